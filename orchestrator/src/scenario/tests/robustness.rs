//! Whatever a file says, it is read or refused with a place; nothing panics.

use crate::scenario::{PRESETS, load_text};
use proptest::prelude::{ProptestConfig, any, prop_assert, proptest};

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn damaged_presets_are_read_or_refused_in_their_lines(
        preset in 0..PRESETS.len(),
        edits in proptest::collection::vec((any::<proptest::sample::Index>(), 0_usize..12, ".{0,6}"), 1..4),
    ) {
        let mut text: Vec<char> = PRESETS[preset].text.chars().collect();
        for (place, removed, inserted) in edits {
            let start = place.index(text.len() + 1);
            let end = (start + removed).min(text.len());
            text.splice(start..end, inserted.chars());
        }
        let text: String = text.into_iter().collect();
        if let Err(error) = load_text("damaged.toml", &text, &[]) {
            let position = error.position().expect("every refusal of a text has a place");
            prop_assert!(position.line <= text.matches('\n').count() + 1, "{error}");
            prop_assert!(!error.message().is_empty());
        }
    }

    #[test]
    fn any_text_is_refused_or_read(text in ".{0,200}") {
        if let Err(error) = load_text("any.toml", &text, &[]) {
            prop_assert!(error.position().is_some());
        }
    }
}
