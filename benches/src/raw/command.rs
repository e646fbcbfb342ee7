//! What the raw programs have in common on the command line: options, and how a result is printed.

use super::RawError;
use super::area::AreaName;
use super::child::{Child, Placement};
use super::port::PAYLOAD_BYTES;
use super::round::Over;
use crate::summary::Summary;
use clap::{Args, ValueEnum};
use hdrhistogram::Histogram;
use serde_json::{Value, json};
use std::process::ExitCode;

/// How the result is printed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Two lines for people.
    #[default]
    Text,
    /// One object.
    Json,
}

/// Options of every raw program.
#[derive(Clone, Debug, Args)]
pub struct Options {
    /// How many cores the processes share (the first ones that this process may use)
    #[arg(long, default_value_t = 2, value_parser = parse_cores)]
    pub cores: usize,
    /// Let processes move among those cores; by default process i stays on core i modulo CORES
    #[arg(long)]
    pub unpinned: bool,
    /// Exchanges before the first one that is recorded
    #[arg(long, default_value_t = 10_000, value_parser = clap::value_parser!(u32).range(..=1_000_000_000))]
    pub warm_up: u32,
    /// Exchanges that are recorded
    #[arg(long, default_value_t = 20_000, value_parser = clap::value_parser!(u32).range(1..=1_000_000_000))]
    pub measured: u32,
    /// How the result is printed
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
    /// Where in shared memory; measurements in one area wait for each other
    #[arg(long, default_value_t = AreaName::of_this_user())]
    pub area: AreaName,
    /// Set for the processes that the program starts
    #[arg(long, hide = true)]
    pub child: Option<u32>,
}

/// At least one core, at most as many as there are.
fn parse_cores(text: &str) -> Result<usize, String> {
    let cores: usize = text.parse().map_err(|_| "not a number".to_owned())?;
    let available = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    if (1..=available).contains(&cores) {
        Ok(cores)
    } else {
        Err(format!("this process may use 1 to {available} cores"))
    }
}

/// How many exchanges a measurement makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Exchanges {
    /// Not recorded.
    pub warm_up: u32,
    /// Recorded.
    pub measured: u32,
}

/// What a figure was measured on, for its output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Workload<'a> {
    /// What it is called.
    pub name: &'a str,
    /// How many processes take part.
    pub processes: u32,
    /// Whether processes sleep in the kernel until something arrives; else they poll.
    pub is_blocking: bool,
}

impl Options {
    /// How many exchanges are made.
    #[must_use]
    pub const fn exchanges(&self) -> Exchanges {
        Exchanges { warm_up: self.warm_up, measured: self.measured }
    }

    /// Which cores the processes use.
    #[must_use]
    pub const fn placement(&self) -> Placement {
        Placement { cores: self.cores, is_pinned: !self.unpinned }
    }

    /// The result of `workload` whose `samples` samples took one of `times`, as [`Self::render`] with
    /// the samples a second at the median time.
    #[must_use]
    pub fn render_rate(
        &self,
        workload: &Workload<'_>,
        times: &Histogram<u64>,
        samples: u32,
    ) -> String {
        let rate = Summary::of(times).rate_per_s(samples);
        let result = self.render(workload, times);
        match self.format {
            Format::Text => {
                let rate = rate.map_or_else(|| "-".to_owned(), |rate| format!("{rate:.0}"));
                format!("{result}\n{rate} samples a second in the fleet, at the median")
            }
            Format::Json => {
                let mut result: Value =
                    serde_json::from_str(&result).expect("invariant: a rendered result is JSON");
                result["samples_per_s"] = json!(rate);
                result.to_string()
            }
        }
    }

    /// The result of `workload` as text or JSON, without a line end.
    #[must_use]
    pub fn render(&self, workload: &Workload<'_>, times: &Histogram<u64>) -> String {
        let Workload { name, processes, is_blocking } = *workload;
        let wake = if is_blocking { "block" } else { "poll" };
        let waits = if is_blocking { "blocking" } else { "polling with sched_yield" };
        let summary = Summary::of(times);
        let placement = if self.unpinned { "unpinned" } else { "pinned" };
        match self.format {
            Format::Text => format!(
                "{name}: {processes} processes on {} cores ({placement}), {PAYLOAD_BYTES} B, {waits}, \
                 {} warm-up\n{summary}",
                self.cores, self.warm_up,
            ),
            Format::Json => json!({
                "workload": name,
                "wake": wake,
                "processes": processes,
                "cores": self.cores,
                "placement": placement,
                "payload_bytes": PAYLOAD_BYTES,
                "warm_up": self.warm_up,
                "time": summary.to_json(),
            })
            .to_string(),
        }
    }
}

/// Options of a raw program in which any number of processes talk to all others.
#[derive(Clone, Debug, Args)]
pub struct Fleet {
    /// How many processes take part
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(2..=128))]
    pub processes: u32,
    /// What the samples travel over
    #[arg(long, value_enum, default_value_t)]
    pub over: Over,
    #[command(flatten)]
    options: Options,
}

/// What a child of such a program does.
type TakePart = fn(Child, u32, u32, Over, Exchanges) -> Result<(), RawError>;

/// What its parent does.
type Measure = fn(&AreaName, Over, u32) -> Result<Histogram<u64>, RawError>;

impl Fleet {
    /// Takes part, as a child; measures and renders the result, as the parent.
    ///
    /// # Errors
    /// If a process, a signal or the system ends the measurement.
    pub fn run(
        &self,
        take_part: TakePart,
        measure: Measure,
        render: impl FnOnce(&Options, &Histogram<u64>) -> String,
    ) -> Result<Option<String>, RawError> {
        let Self { processes, over, options } = self;
        let Some(index) = options.child else {
            return Ok(Some(render(options, &measure(&options.area, *over, *processes)?)));
        };
        let child = Child::begin(index, options.placement(), options.area.clone())?;
        take_part(child, index, *processes, *over, options.exchanges()).map(|()| None)
    }
}

/// Ends a raw program: a child silently, the parent with its result, both with their error.
#[must_use]
pub fn conclude(result: Result<Option<String>, RawError>) -> ExitCode {
    match result {
        Ok(text) => {
            text.iter().for_each(|text| println!("{text}"));
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}
