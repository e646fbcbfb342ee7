//! A results directory of which one file was damaged: one byte that says which, then its content.
//!
//! Directories lie where temporary files do and are removed at the end of the thread.

use crate::outcome::Outcome;
use crate::report::campaign::CampaignReport;
use crate::report::compare::Compare;
use crate::report::diff::Difference;
use crate::report::page::Page;
use crate::report::run::Mission;
use crate::report::{Look, Report};
use crate::results::diff::Diff;
use crate::results::event::Event;
use crate::results::faults::{Failure, FaultKind, FaultRecord, Step};
use crate::results::host::HostCheck;
use crate::results::read::{Missing, RunData, read_run};
use crate::results::record::Cell;
use crate::results::resume::Unfinished;
use crate::results::sample::{capacity, load, provenance, timing, trial};
use crate::results::store::{
    CAPACITIES_FILE, EVENTS_FILE, FAULTS_FILE, LOADS_FILE, Place, SCENARIO_FILE, Store,
    TIMINGS_FILE, TRIALS_FILE,
};
use crate::results::summary::Summary;
use shared_types::transport::WakeMode;
use shared_types::wire::StrategyKind;
use std::path::{Path, PathBuf};

/// Fleet of the sample.
const SIZE: u32 = 3;

/// Steps of recovery that the faults of the sample reached.
const STEPS: [Step; 2] = [Step::Noticed, Step::Reclaimed];

/// A sound directory, and its files as they were.
struct Sound {
    place: tempfile::TempDir,
    files: Vec<(PathBuf, Vec<u8>)>,
    run: RunData,
}

thread_local! {
    static SOUND: Sound = Sound::leave(leave_run);
    static CAMPAIGN: Sound = Sound::leave(leave_campaign);
}

impl Sound {
    fn leave(leave: fn(&Path)) -> Self {
        let place = tempfile::tempdir().expect("temporary files have a place");
        leave(place.path());
        let entries = std::fs::read_dir(place.path()).expect("the directory was made");
        let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
        paths.sort();
        let content = |path: PathBuf| (path.clone(), std::fs::read(path).expect("a file of ours"));
        let files = paths.into_iter().map(content).collect();
        let run = read_run(place.path()).expect("a run was left");
        Self { place, files, run }
    }

    /// The file that `choice` names.
    fn file(&self, choice: u8) -> &(PathBuf, Vec<u8>) {
        &self.files[usize::from(choice) % self.files.len()]
    }

    fn seeds(&self) -> Vec<Vec<u8>> {
        let files = (0..=u8::MAX).zip(&self.files);
        files.map(|(choice, (_, content))| [&[choice][..], content].concat()).collect()
    }
}

/// Leaves everything that a run can hold, as little of it as there can be.
fn leave_run(directory: &Path) {
    let strategies = [StrategyKind::Null, StrategyKind::Boundary, StrategyKind::Central];
    let mut store = Store::create(Place::Exactly(directory), &provenance(), "[run]\nseed = 7\n")
        .expect("the directory is new");
    let event = |store: &mut Store, event| store.event(event).expect("the disk takes it");
    for block in 0..2 {
        let started = Event::FleetStarted { block, size: SIZE, processes: SIZE, order: Vec::new() };
        event(&mut store, started);
        for strategy in strategies {
            let cell = Cell { block, size: SIZE, strategy };
            let mut played = trial(SIZE, strategy, 1);
            played.deterministic.cell = cell;
            store.append_trial(&played).expect("the disk takes it");
            if block > 0 {
                continue;
            }
            let (mut timed, epochs) = timing(SIZE, strategy, 60);
            timed.cell = cell;
            store.append_timing(&timed, &epochs).expect("the disk takes it");
            let (record, histograms) = load(cell, 0, "common", 40, 1.5);
            store.append_load(&record, &histograms).expect("the disk takes it");
            store.append_capacity(&capacity(cell)).expect("the disk takes it");
        }
        let check = HostCheck { measured_ns: 9, busy_ns: 4, own_cpu_ns: 3, ..HostCheck::default() };
        event(&mut store, Event::HostChecked { block, size: SIZE, check });
        event(&mut store, Event::FleetDone { block, size: SIZE, code: 0 });
    }
    store.finish(Outcome::Success).expect("the disk takes it");
}

/// Leaves a campaign of three faults, of which the last one is timed.
fn leave_campaign(directory: &Path) {
    let mut store = Store::create(Place::Exactly(directory), &provenance(), "[run]\nseed = 7\n")
        .expect("the directory is new");
    let kinds = [FaultKind::KillCraft, FaultKind::Pause, FaultKind::KillOrchestrator];
    for (number, kind) in (0..).zip(kinds) {
        let fault = FaultRecord {
            number,
            size: SIZE,
            strategy: StrategyKind::Full,
            wake: WakeMode::Adaptive,
            is_open: number == 2,
            links_fail: number == 2,
            kind,
            point: "send".to_owned(),
            craft: (number == 0).then_some(1),
            took_effect: true,
            failures: vec![(Failure::Left, "a segment".to_owned())],
            times_ns: STEPS.map(|step| (step, 1_000 * (u64::from(number) + 1))).into(),
        };
        store.append_fault(&fault).expect("the disk takes it");
    }
    for step in STEPS {
        let times = vec![1_000, 2_000, 3_000];
        store.keep_recovery_times(step, times).expect("the disk takes it");
    }
    store.finish(Outcome::Broken).expect("the disk takes it");
}

/// Puts a file back when it goes, also out of a panic.
struct Damage<'a>(&'a (PathBuf, Vec<u8>));

impl<'a> Damage<'a> {
    fn of(file: &'a (PathBuf, Vec<u8>), content: &[u8]) -> Self {
        std::fs::write(&file.0, content).expect("the disk takes it");
        Self(file)
    }
}

impl Drop for Damage<'_> {
    fn drop(&mut self) {
        let _put_back = std::fs::write(&self.0.0, &self.0.1);
    }
}

/// Whatever one file says, the run reads, no line is lost in silence, and every report can be made.
pub(super) fn read(bytes: &[u8]) {
    let Some((&choice, content)) = bytes.split_first() else { return };
    SOUND.with(|sound| {
        let file = sound.file(choice);
        let _damage = Damage::of(file, content);
        let run = read_run(sound.place.path()).expect("a damaged run is a run");
        check_lines(&run, &file.0, content);
        assert!(
            !is_cut(file, content) || tells(&run, &file.0),
            "{}: {:?}",
            file.0.display(),
            run.missing
        );
        report(&run);
        let diff = Diff::of(&sound.run, &run);
        let names = ["before".to_owned(), "after".to_owned()];
        let _tables = all_forms(&Difference { diff, names });
    });
}

/// The same of a campaign, whose report is another one.
pub(super) fn read_campaign(bytes: &[u8]) {
    let Some((&choice, content)) = bytes.split_first() else { return };
    CAMPAIGN.with(|sound| {
        let file = sound.file(choice);
        let _damage = Damage::of(file, content);
        let run = read_run(sound.place.path()).expect("a damaged run is a run");
        check_lines(&run, &file.0, content);
        let is_told = !is_cut(file, content) || tells(&run, &file.0);
        assert!(is_told, "{}: {:?}", file.0.display(), run.missing);
        let (summary, directory) = (Summary::of(&run), run.directory.clone());
        let program = "slateswarm".to_owned();
        tell_all(&run, &all_forms(&CampaignReport { summary, directory, program }));
    });
}

/// Whether `content` is what a power cut leaves of a file: a part, or a part and then nothing. White
/// space is no loss, and a scenario that ends between two lines is a scenario.
fn is_cut((path, sound): &(PathBuf, Vec<u8>), content: &[u8]) -> bool {
    let kept = content.len() - content.iter().rev().take_while(|&&byte| byte == 0).count();
    let is_scenario = path.ends_with(SCENARIO_FILE) && kept == content.len();
    let is_less = content.trim_ascii_end() != sound.trim_ascii_end();
    is_less && !is_scenario && sound.starts_with(&content[..kept])
}

fn tells(run: &RunData, path: &Path) -> bool {
    run.missing.iter().any(|lack| path.ends_with(&lack.file))
}

/// Every line of a file of lines is a record, or is told.
fn check_lines(run: &RunData, path: &Path, content: &[u8]) {
    let Some(name) = path.file_name().and_then(|name| name.to_str()) else { return };
    let read = match name {
        TRIALS_FILE => run.trials.len(),
        TIMINGS_FILE => run.timings.len(),
        LOADS_FILE => run.loads.len(),
        CAPACITIES_FILE => run.capacities.len(),
        EVENTS_FILE => run.events.len(),
        FAULTS_FILE => run.faults.len(),
        _ => return,
    };
    let whole = std::str::from_utf8(content).map_or_else(|error| error.valid_up_to(), str::len);
    let lines = String::from_utf8_lossy(&content[..whole]).split_inclusive('\n').count();
    let told = run.missing.iter().filter(|lack| lack.file == name).map(lines_told);
    assert_eq!(read + told.sum::<usize>(), lines, "{name}: {:?}", run.missing);
}

/// Lines that `lack` says are torn or damaged.
fn lines_told(lack: &Missing) -> usize {
    match lack.what.split_once(' ') {
        Some(("line", _)) => 1,
        Some((count, what)) if what.starts_with("lines are damaged") => count.parse().unwrap_or(0),
        _ => 0,
    }
}

/// Both reports of a run, in every form.
fn report(run: &RunData) {
    let summary = Summary::of(run);
    assert_eq!(summary.deterministic.trials.len(), run.trials.len());
    let (directory, program) = (run.directory.clone(), "slateswarm".to_owned());
    let mission = Mission {
        summary: summary.clone(),
        directory: directory.clone(),
        program: program.clone(),
    };
    let compare = Compare { summary, published: Vec::new(), directory, program };
    let pages: [Page; 2] = [mission.page(run), compare.page(run)];
    for page in pages {
        assert!(page.html().ends_with("</html>\n"));
        page.pictures.iter().for_each(|picture| assert!(!picture.document().is_empty()));
    }
    tell_all(run, &all_forms(&mission));
    tell_all(run, &all_forms(&compare));
}

/// Whatever is missing is said wherever a report can say it.
fn tell_all(run: &RunData, forms: &[String; 3]) {
    let is_told = |lack: &Missing| forms[1].contains(&lack.file);
    assert!(run.missing.iter().all(is_told), "{:?}", run.missing);
}

fn all_forms(report: &impl Report) -> [String; 3] {
    let table = report.table(Look { all: true, ..Look::default() });
    let _first_screen = report.table(Look::default());
    let json = report.json();
    assert!(serde_json::from_str::<serde_json::Value>(&json).is_ok());
    [table, json, report.csv()]
}

/// Goes on with a run of which one file was damaged. A run that may not go on is left as it is; else
/// nothing torn remains, and it comes to its end.
pub(super) fn resume(bytes: &[u8]) {
    let Some((&choice, content)) = bytes.split_first() else { return };
    SOUND.with(|sound| {
        let place = tempfile::tempdir().expect("temporary files have a place");
        let damaged = sound.file(choice);
        for (path, sound) in &sound.files {
            let to = place.path().join(path.file_name().unwrap_or_default());
            let content = if *path == damaged.0 { content } else { sound };
            std::fs::write(to, content).expect("the disk takes it");
        }
        let before = contents(place.path());
        let resumed = Unfinished::open(place.path())
            .and_then(|unfinished| Store::resume(unfinished, &provenance()));
        let Ok(store) = resumed else {
            return assert_eq!(contents(place.path()), before, "a refusal changes nothing");
        };
        let outcome = store.outcome_so_far();
        store.finish(outcome).expect("the disk takes it");
        let run = read_run(place.path()).expect("a resumed run is a run");
        let is_torn = |lack: &&Missing| lack.file.ends_with(".jsonl") && lines_told(lack) > 0;
        assert_eq!(run.missing.iter().find(is_torn), None);
        assert_eq!(run.outcome(), Some(outcome));
    });
}

fn contents(directory: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let entries = std::fs::read_dir(directory).expect("a directory of ours");
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    paths.into_iter().map(|path| (path.clone(), std::fs::read(path).unwrap_or_default())).collect()
}

/// Every file as it was.
pub(super) fn seeds() -> Vec<Vec<u8>> {
    SOUND.with(Sound::seeds)
}

/// Every file of a campaign as it was.
pub(super) fn campaign_seeds() -> Vec<Vec<u8>> {
    CAMPAIGN.with(Sound::seeds)
}
