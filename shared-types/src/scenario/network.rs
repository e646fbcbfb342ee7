//! `[network]`: parameters of the generated networks.
//!
//! The defaults are the published experiment (dissertation chapter VII). Not here: how a network is
//! drawn from them (orchestrator, `scenario/generate.rs`), and missions that are written out.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[network]`: every board is drawn at random with these parameters, anew in each trial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct GeneratedNetwork {
    /// Facts of one board; default 1000.
    pub facts: u32,
    /// Rules of one board; default 1000.
    pub rules: u32,
    /// Actions of one board; default 1000.
    pub actions: u32,
    /// Facts of one board that are asserted at the start, none of them final; default 400.
    pub initial: u32,
    /// Final facts of one board; default 100.
    pub finals: u32,
    /// Fewest premises of a rule ("associations" in the source); default 1.
    pub premises_min: u32,
    /// Most premises of a rule; default 3.
    pub premises_max: u32,
    /// How facts of different boards are linked; default `directed-slots-per-pair`.
    pub linking: LinkingModel,
    /// Links drawn for each unordered pair of linked boards, under `per-board` for each board in all;
    /// default 300. Unused by `shared`.
    pub links: u32,
    /// Boards that one board is linked to under `sparse`, tree neighbours first; default 4. Unused by
    /// the other models.
    pub degree: u32,
    /// Share of a board's facts that are boundary facts under `shared`, 0 to 1; default 0.1. Unused by
    /// the other models, where it follows from `links`.
    pub boundary_fraction: f64,
    /// Other crafts that share each boundary fact under `shared`: the copies of one change; default 1.
    /// Unused by the other models.
    pub sharers: u32,
}

impl Default for GeneratedNetwork {
    fn default() -> Self {
        Self {
            facts: 1000,
            rules: 1000,
            actions: 1000,
            initial: 400,
            finals: 100,
            premises_min: 1,
            premises_max: 3,
            linking: LinkingModel::default(),
            links: 300,
            degree: 4,
            boundary_fraction: 0.1,
            sharers: 1,
        }
    }
}

/// How facts of different boards are linked in a generated network.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LinkingModel {
    /// For each unordered pair of boards, `links` times a random fact of each; every fact has one
    /// link slot, and a later link overwrites what is there. The published experiment.
    #[default]
    DirectedSlotsPerPair,
    /// `links` such draws per board in all, each with a random other board: the source's sentence
    /// taken literally, which its tables reject.
    PerBoard,
    /// As `directed-slots-per-pair`, but each board is linked to `degree` neighbours only. For fleets
    /// larger than 128.
    Sparse,
    /// Symmetric boundary facts, as missions have them: `boundary-fraction` of every board's facts,
    /// each of them one fact of exactly `sharers` + 1 boards. The two are the axes along which
    /// strategies change places.
    Shared,
}

impl LinkingModel {
    /// The name in scenarios and in the output.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::DirectedSlotsPerPair => "directed-slots-per-pair",
            Self::PerBoard => "per-board",
            Self::Sparse => "sparse",
            Self::Shared => "shared",
        }
    }

    /// Whether every pair of boards is linked, so that the work grows with the square of the fleet.
    #[must_use]
    pub const fn links_every_pair(self) -> bool {
        matches!(self, Self::DirectedSlotsPerPair)
    }
}
