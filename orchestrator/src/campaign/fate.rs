//! How lives are to end in a round, and the records that are made of it.

use super::defects;
use crate::results::faults::{Failure, FaultKind, FaultRecord, RANDOM};
use crate::run::backend::PlayError;
use agent::process::doom::{Doom, Point};
use shared_types::ids::CraftId;
use shared_types::transport::{RunPaths, WakeMode};
use shared_types::wire::StrategyKind;
use std::collections::BTreeMap;

/// A life that is to end, and how.
pub(super) type Lives = BTreeMap<(CraftId, u32), Fate>;

/// How a life is to end.
#[derive(Clone, Copy, Debug)]
pub(super) enum Fate {
    /// By SIGKILL from outside, at an instant.
    Struck,
    /// The same, and what kills at rare moments leave was planted.
    Planted,
    /// By itself.
    Doomed(Doom),
    /// By itself, if it ever comes to the point: nobody waits for it any more.
    PutOff(Doom),
}

/// What is the same for all faults of a round.
#[derive(Clone, Copy, Debug)]
pub(super) struct Setting {
    pub(super) size: u32,
    pub(super) strategy: StrategyKind,
    pub(super) wake: WakeMode,
    /// Whether it plays an interval of open mode.
    pub(super) is_open: bool,
    /// Whether links fail in it.
    pub(super) links_fail: bool,
}

impl Setting {
    pub(super) fn record(
        &self,
        kind: FaultKind,
        point: &str,
        craft: Option<CraftId>,
    ) -> FaultRecord {
        FaultRecord {
            number: 0,
            size: self.size,
            strategy: self.strategy,
            wake: self.wake,
            is_open: self.is_open,
            links_fail: self.links_fail,
            kind,
            point: point.to_owned(),
            craft: craft.map(|craft| craft.0),
            took_effect: true,
            failures: Vec::new(),
            times_ns: BTreeMap::new(),
        }
    }

    pub(super) fn of_fate(&self, fate: Fate, craft: CraftId) -> FaultRecord {
        let point = match fate {
            Fate::Struck => RANDOM,
            Fate::Planted => defects::POINT,
            Fate::Doomed(doom) | Fate::PutOff(doom) => doom.point.name(),
        };
        self.record(FaultKind::KillCraft, point, Some(craft))
    }
}

impl Fate {
    /// Whether nobody waits for it before the end of the fleet.
    pub(super) const fn is_at_the_end(&self) -> bool {
        match self {
            Self::Struck | Self::Planted => false,
            Self::Doomed(doom) => matches!(doom.point, Point::Shutdown),
            Self::PutOff(_) => true,
        }
    }

    /// What becomes of it when it has not come in all the time that it was waited for.
    pub(super) const fn put_off(self) -> Self {
        match self {
            Self::Doomed(doom) if !self.is_at_the_end() => Self::PutOff(doom),
            fate => fate,
        }
    }
}

/// What a fleet that could not go on has broken.
pub(super) fn failure_of(error: &PlayError) -> (Failure, String) {
    match error {
        PlayError::Unbalanced { standing, .. } => (Failure::Hang, standing.clone()),
        PlayError::Lost(lost) => (Failure::Restart, format!("no successor came: {lost:?}")),
        error => (Failure::Hang, format!("{error:?}")),
    }
}

/// What is left of a fleet that has ended: files, segments, processes.
pub(super) fn left_behind(paths: &RunPaths, processes: &[u32]) -> Vec<(Failure, String)> {
    let mut left = Vec::new();
    match paths.segments() {
        Ok(segments) if segments.is_empty() => {}
        Ok(segments) => left.push((Failure::Left, format!("{segments:?}"))),
        Err(error) => left.push((Failure::Left, error.to_string())),
    }
    if paths.root().exists() {
        left.push((Failure::Left, format!("{}", paths.root().display())));
    }
    let is_there = |pid: &&u32| {
        let line = std::fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
        line.windows(5).any(|word| word == b"agent")
    };
    left.extend(
        processes.iter().filter(is_there).map(|pid| (Failure::Left, format!("process {pid}"))),
    );
    left
}
