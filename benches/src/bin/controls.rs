//! `controls`: how often comparisons name a winner where there is none, and find a slowdown of 20 %.

use benches::comparison::{Asked, Output};
use benches::controls::Controls;
use clap::Parser;
use std::process::ExitCode;

/// Runs comparisons whose answer is known and counts what they say.
#[derive(Parser)]
#[command(version)]
#[command(mut_arg("crafts", |argument| argument.default_value("5")))]
struct Command {
    #[command(flatten)]
    asked: Asked,
    /// Fresh fleets of a run
    #[arg(long, default_value_t = 9, value_parser = clap::value_parser!(u32).range(9..=1_000))]
    blocks: u32,
    /// Runs
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=1_000))]
    runs: u32,
    #[command(flatten)]
    output: Output,
}

fn main() -> ExitCode {
    let Command { asked, blocks, runs, output } = Command::parse();
    output.conclude(|| {
        let (slateswarm, crafts) = (asked.slateswarm()?, asked.crafts);
        Ok(Controls { slateswarm, crafts, blocks, runs }.run(|run| eprintln!("{run}"))?)
    })
}
