//! A scenario with everything said: checked, defaults filled in, names turned into ids.

use super::compile::mission_boards;
use super::draft::{BoardDraft, Entries, Shared};
use super::error::{Finding, ScenarioError, place};
use super::flags;
use super::fleet::{self, Craft};
use super::mission;
use super::names::NameTable;
use super::positions::LinkTable;
use super::reach::Reached;
use super::stated_link::{link_spec, open_recovery, simulated_recovery};
use super::thinking;
use super::validate;
use shared_types::ids::{ActionId, CraftId};
use shared_types::knowledge::{BoardNetwork, Topology};
use shared_types::scenario::{
    ActionEntry, CraftCount, OneOrMany, ProcessFault, Restart, RunMode, Scenario, SendPolicy, Trace,
};
use shared_types::wire::{EpochSpec, LinkSpec, RecoverySpec, StrategyKind};

/// A scenario that can be run as it stands. Written back as TOML it reads as the same value.
#[derive(Clone, Debug, PartialEq)]
pub struct ResolvedScenario {
    scenario: Scenario,
    crafts: Vec<Craft>,
    topology: Topology,
    strategies: Vec<StrategyKind>,
    links: LinkTable,
    link: Option<LinkSpec>,
    boards: Vec<BoardNetwork>,
    names: NameTable,
    entries: Vec<Entries>,
    notices: Vec<String>,
    /// What is odd about the mission, until its places are known.
    flags: Vec<Finding>,
}

impl ResolvedScenario {
    /// Checks a scenario that a program put together.
    ///
    /// # Errors
    /// The first thing that is wrong; the place is named by its keys.
    pub fn new(scenario: Scenario) -> Result<Self, ScenarioError> {
        Ok(Self::check(scenario)?.with_places(ScenarioError::from))
    }

    /// Checks `scenario` and fills in what depends on the rest of it.
    pub(super) fn check(mut scenario: Scenario) -> Result<Self, Finding> {
        check_knowledge(&scenario)?;
        let crafts = fleet::crafts(&scenario)?;
        validate::check(&scenario, &crafts)?;
        let topology = fleet::topology(&scenario, &crafts)?;
        let strategies = strategies(&scenario, &topology)?;
        let links = LinkTable::new(&scenario, &crafts)?;
        let (drafts, shared): (Vec<BoardDraft>, Vec<Shared>) = if scenario.network.is_none() {
            mission::draft(&scenario, &crafts)?
        } else {
            (Vec::new(), Vec::new())
        };
        links.check_range(&crafts, &shared, &topology, &strategies)?;
        let entries: Vec<Entries> = drafts.iter().map(BoardDraft::entries).collect();
        let (boards, names) = mission_boards(&crafts, drafts, &shared);
        let link = link_spec(&scenario, &crafts, &names);
        let mut notices = notices(&scenario, link.is_some());
        notices.extend(thinking::notices(&scenario, &strategies));
        let mut flags = Vec::new();
        if scenario.network.is_none() {
            let reached = Reached::of(&boards);
            reached.check(&scenario, &boards, &names)?;
            flags = flags::flags(&reached, &boards, &entries, &names);
        }
        thinking::check(&scenario, CraftId::from_index(crafts.len()).0, &boards)?;
        if scenario.craft.is_empty() && scenario.fleet.crafts.is_none() {
            scenario.fleet.crafts = Some(CraftCount::Number(CraftId::from_index(crafts.len()).0));
        }
        scenario.topology.tree = Some(fleet::tree(&scenario));
        scenario.replication.strategies = Some(OneOrMany(strategies.clone()));
        Ok(Self {
            scenario,
            crafts,
            topology,
            strategies,
            links,
            link,
            boards,
            names,
            entries,
            notices,
            flags,
        })
    }

    /// Puts what is odd about the mission behind the other notices, at the places that `placed` gives.
    pub(super) fn with_places(mut self, placed: impl Fn(Finding) -> ScenarioError) -> Self {
        for flag in std::mem::take(&mut self.flags) {
            let error = placed(flag);
            let remedy = error.remedy().unwrap_or_default();
            self.notices.push(match error.position() {
                Some(position) => format!("{position}: {}; {remedy}", error.message()),
                None => format!("{}; {remedy}", error.message()),
            });
        }
        self
    }

    /// The same scenario with so many crafts, for fleets that are not listed.
    ///
    /// # Errors
    /// As [`Self::new`]; crafts that are listed cannot be counted anew.
    pub fn with_craft_count(&self, craft_count: u32) -> Result<Self, ScenarioError> {
        let mut scenario = self.scenario.clone();
        scenario.fleet.crafts = Some(CraftCount::Number(craft_count));
        Self::new(scenario)
    }

    /// The same scenario with so many writes of one craft due together.
    ///
    /// # Panics
    /// If the burst is none that `check` accepts as one of `capacity.bursts`.
    #[must_use]
    pub fn with_burst(&self, burst: u32) -> Self {
        assert!(burst > 0, "invariant: bursts were checked");
        let mut resolved = self.clone();
        resolved.scenario.trace.burst = burst;
        resolved
    }

    /// What was written, defaults filled in.
    #[must_use]
    pub const fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// The crafts, by id.
    #[must_use]
    pub fn crafts(&self) -> &[Craft] {
        &self.crafts
    }

    /// How many crafts, the centre not counted.
    #[must_use]
    pub fn craft_count(&self) -> u32 {
        CraftId::from_index(self.crafts.len()).0
    }

    /// The strategies to run, in order.
    #[must_use]
    pub fn strategies(&self) -> &[StrategyKind] {
        &self.strategies
    }

    /// What crafts are told of `trial` under `strategy`, as epoch 0 with its own networks; timing
    /// epochs change turns and end condition.
    #[must_use]
    pub fn epoch_spec(&self, strategy: StrategyKind, trial: u32) -> EpochSpec {
        let Scenario { replication, run, .. } = &self.scenario;
        EpochSpec {
            epoch: 0,
            network: 0,
            seed: run.seed,
            trial,
            strategy,
            own_firing_only: replication.own_firing_only,
            ignores_finals: false,
            sends_altered_only: replication.send == SendPolicy::Altered,
            record_bytes: replication.record_bytes,
            turns_max: run.turns,
            reasoning: self.scenario.reasoning,
            recovery: simulated_recovery(&self.scenario, self.link.as_ref()),
            open: None,
            link: None,
        }
    }

    /// How processes, real and simulated, repair in an interval of open mode what they lose, where they
    /// are to.
    #[must_use]
    pub fn open_recovery(&self) -> Option<RecoverySpec> {
        open_recovery(&self.scenario, self.link.as_ref())
    }

    /// What links do to samples, in simulation and in intervals of real processes; `None` if nothing.
    #[must_use]
    pub const fn link_spec(&self) -> Option<&LinkSpec> {
        self.link.as_ref()
    }

    /// Tree and groups.
    #[must_use]
    pub const fn topology(&self) -> &Topology {
        &self.topology
    }

    /// What the mission says of an action of `craft`; `None` for generated networks.
    #[must_use]
    pub fn action_entry(&self, craft: CraftId, action: ActionId) -> Option<&ActionEntry> {
        let entries = self.entries.get(craft.index())?;
        self.scenario.action.get(*entries.actions.get(action.index())?)
    }

    /// What ids are called.
    #[must_use]
    pub const fn names(&self) -> &NameTable {
        &self.names
    }

    /// Range between crafts.
    #[must_use]
    pub const fn links(&self) -> &LinkTable {
        &self.links
    }

    /// The boards of a mission; empty for generated networks.
    pub(super) fn mission_boards(&self) -> &[BoardNetwork] {
        &self.boards
    }

    /// What is to be said once before a run: what this version only checks, what the mode ignores,
    /// what of a mission is dead. One sentence each.
    #[must_use]
    pub fn notices(&self) -> &[String] {
        &self.notices
    }

    /// The scenario as TOML, every default spelt out: what is stored as `scenario.resolved.toml`.
    ///
    /// # Panics
    /// Never: everything that passed the checks has a form in TOML.
    #[must_use]
    pub fn to_toml(&self) -> String {
        toml::to_string(&self.scenario).expect("invariant: checked scenarios have a form in TOML")
    }
}

/// What the scenario states and this version only checks, or the mode ignores.
fn notices(scenario: &Scenario, has_links: bool) -> Vec<String> {
    let Scenario { faults, run, .. } = scenario;
    let is_simulated = run.mode.is_simulated();
    let is_offered = run.mode.is_open() || !scenario.load.is_empty();
    let has_turns = !run.mode.is_open();
    let is_in_turns = |fault: &ProcessFault| fault.at_turn.is_some();
    let notices = [
        (
            run.mode == RunMode::Lockstep && has_links,
            "`link` acts in simulation and in open mode, not in real lockstep",
        ),
        (
            run.rate_per_s.is_some() && !(run.mode.is_open() && scenario.load.is_empty()),
            "`run.rate-per-s` acts in `record`, and in open mode without a `[[load]]`",
        ),
        (
            run.duration_s.is_some() && !is_offered,
            "`run.duration-s` acts in `record` and in open mode",
        ),
        (
            scenario.trace != Trace::default() && !is_offered,
            "`trace` acts in `record` and in open mode",
        ),
        (
            is_simulated && !scenario.capacity.bursts.is_empty(),
            "`capacity` is searched on real processes only",
        ),
        (
            is_simulated && faults.process.iter().any(is_in_turns),
            "a `faults.process` with `at-turn` acts on real processes only",
        ),
        (
            is_simulated && !is_offered && faults.process.iter().any(|fault| !is_in_turns(fault)),
            "a `faults.process` with `at-s` acts in intervals of open mode",
        ),
        (
            is_simulated && has_turns && faults.restart == Restart::OnFailure,
            "`faults.restart` acts on real processes and in intervals of open mode",
        ),
    ];
    let applying = notices.into_iter().filter(|(applies, _)| *applies);
    applying.map(|(_, notice)| notice.to_owned()).collect()
}

/// Whether the scenario says what crafts know, and says it once.
fn check_knowledge(scenario: &Scenario) -> Result<(), Finding> {
    let written = [
        ("rule", scenario.rule.is_empty()),
        ("action", scenario.action.is_empty()),
        ("boundary", scenario.boundary.is_empty()),
    ];
    let first_written = written.into_iter().find(|(_, is_empty)| !is_empty).map(|(key, _)| key);
    match (&scenario.network, first_written) {
        (Some(_), Some(key)) => Err(Finding::at(
            place![key],
            format!("[[{key}]] beside [network]: networks are generated or written out, not both"),
        )
        .help("remove [network] to run your own mission, or the written-out entries to generate")),
        (Some(_), None) => {
            let knows = scenario
                .craft
                .iter()
                .position(|craft| !craft.initial.is_empty() || !craft.r#final.is_empty());
            knows.map_or(Ok(()), |index| {
                Err(Finding::at(
                    place!["craft", index, "name"],
                    "facts are stated beside [network]",
                )
                .help("generated networks draw their own; remove `initial` and `final`"))
            })
        }
        (None, Some(_)) if !scenario.rule.is_empty() => Ok(()),
        (None, _) => Err(Finding::at(place!["rule"], "the scenario has no rules").help(
            "write some ([[rule]] with `if` and `then`; `show two-craft` prints an example) or \
                 generate them ([network])",
        )),
    }
}

/// The strategies to run: as listed, else all that need no statement of their own.
fn strategies(scenario: &Scenario, topology: &Topology) -> Result<Vec<StrategyKind>, Finding> {
    let has_groups = !topology.group.is_empty();
    match &scenario.replication.strategies {
        Some(strategies) => {
            let hybrid = strategies.iter().position(|&strategy| strategy == StrategyKind::Hybrid);
            if let Some(index) = hybrid.filter(|_| !has_groups) {
                return Err(Finding::at(
                    place!["replication", "strategies", index],
                    "`hybrid` needs groups, and none are stated",
                )
                .help("give every [[craft]] a `group`, or set `topology.group-size`")
                .label("without groups"));
            }
            Ok(strategies.0.clone())
        }
        None => Ok(StrategyKind::ALL
            .into_iter()
            .filter(|&strategy| strategy != StrategyKind::Pipelined)
            .filter(|&strategy| has_groups || strategy != StrategyKind::Hybrid)
            .collect()),
    }
}
