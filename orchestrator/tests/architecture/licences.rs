//! Licences of everything that is linked: each dependency must offer a permissive one.

use crate::Violation;

/// Licences that ask for no more than their notice.
const PERMISSIVE: [&str; 12] = [
    "0BSD",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC0-1.0",
    "ISC",
    "MIT",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
];

/// Checks lines of `licence TAB package`.
pub(crate) fn check(tree: &str) -> Vec<Violation> {
    let packages: Vec<(&str, &str)> =
        tree.lines().filter_map(|line| line.split_once('\t')).collect();
    assert!(packages.len() > 50, "invariant: cargo lists the dependencies");
    packages.into_iter().filter(|(licence, _)| !is_permissive(licence)).map(violation).collect()
}

fn violation((licence, package): (&str, &str)) -> Violation {
    let what = format!("{package} is licensed `{licence}`; replace it by a permissive package");
    Violation { file: "Cargo.lock".to_owned(), line: 1, what }
}

/// Whether the SPDX expression can be met with permissive licences alone. `/` is an old `OR`.
fn is_permissive(expression: &str) -> bool {
    let spaced = expression.replace('/', " OR ").replace('(', " ( ").replace(')', " ) ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut rest = words.as_slice();
    any_of(&mut rest).unwrap_or(false) && rest.is_empty()
}

fn any_of(rest: &mut &[&str]) -> Option<bool> {
    let mut is_met = all_of(rest)?;
    while take(rest, "OR") {
        is_met |= all_of(rest)?;
    }
    Some(is_met)
}

fn all_of(rest: &mut &[&str]) -> Option<bool> {
    let mut is_met = one(rest)?;
    while take(rest, "AND") {
        is_met &= one(rest)?;
    }
    Some(is_met)
}

/// One licence or an expression in brackets; `None` where neither stands.
fn one(rest: &mut &[&str]) -> Option<bool> {
    if take(rest, "(") {
        let is_met = any_of(rest)?;
        return take(rest, ")").then_some(is_met);
    }
    let (licence, after) = rest.split_first()?;
    *rest = after;
    if take(rest, "WITH") {
        let (exception, after) = rest.split_first()?;
        *rest = after;
        return Some(PERMISSIVE.contains(&format!("{licence} WITH {exception}").as_str()));
    }
    Some(PERMISSIVE.contains(licence))
}

fn take(rest: &mut &[&str], word: &str) -> bool {
    let is_next = rest.first() == Some(&word);
    if is_next {
        *rest = &rest[1..];
    }
    is_next
}

#[test]
fn an_expression_is_permissive_if_it_can_be_met() {
    for licence in [
        "MIT",
        "MIT/Apache-2.0",
        "GPL-3.0 OR MIT",
        "(MIT OR GPL-3.0) AND Unicode-3.0",
        "Apache-2.0 WITH LLVM-exception OR GPL-2.0",
    ] {
        assert!(is_permissive(licence), "{licence}");
    }
    for licence in
        ["", "GPL-3.0", "MIT AND GPL-3.0", "(MIT", "MIT OR", "GPL-2.0 WITH MIT", "MIT MIT"]
    {
        assert!(!is_permissive(licence), "{licence}");
    }
}

#[test]
fn a_dependency_with_another_licence_is_named() {
    let tree = "MIT\tgood v1\n".repeat(60) + "GPL-3.0\tstrict v2\n\tunstated v3\n";
    let found: Vec<String> = check(&tree).into_iter().map(|found| found.what).collect();
    assert_eq!(found.len(), 2);
    assert!(found[0].contains("strict v2") && found[1].contains("unstated v3"), "{found:?}");
}
