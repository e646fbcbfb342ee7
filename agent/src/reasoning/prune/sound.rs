//! The pruner for use: what it leaves out can serve no plan to a goal, now or later.
//!
//! Two closures over literals (a fact that holds, or that is known absent). Forwards, what *can hold*:
//! what is known, what may come from outside, and what a rule writes whose premises can all hold.
//! Backwards, what is *wanted*: goals, what others may read, and what a useful rule reads; a rule is
//! useful if it can fire and writes something wanted, itself or through an action. That a fact may be
//! de-asserted again is left out of account on both ways, which only ever keeps more.
//!
//! [`Sound`] keeps both closures and follows changes: what is added is followed forwards, what is taken
//! away is first taken with all that leant on it, then what something else still holds is put back
//! (delete and re-derive). Either touches only the part that depends on the change. The same from
//! scratch, as loops, is [`super::reference::sound`].

use crate::reasoning::{Kept, Producers};
use shared_types::ids::FactId;
use shared_types::knowledge::{BoardView, Literal};

/// The closures of one board's network.
#[derive(Clone, Debug)]
pub struct Sound {
    producers: Producers,
    /// By literal: whether it is known, whether it is a goal.
    is_known: Vec<bool>,
    is_goal: Vec<bool>,
    /// By fact: whether other boards may write and read it.
    is_open: Vec<bool>,
    can_hold: Vec<bool>,
    /// By rule: premises that cannot hold, repeats counted.
    unmet: Vec<u32>,
    is_wanted: Vec<bool>,
    is_useful: Vec<bool>,
    /// Rules that began, and that ceased, to be able to fire.
    gained: Vec<u32>,
    lost: Vec<u32>,
    work: Vec<u32>,
}

impl Sound {
    /// The closures of `board`, whose facts hold what `known` says, towards `goals`. Its boundary facts
    /// are open: other boards may write and read them.
    #[must_use]
    pub fn new(
        board: &BoardView<'_>,
        known: impl IntoIterator<Item = Literal>,
        goals: impl IntoIterator<Item = Literal>,
    ) -> Self {
        let (literals, rules) = (2 * board.fact_count as usize, board.premises.row_count());
        let mut sound = Self {
            producers: Producers::of(board),
            is_known: vec![false; literals],
            is_goal: vec![false; literals],
            is_open: vec![false; board.fact_count as usize],
            can_hold: vec![false; literals],
            unmet: board.premises.lengths().collect(),
            is_wanted: vec![false; literals],
            is_useful: vec![false; rules],
            gained: Vec::new(),
            lost: Vec::new(),
            work: Vec::new(),
        };
        for rule in 0..board.rule_count() {
            if sound.unmet[rule as usize] == 0 {
                sound.gain(board, rule);
            }
        }
        let mut ends: Vec<u32> = Vec::new();
        for fact in (0..board.fact_count).filter(|&fact| board.is_boundary(FactId(fact))) {
            sound.is_open[fact as usize] = true;
            ends.extend([fact << 1, fact << 1 | 1]);
        }
        let open = ends.len();
        ends.extend(known.into_iter().map(|literal| literal.0));
        ends[open..].iter().for_each(|&literal| sound.is_known[literal as usize] = true);
        sound.raise(board, &ends);
        sound.gained.clear();
        ends.truncate(open);
        ends.extend(goals.into_iter().map(|goal| goal.0));
        ends[open..].iter().for_each(|&goal| sound.is_goal[goal as usize] = true);
        sound.want(board, &ends);
        sound
    }

    /// From now on `literal` is known, or is not.
    pub fn set_known(&mut self, board: &BoardView<'_>, literal: Literal, is_known: bool) {
        let at = literal.0 as usize;
        if std::mem::replace(&mut self.is_known[at], is_known) == is_known {
            return;
        }
        if is_known {
            self.raise(board, &[literal.0]);
        } else {
            self.lower(board, literal.0);
        }
        self.follow_rules(board);
    }

    /// From now on `literal` is a goal, or is not.
    pub fn set_goal(&mut self, board: &BoardView<'_>, literal: Literal, is_goal: bool) {
        let at = literal.0 as usize;
        if std::mem::replace(&mut self.is_goal[at], is_goal) == is_goal {
            return;
        }
        if is_goal {
            self.want(board, &[literal.0]);
        } else {
            let mut dropped = Vec::new();
            self.drop_wish(board, literal.0, &mut dropped);
            self.put_wishes_back(board, &dropped);
        }
    }

    /// Whether some plan can need the fact.
    #[must_use]
    pub fn keeps_fact(&self, fact: FactId) -> bool {
        let literals = [2 * fact.index(), 2 * fact.index() + 1];
        literals.into_iter().any(|at| self.is_goal[at] || (self.is_wanted[at] && self.can_hold[at]))
    }

    /// Whether some plan can need the rule.
    #[must_use]
    pub fn keeps_rule(&self, rule: u32) -> bool {
        self.is_useful[rule as usize]
    }

    /// Whether some plan can need the action.
    #[must_use]
    pub fn keeps_action(&self, board: &BoardView<'_>, action: u32) -> bool {
        let outputs = board.action_outputs.row(action as usize);
        outputs.iter().any(|&literal| self.is_wanted[literal as usize])
            && self.producers.queuing(action).iter().any(|&rule| self.is_useful[rule as usize])
    }

    /// What is kept, as flags.
    #[must_use]
    pub fn kept(&self, board: &BoardView<'_>) -> Kept {
        Kept {
            facts: (0..board.fact_count).map(|fact| self.keeps_fact(FactId(fact))).collect(),
            rules: self.is_useful.clone(),
            actions: (0..board.action_count())
                .map(|action| self.keeps_action(board, action))
                .collect(),
        }
    }

    fn is_source(&self, literal: u32) -> bool {
        self.is_known[literal as usize] || self.is_open[literal as usize >> 1]
    }

    fn is_wish(&self, literal: u32) -> bool {
        self.is_goal[literal as usize] || self.is_open[literal as usize >> 1]
    }

    /// Everything that can hold now that `literals` can. First come first served: what is next does not
    /// depend on what is under way, so that a large network's memory is waited for side by side.
    fn raise(&mut self, board: &BoardView<'_>, literals: &[u32]) {
        let mut work = std::mem::take(&mut self.work);
        work.clear();
        work.extend(literals);
        let mut next = 0;
        while let Some(&literal) = work.get(next) {
            next += 1;
            if std::mem::replace(&mut self.can_hold[literal as usize], true) {
                continue;
            }
            for rule in readers(board, literal) {
                self.unmet[rule as usize] -= 1;
                if self.unmet[rule as usize] == 0 {
                    self.gained.push(rule);
                    each_output(board, rule, |output| work.push(output));
                }
            }
        }
        self.work = work;
    }

    /// A rule without premises can always fire.
    fn gain(&mut self, board: &BoardView<'_>, rule: u32) {
        let mut outputs = Vec::new();
        each_output(board, rule, |output| outputs.push(output));
        self.raise(board, &outputs);
    }

    /// Takes away what leant on `literal`, then puts back what something else still holds.
    fn lower(&mut self, board: &BoardView<'_>, literal: u32) {
        let mut work = vec![literal];
        let mut lowered = Vec::new();
        while let Some(literal) = work.pop() {
            let at = literal as usize;
            if self.is_source(literal) || !std::mem::take(&mut self.can_hold[at]) {
                continue;
            }
            lowered.push(literal);
            for rule in readers(board, literal) {
                self.unmet[rule as usize] += 1;
                if self.unmet[rule as usize] == 1 {
                    self.lost.push(rule);
                    each_output(board, rule, |output| work.push(output));
                }
            }
        }
        for literal in lowered {
            let can_fire = |rule: u32| self.unmet[rule as usize] == 0;
            let is_written = self.producers.of_literal(literal).any(can_fire);
            if is_written {
                self.raise(board, &[literal]);
            }
        }
    }

    /// Follows rules that began or ceased to be able to fire back to what they read.
    fn follow_rules(&mut self, board: &BoardView<'_>) {
        let (lost, gained) = (std::mem::take(&mut self.lost), std::mem::take(&mut self.gained));
        let mut dropped = Vec::new();
        for &rule in &lost {
            if self.unmet[rule as usize] > 0 {
                self.drop_rule(board, rule, &mut dropped);
            }
        }
        self.put_wishes_back(board, &dropped);
        for &rule in &gained {
            self.use_rule(board, rule);
        }
        (self.lost, self.gained) = (lost, gained);
        self.lost.clear();
        self.gained.clear();
    }

    /// Everything that is wanted now that `literals` are; in the order of [`Self::raise`].
    fn want(&mut self, board: &BoardView<'_>, literals: &[u32]) {
        let mut work = std::mem::take(&mut self.work);
        work.clear();
        work.extend(literals);
        let mut next = 0;
        while let Some(&literal) = work.get(next) {
            next += 1;
            if std::mem::replace(&mut self.is_wanted[literal as usize], true) {
                continue;
            }
            for rule in self.producers.of_literal(literal) {
                let at = rule as usize;
                if self.unmet[at] == 0 && !std::mem::replace(&mut self.is_useful[at], true) {
                    work.extend(board.premises.row(at));
                }
            }
        }
        self.work = work;
    }

    /// Makes a rule useful that can fire and writes something wanted.
    fn use_rule(&mut self, board: &BoardView<'_>, rule: u32) {
        let at = rule as usize;
        if self.unmet[at] > 0 || self.is_useful[at] {
            return;
        }
        let mut serves = false;
        each_output(board, rule, |output| serves |= self.is_wanted[output as usize]);
        if serves {
            self.is_useful[at] = true;
            self.want(board, board.premises.row(at));
        }
    }

    /// Takes away the wish for `literal`, and every use that leant on it.
    fn drop_wish(&mut self, board: &BoardView<'_>, literal: u32, dropped: &mut Vec<u32>) {
        let mut work = vec![literal];
        while let Some(literal) = work.pop() {
            if self.is_wish(literal) || !std::mem::take(&mut self.is_wanted[literal as usize]) {
                continue;
            }
            dropped.push(literal);
            for rule in self.producers.of_literal(literal) {
                if std::mem::take(&mut self.is_useful[rule as usize]) {
                    work.extend(board.premises.row(rule as usize));
                }
            }
        }
    }

    fn drop_rule(&mut self, board: &BoardView<'_>, rule: u32, dropped: &mut Vec<u32>) {
        if std::mem::take(&mut self.is_useful[rule as usize]) {
            for &premise in board.premises.row(rule as usize) {
                self.drop_wish(board, premise, dropped);
            }
        }
    }

    /// Puts back the uses, and so the wishes, that something else still holds.
    fn put_wishes_back(&mut self, board: &BoardView<'_>, dropped: &[u32]) {
        for &literal in dropped {
            let rules: Vec<u32> = self.producers.of_literal(literal).collect();
            rules.into_iter().for_each(|rule| self.use_rule(board, rule));
            let is_read = readers(board, literal).any(|rule| self.is_useful[rule as usize]);
            if is_read {
                self.want(board, &[literal]);
            }
        }
    }
}

/// The rules that read `literal`, one entry a premise.
fn readers<'a>(board: &BoardView<'a>, literal: u32) -> impl Iterator<Item = u32> + use<'a> {
    let row = board.readers.row(literal as usize >> 1);
    row.iter().filter(move |&&packed| packed & 1 == literal & 1).map(|&packed| packed >> 1)
}

/// Every literal that `rule` writes, itself and through its actions.
fn each_output(board: &BoardView<'_>, rule: u32, mut visit: impl FnMut(u32)) {
    board.outputs.row(rule as usize).iter().for_each(|&output| visit(output));
    for &action in board.queues.row(rule as usize) {
        board.action_outputs.row(action as usize).iter().for_each(|&output| visit(output));
    }
}
