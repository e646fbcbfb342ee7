//! Baselines that Slateswarm's own figures are set beside, and the comparison of the two.
//!
//! [`raw`] measures transports alone, with nothing of ours on the data path; [`delta`] measures the
//! product's delta path in the same protocol; [`turn_ratio`] and [`one_way_ratio`] alternate such
//! measurements with the product's own and take the ratios of each pair or triple; [`controls`] asks how
//! often comparisons of the product find what is there and nothing else; [`soak`] keeps a fleet under load
//! and asks what drifted; [`growth`] how pruning and planning grow with a network; [`summary`] says
//! what of a histogram may be printed. Programs in `src/bin` only parse arguments and print. Not here:
//! what Slateswarm measures about itself, which is the product's job (`slateswarm compare`).

pub mod comparison;
pub mod controls;
pub mod delta;
pub mod growth;
pub mod one_way_ratio;
pub mod program;
pub mod raw;
pub mod soak;
pub mod summary;
pub mod turn_ratio;
