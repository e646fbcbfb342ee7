//! What kills do to iceoryx2, planted file by file: each defect shows without the janitor's step against
//! it, and is gone with all of them. The fifth, descriptors that children inherit, is the launcher's.

use crate::iceoryx::Run;
use crate::reclaim::{FILE_IN_THE_MAKING, OPTIONS, age, set_mode, spawn_craft};
use iceoryx2::prelude::{NodeBuilder, ServiceName, ipc};
use shared_types::ids::{CraftId, Incarnation};
use shared_types::transport::iceoryx::{HostOptions, IceoryxEndpoint, IceoryxHost};
use shared_types::transport::paths::SHM;
use shared_types::transport::reclaim::{
    ReclaimError, Removed, Steps, left_of_the_dead, reclaim_dead_nodes, reclaim_within, remove_run,
};
use shared_types::transport::{Endpoint as _, RunPaths};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::Duration;

const LIMIT_NS: u64 = 10_000_000_000;

/// How long somebody waits who is expected to wait for ever.
const FOR_EVER: Duration = Duration::from_millis(1_500);

/// A run with a living craft 0, and the number of a process that was craft 1 and is dead.
struct Scene {
    zero: IceoryxEndpoint,
    host: IceoryxHost,
    victim: u32,
    // Last: removes what the others leave.
    run: Run,
}

impl Scene {
    /// A scene whose victim is not reclaimed yet.
    fn after_a_kill() -> Self {
        let run = Run::new();
        let host = IceoryxHost::create(&run.paths, HostOptions::new(2)).expect("creates");
        let zero =
            IceoryxEndpoint::open(&run.paths, CraftId(0), Incarnation(0), OPTIONS).expect("opens");
        let mut scene = Self { zero, host, victim: 0, run };
        scene.victim = scene.kill_one(0);
        scene
    }

    /// Starts and kills a craft 1; returns the number that its process had.
    fn kill_one(&self, incarnation: u32) -> u32 {
        let mut child = spawn_craft(&self.run.paths, incarnation);
        child.kill().expect("killed");
        child.wait().expect("reaped");
        child.id()
    }

    /// A number as iceoryx2 gives to ports and nodes, of process `process`.
    fn number_of(process: u32) -> u128 {
        99 << 96 | u128::from(process) << 64 | 4_000_000_000
    }

    fn segment(&self, name: &str) -> PathBuf {
        Path::new(SHM).join(format!("{}{name}", self.run.paths.prefix()))
    }

    /// The directory of the victim's node.
    fn node(&self) -> PathBuf {
        let nodes = fs::read_dir(self.run.paths.root().join("nodes")).expect("nodes");
        let paths = nodes.map(|entry| entry.expect("entry").path());
        let mut directories = paths.filter(|path| path.is_dir() && self.is_of_the_victim(path));
        directories.next().expect("the node of the victim")
    }

    fn is_of_the_victim(&self, path: &Path) -> bool {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        number_in(name)
            .is_some_and(|number| (number >> 64) & 0xffff_ffff == u128::from(self.victim))
    }

    fn attempt(&self, steps: Steps) -> Result<Removed, ReclaimError> {
        reclaim_dead_nodes(&self.run.paths, steps)
    }

    /// All steps, after which nothing is left of the victim and a successor finds its places.
    #[track_caller]
    fn reclaim_and_go_on(mut self) {
        reclaim_within(&self.run.paths, Steps::ALL, LIMIT_NS).expect("reclaims");
        assert_eq!(left_of_the_dead(&self.run.paths).expect("listable"), [] as [PathBuf; 0]);
        self.zero.update_connections().expect("the living are not disturbed");
        let mut successor = spawn_craft(&self.run.paths, 1);
        successor.kill().expect("killed");
        successor.wait().expect("reaped");
        drop((self.zero, self.host));
    }
}

/// The number of iceoryx2 in a file's name.
fn number_in(name: &str) -> Option<u128> {
    name.split(['.', '_'])
        .find_map(|word| word.parse().ok().filter(|number: &u128| number >> 64 != 0))
}

#[test]
fn an_empty_segment_would_keep_the_cleaner_waiting_for_ever() {
    let scene = Scene::after_a_kill();
    // Between a port of the victim and one of the living, as a kill before it had a size leaves it.
    let segments = scene.run.paths.segments().expect("listable");
    let connection = segments.iter().find(|path| path.to_string_lossy().ends_with(".connection"));
    let name = connection.expect("the victim was connected").to_string_lossy().into_owned();
    let (ports, _) = name.rsplit_once('_').expect("two ports");
    let living = Scene::number_of(std::process::id());
    let empty = PathBuf::from(format!("{ports}_{living}.connection"));
    File::create(&empty).expect("planted");
    let (done, is_done) = mpsc::channel();
    let paths = scene.run.paths.clone();
    let cleaner = std::thread::spawn(move || {
        let attempt = reclaim_dead_nodes(&paths, Steps { unfinished: false, ..Steps::ALL });
        done.send(()).expect("somebody waits");
        attempt
    });
    assert!(is_done.recv_timeout(FOR_EVER).is_err(), "the cleaner came to an end");
    // The sweep ends the waiting of whoever waits on it, too.
    age(&empty);
    reclaim_within(
        &scene.run.paths,
        Steps { places: false, by_hand: false, ..Steps::ALL },
        LIMIT_NS,
    )
    .expect("sweeps");
    assert!(!empty.exists());
    let _whatever_it_said = cleaner.join().expect("it ended");
    scene.reclaim_and_go_on();
}

#[test]
fn an_empty_segment_that_only_the_dead_can_have_made_needs_no_age() {
    let scene = Scene::after_a_kill();
    let empty = scene.segment(&format!("{}.data", Scene::number_of(scene.victim)));
    File::create(&empty).expect("planted");
    scene.attempt(Steps::ALL).expect("nothing is pending");
    assert!(!empty.exists());
    scene.reclaim_and_go_on();
}

/// Makes and drops a service past the adapter; returns the files that described it, or what iceoryx2 said.
fn make_service(paths: &RunPaths) -> Result<Vec<PathBuf>, String> {
    let node = NodeBuilder::new()
        .config(&paths.config().expect("usable"))
        .create::<ipc::Service>()
        .expect("a node");
    let name = ServiceName::new("half-made").expect("a name");
    let before = files_of_services(paths);
    let service = node.service_builder(&name).event().open_or_create();
    let service = service.map_err(|error| format!("{error:?}"))?;
    let made = files_of_services(paths).into_iter().filter(|file| !before.contains(file)).collect();
    drop(service);
    Ok(made)
}

fn files_of_services(paths: &RunPaths) -> Vec<PathBuf> {
    let entries = fs::read_dir(paths.root().join("services")).expect("services");
    entries.map(|entry| entry.expect("entry").path()).collect()
}

#[test]
fn a_service_that_was_never_finished_would_block_its_name() {
    let scene = Scene::after_a_kill();
    let paths = &scene.run.paths;
    let made = make_service(paths).expect("makes");
    let [description] = &made[..] else { panic!("one file describes a service: {made:?}") };
    File::create(description).expect("planted");
    set_mode(description, FILE_IN_THE_MAKING);
    let refused = make_service(paths).expect_err("the name is blocked");
    assert!(refused.contains("HangsInCreation"), "{refused}");
    scene.attempt(Steps { unfinished: false, ..Steps::ALL }).expect("does the rest");
    assert!(make_service(paths).is_err(), "nothing else frees the name");
    age(description);
    reclaim_within(paths, Steps::ALL, LIMIT_NS).expect("sweeps");
    make_service(paths).expect("the name is free");
    scene.reclaim_and_go_on();
}

#[test]
fn an_unfinished_tag_would_make_the_clean_up_fail_and_then_claim_success() {
    let scene = Scene::after_a_kill();
    let node = scene.node();
    // One that is there and says nothing yet, as when its writer is killed.
    let number = Scene::number_of(scene.victim);
    let tag = node.join(format!("{}{number}.port_tag", scene.run.paths.prefix()));
    File::create(&tag).expect("planted");
    set_mode(&tag, FILE_IN_THE_MAKING);
    let without = Steps { tags: false, by_hand: false, ..Steps::ALL };
    let first = scene.attempt(without);
    let again = scene.attempt(without);
    assert!(node.exists(), "without the step: {first:?}, then {again:?}, and nothing is left");
    scene.reclaim_and_go_on();
}

#[test]
fn what_iceoryx2_does_not_know_of_would_stay() {
    let scene = Scene::after_a_kill();
    let nodes = scene.run.paths.root().join("nodes");
    let orphan = nodes.join(Scene::number_of(scene.victim).to_string());
    fs::create_dir(&orphan).expect("planted");
    File::create(orphan.join("node.details")).expect("planted");
    let number = Scene::number_of(scene.victim);
    let connection = scene.segment(&format!("{number}_{}.connection", number + 1));
    fs::write(&connection, b"anything").expect("planted");
    scene.attempt(Steps { by_hand: false, ..Steps::ALL }).expect("does the rest");
    assert!(orphan.exists() && connection.exists(), "nothing else removes them");
    scene.attempt(Steps::ALL).expect("removes");
    assert!(!orphan.exists() && !connection.exists());
    scene.reclaim_and_go_on();
}

#[test]
fn a_place_that_nobody_frees_would_be_missing_to_the_successor() {
    let scene = Scene::after_a_kill();
    scene.attempt(Steps { places: false, by_hand: false, ..Steps::ALL }).expect("does the rest");
    let successor =
        || IceoryxEndpoint::open(&scene.run.paths, CraftId(1), Incarnation(1), OPTIONS).map(drop);
    assert!(successor().is_err(), "the dead still hold its place");
    scene.attempt(Steps::ALL).expect("reclaims");
    successor().expect("there is a place");
    scene.reclaim_and_go_on();
}

#[test]
fn what_counts_the_nodes_goes_with_the_run() {
    let scene = Scene::after_a_kill();
    let Scene { zero, host, run, .. } = scene;
    drop((zero, host));
    let is_counter = |path: &PathBuf| path.to_string_lossy().contains("global_mgmt");
    let segments = run.paths.segments().expect("listable");
    assert_eq!(segments.iter().filter(|path| is_counter(path)).count(), 1, "{segments:?}");
    remove_run(&run.paths).expect("removes");
    assert_eq!(run.paths.segments().expect("listable"), [] as [PathBuf; 0]);
    assert!(!run.paths.root().exists());
}
