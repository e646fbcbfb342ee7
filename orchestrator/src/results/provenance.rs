//! Where results come from: seed, scenario, build and host, as `env.json` keeps them.
//!
//! Whatever cannot be found out is absent or `unknown`, never guessed; nothing here can fail a run.
//! This is the only place that reads the wall clock.

use super::record::Digest;
use serde::{Deserialize, Serialize};
use shared_types::transport::WakeMode;
use shared_types::wire::FORMAT_VERSION;
use std::collections::BTreeMap;

/// What the run decides, before it looks at its host.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunIdentity {
    /// Name of the resolved scenario; also names the directory.
    pub scenario: String,
    /// The command and what it was given, as typed.
    pub command: Vec<String>,
    /// Seed of the run.
    pub seed: u64,
    /// Whether crafts live in one process on a virtual clock.
    pub is_simulated: bool,
    /// Most processes of a fleet of the run, the centre counted.
    pub processes_max: u32,
    /// Cores that the fleet is confined to.
    pub cores_used: u32,
    /// How crafts wait.
    pub wake: WakeMode,
    /// Digests of what the run will do, by what they are of.
    pub plan: BTreeMap<String, Digest>,
}

/// The versions that decide what a run does.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Versions {
    /// This program.
    pub slateswarm: String,
    /// Commit checked out when it was built, or `unknown`.
    pub commit: String,
    /// XXH3 digest of the executable file, hexadecimal, or `unknown`.
    pub executable: String,
    /// `debug` or `release`.
    pub profile: String,
    /// The transport.
    pub iceoryx2: String,
    /// Of our headers, records and archives.
    pub wire_format: u16,
}

impl Versions {
    /// What must be the same for results to be of one kind.
    fn pairs(&self, now: &Self) -> Vec<(String, String, String)> {
        [
            ("the version", &self.slateswarm, &now.slateswarm),
            ("the commit of the build", &self.commit, &now.commit),
            ("the profile of the build", &self.profile, &now.profile),
            ("the executable", &self.executable, &now.executable),
        ]
        .map(|(what, then, now)| (what.to_owned(), then.clone(), now.clone()))
        .to_vec()
    }
}

/// The machine and its state.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Host {
    /// Name and release of the operating system's kernel.
    pub kernel: String,
    /// Model name of the processor.
    pub cpu_model: String,
    /// Cores that are online.
    pub cores_online: u32,
    /// The kernel's clock source.
    pub clock_source: String,
    /// Frequency governor of core 0, where the machine has one.
    pub governor: Option<String>,
    /// Load averages over 1, 5 and 15 minutes at the start.
    pub load_average: Option<[f64; 3]>,
    /// Total memory, bytes.
    pub memory_bytes: Option<u64>,
    /// Digest of the machine's id: tells two hosts apart and says nothing about either.
    #[serde(default)]
    pub id: Option<Digest>,
}

impl Host {
    /// What makes it the same host in the same state, load apart.
    #[must_use]
    pub fn pairs(&self, now: &Self) -> Vec<(String, String, String)> {
        let text =
            |value: Option<&dyn std::fmt::Display>| value.map_or_else(unknown, ToString::to_string);
        let (id_then, id_now) = (self.id.as_ref(), now.id.as_ref());
        [
            ("the host", text(id_then.map(|id| id as _)), text(id_now.map(|id| id as _))),
            ("the kernel", self.kernel.clone(), now.kernel.clone()),
            ("the processor", self.cpu_model.clone(), now.cpu_model.clone()),
            ("the number of cores", self.cores_online.to_string(), now.cores_online.to_string()),
            ("the clock source", self.clock_source.clone(), now.clock_source.clone()),
        ]
        .map(|(what, then, now)| (what.to_owned(), then, now))
        .to_vec()
    }
}

/// Everything that `env.json` holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Name of the resolved scenario.
    pub scenario: String,
    /// The command and what it was given, as typed.
    pub command: Vec<String>,
    /// Seed of the run.
    pub seed: u64,
    /// When it started, UTC, as `2026-11-22T15:04:05Z`.
    pub date: String,
    /// Whether crafts lived in one process on a virtual clock.
    pub is_simulated: bool,
    /// Most processes of a fleet, the centre counted.
    pub processes_max: u32,
    /// Cores that the fleet was confined to.
    pub cores_used: u32,
    /// Processes of the largest fleet per core it could use.
    pub processes_per_core: f64,
    /// How crafts waited.
    pub wake: WakeMode,
    /// What was run.
    pub versions: Versions,
    /// On what.
    pub host: Host,
    /// Digests of what the run does, by what they are of; a run that is resumed must have the same.
    #[serde(default)]
    pub plan: BTreeMap<String, Digest>,
    /// When it was cut off and went on, in order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub resumed: Vec<Resumption>,
}

/// One time that a run went on after it had been cut off: same build, same host, another moment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Resumption {
    /// When, UTC, as [`Provenance::date`].
    pub date: String,
    /// On what, with the load of that moment.
    pub host: Host,
    /// Fleets that were complete.
    pub fleets: u64,
}

impl Provenance {
    /// Looks at the host, once, at the start of a run.
    #[must_use]
    pub fn gather(identity: &RunIdentity) -> Self {
        Self {
            scenario: identity.scenario.clone(),
            command: identity.command.clone(),
            seed: identity.seed,
            date: utc_text(seconds_since_1970()),
            is_simulated: identity.is_simulated,
            processes_max: identity.processes_max,
            cores_used: identity.cores_used,
            processes_per_core: f64::from(identity.processes_max)
                / f64::from(identity.cores_used.max(1)),
            wake: identity.wake,
            versions: versions(),
            host: host(),
            plan: identity.plan.clone(),
            resumed: Vec::new(),
        }
    }

    /// In what `now` differs so that its measurements would not belong to these: what, then, now.
    #[must_use]
    pub fn differences(&self, now: &Self) -> Vec<(String, String, String)> {
        let mut pairs: Vec<(String, String, String)> = self
            .versions
            .pairs(&now.versions)
            .into_iter()
            .chain(self.host.pairs(&now.host))
            .collect();
        let seeds = (self.seed.to_string(), now.seed.to_string());
        pairs.push(("the seed".to_owned(), seeds.0, seeds.1));
        for (what, digest) in &self.plan {
            let other = now.plan.get(what).map_or_else(|| "absent".to_owned(), ToString::to_string);
            pairs.push((what.clone(), digest.to_string(), other));
        }
        pairs.retain(|(_, then, now)| then != now);
        pairs
    }

    /// The date as it stands in the name of the directory, `20261122T150405Z`.
    #[must_use]
    pub fn stamp(&self) -> String {
        self.date.chars().filter(|sign| !matches!(sign, '-' | ':')).collect()
    }
}

fn versions() -> Versions {
    let executable = std::fs::read("/proc/self/exe")
        .map_or_else(|_| unknown(), |bytes| format!("{:016x}", xxhash_rust::xxh3::xxh3_64(&bytes)));
    Versions {
        slateswarm: env!("CARGO_PKG_VERSION").to_owned(),
        commit: option_env!("SLATESWARM_COMMIT").unwrap_or("unknown").to_owned(),
        executable,
        profile: if cfg!(debug_assertions) { "debug" } else { "release" }.to_owned(),
        // The manifest pins this version exactly; a test reads it there.
        iceoryx2: ICEORYX2_VERSION.to_owned(),
        wire_format: FORMAT_VERSION,
    }
}

/// The version that the workspace pins.
const ICEORYX2_VERSION: &str = "0.10.0";

fn host() -> Host {
    let system = rustix::system::uname();
    let kernel =
        format!("{} {}", system.sysname().to_string_lossy(), system.release().to_string_lossy());
    let online = std::thread::available_parallelism().map_or(0, std::num::NonZero::get);
    Host {
        kernel,
        cpu_model: cpu_model().unwrap_or_else(unknown),
        cores_online: cores_online().unwrap_or_else(|| u32::try_from(online).unwrap_or(u32::MAX)),
        clock_source: first_line(
            "/sys/devices/system/clocksource/clocksource0/current_clocksource",
        )
        .unwrap_or_else(unknown),
        governor: first_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor"),
        load_average: load_average(),
        memory_bytes: memory_bytes(),
        id: first_line("/etc/machine-id").filter(|id| !id.is_empty()).map(|id| {
            // Salted, so that the digest is of no use elsewhere.
            Digest(xxhash_rust::xxh3::xxh3_64(format!("slateswarm {id}").as_bytes()))
        }),
    }
}

fn unknown() -> String {
    "unknown".to_owned()
}

fn first_line(path: &str) -> Option<String> {
    let text = std::fs::read_to_string(path).ok()?;
    text.lines().next().map(|line| line.trim().to_owned())
}

fn cpu_model() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    line.split_once(':').map(|(_, model)| model.trim().to_owned())
}

/// Counts the ranges of `/sys/devices/system/cpu/online`, such as `0-3,6`.
fn cores_online() -> Option<u32> {
    count_ranges(&first_line("/sys/devices/system/cpu/online")?)
}

fn count_ranges(ranges: &str) -> Option<u32> {
    ranges.split(',').try_fold(0_u32, |count, range| {
        let (first, last) = range.split_once('-').unwrap_or((range, range));
        let (first, last): (u32, u32) = (first.parse().ok()?, last.parse().ok()?);
        count.checked_add(last.checked_sub(first)?)?.checked_add(1)
    })
}

fn load_average() -> Option<[f64; 3]> {
    let text = first_line("/proc/loadavg")?;
    let mut words = text.split(' ').map(|word| word.parse().ok());
    Some([words.next()??, words.next()??, words.next()??])
}

fn memory_bytes() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("MemTotal:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok()?.checked_mul(1024)
}

#[expect(clippy::disallowed_methods, reason = "the date of a run is provenance")]
fn seconds_since_1970() -> u64 {
    std::time::SystemTime::now()
        .duration_since(std::time::UNIX_EPOCH)
        .map_or(0, |since| since.as_secs())
}

/// A time as `2026-11-22T15:04:05Z`. Days become dates by Hinnant's `civil_from_days`, in which a
/// year begins in March, so that the leap day is its last.
fn utc_text(seconds: u64) -> String {
    let (days, second) = (seconds / 86_400, seconds % 86_400);
    let shifted = days + 719_468;
    let (era, day_of_era) = (shifted / 146_097, shifted % 146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    let year = era * 400 + year_of_era + u64::from(month <= 2);
    let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
}

#[cfg(test)]
mod tests {
    use super::{ICEORYX2_VERSION, Provenance, RunIdentity, count_ranges, utc_text};

    #[test]
    fn dates_are_those_of_the_calendar() {
        assert_eq!(utc_text(0), "1970-01-01T00:00:00Z");
        assert_eq!(utc_text(951_826_154), "2000-02-29T12:09:14Z");
        assert_eq!(utc_text(1_795_359_845), "2026-11-22T15:04:05Z");
        assert_eq!(utc_text(4_107_542_399), "2100-02-28T23:59:59Z");
        assert_eq!(utc_text(4_107_542_400), "2100-03-01T00:00:00Z");
    }

    #[test]
    fn core_ranges_are_counted() {
        assert_eq!(count_ranges("0-3,6"), Some(5));
        assert_eq!(count_ranges("0"), Some(1));
        assert_eq!(count_ranges("3-1"), None);
        assert_eq!(count_ranges(""), None);
    }

    #[test]
    fn the_transport_version_is_the_one_in_the_manifest() {
        let manifest = include_str!("../../../Cargo.toml");
        assert!(manifest.contains(&format!("iceoryx2 = \"={ICEORYX2_VERSION}\"")));
    }

    #[test]
    fn this_host_can_be_described() {
        let provenance = Provenance::gather(&RunIdentity {
            scenario: "paper".into(),
            command: vec!["compare".into()],
            seed: 1,
            is_simulated: false,
            processes_max: 11,
            cores_used: 2,
            wake: shared_types::transport::WakeMode::Adaptive,
            plan: std::collections::BTreeMap::new(),
        });
        assert!(provenance.host.kernel.starts_with("Linux "), "{provenance:?}");
        assert!(provenance.host.cores_online > 0);
        assert_eq!(provenance.stamp().len(), "20261122T150405Z".len());
        assert!((provenance.processes_per_core - 5.5).abs() < 1e-9);
    }
}
