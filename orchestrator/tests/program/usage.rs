//! What is refused: exit code 2, one diagnostic with place and remedy, nothing started, nothing left.

use crate::invocation::{Finished, Place, program};

/// A correct mission; tests spoil one line of it.
const MISSION: &str = r#"[[craft]]
name = "orbiter"
initial = ["in-orbit"]

[[craft]]
name = "aerial"
parent = "orbiter"
final = ["seen"]

[[boundary]]
fact = "seen"
crafts = ["orbiter", "aerial"]

[[rule]]
craft = "orbiter"
if = ["in-orbit"]
then = ["seen"]
"#;

/// `words` are refused, and the diagnostic contains all of `needed`; line breaks in it count as blanks.
#[track_caller]
fn refused(place: &Place, words: &[&str], needed: &[&str]) -> Finished {
    check_refusal(place, place.run(words), needed)
}

#[track_caller]
fn check_refusal(place: &Place, finished: Finished, needed: &[&str]) -> Finished {
    let finished = finished.expect_code(2);
    assert_eq!(finished.stdout, "", "{finished}");
    let heads =
        finished.stderr.lines().filter(|line| line.contains('×') || line.starts_with("error: "));
    assert_eq!(heads.count(), 1, "one diagnostic: {finished}");
    let words: Vec<&str> = finished.stderr.split_whitespace().filter(|&word| word != "│").collect();
    let said = words.join(" ");
    for part in needed {
        assert!(said.contains(part), "`{part}` is missing: {finished}");
    }
    let too_wide = finished.stderr.lines().find(|line| line.chars().count() > 80);
    assert_eq!(too_wide, None, "{finished}");
    place.assert_nothing_left(&[]);
    assert!(!place.files().join("runs").exists(), "a results directory was made: {finished}");
    finished
}

/// The mission with `old` replaced by `new` is refused by `run` and `validate`, both at `line`.
#[track_caller]
fn spoiled(old: &str, new: &str, line: usize, needed: &[&str]) {
    let place = Place::new();
    assert!(MISSION.contains(old));
    place.write("mission.toml", &MISSION.replacen(old, new, 1));
    let source = format!("[mission.toml:{line}:");
    let needed: Vec<&str> = [source.as_str(), "help:"].iter().chain(needed).copied().collect();
    for verb in ["run", "validate", "simulate"] {
        refused(&place, &[verb, "mission.toml"], &needed);
    }
}

#[test]
fn the_mission_itself_runs() {
    let place = Place::for_fleets();
    place.write("mission.toml", MISSION);
    place.run(&["run", "mission.toml"]).expect_code(0);
}

#[test]
fn missing_file_is_named_and_the_nearest_preset_offered() {
    let place = Place::new();
    refused(&place, &["run", "mision.toml"], &["`mision.toml`", "help:", "show two-craft"]);
    refused(
        &place,
        &["run", "two-carft"],
        &["`two-carft`", "did you mean the preset `two-craft`?"],
    );
}

#[test]
fn broken_toml_is_shown() {
    spoiled("[[craft]]", "[[craft]", 1, &["not valid TOML"]);
}

#[test]
fn unknown_key_is_answered_with_the_nearest() {
    spoiled("parent =", "parrent =", 7, &["unknown key `parrent`", "did you mean `parent`?"]);
}

#[test]
fn wrong_type_is_named() {
    spoiled("initial = [\"in-orbit\"]", "initial = 7", 3, &["`initial` takes a list"]);
}

#[test]
fn rule_with_an_unknown_fact_is_refused() {
    spoiled("if = [\"in-orbit\"]", "if = [\"in-orbi\"]", 16, &["`in-orbi`", "`in-orbit`?"]);
}

#[test]
fn boundary_fact_needs_two_known_crafts() {
    spoiled("\"orbiter\", \"aerial\"]", "\"orbiter\"]", 12, &["two crafts or more"]);
    spoiled("\"orbiter\", \"aerial\"]", "\"orbiter\", \"arial\"]", 12, &["`arial`", "`aerial`?"]);
}

#[test]
fn tree_that_is_none_is_refused() {
    spoiled("initial =", "parent = \"aerial\"\ninitial =", 3, &["the tree has a cycle"]);
    let (last, end) = (MISSION.lines().count(), "then = [\"seen\"]\n");
    let lonely = format!("{end}[[craft]]\nname = \"ground\"\n");
    spoiled(end, &lonely, last + 2, &["the tree is disconnected"]);
}

#[test]
fn impossible_numbers_are_refused() {
    let last = MISSION.lines().count();
    let end = "then = [\"seen\"]\n";
    let with = |lines: &str| format!("{end}{lines}\n");
    spoiled(end, &with("[run]\nrate-per-s = 0"), last + 2, &["a rate of 0 is impossible"]);
    spoiled(end, &with("[link]\ndelay-ms = -1"), last + 2, &["a delay of -1 ms is impossible"]);
}

#[test]
fn fleets_of_no_crafts_and_of_too_many_are_refused() {
    let place = Place::new();
    refused(&place, &["compare", "--sizes", "0"], &["the fleet has no crafts", "help:"]);
    refused(&place, &["compare", "--sizes", "2,129"], &["129 crafts", "128", "run.mode"]);
    place.write("many.toml", "[network]\n[fleet]\ncrafts = 129\n");
    refused(&place, &["run", "many.toml"], &["[many.toml:3:10]", "129 crafts", "128", "help:"]);
    place.write("none.toml", "[network]\n[fleet]\ncrafts = 0\n");
    refused(&place, &["run", "none.toml"], &["[none.toml:3:10]", "no crafts", "help:"]);
}

#[test]
fn results_that_cannot_be_written_are_refused_before_the_start() {
    let place = Place::new();
    place.write("file", "");
    for out in ["file", "file/below", "/proc/nowhere"] {
        let needed = [out, "results cannot be written", "`--out DIR`"];
        refused(&place, &["run", "two-craft", "--out", out], &needed);
    }
}

#[test]
fn unknown_words_are_refused_with_what_is_known() {
    let place = Place::new();
    refused(&place, &["compare", "--strategies", "boundry"], &["boundry", "mean `boundary`?"]);
    refused(&place, &["compare", "--strategies", "xyz"], &["xyz", "boundary, limited"]);
    refused(&place, &["comparr"], &["'comparr'", "'compare'"]);
    refused(&place, &["compare", "--size", "2"], &["'--size'", "'--sizes'"]);
    refused(&place, &["run"], &["which scenario?", "`list`"]);
    refused(&place, &["reproduce", "table-26"], &["table-26", "table-1 to table-25"]);
    refused(&place, &["report", "nowhere"], &["`nowhere`", "runs/latest"]);
    refused(&place, &["run", "two-craft", "--set", "run.trails=3"], &["`trails`", "`trials`?"]);
    refused(&place, &["run", "two-craft", "--trials", "0"], &["--trials 0", "help:"]);
}

#[test]
fn agent_by_hand_is_refused() {
    let place = Place::new();
    let base = place.base();
    let living = ["--run", "000000000000002a", "--base", base.to_str().unwrap(), "--craft", "0"];
    let of_nobody = ["--crafts", "2", "--incarnation", "0", "--parent", "1", "--wake", "poll"];
    let whole = ["agent"].into_iter().chain(living).chain(of_nobody).chain(["--cores", ""]);
    for words in [vec!["agent"], whole.collect()] {
        let finished = place.run(&words).expect_code(2);
        assert_eq!(finished.stdout, "");
        assert_eq!(finished.stderr.lines().count(), 1, "{finished}");
        assert!(finished.stderr.contains("never by hand"), "{finished}");
        place.assert_nothing_left(&[]);
    }
}

#[test]
fn too_few_descriptors_are_refused_with_need_and_have() {
    let place = Place::new();
    let ours = place.command(&["run", "hierarchy-13"]);
    let mut limited = program("/bin/sh");
    limited.args(["-c", "ulimit -n 64 && exec \"$0\" \"$@\""]);
    limited.arg(ours.get_program()).args(ours.get_args()).current_dir(place.files());
    for (name, value) in ours.get_envs() {
        match value {
            Some(value) => limited.env(name, value),
            None => limited.env_remove(name),
        };
    }
    let finished = place.start_command(limited).finish();
    let needed = ["opens up to", "descriptors", "the hard limit allows 64", "`ulimit -Hn`"];
    check_refusal(&place, finished, &needed);
}

#[test]
fn base_of_somebody_else_is_refused() {
    let place = Place::new();
    std::os::unix::fs::symlink("/tmp", place.base()).unwrap();
    let finished = place.run(&["run", "two-craft"]).expect_code(2);
    std::fs::remove_file(place.base()).unwrap();
    assert!(finished.stderr.contains("SLATESWARM_SHM"), "{finished}");
    assert_eq!(finished.stdout, "");
}
