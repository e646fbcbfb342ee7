//! What a craft of open mode tells and learns as state, and how it plans round those that are gone.
//!
//! Any sharer can tell what any other wrote: the board knows who wrote what it holds. Not here: when a
//! state is asked for (`recovery`), and the boards of central strategies (`open_client`, `open_centre`).

use super::open::Open;
use super::recovering::{is_news, within};
use super::recovery::Evidence;
use shared_types::ids::CraftId;
use shared_types::knowledge::{Change, FactState, FleetView, Topology};
use std::ops::Range;

impl Open {
    /// The craft recovers; its writes have at least the count `floor`.
    pub(super) fn begin_recovery(&mut self, floor: u32, fleet: &FleetView<'_>) {
        self.board.set_count_floor(floor);
        self.set_detour(fleet);
    }

    /// `craft` is gone or back: plans go round it.
    pub(super) fn reroute(&mut self, craft: CraftId, is_gone: bool, fleet: &FleetView<'_>) {
        self.gone.retain(|&gone| gone != craft);
        if is_gone {
            self.gone.push(craft);
        }
        self.set_detour(fleet);
    }

    fn set_detour(&mut self, fleet: &FleetView<'_>) {
        if !self.strategy.relays() {
            return;
        }
        let cut = || Topology::without(&fleet.topology, |craft| self.gone.contains(&craft));
        let detour = if self.gone.is_empty() { None } else { cut() };
        self.strategy.reroute(detour);
    }

    /// The versions held here of what `facts` of `teller` reach, as `teller` numbers them.
    pub(super) fn digest(
        &self,
        teller: CraftId,
        facts: Range<u32>,
        fleet: &FleetView<'_>,
        out: &mut Vec<Change>,
    ) {
        let board = fleet.board(teller);
        for fact in within(facts, board.fact_count) {
            let Some(own) = board.target_on(fact, self.craft) else { continue };
            let FactState { value, version } = self.board.state(own);
            if version.count > 0 {
                out.push(Change { fact, value, version, altered: false });
            }
        }
    }

    /// What `asker` lacks of `facts`, as far as this board knows: what `known` says that it holds is
    /// left out, except where replicas are kept, of which it says nothing.
    pub(super) fn tell(
        &self,
        asker: CraftId,
        facts: Range<u32>,
        known: &[Change],
        fleet: &FleetView<'_>,
        out: &mut Vec<Change>,
    ) {
        let board = fleet.board(self.craft);
        for fact in within(facts.clone(), board.fact_count) {
            let at_asker = board.target_on(fact, asker);
            for change in self.authors.changes(&self.board, fact) {
                let writer = change.version.writer;
                let reached = if writer == asker {
                    Some(change.fact)
                } else {
                    fleet.board(writer).target_on(change.fact, asker)
                };
                let is_own = writer == self.craft && self.strategy.replicates(board, fact);
                let is_told = match reached {
                    Some(reached) => at_asker != Some(reached) || is_news(&change, fact, known),
                    None => false,
                };
                if is_told || is_own {
                    out.push(change);
                }
            }
        }
        if self.keeps_replicas {
            for fact in within(facts, fleet.board(asker).fact_count) {
                let FactState { value, version } = self.replicas.state(asker, fact);
                if version.count > 0 {
                    out.push(Change { fact, value, version, altered: false });
                }
            }
        }
    }

    /// What `asker`, which says what it knows of this board's facts, knows that is newer and that this
    /// board should hold as well: written by a craft whose fact reaches this board. Where links do not all
    /// lead everywhere `asker` may rightly hold what nobody is to tell this board, and a digest does not say
    /// which of its writer's facts it is.
    pub(super) fn newer_at(
        &self,
        asker: CraftId,
        known: &[Change],
        fleet: &FleetView<'_>,
    ) -> Option<Evidence> {
        let board = fleet.board(self.craft);
        Evidence::of(known.iter().filter(|held| {
            let there = (held.fact.0 < board.fact_count)
                .then(|| board.target_on(held.fact, asker))
                .flatten();
            let leads_back =
                |craft, there| fleet.board(craft).target_on(there, self.craft) == Some(held.fact);
            let writer = held.version.writer;
            let reaches = || {
                let at_writer = board.target_on(held.fact, writer);
                writer == self.craft || at_writer.is_some_and(|fact| leads_back(writer, fact))
            };
            there.is_some_and(|there| leads_back(asker, there))
                && held.version > self.board.state(held.fact).version
                && reaches()
        }))
    }

    /// Takes over what a peer told as state; returns how much of it was news.
    pub(super) fn learn(&mut self, changes: &[Change], fleet: &FleetView<'_>) -> u64 {
        let board = fleet.board(self.craft);
        let mut learnt = 0;
        for change in changes {
            let &Change { fact, value, version, .. } = change;
            let writer = version.writer;
            let own = if writer == self.craft {
                Some(fact)
            } else {
                fleet.board(writer).target_on(fact, self.craft)
            };
            if let Some(own) = own
                && self.board.merge(board, own, value, version).accepted
            {
                learnt += 1;
                if writer == self.craft {
                    self.authors.wrote(change);
                } else {
                    self.authors.learnt(own, fact);
                }
            }
            if self.keeps_replicas && writer != self.craft {
                self.replicas.tell(writer, fact, FactState { value, version });
            }
        }
        learnt
    }
}
