//! The words of serde and the TOML parser, in the words of a scenario, with a remedy.
//!
//! Both report what they expected as a sentence; the names in it stand between backticks, so the
//! nearest one can be suggested. Not here: checks of our own, which bring their words along.

use super::error::{Finding, Place};
use super::nearest::suggestion;
use super::schema;
use toml::de::DeValue;

/// What is wrong with a text that is not TOML.
pub(super) fn syntax_message(parser: &str) -> String {
    let mut lines = parser.lines().map(str::trim).filter(|line| !line.is_empty());
    let first = lines.next().unwrap_or("unreadable");
    format!("not valid TOML: {first}")
}

/// What to do about it.
pub(super) fn syntax_remedy(parser: &str) -> &'static str {
    if parser.contains("duplicate key") {
        "give each key once; tables that may repeat are written `[[rule]]`"
    } else if parser.contains("string") || parser.contains("quote") {
        "texts stand in double quotes: `name = \"orbiter\"`"
    } else {
        "lines read `key = value`, sections `[run]`, repeated ones `[[rule]]`"
    }
}

/// A finding for serde's `message` about the value that `keys` lead to.
pub(super) fn type_finding(message: &str, keys: &[String], value: Option<&DeValue<'_>>) -> Finding {
    let names = names_in(message);
    let last = keys.last().map_or("the scenario", String::as_str);
    let parent = keys.split_last().map_or(&[][..], |(_, above)| above);
    let at = |text: String| Finding::at(Place::default(), text);
    if message.starts_with("unknown field") {
        let section = section_name(parent);
        let (unknown, known) = names.split_first().map_or((last, &[][..]), |(u, k)| (*u, k));
        at(format!("unknown key `{unknown}` in {section}"))
            .help(suggestion(unknown, "keys here", known))
            .label("no such key")
    } else if message.starts_with("unknown variant") {
        let (unknown, known) = names.split_first().map_or((last, &[][..]), |(u, k)| (*u, k));
        at(format!("unknown value `{unknown}` for `{last}`"))
            .help(suggestion(unknown, "known values", known))
            .label("no such value")
    } else if message.starts_with("missing field") {
        let missing = names.first().copied().unwrap_or("?");
        at(format!("{} lacks the key `{missing}`", section_name(keys)))
            .help(with_description(keys, Some(missing), "add it"))
            .label("in this entry")
    } else {
        let got = value.map_or_else(String::new, |value| format!(", got {}", described(value)));
        let wanted = message
            .split_once(", expected ")
            .map_or_else(|| message.to_owned(), |(_, wanted)| in_plain_words(wanted));
        at(format!("`{last}` takes {wanted}{got}"))
            .help(with_description(keys, None, ""))
            .label("wrong value")
    }
}

/// The texts between backticks, in order.
fn names_in(message: &str) -> Vec<&str> {
    message.split('`').skip(1).step_by(2).collect()
}

/// `[run]`, or the top level of the file.
fn section_name(keys: &[String]) -> String {
    if keys.is_empty() { "the scenario".to_owned() } else { format!("`{}`", keys.join(".")) }
}

/// Rust's names of types, as a user would call them.
fn in_plain_words(wanted: &str) -> String {
    match wanted.trim() {
        "u32" => "a whole number from 0 to 4294967295".to_owned(),
        "u64" => "a whole number from 0 to 9223372036854775807".to_owned(),
        "f64" => "a number".to_owned(),
        "a string" | "a borrowed string" => "a text in double quotes".to_owned(),
        "a boolean" => "`true` or `false`".to_owned(),
        "a sequence" => "a list".to_owned(),
        "an array of length 3" => "three numbers, as `[x, y, z]`".to_owned(),
        other if other.starts_with("struct ") => "a table of keys".to_owned(),
        other => other.to_owned(),
    }
}

/// The value as it was written, shortened.
fn described(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) if text.chars().count() <= 40 => format!("the text \"{text}\""),
        DeValue::String(_) => "a text".to_owned(),
        DeValue::Integer(number) => format!("the number {number}"),
        DeValue::Float(number) => format!("the number {number}"),
        DeValue::Boolean(truth) => format!("`{truth}`"),
        DeValue::Datetime(_) => "a date".to_owned(),
        DeValue::Array(items) => format!("a list of {}", items.len()),
        DeValue::Table(_) => "a table".to_owned(),
    }
}

/// What the schema says about a key, behind `first`.
fn with_description(keys: &[String], below: Option<&str>, first: &str) -> String {
    let path: Vec<&str> = keys.iter().map(String::as_str).chain(below).collect();
    let description = schema::description(&path).unwrap_or_default();
    match (first.is_empty(), description.is_empty()) {
        (_, true) => first.to_owned(),
        (true, false) => format!("`{}`: {description}", path.join(".")),
        (false, false) => format!("{first}: {description}"),
    }
}
