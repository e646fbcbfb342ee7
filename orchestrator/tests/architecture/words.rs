//! Words that no text of the repository may hold: absolute paths of somebody's machine.

use crate::Violation;
use crate::rust_text::line_of;

/// Beginnings of such paths, written so that this file does not hold them itself.
const PLACES: [&str; 3] = [concat!("/", "home/"), concat!("/", "root/"), concat!("/", "work/")];

pub(crate) fn check(path: &str, text: &str) -> Vec<Violation> {
    let found_at = |place: &'static str| text.match_indices(place);
    PLACES
        .into_iter()
        .flat_map(found_at)
        .filter(|(at, _)| begins_a_path(text, *at))
        .map(|(at, place)| Violation {
            file: path.to_owned(),
            line: line_of(text, at),
            what: format!("`{place}` lies on one machine; write a relative path or a placeholder"),
        })
        .collect()
}

/// Whether nothing stands before byte `at` that would make it the middle of a path or address.
fn begins_a_path(text: &str, at: usize) -> bool {
    let before = text[..at].chars().next_back();
    !before.is_some_and(|before| before.is_alphanumeric() || "._-~/}".contains(before))
}

#[test]
fn a_path_of_one_machine_is_found_with_its_line() {
    for place in PLACES {
        let found = check("a.md", &format!("one\ntwo `{place}somebody`"));
        assert_eq!(found.iter().map(|found| found.line).collect::<Vec<_>>(), [2], "{place}");
    }
}

#[test]
fn the_middle_of_a_relative_path_or_address_is_no_place() {
    for place in PLACES {
        assert_eq!(check("a.md", &format!("src{place}mod.rs https://example.org{place}")), []);
    }
}
