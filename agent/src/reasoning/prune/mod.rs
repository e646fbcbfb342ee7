//! Finds what can be left out of a network.
//!
//! Three ways. [`published`] is the one that reproduces the remaining counts of the published tables
//! (Straub 2016, chapter V): found by fitting them, it differs from the text. [`literal`] is what the
//! text says. [`sound`] is for use: it keeps everything that some plan to a goal can need, and is told
//! of changes instead of starting afresh. Not here: when a craft prunes.

pub mod literal;
pub mod published;
pub mod reference;
pub mod sound;

#[cfg(test)]
mod tests;

use super::Kept;

/// Which kinds of elements are pruned; Table 20 switches one off at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kinds {
    /// Facts that no rule reads, or that nothing can assert.
    pub facts: bool,
    /// Rules that trigger nothing.
    pub rules: bool,
    /// Actions that assert nothing.
    pub actions: bool,
}

impl Kinds {
    /// All three.
    pub const ALL: Self = Self { facts: true, rules: true, actions: true };
}

/// What a pruner of passes left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pruned {
    /// What stays.
    pub kept: Kept,
    /// Passes over the network, the last of which changed nothing.
    pub passes: u32,
}
