//! How results are shown: tables, JSON and CSV, from records alone.
//!
//! Nothing here runs a craft or reads a clock; whatever a report says can be said again from the
//! results directory.
