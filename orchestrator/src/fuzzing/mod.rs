//! Fuzzing of what this crate reads: scenarios, traces, results directories; and of what a craft and the
//! referee are told. As `shared_types::fuzzing`, whose words apply here as well.

#[path = "../../../shared-types/src/fuzzing/body.rs"]
mod body;
mod crafts;
mod directories;
mod documents;
mod scenarios;

#[cfg(test)]
mod power_cut;

pub use body::Body;

/// All bodies of this crate.
pub const BODIES: [Body; 8] = [
    Body { name: "scenarios", run: scenarios::read, seeds: scenarios::seeds },
    Body { name: "traces", run: scenarios::traces, seeds: scenarios::traces_seeds },
    Body { name: "documents", run: documents::read, seeds: documents::seeds },
    Body { name: "logs", run: documents::logs, seeds: documents::logs_seeds },
    Body { name: "directories", run: directories::read, seeds: directories::seeds },
    Body { name: "resumptions", run: directories::resume, seeds: directories::seeds },
    Body { name: "crafts", run: crafts::receive, seeds: crafts::seeds },
    Body { name: "ledgers", run: crafts::record, seeds: crafts::ledgers_seeds },
];

/// Runs the body of that name.
///
/// # Panics
/// If there is none, or a law is broken.
pub fn run(name: &str, bytes: &[u8]) {
    let body = BODIES.iter().find(|body| body.name == name);
    (body.expect("fuzzers are named after bodies").run)(bytes);
}

#[cfg(test)]
mod tests {
    #[test]
    fn every_body_holds_whatever_the_bytes() {
        let broken: Vec<String> =
            super::BODIES.iter().filter_map(|body| body.hold().err()).collect();
        assert!(broken.is_empty(), "{}", broken.join("\n"));
    }
}
