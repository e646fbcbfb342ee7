//! Archives of what a trial counted.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| shared_types::fuzzing::run("reports", bytes));
