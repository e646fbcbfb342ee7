//! A run's directory as a whole: what is written can be read, whatever became of it.

use super::event::{Event, ProcessEnd};
use super::inference::Verdict;
use super::provenance::Provenance;
use super::read::{ReadError, read_run};
use super::record::Cell;
use super::record::TrialEnd;
use super::sample::{
    LOADED, RECOVERY, STRATEGIES, capacity, leave_blocks, leave_loads, leave_run, load, provenance,
    timing, trial,
};
use super::statistics::{Quantile, histogram_of, merged};
use super::store::{
    CAPACITIES_FILE, EVENTS_FILE, LATEST_LINK, LOADS_FILE, MEASUREMENTS_FILE, Place, SUMMARY_FILE,
    Store, StoreError, TRIALS_FILE,
};
use super::summary::Summary;
use crate::outcome::Outcome;
use shared_types::rng::{Purpose, Stream};
use shared_types::wire::StrategyKind;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;

fn files(directory: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(directory)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn what_was_appended_is_read_back_equal() {
    let place = tempfile::tempdir().unwrap();
    let summary = leave_run(place.path(), &[2, 3]);
    let run = read_run(place.path()).unwrap();
    assert_eq!(run.missing, []);
    assert_eq!(run.outcome(), Some(Outcome::Success));
    assert_eq!(run.provenance, Some(provenance()));
    assert_eq!(run.scenario.as_deref(), Some("[run]\nseed = 7\n"));
    assert_eq!(run.trials.len(), 2 * 7 * 10);
    assert_eq!(run.trials[0], trial(2, StrategyKind::Null, 0));
    let (record, epochs) = timing(3, StrategyKind::CentralBatched, 1000);
    assert_eq!(run.timings.last().map(|timed| &timed.record), Some(&record));
    let last = run.timings.last().unwrap();
    assert_eq!(last.turn_times, Some(histogram_of(epochs.iter().flatten().copied())));
    assert_eq!(last.slices.len(), epochs.len());
    assert_eq!(Summary::of(&run), summary);
}

#[test]
fn loads_and_capacities_are_read_back_equal_with_every_histogram() {
    let place = tempfile::tempdir().unwrap();
    leave_loads(place.path(), 1, 2, 500, 1.2);
    let run = read_run(place.path()).unwrap();
    assert_eq!(run.missing, []);
    assert_eq!(run.loads.len(), 2 * LOADED.len());
    let cell = Cell { block: 1, size: 10, strategy: StrategyKind::Boundary };
    assert_eq!(run.capacities, [capacity(Cell { block: 0, ..cell }), capacity(cell)]);
    assert_eq!(run.capacities[0].capacity().map(|probe| probe.offered_per_s), Some(80_000.0));

    let place = tempfile::tempdir().unwrap();
    let mut store = Store::create(Place::Exactly(place.path()), &provenance(), "").unwrap();
    let (record, histograms) = load(cell, 0, "80%", 500, 1.5);
    store.append_load(&record, &histograms).unwrap();
    let null = Cell { strategy: StrategyKind::Null, ..cell };
    let (floor, nothing_known) = load(null, 0, "80%", 500, 1.5);
    store.append_load(&floor, &nothing_known).unwrap();
    let run = read_run(place.path()).unwrap();
    let read = &run.loads[0];
    assert_eq!(read.record, record);
    assert_eq!(read.knowledge, Some(merged(&histograms.knowledge)));
    assert_eq!(read.slices.len(), histograms.knowledge.len());
    assert_eq!((&read.stages, &read.staleness), (&histograms.stages, &histograms.staleness));
    assert_eq!(run.loads[1].knowledge.as_ref().map(hdrhistogram::Histogram::len), Some(0));
}

#[test]
fn a_directory_holds_the_promised_files_and_nothing_else() {
    let place = tempfile::tempdir().unwrap();
    leave_run(place.path(), &[2]);
    let names = files(place.path());
    for name in ["env.json", "events.jsonl", "measurements.csv", "scenario.resolved.toml"] {
        assert!(names.iter().any(|other| other == name), "{name} in {names:?}");
    }
    assert_eq!(names.iter().filter(|name| name.ends_with(".hgrm")).count(), STRATEGIES.len());
    assert_eq!(names.iter().filter(|name| name.ends_with(".hlog")).count(), STRATEGIES.len());
    assert_eq!(names.iter().filter(|name| name.ends_with(".partial")).count(), 0);
}

#[test]
fn every_line_file_reads_after_being_cut_anywhere() {
    let place = tempfile::tempdir().unwrap();
    leave_run(&place.path().join("turns"), &[2]);
    leave_loads(&place.path().join("loads"), 1, 2, 20, 1.2);
    let of_turns = ["turns/trials.jsonl", "turns/timings.jsonl", "turns/events.jsonl"];
    for path in of_turns.into_iter().chain(["loads/loads.jsonl", "loads/capacities.jsonl"]) {
        let (run, name) = path.split_once('/').unwrap();
        cut_anywhere(&place.path().join(run), name);
    }
}

fn cut_anywhere(place: &Path, name: &str) {
    let mut stream = Stream::new(1, 0, Purpose::Test, 0);
    let whole = std::fs::read(place.join(name)).unwrap();
    let line_ends = (0..=whole.len()).filter(|&end| end == 0 || whole[end - 1] == b'\n');
    let length = u32::try_from(whole.len()).unwrap();
    let random = (0..20).map(|_| stream.below(length) as usize).collect::<Vec<_>>();
    for end in line_ends.chain(random) {
        std::fs::write(place.join(name), &whole[..end]).unwrap();
        let run = read_run(place).unwrap();
        let lines = whole[..end].iter().filter(|&&byte| byte == b'\n').count();
        let is_torn = end > 0 && whole[end - 1] != b'\n';
        let read = match name {
            TRIALS_FILE => run.trials.len(),
            EVENTS_FILE => run.events.len(),
            LOADS_FILE => run.loads.len(),
            CAPACITIES_FILE => run.capacities.len(),
            _ => run.timings.len(),
        };
        assert_eq!(read, lines, "{name} cut at {end}");
        let told = run.missing.iter().any(|lack| lack.file == name && lack.what.contains("torn"));
        assert_eq!(told, is_torn, "{name} cut at {end}: {:?}", run.missing);
        // Whatever is left can be summed up.
        let summary = Summary::of(&run);
        assert_eq!(summary.deterministic.trials.len(), run.trials.len());
    }
    std::fs::write(place.join(name), &whole).unwrap();
}

#[test]
fn any_file_may_be_absent_or_damaged() {
    let place = tempfile::tempdir().unwrap();
    leave_run(place.path(), &[2]);
    for name in files(place.path()) {
        let path = place.path().join(&name);
        let whole = std::fs::read(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        let told = read_run(place.path()).unwrap().missing.iter().any(|lack| lack.file == name);
        assert!(told, "{name}");
        let mut damaged = whole.clone();
        damaged.iter_mut().skip(whole.len() / 2).for_each(|byte| *byte ^= 0xa5);
        std::fs::write(&path, damaged).unwrap();
        let _ = Summary::of(&read_run(place.path()).unwrap());
        std::fs::write(&path, whole).unwrap();
    }
    assert_eq!(read_run(place.path()).unwrap().missing, []);
}

#[test]
fn however_many_rows_are_damaged_they_are_told_in_one_line() {
    let place = tempfile::tempdir().unwrap();
    leave_run(place.path(), &[2]);
    for (name, part, header) in [(MEASUREMENTS_FILE, "row", 1), (TRIALS_FILE, "line", 0)] {
        let path = place.path().join(name);
        let whole = std::fs::read_to_string(&path).unwrap();
        // From the fourth on every one.
        let damaged: Vec<&str> = (0..)
            .zip(whole.lines())
            .map(|(number, line)| if number < header + 3 { line } else { "{" })
            .collect();
        let count = damaged.iter().filter(|line| **line == "{").count();
        std::fs::write(&path, damaged.join("\n") + "\n").unwrap();
        let missing = read_run(place.path()).unwrap().missing;
        let told: Vec<&str> = missing
            .iter()
            .filter(|lack| lack.file == name && lack.what.contains("damaged"))
            .map(|lack| lack.what.as_str())
            .collect();
        let [only] = told[..] else { panic!("{told:?}") };
        let wanted = format!("{count} {part}s are damaged: {part} {} is damaged", header + 4);
        assert!(only.starts_with(&wanted), "{only}");
        std::fs::write(&path, whole).unwrap();
    }
}

#[test]
fn a_run_that_was_killed_says_so_and_keeps_its_results() {
    let place = tempfile::tempdir().unwrap();
    let mut store = Store::create(Place::Exactly(place.path()), &provenance(), "").unwrap();
    store.append_trial(&trial(2, StrategyKind::Full, 0)).unwrap();
    drop(store);
    let run = read_run(place.path()).unwrap();
    assert_eq!((run.trials.len(), run.outcome()), (1, None));
    assert!(run.missing.iter().any(|lack| lack.what.contains("killed")), "{:?}", run.missing);
}

#[test]
fn incidents_reach_the_summary_and_plain_progress_does_not() {
    let place = tempfile::tempdir().unwrap();
    let mut store = Store::create(Place::Exactly(place.path()), &provenance(), "").unwrap();
    let lost = Event::CraftLost {
        size: 2,
        name: "craft-1".into(),
        end: ProcessEnd::Signal(9),
        phase: "turn 3 of trial 0".into(),
    };
    store
        .event(Event::FleetStarted { block: 0, size: 2, processes: 2, order: Vec::new() })
        .unwrap();
    store.event(lost.clone()).unwrap();
    let mut partial = trial(2, StrategyKind::Full, 0);
    partial.deterministic.end = TrialEnd::Partial;
    partial.deterministic.measured.replication.requests -= 1;
    store.append_trial(&partial).unwrap();
    let summary = store.finish(Outcome::Partial).unwrap();
    let told: Vec<&Event> = summary.timing.incidents.iter().map(|line| &line.event).collect();
    assert_eq!(told, [&lost]);
    assert_eq!(summary.timing.outcome, Some(Outcome::Partial));
    let cell = summary.counted(2, StrategyKind::Full).unwrap();
    assert_eq!(cell.figures.value("requests"), None, "a partial trial is in no mean");
    assert_eq!(cell.ends[&TrialEnd::Partial], 1);
    assert!(cell.agrees_with_oracle, "a loss is no broken identity");
}

#[test]
fn one_request_too_few_breaks_the_agreement() {
    let place = tempfile::tempdir().unwrap();
    let mut store = Store::create(Place::Exactly(place.path()), &provenance(), "").unwrap();
    let mut wrong = trial(2, StrategyKind::Full, 0);
    wrong.deterministic.measured.replication.requests -= 1;
    store.append_trial(&wrong).unwrap();
    assert!(!store.finish(Outcome::Broken).unwrap().agrees_with_oracle());
}

#[test]
fn equal_records_give_equal_bytes_in_the_deterministic_part() {
    let text = |order: &[u32], duration_ns: u64| {
        let place = tempfile::tempdir().unwrap();
        let mut store = Store::create(Place::Exactly(place.path()), &provenance(), "").unwrap();
        for &number in order {
            let mut record = trial(3, StrategyKind::Boundary, number);
            record.timing.duration_ns = duration_ns;
            store.append_trial(&record).unwrap();
        }
        store.finish(Outcome::Success).unwrap();
        let summary = std::fs::read_to_string(place.path().join(SUMMARY_FILE)).unwrap();
        let document: serde_json::Value = serde_json::from_str(&summary).unwrap();
        serde_json::to_string(&document["deterministic"]).unwrap()
    };
    assert_eq!(text(&[0, 1, 2], 1), text(&[2, 0, 1], 99));
}

#[test]
fn the_deterministic_part_names_no_clock_host_or_path() {
    let place = tempfile::tempdir().unwrap();
    let summary = leave_run(place.path(), &[2]);
    let text = serde_json::to_string(&summary.deterministic).unwrap();
    for word in
        ["_ns", "cpu", "\"date", "kernel", "epoch", "resident", place.path().to_str().unwrap()]
    {
        assert!(!text.contains(word), "{word}");
    }
}

#[test]
fn figures_are_those_of_the_records() {
    let place = tempfile::tempdir().unwrap();
    let summary = leave_run(place.path(), &[3]);
    let boundary = &summary.counted(3, StrategyKind::Boundary).unwrap().figures;
    // Trials 0..10 have 1 2 3 4 1 2 3 4 1 2 turns, odd trials one boundary firing more.
    assert_eq!(boundary.value("turns"), Some(2.3));
    assert_eq!(boundary.value("requests"), Some(2.8));
    let limited = &summary.counted(3, StrategyKind::Limited).unwrap().figures;
    assert_eq!(limited.value("requests-to-boundary"), Some(2.0));
    assert_eq!(limited.value("requests-to-full"), Some(56.0 / 69.0));
    let full = &summary.timed(3, StrategyKind::Full).unwrap().figures;
    assert_eq!(full.get("turn-time-p50").map(|figure| figure.n), Some(1000));
    assert_eq!(full.value("turn-time-p99.9"), None, "1,000 turns do not carry p99.9");
    assert!(full.value("turn-time-p99").is_some());
    assert_eq!(full.value("cpu-per-turn-over-null"), Some(5000.0));
    let floor = &summary.timed(3, StrategyKind::Null).unwrap().figures;
    assert_eq!(floor.value("turn-time-p50-over-null"), None, "the floor has no excess over itself");
    assert!(Quantile::P999.values_needed() > 1000);
}

#[test]
fn the_latest_link_is_relative_and_follows_the_newest_run() {
    let root = tempfile::tempdir().unwrap();
    let first = Store::create(Place::Below(root.path()), &provenance(), "").unwrap();
    let second = Store::create(Place::Below(root.path()), &provenance(), "").unwrap();
    assert_ne!(first.directory(), second.directory(), "two runs of one second stay apart");
    let target = std::fs::read_link(root.path().join(LATEST_LINK)).unwrap();
    assert_eq!(target, Path::new("paper/20261122T150405Z-7-2"));
    assert_eq!(files(root.path()), ["latest", "paper"], "no temporary link remains");
    let through_root = read_run(root.path()).unwrap();
    assert_eq!(through_root.directory, second.directory().canonicalize().unwrap());
}

#[test]
fn names_of_scenarios_cannot_leave_the_root() {
    for name in ["../../etc", "a/b", "", "..", "latest"] {
        let root = tempfile::tempdir().unwrap();
        let provenance = Provenance { scenario: name.into(), ..provenance() };
        let store = Store::create(Place::Below(root.path()), &provenance, "").unwrap();
        let inside = store.directory().strip_prefix(root.path()).unwrap();
        assert_eq!(inside.components().count(), 2, "{name}: {}", inside.display());
    }
}

#[test]
fn a_directory_that_cannot_be_written_is_refused_with_path_and_remedy() {
    let root = tempfile::tempdir().unwrap();
    // A file where a directory is needed stops everybody, root as well.
    let file = root.path().join("occupied");
    std::fs::write(&file, "").unwrap();
    for place in [Place::Below(&file), Place::Exactly(&file)] {
        let error = Store::create(place, &provenance(), "").unwrap_err().to_string();
        assert!(error.contains("occupied") && error.contains("--out"), "{error}");
    }
    let locked = root.path().join("locked");
    std::fs::create_dir(&locked).unwrap();
    std::fs::set_permissions(&locked, std::fs::Permissions::from_mode(0o500)).unwrap();
    if !rustix::process::geteuid().is_root() {
        assert!(Store::create(Place::Below(&locked), &provenance(), "").is_err());
        assert_eq!(files(&locked), Vec::<String>::new());
    }
}

#[test]
fn foreign_files_are_never_overwritten() {
    let root = tempfile::tempdir().unwrap();
    std::fs::write(root.path().join("thesis.txt"), "years of work").unwrap();
    let refused = Store::create(Place::Exactly(root.path()), &provenance(), "");
    assert!(matches!(refused, Err(StoreError::NotEmpty { .. })));
    assert_eq!(files(root.path()), ["thesis.txt"]);
}

#[test]
fn a_directory_without_a_run_is_refused() {
    let root = tempfile::tempdir().unwrap();
    assert!(matches!(read_run(root.path()), Err(ReadError::NoRun { .. })));
    assert!(matches!(read_run(&root.path().join("absent")), Err(ReadError::Unreadable { .. })));
}

#[test]
fn the_long_form_has_every_value_of_a_trial_once() {
    let place = tempfile::tempdir().unwrap();
    leave_run(place.path(), &[2]);
    let mut reader = csv::Reader::from_path(place.path().join("measurements.csv")).unwrap();
    let header: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
    assert_eq!(header, super::measurements::HEADER);
    let rows: Vec<Vec<String>> =
        reader.records().map(|row| row.unwrap().iter().map(str::to_owned).collect()).collect();
    let mut keys: Vec<&[String]> = rows.iter().map(|row| &row[..9]).collect();
    keys.sort();
    keys.dedup();
    assert_eq!(keys.len(), rows.len(), "no value stands there twice");
    let requests: u64 = rows
        .iter()
        .filter(|row| row[2] == "boundary" && row[7] == "fleet" && row[8] == "replication-requests")
        .filter(|row| row[3] == "counted")
        .map(|row| row[9].parse::<u64>().unwrap())
        .sum();
    assert_eq!(requests, 28);
}

#[test]
fn the_long_form_has_what_recovery_did_of_every_cell_that_recovers() {
    let place = tempfile::tempdir().unwrap();
    leave_loads(place.path(), 1, 2, 20, 1.0);
    let mut reader = csv::Reader::from_path(place.path().join("measurements.csv")).unwrap();
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    let found: Vec<[&str; 5]> = rows
        .iter()
        .filter(|row| row[8].starts_with("recovery-"))
        .map(|row| [&row[2], &row[7], &row[8], &row[9], &row[10]])
        .collect();
    let values = super::recovered::values(&RECOVERY).map(|(metric, value, unit, _)| {
        [
            "full".to_owned(),
            "fleet".to_owned(),
            metric.to_owned(),
            value.to_string(),
            unit.to_owned(),
        ]
    });
    assert_eq!(found, [values.clone(), values].concat(), "once a block");
}

#[test]
fn of_a_very_large_fleet_only_the_crafts_that_differ_are_kept() {
    let place = tempfile::tempdir().unwrap();
    let mut store = Store::create(Place::Exactly(place.path()), &provenance(), "").unwrap();
    let mut record = trial(5000, StrategyKind::Full, 0);
    record.deterministic.crafts[17].measured.replication.requests += 1;
    store.append_trial(&record).unwrap();
    let read = read_run(place.path()).unwrap().trials.remove(0).deterministic;
    assert_eq!(read.crafts, record.deterministic.crafts[17..=17]);
    assert_eq!(read.measured, record.deterministic.measured);
    assert!(!read.agrees_with_oracle());
}

#[test]
fn the_data_dictionary_names_every_metric_of_the_long_form() {
    const DICTIONARY: &str = include_str!("../../../docs/data-dictionary.md");
    let place = tempfile::tempdir().unwrap();
    leave_run(&place.path().join("turns"), &[2]);
    leave_loads(&place.path().join("loads"), 1, 1, 20, 1.0);
    let mut metrics = std::collections::BTreeSet::new();
    for run in ["turns", "loads"] {
        let path = place.path().join(run).join("measurements.csv");
        let mut reader = csv::Reader::from_path(path).unwrap();
        metrics.extend(reader.records().map(|row| row.unwrap()[8].to_owned()));
    }
    assert!(metrics.len() > 100, "{}", metrics.len());
    for metric in metrics {
        let (class, count) = metric.rsplit_once('-').unwrap_or((&metric, ""));
        let has_points = ["n", "min", "mean", "max"].contains(&count) || count.starts_with('p');
        let names = [
            format!("`{metric}`"),
            // Traffic stands there as class and count.
            format!("`{}-*`", class.trim_end_matches("-bytes")),
            // So do histograms.
            if has_points { format!("`{class}-n`") } else { String::new() },
            if count.parse::<u32>().is_ok() { "`turn-time-1`".to_owned() } else { String::new() },
        ];
        let is_named = names.iter().any(|name| !name.is_empty() && DICTIONARY.contains(name));
        assert!(is_named, "{metric}");
    }
}

#[test]
fn nine_blocks_find_a_fifth_and_eight_do_not_name_it() {
    let place = tempfile::tempdir().unwrap();
    let compared = |run: u32, blocks: u32, slowdown| {
        let directory = place.path().join(format!("{run}-{blocks}-{slowdown}"));
        leave_blocks(&directory, run, blocks, slowdown).timing.compared.remove(0)
    };
    let found = compared(7, 9, 1.2);
    assert_eq!((found.strategy, found.base), (StrategyKind::Full, StrategyKind::Boundary));
    assert_eq!(found.comparison.verdict, Verdict::Winner);
    assert_eq!(found.winner, Some(StrategyKind::Boundary));
    assert!((found.comparison.ratio - 1.2).abs() < 0.02, "{}", found.comparison.ratio);
    assert!(found.comparison.floor.unwrap() < 1.02);
    assert_eq!(compared(7, 8, 1.2).comparison.verdict, Verdict::TooFewBlocks);
    // By chance alone one in twenty may come out.
    let named = (0..20).filter(|&run| compared(run, 9, 1.0).winner.is_some()).count();
    assert!(named <= 2, "{named} winners in 20 runs without a difference");
}

#[test]
fn controls_say_whether_what_was_planted_is_found() {
    let place = tempfile::tempdir().unwrap();
    let controls = |run: u32, blocks: u32, slowdown| {
        let directory = place.path().join(format!("{run}-{blocks}-{slowdown}"));
        leave_blocks(&directory, run, blocks, slowdown).timing.controls
    };
    let of_nine = controls(7, 9, 1.2);
    let planted: Vec<_> =
        of_nine.iter().map(|one| (one.planted_percent, one.comparison.verdict)).collect();
    assert_eq!(planted, [(0, Verdict::Tie), (20, Verdict::Winner)]);
    assert!(of_nine.iter().all(|control| control.is_right == Some(true)), "{of_nine:?}");
    assert_eq!(controls(7, 9, 1.0)[1].is_right, Some(false), "nothing was slowed down");
    assert!(controls(7, 8, 1.2).iter().all(|control| control.is_right.is_none()));
}

#[test]
fn intervals_cover_blocks_and_the_excess_is_narrower_than_its_parts() {
    let place = tempfile::tempdir().unwrap();
    let summary = leave_blocks(place.path(), 7, 9, 1.2);
    let figures = &summary.timed(3, StrategyKind::Boundary).unwrap().figures;
    let width = |metric: &str| {
        let figure = figures.get(metric).unwrap();
        let (value, low, high) = (figure.value.unwrap(), figure.low.unwrap(), figure.high.unwrap());
        assert!(low <= value && value <= high, "{metric}: {low} {value} {high}");
        high - low
    };
    // Blocks move both alike, and the excess is half the time: so is its interval.
    assert!(width("turn-time-p50-over-null") < 0.8 * width("turn-time-p50"));
    assert!(width("cpu-per-turn-over-null") < 0.8 * width("cpu-per-turn"));
    let of_two = leave_blocks(&place.path().join("two"), 7, 2, 1.2);
    let figures = &of_two.timed(3, StrategyKind::Boundary).unwrap().figures;
    assert_eq!(figures.get("turn-time-p50").unwrap().low, None, "two blocks have no interval");
}

#[test]
fn directories_without_labels_and_orders_are_still_read() {
    let place = tempfile::tempdir().unwrap();
    let summary = leave_run(place.path(), &[2]);
    for (name, pattern) in
        [("timings.jsonl", ",\"place\":0"), (EVENTS_FILE, ",\"order\":[\"null\"]")]
    {
        let text = std::fs::read_to_string(place.path().join(name)).unwrap();
        assert!(text.contains(pattern), "{text}");
        std::fs::write(place.path().join(name), text.replace(pattern, "")).unwrap();
    }
    let run = read_run(place.path()).unwrap();
    assert_eq!(run.missing, []);
    assert_eq!(Summary::of(&run), summary);
}
