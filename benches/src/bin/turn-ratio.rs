//! `turn-ratio`: Slateswarm's turn time over a raw round, as the median of alternating pairs.

use benches::comparison::{Asked, Output, beside};
use benches::turn_ratio::{Comparison, PAIRS_MIN};
use clap::Parser;
use std::process::ExitCode;

/// Compares Slateswarm's turn time under full replication with a bare iceoryx2 round, both polling.
#[derive(Parser)]
#[command(version)]
struct TurnRatio {
    #[command(flatten)]
    asked: Asked,
    /// Pairs, of which every second one runs in the other order
    #[arg(long, default_value_t = PAIRS_MIN, value_parser = clap::value_parser!(u32).range(i64::from(PAIRS_MIN)..=1_000))]
    pairs: u32,
    #[command(flatten)]
    output: Output,
}

fn main() -> ExitCode {
    let TurnRatio { asked, pairs, output } = TurnRatio::parse();
    output.conclude(|| {
        let (raw_round, slateswarm, crafts) =
            (beside("raw-round")?, asked.slateswarm()?, asked.crafts);
        let comparison = Comparison { raw_round, slateswarm, crafts, pairs };
        Ok(comparison.run(|pair| eprintln!("{pair}"))?)
    })
}
