//! What drifted over a soak: what grew, what does not add up, and what could not be read.
//!
//! Times are shown and not judged: the host may have others to serve.

use super::{Soak, Soaked, flat, ledger};
use std::fmt;

/// Something that is not as it was, or not as it must be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Drift(String);

impl Drift {
    pub(super) const fn new(what: String) -> Self {
        Self(what)
    }
}

impl fmt::Display for Drift {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

/// Everything that drifted; nothing if the soak is passed. A fleet that `may_lose` something is judged by
/// what grew alone.
#[must_use]
pub fn drifts(soak: &Soak, soaked: &Soaked, may_lose: bool) -> Vec<Drift> {
    let mut drifts = flat::growths(&soaked.looks);
    if !may_lose {
        drifts.extend(ledger::lacks(soak, &soaked.run));
    }
    let missing = soaked.run.missing.iter();
    drifts.extend(missing.map(|lack| Drift::new(format!("{}: {}", lack.file, lack.what))));
    drifts
}
