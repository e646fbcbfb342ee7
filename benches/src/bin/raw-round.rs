//! `raw-round`: how long one all-to-all round of a bare transport takes between N polling processes.

use benches::raw::RawError;
use benches::raw::child::Child;
use benches::raw::command::{self, Workload};
use benches::raw::round::{self, Over};
use clap::Parser;
use std::process::ExitCode;

/// Measures all-to-all rounds over a bare transport between processes that poll.
#[derive(Parser)]
#[command(version)]
struct RawRound {
    /// How many processes take part
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(2..=128))]
    processes: u32,
    /// What the samples travel over
    #[arg(long, value_enum, default_value_t)]
    over: Over,
    #[command(flatten)]
    options: command::Options,
}

fn main() -> ExitCode {
    let command = RawRound::parse();
    command::conclude(run(&command))
}

fn run(RawRound { processes, over, options }: &RawRound) -> Result<Option<String>, RawError> {
    if let Some(index) = options.child {
        let child = Child::begin(index, options.placement(), options.area.clone())?;
        round::take_part(child, index, *processes, *over, options.exchanges())?;
        return Ok(None);
    }
    let name = match over {
        Over::Iceoryx2 => "raw iceoryx2 all-to-all round",
        Over::Datagrams => "Unix datagrams all-to-all round",
    };
    let times = round::measure(&options.area, *over, *processes)?;
    let workload = Workload { name, processes: *processes, is_blocking: false };
    Ok(Some(options.render(&workload, &times)))
}
