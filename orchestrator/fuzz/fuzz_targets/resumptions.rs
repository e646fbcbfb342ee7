//! Results directories that are gone on with.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| orchestrator::fuzzing::run("resumptions", bytes));
