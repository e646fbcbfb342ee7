//! What recovery did in intervals of open mode: its counts by name, a line of the long form and a figure
//! each.
//!
//! Not here: the record itself ([`super::load`]), and which losses no recovery made up for
//! ([`shared_types::wire::Losses`]).

use super::load::LoadRecovery;

/// Metric, value, unit and label of everything that `recovery` says.
#[must_use]
pub fn values(recovery: &LoadRecovery) -> [(&'static str, u64, &'static str, &'static str); 12] {
    let LoadRecovery {
        deaths,
        records_missed,
        repeats,
        given_up,
        learnt,
        states_missed,
        links,
        dropped,
    } = *recovery;
    [
        ("recovery-deaths", deaths, "process", "processes that died and were followed"),
        (
            "recovery-records-missed",
            records_missed,
            "record",
            "records due before a successor came, which skips them",
        ),
        ("recovery-lost-on-link", links.lost, "sample", "samples that links lost"),
        ("recovery-cut-off-on-link", links.cut_off, "sample", "samples lost in an outage"),
        ("recovery-doubled-on-link", links.doubled, "sample", "samples that links doubled"),
        ("recovery-delayed-on-link", links.delayed, "sample", "samples that links held up"),
        (
            "recovery-overtaken-on-link",
            links.overtaken,
            "sample",
            "samples that a later one overtook",
        ),
        ("recovery-dropped", dropped, "sample", "samples that full outboxes dropped"),
        ("recovery-repeats", repeats, "sample", "samples sent again"),
        ("recovery-given-up", given_up, "sample", "samples for which the state was asked instead"),
        ("recovery-learnt", learnt, "change", "changes learnt from states"),
        (
            "recovery-states-missed",
            states_missed,
            "question",
            "questions for a state without an answer",
        ),
    ]
}
