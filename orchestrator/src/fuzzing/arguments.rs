//! Command lines: of a craft's process, with what it is doomed to, and what users override.

use super::scenarios;
use crate::scenario::{Base, Override, PRESETS, load};
use agent::process::doom::Doom;
use agent::process::startup::AgentArguments;
use shared_types::ids::{CraftId, Incarnation};
use shared_types::transport::WakeMode;
use std::ffi::OsString;
use std::os::unix::ffi::OsStringExt as _;

/// Words with a zero between each two. What is accepted is the same once written; what is refused is named.
/// A doom, and the last words of one who obeyed, are read likewise.
pub(super) fn crafts(bytes: &[u8]) {
    let words = bytes.split(|&byte| byte == 0).map(|word| OsString::from_vec(word.to_vec()));
    match AgentArguments::from_command_line(words) {
        Ok(arguments) => {
            let again = AgentArguments::from_command_line(arguments.to_command_line());
            assert_eq!(again, Ok(arguments));
        }
        Err(error) => assert!(error.to_string().contains("agent"), "{error}"),
    }
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let _died_at = Doom::died_at(text);
    if let Ok(doom) = text.parse::<Doom>() {
        assert_eq!(doom.to_string().parse(), Ok(doom));
    }
}

/// A craft that is pinned, one that is not, one with a doom, and a doom by itself.
pub(super) fn crafts_seeds() -> Vec<Vec<u8>> {
    let doom: Doom = "send:3".parse().expect("a doom");
    let arguments = |cores: Vec<u32>, doom| AgentArguments {
        run: 0xfeed,
        base: "/dev/shm".into(),
        craft: CraftId(2),
        craft_count: 5,
        incarnation: Incarnation(1),
        parent_pid: 77,
        wake: WakeMode::Adaptive,
        cores,
        beside: vec![CraftId(0), CraftId(4)],
        doom,
    };
    let line = |arguments: AgentArguments| {
        let words = arguments.to_command_line().into_iter().map(OsString::into_vec);
        words.collect::<Vec<_>>().join(&0)
    };
    let last_words = b"slateswarm: dies as it was told: send:3 at 123456 ns\n".to_vec();
    vec![
        line(arguments(vec![1], None)),
        line(arguments(Vec::new(), Some(doom))),
        doom.to_string().into_bytes(),
        last_words,
    ]
}

/// A preset in a byte, then lines: variables of the environment (`SLATESWARM_..=VALUE`), and what `--set` is
/// told. It is refused at what was given, with a remedy, or is a scenario like any other.
pub(super) fn overrides(bytes: &[u8]) {
    let Some((&preset, text)) = bytes.split_first() else { return };
    let Ok(text) = std::str::from_utf8(text) else { return };
    let preset = PRESETS[usize::from(preset) % PRESETS.len()];
    let is_variable = |line: &&str| line.starts_with("SLATESWARM_");
    let variables = text.split('\n').filter(is_variable).filter_map(|line| line.split_once('='));
    let variables = variables.map(|(name, value)| (name.to_owned(), value.to_owned()));
    let set: Result<Vec<Override>, _> =
        text.split('\n').filter(|line| !is_variable(line)).map(Override::set).collect();
    let loaded = set.and_then(|set| load(&Base::Preset(preset.name.to_owned()), variables, &set));
    match loaded {
        Ok(scenario) => scenarios::check(&scenario),
        Err(error) => {
            let has_place = error.position().is_some() || error.message().contains("--set");
            assert!(has_place, "{error}");
            assert!(!error.message().is_empty());
        }
    }
}

/// Numbers, texts, lists, keys of lists, and variables.
pub(super) fn overrides_seeds() -> Vec<Vec<u8>> {
    let lines = [
        "run.seed=7",
        "run.trials=3\nreplication.strategies=[\"full\", \"null\"]\nfleet.crafts=4",
        "SLATESWARM_RUN__SEED=9\nnetwork.facts=60\nnetwork.links=0.5",
        "link.loss=0.02\nlink.delay-ms=1.5\nrun.wake=poll",
        "SLATESWARM_LINK__JITTER_MS=0.25\nreasoning.policy=best-path",
    ];
    (0_u8..).zip(lines).map(|(preset, lines)| [&[preset][..], lines.as_bytes()].concat()).collect()
}
