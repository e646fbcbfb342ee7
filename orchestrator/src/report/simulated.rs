//! What campaigns on the virtual clock showed: which laws held, and what lossy links cost.

use super::table::{Table, column, exact, short, wrap};
use super::{Look, Report};
use serde::Serialize;

/// One strategy in a campaign.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StrategyRow {
    /// Its name.
    pub strategy: &'static str,
    /// Fleets played.
    pub seeds: u64,
    /// Fleets that broke a law.
    pub broken: u64,
    /// Trials of lockstep that came to their end as without faults.
    pub trials: u64,
    /// Processes killed.
    pub kills: u64,
    /// Samples that the links lost.
    pub lost: u64,
    /// Samples repeated.
    pub repeats: u64,
    /// Changes learnt from states.
    pub learnt: u64,
    /// Samples that were given up and healed by a state.
    pub given_up: u64,
    /// Fleets played a second of real time.
    pub seeds_per_s: f64,
}

/// A fleet that broke a law.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Broken {
    /// The strategy.
    pub strategy: &'static str,
    /// The seed.
    pub seed: u64,
    /// The law, and how it was broken.
    pub law: String,
    /// Everything that befell the fleet.
    pub faults: Vec<String>,
    /// What of it suffices.
    pub minimal: Vec<String>,
}

/// A campaign.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SimulatedCampaign {
    /// The first seed.
    pub first_seed: u64,
    /// Whether its fleets play trials in lockstep, in place of traces.
    pub is_lockstep: bool,
    /// By strategy.
    pub strategies: Vec<StrategyRow>,
    /// The first fleets that broke a law.
    pub broken: Vec<Broken>,
}

impl Report for SimulatedCampaign {
    fn table(&self, look: Look) -> String {
        let mut table = Table::new(&[
            column("", "strategy"),
            column("", "fleets"),
            column("", "broken"),
            column("", "kills"),
            column("samples", "lost"),
            column("samples", "repeated"),
            if self.is_lockstep { column("", "trials") } else { column("changes", "learnt") },
            column("", "a second"),
        ]);
        for row in &self.strategies {
            let count = |count: u64| count.to_string();
            table.row(vec![
                row.strategy.to_owned(),
                count(row.seeds),
                count(row.broken),
                count(row.kills),
                count(row.lost),
                count(row.repeats),
                count(if self.is_lockstep { row.trials } else { row.learnt }),
                exact(Some(row.seeds_per_s), 0),
            ]);
        }
        let mut text = table.render(look.colour);
        for broken in &self.broken {
            text += &format!("\n{}, seed {}\n", broken.strategy, broken.seed);
            text += &wrap("law    ", &broken.law);
            for (head, faults) in [("all", &broken.faults), ("enough", &broken.minimal)] {
                for (number, fault) in faults.iter().enumerate() {
                    let head = if number == 0 { head } else { "" };
                    text += &format!("{head:<7}{fault}\n");
                }
            }
            text += &wrap(
                "see    ",
                &format!(
                    "simulate --replay{} --strategy {} --seed {}",
                    if self.is_lockstep { " --lockstep" } else { "" },
                    broken.strategy,
                    broken.seed
                ),
            );
        }
        text
    }

    fn json(&self) -> String {
        let text = serde_json::to_string_pretty(self).expect("invariant: documents are plain data");
        text + "\n"
    }

    fn csv(&self) -> String {
        csv_of(&self.strategies)
    }
}

/// One strategy at one loss.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LossRow {
    /// Its name.
    pub strategy: &'static str,
    /// Samples lost, percent.
    pub loss_percent: f64,
    /// Changes that boards of others needed.
    pub needed: u64,
    /// Those that came as deltas or replies; what is missing was told as state.
    pub delivered: u64,
    /// Time to knowledge of those, us of the virtual clock; absent where fewer than ten values lie
    /// beyond it.
    pub p50_us: Option<f64>,
    /// The same, 99th percentile.
    pub p99_us: Option<f64>,
    /// Samples sent for the first time.
    pub first_samples: u64,
    /// Their bytes.
    pub first_bytes: u64,
    /// Repeats, receipts, digests and states.
    pub further_samples: u64,
    /// Their bytes.
    pub further_bytes: u64,
}

/// What lossy links cost.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Losses {
    /// Fleets behind each row.
    pub seeds: u64,
    /// By strategy and loss.
    pub rows: Vec<LossRow>,
}

impl Report for Losses {
    fn table(&self, look: Look) -> String {
        let mut table = Table::new(&[
            column("", "strategy"),
            column("", "loss %"),
            column("changes", "needed"),
            column("changes", "delivered"),
            column("knowledge, us", "p50"),
            column("knowledge, us", "p99"),
            column("samples", "first"),
            column("samples", "further"),
            column("bytes", "further"),
        ]);
        for row in &self.rows {
            table.row(vec![
                row.strategy.to_owned(),
                exact(Some(row.loss_percent), 0),
                row.needed.to_string(),
                row.delivered.to_string(),
                short(row.p50_us, 3),
                short(row.p99_us, 3),
                row.first_samples.to_string(),
                row.further_samples.to_string(),
                row.further_bytes.to_string(),
            ]);
        }
        let legend = format!(
            "{} fleets a row on the virtual clock, samples under way up to 20 us, patience 500 us. Every \
             change reached every board that shares its fact, or the run would have ended with exit code \
             1. Further: repeats, receipts, and the states that are asked for at the end.",
            self.seeds
        );
        table.render(look.colour) + "\n" + &wrap("", &legend)
    }

    fn json(&self) -> String {
        let text = serde_json::to_string_pretty(self).expect("invariant: documents are plain data");
        text + "\n"
    }

    fn csv(&self) -> String {
        csv_of(&self.rows)
    }
}

fn csv_of(rows: &[impl Serialize]) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row).expect("invariant: rows are plain data");
    }
    let bytes = writer.into_inner().expect("invariant: memory takes every row");
    String::from_utf8(bytes).expect("invariant: rows are made of text")
}
