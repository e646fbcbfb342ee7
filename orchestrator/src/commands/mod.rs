//! One file a verb: from what was typed to what is printed.
//!
//! Results go to standard output, everything else to standard error. A verb returns how the
//! invocation ends; `main` turns that into the exit code.

pub mod campaign;
pub mod clean;
pub mod compare;
pub mod diff;
pub mod doctor;
mod execute;
pub mod explain;
mod planning;
mod progress;
pub mod record;
pub mod report;
pub mod reproduce;
mod resume;

pub mod run;
pub mod scenario;
pub mod simulated;
pub mod solve;
pub mod sweep;

use crate::cli::{Cli, Command, CommonArguments, Format};
use crate::outcome::Outcome;
use crate::report::table::Colour;
use crate::report::{Look, Report};
use crate::scenario::{
    Base, Override, ResolvedScenario, ScenarioError, environment, load, load_simulated,
};
use crate::workload::TraceError;
use clap::CommandFactory;
use std::io::{IsTerminal as _, Write as _};

/// What every verb is told besides its own arguments.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// How results are printed.
    pub format: Format,
    /// Whether only results and errors are printed.
    pub is_quiet: bool,
}

/// Why a verb did nothing.
#[derive(Debug)]
pub struct Refusal {
    /// What to print: a diagnostic with place and remedy where there is one.
    report: miette::Report,
}

impl From<ScenarioError> for Refusal {
    fn from(error: ScenarioError) -> Self {
        Self { report: error.into() }
    }
}

impl From<TraceError> for Refusal {
    fn from(error: TraceError) -> Self {
        Self { report: error.into() }
    }
}

impl Refusal {
    /// A refusal in one sentence that names the remedy.
    pub fn new(message: impl Into<String>) -> Self {
        Self { report: miette::Report::msg(message.into()) }
    }

    /// Says why on standard error.
    pub fn print(&self) {
        eprintln!("{:?}", self.report);
    }
}

/// Carries out what was typed.
///
/// # Errors
/// If nothing was started because something asked for is wrong.
pub fn carry_out(cli: &Cli) -> Result<Outcome, Refusal> {
    let setting = Setting { format: cli.format, is_quiet: cli.quiet };
    match &cli.command {
        Command::Compare(arguments) => compare::compare(arguments, setting),
        Command::Run(arguments) => run::run(arguments, arguments.simulated, setting),
        Command::Simulate(arguments) => simulated::simulated(arguments, setting)
            .unwrap_or_else(|| run::run(&arguments.run, true, setting)),
        Command::Sweep(arguments) => sweep::sweep(arguments, setting),
        Command::Reproduce(arguments) => reproduce::reproduce(arguments, setting),
        Command::Report(arguments) => report::report(arguments, setting),
        Command::Diff(arguments) => diff::diff(arguments, setting),
        Command::Record(arguments) => record::record(arguments),
        Command::Solve(arguments) => solve::solve(arguments, setting),
        Command::Explain(arguments) => explain::explain(arguments, setting),
        Command::Campaign(arguments) => campaign::campaign(arguments, setting),
        Command::List => scenario::list(setting),
        Command::Show(arguments) => scenario::show(arguments),
        Command::Validate(arguments) => scenario::validate(arguments, setting),
        Command::Schema => scenario::schema(),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(*shell, &mut Cli::command(), "slateswarm", &mut script);
            print_bytes(&script)
        }
        Command::Clean => clean::carry_out(setting),
        Command::Doctor => doctor::carry_out(setting),
    }
}

/// Reads the scenario that `argument` names, with what the command line says over it; to be played on a
/// virtual clock if `is_simulated`.
fn load_scenario(
    argument: &str,
    common: &CommonArguments,
    is_simulated: bool,
) -> Result<ResolvedScenario, Refusal> {
    load_scenario_with(argument, common, is_simulated, Vec::new())
}

/// The same, with `last` over all of it.
fn load_scenario_with(
    argument: &str,
    common: &CommonArguments,
    is_simulated: bool,
    last: Vec<Override>,
) -> Result<ResolvedScenario, Refusal> {
    let mut overrides = Vec::new();
    for set in &common.set {
        overrides.push(Override::set(set)?);
    }
    let mut flag = |name: &str, key: &str, value: Option<String>| {
        if let Some(value) = value {
            overrides.push(Override::flag(format!("{name} {value}"), key, &value));
        }
    };
    let names: Vec<String> =
        common.strategies.iter().map(|strategy| format!("\"{strategy}\"")).collect();
    let strategies = (!names.is_empty()).then(|| format!("[{}]", names.join(", ")));
    flag("--strategies", "replication.strategies", strategies);
    flag("--trials", "run.trials", common.trials.map(|trials| trials.to_string()));
    flag("--blocks", "run.blocks", common.blocks.map(|blocks| blocks.to_string()));
    flag("--controls", "run.controls", common.controls.then(|| "true".to_owned()));
    flag("--seed", "run.seed", common.seed.map(|seed| seed.to_string()));
    flag("--wake", "fleet.wake", common.wake.map(|wake| wake.name().to_owned()));
    flag("--cores", "fleet.cores", common.cores.map(|cores| cores.to_string()));
    overrides.extend(last);
    let load = if is_simulated { load_simulated } else { load };
    Ok(load(&Base::from_argument(argument), environment(), &overrides)?)
}

/// Prints a report in the form asked for.
fn print_report(report: &impl Report, setting: Setting, all: bool) -> Result<Outcome, Refusal> {
    let text = match setting.format {
        Format::Table => {
            let no_color = std::env::var_os("NO_COLOR");
            let colour = Colour::detect(std::io::stdout().is_terminal(), no_color.as_deref());
            report.table(Look { colour, all })
        }
        Format::Json => report.json(),
        Format::Csv => report.csv(),
    };
    print_bytes(text.as_bytes())
}

/// Writes to standard output. A reader that has gone away (`| head`) is no error.
fn print_bytes(bytes: &[u8]) -> Result<Outcome, Refusal> {
    let mut output = std::io::stdout().lock();
    match output.write_all(bytes).and_then(|()| output.flush()) {
        Ok(()) => Ok(Outcome::Success),
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(Outcome::Success),
        Err(error) => Err(Refusal::new(format!("cannot write to standard output: {error}"))),
    }
}

/// How the user calls this program, for what to try next: by its name if that is on the path, else
/// through cargo.
fn program() -> String {
    let is_cargo = std::env::var_os("CARGO").is_some();
    if is_cargo { "cargo run --release --".into() } else { "slateswarm".into() }
}
