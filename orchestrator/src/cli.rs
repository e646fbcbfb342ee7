//! The command line: what a user may type. One variant a verb; what the verbs do stands in
//! `commands`. The verb `agent` is not here: a craft's process is started by the orchestrator and
//! reads its own arguments.

mod campaign;
mod explain;
mod simulate;
mod solve;

pub use campaign::{CampaignArguments, JanitorStep};
pub use explain::ExplainArguments;
pub use simulate::SimulateArguments;
pub use solve::SolveArguments;

use crate::report::networks::PUBLISHED_NETWORKS;
use crate::scenario::nearest;
use clap::{Args, Parser, Subcommand, ValueEnum};
use shared_types::transport::WakeMode;
use shared_types::wire::StrategyKind;
use std::path::PathBuf;

/// Measures what replication strategies cost, with one real process per craft.
#[derive(Debug, Parser)]
#[command(name = "slateswarm", version, about, max_term_width = 80, propagate_version = true)]
#[command(after_help = "Start with `slateswarm compare`, then `slateswarm list` and \
                        `slateswarm show two-craft`.\n\
                        Exit codes: 0 ok, 1 an identity is broken, 2 usage or scenario error, \
                        3 partial, 4 regression, 124 time limit, 130 SIGINT, 143 SIGTERM.")]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
    /// How results are printed on standard output.
    #[arg(long, global = true, value_enum, default_value_t = Format::Table)]
    pub format: Format,
    /// Prints results and errors only.
    #[arg(long, short, global = true)]
    pub quiet: bool,
}

/// How results are printed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Tables for people, right at 80 columns.
    #[default]
    Table,
    /// One JSON document.
    Json,
    /// Comma-separated rows: metric, labels, value, unit.
    Csv,
}

/// The verbs.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Runs the published experiment on real fleets under every strategy and compares what it costs.
    Compare(CompareArguments),
    /// Runs a mission file or preset on a real fleet.
    Run(RunArguments),
    /// Runs a mission file or preset in one process, on a virtual clock; or a campaign of faults.
    Simulate(SimulateArguments),
    /// Runs a mission file or preset over a grid of values, one run a cell.
    Sweep(SweepArguments),
    /// Sets the published tables beside ours.
    Reproduce(ReproduceArguments),
    /// Prints the tables of a finished, killed or running run again, from its directory alone.
    Report(ReportArguments),
    /// Sets two runs beside each other: counts must be equal, times are ratios (exit code 4: worse).
    Diff(DiffArguments),
    /// Prints the cheapest way to a mission's end, without running it.
    Solve(SolveArguments),
    /// Says why a fact holds at the end of a run, or why a rule or action did not come about.
    Explain(ExplainArguments),
    /// Prints a trace of writes and reads for open mode as CSV.
    Record(RecordArguments),
    /// Kills and stops processes of fleets on purpose, again and again, and checks what is promised.
    Campaign(CampaignArguments),
    /// Lists the presets.
    List,
    /// Prints a preset or the resolved form of a mission file.
    Show(ScenarioArguments),
    /// Checks a mission file and says what it would run.
    Validate(ScenarioArguments),
    /// Removes what runs that died left behind.
    Clean,
    /// Says whether this machine can run fleets.
    Doctor,
    /// Prints the JSON schema of mission files.
    Schema,
    /// Prints completions for a shell.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
}

/// Flags that decide what a run does: one that is resumed has them already.
const PLAN_FLAGS: [&str; 9] =
    ["strategies", "trials", "blocks", "controls", "seed", "set", "out", "wake", "cores"];

/// What every run may be told.
#[derive(Clone, Debug, Default, Args)]
pub struct CommonArguments {
    /// Strategies, separated by commas; default those of the scenario.
    #[arg(long, alias = "strategy", value_delimiter = ',', value_name = "NAMES")]
    #[arg(value_parser = strategy)]
    pub strategies: Vec<StrategyKind>,
    /// Trials for each strategy, all strategies on the same seeds.
    #[arg(long, value_name = "N")]
    pub trials: Option<u32>,
    /// Fresh launches of each fleet over which turn times are measured; 9 and more name winners.
    #[arg(long, value_name = "N")]
    pub blocks: Option<u32>,
    /// Times further entries of one strategy in every block, one of them slowed down by 20 %, and says
    /// whether the comparison finds what it should (`run.controls`).
    #[arg(long)]
    pub controls: bool,
    /// Seed of everything that is drawn.
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Sets any key of the scenario: `--set run.turns=50`.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Directory under which run directories are made.
    #[arg(long, value_name = "DIR", default_value = "runs")]
    pub out: PathBuf,
    /// How an idle process waits.
    #[arg(long, value_enum, value_name = "MODE")]
    pub wake: Option<Wake>,
    /// Cores that the fleet is confined to.
    #[arg(long, value_name = "N")]
    pub cores: Option<u32>,
    /// Prints every figure, not only the first screen.
    #[arg(long)]
    pub all: bool,
    /// Ends the run after so many seconds (exit code 124).
    #[arg(long, value_name = "S")]
    pub time_limit_s: Option<u32>,
}

/// `compare`.
#[derive(Clone, Debug, Args)]
pub struct CompareArguments {
    /// `compare`, or `paper`: nine fresh fleets a size up to 50 crafts, capacity, loads at shares of it;
    /// hours, which it says first [default: compare].
    #[arg(value_parser = ["compare", "paper"], hide_possible_values = true)]
    pub preset: Option<String>,
    /// Goes on with a run that was cut off, in its directory and as it was started.
    #[arg(long, value_name = "DIR", conflicts_with_all = PLAN_FLAGS)]
    #[arg(conflicts_with_all = ["preset", "sizes", "load_sizes", "simulated"])]
    #[arg(conflicts_with_all = ["no_timing", "timing_only"])]
    pub resume: Option<PathBuf>,
    /// Fleet sizes [default: 2,3,5,10].
    #[arg(long, value_delimiter = ',', value_name = "SIZES")]
    pub sizes: Option<Vec<u32>>,
    /// Fleet sizes that are offered loads, among `--sizes`; `none` for none [default: 10, where it is
    /// one of them; of `paper` all].
    #[arg(long, value_name = "SIZES", value_parser = load_sizes)]
    pub load_sizes: Option<LoadSizes>,
    /// On the memory network instead of real processes: counts only, no times.
    #[arg(long)]
    pub simulated: bool,
    /// Counts only: leaves out turn times and loads.
    #[arg(long, conflicts_with = "timing_only")]
    pub no_timing: bool,
    /// Times only: leaves out the trials.
    #[arg(long)]
    pub timing_only: bool,
    /// What every run may be told.
    #[command(flatten)]
    pub common: CommonArguments,
}

/// `run` and `simulate`.
#[derive(Clone, Debug, Args)]
pub struct RunArguments {
    /// A mission file, or the name of a preset.
    pub scenario: Option<String>,
    /// Goes on with a run that was cut off, in its directory and as it was started.
    #[arg(long, value_name = "DIR", conflicts_with_all = PLAN_FLAGS)]
    #[arg(conflicts_with_all = ["scenario", "simulated"])]
    pub resume: Option<PathBuf>,
    /// On the memory network instead of real processes.
    #[arg(long)]
    pub simulated: bool,
    /// What every run may be told.
    #[command(flatten)]
    pub common: CommonArguments,
}

/// `sweep`.
#[derive(Clone, Debug, Args)]
pub struct SweepArguments {
    /// A mission file, or the name of a preset.
    #[arg(required_unless_present = "resume")]
    pub scenario: Option<String>,
    /// Varies any key of the scenario; several keys make a grid: `--vary network.links=100,300`. The
    /// presets `map`, `map-small` and `lossy-links` have axes of their own.
    #[arg(long, value_name = "KEY=VALUES")]
    pub vary: Vec<String>,
    /// Goes on with a sweep that was cut off: cells that are done are kept.
    #[arg(long, value_name = "DIR", conflicts_with_all = PLAN_FLAGS)]
    #[arg(conflicts_with_all = ["scenario", "vary", "simulated"])]
    pub resume: Option<PathBuf>,
    /// On the memory network instead of real processes.
    #[arg(long)]
    pub simulated: bool,
    /// Metrics of the table, as `--format csv` names them.
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    pub metrics: Vec<String>,
    /// What every run may be told.
    #[command(flatten)]
    pub common: CommonArguments,
}

/// `reproduce`.
#[derive(Clone, Debug, Args)]
pub struct ReproduceArguments {
    /// `table-1` ... `table-25`, or `all`: 1 to 20 are about pruning and solving random networks, 21
    /// to 25 about replication in fleets.
    #[arg(default_value = "all")]
    pub tables: Vec<String>,
    /// Goes on with a run that was cut off, in its directory and as it was started.
    #[arg(long, value_name = "DIR", conflicts_with_all = PLAN_FLAGS)]
    #[arg(conflicts_with_all = ["tables", "simulated", "networks", "pruner"])]
    pub resume: Option<PathBuf>,
    /// On the memory network instead of real processes: the same counts.
    #[arg(long)]
    pub simulated: bool,
    /// Random networks behind each mean of Tables 1 to 20.
    #[arg(long, value_name = "N", default_value_t = PUBLISHED_NETWORKS)]
    #[arg(value_parser = clap::value_parser!(u32).range(2..=1_000_000))]
    pub networks: u32,
    /// Which pruner's counts are shown.
    #[arg(long, value_enum, default_value_t)]
    pub pruner: Pruner,
    /// What every run may be told.
    #[command(flatten)]
    pub common: CommonArguments,
}

/// Which pruner `reproduce` sets beside the published counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Pruner {
    /// The one that gives the published counts.
    #[default]
    Published,
    /// The one that the source's text describes, which does not.
    Literal,
}

/// `report`.
#[derive(Clone, Debug, Args)]
pub struct ReportArguments {
    /// The directory of a run or a sweep, such as `runs/latest`.
    pub directory: PathBuf,
    /// Metrics of a sweep's table, as `--format csv` names them.
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    pub metrics: Vec<String>,
    /// Prints every figure, not only the first screen.
    #[arg(long)]
    pub all: bool,
    /// Where `report.html` and `pictures/` are written: the run's own directory for tables, nowhere
    /// for json and csv, unless said here; `none` for nowhere.
    #[arg(long, value_name = "DIR|none")]
    pub pictures: Option<PathBuf>,
}

/// `diff`.
#[derive(Clone, Debug, Args)]
pub struct DiffArguments {
    /// The directory of the run that is compared with.
    pub before: PathBuf,
    /// The directory of the run that is judged.
    pub after: PathBuf,
    /// Prints every difference and every quantile.
    #[arg(long)]
    pub all: bool,
}

/// `show` and `validate`.
#[derive(Clone, Debug, Args)]
pub struct ScenarioArguments {
    /// A mission file, or the name of a preset.
    pub scenario: String,
    /// Sets any key of the scenario: `--set run.turns=50`.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}

/// `record`.
#[derive(Clone, Debug, Args)]
pub struct RecordArguments {
    /// A mission file, or the name of a preset.
    pub scenario: String,
    /// Sets any key of the scenario: `--set run.rate-per-s=1000 --set run.duration-s=2`.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Seed of everything that is drawn.
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Trial of the seed.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub trial: u32,
}

/// [`WakeMode`] on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Wake {
    /// Yields the core and looks again.
    Poll,
    /// Looks again a few times, then sleeps.
    Adaptive,
    /// Sleeps at once.
    Block,
}

impl Wake {
    /// The name that the scenario uses.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Poll => "poll",
            Self::Adaptive => "adaptive",
            Self::Block => "block",
        }
    }
}

/// Fleet sizes that are offered loads.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LoadSizes(pub Vec<u32>);

/// Reads fleet sizes, separated by commas, or `none`.
fn load_sizes(text: &str) -> Result<LoadSizes, String> {
    if text == "none" {
        return Ok(LoadSizes(Vec::new()));
    }
    let size = |word: &str| {
        word.trim()
            .parse()
            .map_err(|_| format!("`{word}` is no fleet size\n  such as `5,10` or `none`"))
    };
    text.split(',').map(size).collect::<Result<_, _>>().map(LoadSizes)
}

/// Reads a strategy's name; whoever mistypes one is told what was meant, in lines that fit a narrow
/// terminal.
fn strategy(name: &str) -> Result<StrategyKind, String> {
    name.parse().map_err(|_| {
        let known = StrategyKind::ALL.map(StrategyKind::name);
        let remedy = nearest(name, known).map_or_else(
            || format!("known: {}", known.join(", ").replace("central, ", "central,\n  ")),
            |near| format!("did you mean `{near}`?"),
        );
        format!("no such strategy\n  {remedy}")
    })
}

impl From<Wake> for WakeMode {
    fn from(wake: Wake) -> Self {
        match wake {
            Wake::Poll => Self::Poll,
            Wake::Adaptive => Self::Adaptive,
            Wake::Block => Self::Block,
        }
    }
}

#[cfg(test)]
mod tests;
