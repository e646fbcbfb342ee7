//! `doctor`: says whether this machine can run fleets, line by line, with a remedy where it cannot.
//!
//! [`Facts::gather`] asks the machine, [`examine`] judges, [`write()`] prints: the judgement depends on
//! nothing but the facts, so that machines which nobody has at hand can be judged in tests. Not here:
//! whether a particular run fits, which the run itself refuses (`launch::resources`).

mod facts;
#[cfg(test)]
mod tests;

pub use facts::{Facts, SharedMemory};

use super::{Refusal, Setting, print_bytes};
use crate::cli::Format;
use crate::launch::host::Host;
use crate::launch::resources::{EpochPorts, FleetShape, LOCKSTEP_SAMPLES_IN_FLIGHT};
use crate::outcome::Outcome;
use shared_types::ids::CraftId;
use shared_types::limits::REAL_CRAFTS_MAX;
use shared_types::transport::Peers;
use std::io::{self, Write};

/// The oldest kernel: `pidfd_open`, `waitid` on a pidfd and what iceoryx2 needs.
const KERNEL_MIN: (u32, u32) = (5, 9);

/// The largest fleet of `compare` as it comes.
const COMPARE_CRAFTS: u32 = 10;

/// `doctor`.
pub(super) fn carry_out(setting: Setting) -> Result<Outcome, Refusal> {
    let findings = examine(&Facts::gather());
    let mut text = Vec::new();
    write(&findings, setting.format, &mut text).expect("invariant: memory takes every write");
    print_bytes(&text)?;
    Ok(outcome(&findings))
}

/// How good a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// As it should be.
    Ok,
    /// Fleets run, but something is limited or times are less trustworthy.
    Warn,
    /// No fleet runs.
    Fail,
}

impl Level {
    const fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Warn => "warn",
            Self::Fail => "fail",
        }
    }
}

/// One line of the examination.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Finding {
    /// What was looked at.
    pub subject: &'static str,
    /// How good it is.
    pub level: Level,
    /// What was found.
    pub found: String,
    /// What helps; empty if nothing has to.
    pub remedy: &'static str,
}

/// How the invocation ends: surroundings in which nothing can be started are a usage error.
#[must_use]
pub fn outcome(findings: &[Finding]) -> Outcome {
    if findings.iter().any(|finding| finding.level == Level::Fail) {
        Outcome::Usage
    } else {
        Outcome::Success
    }
}

/// Judges a machine.
#[must_use]
pub fn examine(facts: &Facts) -> Vec<Finding> {
    vec![
        kernel(facts),
        architecture(facts),
        process_descriptors(facts),
        death_signal(facts),
        shared_memory(facts),
        open_files(facts),
        fleet(facts),
        cores(facts),
        clock_source(facts),
        runs(facts),
    ]
}

/// A finding: `remedy` is shown where `level` is not [`Level::Ok`].
fn finding(subject: &'static str, level: Level, found: String, remedy: &'static str) -> Finding {
    Finding { subject, level, found, remedy: if level == Level::Ok { "" } else { remedy } }
}

/// [`Level::Ok`] if `holds`, else `otherwise`.
const fn level(holds: bool, otherwise: Level) -> Level {
    if holds { Level::Ok } else { otherwise }
}

fn kernel(facts: &Facts) -> Finding {
    let version = version_of(&facts.kernel);
    let is_new_enough = version.is_some_and(|version| version >= KERNEL_MIN);
    let found = format!("Linux {} (5.9 or newer is needed)", facts.kernel);
    finding("kernel", level(is_new_enough, Level::Fail), found, "run on a newer kernel")
}

/// Major and minor version of a kernel release such as `6.18.44-generic`.
fn version_of(release: &str) -> Option<(u32, u32)> {
    let mut parts = release.split(|character: char| !character.is_ascii_digit());
    Some((parts.next()?.parse().ok()?, parts.next()?.parse().ok()?))
}

fn architecture(facts: &Facts) -> Finding {
    let Facts { pointer_bits, is_little_endian, .. } = *facts;
    let order = if is_little_endian { "little-endian" } else { "big-endian" };
    let fits = pointer_bits == 64 && is_little_endian;
    let found = format!("{pointer_bits}-bit, {order}");
    finding("architecture", level(fits, Level::Fail), found, "run on 64-bit x86 or Arm")
}

fn process_descriptors(facts: &Facts) -> Finding {
    let found = if facts.has_pidfd { "pidfds work" } else { "pidfd_open is refused" };
    let remedy = "allow pidfd_open in the sandbox or container profile";
    finding("processes", level(facts.has_pidfd, Level::Fail), found.into(), remedy)
}

fn death_signal(facts: &Facts) -> Finding {
    let found = if facts.has_death_signal { "PR_SET_PDEATHSIG works" } else { "prctl is refused" };
    let remedy = "allow prctl, or crafts may outlive a killed orchestrator";
    finding("death signal", level(facts.has_death_signal, Level::Fail), found.into(), remedy)
}

fn shared_memory(facts: &Facts) -> Finding {
    let subject = "shared memory";
    let Some(shared) = &facts.shared_memory else {
        return finding(
            subject,
            Level::Fail,
            "/dev/shm is not there".into(),
            "mount a tmpfs on it",
        );
    };
    let found = format!(
        "{} MiB free of {} in /dev/shm{}",
        shared.free_bytes >> 20,
        shared.total_bytes >> 20,
        if shared.is_tmpfs { "" } else { ", which is no tmpfs" }
    );
    finding(subject, level(shared.is_tmpfs, Level::Warn), found, "mount a tmpfs on /dev/shm")
}

fn open_files(facts: &Facts) -> Finding {
    let subject = "descriptors";
    let Some(host) = &facts.host else {
        return finding(subject, Level::Warn, "unknown".into(), "see shared memory");
    };
    let needed = mesh_demand(REAL_CRAFTS_MAX).open_files;
    let most = match host.open_files_max {
        u64::MAX => "any number of".to_owned(),
        most => format!("up to {most}"),
    };
    let found = format!("{most} a process; {REAL_CRAFTS_MAX} crafts, all to all, need {needed}");
    let fits = level(host.open_files_max >= needed, Level::Warn);
    finding(subject, fits, found, "raise the hard limit: `ulimit -Hn`")
}

/// What a fleet needs in which everybody sends to everybody, by unicast and multicast.
fn mesh_demand(craft_count: u32) -> crate::launch::resources::Demand {
    let peers: Vec<Peers> = (0..craft_count)
        .map(|own| Peers {
            unicast: (0..craft_count).filter(|&other| other != own).map(CraftId).collect(),
            sends_multicast: true,
            receives_multicast: true,
        })
        .collect();
    let samples_in_flight = LOCKSTEP_SAMPLES_IN_FLIGHT;
    FleetShape::of_epochs([EpochPorts { peers: &peers, samples_in_flight }]).demand(4096, 1 << 20)
}

/// The largest fleet, all to all, that `host` can carry; 0 if none.
fn crafts_that_fit(host: &Host) -> u32 {
    (2..=REAL_CRAFTS_MAX)
        .rev()
        .find(|&craft_count| mesh_demand(craft_count).check(host).is_ok())
        .unwrap_or(0)
}

fn fleet(facts: &Facts) -> Finding {
    let subject = "fleet";
    let fits = facts.host.as_ref().map_or(0, crafts_that_fit);
    let level = match fits {
        0 => Level::Fail,
        1..COMPARE_CRAFTS => Level::Warn,
        _ => Level::Ok,
    };
    let found = match fits {
        0 => "not even two crafts fit what this machine has free".into(),
        _ => format!("room for {fits} crafts, all to all (the limit is {REAL_CRAFTS_MAX})"),
    };
    finding(subject, level, found, "enlarge /dev/shm or the limits, or try `slateswarm clean`")
}

fn cores(facts: &Facts) -> Finding {
    let found =
        format!("physical cores: {}, processors: {}", facts.core_count, facts.processor_count);
    let remedy = "on one core, times say little; counts are unaffected";
    finding("cores", level(facts.core_count >= 2, Level::Warn), found, remedy)
}

fn clock_source(facts: &Facts) -> Finding {
    let source = facts.clock_source.as_deref().unwrap_or("unknown");
    let is_cheap =
        matches!(source, "tsc" | "arch_sys_counter" | "kvm-clock" | "hyperv_clocksource_tsc_page");
    let remedy = "reading this clock is slow: times include it";
    finding("clock source", level(is_cheap, Level::Warn), source.to_owned(), remedy)
}

fn runs(facts: &Facts) -> Finding {
    let (living, dead) = (facts.living_runs, facts.dead_runs);
    let found = format!("{living} living, {dead} left behind by dead ones");
    finding("runs", level(dead == 0, Level::Warn), found, "`slateswarm clean` removes them")
}

/// Writes the findings.
///
/// # Errors
/// If they cannot be written.
pub fn write(findings: &[Finding], format: Format, out: &mut dyn Write) -> io::Result<()> {
    match format {
        Format::Table => {
            for finding in findings {
                let Finding { subject, level, found, remedy } = finding;
                writeln!(out, "{:<5}{subject:<15}{found}", level.name())?;
                if !remedy.is_empty() {
                    writeln!(out, "{:<20}{remedy}", "")?;
                }
            }
            Ok(())
        }
        Format::Json => {
            serde_json::to_writer_pretty(&mut *out, findings)?;
            writeln!(out)
        }
        Format::Csv => {
            let mut rows = csv::Writer::from_writer(out);
            rows.write_record(["subject", "level", "found", "remedy"])?;
            for finding in findings {
                let Finding { subject, level, found, remedy } = finding;
                rows.write_record([subject, level.name(), found, remedy])?;
            }
            rows.flush()
        }
    }
}
