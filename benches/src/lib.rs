//! Baselines that Slateswarm's own figures are set beside, and the comparison of the two.
//!
//! [`raw`] measures iceoryx2 alone, with nothing of ours on the data path; [`turn_ratio`] alternates
//! such a measurement with the product's own and takes the ratio of each pair; [`summary`] says what
//! of a histogram may be printed. Programs in `src/bin` only parse arguments and print. Not here:
//! what Slateswarm measures about itself, which is the product's job (`slateswarm compare`).

pub mod raw;
pub mod summary;
pub mod turn_ratio;
