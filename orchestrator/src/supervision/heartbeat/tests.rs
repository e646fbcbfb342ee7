//! The rule with given times: who is told, swept for and killed when, and who is left alone.

use super::{
    CraftId, Finding, GRACE_NS, Incarnation, LOOK_NS, Nanos, SILENCE_NS, SLEEP_NS_MAX,
    START_SILENCE_NS, Seen, Silence, Standing, Vigil,
};

/// A process as a test drives it.
#[derive(Clone, Copy)]
struct Process {
    incarnation: u32,
    is_ready: bool,
    beats: u64,
    state: char,
    cpu_ns: u64,
    starved_ns: u64,
}

const WELL: Process = Process {
    incarnation: 0,
    is_ready: true,
    beats: 7,
    state: 'S',
    cpu_ns: 1_000_000,
    starved_ns: 0,
};

/// A vigil over processes, one look every [`LOOK_NS`].
struct Watched<const N: usize> {
    vigil: Vigil,
    now: Nanos,
    processes: [Process; N],
}

impl<const N: usize> Watched<N> {
    fn new(processes: [Process; N]) -> Self {
        let mut watched = Self { vigil: Vigil::default(), now: Nanos(5_000_000_000), processes };
        assert_eq!(watched.look_after(0), []);
        watched
    }

    fn look_after(&mut self, passed_ns: u64) -> Vec<Finding> {
        self.now = self.now.plus(passed_ns);
        let living: Vec<Seen> = (0..)
            .zip(&self.processes)
            .map(|(craft, process)| Seen {
                craft: CraftId(craft),
                incarnation: Incarnation(process.incarnation),
                is_ready: process.is_ready,
                beats: process.beats,
            })
            .collect();
        let processes = self.processes;
        self.vigil.look(self.now, &living, |craft| {
            let Process { state, cpu_ns, starved_ns, .. } = processes[craft.index()];
            Some(Standing { state, cpu_ns, starved_ns })
        })
    }

    /// Looks for `during_ns`, with `live` between two looks; stops at the first finding and says when.
    fn until_found(
        &mut self,
        during_ns: u64,
        mut live: impl FnMut(&mut [Process; N]),
    ) -> Option<(u64, Vec<Finding>)> {
        let began = self.now;
        while self.now.since(began) < during_ns {
            live(&mut self.processes);
            let found = self.look_after(LOOK_NS);
            if !found.is_empty() {
                return Some((self.now.since(began), found));
            }
        }
        None
    }
}

fn silence(craft: u32, silent_ns: u64) -> Silence {
    Silence { craft: CraftId(craft), incarnation: Incarnation(0), silent_ns }
}

const LONG_NS: u64 = 60_000_000_000;

#[test]
fn who_sleeps_as_long_as_it_may_is_not_even_looked_at() {
    let mut vigil = Vigil::default();
    let seen =
        |beats| Seen { craft: CraftId(0), incarnation: Incarnation(0), is_ready: true, beats };
    for look in 0..400 {
        let now = Nanos(look * LOOK_NS);
        let beats = look * LOOK_NS / SLEEP_NS_MAX;
        let found = vigil.look(now, &[seen(beats)], |_| panic!("a look into /proc"));
        assert_eq!(found, []);
    }
}

/// Told after two seconds, killed when the grace after the sweep is over.
#[track_caller]
fn check_silent(state: char, cpu_ns_a_look: u64) {
    let mut watched = Watched::new([WELL, WELL]);
    watched.processes[1].state = state;
    let mut live = |processes: &mut [Process; 2]| {
        processes[0].beats += 1;
        processes[1].cpu_ns += cpu_ns_a_look;
    };
    let (after_ns, found) = watched.until_found(LONG_NS, &mut live).expect("silent");
    assert!((SILENCE_NS..=SILENCE_NS + LOOK_NS).contains(&after_ns), "{after_ns}");
    assert_eq!(found, [Finding::Silent(silence(1, after_ns))]);
    assert_eq!(watched.until_found(LONG_NS, &mut live), None, "the sweep is under way");
    watched.vigil.swept();
    let (grace_ns, found) = watched.until_found(LONG_NS, &mut live).expect("not helped");
    assert_eq!(grace_ns, GRACE_NS);
    assert_eq!(found, [Finding::Hopeless(silence(1, after_ns + LONG_NS + grace_ns))]);
    assert_eq!(watched.until_found(LONG_NS, &mut live), None, "nobody is killed twice");
}

#[test]
fn who_loops_for_ever_is_told_swept_for_and_killed() {
    check_silent('R', LOOK_NS);
}

#[test]
fn who_sleeps_for_ever_is_told_swept_for_and_killed() {
    check_silent('S', 0);
}

#[test]
fn who_moves_after_the_sweep_is_forgiven_and_begins_anew() {
    let mut watched = Watched::new([WELL]);
    let (after_ns, _) = watched.until_found(LONG_NS, |_| {}).expect("silent");
    watched.vigil.swept();
    watched.processes[0].beats += 1;
    let found = watched.look_after(LOOK_NS);
    assert_eq!(found, [Finding::Moves(silence(0, after_ns + LOOK_NS))]);
    let (again_ns, found) = watched.until_found(LONG_NS, |_| {}).expect("silent again");
    assert_eq!((again_ns, found), (after_ns, vec![Finding::Silent(silence(0, after_ns))]));
}

#[test]
fn who_gets_no_core_is_starved_and_not_silent() {
    let mut watched = Watched::new([Process { state: 'R', ..WELL }]);
    assert_eq!(watched.until_found(LONG_NS, |_| {}), None);
    // A tenth of a core: two seconds of it, but for the sleep that was granted unseen.
    let live = |processes: &mut [Process; 1]| processes[0].cpu_ns += LOOK_NS / 10;
    let (after_ns, _) = watched.until_found(LONG_NS, live).expect("silent");
    let wanted_ns = 10 * (SILENCE_NS - SLEEP_NS_MAX);
    assert!((wanted_ns..=wanted_ns + SLEEP_NS_MAX + LOOK_NS).contains(&after_ns), "{after_ns}");
}

#[test]
fn who_was_starved_most_of_the_time_and_is_found_asleep_is_not_silent() {
    let mut watched = Watched::new([WELL]);
    let live = |processes: &mut [Process; 1]| processes[0].starved_ns += LOOK_NS - LOOK_NS / 10;
    let (after_ns, _) = watched.until_found(LONG_NS, live).expect("silent");
    let wanted_ns = 10 * (SILENCE_NS - SLEEP_NS_MAX);
    assert!(after_ns.abs_diff(wanted_ns) <= 10 * LOOK_NS, "{after_ns}");
}

#[test]
fn who_is_stopped_is_left_alone_and_begins_anew_when_it_goes_on() {
    for state in ['T', 't'] {
        let mut watched = Watched::new([WELL]);
        assert_eq!(watched.until_found(SILENCE_NS - LOOK_NS, |_| {}), None);
        watched.processes[0].state = state;
        assert_eq!(watched.until_found(LONG_NS, |_| {}), None);
        watched.processes[0].state = 'S';
        let (after_ns, found) = watched.until_found(LONG_NS, |_| {}).expect("silent");
        // From the first look at it on.
        assert_eq!((after_ns, found.len()), (LOOK_NS + SILENCE_NS, 1));
    }
}

#[test]
fn while_somebody_is_stopped_or_held_up_by_the_kernel_nobody_is_judged() {
    for state in ['T', 'D'] {
        let mut watched = Watched::new([WELL, Process { state, ..WELL }]);
        assert_eq!(watched.until_found(LONG_NS, |_| {}), None);
        watched.processes[1].state = 'S';
        let live = |processes: &mut [Process; 2]| processes[1].beats += 1;
        let (_, found) = watched.until_found(LONG_NS, live).expect("silent");
        let [Finding::Silent(Silence { craft, .. })] = found[..] else { panic!("{found:?}") };
        assert_eq!(craft, CraftId(0));
    }
}

#[test]
fn who_is_held_up_now_and_then_is_judged_by_the_rest_of_its_time() {
    let mut watched = Watched::new([WELL]);
    let mut looks = 0_u64;
    let live = |processes: &mut [Process; 1]| {
        looks += 1;
        processes[0].state = if looks.is_multiple_of(2) { 'D' } else { 'S' };
    };
    let (after_ns, _) = watched.until_found(LONG_NS, live).expect("silent");
    let wanted_ns = 2 * (SILENCE_NS - SLEEP_NS_MAX);
    assert!((wanted_ns..=wanted_ns + SLEEP_NS_MAX + LOOK_NS).contains(&after_ns), "{after_ns}");
}

#[test]
fn one_look_after_a_long_time_proves_nothing() {
    let mut watched = Watched::new([WELL]);
    assert_eq!(watched.look_after(LONG_NS), []);
    assert_eq!(watched.look_after(LONG_NS), []);
}

#[test]
fn who_still_starts_is_given_longer() {
    let mut watched = Watched::new([Process { is_ready: false, ..WELL }]);
    let (after_ns, found) = watched.until_found(LONG_NS, |_| {}).expect("silent");
    assert_eq!((after_ns, found.len()), (START_SILENCE_NS, 1));
}

#[test]
fn a_successor_begins_anew_with_the_counter_that_it_found() {
    let mut watched = Watched::new([WELL]);
    watched.until_found(LONG_NS, |_| {}).expect("silent");
    watched.vigil.swept();
    watched.processes[0].incarnation = 1;
    let (after_ns, found) = watched.until_found(LONG_NS, |_| {}).expect("silent");
    // From the first look at it on.
    assert_eq!(after_ns, LOOK_NS + SILENCE_NS);
    let [Finding::Silent(Silence { incarnation, .. })] = found[..] else { panic!("{found:?}") };
    assert_eq!(incarnation, Incarnation(1));
}
