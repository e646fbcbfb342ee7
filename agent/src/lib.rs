//! The craft.
