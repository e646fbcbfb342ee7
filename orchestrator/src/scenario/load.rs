//! Reads a scenario: default < file or preset < environment `SLATESWARM_*` < flags.
//!
//! A variable names a key with `__` between the levels and `_` inside a word: `SLATESWARM_RUN__SEED`
//! is `run.seed`, `SLATESWARM_REPLICATION__RECORD_BYTES` is `replication.record-bytes`. Variables
//! without `__` name no key and are left to others. Every flag that sets a key becomes an
//! [`Override`]; `--set` takes any key. Values are TOML; a bare word is a text. Not here: what the
//! values mean (`resolve`), which flags there are (the command line).

use super::document::Layers;
use super::error::ScenarioError;
use super::nearest::nearest;
use super::preset::{self, Preset};
use super::resolve::ResolvedScenario;
use shared_types::scenario::Scenario;
use std::path::{Path, PathBuf};

/// Where a scenario starts from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Base {
    /// A file of the user.
    File(PathBuf),
    /// A preset, by name.
    Preset(String),
}

impl Base {
    /// What a user means by `argument`: a preset of that name, else a file.
    #[must_use]
    pub fn from_argument(argument: &str) -> Self {
        if preset::find(argument).is_some() {
            Self::Preset(argument.to_owned())
        } else {
            Self::File(PathBuf::from(argument))
        }
    }

    /// Label and text of the lowest layer, and the scenario's name where it states none.
    fn read(&self) -> Result<(String, String, String), ScenarioError> {
        match self {
            Self::Preset(name) => {
                let Preset { name, text } =
                    preset::find(name).ok_or_else(|| unknown_preset(name))?;
                Ok((format!("preset {name}"), text.to_owned(), name.to_owned()))
            }
            Self::File(path) => {
                let text =
                    std::fs::read_to_string(path).map_err(|error| unreadable(path, &error))?;
                let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                Ok((path.display().to_string(), text, name))
            }
        }
    }
}

/// One key set from outside the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Override {
    /// What errors call it: the flag or variable as the user gave it.
    label: String,
    /// `key = value`, as TOML.
    text: String,
}

impl Override {
    /// The argument of `--set`: `run.seed=7`.
    ///
    /// # Errors
    /// If it has no `=` or no key.
    pub fn set(argument: &str) -> Result<Self, ScenarioError> {
        match argument.split_once('=') {
            Some((key, value)) if !key.trim().is_empty() => {
                Ok(Self::flag(format!("--set {argument}"), key.trim(), value))
            }
            _ => Err(ScenarioError::without_place(
                format!("`--set {argument}` sets nothing"),
                "write a key and a value: `--set run.seed=7`".to_owned(),
            )),
        }
    }

    /// A flag of its own that sets `key` (dotted): `Override::flag("--seed 7", "run.seed", "7")`.
    #[must_use]
    pub fn flag(label: impl Into<String>, key: &str, value: &str) -> Self {
        Self { label: label.into(), text: format!("{key} = {}", as_toml(value)) }
    }

    /// A variable of the environment; `None` if it names no key.
    fn variable(name: &str, value: &str) -> Option<Self> {
        let path = name.strip_prefix("SLATESWARM_").filter(|path| path.contains("__"))?;
        let key = path.to_lowercase().replace("__", ".").replace('_', "-");
        Some(Self::flag(name, &key, value))
    }
}

/// `value` as TOML: as it stands if it is TOML, else as a text.
fn as_toml(value: &str) -> String {
    let value = value.trim();
    let is_one_line = !value.contains(['\n', '\r']);
    let is_bare = |letter: char| letter.is_alphanumeric() || "-_./!:+ ".contains(letter);
    let parses = || toml::de::DeValue::parse(value).is_ok();
    if is_one_line && (parses() || !(value.is_empty() || value.chars().all(is_bare))) {
        value.to_owned()
    } else {
        toml::Value::String(value.to_owned()).to_string()
    }
}

/// Reads, merges and checks a scenario. `variables` are the process's ([`environment`]; only
/// `SLATESWARM_*` names with `__` are read), in any order; of two overrides of one key the later one holds.
///
/// # Errors
/// One error, the first found, with place and remedy: the file cannot be read, a text is not TOML, a
/// key is unknown, a value has the wrong type, or what it all says cannot be run.
pub fn load(
    base: &Base,
    variables: impl IntoIterator<Item = (String, String)>,
    overrides: &[Override],
) -> Result<ResolvedScenario, ScenarioError> {
    load_with(base, variables, overrides, |_| {})
}

/// The same, to be played on a virtual clock: turns where the scenario states turns, its open mode where
/// it states that.
///
/// # Errors
/// As [`load`].
pub fn load_simulated(
    base: &Base,
    variables: impl IntoIterator<Item = (String, String)>,
    overrides: &[Override],
) -> Result<ResolvedScenario, ScenarioError> {
    load_with(base, variables, overrides, |scenario| {
        scenario.run.mode = scenario.run.mode.simulated();
    })
}

fn load_with(
    base: &Base,
    variables: impl IntoIterator<Item = (String, String)>,
    overrides: &[Override],
    change: impl FnOnce(&mut Scenario),
) -> Result<ResolvedScenario, ScenarioError> {
    let (label, text, name) = base.read()?;
    let mut layers = Layers::default();
    layers.push(label, &text);
    let mut variables: Vec<(String, String)> = variables.into_iter().collect();
    variables.sort();
    let variables = variables.iter().filter_map(|(name, value)| Override::variable(name, value));
    for Override { label, text } in variables.chain(overrides.iter().cloned()) {
        layers.push(label, &text);
    }
    resolve_layers(&layers, &name, change)
}

/// Checks a scenario that stands in memory, as `load` does one in a file; `label` is what errors call
/// it.
///
/// # Errors
/// As [`load`].
pub fn load_text(
    label: &str,
    text: &str,
    overrides: &[Override],
) -> Result<ResolvedScenario, ScenarioError> {
    let mut layers = Layers::default();
    layers.push(label, text);
    for Override { label, text } in overrides {
        layers.push(label, text);
    }
    resolve_layers(&layers, label, |_| {})
}

/// The variables of this process that may set a key, for [`load`].
pub fn environment() -> impl Iterator<Item = (String, String)> {
    std::env::vars_os()
        .map(|(name, value)| {
            (name.to_string_lossy().into_owned(), value.to_string_lossy().into_owned())
        })
        .filter(|(name, _)| name.starts_with("SLATESWARM_"))
}

fn resolve_layers(
    layers: &Layers,
    name: &str,
    change: impl FnOnce(&mut Scenario),
) -> Result<ResolvedScenario, ScenarioError> {
    let document = layers.parse()?;
    let mut scenario = document.deserialize()?;
    change(&mut scenario);
    if scenario.name.is_empty() {
        name.clone_into(&mut scenario.name);
    }
    let place = |finding| document.error(finding);
    Ok(ResolvedScenario::check(scenario).map_err(place)?.with_places(place))
}

fn unknown_preset(name: &str) -> ScenarioError {
    let names = preset::PRESETS.map(|preset| preset.name);
    ScenarioError::without_place(
        format!("there is no preset `{name}`"),
        super::nearest::suggestion(name, "presets", &names),
    )
}

fn unreadable(path: &Path, error: &std::io::Error) -> ScenarioError {
    let shown = path.display();
    let message = match error.kind() {
        std::io::ErrorKind::NotFound => format!("there is no scenario file `{shown}`"),
        std::io::ErrorKind::IsADirectory => {
            format!("`{shown}` is a directory, not a scenario file")
        }
        std::io::ErrorKind::InvalidData => format!("`{shown}` is not a text in UTF-8"),
        _ => format!("cannot read `{shown}`: {error}"),
    };
    let names = preset::PRESETS.map(|preset| preset.name);
    let typed = path.to_string_lossy();
    let remedy = match nearest(&typed, names) {
        Some(near) => format!("did you mean the preset `{near}`?"),
        None => format!(
            "give a TOML file or a preset ({}); `show two-craft` prints one to start from",
            super::nearest::listing(&names)
        ),
    };
    ScenarioError::without_place(message, remedy)
}
