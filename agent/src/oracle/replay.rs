//! The replay of one trial: who fires what in which turn, what that changes, how the trial ends.

use super::board::PlainBoard;
use super::digest::{board_digest, path_digest};
use super::policy::{self, LastRule};
use crate::lockstep::Outcome;
use shared_types::ids::{CraftId, Firing, Turn};
use shared_types::knowledge::{Change, FactState, FleetView};
use shared_types::reasoning::Policy;
use shared_types::rng::{Purpose, Stream};
use shared_types::wire::EpochSpec;
use std::ops::Range;

/// What became of a firing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turnout {
    /// It wrote what it says.
    Done,
    /// An action that went on in the next turn.
    Underway,
    /// An action that brought about nothing.
    InVain,
}

/// One firing of the trial; idle crafts have none. An action of several turns is one in each.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fired {
    /// In which turn.
    pub turn: Turn,
    /// By whom.
    pub craft: CraftId,
    /// What ran.
    pub firing: Firing,
    /// What became of it.
    pub turnout: Turnout,
    /// The changes that are sent, as a range of [`Replay::changes`], ascending by fact.
    pub(super) sent: Range<usize>,
}

/// A trial as it must go, whatever strategy replicates it.
#[derive(Clone, Debug)]
pub struct Replay {
    /// Turns that were played.
    pub turns: u32,
    /// How the trial ended.
    pub outcome: Outcome,
    /// Every firing, by turn and craft.
    pub firings: Vec<Fired>,
    /// Per craft the merges that the craft id decided because the counts were equal.
    pub conflicts: Vec<u64>,
    /// Per craft the facts of its board at the end.
    pub boards: Vec<Vec<FactState>>,
    changes: Vec<Change>,
}

impl Replay {
    /// Replays the trial that `spec` names on `fleet`. The strategy in `spec` is not looked at.
    ///
    /// A trial ends with the turn in which a firing newly asserts a final fact of its own board or,
    /// unless only own firings count, after whose merge a final fact is asserted on a board that
    /// declares it (one that was asserted from the start counts as well). A turn in which no craft
    /// has a candidate is counted and ends the trial as stalled. Trials that ignore finals play
    /// exactly the turns that they may.
    #[must_use]
    pub fn of(fleet: &FleetView<'_>, spec: &EpochSpec) -> Self {
        let mut trial = Trial::new(fleet, spec);
        let mut turns = 0;
        let outcome = loop {
            if turns == spec.turns_max {
                break Outcome::Dropped;
            }
            let end = trial.play(Turn(turns));
            turns += 1;
            match end {
                Some(outcome) if !spec.ignores_finals => break outcome,
                _ => {}
            }
        };
        Self {
            turns,
            outcome,
            firings: trial.firings,
            conflicts: trial.conflicts,
            boards: trial.boards.into_iter().map(|board| board.states).collect(),
            changes: trial.changes,
        }
    }

    /// The changes that `fired` sends under every strategy that sends something: all that it made or,
    /// where only altering ones are sent, those. Ascending by fact.
    #[must_use]
    pub fn changes(&self, fired: &Fired) -> &[Change] {
        &self.changes[fired.sent.clone()]
    }

    /// What was fired, by turn and craft.
    pub fn path(&self) -> impl Iterator<Item = (Turn, CraftId, Firing)> {
        self.firings.iter().map(|fired| (fired.turn, fired.craft, fired.firing))
    }

    /// Digest of [`Self::path`]; for its encoding see [`path_digest`].
    #[must_use]
    pub fn path_digest(&self) -> u64 {
        path_digest(self.path())
    }

    /// Per craft the digest of its board at the end; for its encoding see [`board_digest`]. Under
    /// `null` nothing is merged, so there only the path agrees.
    #[must_use]
    pub fn board_digests(&self) -> Vec<u64> {
        self.boards.iter().map(|states| board_digest(states)).collect()
    }

    /// Per craft its firing of every turn, [`Firing::IDLE`] where it had none: what `null` replays.
    #[must_use]
    pub fn script(&self) -> Vec<Vec<u32>> {
        let mut script = vec![vec![Firing::IDLE.0; self.turns as usize]; self.boards.len()];
        for (turn, craft, firing) in self.path() {
            script[craft.index()][turn.index()] = firing.0;
        }
        script
    }
}

/// A trial while it is played.
struct Trial<'a> {
    fleet: &'a FleetView<'a>,
    spec: &'a EpochSpec,
    boards: Vec<PlainBoard>,
    draws: Vec<Stream>,
    last_rules: Vec<LastRule>,
    /// Per craft the action that it is at, and the turns that it has spent on it.
    works: Vec<Option<(Firing, u32)>>,
    /// Per craft what its actions come to.
    outcomes: Vec<Stream>,
    firings: Vec<Fired>,
    changes: Vec<Change>,
    conflicts: Vec<u64>,
    /// Scratch memory.
    candidates: Vec<u32>,
}

impl<'a> Trial<'a> {
    fn new(fleet: &'a FleetView<'a>, spec: &'a EpochSpec) -> Self {
        let crafts = 0..fleet.craft_count();
        let stream = |purpose, craft| Stream::new(spec.seed, spec.trial, purpose, craft);
        Self {
            fleet,
            spec,
            boards: fleet.boards.iter().map(PlainBoard::new).collect(),
            draws: crafts.clone().map(|craft| stream(Purpose::Firing, craft)).collect(),
            works: vec![None; fleet.boards.len()],
            outcomes: crafts.map(|craft| stream(Purpose::Outcomes, craft)).collect(),
            last_rules: vec![LastRule::default(); fleet.boards.len()],
            firings: Vec::new(),
            changes: Vec::new(),
            conflicts: vec![0; fleet.boards.len()],
            candidates: Vec::new(),
        }
    }

    /// Plays one turn and says how the trial ends with it, if it does.
    fn play(&mut self, turn: Turn) -> Option<Outcome> {
        let first = self.firings.len();
        let mut is_final = false;
        for craft in (0..self.fleet.craft_count()).map(CraftId) {
            is_final |= self.fire(turn, craft);
        }
        if self.firings.len() == first {
            return Some(Outcome::Stalled);
        }
        self.merge(first);
        is_final |= !self.spec.own_firing_only
            && self
                .boards
                .iter()
                .zip(&self.fleet.boards)
                .any(|(board, network)| board.holds_a_final(network));
        is_final.then_some(Outcome::Finished)
    }

    /// Goes on with what `craft` is at, else draws and runs one candidate of it, if it has any; says
    /// whether that newly asserted a final fact. Nothing of this turn has been merged yet, and a firing
    /// writes to its own board only, so every craft fires on its board as it was when the turn opened.
    fn fire(&mut self, turn: Turn, craft: CraftId) -> bool {
        let network = self.fleet.board(craft);
        let chosen = match self.works[craft.index()] {
            Some((action, _)) => Some(action),
            None => {
                self.boards[craft.index()].list_candidates(network, &mut self.candidates);
                self.choose(craft)
            }
        };
        let Some(firing) = chosen else { return false };
        let turnout = self.turnout(craft, firing);
        let board = &mut self.boards[craft.index()];
        self.last_rules[craft.index()].note(firing, network.rule_count());

        let start = self.changes.len();
        let mut is_final = false;
        match turnout {
            Turnout::Done => is_final = board.fire(network, craft, firing, &mut self.changes),
            Turnout::Underway => {}
            Turnout::InVain => board.run_in_vain(network, firing),
        }
        if self.spec.sends_altered_only {
            let unsent = self.changes.split_off(start);
            self.changes.extend(unsent.into_iter().filter(|change| change.altered));
        }
        self.changes[start..].sort_by_key(|change| change.fact);
        let sent = start..self.changes.len();
        self.firings.push(Fired { turn, craft, firing, turnout, sent });
        is_final
    }

    /// What one more turn of `craft` on `firing` comes to: an action is over after as many turns as it
    /// takes, and then brings something about as often as it is likely to.
    fn turnout(&mut self, craft: CraftId, firing: Firing) -> Turnout {
        let network = self.fleet.board(craft);
        let Some(action) = firing.0.checked_sub(network.rule_count()) else {
            return Turnout::Done;
        };
        let work = &mut self.works[craft.index()];
        let spent = work.map_or(0, |(_, spent)| spent) + 1;
        if spent < network.action_duration(action) {
            *work = Some((firing, spent));
            return Turnout::Underway;
        }
        *work = None;
        let likelihood = network.action_likelihood(action);
        let is_certain = likelihood >= 1.0;
        if is_certain || self.outcomes[craft.index()].unit() < likelihood {
            Turnout::Done
        } else {
            Turnout::InVain
        }
    }

    /// What `craft` fires of its candidates; `None` if it is idle.
    fn choose(&mut self, craft: CraftId) -> Option<Firing> {
        let policy = self.spec.reasoning.policy;
        if policy != Policy::Random {
            let (board, last) = (&self.boards[craft.index()], self.last_rules[craft.index()]);
            return policy::choose(self.fleet, craft, board, &self.candidates, policy, last);
        }
        if self.candidates.is_empty() {
            return None;
        }
        let count = u32::try_from(self.candidates.len()).expect("invariant: boards are bounded");
        let draw = self.draws[craft.index()].below(count);
        Some(Firing(self.candidates[draw as usize]))
    }

    /// Merges what the firings from `first` on sent, in the order of origin and fact (each origin
    /// fired once this turn), into every linked board.
    fn merge(&mut self, first: usize) {
        for fired in &self.firings[first..] {
            for change in &self.changes[fired.sent.clone()] {
                let told = FactState { value: change.value, version: change.version };
                for target in self.fleet.board(fired.craft).targets(change.fact) {
                    let conflicts = self.boards[target.craft.index()].merge(target.fact, told);
                    self.conflicts[target.craft.index()] += u64::from(conflicts);
                }
            }
        }
    }
}
