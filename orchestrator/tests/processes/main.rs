//! Real processes: starting, watching and ending them, and what is left when they are killed.
//!
//! The executable is its own test subject: started with a role as first argument it plays a craft or an
//! orchestrator (`roles`), otherwise it runs the tests one after the other on its main thread, because
//! a child's death signal belongs to the thread that spawned it. Tests hold a machine-wide lock.

#![expect(clippy::unwrap_used, reason = "a test says so by failing")]

mod endings;
mod opens;
mod roles;
mod runs;
#[path = "../support/mod.rs"]
mod shared;
mod silent;
mod support;
mod watching;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;

/// A test and its name.
type Test = (&'static str, fn());

/// Lists functions as tests under their own names.
macro_rules! tests {
    ($($module:ident::$name:ident),* $(,)?) => {
        &[$((concat!(stringify!($module), "::", stringify!($name)), $module::$name)),*]
    };
}

const TESTS: &[Test] = tests![
    watching::killed_process_is_noticed_through_its_pidfd,
    watching::stopped_process_is_paused_and_never_reported_dead,
    watching::end_is_reported_with_what_the_process_said,
    watching::process_that_says_too_much_is_cut_and_never_blocked,
    watching::dropped_watch_leaves_no_process,
    watching::no_descriptor_is_inherited,
    watching::executable_that_does_not_exist_is_named,
    endings::obedient_crafts_end_orderly,
    endings::stragglers_are_terminated_and_then_killed,
    endings::stopped_craft_does_not_hold_up_the_end,
    endings::second_signal_cuts_the_graces,
    endings::crafts_end_when_their_orchestrator_is_killed,
    endings::craft_hears_the_orchestrator_and_not_the_terminal,
    endings::craft_refuses_a_dead_run_and_a_foreign_parent,
    opens::every_strategy_plays_a_trace_as_in_simulation,
    opens::time_limit_and_signal_end_an_interval,
    opens::what_a_saturated_interval_left_undone_reaches_no_other,
    opens::killed_craft_ends_an_interval_and_nothing_is_left,
    opens::killed_crafts_are_followed_while_the_interval_goes_on,
    opens::successor_that_is_in_is_not_kept_waiting_by_one_that_dies_at_the_door,
    opens::stopped_crafts_are_paused_and_catch_up,
    opens::every_fact_reaches_its_peers_over_links_that_lose_a_quarter_and_a_half,
    silent::craft_that_loops_is_followed_while_the_interval_goes_on,
    silent::craft_that_never_answers_is_killed_and_followed,
    silent::craft_that_loops_ends_the_run_as_partial_and_is_named,
    silent::craft_that_loops_is_restarted_where_that_is_wanted,
    opens::every_fact_reaches_its_peers_over_links_with_every_fault,
    runs::living_runs_are_private_and_never_cleaned,
    runs::dead_run_is_cleaned_with_its_segments_and_stopped_craft,
    runs::root_without_a_lock_file_is_a_dead_run,
    runs::base_that_is_a_link_is_refused,
];

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args_os().skip(1).collect();
    if let Some(code) = roles::play(&arguments) {
        return code;
    }
    let words: Vec<_> = arguments.iter().filter_map(|word| word.to_str()).collect();
    if words.contains(&"--list") {
        TESTS.iter().for_each(|(name, _)| println!("{name}: test"));
        return ExitCode::SUCCESS;
    }
    let filters: Vec<_> = words.into_iter().filter(|word| !word.starts_with('-')).collect();
    run(|name| filters.is_empty() || filters.iter().any(|filter| name.contains(filter)))
}

/// Runs the selected tests; fails if one does.
fn run(is_selected: impl Fn(&str) -> bool) -> ExitCode {
    let selected: Vec<&Test> = TESTS.iter().filter(|(name, _)| is_selected(name)).collect();
    println!("\nrunning {} tests on real processes", selected.len());
    if selected.is_empty() {
        return ExitCode::SUCCESS;
    }
    let _alone = shared::machine_wide_lock();
    let mut failed = Vec::new();
    for (name, test) in &selected {
        let passed = catch_unwind(AssertUnwindSafe(test)).is_ok();
        println!("test {name} ... {}", if passed { "ok" } else { "FAILED" });
        if !passed {
            failed.push(name);
        }
    }
    println!("\ntest result: {} passed; {} failed", selected.len() - failed.len(), failed.len());
    if failed.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
