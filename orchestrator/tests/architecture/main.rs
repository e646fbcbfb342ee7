//! Holds the code to docs/architecture.md: directions of imports, shape of files, packages, licences.
//!
//! Each rule is a checker on text in a module of its own, tested there on planted violations; the
//! tests in this file run the checkers over the repository. An error names file and line, what is
//! wrong and what to do. A rule that is wrong is changed here, in the same commit as the code.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod directions;
mod imports;
mod licences;
mod limits_page;
mod packages;
mod repository;
mod rust_text;
mod shape;
mod words;

use repository::Repository;
use rust_text::RustFile;
use std::fmt;

/// One place that breaks a rule.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Violation {
    /// Path from the repository's root.
    file: String,
    /// From 1.
    line: usize,
    /// What is wrong and the remedy.
    what: String,
}

impl fmt::Display for Violation {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}:{}: {}", self.file, self.line, self.what)
    }
}

/// Fails with every violation, if there is one.
fn expect_none(violations: impl IntoIterator<Item = Violation>) {
    let lines: Vec<String> =
        violations.into_iter().map(|violation| format!("\n  {violation}")).collect();
    assert!(lines.is_empty(), "{} violations:{}", lines.len(), lines.concat());
}

/// Runs `check` on every Rust file.
fn check_rust_files(check: impl Fn(&RustFile) -> Vec<Violation>) {
    let files = Repository::find().rust_files();
    assert!(files.len() > 50, "invariant: the crates are found");
    expect_none(files.iter().flat_map(check));
}

#[test]
fn crates_import_only_downward() {
    let repository = Repository::find();
    for rule in packages::CRATES {
        let manifest = format!("{}/Cargo.toml", rule.directory);
        expect_none(packages::check_manifest(rule, &manifest, &repository.read(&manifest)));
    }
}

#[test]
fn modules_import_only_downward() {
    check_rust_files(directions::check);
}

#[test]
fn every_rule_of_direction_is_about_a_module() {
    let files = Repository::find().rust_files();
    let unknown: Vec<&str> =
        directions::modules().filter(|module| !directions::exists(module, &files)).collect();
    assert_eq!(unknown, [""; 0], "the module is gone; edit directions.rs");
}

#[test]
fn every_file_says_what_lives_in_it() {
    check_rust_files(shape::check_head);
}

#[test]
fn no_file_is_too_long() {
    check_rust_files(shape::check_length);
}

#[test]
fn every_name_says_what_the_file_is_about() {
    check_rust_files(shape::check_name);
}

#[test]
fn nothing_is_left_to_do_and_nothing_unwraps() {
    check_rust_files(shape::check_calls);
}

#[test]
fn unsafe_stands_in_named_files_only() {
    check_rust_files(shape::check_unsafe);
}

#[test]
fn the_page_of_limits_says_what_the_code_says() {
    let repository = Repository::find();
    let limits = repository.read("shared-types/src/limits.rs");
    expect_none(limits_page::check("docs/limits.md", &repository.read("docs/limits.md"), &limits));
}

#[test]
fn every_package_that_was_asked_for_is_really_used() {
    expect_none(packages::check_used(&Repository::find().rust_files()));
}

#[test]
fn no_text_names_a_place_on_somebodys_machine() {
    let files = Repository::find().tracked_texts();
    assert!(files.len() > 50, "invariant: the repository is found");
    expect_none(files.iter().flat_map(|(path, text)| words::check(path, text)));
}

#[test]
fn every_dependency_has_a_permissive_licence() {
    expect_none(licences::check(&Repository::find().cargo_tree_with_licences()));
}
