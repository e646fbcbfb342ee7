//! What `campaign` may be told.

use clap::Args;
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
}
