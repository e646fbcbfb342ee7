//! `raw-one-way`: half a round trip of a bare transport between two processes.

use benches::raw::RawError;
use benches::raw::child::Child;
use benches::raw::command::{self, Workload};
use benches::raw::one_way::{self, Over};
use clap::Parser;
use std::process::ExitCode;

/// Measures one-way latency (half a round trip) of a bare transport between two processes.
#[derive(Parser)]
#[command(version)]
struct RawOneWay {
    /// What the samples travel over
    #[arg(long, value_enum, default_value_t)]
    over: Over,
    #[command(flatten)]
    options: command::Options,
}

fn main() -> ExitCode {
    let command = RawOneWay::parse();
    command::conclude(run(&command))
}

fn run(RawOneWay { over, options }: &RawOneWay) -> Result<Option<String>, RawError> {
    if let Some(index) = options.child {
        let child = Child::begin(index, options.placement(), options.area.clone())?;
        one_way::take_part(child, index, *over, options.exchanges())?;
        return Ok(None);
    }
    let (name, is_blocking) = match over {
        Over::Iceoryx2 => ("raw iceoryx2 one way", false),
        Over::Datagrams => ("Unix datagrams one way", false),
        Over::BlockingDatagrams => ("Unix datagrams one way", true),
    };
    let times = one_way::measure(&options.area, *over)?;
    Ok(Some(options.render(&Workload { name, processes: 2, is_blocking }, &times)))
}
