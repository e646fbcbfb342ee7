//! Records and documents of a results directory.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| orchestrator::fuzzing::run("documents", bytes));
