//! Suggestions for names that do not exist.

/// The candidate that `name` most likely meant; `None` if none is near enough to be meant.
///
/// Near enough is one edit (a swap of neighbours counts as one) per three letters, at least one, case
/// and separators not counted; or a beginning of at least three letters.
pub(crate) fn nearest<'c>(
    name: &str,
    candidates: impl IntoIterator<Item = &'c str>,
) -> Option<&'c str> {
    let plain = |text: &str| text.to_lowercase().replace(['_', ' '], "-");
    let typed = plain(name);
    let edits_max = (typed.chars().count() / 3).max(1);
    candidates
        .into_iter()
        .filter(|&candidate| candidate != name)
        .map(|candidate| (plain(candidate), candidate))
        .map(|(known, candidate)| {
            let begins = typed.len() >= 3 && known.starts_with(&typed);
            (strsim::damerau_levenshtein(&typed, &known), begins, candidate)
        })
        .filter(|&(edits, begins, _)| edits <= edits_max || begins)
        .map(|(edits, _, candidate)| (edits, candidate))
        .min()
        .map(|(_, candidate)| candidate)
}

/// A remedy for an unknown `name`: the nearest candidate, else all of them (the first few of many).
pub(super) fn suggestion(name: &str, what: &str, candidates: &[&str]) -> String {
    if let Some(near) = nearest(name, candidates.iter().copied()) {
        return format!("did you mean `{near}`?");
    }
    if candidates.is_empty() {
        return format!("there are no {what}");
    }
    format!("{what}: {}", listing(candidates))
}

/// The candidates in one line, at most [`SHOWN_MAX`] of them.
pub(super) fn listing(candidates: &[&str]) -> String {
    let mut shown: Vec<String> =
        candidates.iter().take(SHOWN_MAX).map(|name| format!("`{name}`")).collect();
    if candidates.len() > SHOWN_MAX {
        shown.push(format!("and {} more", candidates.len() - SHOWN_MAX));
    }
    shown.join(", ")
}

/// A list longer than this hides more than it shows.
const SHOWN_MAX: usize = 16;

#[cfg(test)]
mod tests {
    use super::{nearest, suggestion};

    #[test]
    fn a_slip_of_the_finger_finds_its_name() {
        let keys = ["turns", "trials", "turn-limit-ms", "seed"];
        for (typed, meant) in [
            ("turn", Some("turns")),
            ("trails", Some("trials")),
            ("turn_limit_ms", Some("turn-limit-ms")),
            ("Seed", Some("seed")),
            ("tri", Some("trials")),
            ("velocity", None),
            ("x", None),
        ] {
            assert_eq!(nearest(typed, keys), meant, "{typed}");
        }
    }

    #[test]
    fn where_nothing_is_near_everything_is_listed() {
        assert_eq!(suggestion("velocity", "keys here", &["a", "b"]), "keys here: `a`, `b`");
        assert_eq!(suggestion("velocity", "actions", &[]), "there are no actions");
        let many: Vec<String> = (0..20).map(|number| format!("fact-number-{number}")).collect();
        let many: Vec<&str> = many.iter().map(String::as_str).collect();
        assert!(suggestion("velocity", "facts", &many).ends_with("and 4 more"));
    }
}
