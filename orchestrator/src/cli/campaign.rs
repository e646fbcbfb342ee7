//! What `campaign` may be told.

use clap::{Args, ValueEnum};
use shared_types::transport::reclaim::Steps;
use std::path::PathBuf;

/// `campaign`.
#[derive(Clone, Debug, Args)]
pub struct CampaignArguments {
    /// Processes that are killed; the campaign ends with the fleet that reaches them.
    #[arg(long, value_name = "N", default_value_t = 100)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub kills: u32,
    /// Fleet sizes, in turn.
    #[arg(long, value_delimiter = ',', value_name = "SIZES", default_value = "5,10,20")]
    pub sizes: Vec<u32>,
    /// What decides who is hit where.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Sets any key of the preset `campaign`: `--set fleet.cores=2`.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Directory under which run directories are made.
    #[arg(long, value_name = "DIR", default_value = "runs")]
    pub out: PathBuf,
    /// Ends the campaign after so many seconds (exit code 124).
    #[arg(long, value_name = "S")]
    pub time_limit_s: Option<u32>,
    /// Leaves out one step of the janitor. It exists to test the campaign, which must then fail.
    #[arg(long, value_name = "STEP")]
    pub without: Option<JanitorStep>,
}

/// The name of a step of [`Steps`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum JanitorStep {
    /// Sweeping what was never finished.
    Unfinished,
    /// Forgetting the tags that the dead did not finish.
    Tags,
    /// Letting iceoryx2 take the dead off the services.
    Places,
    /// Removing by hand what is left.
    ByHand,
}

impl JanitorStep {
    /// All steps but this one.
    #[must_use]
    pub const fn left_out(self) -> Steps {
        let mut steps = Steps::ALL;
        match self {
            Self::Unfinished => steps.unfinished = false,
            Self::Tags => steps.tags = false,
            Self::Places => steps.places = false,
            Self::ByHand => steps.by_hand = false,
        }
        steps
    }
}
