//! The raw programs as a user runs them: figures come out, and nothing stays behind, whoever dies.
//!
//! Each test has an area of its own, so that tests run side by side and beside a measurement.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use rustix::process::{Pid, Signal, kill_process};
use std::io::Read;
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

const RAW_ROUND: &str = env!("CARGO_BIN_EXE_raw-round");
const RAW_ONE_WAY: &str = env!("CARGO_BIN_EXE_raw-one-way");
const RAW_CAPACITY: &str = env!("CARGO_BIN_EXE_raw-capacity");
const DELTA_ONE_WAY: &str = env!("CARGO_BIN_EXE_delta-one-way");

/// A measurement that never ends by itself.
const ENDLESS: [&str; 4] = ["--processes", "3", "--measured", "1000000000"];

/// An area for one test, checked and removed at its end.
struct TestArea(String);

impl TestArea {
    fn new(test: &str) -> Self {
        Self(format!("sst-{test}-{}", std::process::id()))
    }

    #[expect(clippy::disallowed_methods, reason = "the subject of the test is a program")]
    fn command(&self, program: &str, arguments: &[&str]) -> Command {
        let mut command = Command::new(program);
        command.args(arguments).args(["--area", &self.0]);
        command
    }

    /// What lies in shared memory for this area.
    fn leftovers(&self) -> Vec<PathBuf> {
        let is_ours = |path: &PathBuf| path.to_string_lossy().contains(&self.0);
        std::fs::read_dir("/dev/shm")
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .filter(is_ours)
            .collect()
    }

    /// An endless measurement that is under way, and its children.
    fn start_endless(&self) -> (Running, Vec<Pid>) {
        let mut running = Running(
            self.command(RAW_ROUND, &ENDLESS)
                .stdout(Stdio::null())
                .stderr(Stdio::piped())
                .spawn()
                .unwrap(),
        );
        let parent = running.0.id();
        let mut children = Vec::new();
        wait_until("three children with open ports", || {
            assert!(running.0.try_wait().unwrap().is_none(), "ended early");
            let listed =
                std::fs::read_to_string(format!("/proc/{parent}/task/{parent}/children")).unwrap();
            children =
                listed.split(' ').filter_map(|pid| Pid::from_raw(pid.parse().ok()?)).collect();
            let is_data = |path: &PathBuf| path.extension().is_some_and(|end| end == "data");
            children.len() == 3 && self.leftovers().iter().filter(|path| is_data(path)).count() == 3
        });
        (running, children)
    }
}

impl Drop for TestArea {
    fn drop(&mut self) {
        for path in self.leftovers() {
            let _ = std::fs::remove_dir_all(&path).or_else(|_| std::fs::remove_file(&path));
        }
    }
}

/// A program that is killed if its test fails.
struct Running(Child);

impl Running {
    fn end(mut self) -> (ExitStatus, String) {
        let status = self.0.wait().unwrap();
        let mut error = String::new();
        self.0.stderr.take().unwrap().read_to_string(&mut error).unwrap();
        (status, error)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Looks again until `condition` holds. The bound only keeps a broken program from hanging the test.
#[expect(clippy::disallowed_methods, reason = "a bound on hanging needs a clock")]
fn wait_until(what: &str, mut condition: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !condition() {
        assert!(begun.elapsed() < Duration::from_secs(120), "waited in vain for {what}");
        std::thread::yield_now();
    }
}

fn is_alive(process: Pid) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{}/stat", process.as_raw_nonzero()));
    status.is_ok_and(|status| !status.contains(") Z "))
}

#[test]
fn every_round_and_round_trip_is_recorded_and_nothing_stays() {
    let area = TestArea::new("figures");
    let cases = [
        (RAW_ROUND, "iceoryx2"),
        (RAW_ROUND, "datagrams"),
        (RAW_ONE_WAY, "iceoryx2"),
        (RAW_ONE_WAY, "datagrams"),
        (RAW_ONE_WAY, "blocking-datagrams"),
    ];
    let arguments = ["--warm-up", "10", "--measured", "300", "--format", "json", "--over"];
    for (program, over) in cases {
        let output = area.command(program, &[&arguments[..], &[over]].concat()).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        let result: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(result["time"]["n"], 300, "{result}");
        assert!(result["time"]["p50"].as_u64().unwrap() > 0, "{result}");
        assert!(result["time"]["p99"].is_null(), "300 samples do not support a p99: {result}");
        assert_eq!(area.leftovers(), [] as [PathBuf; 0]);
    }
}

#[test]
fn a_stream_of_samples_arrives_whole_and_nothing_stays() {
    let area = TestArea::new("stream");
    let arguments = ["--processes", "3", "--warm-up", "1", "--measured", "40", "--format", "json"];
    for over in ["iceoryx2", "datagrams"] {
        let output = area
            .command(RAW_CAPACITY, &[&arguments[..], &["--over", over]].concat())
            .output()
            .unwrap();
        assert!(output.status.success(), "{output:?}");
        let result: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(result["time"]["n"], 40, "{result}");
        assert!(result["samples_per_s"].as_f64().unwrap() > 0.0, "{result}");
        assert_eq!(area.leftovers(), [] as [PathBuf; 0]);
    }
}

#[test]
fn every_delta_is_applied_at_the_peer_and_no_run_stays() {
    let area = TestArea::new("delta");
    let base = format!("/dev/shm/{}-runs", area.0);
    let output = area
        .command(DELTA_ONE_WAY, &["--warm-up", "10", "--measured", "300", "--format", "json"])
        .env("SLATESWARM_SHM", &base)
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    let result: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(result["time"]["n"], 300, "{result}");
    assert!(result["time"]["p50"].as_u64().unwrap() > 0, "{result}");
    assert_eq!(area.leftovers(), [] as [PathBuf; 0]);
}

#[test]
fn a_killed_child_ends_the_measurement_and_nothing_stays() {
    let area = TestArea::new("child");
    let (running, children) = area.start_endless();
    kill_process(children[1], Signal::KILL).unwrap();
    let (status, error) = running.end();
    assert_eq!(status.code(), Some(1), "{error}");
    assert!(error.contains("process 1 ended early"), "{error}");
    assert!(!children.into_iter().any(is_alive));
    assert_eq!(area.leftovers(), [] as [PathBuf; 0]);
}

#[test]
fn a_signal_ends_the_measurement_with_its_code_and_nothing_stays() {
    for (signal, code) in [(Signal::INT, 130), (Signal::TERM, 143)] {
        let area = TestArea::new("signal");
        let (running, children) = area.start_endless();
        kill_process(Pid::from_child(&running.0), signal).unwrap();
        let (status, error) = running.end();
        assert_eq!(status.code(), Some(code), "{error}");
        assert!(!children.into_iter().any(is_alive));
        assert_eq!(area.leftovers(), [] as [PathBuf; 0]);
    }
}

#[test]
fn what_a_killed_parent_left_is_gone_after_the_next_measurement() {
    let area = TestArea::new("parent");
    let (running, children) = area.start_endless();
    kill_process(Pid::from_child(&running.0), Signal::KILL).unwrap();
    running.end();
    wait_until("the end of the children", || !children.iter().copied().any(is_alive));
    assert_ne!(area.leftovers(), [] as [PathBuf; 0]);
    let output = area
        .command(RAW_ROUND, &["--processes", "2", "--warm-up", "0", "--measured", "30"])
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    assert_eq!(area.leftovers(), [] as [PathBuf; 0]);
}
