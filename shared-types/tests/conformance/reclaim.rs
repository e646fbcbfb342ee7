//! The janitor against what killed processes leave behind.

use crate::fleet::{drain, numbers, send_number, to_craft};
use crate::iceoryx::Run;
use shared_types::ids::{CraftId, Incarnation};
use shared_types::rng::{Purpose, Stream};
use shared_types::transport::iceoryx::{
    EndpointOptions, HostOptions, IceoryxEndpoint, IceoryxHost,
};
use shared_types::transport::paths::SHM;
use shared_types::transport::reclaim::{
    ReclaimError, Removed, Steps, UNFINISHED_AGE, left_of_the_dead, reclaim_dead_nodes,
    reclaim_within, remove_run, sweep_unfinished,
};
use shared_types::transport::{Endpoint, Peers, RunPaths, WakeMode, clock};
use std::fs::{self, File, FileTimes, Permissions};
use std::io::{BufRead, BufReader};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};

pub(crate) const OPTIONS: EndpointOptions = EndpointOptions::new(2, WakeMode::Poll);

/// Makes `path` look as old as what a killed process left.
pub(crate) fn age(path: &Path) {
    let long_ago = fs::metadata(path).and_then(|found| found.modified()).expect("is there")
        - 2 * UNFINISHED_AGE;
    let times = FileTimes::new().set_modified(long_ago);
    // A write-only file cannot be opened for reading, nor an empty one for anything else.
    File::options().append(true).open(path).and_then(|file| file.set_times(times)).expect("ages");
}

fn segment(paths: &RunPaths, name: &str) -> PathBuf {
    Path::new(SHM).join(format!("{}{name}", paths.prefix()))
}

pub(crate) fn set_mode(path: &Path, mode: u32) {
    fs::set_permissions(path, Permissions::from_mode(mode)).expect("its own file");
}

/// Permissions of what iceoryx2 has not finished: of segments, of descriptions and tags; and finished.
pub(crate) const SEGMENT_IN_THE_MAKING: u32 = 0o200;
pub(crate) const FILE_IN_THE_MAKING: u32 = 0o600;
const FINISHED: u32 = 0o400;

#[test]
fn unfinished_files_go_once_they_are_old_and_finished_ones_stay() {
    let run = Run::new();
    let services = run.paths.root().join("services");
    fs::create_dir_all(&services).expect("below the root");
    let names = ["empty", "write_only", "young", "whole"];
    let [empty, secret, young, whole] = names.map(|name| segment(&run.paths, name));
    let (half, finished) = (services.join("unfinished"), services.join("finished"));
    for path in [&empty, &young, &half, &finished] {
        File::create(path).expect("made");
    }
    for path in [&secret, &whole] {
        fs::write(path, b"data").expect("made");
    }
    set_mode(&secret, SEGMENT_IN_THE_MAKING);
    for path in [&empty, &secret, &whole, &half, &finished] {
        age(path);
    }
    set_mode(&half, FILE_IN_THE_MAKING);
    set_mode(&finished, FINISHED);
    let pending = sweep_unfinished(&run.paths);
    assert!(matches!(pending, Err(ReclaimError::Pending { count: 1 })), "{pending:?}");
    assert!(!empty.exists() && !secret.exists() && !half.exists());
    assert!(young.exists() && whole.exists() && finished.exists());
    age(&young);
    let removed = sweep_unfinished(&run.paths).expect("sweeps");
    assert_eq!(removed, Removed { segments: 1, ..Removed::default() });
    assert!(whole.exists() && finished.exists());
}

#[test]
fn everything_of_a_run_goes_and_nothing_of_its_neighbour() {
    let run = Run::new();
    let neighbour = RunPaths::below(run.paths.base(), run.paths.run() ^ 0x8000_0000);
    for paths in [&run.paths, &neighbour] {
        fs::create_dir_all(paths.root().join("nodes/3")).expect("below the root");
        fs::write(paths.root().join("nodes/3/tag"), b"").expect("made");
        fs::write(paths.lock_file(), b"").expect("made");
        fs::write(segment(paths, "one.data"), b"data").expect("made");
        fs::write(segment(paths, "two.connection"), b"").expect("made");
    }
    let all = Removed { segments: 2, files: 2, ..Removed::default() };
    assert_eq!(remove_run(&run.paths).expect("removes"), all);
    assert!(!run.paths.root().exists() && run.paths.segments().expect("listable").is_empty());
    assert_eq!(neighbour.segments().expect("listable").len(), 2);
    assert!(run.paths.base().exists(), "the neighbour still lives here");
    assert_eq!(remove_run(&neighbour).expect("removes"), all);
    assert!(!run.paths.base().exists());
    assert_eq!(remove_run(&run.paths).expect("nothing is left to do"), Removed::default());
}

/// Says which run, and which life of craft 1, the child process shall open.
const CHILD_RUN: &str = "SLATESWARM_TEST_CHILD_RUN";

/// Starts this test binary as craft 1 of the run, in one of the roles below.
#[expect(clippy::disallowed_methods, reason = "the test needs a process that it can kill")]
fn spawn(role: &str, paths: &RunPaths, incarnation: u32) -> Child {
    let life = format!("{}:{}:{incarnation}", paths.base().display(), paths.run());
    std::process::Command::new(std::env::current_exe().expect("this binary"))
        .args(["--exact", role, "--nocapture"])
        .env(CHILD_RUN, life)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("starts")
}

/// Starts craft 1 and waits until it is up.
pub(crate) fn spawn_craft(paths: &RunPaths, incarnation: u32) -> Child {
    let mut child = spawn("reclaim::child_process", paths, incarnation);
    let output = BufReader::new(child.stdout.take().expect("piped"));
    let is_up = output.lines().map_while(Result::ok).any(|line| line.ends_with(UP));
    assert!(is_up, "the child ended before it was up");
    child
}

const UP: &str = "craft 1 is up";

/// Opens craft 1 as the parent said, `None` if there is no parent.
fn open_child() -> Option<IceoryxEndpoint> {
    let life = std::env::var(CHILD_RUN).ok()?;
    let mut parts = life.split(':');
    let mut next = || parts.next().expect("three parts");
    let (base, run, incarnation) = (next(), next(), next());
    let paths = RunPaths::below(base, run.parse().expect("a number"));
    let incarnation = Incarnation(incarnation.parse().expect("a number"));
    Some(IceoryxEndpoint::open(&paths, CraftId(1), incarnation, OPTIONS).expect("opens"))
}

/// No test by itself: what the child process of another test runs. Nothing without [`CHILD_RUN`].
#[test]
fn child_process() {
    let Some(mut craft) = open_child() else { return };
    let to_zero = Peers { unicast: vec![CraftId(0)], ..Peers::default() };
    craft.open_ports(&to_zero).expect("ports open");
    send_number(&mut craft, to_craft(0), 7).expect("sends");
    println!("{UP}");
    // Until it is killed, or whoever started it is.
    let mut line = String::new();
    let _end_of_input = std::io::stdin().read_line(&mut line);
}

/// No test by itself, as above: opens and closes ports until it is killed.
#[test]
fn restless_child_process() {
    let Some(mut craft) = open_child() else { return };
    let talks =
        Peers { unicast: vec![CraftId(0)], sends_multicast: true, receives_multicast: true };
    // A parent that dies takes its end of the pipe along; the bound is for nothing else.
    for _ in 0..100_000 {
        craft.open_ports(&talks).expect("ports open");
        craft.open_ports(&Peers::default()).expect("ports close");
    }
}

/// How long reclaiming may take: many times what it does.
const RECLAIM_LIMIT_NS: u64 = 10_000_000_000;

/// Lets time pass for the files of the dead to become old.
fn pause(duration_ns: u64) {
    let until = clock::now().plus(duration_ns);
    while clock::now() < until {
        std::thread::yield_now();
    }
}

#[test]
fn crafts_killed_at_any_moment_of_opening_ports_are_reclaimed() {
    let run = Run::new();
    let host = IceoryxHost::create(&run.paths, HostOptions::new(2)).expect("creates");
    let mut zero =
        IceoryxEndpoint::open(&run.paths, CraftId(0), Incarnation(0), OPTIONS).expect("opens");
    // The long version, by environment: SLATESWARM_KILLS=400.
    let kills = std::env::var("SLATESWARM_KILLS").ok().and_then(|kills| kills.parse().ok());
    let mut moments = Stream::new(1, 0, Purpose::Test, 0);
    for incarnation in 0..kills.unwrap_or(12) {
        let mut child = spawn("reclaim::restless_child_process", &run.paths, incarnation);
        pause(u64::from(moments.below(30_000_000)));
        child.kill().expect("killed");
        child.wait().expect("reaped");
        reclaim_within(&run.paths, Steps::ALL, RECLAIM_LIMIT_NS).expect("reclaims");
        assert_eq!(left_of_the_dead(&run.paths).expect("listable"), [] as [PathBuf; 0]);
        zero.update_connections().expect("the living are not disturbed");
    }
    let mut child = spawn_craft(&run.paths, 1_000_000);
    assert_eq!(numbers(&drain(&mut zero)), [7], "there is a place for a successor");
    child.kill().expect("killed");
    child.wait().expect("reaped");
    drop((zero, host));
}

#[test]
fn killed_crafts_are_reclaimed_and_their_successors_find_a_place() {
    let run = Run::new();
    let host = IceoryxHost::create(&run.paths, HostOptions::new(2)).expect("creates");
    let mut zero =
        IceoryxEndpoint::open(&run.paths, CraftId(0), Incarnation(0), OPTIONS).expect("opens");
    let mut segments_after_one = None;
    // More lives than a service has slots for the dead.
    for incarnation in 0..12 {
        let mut child = spawn_craft(&run.paths, incarnation);
        assert_eq!(numbers(&drain(&mut zero)), [7]);
        child.kill().expect("killed");
        child.wait().expect("reaped");
        let removed = reclaim_dead_nodes(&run.paths, Steps::ALL).expect("reclaims");
        assert_eq!(removed.nodes, 1);
        zero.update_connections().expect("the living are not disturbed");
        let segments = run.paths.segments().expect("listable").len();
        assert_eq!(*segments_after_one.get_or_insert(segments), segments, "nothing piles up");
    }
    let removed = reclaim_dead_nodes(&run.paths, Steps::ALL).expect("nobody is dead");
    assert_eq!(removed, Removed::default());
    drop((zero, host));
}

#[test]
fn a_run_whose_processes_were_all_killed_leaves_nothing() {
    let run = Run::new();
    let host = IceoryxHost::create(&run.paths, HostOptions::new(2)).expect("creates");
    let mut child = spawn_craft(&run.paths, 0);
    child.kill().expect("killed");
    child.wait().expect("reaped");
    // The host is never dropped: as if it had been killed as well.
    std::mem::forget(host);
    let removed = remove_run(&run.paths).expect("removes");
    assert!(removed.segments > 0 && removed.files > 0, "{removed:?}");
    assert!(run.paths.segments().expect("listable").is_empty());
    assert!(!run.paths.base().exists());
}

#[test]
fn what_a_living_process_is_making_stays_however_slowly_it_makes_it() {
    let run = Run::new();
    let port = |process: u32| 99_u128 << 96 | u128::from(process) << 64 | 4_000_000_000;
    // Between its being made and its being sized its maker got no core for longer than the age.
    let name = format!("{}_{}.connection", port(std::process::id()), port(std::process::id()) + 1);
    let segment = segment(&run.paths, &name);
    File::create(&segment).expect("made");
    age(&segment);
    assert_eq!(sweep_unfinished(&run.paths).expect("nothing is waited for"), Removed::default());
    assert!(segment.exists(), "its maker goes on with it, and nobody else would find it");
}
