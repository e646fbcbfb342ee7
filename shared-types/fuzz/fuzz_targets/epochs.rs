//! Archives that begin an epoch.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| shared_types::fuzzing::run("epochs", bytes));
