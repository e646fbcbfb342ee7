//! Command lines of crafts.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| orchestrator::fuzzing::run("arguments", bytes));
