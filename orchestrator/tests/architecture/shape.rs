//! The shape of a Rust file: its head, its length, its name, and what it must not hold.

use crate::Violation;
use crate::rust_text::{RustFile, code_of, line_of};

/// Most lines of a file.
const LINES_MAX: usize = 400;

/// Data tables, which may be longer. A file that needs it no longer is taken off.
const DATA_TABLES: [&str; 0] = [];

/// Where `unsafe` may stand: what begins with one of these.
const UNSAFE_PLACES: [&str; 3] = [
    "orchestrator/src/launch/os_process.rs",
    "shared-types/src/transport/iceoryx/",
    "shared-types/src/transport/heartbeat/mapping.rs",
];

/// Names that say nothing about what is inside.
const EMPTY_NAMES: [&str; 8] =
    ["util", "utils", "common", "misc", "helper", "helpers", "manager", "managers"];

pub(crate) fn check_head(file: &RustFile) -> Vec<Violation> {
    let has_head = file.source.starts_with("//!");
    let what = "the file does not begin with `//!`; say what lives here, how it works, and what is \
                deliberately not here";
    violation_unless(has_head, file, 1, what)
}

pub(crate) fn check_length(file: &RustFile) -> Vec<Violation> {
    let lines = file.source.lines().count();
    let is_table = DATA_TABLES.contains(&file.path.as_str());
    if is_table && lines <= LINES_MAX {
        return violation_unless(false, file, 1, "no longer a long table; take it off DATA_TABLES");
    }
    let fits = lines <= LINES_MAX || is_table || file.is_test;
    let what = format!(
        "{lines} lines, at most {LINES_MAX}; split by subject, or move tests to a sibling tests.rs"
    );
    violation_unless(fits, file, LINES_MAX + 1, &what)
}

pub(crate) fn check_name(file: &RustFile) -> Vec<Violation> {
    let parts = file.path.split('/').map(|part| part.trim_end_matches(".rs"));
    let empty: Vec<&str> = parts.filter(|part| EMPTY_NAMES.contains(part)).collect();
    let what = format!("{empty:?} says nothing; name the file after its subject");
    violation_unless(empty.is_empty(), file, 1, &what)
}

pub(crate) fn check_calls(file: &RustFile) -> Vec<Violation> {
    let code = code_of(&file.source);
    let mut found = Vec::new();
    let mut forbid = |code: &str, call: &str, remedy: &str| {
        found.extend(code.match_indices(call).map(|(at, _)| Violation {
            file: file.path.clone(),
            line: line_of(code, at),
            what: format!("`{call}`: {remedy}"),
        }));
    };
    forbid(&code, "todo!", "finish it or leave it out");
    forbid(&code, "unimplemented!", "finish it or leave it out");
    forbid(&code, "#[ignore", "make the test fast, or put the long version behind a flag");
    let remedy = "return the error, or `expect(\"invariant: ...\")` if only a bug can cause it";
    forbid(&file.product_code(), ".unwrap()", remedy);
    found
}

/// `unsafe` is denied, so that whoever needs it has to name the lint.
pub(crate) fn check_unsafe(file: &RustFile) -> Vec<Violation> {
    let code = file.product_code();
    if UNSAFE_PLACES.iter().any(|place| file.path.starts_with(place)) {
        return Vec::new();
    }
    let line = code.find("unsafe_code").map(|at| line_of(&code, at));
    let what = "`unsafe` stands in named files only; use zerocopy or rustix, or move it there";
    violation_unless(line.is_none(), file, line.unwrap_or(1), what)
}

fn violation_unless(holds: bool, file: &RustFile, line: usize, what: &str) -> Vec<Violation> {
    if holds {
        Vec::new()
    } else {
        vec![Violation { file: file.path.clone(), line, what: what.to_owned() }]
    }
}

#[test]
fn a_file_without_a_head_is_found() {
    assert_eq!(check_head(&RustFile::new("a/src/b.rs", "//! Says it.\n")), []);
    assert_eq!(check_head(&RustFile::new("a/src/b.rs", "use a;\n//! Too late.\n")).len(), 1);
    assert_eq!(check_head(&RustFile::new("a/src/b.rs", "")).len(), 1);
}

#[test]
fn a_long_file_is_found_unless_it_is_a_test() {
    let long = "//\n".repeat(LINES_MAX + 1);
    assert_eq!(check_length(&RustFile::new("a/src/b.rs", &long)).len(), 1);
    assert_eq!(check_length(&RustFile::new("a/src/b.rs", &long[3..])), []);
    assert_eq!(check_length(&RustFile::new("a/src/b/tests.rs", &long)), []);
    assert_eq!(check_length(&RustFile::new("a/tests/b.rs", &long)), []);
}

#[test]
fn an_empty_name_is_found() {
    for path in ["a/src/util.rs", "a/src/common/mod.rs", "a/src/b/manager.rs"] {
        assert_eq!(check_name(&RustFile::new(path, "")).len(), 1, "{path}");
    }
    assert_eq!(check_name(&RustFile::new("a/src/utilisation.rs", "")), []);
}

#[test]
fn unsafe_outside_its_places_is_found_with_its_line() {
    let source = "//! Head.\n#[expect(unsafe_code, reason = \"b\")]\nfn a() {}";
    let found = check_unsafe(&RustFile::new("agent/src/a.rs", source));
    assert_eq!(found.iter().map(|found| found.line).collect::<Vec<_>>(), [2]);
    assert_eq!(check_unsafe(&RustFile::new(UNSAFE_PLACES[0], source)), []);
    assert_eq!(check_unsafe(&RustFile::new("agent/tests/a.rs", source)), []);
}

#[test]
fn a_forbidden_call_is_found_with_its_line() {
    let lines = |path: &str, source: &str| {
        check_calls(&RustFile::new(path, source)).iter().map(|found| found.line).collect::<Vec<_>>()
    };
    assert_eq!(lines("a/src/b.rs", "fn a() {\n    b.unwrap();\n}"), [2]);
    assert_eq!(lines("a/src/b.rs", "fn a() {\n    todo!()\n}"), [2]);
    assert_eq!(lines("a/tests/b.rs", "#[test]\n#[ignore]\nfn a() { b.unwrap() }"), [2]);
    assert_eq!(lines("a/src/b.rs", "/// b.unwrap()\nfn a() { c(\"todo!\") }"), []);
    assert_eq!(lines("a/src/b.rs", "#[cfg(test)]\nmod tests { fn a() { b.unwrap() } }"), []);
    assert_eq!(lines("a/src/b.rs", "fn a() { b.unwrap_or(0) }"), []);
}
