//! The scenario file's types.
