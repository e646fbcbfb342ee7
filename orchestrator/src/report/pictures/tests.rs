//! Pictures of made-up runs: what is in them, and that none fails on what is missing.

use super::gallery;
use super::map::{headline, map};
use crate::report::compare::PublishedMean;
use crate::report::map::text;
use crate::report::svg::picture::Picture;
use crate::report::table::{Colour, WIDTH};
use crate::results::figure::Figure;
use crate::results::inference::Verdict;
use crate::results::load::Saturation;
use crate::results::map::{Choice, Map, MapCell};
use crate::results::read::{RunData, read_run};
use crate::results::sample::{leave_blocks, leave_loads, leave_run};
use crate::results::summary::Summary;
use shared_types::wire::StrategyKind;
use std::path::Path;

fn texts(picture: &Picture) -> Vec<String> {
    let text = picture.document();
    let document = roxmltree::Document::parse(&text).expect("well-formed XML");
    let nodes = document.descendants().filter(|node| node.has_tag_name("text"));
    nodes.filter_map(|node| node.text().map(str::to_owned)).collect()
}

fn has(picture: &Picture, words: &str) -> bool {
    texts(picture).join(" ").contains(words)
}

fn published() -> Vec<PublishedMean> {
    let mean = |strategy, is_explained| PublishedMean {
        size: 2,
        strategy,
        figure: Figure::count(Some(13.8), 10, "request", "published mean"),
        is_explained,
    };
    vec![mean(StrategyKind::Full, true), mean(StrategyKind::Limited, false)]
}

fn pictures_of(directory: &Path) -> Vec<Picture> {
    let run = read_run(directory).unwrap();
    gallery(&run, &Summary::of(&run), &published())
}

#[test]
fn a_comparison_has_turn_times_and_requests() {
    let place = tempfile::tempdir().unwrap();
    leave_run(place.path(), &[2, 10]);
    let pictures = pictures_of(place.path());
    let names: Vec<&str> = pictures.iter().map(|picture| picture.name.as_str()).collect();
    assert_eq!(names, ["turn-time", "requests"]);
    assert!(has(&pictures[0], "null") && has(&pictures[0], "central-batched"));
    assert!(has(&pictures[0], "No intervals"));
    let requests = &pictures[1];
    assert!(has(requests, "Table 25") && has(requests, "limited at 2 crafts: source inconsistent"));
    let hollow = requests.document().matches("hollow s-full").count();
    assert_eq!(hollow, 1, "one published mean of full");
}

#[test]
fn intervals_over_blocks_are_drawn() {
    let place = tempfile::tempdir().unwrap();
    leave_blocks(place.path(), 1, 4, 1.5);
    let pictures = pictures_of(place.path());
    assert!(has(&pictures[0], "95 % interval over blocks"));
    assert!(pictures[0].document().contains("whisker s-full"));
    assert!(has(&pictures[0], "from 4 fresh fleets"));
}

#[test]
fn a_run_cut_at_any_byte_still_has_its_pictures() {
    for leave in
        [|place: &Path| leave_run(place, &[2]), |place: &Path| leave_loads(place, 1, 2, 500, 1.2)]
    {
        let whole = tempfile::tempdir().unwrap();
        leave(whole.path());
        cut_everywhere(&whole);
    }
}

/// Cuts each file of `whole` at several bytes and draws what is left.
fn cut_everywhere(whole: &tempfile::TempDir) {
    let files: Vec<_> =
        std::fs::read_dir(whole.path()).unwrap().map(|entry| entry.unwrap().path()).collect();
    for file in &files {
        let bytes = std::fs::read(file).unwrap();
        for share in [0, 1, 37, 80, 99] {
            let cut = tempfile::tempdir().unwrap();
            for other in &files {
                std::fs::copy(other, cut.path().join(other.file_name().unwrap())).unwrap();
            }
            let kept = &bytes[..bytes.len() * share / 100];
            std::fs::write(cut.path().join(file.file_name().unwrap()), kept).unwrap();
            for picture in pictures_of(cut.path()) {
                assert!(!texts(&picture).is_empty(), "{}", picture.name);
            }
        }
    }
}

#[test]
fn loads_have_curves_shares_hops_staleness_and_capacity() {
    let place = tempfile::tempdir().unwrap();
    leave_loads(place.path(), 1, 3, 5000, 1.3);
    let pictures = pictures_of(place.path());
    let names: Vec<&str> = pictures.iter().map(|picture| picture.name.as_str()).collect();
    assert_eq!(
        names,
        [
            "knowledge-10",
            "shares-10",
            "knowledge-by-hops-10",
            "hops-10",
            "staleness-10",
            "capacity",
        ]
    );
    let of = |name: &str| pictures.iter().find(|picture| picture.name == name).unwrap();
    let knowledge = of("knowledge-10");
    // 15,000 events carry 99.9 and no more.
    assert!(texts(knowledge).contains(&"99.9".to_owned()), "{:?}", texts(knowledge));
    assert!(!texts(knowledge).contains(&"99.99".to_owned()));
    assert!(has(knowledge, "central-batched 3 ms"));
    assert!(!has(knowledge, "null"), "nothing is known under it");
    assert_eq!(
        knowledge.document().matches("curve s-").count(),
        3,
        "boundary, full, central-batched"
    );
    assert!(knowledge.document().contains("whisker s-boundary"));
    assert!(has(of("shares-10"), "wake 62") && has(of("shares-10"), "from p99 on"));
    let by_hops = of("knowledge-by-hops-10");
    assert!(has(by_hops, "boundary at common n 15000 (1 hop)"));
    assert!(has(by_hops, "central-batched at common n 15000 (2 hops)"));
    assert!(by_hops.document().contains("whisker s-boundary"));
    assert!(!texts(by_hops).contains(&"3".to_owned()), "nothing came over three hops");
    assert!(has(of("hops-10"), "one hop, other core") && has(of("hops-10"), "n 15000"));
    assert!(has(of("staleness-10"), "reads that missed a write"));
    assert!(has(of("capacity"), "n 3 blocks"));
}

#[test]
fn what_is_saturated_says_so_and_has_no_percentiles() {
    let place = tempfile::tempdir().unwrap();
    leave_loads(place.path(), 1, 3, 5000, 1.3);
    let mut run = read_run(place.path()).unwrap();
    let saturate = |run: &mut RunData, is_so: fn(StrategyKind) -> bool| {
        for cell in &mut run.loads {
            let record = &mut cell.record;
            record.saturated = is_so(record.cell.strategy).then_some(Saturation::Lag);
        }
    };
    saturate(&mut run, |strategy| strategy == StrategyKind::Full);
    let pictures = gallery(&run, &Summary::of(&run), &[]);
    assert!(has(&pictures[0], "full: saturated") && has(&pictures[0], "full at load common"));
    assert!(!pictures[0].document().contains("curve s-full"));
    assert!(pictures[0].document().contains("curve s-boundary"));
    saturate(&mut run, |_| true);
    for picture in &gallery(&run, &Summary::of(&run), &[])[..3] {
        assert!(has(picture, "every strategy is saturated"), "{}", picture.name);
    }
}

fn choice(strategy: Option<StrategyKind>, best: StrategyKind, margin: f64) -> Option<Choice> {
    let runner_up = StrategyKind::Limited;
    let verdict = if strategy.is_some() { Verdict::Winner } else { Verdict::Tie };
    let (low, high) = (margin * 0.9, margin * 1.1);
    Some(Choice { strategy, best, runner_up, margin, low, high, verdict })
}

/// Counts change over at 1, CPU at 2.
fn sample_map() -> Map {
    let (sizes, k_betas) = (vec![2, 5, 10, 20, 50, 100, 128], vec![0.25, 0.5, 1.0, 1.5, 4.0]);
    let by = |k_beta: f64, from: f64| {
        if k_beta < from { StrategyKind::Boundary } else { StrategyKind::Full }
    };
    let mut cells = Vec::new();
    for &size in &sizes {
        for &k_beta in &k_betas {
            let best = by(k_beta, 2.0);
            cells.push(MapCell {
                size,
                k_beta,
                n: 9,
                by_cpu: choice((size > 2).then_some(best), best, 1.0 + k_beta),
                by_p99: if size == 128 { None } else { choice(None, best, 1.01) },
                by_count: by(k_beta, 1.0),
            });
        }
    }
    let predicted_cpu = sizes.iter().map(|&size| (size, 0.8 + f64::from(size) / 20.0)).collect();
    Map { cells, sizes, k_betas, sample_costs: None, predicted_cpu, ..Map::default() }
}

#[test]
fn the_map_hatches_where_counts_name_another_winner() {
    let sample = sample_map();
    // Six sizes with a winner, and two rows between the two borders.
    assert!(headline(&sample).contains("in 12 of 30 cells with a winner by CPU"), "{sample:?}");
    assert!(headline(&sample).contains("in 0 of 0 cells with a winner by p99"));
    let picture = map(&sample);
    let hatched = picture.document().matches("class=\"hatched\"").count();
    assert_eq!(hatched, 12);
    assert!(has(&picture, "B 2.5") && has(&picture, "(B) 1.01") && has(&picture, "n 9"));
    // The line of counts in both panels, that of CPU in one, each with what lies under it.
    assert_eq!(picture.document().matches("class=\"limit\"").count(), 2 + 1 + 2);
}

#[test]
fn the_map_as_text_fits_a_terminal_and_marks_the_same_cells() {
    let text = text(&sample_map(), Colour::Never);
    assert!(text.lines().all(|line| line.len() <= WIDTH), "{text}");
    assert!(text.is_ascii() && text.lines().all(|line| line == line.trim_end()));
    let (panels, legend) = text.split_once("winner        ").unwrap();
    assert_eq!(panels.matches('*').count(), 12, "{text}");
    assert!(legend.contains("F full") && legend.contains("B boundary"));
    assert!(panels.contains("CPU at") && panels.contains("2.5/9*"), "{text}");
    let line = panels.lines().position(|line| line.starts_with("----")).unwrap();
    let rows: Vec<&str> = panels.lines().collect();
    assert!(rows[line - 1].starts_with("1 ") && rows[line + 1].starts_with("0.5"), "{text}");
}

#[test]
fn an_empty_map_says_so() {
    let empty = Map::default();
    assert!(has(&map(&empty), "no cell has two strategies to compare"));
    assert!(text(&empty, Colour::Never).lines().all(|line| line.len() <= WIDTH));
}
