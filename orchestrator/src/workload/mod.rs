//! What a fleet is offered in open mode: traces of writes and reads.
//!
//! `schedule` draws when bursts are due, `trace` what is written and read then, `csv` reads and writes
//! traces as files. A trace is fixed by scenario, seed and trial, byte for byte on every machine: the
//! draws use no function whose last bit a library may choose. Not here: replaying one.

mod csv;
mod schedule;
mod trace;

pub use csv::{TraceError, read, write};
pub use trace::{Trace, draw, draw_at};

#[cfg(test)]
mod tests;
