//! The progress line: on a terminal only, and never among the results.

use crate::run::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal as _;

/// Draws at most so often a second: the line must not cost what is measured.
const DRAWS_PER_SECOND: u8 = 4;

/// Progress on standard error.
#[derive(Debug)]
pub(super) struct Line {
    bar: Option<ProgressBar>,
    /// What stands before every message.
    prefix: String,
}

impl Line {
    /// A line on a terminal, nothing elsewhere or if the user wants quiet; `part` is which of how many
    /// runs it shows.
    pub(super) fn new(is_quiet: bool, part: Option<(usize, usize)>) -> Self {
        let prefix = part
            .map_or_else(String::new, |(number, all)| format!("cell {} of {all}: ", number + 1));
        let is_shown = !is_quiet && std::io::stderr().is_terminal();
        let style = ProgressStyle::with_template("{bar:20} {pos}/{len} {wide_msg}");
        let bar = is_shown.then(|| {
            let bar = ProgressBar::with_draw_target(
                Some(0),
                ProgressDrawTarget::stderr_with_hz(DRAWS_PER_SECOND),
            );
            match style {
                Ok(style) => bar.with_style(style),
                Err(_) => bar,
            }
        });
        Self { bar, prefix }
    }
}

impl Progress for Line {
    fn at(&mut self, done: u64, total: u64, what: &str) {
        if let Some(bar) = &self.bar {
            bar.set_length(total);
            bar.set_message(format!("{}{what}", self.prefix));
            bar.set_position(done);
        }
    }

    fn say(&mut self, line: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| eprintln!("slateswarm: {line}")),
            None => eprintln!("slateswarm: {line}"),
        }
    }
}

impl Drop for Line {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
