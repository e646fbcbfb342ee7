//! What the orchestrator tells a craft on its command line: who it is and where its run lives.
//!
//! Everything else travels as messages. The order of the options does not matter; each comes once and
//! none has a default, so that two versions that disagree refuse each other. Not here: the verb
//! `agent` itself, which the orchestrator's command line strips.

use crate::process::doom::Doom;
use shared_types::ids::{CraftId, Incarnation};
use shared_types::transport::WakeMode;
use std::ffi::{OsStr, OsString};
use std::path::PathBuf;

/// Who a craft's process is, and where its run lives.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AgentArguments {
    /// The run; messages of another are refused.
    pub run: u64,
    /// The directory under which the roots of all runs lie.
    pub base: PathBuf,
    /// Which craft; the centre is craft N.
    pub craft: CraftId,
    /// Crafts of the fleet, the centre not counted.
    pub craft_count: u32,
    /// Which life of the craft.
    pub incarnation: Incarnation,
    /// The orchestrator's process; the craft refuses to live under another parent.
    pub parent_pid: u32,
    /// How the craft waits when nothing has arrived.
    pub wake: WakeMode,
    /// The logical processors that it may run on; empty for all that its parent may.
    pub cores: Vec<u32>,
    /// The other processes that run on the same single processor, so that wake-ups are told apart;
    /// empty if it is not pinned to one.
    pub beside: Vec<CraftId>,
    /// Where it kills itself; `None` for every craft that is not part of a campaign of faults.
    pub doom: Option<Doom>,
}

/// Why a command line is not one of a craft.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ArgumentError {
    /// An option that does not exist.
    #[error(
        "`agent` does not know the option {0:?}: it is started by the orchestrator, never by hand"
    )]
    Unknown(OsString),
    /// An option that was given twice.
    #[error("`agent` was given {0} twice: it is started by the orchestrator, never by hand")]
    Twice(&'static str),
    /// An option that was not given, or without its value.
    #[error("`agent` needs {0}: it is started by the orchestrator, never by hand")]
    Missing(&'static str),
    /// A value that cannot be read.
    #[error(
        "`agent` was given {value:?}, which is no value for {option}: it is started by the orchestrator, \
         never by hand"
    )]
    Value {
        /// The option.
        option: &'static str,
        /// What was given.
        value: OsString,
    },
}

/// The options, in the order in which they are written.
pub(super) const OPTIONS: [&str; 10] = [
    "--run",
    "--base",
    "--craft",
    "--crafts",
    "--incarnation",
    "--parent",
    "--wake",
    "--cores",
    "--beside",
    "--doom",
];

impl AgentArguments {
    /// The command line, without executable and verb.
    #[must_use]
    pub fn to_command_line(&self) -> Vec<OsString> {
        let cores: Vec<String> = self.cores.iter().map(u32::to_string).collect();
        let beside: Vec<String> = self.beside.iter().map(CraftId::to_string).collect();
        let values: [OsString; OPTIONS.len()] = [
            format!("{:016x}", self.run).into(),
            self.base.clone().into(),
            self.craft.to_string().into(),
            self.craft_count.to_string().into(),
            self.incarnation.to_string().into(),
            self.parent_pid.to_string().into(),
            wake_name(self.wake).into(),
            cores.join(",").into(),
            beside.join(",").into(),
            self.doom.map_or_else(String::new, |doom| doom.to_string()).into(),
        ];
        OPTIONS
            .into_iter()
            .map(OsString::from)
            .zip(values)
            .flat_map(|(key, value)| [key, value])
            .collect()
    }

    /// Reads what [`Self::to_command_line`] wrote.
    ///
    /// # Errors
    /// If an option is unknown, missing, given twice or has no readable value.
    pub fn from_command_line<I>(arguments: I) -> Result<Self, ArgumentError>
    where
        I: IntoIterator<Item = OsString>,
    {
        let mut given: [Option<OsString>; OPTIONS.len()] = Default::default();
        let mut arguments = arguments.into_iter();
        while let Some(key) = arguments.next() {
            let Some(place) = OPTIONS.iter().position(|option| key == *option) else {
                return Err(ArgumentError::Unknown(key));
            };
            let value = arguments.next().ok_or(ArgumentError::Missing(OPTIONS[place]))?;
            if given[place].replace(value).is_some() {
                return Err(ArgumentError::Twice(OPTIONS[place]));
            }
        }
        let mut take =
            |place: usize| given[place].take().ok_or(ArgumentError::Missing(OPTIONS[place]));
        Ok(Self {
            run: read(0, &take(0)?, |text| u64::from_str_radix(text, 16).ok())?,
            base: take(1)?.into(),
            craft: CraftId(read(2, &take(2)?, number)?),
            craft_count: read(3, &take(3)?, number)?,
            incarnation: Incarnation(read(4, &take(4)?, number)?),
            parent_pid: read(5, &take(5)?, number)?,
            wake: read(6, &take(6)?, wake_of)?,
            cores: read(7, &take(7)?, numbers)?,
            beside: read(8, &take(8)?, numbers)?.into_iter().map(CraftId).collect(),
            doom: read(9, &take(9)?, optional)?,
        })
    }
}

/// The value of option `place`, as `parse` understands it.
fn read<T>(
    place: usize,
    value: &OsStr,
    parse: impl FnOnce(&str) -> Option<T>,
) -> Result<T, ArgumentError> {
    value
        .to_str()
        .and_then(parse)
        .ok_or_else(|| ArgumentError::Value { option: OPTIONS[place], value: value.to_owned() })
}

fn number(text: &str) -> Option<u32> {
    text.parse().ok()
}

fn numbers(text: &str) -> Option<Vec<u32>> {
    text.split(',').filter(|one| !one.is_empty()).map(number).collect()
}

/// An empty value is none.
fn optional<T: std::str::FromStr>(text: &str) -> Option<Option<T>> {
    if text.is_empty() { Some(None) } else { text.parse().ok().map(Some) }
}

const fn wake_name(wake: WakeMode) -> &'static str {
    match wake {
        WakeMode::Poll => "poll",
        WakeMode::Adaptive => "adaptive",
        WakeMode::Block => "block",
    }
}

fn wake_of(text: &str) -> Option<WakeMode> {
    [WakeMode::Poll, WakeMode::Adaptive, WakeMode::Block]
        .into_iter()
        .find(|&wake| wake_name(wake) == text)
}
