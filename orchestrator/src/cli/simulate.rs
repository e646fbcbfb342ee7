//! What `simulate` may be told: a scenario, or a campaign of faults.

use super::RunArguments;
use clap::Args;

/// `simulate`.
#[derive(Clone, Debug, Args)]
pub struct SimulateArguments {
    /// As `run`.
    #[command(flatten)]
    pub run: RunArguments,
    /// Instead of a scenario: N small fleets a strategy under faults drawn from seeds (kills, pauses,
    /// loss, delay, doubling, reordering, partitions), from `--seed` on. Exit code 1 if one breaks a law.
    #[arg(long, value_name = "N", conflicts_with_all = ["scenario", "resume", "replay", "losses"])]
    #[arg(value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    pub campaign: Option<u64>,
    /// The fleets of `--campaign` and `--replay` play trials in lockstep in place of traces; every trial must
    /// go as without faults.
    #[arg(long, conflicts_with_all = ["scenario", "resume", "losses"])]
    pub lockstep: bool,
    /// Shows the fleet of a campaign that `--seed` and `--strategy` name, step by step; one that breaks a
    /// law with as few faults as still break it.
    #[arg(long, conflicts_with_all = ["scenario", "resume", "losses"])]
    pub replay: bool,
    /// Instead of a scenario: what it costs and how late knowledge comes when links lose 0 to 75 % of all
    /// samples, over N small fleets.
    #[arg(long, value_name = "N", conflicts_with_all = ["scenario", "resume"])]
    #[arg(value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    pub losses: Option<u64>,
}
