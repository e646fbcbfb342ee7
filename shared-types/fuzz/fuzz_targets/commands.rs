//! Commands, turn reports, tallies.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| shared_types::fuzzing::run("commands", bytes));
