//! The command line's round trip and its refusals. What the first steps do to a process is tested with
//! real processes beside the launcher.

use super::{AgentArguments, ArgumentError};
use crate::process::doom::{Doom, Point};
use shared_types::ids::{CraftId, Incarnation};
use shared_types::transport::WakeMode;
use std::ffi::OsString;
use std::path::PathBuf;

fn sample(wake: WakeMode, cores: &[u32]) -> AgentArguments {
    AgentArguments {
        run: 0x00ab_cdef_0123_4567,
        base: PathBuf::from("/dev/shm/a directory"),
        craft: CraftId(12),
        craft_count: 13,
        incarnation: Incarnation(2),
        parent_pid: 4321,
        wake,
        cores: cores.to_vec(),
        beside: cores.iter().copied().map(CraftId).collect(),
        doom: cores.first().map(|&after| Doom { point: Point::Send, after }),
    }
}

fn without(option: &str) -> Vec<OsString> {
    let line = sample(WakeMode::Poll, &[]).to_command_line();
    line.chunks(2).filter(|pair| pair[0] != option).flatten().cloned().collect()
}

#[test]
fn command_line_is_read_as_it_was_written() {
    for wake in [WakeMode::Poll, WakeMode::Adaptive, WakeMode::Block] {
        for cores in [&[][..], &[3], &[0, 1, 17]] {
            let arguments = sample(wake, cores);
            assert_eq!(
                AgentArguments::from_command_line(arguments.to_command_line()),
                Ok(arguments)
            );
        }
    }
}

#[test]
fn every_option_is_needed() {
    for option in super::arguments::OPTIONS {
        assert_eq!(
            AgentArguments::from_command_line(without(option)),
            Err(ArgumentError::Missing(option))
        );
    }
}

#[test]
fn unknown_repeated_and_unreadable_options_are_refused() {
    let with = |extra: &[&str]| {
        let mut line = without("--craft");
        line.extend(extra.iter().map(OsString::from));
        AgentArguments::from_command_line(line).unwrap_err()
    };
    assert_eq!(with(&["--kraft", "1"]), ArgumentError::Unknown("--kraft".into()));
    assert_eq!(with(&["--craft", "1", "--craft", "2"]), ArgumentError::Twice("--craft"));
    assert_eq!(with(&["--craft"]), ArgumentError::Missing("--craft"));
    assert_eq!(
        with(&["--craft", "-1"]),
        ArgumentError::Value { option: "--craft", value: "-1".into() }
    );
}
