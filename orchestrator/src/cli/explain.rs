//! What `explain` may be told.

use super::strategy;
use clap::Args;
use shared_types::wire::StrategyKind;
use std::path::PathBuf;

/// `explain`.
#[derive(Clone, Debug, Args)]
pub struct ExplainArguments {
    /// The directory of a run, such as `runs/latest`.
    pub directory: PathBuf,
    /// A fact, rule or action of a craft, as `CRAFT.NAME`; default the final fact that ended the trial.
    #[arg(value_name = "CRAFT.NAME")]
    pub subject: Option<String>,
    /// Trial of the run's seed.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub trial: u32,
    /// Crafts of the fleet, where the run had several sizes; default the largest.
    #[arg(long, value_name = "N")]
    pub size: Option<u32>,
    /// The strategy by whose ways changes went; default the first of the run.
    #[arg(long, value_name = "NAME", value_parser = strategy)]
    pub strategy: Option<StrategyKind>,
    /// Prints every step and everybody who could help.
    #[arg(long)]
    pub all: bool,
}
