//! Makes a failing case small: delta debugging over its faults (Zeller and Hildebrandt 2002,
//! "Simplifying and isolating failure-inducing input"), then shorter faults.

use super::{Case, Fault};

/// Times that the length of a fault is halved at most.
const HALVINGS: u32 = 8;

impl Case {
    /// Faults with which `fails` still holds, such that it holds with none of them left out, and each as
    /// short as halving makes it.
    pub fn shrink(&self, mut fails: impl FnMut(&Self) -> bool) -> Vec<Fault> {
        let mut case = self.clone();
        let mut fails_with = |faults: &[Fault]| {
            case.faults = faults.to_vec();
            fails(&case)
        };
        let mut faults = without_idle_parts(self.faults.clone(), &mut fails_with);
        for index in 0..faults.len() {
            for _ in 0..HALVINGS {
                let mut shorter = faults.clone();
                if shorter[index].lasts_ns == Fault::FOR_EVER {
                    break;
                }
                shorter[index].lasts_ns /= 2;
                if !fails_with(&shorter) {
                    break;
                }
                faults = shorter;
            }
        }
        faults
    }
}

/// Leaves out parts of `faults`, large ones first, as long as `fails` holds.
fn without_idle_parts(
    mut faults: Vec<Fault>,
    fails: &mut impl FnMut(&[Fault]) -> bool,
) -> Vec<Fault> {
    let mut part = faults.len().div_ceil(2).max(1);
    loop {
        let before = faults.len();
        let mut start = 0;
        while start < faults.len() {
            let end = (start + part).min(faults.len());
            let rest = [&faults[..start], &faults[end..]].concat();
            if fails(&rest) {
                faults = rest;
            } else {
                start = end;
            }
        }
        if part == 1 && faults.len() == before {
            return faults;
        }
        part = part.div_ceil(2);
    }
}
