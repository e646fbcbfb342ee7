//! What is fuzzed, and its bounded run under `cargo test`. The crates above have this file as well, by
//! its path: a crate that is built for its tests cannot lend theirs.

#[cfg(test)]
#[path = "edits.rs"]
mod edits;

/// Something that is read from outside a process.
#[derive(Clone, Copy, Debug)]
pub struct Body {
    /// Its name, which is the fuzzer's as well.
    pub name: &'static str,
    /// Reads the bytes; panics if a law is broken.
    pub run: fn(&[u8]),
    /// Inputs that are accepted.
    pub seeds: fn() -> Vec<Vec<u8>>,
}

#[cfg(test)]
impl Body {
    /// Runs the body on damaged inputs, 256 unless `PROPTEST_CASES` says otherwise.
    ///
    /// # Errors
    /// Which law was broken, and by which bytes.
    pub(crate) fn hold(&self) -> Result<(), String> {
        use proptest::test_runner::{Config, TestError, TestRunner};
        let config = Config { failure_persistence: None, ..Config::default() };
        let outcome = TestRunner::new(config).run(&edits::damaged((self.seeds)()), |bytes| {
            (self.run)(&bytes);
            Ok(())
        });
        outcome.map_err(|error| match error {
            TestError::Abort(why) => format!("{}: {why}", self.name),
            TestError::Fail(why, bytes) => {
                format!("{}: {why}\nby b\"{}\"", self.name, bytes.escape_ascii())
            }
        })
    }
}
