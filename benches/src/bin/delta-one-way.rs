//! `delta-one-way`: half a round trip of a change between the boards of two crafts.

use benches::delta::one_way;
use benches::raw::RawError;
use benches::raw::child::Child;
use benches::raw::command::{self, Workload};
use clap::Parser;
use std::process::ExitCode;

/// Measures how long a change takes from a firing at one craft to the board of another (half a round
/// trip), through Slateswarm's own path.
#[derive(Parser)]
#[command(version)]
struct DeltaOneWay {
    #[command(flatten)]
    options: command::Options,
}

fn main() -> ExitCode {
    let command = DeltaOneWay::parse();
    command::conclude(run(&command.options))
}

fn run(options: &command::Options) -> Result<Option<String>, RawError> {
    if let Some(index) = options.child {
        let child = Child::begin(index, options.placement(), options.area.clone())?;
        one_way::take_part(child, index, options.exchanges())?;
        return Ok(None);
    }
    let workload = Workload { name: "Slateswarm delta one way", processes: 2, is_blocking: false };
    Ok(Some(options.render(&workload, &one_way::measure(&options.area)?)))
}
