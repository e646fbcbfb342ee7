//! What `solve` may be told.

use clap::Args;

/// `solve`.
#[derive(Clone, Debug, Args)]
pub struct SolveArguments {
    /// A mission file, or the name of a preset.
    pub scenario: String,
    /// Sets any key of the scenario: `--set fleet.crafts=3`.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Seed of everything that is drawn.
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Trial of the seed, for networks that are drawn.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub trial: u32,
    /// Cost of telling another craft a fact; a rule and an action cost 1 each.
    #[arg(long, value_name = "COST", default_value_t = 1.0)]
    pub telling: f64,
    /// Premises are worked for side by side: the dearest counts, not their sum.
    #[arg(long)]
    pub parallel: bool,
    /// Takes a fact to hold at the start; may be given several times.
    #[arg(long, value_name = "CRAFT.FACT")]
    pub known: Vec<String>,
    /// Takes a fact to be known absent: what rests on it is never done; may be given several times.
    #[arg(long, value_name = "CRAFT.FACT")]
    pub absent: Vec<String>,
    /// Prints so many ways, the cheapest first, as far as there are.
    #[arg(long, value_name = "K", default_value_t = 1)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=1_000))]
    pub ways: u32,
    /// Prints the likeliest outcomes of the plan's actions, and what each leaves to be done.
    #[arg(long, value_name = "K", default_value_t = 0)]
    #[arg(value_parser = clap::value_parser!(u32).range(0..=1_000))]
    pub outcomes: u32,
    /// Prints every final fact.
    #[arg(long)]
    pub all: bool,
}
