//! Draws a trace: per craft when something is due, and which fact is written or read then.
//!
//! A craft draws from streams of its own, one each for the times of writes and of reads, and for what
//! is written and read then. Another rate therefore stretches the same pattern, another boundary fraction
//! leaves every time as it was, and reads never move a write.

use shared_types::ids::{CraftId, FactId};
use shared_types::knowledge::{BoardView, FleetView};
use shared_types::rng::{Purpose, Stream};
use shared_types::scenario::Scenario;
use shared_types::trace::TraceRecord;

use super::csv::TraceError;
use super::schedule::Schedule;

/// What a fleet is to write and read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Trace {
    /// Per craft its records, ascending by time; of one time in the order in which they are made.
    pub crafts: Vec<Vec<TraceRecord>>,
}

/// Which stream of a craft is drawn from.
#[derive(Clone, Copy)]
enum Part {
    Times = 0,
    Facts = 1,
    ReadTimes = 2,
    ReadFacts = 3,
}

const PARTS: u32 = 4;

/// Draws the trace of `trial`, at the rate and for the time that `[run]` states.
///
/// # Errors
/// If rate or duration is not stated, or a board has no facts of a kind that shall be written.
pub fn draw(scenario: &Scenario, fleet: &FleetView<'_>, trial: u32) -> Result<Trace, TraceError> {
    let rate =
        scenario.run.rate_per_s.ok_or_else(|| TraceError::unstated("run.rate-per-s", 1000))?;
    let duration_s =
        scenario.run.duration_s.ok_or_else(|| TraceError::unstated("run.duration-s", 2))?;
    draw_at(scenario, (rate, duration_s), fleet, trial)
}

/// As [`draw`], at so many writes per second for so many seconds.
///
/// # Errors
/// If a board has no facts of a kind that shall be written.
pub fn draw_at(
    scenario: &Scenario,
    (rate, duration_s): (f64, f64),
    fleet: &FleetView<'_>,
    trial: u32,
) -> Result<Trace, TraceError> {
    let settings = &scenario.trace;
    let crafts = f64::from(fleet.craft_count());
    let bursts_per_s = rate / crafts / f64::from(settings.burst);
    let mut trace = Trace::default();
    for (board, craft) in fleet.boards.iter().zip(0..) {
        let stream = |part: Part| {
            Stream::new(scenario.run.seed, trial, Purpose::Trace, craft * PARTS + part as u32)
        };
        let choice = Choice::new(board, scenario, CraftId(craft))?;
        let mut facts = stream(Part::Facts);
        let mut records = Vec::new();
        for at_ns in Schedule::new(stream(Part::Times), bursts_per_s, duration_s) {
            for _ in 0..settings.burst {
                let fact = choice.draw(&mut facts);
                records.push(TraceRecord::write(at_ns, fact, facts.below(2) == 0));
            }
        }
        let mut facts = stream(Part::ReadFacts);
        let reads_per_s = settings.reads_per_s / crafts;
        for at_ns in Schedule::new(stream(Part::ReadTimes), reads_per_s, duration_s) {
            records.push(TraceRecord::read(at_ns, FactId(facts.below(board.fact_count))));
        }
        records.sort_by_key(|record| record.at_ns);
        trace.crafts.push(records);
    }
    Ok(trace)
}

/// The facts of one board that may be written.
struct Choice {
    /// Chance of a boundary fact; `None` draws from all facts alike.
    boundary_fraction: Option<f64>,
    fact_count: u32,
    boundary: Vec<FactId>,
    private: Vec<FactId>,
}

impl Choice {
    fn new(board: &BoardView<'_>, scenario: &Scenario, craft: CraftId) -> Result<Self, TraceError> {
        let settings = &scenario.trace;
        let facts = || (0..board.fact_count).map(FactId);
        let is_wanted = |fact: FactId| {
            settings.sharers.is_none_or(|sharers| board.targets(fact).len() == sharers as usize)
        };
        let choice = Self {
            boundary_fraction: settings.boundary_fraction,
            fact_count: board.fact_count,
            boundary: facts().filter(|&fact| board.is_boundary(fact) && is_wanted(fact)).collect(),
            private: facts().filter(|&fact| !board.is_boundary(fact)).collect(),
        };
        let lacks =
            |kind: &str, remedy: &str| Err(TraceError::nothing_to_write(craft, kind, remedy));
        match choice.boundary_fraction {
            Some(share) if share > 0.0 && choice.boundary.is_empty() => match settings.sharers {
                Some(sharers) => lacks(
                    &format!("boundary fact with {sharers} other sharers"),
                    "change `trace.sharers`, or what crafts share",
                ),
                None => {
                    lacks("boundary fact", "set `trace.boundary-fraction` to 0, or share facts")
                }
            },
            Some(share) if share < 1.0 && choice.private.is_empty() => {
                lacks("fact of its own", "set `trace.boundary-fraction` to 1")
            }
            _ => Ok(choice),
        }
    }

    fn draw(&self, stream: &mut Stream) -> FactId {
        let one_of = |facts: &[FactId], stream: &mut Stream| {
            facts[stream.below(FactId::from_index(facts.len()).0) as usize]
        };
        match self.boundary_fraction {
            None => FactId(stream.below(self.fact_count)),
            Some(share) if stream.unit() < share => one_of(&self.boundary, stream),
            Some(_) => one_of(&self.private, stream),
        }
    }
}
