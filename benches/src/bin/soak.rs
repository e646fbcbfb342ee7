//! `soak`: one fleet under one load for long, whose crafts die; says what drifted.

use benches::soak::{Soak, table, verdict};
use clap::Parser;
use std::path::PathBuf;
use std::process::ExitCode;

/// Keeps a fleet under load while crafts are killed and stopped and links lose samples, watches memory,
/// descriptors and shared memory, and fails on drift.
#[derive(Parser)]
#[command(version)]
struct Command {
    /// How long, min
    #[arg(default_value_t = 1.0, value_parser = parse_minutes)]
    minutes: f64,
    /// The executable to soak; by default the one beside this program
    #[arg(long)]
    slateswarm: Option<PathBuf>,
    /// Crafts of the fleet
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(2..=128))]
    crafts: u32,
    /// Writes of the fleet per second
    #[arg(long, default_value_t = 2_000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    rate: u32,
    /// How changes are replicated
    #[arg(long, default_value = "boundary")]
    strategy: String,
    /// Leaves the fleet in peace: then every count must be what the trace demands
    #[arg(long)]
    without_faults: bool,
    /// A further key of the scenario; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Judges only what grew: for faults of your own, by which something may be lost
    #[arg(long)]
    may_lose: bool,
    /// Where the results go
    #[arg(long, default_value = "runs")]
    out: PathBuf,
}

fn parse_minutes(text: &str) -> Result<f64, String> {
    let minutes: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if (0.1..=10_000.0).contains(&minutes) { Ok(minutes) } else { Err("0.1 to 10000".to_owned()) }
}

fn main() -> ExitCode {
    let command = Command::parse();
    match run(&command) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

/// Says whether nothing drifted.
fn run(command: &Command) -> Result<bool, Box<dyn std::error::Error>> {
    let beside = || Ok::<_, std::io::Error>(std::env::current_exe()?.with_file_name("slateswarm"));
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked bounds")]
    let seconds = (command.minutes * 60.0).round() as u32;
    let soak = Soak {
        slateswarm: command.slateswarm.clone().map_or_else(beside, Ok)?,
        crafts: command.crafts,
        seconds,
        rate_per_s: command.rate,
        strategy: command.strategy.clone(),
        has_faults: !command.without_faults,
        set: command.set.clone(),
        out: command.out.clone(),
    };
    let (crafts, rate, strategy) = (soak.crafts, soak.rate_per_s, &soak.strategy);
    println!(
        "soak: {crafts} crafts, {strategy}, {rate} writes/s for {seconds} s in {} parts{}",
        soak.parts(),
        if soak.has_faults { ", each with deaths, a pause and losses" } else { "" }
    );
    let soaked = soak.run()?;
    println!("{}", table::parts(&soaked));
    if soak.has_faults {
        println!("{}\n{}", table::repaired(&soaked), table::successors(&soaked));
    }
    println!("{}", table::resources(&soaked));
    println!("results   {}", soaked.run.directory.display());
    let drifts = verdict::drifts(&soak, &soaked, command.may_lose);
    for drift in &drifts {
        println!("drift     {drift}");
    }
    let verdict = if drifts.is_empty() { "flat" } else { "DRIFT" };
    println!("verdict   {verdict}, by {} looks at {crafts} crafts", soaked.looks.len());
    Ok(drifts.is_empty())
}
