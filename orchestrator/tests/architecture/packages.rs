//! Packages: which of our crates import which, and that those that were asked for are in use.

use crate::Violation;
use crate::imports::imports_of;
use crate::rust_text::RustFile;

/// What a crate of ours may import of ours.
pub(crate) struct CrateRule {
    pub(crate) directory: &'static str,
    may_import: &'static [&'static str],
}

/// Lowest first, by the names that manifests use.
pub(crate) const CRATES: &[CrateRule] = &[
    CrateRule { directory: "shared-types", may_import: &[] },
    CrateRule { directory: "agent", may_import: &["shared-types"] },
    CrateRule { directory: "orchestrator", may_import: &["shared-types", "agent"] },
    CrateRule { directory: "benches", may_import: &["shared-types", "agent", "orchestrator"] },
];

/// What the customer asked the product to be built with.
const ASKED_FOR: [&str; 7] =
    ["iceoryx2", "serde", "rkyv", "nalgebra", "rand_chacha", "clap", "hdrhistogram"];

/// Checks the dependencies of every kind in one manifest.
pub(crate) fn check_manifest(rule: &CrateRule, path: &str, manifest: &str) -> Vec<Violation> {
    let parsed: toml::Table = manifest.parse().unwrap();
    let targets = parsed.get("target").and_then(toml::Value::as_table);
    let tables =
        targets.into_iter().flat_map(|targets| targets.values().filter_map(|t| t.as_table()));
    let ours = |name: &str| CRATES.iter().any(|known| known.directory == name);
    let mut found = Vec::new();
    for table in tables.chain([&parsed]) {
        for kind in ["dependencies", "dev-dependencies", "build-dependencies"] {
            let dependencies = table.get(kind).and_then(toml::Value::as_table);
            for name in dependencies.into_iter().flat_map(toml::Table::keys) {
                if ours(name) && !rule.may_import.contains(&name.as_str()) {
                    let what = format!(
                        "{} must not depend on {name} ({kind}); imports point downward only",
                        rule.directory
                    );
                    let line = line_of_dependency(manifest, name);
                    found.push(Violation { file: path.to_owned(), line, what });
                }
            }
        }
    }
    found
}

fn line_of_dependency(manifest: &str, name: &str) -> usize {
    let is_it =
        |line: &str| line.strip_prefix(name).is_some_and(|rest| rest.starts_with(['.', ' ', '=']));
    manifest.lines().position(is_it).map_or(1, |index| index + 1)
}

/// Checks that the product itself, not its tests or benchmarks, uses what was asked for.
pub(crate) fn check_used(files: &[RustFile]) -> Vec<Violation> {
    let mut unused = ASKED_FOR.to_vec();
    for file in files.iter().filter(|file| !file.path.starts_with("benches/")) {
        let imports = imports_of(file);
        unused.retain(|package| !imports.iter().any(|import| import.leads_into(package)));
    }
    let violation = |package: &str| Violation {
        file: "Cargo.toml".to_owned(),
        line: 1,
        what: format!(
            "{package} is used nowhere outside tests; use it where it was meant to serve"
        ),
    };
    unused.into_iter().map(violation).collect()
}

#[test]
fn a_dependency_upward_is_found_with_its_line() {
    let found = |manifest: &str| {
        let found = check_manifest(&CRATES[1], "agent/Cargo.toml", manifest);
        found.iter().map(|found| found.line).collect::<Vec<_>>()
    };
    assert_eq!(found("[dependencies]\nshared-types.workspace = true\nserde = \"1\"\n"), []);
    assert_eq!(found("[dependencies]\norchestrator.workspace = true\n"), [2]);
    assert_eq!(found("[dev-dependencies]\nbenches = { path = \"../benches\" }\n"), [2]);
    assert_eq!(found("[target.'cfg(unix)'.dependencies]\norchestrator = \"1\"\n"), [2]);
}

#[test]
fn a_package_that_only_tests_use_is_found() {
    let uses: String = ASKED_FOR[1..].iter().map(|name| format!("use {name}::A;\n")).collect();
    let product = RustFile::new("agent/src/lib.rs", &uses);
    let in_test = RustFile::new("agent/src/a/tests.rs", "use iceoryx2::A;");
    let in_bench = RustFile::new("benches/src/lib.rs", "use iceoryx2::A;");
    let in_comment = RustFile::new("agent/src/b.rs", "// use iceoryx2::A;");
    let found = check_used(&[product.clone(), in_test, in_bench, in_comment]);
    assert_eq!(found.len(), 1);
    assert!(found[0].what.starts_with("iceoryx2 "), "{found:?}");
    assert_eq!(check_used(&[product, RustFile::new("agent/src/c.rs", "use iceoryx2::A;")]), []);
}
