//! `raw-round`: how long one all-to-all round of a bare transport takes between N polling processes.

use benches::raw::command::{self, Workload};
use benches::raw::round::{self, Over};
use clap::Parser;
use std::process::ExitCode;

/// Measures all-to-all rounds over a bare transport between processes that poll.
#[derive(Parser)]
#[command(version)]
struct RawRound {
    #[command(flatten)]
    fleet: command::Fleet,
}

fn main() -> ExitCode {
    let RawRound { fleet } = RawRound::parse();
    let name = match fleet.over {
        Over::Iceoryx2 => "raw iceoryx2 all-to-all round",
        Over::Datagrams => "Unix datagrams all-to-all round",
    };
    let workload = Workload { name, processes: fleet.processes, is_blocking: false };
    command::conclude(
        fleet.run(round::take_part, round::measure, |options, times| {
            options.render(&workload, times)
        }),
    )
}
