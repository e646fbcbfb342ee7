//! The referee of a lockstep trial: opens turns, keeps the ledger, closes turns, ends the trial.
//!
//! A turn closes when every process has fired and the deliveries owed are the deliveries held. One
//! command closes a turn and opens the next, so a turn costs one round of messages; only where a
//! delivery may end a trial does the referee first ask everybody to merge and to say what that
//! brought. No clock and no transport in here: the orchestrator's run loop and the simulator both
//! feed it the crafts' reports.

#[cfg(test)]
mod tests;

use shared_types::ids::{CraftId, Firing, Turn};
use shared_types::wire::{EpochSpec, TurnCommand, TurnPhase, TurnReport};
use xxhash_rust::xxh3::Xxh3;

/// How a trial ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Outcome {
    /// A final fact was reached.
    Finished,
    /// None was reached in the turns that the scenario allows. With finals ignored this is the
    /// normal end.
    Dropped,
    /// No craft had anything to fire and nothing was in flight.
    Stalled,
}

/// A report that does not fit the turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LedgerError {
    /// From no process of this fleet.
    #[error("a turn report came from process {0}, which does not take part")]
    UnknownProcess(CraftId),
    /// About another turn than the open one.
    #[error("process {craft} reported turn {reported} while turn {open} was open")]
    WrongTurn {
        /// Who reported.
        craft: CraftId,
        /// The turn that it named.
        reported: u32,
        /// The turn that is open.
        open: u32,
    },
    /// A phase that does not exist or came twice.
    #[error("process {craft} sent a turn report out of order in turn {turn}")]
    OutOfOrder {
        /// Who reported.
        craft: CraftId,
        /// The open turn.
        turn: u32,
    },
}

/// One process's line of the ledger.
#[derive(Clone, Copy, Debug, Default)]
struct Line {
    has_fired: bool,
    has_merged: bool,
    firing: u32,
    owed: u32,
    held: u32,
}

/// What the referee waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Firing,
    Merging,
    Over(Outcome),
}

/// The referee of one trial after another.
#[derive(Debug)]
pub struct Referee {
    crafts: usize,
    turns_max: u32,
    ignores_finals: bool,
    deliveries_may_end: bool,
    stage: Stage,
    turn: u32,
    lines: Vec<Line>,
    fired: usize,
    merged: usize,
    owed: u64,
    held: u64,
    is_final: bool,
    path: Vec<(Turn, CraftId, Firing)>,
}

impl Referee {
    /// The referee of the epoch `spec` on `crafts` crafts; the centre takes part beyond them where
    /// the strategy has one.
    #[must_use]
    pub fn new(spec: &EpochSpec, crafts: u32) -> Self {
        let has_centre = spec.strategy.has_centre();
        Self {
            crafts: crafts as usize,
            turns_max: spec.turns_max,
            ignores_finals: spec.ignores_finals,
            deliveries_may_end: !spec.own_firing_only && !spec.ignores_finals && !has_centre,
            stage: Stage::Firing,
            turn: 0,
            lines: vec![Line::default(); crafts as usize + usize::from(has_centre)],
            fired: 0,
            merged: 0,
            owed: 0,
            held: 0,
            is_final: false,
            path: Vec::new(),
        }
    }

    /// The command that opens the first turn.
    #[must_use]
    pub fn start(&self) -> TurnCommand {
        TurnCommand { closed: TurnCommand::NO_TURN, opened: 0, wants_merged: 0, is_last: 0 }
    }

    /// Takes one line for the ledger.
    ///
    /// # Errors
    /// If the report does not fit the open turn; the ledger is as before.
    pub fn record(&mut self, craft: CraftId, report: &TurnReport) -> Result<(), LedgerError> {
        let turn = self.turn;
        let line = self.lines.get_mut(craft.index()).ok_or(LedgerError::UnknownProcess(craft))?;
        if report.turn != turn {
            return Err(LedgerError::WrongTurn { craft, reported: report.turn, open: turn });
        }
        match report.phase() {
            Some(TurnPhase::Fired) if !line.has_fired => {
                line.has_fired = true;
                line.firing = report.firing;
                line.owed = report.owed;
                self.fired += 1;
                self.owed += u64::from(report.owed);
                self.is_final |= report.is_final != 0;
            }
            Some(TurnPhase::Held) if line.has_fired => {}
            Some(TurnPhase::Merged) if self.stage == Stage::Merging && !line.has_merged => {
                line.has_merged = true;
                self.merged += 1;
                self.is_final |= report.is_final != 0;
                return Ok(());
            }
            _ => return Err(LedgerError::OutOfOrder { craft, turn }),
        }
        self.held = self.held - u64::from(line.held) + u64::from(report.held);
        line.held = report.held;
        Ok(())
    }

    /// The next command, once the ledger allows one.
    pub fn advance(&mut self) -> Option<TurnCommand> {
        match self.stage {
            Stage::Firing if self.fired == self.lines.len() && self.owed == self.held => {
                self.close_path();
                let all_idle = self.lines[..self.crafts].iter().all(Line::is_idle);
                if self.deliveries_may_end && !all_idle {
                    self.stage = Stage::Merging;
                    let turn = self.turn;
                    return Some(TurnCommand {
                        closed: turn,
                        opened: TurnCommand::NO_TURN,
                        wants_merged: 1,
                        is_last: 0,
                    });
                }
                Some(self.next_turn(self.turn, all_idle && self.owed == 0))
            }
            Stage::Merging if self.merged == self.lines.len() => {
                Some(self.next_turn(TurnCommand::NO_TURN, false))
            }
            _ => None,
        }
    }

    /// How the trial ended, if it did.
    #[must_use]
    pub const fn outcome(&self) -> Option<Outcome> {
        match self.stage {
            Stage::Over(outcome) => Some(outcome),
            _ => None,
        }
    }

    /// Turns that have been closed.
    #[must_use]
    pub const fn turns(&self) -> u32 {
        match self.stage {
            Stage::Over(_) => self.turn + 1,
            _ => self.turn,
        }
    }

    /// Turns that have been opened.
    #[must_use]
    pub const fn turns_opened(&self) -> u32 {
        self.turn + 1
    }

    /// What was fired, by turn and craft; idle crafts left out.
    #[must_use]
    pub fn path(&self) -> &[(Turn, CraftId, Firing)] {
        &self.path
    }

    /// Digest over (turn, craft, firing; u32 little-endian) of the path.
    #[must_use]
    pub fn path_digest(&self) -> u64 {
        let mut hasher = Xxh3::new();
        for (turn, craft, firing) in &self.path {
            hasher.update(&turn.0.to_le_bytes());
            hasher.update(&craft.0.to_le_bytes());
            hasher.update(&firing.0.to_le_bytes());
        }
        hasher.digest()
    }

    /// Why the open turn does not close, in words.
    #[must_use]
    pub fn standing(&self) -> String {
        let missing: Vec<String> = (0_u32..)
            .zip(&self.lines)
            .filter(|(_, line)| match self.stage {
                Stage::Merging => !line.has_merged,
                _ => !line.has_fired,
            })
            .map(|(craft, _)| craft.to_string())
            .collect();
        let silent = if missing.is_empty() { "none".to_owned() } else { missing.join(", ") };
        format!(
            "turn {}: {} of {} processes have fired (silent: {silent}), {} deliveries owed, {} held",
            self.turn,
            self.fired,
            self.lines.len(),
            self.owed,
            self.held
        )
    }

    fn close_path(&mut self) {
        for (craft, line) in (0_u32..).zip(&self.lines[..self.crafts]) {
            if !line.is_idle() {
                self.path.push((Turn(self.turn), CraftId(craft), Firing(line.firing)));
            }
        }
    }

    fn next_turn(&mut self, closed: u32, is_stalled: bool) -> TurnCommand {
        let outcome = if self.is_final && !self.ignores_finals {
            Some(Outcome::Finished)
        } else if is_stalled && !self.ignores_finals {
            Some(Outcome::Stalled)
        } else if self.turn + 1 >= self.turns_max {
            Some(Outcome::Dropped)
        } else {
            None
        };
        if let Some(outcome) = outcome {
            self.stage = Stage::Over(outcome);
            return TurnCommand {
                closed,
                opened: TurnCommand::NO_TURN,
                wants_merged: 0,
                is_last: 1,
            };
        }
        self.stage = Stage::Firing;
        self.turn += 1;
        self.lines.fill(Line::default());
        (self.fired, self.merged, self.owed, self.held) = (0, 0, 0, 0);
        TurnCommand { closed, opened: self.turn, wants_merged: 0, is_last: 0 }
    }
}

impl Line {
    const fn is_idle(&self) -> bool {
        self.firing == Firing::IDLE.0
    }
}
