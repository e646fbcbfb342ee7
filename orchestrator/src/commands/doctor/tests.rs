//! Machines that nobody has at hand, judged.

use super::{Facts, Finding, Format, Level, SharedMemory, examine, outcome, write};
use crate::launch::host::Host;
use crate::outcome::Outcome;

fn good() -> Facts {
    Facts {
        kernel: "6.1.0-13-amd64".into(),
        pointer_bits: 64,
        is_little_endian: true,
        has_pidfd: true,
        has_death_signal: true,
        shared_memory: Some(SharedMemory {
            is_tmpfs: true,
            total_bytes: 8 << 30,
            free_bytes: 7 << 30,
        }),
        host: Some(Host {
            open_files: 1024,
            open_files_max: 1 << 20,
            shared_bytes: 7 << 30,
            shared_files: 1 << 20,
            memory_bytes: Some(8 << 30),
            tasks: Some(10_000),
        }),
        core_count: 4,
        processor_count: 8,
        clock_source: Some("tsc".into()),
        living_runs: 1,
        dead_runs: 0,
    }
}

/// The subjects that are not as they should be, with their level.
fn complaints(facts: &Facts) -> Vec<(&'static str, Level)> {
    let findings = examine(facts);
    for finding in &findings {
        assert_eq!(finding.remedy.is_empty(), finding.level == Level::Ok, "{finding:?}");
    }
    let bad = findings.into_iter().filter(|finding| finding.level != Level::Ok);
    bad.map(|finding| (finding.subject, finding.level)).collect()
}

fn with(change: impl FnOnce(&mut Facts)) -> Vec<(&'static str, Level)> {
    let mut facts = good();
    change(&mut facts);
    complaints(&facts)
}

fn with_host(change: impl FnOnce(&mut Host)) -> Vec<(&'static str, Level)> {
    with(|facts| change(facts.host.as_mut().unwrap()))
}

#[test]
fn good_machine_has_nothing_to_complain_about() {
    assert_eq!(complaints(&good()), []);
    assert_eq!(outcome(&examine(&good())), Outcome::Success);
}

#[test]
fn kernels_before_5_9_fail() {
    for (release, passes) in
        [("5.8.18", false), ("5.9.0", true), ("5.10.1-arch", true), ("10.0", true), ("odd", false)]
    {
        let found = with(|facts| facts.kernel = release.into());
        assert_eq!(found.is_empty(), passes, "{release}: {found:?}");
    }
}

#[test]
fn each_missing_thing_is_named() {
    use Level::{Fail, Warn};
    assert_eq!(with(|facts| facts.pointer_bits = 32), [("architecture", Fail)]);
    assert_eq!(with(|facts| facts.is_little_endian = false), [("architecture", Fail)]);
    assert_eq!(with(|facts| facts.has_pidfd = false), [("processes", Fail)]);
    assert_eq!(with(|facts| facts.has_death_signal = false), [("death signal", Fail)]);
    assert_eq!(with(|facts| facts.core_count = 1), [("cores", Warn)]);
    assert_eq!(with(|facts| facts.clock_source = Some("hpet".into())), [("clock source", Warn)]);
    assert_eq!(with(|facts| facts.dead_runs = 2), [("runs", Warn)]);
    let no_shared_memory = with(|facts| (facts.shared_memory, facts.host) = (None, None));
    assert_eq!(no_shared_memory[0], ("shared memory", Fail));
}

#[test]
fn small_hosts_warn_and_hosts_without_room_for_two_crafts_fail() {
    use Level::{Fail, Warn};
    assert_eq!(with_host(|host| host.shared_bytes = 64 << 20), [], "a container as it comes");
    assert_eq!(with_host(|host| host.shared_bytes = 9 << 20), [("fleet", Warn)]);
    assert_eq!(with_host(|host| host.shared_bytes = 1 << 20), [("fleet", Fail)]);
    assert_eq!(with_host(|host| host.tasks = Some(3)), [("fleet", Fail)]);
    assert_eq!(with_host(|host| host.open_files_max = 1024), [("descriptors", Warn)]);
}

#[test]
fn every_format_shows_every_finding_within_80_columns() {
    let bad = Facts {
        kernel: "4.19.0-27-cloud-amd64".into(),
        pointer_bits: 32,
        is_little_endian: false,
        has_pidfd: false,
        has_death_signal: false,
        host: None,
        core_count: 1,
        clock_source: None,
        dead_runs: 3,
        ..good()
    };
    assert_eq!(outcome(&examine(&bad)), Outcome::Usage);
    let formats = [Format::Table, Format::Json, Format::Csv];
    for (facts, format) in
        [good(), bad].iter().flat_map(|facts| formats.map(|format| (facts, format)))
    {
        let findings = examine(facts);
        let mut out = Vec::new();
        write(&findings, format, &mut out).unwrap();
        let text = String::from_utf8(out).unwrap();
        for Finding { subject, found, remedy, .. } in &findings {
            let shows =
                |part: &str| text.contains(part) || text.contains(&part.replace('"', "\"\""));
            assert!(shows(subject) && shows(found) && shows(remedy), "{subject}: {text}");
        }
        if format == Format::Table {
            assert!(text.lines().all(|line| line.len() <= 80), "{text}");
        }
    }
}

#[test]
fn this_machine_can_be_asked() {
    let facts = Facts::gather();
    assert!(facts.core_count >= 1 && facts.processor_count >= facts.core_count);
    assert!(facts.shared_memory.is_some() && facts.host.is_some());
}
