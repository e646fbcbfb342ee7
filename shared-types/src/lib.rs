//! The contract between Slateswarm's processes: the vocabulary and how it travels.
//!
//! Start with [`knowledge`] (facts, versions, networks), then [`wire`] (headers and records) and
//! [`transport`] (the port that every craft sends and receives through, with its adapters). Nothing
//! here decides anything: reasoning and strategies live in the `agent` crate.

#[cfg(not(all(target_os = "linux", target_pointer_width = "64", target_endian = "little")))]
compile_error!("Slateswarm runs on 64-bit little-endian Linux, 5.9 or newer");

#[cfg(any(test, fuzzing))]
pub mod fuzzing;
pub mod ids;
pub mod knowledge;
pub mod limits;
pub mod reasoning;
pub mod rng;
pub mod scenario;
pub mod time;
pub mod trace;
pub mod transport;
pub mod wire;
