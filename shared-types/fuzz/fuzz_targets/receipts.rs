//! What was received and what is missing.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| shared_types::fuzzing::run("receipts", bytes));
