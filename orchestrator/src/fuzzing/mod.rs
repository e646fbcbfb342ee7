//! Fuzzing of what this crate reads: scenarios, traces, results directories; and of what a craft and the
//! referee are told. As `shared_types::fuzzing`, whose words apply here as well.

mod arguments;
#[path = "../../../shared-types/src/fuzzing/body.rs"]
mod body;
mod crafts;
mod directories;
mod documents;
mod histograms;
mod lives;
mod reports;
mod scenarios;

#[cfg(test)]
mod power_cut;

pub use body::Body;

/// All bodies of this crate.
pub const BODIES: [Body; 14] = [
    Body { name: "scenarios", run: scenarios::read, seeds: scenarios::seeds },
    Body { name: "overrides", run: arguments::overrides, seeds: arguments::overrides_seeds },
    Body { name: "traces", run: scenarios::traces, seeds: scenarios::traces_seeds },
    Body { name: "documents", run: documents::read, seeds: documents::seeds },
    Body { name: "logs", run: documents::logs, seeds: documents::logs_seeds },
    Body { name: "histograms", run: histograms::read, seeds: histograms::seeds },
    Body { name: "directories", run: directories::read, seeds: directories::seeds },
    Body { name: "campaigns", run: directories::read_campaign, seeds: directories::campaign_seeds },
    Body { name: "resumptions", run: directories::resume, seeds: directories::seeds },
    Body { name: "crafts", run: crafts::receive, seeds: crafts::seeds },
    Body { name: "lives", run: lives::live, seeds: lives::seeds },
    Body { name: "arguments", run: arguments::crafts, seeds: arguments::crafts_seeds },
    Body { name: "ledgers", run: crafts::record, seeds: crafts::ledgers_seeds },
    Body { name: "judgements", run: reports::judge, seeds: reports::seeds },
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
