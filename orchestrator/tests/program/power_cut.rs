//! What `report` makes of a directory after a power cut: it prints what is there and says what is not.

use crate::invocation::{Finished, Place};
use std::path::{Path, PathBuf};

/// Every file below `directory`, sorted.
fn files(directory: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { files.extend(self::files(&path)) } else { files.push(path) }
    }
    files.sort();
    files
}

/// What a power cut leaves of `whole`: half of it, half and zeros, nothing but zeros, nothing.
fn remains(whole: &[u8]) -> [Vec<u8>; 4] {
    let half = whole[..whole.len() / 2].to_vec();
    let mut blank_from_half = half.clone();
    blank_from_half.resize(whole.len(), 0);
    [half, blank_from_half, vec![0; whole.len()], Vec::new()]
}

/// Damages one file after the other and reports each time.
fn after_each_cut(place: &Place, directory: &Path, check: impl Fn(&str, &Finished)) {
    for path in files(directory) {
        let whole = std::fs::read(&path).unwrap();
        let name = path.strip_prefix(directory).unwrap().display().to_string();
        for left in remains(&whole).into_iter().filter(|left| *left != whole) {
            std::fs::write(&path, left).unwrap();
            let report = place.run(&["report", "runs/latest"]).expect_code(0);
            assert!(!report.stdout.is_empty() && !report.stderr.contains("panicked"), "{report}");
            check(&name, &report);
        }
        std::fs::write(&path, &whole).unwrap();
    }
}

#[test]
fn a_run_is_reported_whatever_was_cut_and_pictures_are_drawn_again() {
    let place = Place::new();
    place.run(&["simulate", "two-craft", "--trials", "2"]).expect_code(0);
    place.run(&["report", "runs/latest"]).expect_code(0);
    let run = std::fs::canonicalize(place.files().join("runs/latest")).unwrap();
    let drawn: Vec<PathBuf> = files(&run)
        .into_iter()
        .filter(|path| path.extension().is_some_and(|e| e == "svg"))
        .collect();
    assert!(!drawn.is_empty());
    after_each_cut(&place, &run, |name, report| {
        for picture in &drawn {
            let text = std::fs::read_to_string(picture).unwrap();
            assert!(text.trim_end().ends_with("</svg>"), "{name}: {}", picture.display());
        }
        // What is drawn again is whole again, and half a scenario may be one.
        let is_told = report.stdout.contains(name);
        let may_be_silent = [".html", ".svg", ".toml"].iter().any(|end| name.ends_with(end));
        assert!(is_told || may_be_silent, "{name}: {report}");
    });
}

#[test]
fn a_sweep_is_reported_whatever_was_cut() {
    let place = Place::new();
    let vary = ["--vary", "run.seed=5,6", "--trials", "2", "--strategies", "boundary"];
    place.run(&[&["sweep", "two-craft", "--simulated"], &vary[..]].concat()).expect_code(0);
    let sweep = std::fs::canonicalize(place.files().join("runs/latest")).unwrap();
    after_each_cut(&place, &sweep, |name, report| {
        if name == "sweep.json" {
            assert!(report.stderr.contains("sweep.json"), "{report}");
            assert!(report.stdout.contains("001-seed-6"), "{report}");
        }
    });
}

#[test]
fn a_campaign_is_reported_whatever_was_cut() {
    let place = Place::for_fleets();
    place.run(&["campaign", "--kills", "1", "--sizes", "2", "--seed", "2"]).expect_code(0);
    let run = std::fs::canonicalize(place.files().join("runs/latest")).unwrap();
    let told = |name: &str, report: &Finished| {
        let may_be_silent = name.ends_with(".toml");
        assert!(report.stdout.contains(name) || may_be_silent, "{name}: {report}");
    };
    after_each_cut(&place, &run, told);
    // Between two lines: nothing is torn, and what is gone is counted elsewhere.
    let faults = run.join("faults.jsonl");
    let whole = std::fs::read_to_string(&faults).unwrap();
    for end in whole.match_indices('\n').map(|(end, _)| end + 1).filter(|&end| end < whole.len()) {
        std::fs::write(&faults, &whole[..end]).unwrap();
        told("faults.jsonl", &place.run(&["report", "runs/latest"]).expect_code(0));
    }
}
