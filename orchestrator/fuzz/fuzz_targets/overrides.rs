//! What users set from outside a scenario's file.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| orchestrator::fuzzing::run("overrides", bytes));
