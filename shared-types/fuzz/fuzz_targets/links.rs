//! Links as epochs state them.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| shared_types::fuzzing::run("links", bytes));
