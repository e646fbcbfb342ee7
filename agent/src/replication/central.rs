//! `central`, `central-batched`, `pipelined`: the craft's side of the conversation with the centre.
//!
//! Every board lives at the centre. A craft asks what to run, runs it, reports what that output, and
//! (unless the centre checks by itself) asks for every final fact whether it is reached; each
//! question waits for its answer, `pipelined` keeps many checks in flight. What the craft learns from
//! replies it keeps in a mirror of its board: the centre's truth as of the last reply.

use crate::blackboard::Blackboard;
use crate::control::acting::Acting;
use crate::craft::{Counting, Outbox, header};
use shared_types::ids::{CraftId, FactId, Firing, Turn};
use shared_types::knowledge::{Change, FleetView};
use shared_types::limits::PIPELINE_DEPTH;
use shared_types::time::Nanos;
use shared_types::transport::{Destination, Peers};
use shared_types::wire::{
    Class, EpochSpec, Header, Kind, Refusal, StrategyKind, TurnPhase, TurnReport,
};

/// What the craft waits for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Stage {
    /// Nothing: no turn is open.
    #[default]
    Resting,
    /// The answer to its registration.
    Registering,
    /// The answer to "what shall I run?".
    Asking,
    /// The answer to its result.
    Reporting,
    /// Answers to checks.
    Checking,
    /// The answer to its sign-off.
    SigningOff,
}

/// A craft that is told what to do.
#[derive(Debug, Default)]
pub struct Client {
    craft: CraftId,
    centre: CraftId,
    spec: Option<EpochSpec>,
    mirror: Blackboard,
    acting: Acting,
    stage: Stage,
    turn: Turn,
    intended: Nanos,
    is_registered: bool,
    firing: Option<Firing>,
    firing_number: u32,
    checks_asked: usize,
    checks_answered: usize,
    is_final: bool,
    changes: Vec<Change>,
}

impl Client {
    /// Starts an epoch.
    pub fn begin_epoch(&mut self, craft: CraftId, spec: &EpochSpec, fleet: &FleetView<'_>) {
        self.craft = craft;
        self.centre = CraftId(fleet.craft_count());
        self.spec = Some(spec.clone());
        self.mirror.reset(fleet.board(craft));
        self.acting = Acting::new(spec.seed, spec.trial, craft);
        self.stage = Stage::Resting;
        self.is_registered = false;
        self.firing_number = 0;
    }

    /// The ports that the client needs.
    #[must_use]
    pub fn peers(fleet: &FleetView<'_>) -> Peers {
        Peers { unicast: vec![CraftId(fleet.craft_count())], ..Peers::default() }
    }

    /// Takes part in `turn`.
    pub fn open_turn(&mut self, now: Nanos, turn: Turn, counting: &mut Counting, out: &mut Outbox) {
        self.turn = turn;
        self.intended = now;
        self.firing = None;
        self.is_final = false;
        (self.checks_asked, self.checks_answered) = (0, 0);
        if self.is_registered {
            self.ask(Kind::Instruction, 0, Stage::Asking, counting, out);
        } else {
            self.is_registered = true;
            self.ask(Kind::Register, 0, Stage::Registering, counting, out);
        }
    }

    /// Takes part no longer.
    pub fn sign_off(&mut self, counting: &mut Counting, out: &mut Outbox) {
        self.ask(Kind::SignOff, 0, Stage::SigningOff, counting, out);
    }

    /// Reads an answer and asks the next question.
    ///
    /// # Errors
    /// If the answer names something that does not exist, or nothing was asked.
    pub fn receive_reply(
        &mut self,
        header: &Header,
        changes: &[Change],
        fleet: &FleetView<'_>,
        counting: &mut Counting,
        out: &mut Outbox,
    ) -> Result<(), Refusal> {
        let board = fleet.board(self.craft);
        for change in changes {
            let origin = change.version.writer;
            if let Some(fact) = fleet.board(origin).target_on(change.fact, self.craft) {
                self.mirror.merge(board, fact, change.value, change.version);
            }
        }
        match self.stage {
            Stage::Resting => return Err(Refusal::Kind),
            Stage::Registering => self.ask(Kind::Instruction, 0, Stage::Asking, counting, out),
            Stage::Asking => self.run(Firing(header.argument), fleet, counting, out)?,
            Stage::Reporting => self.check(fleet, counting, out),
            Stage::Checking => {
                self.checks_answered += 1;
                self.is_final |= header.argument != 0;
                self.check(fleet, counting, out);
            }
            Stage::SigningOff => {
                self.stage = Stage::Resting;
                out.is_finished = true;
            }
        }
        Ok(())
    }

    /// Digest of the mirror.
    #[must_use]
    pub fn digest(&self) -> u64 {
        self.mirror.digest()
    }

    fn spec(&self) -> &EpochSpec {
        self.spec.as_ref().expect("invariant: an epoch began")
    }

    fn run(
        &mut self,
        firing: Firing,
        fleet: &FleetView<'_>,
        counting: &mut Counting,
        out: &mut Outbox,
    ) -> Result<(), Refusal> {
        let board = fleet.board(self.craft);
        self.firing = Some(firing);
        if firing.is_idle() {
            counting.counters.idle_turns += 1;
            self.check(fleet, counting, out);
            return Ok(());
        }
        if firing.0 >= board.rule_count() + board.action_count() {
            return Err(Refusal::Record);
        }
        let mut changes = std::mem::take(&mut self.changes);
        let effect = self.acting.spend(board, firing);
        effect.bring(&mut self.mirror, board, self.craft, firing, &mut changes);
        if self.spec().sends_altered_only {
            changes.retain(|change| change.altered);
        }
        counting.fired(board, &changes);
        let mut header = self.header(Kind::Result);
        header.firing_number = self.firing_number;
        self.firing_number += 1;
        self.stage = Stage::Reporting;
        let range = out.put_changes(&changes);
        out.send(Destination::Craft(self.centre), header, range, counting);
        self.changes = changes;
        Ok(())
    }

    /// Sends the next checks or, when all are answered, reports the turn as fired.
    fn check(&mut self, fleet: &FleetView<'_>, counting: &mut Counting, out: &mut Outbox) {
        self.stage = Stage::Checking;
        let finals = fleet.board(self.craft).finals;
        let (wanted, depth) = match self.spec().strategy {
            StrategyKind::CentralBatched => (0, 0),
            StrategyKind::Pipelined => (finals.len(), PIPELINE_DEPTH),
            _ => (finals.len(), 1),
        };
        while self.checks_asked < wanted && self.checks_asked - self.checks_answered < depth {
            let fact = FactId(finals[self.checks_asked]);
            self.checks_asked += 1;
            self.ask(Kind::Check, fact.0, Stage::Checking, counting, out);
        }
        if self.checks_answered == wanted {
            self.stage = Stage::Resting;
            out.reports.push(TurnReport {
                turn: self.turn.0,
                phase: TurnPhase::Fired as u32,
                firing: self.firing.unwrap_or(Firing::IDLE).0,
                owed: 0,
                held: 0,
                is_final: u32::from(self.is_final),
            });
        }
    }

    fn header(&self, kind: Kind) -> Header {
        let mut header = header(Class::Replication, kind, self.craft, self.spec().epoch, self.turn);
        header.intended_ns = self.intended.0;
        header
    }

    fn ask(
        &mut self,
        kind: Kind,
        argument: u32,
        stage: Stage,
        counting: &mut Counting,
        out: &mut Outbox,
    ) {
        let mut header = self.header(kind);
        header.argument = argument;
        self.stage = stage;
        out.send(Destination::Craft(self.centre), header, 0..0, counting);
    }
}
