//! `raw-capacity`: how many samples a second a bare transport carries between N polling processes.

use benches::raw::RawError;
use benches::raw::capacity::{self, SLICE};
use benches::raw::child::Child;
use benches::raw::command::{self, Workload};
use benches::raw::round::Over;
use clap::Parser;
use std::process::ExitCode;

/// Measures how long 1,000 samples take to arrive at one process while all processes send to all others
/// as fast as they can. The fleet receives PROCESSES times as many in that time.
#[derive(Parser)]
#[command(version)]
// An exchange is a thousand samples here.
#[command(mut_arg("warm_up", |argument| argument.default_value("50")))]
#[command(mut_arg("measured", |argument| argument.default_value("200")))]
struct RawCapacity {
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
    let command = RawCapacity::parse();
    command::conclude(run(&command))
}

fn run(RawCapacity { processes, over, options }: &RawCapacity) -> Result<Option<String>, RawError> {
    if let Some(index) = options.child {
        let child = Child::begin(index, options.placement(), options.area.clone())?;
        capacity::take_part(child, index, *processes, *over, options.exchanges())?;
        return Ok(None);
    }
    let name = match over {
        Over::Iceoryx2 => "raw iceoryx2 capacity, 1,000 samples to one process",
        Over::Datagrams => "Unix datagrams capacity, 1,000 samples to one process",
    };
    let times = capacity::measure(&options.area, *over, *processes)?;
    let workload = Workload { name, processes: *processes, is_blocking: false };
    Ok(Some(options.render_rate(&workload, &times, processes * SLICE)))
}
