//! What is refused: the exact place, what is wrong, and the remedy.

use crate::scenario::{Base, ScenarioError, load, load_text};

/// A correct mission; rows replace one line of it.
const MISSION: &str = r#"[fleet]
wake = "poll"

[[craft]]
name = "orbiter"
tier = "orbital"
initial = ["in-orbit"]

[[craft]]
name = "aerial"
parent = "orbiter"
final = ["target-confirmed"]

[[boundary]]
fact = "target-seen"
crafts = ["orbiter", "aerial"]

[[rule]]
craft = "orbiter"
if = ["in-orbit"]
run = ["take-image"]

[[action]]
craft = "orbiter"
name = "take-image"
then = ["target-seen"]

[[rule]]
craft = "aerial"
if = ["target-seen"]
then = ["target-confirmed"]
"#;

pub(super) fn refused(text: &str) -> ScenarioError {
    match load_text("mission.toml", text, &[]) {
        Ok(_) => panic!("accepted:\n{text}"),
        Err(error) => error,
    }
}

/// `text` is refused at `place` (line:column), and message and remedy contain what is given.
#[track_caller]
fn check(text: &str, place: &str, message: &str, remedy: &str) {
    let error = refused(text);
    let position = error.position().unwrap_or_else(|| panic!("no place: {error}"));
    assert_eq!(position.source, "mission.toml");
    assert_eq!(format!("{}:{}", position.line, position.column), place, "{error}");
    assert!(error.message().contains(message), "message: {error}");
    let found = error.remedy().unwrap_or_default();
    assert!(found.contains(remedy), "{error}\nremedy: {found}");
}

/// Checks one edit of the mission a row: `old => new | place | message | remedy`, or `+ lines` that
/// are added below it, whose place counts from the first of them. `\n` is a line break.
#[track_caller]
fn check_rows(rows: &str) {
    for row in rows.lines().filter(|row| !row.is_empty()) {
        let [edit, place, message, remedy] = *row.split(" | ").collect::<Vec<_>>() else {
            panic!("not a row: {row}")
        };
        let edit = edit.replace("\\n", "\n");
        if let Some(lines) = edit.strip_prefix("+ ") {
            let (line, column) = place.split_once(':').unwrap();
            let line = line.parse::<usize>().unwrap() + MISSION.lines().count();
            let text = format!("{MISSION}{lines}\n");
            check(&text, &format!("{line}:{column}"), message, remedy.trim());
        } else {
            let (old, new) = edit.split_once(" => ").unwrap();
            assert!(MISSION.contains(old), "the mission has no {old}");
            check(&MISSION.replacen(old, new, 1), place, message, remedy.trim());
        }
    }
}

#[test]
fn the_mission_itself_is_accepted() {
    load_text("mission.toml", MISSION, &[]).unwrap();
}

#[test]
fn unreadable_files_are_named() {
    let error = load(&Base::from_argument("no-such-mission.toml"), [], &[]).unwrap_err();
    assert_eq!(error.message(), "there is no scenario file `no-such-mission.toml`");
    assert!(error.remedy().unwrap().contains("`two-craft`"));
    let error = load(&Base::from_argument("two-carft"), [], &[]).unwrap_err();
    assert_eq!(error.remedy(), Some("did you mean the preset `two-craft`?"));
    let error = load(&Base::Preset("spars".to_owned()), [], &[]).unwrap_err();
    assert_eq!(error.remedy(), Some("did you mean `sparse`?"));
    let directory = tempfile::tempdir().unwrap();
    let error = load(&Base::File(directory.path().to_owned()), [], &[]).unwrap_err();
    assert!(error.message().contains("is a directory"), "{error}");
    let binary = directory.path().join("binary.toml");
    std::fs::write(&binary, [0xff, 0xfe, 0x00]).unwrap();
    let error = load(&Base::File(binary), [], &[]).unwrap_err();
    assert!(error.message().contains("is not a text in UTF-8"), "{error}");
}

#[test]
fn broken_toml() {
    check_rows(
        r#"
wake = "poll" => wake = poll | 2:8 | not valid TOML | double quotes
wake = "poll" => wake | 2:5 | not valid TOML | key = value
[fleet] => [fleet | 1:7 | not valid TOML | [run]
tier = => name = | 6:1 | duplicate key | once
"#,
    );
    check("[fleet]\ncrafts = 3\n[fleet]\ncores = 1\n", "3:2", "duplicate key", "once");
    check("[[rule]]\nif = [\"a\"\n", "2:10", "not valid TOML", "");
}

#[test]
fn unknown_keys() {
    check_rows(
        r#"
wake = => weke = | 2:1 | unknown key `weke` in `fleet` | did you mean `wake`?
if = => where = | 20:1 | unknown key `where` in `rule` | keys here: `name`
parent = => parrent = | 11:1 | unknown key `parrent` | `parent`?
[fleet] => [flet] | 1:2 | unknown key `flet` in the scenario | `fleet`?
+ [link.from-positions]\nrange-m = 1\nspeed = 2 | 3:1 | `speed` | `range-m`
+ [run]\nturn_limit_ms = 3 | 2:1 | `turn_limit_ms` | `turn-limit-ms`?
"#,
    );
    check(
        "fleet.crafts = { orbit = 1 }\n",
        "1:18",
        "unknown key `orbit`",
        "did you mean `orbital`?",
    );
}

#[test]
fn wrong_types_and_values() {
    check_rows(
        r#"
+ [run]\nturns = "many" | 2:9 | takes a whole number | Most turns of one trial
+ [run]\nturns = -3 | 2:9 | got the number -3 | `run.turns`
+ [run]\nturns = 2.5 | 2:9 | got the number 2.5 | `run.turns`
+ [run]\nmode = "lockstp" | 2:8 | unknown value `lockstp` | `lockstep`?
tier = "orbital" => tier = "space" | 6:8 | `space` | `orbital`, `aerial`
if = ["in-orbit"] => if = "in-orbit" | 20:6 | `if` takes a list | premises
initial = ["in-orbit"] => initial = [3] | 7:12 | takes a text | 
name = "orbiter"\n =>  | 4:1 | lacks the key `name` | unique in the fleet
+ [[action]]\nname = "x" | 1:1 | lacks the key `then` | asserts
+ [link]\nloss = true | 2:8 | `loss` takes a number, got `true` | lost
parent = "orbiter" => position = [1, 2] | 11:12 | three numbers | metres
"#,
    );
    check("fleet.crafts = -1\n", "1:16", "a number of crafts", "Crafts as a number");
    check("fleet.crafts = \"ten\"\n", "1:16", "a number of crafts", "Crafts as a number");
    check("fleet = 3\n", "1:9", "`fleet` takes a table of keys", "How many crafts");
}

#[test]
fn names_that_mean_nothing() {
    check_rows(
        r#"
if = ["target-seen"] => if = ["target-sen"] | 30:7 | `aerial` has no fact `target-sen` | did you mean `target-seen`?
if = ["target-seen"] => if = ["target-seen", "in-orbit"] | 30:22 | no fact `in-orbit` | `orbiter` has it; share it
if = ["target-seen"] => if = ["fuel"] | 30:7 | no fact `fuel` | put it into `initial`
if = ["target-seen"] => if = ["!target-seen"] | 30:7 | nothing ever de-asserts | `!target-seen` into a `then`
final = ["target-confirmed"] => final = ["confirmed"] | 12:10 | no fact `confirmed` | facts of `aerial`
final = ["target-confirmed"] => final = ["!target-seen"] | 12:10 | cannot be final | asserted
initial = ["in-orbit"] => initial = ["!in-orbit"] | 7:12 | cannot stand in `initial` | unknown
run = ["take-image"] => run = ["take-imag"] | 21:8 | `orbiter` has no action `take-imag` | `take-image`?
craft = "aerial" => craft = "arial" | 29:9 | no craft `arial` | did you mean `aerial`?
craft = "aerial" => craft = ["aerial", "x"] | 29:20 | no craft `x` | crafts: `orbiter`, `aerial`
craft = "aerial" => craft = ["aerial", "aerial"] | 29:20 | named twice | keep one
craft = "aerial" => craft = [] | 29:9 | a list of no crafts | leave `craft` out
craft = "aerial" => tier = "aerial" | 29:8 | no craft is of this tier | `ground`
craft = "aerial" => craft = "aerial"\ntier = "ground" | 30:8 | both `craft` and `tier` | keep one
if = ["target-seen"] => if = [] | 30:6 | a rule of 0 premises | initial
then = ["target-confirmed"]\n =>  | 28:1 | a rule that does nothing | `then`
then = ["target-seen"] => then = [] | 26:8 | an action without an outcome | then
then = ["target-confirmed"] => then = ["a", "!a"] | 31:14 | `a` stands twice | keep one
then = ["target-confirmed"] => then = ["a b"] | 31:9 | cannot name a fact | letters
+ [[action]]\nname = "take-image"\nthen = ["x"] | 2:8 | two actions called | rename
name = "aerial" => name = "orbiter" | 10:8 | two crafts are called `orbiter` | rename one
name = "aerial" => name = "air.1" | 10:8 | cannot name a craft | letters, digits
"#,
    );
}

#[test]
fn boundaries_that_share_nothing() {
    check_rows(
        r#"
crafts = ["orbiter", "aerial"] => crafts = ["orbiter"] | 16:10 | needs two crafts or more | name every craft
crafts = ["orbiter", "aerial"] => crafts = [] | 16:10 | needs two crafts or more | name every craft
crafts = ["orbiter", "aerial"] => crafts = ["orbiter", "arial"] | 16:22 | no craft `arial` | `aerial`?
crafts = ["orbiter", "aerial"] => crafts = ["orbiter", "orbiter"] | 16:22 | `orbiter` is named twice | once
fact = "target-seen" => fact = "!target-seen" | 15:8 | without `!` | `target-seen`
fact = "target-seen"\n =>  | 14:1 | a boundary without a fact | link = [
+ [[boundary]]\nfact = "target-seen" | 2:8 | already shares `target-seen` by boundary 0 | one [[boundary]]
+ [[boundary]]\nfact = "fog" | 1:1 | ever asserts it | `initial`
+ [[boundary]]\nlink = ["orbiter.a"] | 2:8 | needs two crafts or more | name every craft
+ [[boundary]]\nlink = ["orbiter.a", "aerial"] | 2:22 | names no craft and fact | `orbiter.target`
+ [[boundary]]\nlink = ["orbiter.a", "arial.b"] | 2:22 | no craft `arial` | `aerial`?
+ [[boundary]]\nlink = ["orbiter.a", "aerial.b"]\nfact = "c" | 2:8 | both `fact` and `link` | same
+ [[boundary]]\nlink = ["orbiter.a", "aerial.b"]\ncrafts = [] | 3:10 | `crafts` beside `link` | out
"#,
    );
}

#[test]
fn a_fact_shared_by_too_many_is_refused_with_the_links_it_needs() {
    let text = "run.mode = \"simulated\"\nfleet.crafts = 5000\n[[boundary]]\nfact = \"x\"\n\
                [[rule]]\nif = [\"x\"]\nthen = [\"x\"]\n";
    check(text, "3:1", "24995000 links", "at most 16000000");
}

#[test]
fn fleets_that_cannot_fly() {
    check_rows(
        r#"
wake = "poll" => crafts = 3 | 2:10 | [[craft]] lists 2 | leave `fleet.crafts` out
"#,
    );
    let generated = |fleet: &str| format!("[network]\n[fleet]\n{fleet}\n");
    check(&generated("crafts = 0"), "3:10", "the fleet has no crafts", "fleet.crafts = 10");
    check(&generated("crafts = {}"), "3:1", "the fleet has no crafts", "fleet.crafts = 10");
    check(&generated("crafts = 129"), "3:10", "129 crafts are more than the 128", "run.mode");
    check(&generated("crafts = 100001"), "3:10", "more than the 100000", "at most 100000");
    check(&generated("cores = 0\ncrafts = 2"), "3:9", "no cores", "at least 1");
    let simulated = "run.mode = \"simulated\"\nfleet.crafts = 200\nnetwork.links = 3\n";
    check(simulated, "3:1", "links every pair", "sparse");
    check("[network]\n", "1:1", "the fleet has no crafts", "fleet.crafts");
    let shared = "fleet.crafts = 128\n[network]\nlinking = \"shared\"\nboundary-fraction = 1\n";
    check(&format!("{shared}sharers = 127\n"), "5:11", "need 16256000 links", "at most 16000000");
}

#[test]
fn trees_that_are_none() {
    check_rows(
        r#"
tier = "orbital" => parent = "aerial" | 6:10 | the tree has a cycle | no parent
parent = "orbiter" => parent = "aerial" | 11:10 | the tree has a cycle | circle
parent = "orbiter" => parent = "obiter" | 11:10 | no craft `obiter` | `orbiter`?
+ [[craft]]\nname = "ground" | 2:8 | the tree is disconnected: 2 crafts | parent = "orbiter"
tier = "orbital" => group = "up" | 10:8 | `aerial` has no group, but `orbiter` has | every craft
"#,
    );
    check(
        &format!("{MISSION}[topology]\ntree = \"star\"\n"),
        "11:10",
        "the tree is not `listed`",
        "topology.tree",
    );
    check(
        "fleet.crafts = 3\ntopology.tree = \"listed\"\n[network]\n",
        "2:17",
        "nobody lists a parent",
        "`binary`",
    );
    check(
        "fleet.crafts = 3\ntopology.group-size = 0\n[network]\n",
        "2:23",
        "groups of no crafts",
        "at least 1",
    );
}

#[test]
fn strategies_that_cannot_be_run() {
    check_rows(
        r#"
+ [replication]\nstrategies = [] | 2:14 | no strategy is chosen | `boundary`
+ [replication]\nstrategy = "boundry" | 2:12 | unknown value `boundry` | `boundary`?
+ [replication]\nstrategies = ["full", "ful"] | 2:23 | `ful` | `full`?
+ [replication]\nstrategies = ["full", "null", "full"] | 2:31 | chosen twice | keep one
+ [replication]\nstrategies = ["full", "hybrid"] | 2:23 | `hybrid` needs groups | group-size
+ [replication]\nstrategy = "full"\nstrategies = ["null"] | 2:1 | given twice | keep one
+ [replication]\nrecord-bytes = 15 | 2:16 | a record of 15 bytes | 16 bytes
+ [replication]\nrecord-bytes = 5000 | 2:16 | a record of 5000 bytes | at most 4112
"#,
    );
}

#[test]
fn numbers_out_of_bounds() {
    check_rows(
        r#"
+ [run]\nturns = 0 | 2:9 | `run.turns` is 0 | use 1 to 1000000
+ [run]\nturns = 1000001 | 2:9 | `run.turns` is 1000001 | use 1 to 1000000
+ [run]\nblocks = 0 | 2:10 | `run.blocks` is 0 | use 1 to 1000
+ [run]\ntrials = 0 | 2:10 | `run.trials` is 0 | use 1
+ [run]\nseed = -1 | 2:8 | `seed` takes a whole number | seed of everything
+ [run]\nturn-limit-ms = 0 | 2:17 | `run.turn-limit-ms` is 0 | use 1
+ [run]\nmode = "open" | 2:8 | open mode without a rate | `run.rate-per-s`
+ [run]\nmode = "open"\nrate-per-s = 5 | 2:8 | nothing says how long | `run.duration-s`
+ [[load]]\nname = "a"\nrate-per-s = 5 | 1:3 | nothing says how long | `run.duration-s`
+ [[load]]\nname = "a"\nrate-per-s = 0 | 3:14 | a rate of 0 is impossible | more than 0
+ [[load]]\nname = " "\nrate-per-s = 5 | 2:8 | a load without a name | tables
+ [[load]]\nname = "a"\nrate-per-s = 5\n[[load]]\nname = "a"\nrate-per-s = 6 | 5:8 | two loads are called `a` | its own
+ [[load]]\nname = "a"\nrate-per-s = 5\nstrategies = "pull" | 4:14 | `pull` | `push`
+ [run]\nduration-s = 1\n[trace]\nfile = "t"\n[[load]]\nname = "a"\nrate-per-s = 5 | 5:3 | beside `trace.file` | leave out one
+ [run]\nduration-s = 21\n[[load]]\nname = "a"\nrate-per-s = 1e6 | 2:14 | a trace of 21000000 events | shorten one
+ [run]\nasks-every-ms = [] | 2:17 | 0 asking intervals | [1, 3, 10]
+ [run]\nasks-every-ms = [1, 0] | 2:21 | a pause of 0 is impossible | more than 0
+ [run]\nasks-every-ms = [1, 1] | 2:21 | stated twice | keep one
+ [run]\nrate-per-s = 0 | 2:14 | a rate of 0 is impossible | more than 0
+ [run]\nrate-per-s = -5 | 2:14 | a rate of -5 is impossible | more than 0
+ [run]\nrate-per-s = inf | 2:14 | a rate of inf is impossible | more than 0
+ [run]\nrate-per-s = 1e6\nduration-s = 21 | 3:14 | a trace of 21000000 events | shorten one
+ [trace]\nburst = 0 | 2:9 | bursts of 0 | use 1 to 1024
+ [trace]\nboundary-fraction = -0.1 | 2:21 | a boundary fraction of -0.1 | a share
+ [trace]\nboundary-fraction = nan | 2:21 | a boundary fraction of NaN | a share
+ [trace]\nsharers = 2 | 2:11 | without a boundary fraction | as well
+ [trace]\nboundary-fraction = 1\nsharers = 0 | 3:11 | nobody shares | at least 1
+ [trace]\nreads-per-s = -1 | 2:15 | -1 reads | use 0 to
+ [run]\nduration-s = nan | 2:14 | a duration of NaN is impossible | more than 0
+ [link]\ndelay-ms = -1 | 2:12 | a delay of -1 ms is impossible | use 0 to
+ [link]\nloss = 1.5 | 2:8 | a loss of 1.5 is impossible | a share
+ [link]\nloss = -0.1 | 2:8 | a loss of -0.1 is impossible | a share
+ [link]\nloss = nan | 2:8 | a loss of NaN is impossible | a share
+ [link]\nduplication = 1.5 | 2:15 | a duplication of 1.5 is impossible | a share
+ [link]\njitter-ms = -1 | 2:13 | a jitter of -1 ms is impossible | use 0 to
+ [link]\njitter-ms = nan | 2:13 | a jitter of NaN ms is impossible | use 0 to
+ [link]\nbandwidth-bits-per-s = 0 | 2:24 | a bandwidth of 0 | bits per second
+ [link]\nfrom-positions = { range-m = -1 } | 2:30 | a range of -1 | metres
"#,
    );
    for (setting, column, message, remedy) in [
        ("facts = 0", 9, "a board of 0 facts", "use 1 to"),
        ("initial = 950", 11, "1050 initial and final facts of 1000", "at least 1050"),
        ("premises-min = 4", 16, "rules of 4 to 3 premises", "which is 3"),
        ("premises-max = 300", 16, "up to 300 premises", "at most 255"),
        ("linking = \"sparse\"\ndegree = 0", 10, "without neighbours", "at least 1"),
        ("linking = \"spars\"", 11, "`spars`", "`sparse`?"),
        ("linking = \"shared\"\nsharers = 0", 11, "shared with 0 others of 4", "use 1 to 3"),
        ("linking = \"shared\"\nsharers = 4", 11, "shared with 4 others of 4", "use 1 to 3"),
        ("linking = \"shared\"\nboundary-fraction = 1.1", 21, "fraction of 1.1", "a share"),
        ("linking = \"shared\"\nboundary-fraction = nan", 21, "fraction of NaN", "a share"),
    ] {
        let line = 3 + setting.matches('\n').count();
        let text = format!("fleet.crafts = 4\n[network]\n{setting}\n");
        check(&text, &format!("{line}:{column}"), message, remedy);
    }
}

#[test]
fn crafts_that_must_communicate_out_of_range() {
    let positions = MISSION
        .replace("name = \"orbiter\"", "name = \"orbiter\"\nposition = [0, 0, 400000]")
        .replace("name = \"aerial\"", "name = \"aerial\"\nposition = [30000, 0, 0]");
    let with_range = |range: u32| format!("{positions}[link.from-positions]\nrange-m = {range}\n");
    check(
        &with_range(1000),
        "16:1",
        "`orbiter` and `aerial` share a boundary fact but are out of range",
        "raise it to 401124",
    );
    load_text("mission.toml", &with_range(401_124), &[]).unwrap();
    let unshared = with_range(1000)
        .replace("crafts = [\"orbiter\", \"aerial\"]", "")
        .replace("fact = \"target-seen\"", "link = [\"orbiter.target-seen\", \"far.target-seen\"]");
    let unshared = format!("{unshared}[[craft]]\nname = \"far\"\nparent = \"orbiter\"\n");
    check(&unshared, "37:8", "`far` has no position", "position = [x, y, z]");
}

#[test]
fn outages_and_faults_of_nobody() {
    check_rows(
        r#"
+ [[link.outages]]\ncraft = "arial"\nfrom-ms = 1\nuntil-ms = 2 | 2:9 | no craft `arial` | `aerial`?
+ [[link.outages]]\ncraft = "aerial"\nfrom-ms = 2\nuntil-ms = 2 | 4:12 | ends before it begins | more than
+ [[link.outages]]\ncraft = "aerial"\nfrom-ms = -1\nuntil-ms = 2 | 3:11 | a time of -1 ms | start of a trial
+ [[link.outages]]\ncraft = []\nfrom-ms = 1\nuntil-ms = 2 | 2:9 | an outage of nobody | at least one
+ [[link.outages]]\nfrom-ms = 1\nuntil-ms = 2 | 1:1 | an outage of nobody | between = ["a", "b"]
+ [[link.outages]]\nbetween = ["aerial", "arial"]\nfrom-ms = 1\nuntil-ms = 2 | 2:11 | no craft `arial` | `aerial`?
+ [[link.outages]]\nbetween = ["aerial", "aerial"]\nfrom-ms = 1\nuntil-ms = 2 | 2:11 | no link to itself | two crafts
+ [[link.outages]]\ncraft = "aerial"\nbetween = ["aerial", "orbiter"]\nfrom-ms = 1\nuntil-ms = 2 | 3:11 | a craft and of a link | leave out
+ [[faults.process]]\ncraft = "arial"\nat-turn = 1 | 2:9 | no craft `arial` | `aerial`?
+ [[faults.process]]\ncraft = "aerial"\nat-turn = 200 | 3:11 | turn 200 never comes | run.turns
+ [[faults.process]]\ncraft = "aerial" | 1:1 | fails at no time | at-turn
+ [[faults.process]]\ncraft = "aerial"\nat-turn = 1\nat-s = 0.1 | 4:8 | both a turn and a time | keep one
+ [[faults.process]]\ncraft = "aerial"\nat-s = 0.1 | 3:8 | no interval of open mode | at-turn
+ [[faults.process]]\ncraft = "aerial"\nat-turn = 1\ndo = "stop" | 4:6 | stopped without an end | for-s
+ [[faults.process]]\ncraft = "aerial"\nat-turn = 1\nfor-s = 1.0 | 4:9 | does not go on | do = "stop"
+ [[faults.process]]\ncraft = "aerial"\nat-turn = 1\ndo = "stop"\nfor-s = 0.0 | 5:9 | a stop of 0 s | above 0
"#,
    );
}

#[test]
fn rules_that_rest_on_nothing() {
    check_rows(
        r#"
initial = ["in-orbit"]\n =>  | 19:7 | `orbiter` has no fact `in-orbit` | put it into `initial`
"#,
    );
}

/// Crafts that wait for each other: everything can be asserted by something, and nothing ever is.
#[test]
fn circles_of_rules_that_nothing_starts() {
    let circle = "[[craft]]\nname = \"a\"\nfinal = [\"done\"]\n[[rule]]\nif = [\"go\"]\nthen = [\"ready\"]\n\
                  [[rule]]\nif = [\"ready\"]\nthen = [\"go\", \"done\"]\n";
    check(circle, "4:3", "no rule can ever fire", "`initial`");
    let other = "[[rule]]\nif = [\"up\"]\nthen = [\"seen\"]\n";
    let circle = circle.replace("final", "initial = [\"up\"]\nfinal");
    check(&format!("{circle}{other}"), "4:10", "`done` can never be reached on `a`", "no chain");
    let scenario = load_text(
        "mission.toml",
        &format!("{circle}{other}").replace("final = [\"done\"]\n", ""),
        &[],
    );
    assert_eq!(
        scenario.unwrap().notices(),
        [
            "mission.toml:4:1: the rule `if go then ready` of `a` can never fire; no chain leads to \
             all its premises; assert them or remove it",
            "mission.toml:7:1: the rule `if ready then go, done` of `a` can never fire; no chain \
             leads to all its premises; assert them or remove it"
        ]
    );
}

/// What `text` is told of, one notice a line.
fn told(text: &str) -> String {
    load_text("mission.toml", text, &[]).unwrap().notices().join("\n")
}

#[test]
fn odd_rules_are_told_with_their_place_and_a_remedy() {
    let with = |lines: &str| told(&format!("{MISSION}{lines}\n"));
    assert_eq!(told(MISSION), "");
    let own = with("[[rule]]\ncraft = \"orbiter\"\nif = [\"in-orbit\"]\nthen = [\"in-orbit\"]");
    assert!(own.contains("mission.toml:32:1: the rule `if in-orbit then in-orbit`"), "{own}");
    assert!(own.contains("triggers itself by `in-orbit`"), "{own}");
    // Through an action as well.
    let action = "[[rule]]\ncraft = \"orbiter\"\nif = [\"target-seen\"]\nrun = [\"take-image\"]";
    assert!(with(action).contains("triggers itself by `target-seen`"));
    let endless = "[[rule]]\nif = [\"target-seen\"]\nthen = [\"x\"]\nrepeat = true";
    let endless = with(endless);
    assert!(endless.contains("of `orbiter` and another craft repeats and may"), "{endless}");
    assert!(endless.contains("drop `repeat`"), "{endless}");
    let ending = "[[rule]]\nif = [\"target-seen\"]\nthen = [\"!target-seen\"]\nrepeat = true";
    assert_eq!(with(ending), "");
    let twice =
        "[[rule]]\ncraft = \"aerial\"\nif = [\"target-seen\"]\nthen = [\"target-confirmed\"]";
    assert!(with(twice).contains("stands twice; remove one"));
    let idle = with("[[action]]\ncraft = \"aerial\"\nname = \"land\"\nthen = [\"landed\"]");
    assert!(idle.contains("32:1: no rule of `aerial` runs the action `land`"), "{idle}");
}

#[test]
fn costs_and_names_that_are_none() {
    check_rows(
        r#"
run = ["take-image"] => run = ["take-image"]\ncost = -1 | 22:8 | a cost of -1 is impossible | 0.001 to 1000000
run = ["take-image"] => run = ["take-image"]\ncost = nan | 22:8 | a cost of NaN | 0.001 to 1000000
run = ["take-image"] => run = ["take-image"]\ncost = inf | 22:8 | a cost of inf | 0.001 to 1000000
then = ["target-seen"] => then = ["target-seen"]\nlikelihood = 0 | 27:14 | a likelihood of 0 | 0.001 to 1
then = ["target-seen"] => then = ["target-seen"]\nlikelihood = 1.5 | 27:14 | a likelihood of 1.5 | 0.001 to 1
then = ["target-seen"] => then = ["target-seen"]\nduration = 0 | 27:12 | a duration of 0 turns | 1 to 1000000
then = ["target-seen"] => then = ["target-seen"]\ncost = 0 | 27:8 | a cost of 0 | leave it out
then = ["target-seen"] => then = ["target-seen"]\ncost = "dear" | 27:8 | takes a number | plan
+ [[rule]]\nname = "r"\nif = ["target-seen"]\nthen = ["x"]\n[[rule]]\nname = "r"\nif = ["x"]\nthen = ["y"] | 6:8 | `orbiter` has two rules called `r` | rename
"#,
    );
}

#[test]
fn thinking_that_cannot_be_done() {
    check_rows(
        r#"
+ [reasoning]\npolicy = "best" | 2:10 | unknown value `best` | `best-path`
+ [reasoning]\nmaintain-every-turns = 2\nmaintain-items = 0 | 3:18 | looks at nothing | at least 1
final = ["target-confirmed"]\n => \n[reasoning]\npolicy = "best-path"\n | 14:10 | nothing is final | `naive`
"#,
    );
    let many = "fleet.crafts = 100\n[network]\n[reasoning]\npolicy = \"best-path\"\n";
    check(many, "4:10", "400000 facts, rules, actions and links", "at most 100000");
    let central = "[reasoning]\nprune-every-turns = 1\n[replication]\nstrategy = \"central\"\n";
    assert!(told(&format!("{MISSION}{central}")).contains("under `central` they have none"));
    let open = "[reasoning]\npolicy = \"naive\"\n[run]\nmode = \"open\"\nrate-per-s = 10\nduration-s = 1\n";
    assert!(told(&format!("{MISSION}{open}")).contains("no rule runs in mode `open`"));
}

/// A network may turn in a circle for ever; a trial of it ends with its turns.
#[test]
fn a_cyclic_mission_is_accepted_and_ends() {
    let text = "[[craft]]\nname = \"a\"\ninitial = [\"on\"]\n[[rule]]\nif = [\"on\"]\n\
                then = [\"!on\", \"off\"]\nrepeat = true\n[[rule]]\nif = [\"off\"]\n\
                then = [\"!off\", \"on\"]\nrepeat = true\n";
    let scenario = load_text("mission.toml", text, &[]).unwrap();
    let mut network = shared_types::knowledge::FleetNetwork::default();
    crate::scenario::compile(&scenario, 1, 0, &mut network);
    let spec = scenario.epoch_spec(shared_types::wire::StrategyKind::Boundary, 0);
    let replay = agent::oracle::Replay::of(&network.view(), &spec);
    assert_eq!((replay.turns, replay.outcome), (200, agent::lockstep::Outcome::Dropped));
}

#[test]
fn scenarios_that_say_nothing_or_too_much() {
    check("", "1:1", "the scenario has no rules", "show two-craft");
    check(
        "[[craft]]\nname = \"a\"\n[[action]]\nname = \"x\"\nthen = [\"y\"]\n",
        "1:1",
        "no rules",
        "",
    );
    check(
        &format!("{MISSION}[network]\n"),
        "18:3",
        "networks are generated or written out",
        "remove [network]",
    );
    check(
        "[network]\n[[craft]]\nname = \"a\"\ninitial = [\"b\"]\n",
        "3:8",
        "beside [network]",
        "remove `initial`",
    );
}

#[test]
fn a_rendered_error_shows_the_line_and_the_remedy_and_fits_narrow_terminals() {
    let error = refused(&MISSION.replacen("wake =", "weke =", 1));
    let theme = miette::GraphicalTheme::unicode_nocolor();
    for width in [40, 80] {
        let mut rendered = String::new();
        miette::GraphicalReportHandler::new_themed(theme.clone())
            .with_width(width)
            .render_report(&mut rendered, &error)
            .unwrap();
        assert!(rendered.contains("mission.toml:2:1"), "{rendered}");
        assert!(rendered.contains("weke = \"poll\""), "{rendered}");
        assert!(rendered.contains("did you mean"), "{rendered}");
        assert!(rendered.lines().all(|line| line.chars().count() <= width), "{rendered}");
    }
}
