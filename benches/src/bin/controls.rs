//! `controls`: how often comparisons name a winner where there is none, and find a slowdown of 20 %.

use benches::controls::Controls;
use benches::raw::command::Format;
use clap::Parser;
use std::path::PathBuf;
use std::process::ExitCode;

/// Runs comparisons whose answer is known and counts what they say.
#[derive(Parser)]
#[command(version)]
struct Command {
    /// The executable to ask; by default the one beside this program
    #[arg(long)]
    slateswarm: Option<PathBuf>,
    /// Crafts of a fleet
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(2..=128))]
    crafts: u32,
    /// Fresh fleets of a run
    #[arg(long, default_value_t = 9, value_parser = clap::value_parser!(u32).range(9..=1_000))]
    blocks: u32,
    /// Runs
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=1_000))]
    runs: u32,
    /// How the result is printed; progress goes to standard error
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

fn main() -> ExitCode {
    match run(Command::parse()) {
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

fn run(command: Command) -> Result<String, Box<dyn std::error::Error>> {
    if cfg!(debug_assertions) {
        return Err("times of unoptimised programs mean nothing; build with --release".into());
    }
    let own = std::env::current_exe()?;
    let Command { slateswarm, crafts, blocks, runs, format } = command;
    let slateswarm = slateswarm.unwrap_or_else(|| own.with_file_name("slateswarm"));
    let outcome = Controls { slateswarm, crafts, blocks, runs }.run(|run| eprintln!("{run}"))?;
    Ok(match format {
        Format::Json => outcome.to_json().to_string(),
        Format::Text => outcome.to_string(),
    })
}
