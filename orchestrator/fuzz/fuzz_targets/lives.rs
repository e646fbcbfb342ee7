//! What a craft's process is told.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| orchestrator::fuzzing::run("lives", bytes));
