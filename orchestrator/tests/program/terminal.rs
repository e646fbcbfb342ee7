//! What is printed where nobody draws: no colour, no progress, nothing wider than 80 columns.

use crate::invocation::{Finished, Place};

/// Columns of the narrowest terminal that everything fits.
const COLUMNS: usize = 80;

/// A line may be wider only because of a path in it.
#[track_caller]
fn assert_plain(finished: &Finished) {
    for line in finished.stdout.lines().chain(finished.stderr.lines()) {
        let is_path = line.split_whitespace().any(|word| word.contains('/') && word.len() > 30);
        assert!(line.chars().count() <= COLUMNS || is_path, "too wide: {line}\n{finished}");
        assert!(!line.contains(['\u{1b}', '\r']), "control characters: {line:?}");
    }
}

#[test]
fn everything_fits_a_narrow_terminal_and_is_plain_in_a_pipe() {
    let place = Place::for_fleets();
    for words in [
        "compare --sizes 2,5 --trials 3 --set run.timing-epochs=1",
        "compare --sizes 2,5 --trials 3 --no-timing --all",
        "run hierarchy-13 --trials 2",
        "run planetary-survey --trials 2 --all",
        "simulate two-craft",
        "report runs/latest --all",
        "reproduce --simulated --trials 2 table-21 table-22",
        "list",
        "show two-craft",
        "show planetary-survey",
        "show hierarchy-13",
        "validate planetary-survey",
        "clean",
        "--help",
        "compare --help",
        "run --help",
    ] {
        let finished = place.run(&words.split(' ').collect::<Vec<_>>()).expect_code(0);
        assert!(!finished.stdout.is_empty(), "{finished}");
        assert_plain(&finished);
    }
    let doctor = place.run(&["doctor"]);
    assert_plain(&doctor);
}

#[test]
fn quiet_runs_print_results_only() {
    let place = Place::for_fleets();
    let finished = place.run(&["run", "planetary-survey", "--trials", "1", "--quiet"]);
    let finished = finished.expect_code(0);
    assert_eq!(finished.stderr, "");
    assert!(finished.stdout.contains("boundary"));
}
