//! What `report` writes beside its tables, and where: the page and the pictures.

use crate::invocation::Place;
use std::path::Path;

/// A place with a run of a preset.
fn simulated() -> Place {
    let place = Place::new();
    place.run(&["simulate", "two-craft", "--trials", "2"]).expect_code(0);
    place
}

/// The text of a well-formed file.
#[track_caller]
fn well_formed(path: &Path) -> String {
    let text = std::fs::read_to_string(path).unwrap();
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
    roxmltree::Document::parse_with_options(&text, options).unwrap();
    text
}

#[test]
fn report_writes_a_page_and_pictures_into_the_run_it_is_of() {
    let place = simulated();
    let report = place.run(&["report", "runs/latest"]).expect_code(0);
    let run = place.files().join("runs/latest");
    let page = well_formed(&run.join("report.html"));
    assert!(page.contains("id=\"requests\""), "{page}");
    well_formed(&run.join("pictures/requests.svg"));
    assert!(report.stderr.contains("report.html"), "{report}");
    assert!(report.stdout.contains("boundary"), "{report}");
    let again = place.run(&["report", "runs/latest", "--quiet"]).expect_code(0);
    assert_eq!(again.stderr, "");
    assert_eq!(well_formed(&run.join("report.html")), page, "the same bytes again");
}

#[test]
fn pictures_go_where_they_are_asked_for_or_nowhere() {
    let place = simulated();
    let run = place.files().join("runs/latest");
    for words in ["--pictures none", "--format json", "--format csv"] {
        let words: Vec<&str> =
            ["report", "runs/latest"].into_iter().chain(words.split(' ')).collect();
        place.run(&words).expect_code(0);
        assert!(!run.join("report.html").exists() && !run.join("pictures").exists(), "{words:?}");
    }
    let words = ["report", "runs/latest", "--format", "json", "--pictures", "else/where"];
    place.run(&words).expect_code(0);
    well_formed(&place.files().join("else/where/report.html"));
    assert!(!run.join("report.html").exists());
}

#[test]
fn a_place_that_cannot_be_written_costs_no_table() {
    let place = simulated();
    place.write("runs/latest/pictures", "a file where a folder should be");
    let report = place.run(&["report", "runs/latest"]).expect_code(0);
    assert!(report.stdout.contains("boundary"), "{report}");
    assert!(report.stderr.contains("cannot be written"), "{report}");
    assert!(report.stderr.contains("--pictures DIR"), "{report}");
}
