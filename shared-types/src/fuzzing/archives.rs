//! Archives: what has no fixed size. An archive that is accepted is the value that it was made of.

use crate::ids::{CraftId, FactId};
use crate::knowledge::{BoardNetwork, FleetNetwork, FleetView, Topology};
use crate::limits::INBOX_PAYLOAD_BYTES;
use crate::reasoning::Reasoning;
use crate::trace::{TraceRecord, to_words};
use crate::wire::{
    CutOff, DELTA_BYTES, EpochSpec, HeldFact, LinkSpec, OpenReport, OpenSpec, OutageSpec, ReadSeen,
    RecoverySpec, Stage, StrategyKind, TrialReport,
};
use rkyv::rancor::Error;
use rkyv::util::AlignedVec;

/// Pairs of crafts between which ways are walked.
const WALKED_MAX: u32 = 12;

/// `bytes` where an archive may lie.
fn aligned(bytes: &[u8]) -> AlignedVec<16> {
    let mut aligned = AlignedVec::with_capacity(bytes.len());
    aligned.extend_from_slice(bytes);
    aligned
}

/// Reads what `$bytes` hold of type `$type`, writes it again and reads that: nothing changes.
macro_rules! reread {
    ($type:ty, $bytes:expr) => {{
        let read = |bytes: &[u8]| -> Option<$type> {
            let archived = rkyv::access::<rkyv::Archived<$type>, Error>(bytes).ok()?;
            Some(rkyv::deserialize::<$type, Error>(archived).expect("what is checked can be read"))
        };
        let value = read(&aligned($bytes));
        if let Some(value) = &value {
            let again = rkyv::to_bytes::<Error>(value).expect("memory takes every archive");
            assert_eq!(read(&again).as_ref(), Some(value));
        }
        value
    }};
}

/// What begins an epoch. Whatever a craft accepts of it can be archived and is accepted again.
pub(super) fn epochs(bytes: &[u8]) {
    let any = reread!(EpochSpec, bytes);
    if let Some(accepted) = EpochSpec::from_archive(bytes) {
        assert_eq!(any.as_ref(), Some(&accepted));
        assert!(accepted.record_bytes as usize >= DELTA_BYTES, "records must hold a change");
        assert!(
            (accepted.record_bytes as usize) < INBOX_PAYLOAD_BYTES,
            "samples must hold a record"
        );
        let again = rkyv::to_bytes::<Error>(&accepted).expect("memory takes every archive");
        assert_eq!(EpochSpec::from_archive(&again).as_ref(), Some(&accepted));
    }
}

/// What a process measured.
pub(super) fn reports(bytes: &[u8]) {
    let Some(report) = reread!(TrialReport, bytes) else { return };
    let _is_partial = report.counters.losses.is_partial();
    let mut twice = report.counters.losses;
    twice += report.counters.losses;
    let mut recovered = report.counters.recovered;
    recovered += report.counters.recovered;
    for mut traffic in report.counters.traffic {
        traffic += traffic;
    }
}

/// A fleet's networks. Whoever accepts them may follow every id and every way through the trees.
pub(super) fn networks(bytes: &[u8]) {
    let archive = aligned(bytes);
    let Ok(fleet) = FleetView::from_archive(&archive) else { return };
    walk(&fleet);
    let network = reread!(FleetNetwork, bytes).expect("an archive that was accepted");
    let again = network.to_archive();
    let view = FleetView::from_archive(&again).expect("what was accepted is accepted again");
    assert_eq!(format!("{view:?}"), format!("{fleet:?}"));
}

/// Follows whatever crafts follow.
fn walk(fleet: &FleetView<'_>) {
    let crafts = fleet.craft_count();
    for craft in (0..crafts).map(CraftId) {
        let board = fleet.board(craft);
        for fact in (0..board.fact_count).map(FactId) {
            for target in board.targets(fact) {
                assert!(target.fact.0 < fleet.board(target.craft).fact_count);
                assert_ne!(target.craft, craft, "nobody sends to itself");
            }
            board.readers.row(fact.index()).iter().for_each(|reader| {
                let _premises = board.premises.row((reader >> 1) as usize);
            });
        }
        for rule in 0..board.rule_count() as usize {
            let queued = board.queues.row(rule).iter();
            queued.for_each(|&action| assert!(action < board.action_count()));
            let _outputs = board.outputs.row(rule);
        }
        for record in fleet.trace_of(craft) {
            assert!(record.fact().0 < board.fact_count);
        }
        let ways = (0..crafts.min(WALKED_MAX)).map(CraftId).filter(|&there| there != craft);
        ways.for_each(|there| walk_ways(fleet, craft, there));
    }
}

/// Every tree leads from craft to craft.
fn walk_ways(fleet: &FleetView<'_>, from: CraftId, to: CraftId) {
    let topology = &fleet.topology;
    let arrives = |next: &dyn Fn(CraftId) -> CraftId| {
        let mut at = from;
        for _ in 0..fleet.craft_count() {
            if at == to {
                break;
            }
            at = next(at);
        }
        assert_eq!(at, to, "the way from {from} leads elsewhere");
    };
    arrives(&|at| topology.next_hop(at, to));
    if !topology.group.is_empty() {
        let _is_near = topology.are_grouped(from, to);
        arrives(&|at| topology.next_hop_over_leaders(at, to));
    }
}

/// An epoch of lockstep.
pub(super) fn spec() -> EpochSpec {
    EpochSpec {
        epoch: 3,
        network: 2,
        seed: 7,
        trial: 1,
        strategy: StrategyKind::Boundary,
        own_firing_only: true,
        ignores_finals: false,
        sends_altered_only: false,
        record_bytes: 16,
        turns_max: 200,
        reasoning: Reasoning::default(),
        open: None,
        recovery: None,
        link: None,
    }
}

/// Of lockstep and of open mode.
pub(super) fn epochs_seeds() -> Vec<Vec<u8>> {
    let open = OpenSpec {
        duration_ns: 500_000_000,
        slice_ns: 100_000_000,
        asks_every_ns: 3_000_000,
        stamps_stages: true,
    };
    let link = LinkSpec {
        loss_per_billion: 250_000_000,
        outages: vec![OutageSpec { from_ns: 1, until_ns: 2, whom: CutOff::Group(vec![0, 2]) }],
        ..LinkSpec::default()
    };
    let recovery = Some(RecoverySpec::patient(1_000_000));
    let open = EpochSpec { open: Some(open), recovery, link: Some(link), ..spec() };
    let central = EpochSpec { strategy: StrategyKind::Central, ..open.clone() };
    let specs = [spec(), open, central];
    specs.iter().map(|spec| rkyv::to_bytes::<Error>(spec).expect("memory").to_vec()).collect()
}

/// Of lockstep and of open mode.
pub(super) fn reports_seeds() -> Vec<Vec<u8>> {
    let open = OpenReport {
        records_played: 40,
        applied_from: vec![1, 2, 3],
        stages: vec![(Stage::Publish, vec![1; 40])],
        knowledge_slices: vec![vec![2; 30], Vec::new()],
        shares: vec![[1, 2, 3, 4]],
        reads: vec![ReadSeen { number: 1, at_ns: 2, seen_ns: ReadSeen::NOTHING }],
        held: vec![HeldFact { fact: 3, value: 1, count: 2, writer: 0 }],
        ..OpenReport::default()
    };
    let report = |open| {
        let mut report = TrialReport { craft: 2, open, ..TrialReport::default() };
        report.counters.deliveries_from = vec![5, 6, 7];
        report.counters.traffic[0].requests = 9;
        report.board_digests = vec![(2, 0xfeed)];
        rkyv::to_bytes::<Error>(&report).expect("memory").to_vec()
    };
    vec![report(None), report(Some(open))]
}

/// Crafts in a binary tree, with groups or without, with a script and a trace.
pub(super) fn networks_seeds() -> Vec<Vec<u8>> {
    let fleet = |crafts: u32, group: Vec<u32>| {
        let parent = Topology::binary(crafts).parent;
        let network = FleetNetwork {
            boards: (0..crafts).map(|craft| board(craft, crafts)).collect(),
            topology: Topology::new(parent, group).expect("a binary tree"),
            script: vec![vec![0, 2, u32::MAX]; crafts as usize],
            trace: vec![
                to_words(&[
                    TraceRecord::write(5, FactId(1), true),
                    TraceRecord::read(9, FactId(0)),
                ]);
                crafts as usize
            ],
        };
        network.to_archive().to_vec()
    };
    vec![fleet(1, Vec::new()), fleet(4, Vec::new()), fleet(6, vec![0, 0, 1, 1, 0, 1])]
}

/// Four facts, two rules and an action; fact 1 goes to everybody else.
fn board(craft: u32, crafts: u32) -> BoardNetwork {
    let mut board = BoardNetwork {
        fact_count: 4,
        initial: vec![0],
        finals: vec![3],
        ..BoardNetwork::default()
    };
    for (premises, outputs, queues) in [(vec![0], vec![2], vec![0]), (vec![2, 5], vec![6], vec![])]
    {
        board.premises.push_row(premises);
        board.outputs.push_row(outputs);
        board.queues.push_row(queues);
    }
    board.action_outputs.push_row([4]);
    board.repeating_rules = vec![1];
    for fact in 0..4 {
        let others = (0..crafts).filter(|&other| other != craft && fact == 1);
        board.links.push_row(others.flat_map(|other| [other, 1]));
    }
    board.index_readers();
    board
}
