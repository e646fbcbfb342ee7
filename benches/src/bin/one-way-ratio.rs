//! `one-way-ratio`: Slateswarm's delta path beside bare iceoryx2 and Unix datagrams.

use benches::one_way_ratio::{Comparison, TRIPLES_MIN};
use benches::raw::command::Format;
use clap::Parser;
use std::process::ExitCode;

/// Compares one-way latency of Slateswarm's deltas with bare iceoryx2 and Unix datagrams, all polling.
#[derive(Parser)]
#[command(version)]
struct OneWayRatio {
    /// Triples, whose order changes from one to the next
    #[arg(long, default_value_t = TRIPLES_MIN, value_parser = clap::value_parser!(u32).range(i64::from(TRIPLES_MIN)..=1_000))]
    triples: u32,
    /// How the result is printed; progress goes to standard error
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

fn main() -> ExitCode {
    match run(&OneWayRatio::parse()) {
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

fn run(command: &OneWayRatio) -> Result<String, Box<dyn std::error::Error>> {
    if cfg!(debug_assertions) {
        return Err("a ratio of unoptimised programs means nothing; build with --release".into());
    }
    let own = std::env::current_exe()?;
    let comparison = Comparison {
        delta_one_way: own.with_file_name("delta-one-way"),
        raw_one_way: own.with_file_name("raw-one-way"),
        triples: command.triples,
    };
    let outcome = comparison.run(|triple| eprintln!("{triple}"))?;
    Ok(match command.format {
        Format::Json => outcome.to_json().to_string(),
        Format::Text => outcome.to_string(),
    })
}
