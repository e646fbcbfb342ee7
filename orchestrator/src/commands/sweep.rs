//! `sweep`: a scenario over a grid of values, one run a cell.

use super::execute::{Destination, Job, Scope, execute_under};
use super::planning::plan;
use super::resume::{parse, with_typed};
use super::{Refusal, Setting, load_scenario_with, print_report, program};
use crate::cli::{Command, CommonArguments, SweepArguments};
use crate::outcome::Outcome;
use crate::report::sweep::{Cell, Sweep};
use crate::results::provenance::{Provenance, RunIdentity};
use crate::results::record::Digest;
use crate::results::resume::{Unfinished, lock};
use crate::results::store::Place;
use crate::results::summary::Summary;
use crate::results::sweep::{CellState, SweepCell, SweepFile};
use crate::run::demand::demand;
use crate::run::estimate;
use crate::scenario::{Axis, ResolvedScenario, grid, load_text, overrides, preset_axes};
use crate::supervision::signals::Signals;
use shared_types::time::Nanos;
use shared_types::transport::clock;
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::xxh3_64;

/// Runs every cell that is not done yet and prints the table of the sweep.
///
/// # Errors
/// If something asked for is wrong; nothing was started then.
pub fn sweep(arguments: &SweepArguments, setting: Setting) -> Result<Outcome, Refusal> {
    let refused = |error: &dyn std::fmt::Display| Refusal::new(error.to_string());
    let Some(directory) = &arguments.resume else {
        let (axes, scenarios) = scenarios(arguments)?;
        let whole = Whole::plan(scenarios, &arguments.common)?;
        let file = whole.file(axes, None)?;
        whole.announce(&file, setting);
        let mut signals = Signals::install().map_err(|error| refused(&error))?;
        let (directory, _lock) =
            file.create(&arguments.common.out).map_err(|error| refused(&error))?;
        let common = &arguments.common;
        return run(&file, &directory, common, &arguments.metrics, setting, &mut signals);
    };
    let directory = SweepFile::find(directory).unwrap_or_else(|| directory.clone());
    let file = SweepFile::read(&directory).map_err(|error| refused(&error))?;
    let _lock = lock(&directory).map_err(|error| refused(&error))?;
    let Command::Sweep(stored) = parse(&file.provenance.command)? else {
        return Err(Refusal::new(format!("`{}` is no sweep's", directory.display())));
    };
    let label = |cell: &SweepCell| directory.join(&cell.directory).display().to_string();
    let scenarios: Result<Vec<ResolvedScenario>, _> =
        file.cells.iter().map(|cell| load_text(&label(cell), &cell.scenario, &[])).collect();
    let common = with_typed(stored.common, &arguments.common);
    let whole = Whole::plan(
        file.cells.iter().map(|cell| cell.values.clone()).zip(scenarios?).collect(),
        &common,
    )?;
    let now = whole.file(file.axes.clone(), Some(&file.provenance))?;
    file.check(&directory, &now.provenance).map_err(|error| refused(&error))?;
    let mut signals = Signals::install().map_err(|error| refused(&error))?;
    run(&file, &directory, &common, &arguments.metrics, setting, &mut signals)
}

/// A cell's values and its scenario.
type Planned = (Vec<String>, ResolvedScenario);

/// The grid of what was typed; every cell's scenario is checked.
fn scenarios(arguments: &SweepArguments) -> Result<(Vec<Axis>, Vec<Planned>), Refusal> {
    let name = arguments.scenario.as_deref().unwrap_or_default();
    let mut varied: Vec<&str> = arguments.vary.iter().map(String::as_str).collect();
    if varied.is_empty() {
        varied = preset_axes(name).to_vec();
    }
    let axes: Vec<Axis> = varied.into_iter().map(Axis::parse).collect::<Result<_, _>>()?;
    let mut cells = Vec::new();
    for values in grid(&axes)? {
        let Some(set) = overrides(&axes, &values)? else { continue };
        let scenario = load_scenario_with(name, &arguments.common, arguments.simulated, set)?;
        cells.push((values, scenario));
    }
    if cells.is_empty() {
        return Err(Refusal::new("no fleet of the grid is large enough for its copies (k-beta)"));
    }
    Ok((axes, cells))
}

/// All cells of a sweep, before any is started.
struct Whole {
    cells: Vec<Planned>,
    /// About, s.
    seconds: f64,
    /// Most processes of a fleet.
    identity: RunIdentity,
}

impl Whole {
    /// Plans every cell and compares what each needs with what the host has.
    fn plan(cells: Vec<Planned>, common: &CommonArguments) -> Result<Self, Refusal> {
        let (mut seconds, mut processes_max) = (0.0, 0);
        for (_, scenario) in &cells {
            let plan = plan(vec![scenario.clone()], Scope::All, None, common)?;
            seconds += estimate::seconds(&plan);
            for fleet in &plan.fleets {
                processes_max = processes_max.max(plan.fleet_options(fleet, None).processes());
                if !plan.is_simulated {
                    let claimed = demand(fleet, plan.seed).claim();
                    claimed.map_err(|error| Refusal::new(error.to_string()))?;
                }
            }
        }
        let first = plan(vec![cells[0].1.clone()], Scope::All, None, common)?;
        let identity = super::execute::identity("sweep", &first);
        Ok(Self { cells, seconds, identity: RunIdentity { processes_max, ..identity } })
    }

    /// `sweep.json`; of a sweep that goes on, with the command that started it.
    fn file(&self, axes: Vec<Axis>, then: Option<&Provenance>) -> Result<SweepFile, Refusal> {
        let texts: Vec<(Vec<String>, String)> = self
            .cells
            .iter()
            .map(|(values, scenario)| (values.clone(), scenario.to_toml()))
            .collect();
        let digest = Digest(xxh3_64(format!("{texts:?}").as_bytes()));
        let name = format!("sweep-{}", self.cells[0].1.scenario().name);
        let command =
            then.map_or_else(|| self.identity.command.clone(), |then| then.command.clone());
        let provenance = Provenance::gather(&RunIdentity {
            scenario: name,
            command,
            plan: [("the digest of the cells".to_owned(), digest)].into(),
            ..self.identity.clone()
        });
        Ok(SweepFile::new(axes, texts, provenance))
    }

    /// Says how much is coming, before it does.
    fn announce(&self, file: &SweepFile, setting: Setting) {
        if !setting.is_quiet {
            let (cells, length) = (file.cells.len(), estimate::in_words(self.seconds));
            eprintln!("slateswarm: {cells} cells, {length}");
        }
    }
}

/// Runs what is not done of a sweep, cell by cell, and prints its table.
fn run(
    file: &SweepFile,
    directory: &Path,
    common: &CommonArguments,
    metrics: &[String],
    setting: Setting,
    signals: &mut Signals,
) -> Result<Outcome, Refusal> {
    let limit_ns = common.time_limit_s.map(|seconds| u64::from(seconds) * 1_000_000_000);
    let began = clock::now();
    let mut early = None;
    for (number, cell) in file.cells.iter().enumerate() {
        let run = cell.run(directory);
        let state = SweepCell::state(run.as_ref());
        drop(run);
        if matches!(state, CellState::Done(_)) {
            continue;
        }
        let part = Part { number, cells: file.cells.len(), state };
        let common =
            CommonArguments { time_limit_s: remaining_s(limit_ns, began), ..common.clone() };
        let outcome = part.run(cell, directory, &common, setting, signals)?;
        if matches!(outcome, Outcome::Interrupted | Outcome::Terminated | Outcome::TimeLimit) {
            early = Some(outcome);
            break;
        }
    }
    let report = read(directory, metrics)?;
    super::execute::tell_how_to_resume("sweep", early.unwrap_or_default(), directory, setting);
    print_report(&report, setting, common.all)?;
    Ok(report.outcome().worse(early.unwrap_or_default()))
}

/// What is left of a time limit, whole seconds, at least one: a run may not be unlimited.
fn remaining_s(limit_ns: Option<u64>, began: Nanos) -> Option<u32> {
    let left_ns = limit_ns?.saturating_sub(clock::now().since(began));
    Some(u32::try_from(left_ns.div_ceil(1_000_000_000)).unwrap_or(u32::MAX).max(1))
}

/// A cell among the others.
struct Part {
    number: usize,
    cells: usize,
    state: CellState,
}

impl Part {
    fn run(
        &self,
        cell: &SweepCell,
        sweep: &Path,
        common: &CommonArguments,
        setting: Setting,
        signals: &mut Signals,
    ) -> Result<Outcome, Refusal> {
        let refused = |error: &dyn std::fmt::Display| Refusal::new(error.to_string());
        let path = sweep.join(&cell.directory);
        let destination = if self.state == CellState::CutOff {
            let unfinished = Unfinished::open(&path).map_err(|error| refused(&error))?;
            Destination::Resumed(Box::new(unfinished))
        } else {
            // A directory without provenance was being made when the sweep was cut off.
            match std::fs::remove_dir_all(&path) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                    return Err(refused(&error));
                }
                _ => Destination::New(Place::Exactly(&path)),
            }
        };
        let scenario = load_text(&path.display().to_string(), &cell.scenario, &[])?;
        let name = scenario.scenario().name.clone();
        let job = Job {
            name: &name,
            scenarios: vec![scenario],
            scope: Scope::All,
            load_sizes: None,
            common,
            destination,
            part: Some((self.number, self.cells)),
        };
        Ok(execute_under(job, setting, signals)?.outcome)
    }
}

/// The sweep in `directory` as it stands.
///
/// Where its file is lost or damaged, the cells stand for it.
///
/// # Errors
/// If there is none, or a metric is asked for that no cell has.
pub(super) fn read(directory: &Path, metrics: &[String]) -> Result<Sweep, Refusal> {
    let file = SweepFile::read(directory).or_else(|error| {
        let left = SweepFile::of_cells(directory).ok_or(error.to_string());
        left.inspect(|_| eprintln!("slateswarm: {error}; its cells are named by their directories"))
    });
    let file = file.map_err(Refusal::new)?;
    let runs: Vec<_> = file.cells.iter().map(|cell| cell.run(directory)).collect();
    let cells = runs.iter().map(|run| {
        let state = SweepCell::state(run.as_ref());
        Cell { state, summary: run.as_ref().map(Summary::of) }
    });
    let report = Sweep {
        cells: cells.collect(),
        map: file.map(&runs),
        file,
        metrics: metrics.to_vec(),
        directory: PathBuf::from(directory),
        program: program(),
    };
    if let Some((metric, near)) = report.unknown_metric() {
        let remedy = near.map_or_else(
            || "`--format csv` lists all".to_owned(),
            |near| format!("did you mean `{near}`?"),
        );
        return Err(Refusal::new(format!("no cell has the metric `{metric}`; {remedy}")));
    }
    Ok(report)
}
