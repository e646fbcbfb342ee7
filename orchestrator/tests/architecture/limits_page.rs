//! The table of bounds in the documentation: each row must say what the constant says.

use crate::Violation;
use crate::rust_text::code_of;

/// Checks the rows of `page` that look like ``| `NAME` | `value` | ...`` against the constants of
/// `limits`.
pub(crate) fn check(path: &str, page: &str, limits: &str) -> Vec<Violation> {
    let code = code_of(limits);
    let rows = page.lines().enumerate().filter_map(|(at, line)| Some((at + 1, row_of(line)?)));
    let mut found = Vec::new();
    for (line, (name, stated)) in rows {
        let what = match value_of(&code, name) {
            Some(value) if value == stated => continue,
            Some(value) => format!("{name} is `{value}`, not `{stated}`; copy the value"),
            None => format!("{name} is no constant of limits.rs; remove the row"),
        };
        found.push(Violation { file: path.to_owned(), line, what });
    }
    found
}

/// Name and value of a row of the table.
fn row_of(line: &str) -> Option<(&str, &str)> {
    let (name, rest) = line.strip_prefix("| `")?.split_once("` | `")?;
    Some((name, rest.split_once('`')?.0))
}

/// The expression that the public constant `name` is set to.
fn value_of<'a>(code: &'a str, name: &str) -> Option<&'a str> {
    let (_, after) = code.split_once(&format!("pub const {name}: "))?;
    let (_, value) = after.split_once(';')?.0.split_once(" = ")?;
    Some(value)
}

#[test]
fn a_row_that_disagrees_is_found_with_its_line() {
    let limits = "/// Inboxes.\npub const INBOX: usize = 64 * 1024;\npub const LOANS: u32 = 2;\n";
    let lines =
        |page: &str| check("a.md", page, limits).iter().map(|found| found.line).collect::<Vec<_>>();
    assert_eq!(lines("| bound | value |\n|---|---|\n| `INBOX` | `64 * 1024` | bytes |\n"), []);
    assert_eq!(lines("text\n| `INBOX` | `65_536` | bytes |\n| `LOANS` | `2` | |\n"), [2]);
    assert_eq!(lines("| `GONE` | `1` | nothing |\n"), [1]);
}
