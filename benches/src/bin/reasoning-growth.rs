//! `reasoning-growth`: how the cost of pruning and planning grows with a network.

use benches::growth::{measure, picture, table};
use clap::Parser;
use std::path::PathBuf;
use std::process::ExitCode;

/// Measures pruners and solvers on random networks from 10^3 edges on, and prints a table.
#[derive(Parser)]
#[command(version)]
struct ReasoningGrowth {
    /// Largest network: ten to the power of so many edges
    #[arg(long, default_value_t = 7, value_parser = clap::value_parser!(u32).range(3..=7))]
    largest: u32,
    /// Times of which the shortest counts
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1_000))]
    repeats: u32,
    /// Writes the picture here
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
}

fn main() -> ExitCode {
    match run(&ReasoningGrowth::parse()) {
        Ok(text) => {
            print!("{text}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(command: &ReasoningGrowth) -> Result<String, Box<dyn std::error::Error>> {
    if cfg!(debug_assertions) {
        return Err("times of an unoptimised program mean nothing; build with --release".into());
    }
    let rows: Vec<_> = (3..=command.largest)
        .map(|power| {
            eprintln!("10^{power} edges");
            measure(10_u64.pow(power), command.repeats)
        })
        .collect();
    if let (Some(path), Some(picture)) = (&command.svg, picture(&rows)) {
        std::fs::write(path, picture.document())
            .map_err(|error| format!("cannot write `{}`: {error}", path.display()))?;
    }
    Ok(table(&rows))
}
