//! The scenarios that ship with the program, as the files they are.

/// A scenario file compiled in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Preset {
    /// What it is called on the command line.
    pub name: &'static str,
    /// The file, comments included.
    pub text: &'static str,
}

/// All presets, in the order of `list`.
pub const PRESETS: [Preset; 11] = [
    Preset { name: "compare", text: include_str!("../../presets/compare.toml") },
    Preset { name: "paper", text: include_str!("../../presets/paper.toml") },
    Preset { name: "campaign", text: include_str!("../../presets/campaign.toml") },
    Preset { name: "map", text: include_str!("../../presets/map.toml") },
    Preset { name: "map-small", text: include_str!("../../presets/map-small.toml") },
    Preset { name: "lossy-links", text: include_str!("../../presets/lossy-links.toml") },
    Preset { name: "two-craft", text: include_str!("../../presets/two-craft.toml") },
    Preset { name: "planetary-survey", text: include_str!("../../presets/planetary-survey.toml") },
    Preset { name: "hierarchy-13", text: include_str!("../../presets/hierarchy-13.toml") },
    Preset { name: "generated", text: include_str!("../../presets/generated.toml") },
    Preset { name: "sparse", text: include_str!("../../presets/sparse.toml") },
];

/// The preset of that name.
#[must_use]
pub fn find(name: &str) -> Option<Preset> {
    PRESETS.into_iter().find(|preset| preset.name == name)
}

impl Preset {
    /// What it is for, in a sentence: its `description`.
    ///
    /// # Panics
    /// Never: a test reads every preset.
    #[must_use]
    pub fn description(&self) -> String {
        let table: toml::Table = self.text.parse().expect("invariant: presets are TOML");
        table["description"].as_str().expect("invariant: presets describe themselves").to_owned()
    }
}
