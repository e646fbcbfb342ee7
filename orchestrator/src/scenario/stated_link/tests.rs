//! What each key of `[link]` makes of single samples, and when a fleet repairs it.

use super::simulated_recovery;
use crate::scenario::{ResolvedScenario, load_text};
use shared_types::ids::CraftId;
use shared_types::limits::REAL_PATIENCE_NS;
use shared_types::scenario::RunMode;
use shared_types::time::Nanos;
use shared_types::transport::link::{Link, StatedLink, Verdict};
use shared_types::wire::{Class, HEADER_BYTES, Header, Kind, RecoverySpec, StrategyKind};

/// A fleet of `a`, `b` and `c` with `keys` in its file.
fn scenario(keys: &str) -> ResolvedScenario {
    let crafts =
        ["a", "b", "c"].map(|name| format!("[[craft]]\nname = '{name}'\ninitial = ['x']\n"));
    let rest = "[run]\nmode = 'simulated'\n[[rule]]\ncraft = 'a'\nif = ['x']\nthen = ['y']\n";
    let text = format!("{keys}{}{rest}", crafts.concat());
    load_text("links.toml", &text, &[]).expect("a scenario")
}

fn link(keys: &str) -> StatedLink {
    let scenario = scenario(keys);
    let spec = scenario.link_spec().expect("something happens on these links");
    StatedLink::new(spec.clone(), 7)
}

/// A sample of `source` with `length` bytes behind its header.
fn sample(source: u32, length: u32) -> Header {
    Header { source, length, ..Header::new(Class::Replication, Kind::Delta) }
}

#[test]
fn a_group_is_cut_off_from_the_others_for_a_time_of_each_trial() {
    let mut link = link("[[link.outages]]\ncraft = [\"a\", \"b\"]\nfrom-ms = 1\nuntil-ms = 3\n");
    for began_ms in [0, 50] {
        link.begin(Nanos(began_ms * 1_000_000), 0);
        let mut at = |ms: u64, from: u32, to: u32| {
            link.judge(Nanos((began_ms + ms) * 1_000_000), CraftId(to), &sample(from, 0))
        };
        assert_eq!(at(0, 0, 2), Verdict::Pass);
        for (from, to) in [(0, 2), (2, 1)] {
            assert_eq!(at(1, from, to), Verdict::CutOff);
            assert_eq!(at(2, from, to), Verdict::CutOff);
            assert_eq!(at(3, from, to), Verdict::Pass);
        }
        assert_eq!(at(2, 0, 1), Verdict::Pass, "among them all passes");
    }
}

#[test]
fn a_link_is_cut_in_both_directions_and_no_other() {
    let mut link = link("[[link.outages]]\nbetween = [\"c\", \"a\"]\nfrom-ms = 0\nuntil-ms = 1\n");
    let mut at = |from: u32, to: CraftId| link.judge(Nanos(5), to, &sample(from, 0));
    assert_eq!([at(0, CraftId(2)), at(2, CraftId(0))], [Verdict::CutOff; 2]);
    assert_eq!([at(0, CraftId(1)), at(1, CraftId(2))], [Verdict::Pass; 2]);
    assert_eq!(at(0, CraftId::ORCHESTRATOR), Verdict::Pass, "that is no radio");
}

#[test]
fn what_a_link_carries_waits_for_what_was_sent_before() {
    // A bit takes a microsecond.
    let mut link = link("link.bandwidth-bits-per-s = 1e6\nlink.delay-ms = 1\n");
    let bits = (HEADER_BYTES as u64 + 32) * 8;
    let mut delay = |now_ns: u64, from: u32, to: u32| match link.judge(
        Nanos(now_ns),
        CraftId(to),
        &sample(from, 32),
    ) {
        Verdict::Delay(ns) => ns,
        verdict => panic!("{verdict:?}"),
    };
    let alone = 1_000_000 + bits * 1_000;
    assert_eq!(delay(0, 0, 1), alone);
    assert_eq!(delay(0, 0, 1), alone + bits * 1_000, "behind the first");
    assert_eq!(delay(0, 1, 0), alone, "the other direction is another way");
    assert_eq!(delay(0, 0, 2), alone);
    assert_eq!(delay(10_000_000_000, 0, 1), alone, "the way is free again");
}

#[test]
fn jitter_lets_samples_be_overtaken_and_doubles_stay_doubles() {
    let mut link = link("link.jitter-ms = 2\nlink.duplication = 0.5\n");
    let (mut doubled, mut longest) = (0, 0);
    for _ in 0..1_000 {
        longest = longest.max(match link.judge(Nanos(0), CraftId(1), &sample(0, 0)) {
            Verdict::Overtaken(ns) => ns,
            Verdict::Doubled { delay_ns, keeps_order: false } => {
                doubled += 1;
                delay_ns
            }
            verdict => panic!("{verdict:?}"),
        });
    }
    assert!((400..600).contains(&doubled), "{doubled}");
    assert!((1_900_000..2_000_000).contains(&longest), "{longest}");
}

#[test]
fn no_key_changes_what_another_one_draws() {
    let lost = |keys: &str| {
        let mut link = link(keys);
        link.begin(Nanos(0), 3);
        (0..200)
            .map(|_| link.judge(Nanos(0), CraftId(1), &sample(0, 0)) == Verdict::Drop)
            .collect::<Vec<bool>>()
    };
    let alone = lost("link.loss = 0.3\n");
    assert!(alone.contains(&true));
    assert_eq!(lost("link.loss = 0.3\nlink.duplication = 0.5\nlink.jitter-ms = 1\n"), alone);
}

#[test]
fn fleets_repair_what_is_not_in_order_in_simulation() {
    let of = |keys: &str| scenario(keys).epoch_spec(StrategyKind::Full, 0).recovery;
    let patience = |patience_ns| Some(RecoverySpec::patient(patience_ns));
    assert_eq!(of("link.loss = 0.5\nlink.delay-ms = 2\n"), patience(8_100_000));
    assert_eq!(of("link.duplication = 0.1\n"), patience(100_000));
    assert_eq!(of("link.jitter-ms = 1\n"), patience(4_100_000));
    let outage = "[[link.outages]]\ncraft = \"a\"\nfrom-ms = 0\nuntil-ms = 9000\n";
    assert_eq!(of(outage), patience(9_000_000));
    assert_eq!(of("link.delay-ms = 2\nlink.bandwidth-bits-per-s = 1e6\n"), None);
}

#[test]
fn real_intervals_repair_on_every_link_that_does_anything() {
    let of = |keys: &str| scenario(keys).open_recovery().map(|recovery| recovery.patience_ns);
    assert_eq!(of(""), None);
    assert_eq!(of("link.loss = 0.5\n"), Some(REAL_PATIENCE_NS));
    assert_eq!(of("link.delay-ms = 2\n"), Some(REAL_PATIENCE_NS + 8_000_000));
    assert_eq!(of("faults.restart = 'on-failure'\n"), Some(REAL_PATIENCE_NS));
    let outage = "[[link.outages]]\ncraft = \"a\"\nfrom-ms = 0\nuntil-ms = 20000\n";
    assert_eq!(of(outage), Some(2 * REAL_PATIENCE_NS));
    let lossy = scenario("link.loss = 0.5\n");
    let mut real = lossy.scenario().clone();
    real.run.mode = RunMode::Lockstep;
    assert_eq!(simulated_recovery(&real, lossy.link_spec()), None, "a turn loses nothing");
}
