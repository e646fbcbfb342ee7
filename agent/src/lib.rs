//! The craft.

#[cfg(feature = "shell")]
pub mod process;
