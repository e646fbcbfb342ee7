//! `turn-ratio`: Slateswarm's turn time over a raw round, as the median of alternating pairs.

use benches::raw::command::Format;
use benches::turn_ratio::{Comparison, PAIRS_MIN};
use clap::Parser;
use std::path::PathBuf;
use std::process::ExitCode;

/// Compares Slateswarm's turn time under full replication with a bare iceoryx2 round, both polling.
#[derive(Parser)]
#[command(version)]
struct TurnRatio {
    /// The executable to compare; by default the one beside this program
    #[arg(long)]
    slateswarm: Option<PathBuf>,
    /// Crafts of a turn, processes of a round
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(2..=128))]
    crafts: u32,
    /// Pairs, of which every second one runs in the other order
    #[arg(long, default_value_t = PAIRS_MIN, value_parser = clap::value_parser!(u32).range(i64::from(PAIRS_MIN)..=1_000))]
    pairs: u32,
    /// How the result is printed; progress goes to standard error
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

fn main() -> ExitCode {
    match run(TurnRatio::parse()) {
        Ok(text) => {
            println!("{text}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(command: TurnRatio) -> Result<String, Box<dyn std::error::Error>> {
    if cfg!(debug_assertions) {
        return Err("a ratio of unoptimised programs means nothing; build with --release".into());
    }
    let own = std::env::current_exe()?;
    let comparison = Comparison {
        raw_round: own.with_file_name("raw-round"),
        slateswarm: command.slateswarm.unwrap_or_else(|| own.with_file_name("slateswarm")),
        crafts: command.crafts,
        pairs: command.pairs,
    };
    let outcome = comparison.run(|pair| eprintln!("{pair}"))?;
    Ok(match command.format {
        Format::Json => outcome.to_json().to_string(),
        Format::Text => {
            let pairs = outcome.pairs.iter().map(|pair| format!("{pair}\n")).collect::<String>();
            let (ratio, pairs_run) = (outcome.median_ratio(), outcome.pairs.len());
            format!("{pairs}median ratio of {pairs_run} pairs: {ratio:.3}")
        }
    })
}
