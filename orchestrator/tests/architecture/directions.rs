//! Which modules must not import which: the picture of docs/architecture.md as a table.

use crate::Violation;
use crate::imports::imports_of;
use crate::rust_text::{RustFile, is_inside};

/// What one module, with everything inside it, must not import.
struct Rule {
    module: &'static str,
    never: &'static [&'static str],
    because: &'static str,
}

/// What only shells touch: clock, files, processes, network, threads, the real transport.
const OUTSIDE: &[&str] = &[
    "std::env",
    "std::fs",
    "std::io",
    "std::net",
    "std::process",
    "std::thread",
    "std::time",
    "rustix",
    "iceoryx2",
    "shared_types::transport::clock",
    "shared_types::transport::iceoryx",
    "shared_types::transport::paths",
    "shared_types::transport::reclaim",
    "agent::process",
];
const NO_OUTSIDE: &str = "the core takes time, randomness and messages as arguments";
const DOWNWARD: &str = "imports point downward only";

const RULES: &[Rule] = &[
    Rule {
        module: "shared_types::knowledge",
        never: &["shared_types::scenario", "shared_types::transport", "shared_types::wire"],
        because: DOWNWARD,
    },
    Rule {
        module: "shared_types::wire",
        never: &["shared_types::scenario", "shared_types::transport"],
        because: DOWNWARD,
    },
    Rule {
        module: "shared_types::transport",
        never: &["shared_types::scenario"],
        because: "the transport knows no user's file",
    },
    Rule { module: "shared_types::knowledge", never: OUTSIDE, because: NO_OUTSIDE },
    Rule { module: "shared_types::rng", never: OUTSIDE, because: NO_OUTSIDE },
    Rule { module: "shared_types::trace", never: OUTSIDE, because: NO_OUTSIDE },
    Rule { module: "shared_types::scenario", never: OUTSIDE, because: NO_OUTSIDE },
    Rule { module: "shared_types::transport::memory", never: OUTSIDE, because: NO_OUTSIDE },
    Rule { module: "agent::blackboard", never: OUTSIDE, because: NO_OUTSIDE },
    Rule { module: "agent::craft", never: OUTSIDE, because: NO_OUTSIDE },
    Rule { module: "agent::lockstep", never: OUTSIDE, because: NO_OUTSIDE },
    Rule { module: "agent::metrics", never: OUTSIDE, because: NO_OUTSIDE },
    Rule { module: "agent::oracle", never: OUTSIDE, because: NO_OUTSIDE },
    Rule { module: "agent::reasoning", never: OUTSIDE, because: NO_OUTSIDE },
    Rule { module: "agent::replication", never: OUTSIDE, because: NO_OUTSIDE },
    Rule { module: "agent::simulation", never: OUTSIDE, because: NO_OUTSIDE },
    Rule {
        module: "agent::blackboard",
        never: &[
            "agent::craft",
            "agent::lockstep",
            "agent::oracle",
            "agent::replication",
            "agent::simulation",
            "shared_types::transport",
        ],
        because: "a board knows facts, and nobody to tell them to",
    },
    Rule {
        module: "agent::reasoning",
        never: &[
            "agent::blackboard",
            "agent::craft",
            "agent::lockstep",
            "agent::oracle",
            "agent::replication",
            "agent::simulation",
            "shared_types::transport",
            "shared_types::wire",
        ],
        because: "reasoning reads networks and values, whoever holds them",
    },
    Rule { module: "agent::control", never: OUTSIDE, because: NO_OUTSIDE },
    Rule {
        module: "agent::control",
        never: &[
            "agent::craft",
            "agent::lockstep",
            "agent::oracle",
            "agent::replication",
            "agent::simulation",
            "shared_types::transport",
        ],
        because: "control looks at a board and chooses",
    },
    Rule {
        module: "agent::lockstep",
        never: &[
            "agent::blackboard",
            "agent::craft",
            "agent::oracle",
            "agent::replication",
            "agent::simulation",
            "shared_types::transport",
        ],
        because: "the referee judges reports and takes no part",
    },
    Rule {
        module: "agent::replication",
        never: &["agent::lockstep", "agent::oracle", "agent::simulation"],
        because: DOWNWARD,
    },
    Rule {
        module: "agent::replication",
        never: &["shared_types::transport::Endpoint", "shared_types::transport::memory"],
        because: "a strategy decides and never sends",
    },
    Rule {
        module: "agent::craft",
        never: &["agent::oracle", "agent::simulation", "shared_types::transport::memory"],
        because: DOWNWARD,
    },
    Rule {
        module: "agent::oracle",
        never: &[
            "agent::blackboard",
            "agent::craft",
            // Not all of lockstep: how a trial ended (`Outcome`) is vocabulary.
            "agent::lockstep::Referee",
            "agent::replication",
            "agent::simulation",
            "shared_types::transport",
        ],
        because: "the oracle shares no code with what it is held against",
    },
    Rule {
        module: "agent::simulation",
        never: &["agent::oracle"],
        because: "the two are held against each other",
    },
    Rule {
        module: "orchestrator::scenario",
        never: &[
            "orchestrator::cli",
            "orchestrator::commands",
            "orchestrator::launch",
            "orchestrator::report",
            "orchestrator::results",
            "orchestrator::run",
            "orchestrator::supervision",
        ],
        because: "a scenario is read and checked before anything runs",
    },
    Rule {
        module: "orchestrator::workload",
        never: &[
            "orchestrator::cli",
            "orchestrator::commands",
            "orchestrator::launch",
            "orchestrator::report",
            "orchestrator::results",
            "orchestrator::run",
            "orchestrator::supervision",
        ],
        because: "a trace is fixed before anything runs",
    },
    Rule {
        module: "orchestrator::launch",
        never: &[
            "orchestrator::cli",
            "orchestrator::commands",
            "orchestrator::report",
            "orchestrator::results",
            "orchestrator::run",
        ],
        because: DOWNWARD,
    },
    Rule {
        module: "orchestrator::supervision",
        never: &[
            "orchestrator::cli",
            "orchestrator::commands",
            "orchestrator::report",
            "orchestrator::run",
        ],
        because: DOWNWARD,
    },
    Rule {
        module: "orchestrator::results",
        never: &[
            "orchestrator::cli",
            "orchestrator::commands",
            "orchestrator::launch",
            "orchestrator::report",
            "orchestrator::run",
            "orchestrator::supervision",
        ],
        because: "records know nothing of who writes or reads them",
    },
    Rule {
        module: "orchestrator::report",
        never: &[
            "orchestrator::commands",
            "orchestrator::launch",
            "orchestrator::run",
            "orchestrator::supervision",
            "agent",
        ],
        because: "a report reads results only and never needs a run",
    },
    Rule {
        module: "orchestrator::run",
        never: &["orchestrator::cli", "orchestrator::commands", "orchestrator::report"],
        because: DOWNWARD,
    },
    Rule {
        module: "benches::raw",
        never: &["shared_types", "agent", "orchestrator"],
        because: "the yardstick holds nothing of what is measured with it",
    },
];

/// The modules that rules are about, each once, in the order of the table.
pub(crate) fn modules() -> impl Iterator<Item = &'static str> {
    let first = |at: usize| RULES[..at].iter().all(|rule| rule.module != RULES[at].module);
    RULES.iter().enumerate().filter(move |(at, _)| first(*at)).map(|(_, rule)| rule.module)
}

/// Whether `module` is one of the files.
pub(crate) fn exists(module: &str, files: &[RustFile]) -> bool {
    files.iter().any(|file| file.module().as_deref() == Some(module))
}

/// Checks one file against every rule; tests may import what they like.
pub(crate) fn check(file: &RustFile) -> Vec<Violation> {
    let module = file.module().unwrap_or_default();
    let rules: Vec<&Rule> = RULES.iter().filter(|rule| is_inside(&module, rule.module)).collect();
    if rules.is_empty() {
        return Vec::new();
    }
    let imports = imports_of(file);
    let mut found = Vec::new();
    for rule in rules {
        for import in &imports {
            if rule.never.iter().any(|never| import.leads_into(never)) {
                let what = format!(
                    "{} must not import {}, because {}; move one of them, or hand over a value",
                    rule.module, import.path, rule.because
                );
                found.push(Violation { file: file.path.clone(), line: import.line, what });
            }
        }
    }
    found
}

#[test]
fn an_import_against_the_direction_is_found_with_its_line() {
    let lines = |path: &str, source: &str| {
        check(&RustFile::new(path, source)).iter().map(|found| found.line).collect::<Vec<_>>()
    };
    let oracle = "agent/src/oracle/replay.rs";
    assert_eq!(lines(oracle, "use shared_types::ids::CraftId;\nuse crate::blackboard::A;"), [2]);
    assert_eq!(lines(oracle, "use super::super::{craft::Craft, metrics};"), [1]);
    assert_eq!(lines(oracle, "fn a() {\n    crate::replication::plan()\n}"), [2]);
    assert_eq!(lines("orchestrator/src/report/mod.rs", "use crate::run::Run;"), [1]);
    assert_eq!(lines("agent/src/craft/mod.rs", "let a = std::time::Instant::now();"), [1]);
}

#[test]
fn what_is_allowed_is_not_found() {
    let allowed = |path: &str, source: &str| {
        assert_eq!(check(&RustFile::new(path, source)), [], "{path}: {source}")
    };
    allowed("agent/src/oracle/mod.rs", "use crate::oracle::replay; use shared_types::wire::A;");
    allowed("agent/src/oracle/mod.rs", "/// [`crate::blackboard`]\nfn a() {}");
    allowed("agent/src/oracle/tests.rs", "use crate::blackboard::Blackboard;");
    allowed("agent/src/oracle/mod.rs", "#[cfg(test)]\nmod tests { use crate::craft::Craft; }");
    allowed("orchestrator/src/report/mod.rs", "use crate::runway::Run;");
    allowed("agent/src/process/mod.rs", "use std::time::Instant;");
}
