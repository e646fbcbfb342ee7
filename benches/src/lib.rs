//! Benchmarks and raw baselines.
