//! `raw-round`: how long one all-to-all round of raw iceoryx2 takes between N polling processes.

use benches::raw::child::Child;
use benches::raw::{RawError, command, fleet, round};
use clap::Parser;
use std::process::ExitCode;

/// Measures all-to-all rounds over raw iceoryx2 between processes that poll.
#[derive(Parser)]
#[command(version)]
struct RawRound {
    /// How many processes take part
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(2..=128))]
    processes: u32,
    #[command(flatten)]
    options: command::Options,
}

fn main() -> ExitCode {
    let command = RawRound::parse();
    command::conclude(run(&command))
}

fn run(RawRound { processes, options }: &RawRound) -> Result<Option<String>, RawError> {
    if let Some(index) = options.child {
        let child = Child::begin(index, options.placement(), options.area.clone())?;
        round::take_part(child, index, *processes, options.warm_up, options.measured)?;
        return Ok(None);
    }
    let times =
        fleet::measure(&options.area, *processes as usize, &[round::service(*processes as usize)])?;
    Ok(Some(options.render("raw iceoryx2 all-to-all round", *processes, &times)))
}
