//! The janitor against what killed processes leave behind.

use crate::fleet::{drain, numbers, send_number, to_craft};
use crate::iceoryx::Run;
use shared_types::ids::{CraftId, Incarnation};
use shared_types::transport::iceoryx::{
    EndpointOptions, HostOptions, IceoryxEndpoint, IceoryxHost,
};
use shared_types::transport::paths::SHM;
use shared_types::transport::reclaim::{
    Removed, UNFINISHED_AGE, reclaim_dead_nodes, remove_run, sweep_unfinished,
};
use shared_types::transport::{Endpoint, Peers, RunPaths, WakeMode};
use std::fs::{self, File, FileTimes, Permissions};
use std::io::{BufRead, BufReader};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};

const OPTIONS: EndpointOptions = EndpointOptions::new(2, WakeMode::Poll);

/// Makes `path` look as old as what a killed process left.
fn age(path: &Path) {
    let long_ago = fs::metadata(path).and_then(|found| found.modified()).expect("is there")
        - 2 * UNFINISHED_AGE;
    let times = FileTimes::new().set_modified(long_ago);
    // A write-only file cannot be opened for reading, nor an empty one for anything else.
    File::options().append(true).open(path).and_then(|file| file.set_times(times)).expect("ages");
}

fn segment(paths: &RunPaths, name: &str) -> PathBuf {
    Path::new(SHM).join(format!("{}{name}", paths.prefix()))
}

fn write_only(path: &Path) {
    fs::set_permissions(path, Permissions::from_mode(0o200)).expect("its own file");
}

#[test]
fn unfinished_files_go_once_they_are_old_and_finished_ones_stay() {
    let run = Run::new();
    let tags = run.paths.root().join("nodes/17");
    fs::create_dir_all(&tags).expect("below the root");
    let names = ["empty", "write_only", "young", "whole"];
    let [empty, secret, young, whole] = names.map(|name| segment(&run.paths, name));
    let (tag, finished_tag) = (tags.join("unfinished"), tags.join("finished"));
    for path in [&empty, &young, &tag, &finished_tag] {
        File::create(path).expect("made");
    }
    for path in [&secret, &whole] {
        fs::write(path, b"data").expect("made");
    }
    write_only(&secret);
    write_only(&tag);
    for path in [&empty, &secret, &whole, &tag, &finished_tag] {
        age(path);
    }
    let removed = sweep_unfinished(&run.paths).expect("sweeps");
    assert_eq!(removed, Removed { segments: 2, files: 1, nodes: 0 });
    assert!(!empty.exists() && !secret.exists() && !tag.exists());
    assert!(young.exists() && whole.exists() && finished_tag.exists());
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
    let all = Removed { segments: 2, files: 2, nodes: 0 };
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

/// Starts this test binary as craft 1 of the run and waits until it is up.
#[expect(clippy::disallowed_methods, reason = "the test needs a process that it can kill")]
fn spawn_craft(paths: &RunPaths, incarnation: u32) -> Child {
    let life = format!("{}:{}:{incarnation}", paths.base().display(), paths.run());
    let mut child = std::process::Command::new(std::env::current_exe().expect("this binary"))
        .args(["--exact", "reclaim::child_process", "--nocapture"])
        .env(CHILD_RUN, life)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("starts");
    let output = BufReader::new(child.stdout.take().expect("piped"));
    let is_up = output.lines().map_while(Result::ok).any(|line| line.ends_with(UP));
    assert!(is_up, "the child ended before it was up");
    child
}

const UP: &str = "craft 1 is up";

/// No test by itself: what the child process of another test runs. Nothing without [`CHILD_RUN`].
#[test]
fn child_process() {
    let Ok(life) = std::env::var(CHILD_RUN) else { return };
    let mut parts = life.split(':');
    let mut next = || parts.next().expect("three parts");
    let (base, run, incarnation) = (next(), next(), next());
    let paths = RunPaths::below(base, run.parse().expect("a number"));
    let incarnation = Incarnation(incarnation.parse().expect("a number"));
    let mut craft = IceoryxEndpoint::open(&paths, CraftId(1), incarnation, OPTIONS).expect("opens");
    let to_zero = Peers { unicast: vec![CraftId(0)], ..Peers::default() };
    craft.open_ports(&to_zero).expect("ports open");
    send_number(&mut craft, to_craft(0), incarnation.0).expect("sends");
    println!("{UP}");
    // Until it is killed, or whoever started it is.
    let mut line = String::new();
    let _end_of_input = std::io::stdin().read_line(&mut line);
}

#[test]
fn killed_crafts_are_reclaimed_and_their_successors_find_a_place() {
    let run = Run::new();
    let host = IceoryxHost::create(&run.paths, HostOptions::new(2)).expect("creates");
    let mut zero =
        IceoryxEndpoint::open(&run.paths, CraftId(0), Incarnation(0), OPTIONS).expect("opens");
    // More lives than a service has slots for the dead.
    for incarnation in 0..12 {
        let mut child = spawn_craft(&run.paths, incarnation);
        assert_eq!(numbers(&drain(&mut zero)), [incarnation]);
        child.kill().expect("killed");
        child.wait().expect("reaped");
        let removed = reclaim_dead_nodes(&run.paths).expect("reclaims");
        assert_eq!(removed.nodes, 1);
    }
    let removed = reclaim_dead_nodes(&run.paths).expect("nobody is dead");
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
