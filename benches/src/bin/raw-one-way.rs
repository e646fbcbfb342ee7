//! `raw-one-way`: half a round trip of raw iceoryx2 between two polling processes.

use benches::raw::child::Child;
use benches::raw::one_way::{self, BACK, THERE};
use benches::raw::{RawError, command, fleet};
use clap::Parser;
use std::process::ExitCode;

/// Measures one-way latency (half a round trip) over raw iceoryx2 between two processes that poll.
#[derive(Parser)]
#[command(version)]
struct RawOneWay {
    #[command(flatten)]
    options: command::Options,
}

fn main() -> ExitCode {
    let command = RawOneWay::parse();
    command::conclude(run(&command.options))
}

fn run(options: &command::Options) -> Result<Option<String>, RawError> {
    if let Some(index) = options.child {
        let child = Child::begin(index, options.placement(), options.area.clone())?;
        one_way::take_part(child, index, options.warm_up, options.measured)?;
        return Ok(None);
    }
    let times = fleet::measure(&options.area, 2, &[THERE, BACK])?;
    Ok(Some(options.render("raw iceoryx2 one way", 2, &times)))
}
