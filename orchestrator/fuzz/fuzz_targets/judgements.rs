//! What is made of reports.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| orchestrator::fuzzing::run("judgements", bytes));
