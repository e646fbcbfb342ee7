//! From parameters to networks. Not here: the scenario file's types (`shared_types::scenario`).

pub mod generate;
