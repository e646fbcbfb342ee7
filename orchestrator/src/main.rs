//! The command `slateswarm`.
fn main() {}
