//! Every bound of the system, in one place. A bound that is exceeded is refused with the number
//! that was needed; nothing grows without one. Relations between bounds are checked at compile time.

/// Most crafts of a real fleet: one process each, all-to-all descriptors stay below what
/// `RLIMIT_NOFILE` usually allows. The centre of the central strategies comes on top.
pub const REAL_CRAFTS_MAX: u32 = 128;

/// Largest simulated fleet that tests cover.
pub const SIMULATED_CRAFTS_TESTED: u32 = 10_000;

/// Largest simulated fleet that is accepted.
pub const SIMULATED_CRAFTS_MAX: u32 = 100_000;

/// Fewest crafts of a fleet.
pub const CRAFTS_MIN: u32 = 1;

/// Most facts, rules or actions of one explicit board.
pub const BOARD_ITEMS_MAX: u32 = 1_000_000;

/// Least cost of a rule or action: with less, sums of many costs would swallow it.
pub const COST_MIN: f64 = 0.001;

/// Largest cost of a rule or action.
pub const COST_MAX: f64 = 1e6;

/// Least likelihood that an action brings about what it presumes.
pub const LIKELIHOOD_MIN: f64 = 0.001;

/// Most turns that an action takes.
pub const DURATION_TURNS_MAX: u32 = 1_000_000;

/// Facts, rules, actions and links of all boards together above which crafts do not plan: each of them
/// keeps the least cost of every fact of the fleet.
pub const PLANNED_ITEMS_MAX: u64 = 100_000;

/// Most turns of one trial, whatever the scenario says.
pub const TURNS_MAX: u32 = 1_000_000;

/// The published experiment drops trials that reach no final fact in this many turns.
pub const PUBLISHED_TURNS_MAX: u32 = 200;

/// Samples that a receiver's inbox holds before a sender is told that it is full.
pub const INBOX_SAMPLES: usize = 64;

/// Samples that the orchestrator's own inbox holds: every craft may report twice a turn.
pub const ORCHESTRATOR_INBOX_SAMPLES: usize = 1024;

/// Samples kept locally for one unicast destination whose inbox is full.
pub const OUTBOX_SAMPLES: usize = 256;

/// Ranges of missing numbers that one receiver remembers per service; an older one is a gap for good.
pub const HOLES_MAX: usize = 1024;

/// Samples that one call to drain hands over at most, so that nobody can be kept there.
pub const DRAIN_SAMPLES_MAX: usize = 4096;

/// Samples of one service that are handed over before the next service has its turn.
pub const DRAIN_BURST: usize = 64;

/// Samples that one process remembers so that it can repeat them; of older ones the state is told.
pub const RING_SAMPLES: usize = 1024;

/// Times that one sample is repeated at most: at 75 % loss one in a hundred million is lost for good.
pub const REPEATS_MAX: u32 = 64;

/// Ranges of missing numbers that one receipt names.
pub const MISSING_ROWS_MAX: usize = 64;

/// Numbers that one receipt has repeated at most; the rest is asked for again.
pub const REPEATS_PER_RECEIPT: u64 = 64;

/// Times that one thing is asked for without any progress, before it is given up.
pub const ASKS_MAX: u32 = 256;

/// Numbered samples from one source after which a receipt is sent at once.
pub const RECEIPT_SAMPLES: u32 = 32;

/// What a real process waits before it asks again for what it misses, ns: a way there and back where
/// processes wait for a core. Receipts come after half of it, a gap is named after an eighth.
pub const REAL_PATIENCE_NS: u64 = 10_000_000;

/// Every life writes versions from its number times this on, so that no two lives give out the same:
/// more than one life writes a fact.
pub const VERSIONS_PER_LIFE: u32 = 1 << 20;

/// Lives that one fleet may have besides its first ones.
pub const LIVES_MAX: u32 = u32::MAX / VERSIONS_PER_LIFE;

/// Longest sleep of a process, ns: within a second it must see that its orchestrator is gone.
pub const SLEEP_NS_MAX: u64 = 500_000_000;

/// How long a process waits for another that is making what both share, ns. Whoever stops waiting is never
/// connected, so it is long: making takes microseconds of a host that lets the other run, and what the
/// dead did not finish is swept meanwhile. Nobody is killed as silent before it has passed.
pub const CREATION_PATIENCE_NS: u64 = 3_000_000_000;

/// How long a process with a full outbox sleeps at most, ns: nobody rings when an inbox has room.
pub const OUTBOX_RETRY_NS: u64 = 1_000_000;

/// Samples of one publisher that may be loaned at once.
pub const LOANS: usize = 2;

/// Longest payload of an inbox or multicast sample, in bytes; longer messages go over `bulk`.
pub const INBOX_PAYLOAD_BYTES: usize = 64 * 1024;

/// Most padding that a record may be given, in bytes, beyond its own size.
pub const RECORD_PADDING_BYTES_MAX: u32 = 4096;

/// Most changes of one firing.
pub const CHANGES_PER_FIRING_MAX: usize = 1024;

/// Most links of all boundary facts of a mission together, one from each sharer to every other.
pub const SHARED_LINKS_MAX: u64 = 16_000_000;

/// Most premises of one rule: a byte counts those that are not met yet.
pub const PREMISES_MAX: u32 = 255;

/// Most cells of a sweep; each is a run with a directory of its own.
pub const SWEEP_CELLS_MAX: usize = 10_000;

/// Most changes per second of an offered load; above it times in nanoseconds coincide.
pub const RATE_PER_S_MAX: f64 = 1e9;

/// Most writes, and most reads, that a drawn trace has on average.
pub const TRACE_RECORDS_MAX: f64 = 2e7;

/// Longest stop of a process that a scenario states, s: an hour.
pub const STOP_S_MAX: f64 = 3_600.0;

/// Longest trial of a stated duration, in seconds: a year.
pub const DURATION_S_MAX: f64 = 31_536_000.0;

/// Most asking intervals of central strategies that one run measures.
pub const ASKING_INTERVALS_MAX: usize = 8;

/// Longest asking interval of a client of the centre, ms: an hour.
pub const ASKING_MS_MAX: f64 = 3_600_000.0;

/// Most `[[load]]` entries of a scenario.
pub const LOADS_MAX: usize = 100;

/// Longest window in which restarts of a craft are counted, in seconds: a day.
pub const RESTART_WINDOW_S_MAX: u32 = 86_400;

/// Largest share of all samples that a link may lose: repeats are bounded.
pub const LOSS_MAX: f64 = 0.9;

/// Longest delay of a link, in milliseconds: a day.
pub const DELAY_MS_MAX: f64 = 86_400_000.0;

/// Most outages of a scenario: with its largest groups they travel in one sample.
pub const OUTAGES_MAX: usize = 64;

/// Samples that links hold up before one real process at a time; what comes on top is lost.
pub const HELD_SAMPLES_MAX: usize = 4096;

/// Widest range of a radio, in metres: some hundred astronomical units.
pub const RANGE_M_MAX: f64 = 1e14;

/// Nothing propagates faster, in metres per second.
pub const SPEED_OF_LIGHT_M_PER_S: f64 = 299_792_458.0;

/// Most that a link carries, in bits per second.
pub const BANDWIDTH_BITS_PER_S_MAX: f64 = 1e15;

/// Requests that one craft of the `pipelined` central strategy may have in flight.
pub const PIPELINE_DEPTH: usize = 32;

/// Most slices of an interval of open mode that are kept apart; what comes after the last is in it.
pub const SLICES_MAX: u64 = 256;

/// Records of one due time that a craft of open mode plays before it looks at its inboxes again.
pub const DUE_TIMES_PER_STEP_MAX: usize = 16;

/// How long after the end of an interval a craft still makes what was due before it, ns. It covers a
/// craft that was not scheduled at the end; one with a longer queue of work is saturated.
pub const LATE_PLAY_NS: u64 = 20_000_000;

/// Bytes of a trial report that travel in one sample; longer reports travel in several.
pub const REPORT_PART_BYTES: usize = 48 * 1024;

/// Times that an idle process yields before it sleeps on its bell (adaptive wake-up).
pub const YIELDS_BEFORE_SLEEP: u32 = 20;

/// Shortest and longest prefix + root path that still fits a Unix socket address, in bytes.
pub const RUN_PATH_BYTES_MAX: usize = 60;

/// Descriptors that a run asks for at least, as soft limit.
pub const OPEN_FILES_MIN: u64 = 4096;

/// Largest fleet whose results are kept craft by craft; of larger ones the sums, and the crafts that
/// differ from the independent replay.
pub const CRAFTS_RECORDED_MAX: usize = 1024;

/// Most blocks of a run, fresh launches of each of its fleets.
pub const BLOCKS_MAX: u32 = 1000;

/// Fewest blocks, fresh launches of a fleet, with which a comparison of times names a winner.
pub const WINNER_BLOCKS_MIN: u32 = 9;

/// How much longer every turn of the control that is slowed down on purpose takes, percent.
pub const PLANTED_SLOWDOWN_PERCENT: u64 = 20;

/// Processors that others may keep busy on average while a block is measured, before it is noisy.
pub const FOREIGN_CORES_MAX: f64 = 0.1;

/// How much slower than the fastest of a run its fixed loop may be, before a block is noisy.
pub const SPIN_RATIO_MAX: f64 = 1.25;

/// Share of a core that the orchestrator may use in a measured interval of open mode, before its cell is
/// marked.
pub const ORCHESTRATOR_CORE_SHARE_MAX: f64 = 0.001;

/// Share of the applications that a trace needs which must be known by the end of the interval, else the
/// load is above capacity.
pub const APPLIED_SHARE_MIN: f64 = 0.999;

/// What is due so shortly before the end of an interval need not be known by it, ns: of the two seconds
/// for which capacity is defined, the share that may be missing.
pub const SETTLING_NS: u64 = 2_000_000;

/// 99th percentile of the schedule's lateness from which a load is above capacity, ns.
pub const LAG_P99_NS_MAX: u64 = 1_000_000;

/// Share of its time that the fixed loop may wait for a processor, before a block is noisy.
pub const SPIN_DELAY_SHARE_MAX: f64 = 0.1;

const _: () = assert!(REAL_CRAFTS_MAX < SIMULATED_CRAFTS_TESTED);
const _: () = assert!((REAL_CRAFTS_MAX as usize) < CRAFTS_RECORDED_MAX);
const _: () = assert!(SIMULATED_CRAFTS_TESTED <= SIMULATED_CRAFTS_MAX);
const _: () = assert!(PIPELINE_DEPTH < INBOX_SAMPLES);
const _: () = assert!(REPEATS_PER_RECEIPT <= INBOX_SAMPLES as u64);
const _: () =
    assert!(OUTAGES_MAX * (REAL_CRAFTS_MAX as usize * 4 + 64) < INBOX_PAYLOAD_BYTES / 4 * 3);
const _: () = assert!(REPEATS_MAX <= ASKS_MAX);
const _: () = assert!(REPORT_PART_BYTES <= INBOX_PAYLOAD_BYTES);
const _: () = assert!(PUBLISHED_TURNS_MAX <= TURNS_MAX);
