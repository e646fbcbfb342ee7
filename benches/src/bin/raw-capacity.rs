//! `raw-capacity`: how many samples a second a bare transport carries between N polling processes.

use benches::raw::capacity::{self, SLICE};
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
    #[command(flatten)]
    fleet: command::Fleet,
}

fn main() -> ExitCode {
    let RawCapacity { fleet } = RawCapacity::parse();
    let processes = fleet.processes;
    let name = match fleet.over {
        Over::Iceoryx2 => "raw iceoryx2 capacity, 1,000 samples to one process",
        Over::Datagrams => "Unix datagrams capacity, 1,000 samples to one process",
    };
    let workload = Workload { name, processes, is_blocking: false };
    command::conclude(fleet.run(capacity::take_part, capacity::measure, |options, times| {
        options.render_rate(&workload, times, processes * SLICE)
    }))
}
