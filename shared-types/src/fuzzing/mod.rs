//! Fuzzing: one body for everything that a process reads from another one.
//!
//! A [`Body`] takes any bytes at all. It must not panic, and where there is a law it holds the reader to
//! it: what is accepted reads the same again, what is refused is refused for the reason that it has. The
//! fuzzers in `shared-types/fuzz` and the bounded tests here run the very same bodies, both from
//! [`Body::seeds`]: valid inputs, to be damaged. Built for tests and under `--cfg fuzzing` only.

mod archives;
mod body;
mod headers;
mod links;
mod records;
mod sequences;

pub use body::Body;

/// All bodies of this crate.
pub const BODIES: [Body; 9] = [
    Body { name: "headers", run: headers::read, seeds: headers::seeds },
    Body { name: "deltas", run: records::deltas, seeds: records::deltas_seeds },
    Body { name: "commands", run: records::commands, seeds: records::commands_seeds },
    Body { name: "receipts", run: records::receipts, seeds: records::receipts_seeds },
    Body { name: "epochs", run: archives::epochs, seeds: archives::epochs_seeds },
    Body { name: "networks", run: archives::networks, seeds: archives::networks_seeds },
    Body { name: "reports", run: archives::reports, seeds: archives::reports_seeds },
    Body { name: "links", run: links::judge, seeds: links::seeds },
    Body { name: "sequences", run: sequences::arrive, seeds: sequences::seeds },
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
