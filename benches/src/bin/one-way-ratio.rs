//! `one-way-ratio`: Slateswarm's delta path beside bare iceoryx2 and Unix datagrams.

use benches::comparison::{Output, beside};
use benches::one_way_ratio::{Comparison, TRIPLES_MIN};
use clap::Parser;
use std::process::ExitCode;

/// Compares one-way latency of Slateswarm's deltas with bare iceoryx2 and Unix datagrams, all polling.
#[derive(Parser)]
#[command(version)]
struct OneWayRatio {
    /// Triples, whose order changes from one to the next
    #[arg(long, default_value_t = TRIPLES_MIN, value_parser = clap::value_parser!(u32).range(i64::from(TRIPLES_MIN)..=1_000))]
    triples: u32,
    #[command(flatten)]
    output: Output,
}

fn main() -> ExitCode {
    let OneWayRatio { triples, output } = OneWayRatio::parse();
    output.conclude(|| {
        let (delta_one_way, raw_one_way) = (beside("delta-one-way")?, beside("raw-one-way")?);
        let comparison = Comparison { delta_one_way, raw_one_way, triples };
        Ok(comparison.run(|triple| eprintln!("{triple}"))?)
    })
}
