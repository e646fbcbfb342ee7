//! The map as text: a letter a cell for the strategy that costs least, readable without colour.

use super::pictures::map::{MEASURES, Measure, TITLE, headline, is_count_wrong};
use super::svg::look::Mark;
use super::svg::number::Unit;
use super::table::{Colour, DASH, WIDTH, clip, wrap};
use crate::results::map::{Map, MapCell};
use shared_types::wire::StrategyKind;
use std::collections::BTreeSet;

/// Columns of a row's name.
const NAME_WIDTH: usize = 8;
/// Columns of a cell.
const CELL_WIDTH: usize = 12;
/// Fleet sizes side by side.
const SIZES_BESIDE: usize = (WIDTH - NAME_WIDTH) / CELL_WIDTH;

/// The map on a terminal, both panels one below the other.
#[must_use]
pub fn text(map: &Map, colour: Colour) -> String {
    let mut text = format!("{}\n{}", colour.heading(TITLE), wrap("", &headline(map)));
    for (place, (name, measure)) in MEASURES.into_iter().enumerate() {
        text += &format!("\n{}\n", colour.heading(&clip(name, WIDTH)));
        for sizes in map.sizes.chunks(SIZES_BESIDE) {
            text += &panel(map, sizes, measure, colour);
            // The costs of samples are of CPU: they say nothing about times.
            if place == 0 && !map.predicted_cpu.is_empty() {
                text += &crossings(map, sizes);
            }
        }
    }
    text + "\n" + &legend(map)
}

fn panel(map: &Map, sizes: &[u32], measure: Measure, colour: Colour) -> String {
    let heads = sizes.iter().map(|size| cell(&format!("{size} crafts"), ' '));
    let mut text = line("k beta", heads);
    let mut is_above_one = true;
    for &k_beta in map.k_betas.iter().rev() {
        if is_above_one && k_beta < 1.0 {
            // Rows fall: here the counts change over.
            text += &format!("{:-<1$}\n", "", NAME_WIDTH + sizes.len() * CELL_WIDTH);
            is_above_one = false;
        }
        let cells = sizes.iter().map(|&size| {
            let is_it =
                |cell: &&MapCell| cell.size == size && cell.k_beta.total_cmp(&k_beta).is_eq();
            let found = map.cells.iter().find(is_it);
            found.map_or_else(|| cell(DASH, ' '), |found| words(found, measure, colour))
        });
        text += &line(&Unit::Plain.format(k_beta), cells);
    }
    text
}

/// Where CPU is predicted to change over, size by size.
fn crossings(map: &Map, sizes: &[u32]) -> String {
    let cells = sizes.iter().map(|&size| {
        let crossing = map.predicted_cpu.iter().find(|(known, _)| *known == size);
        let number = crossing.map_or_else(|| DASH.to_owned(), |&(_, at)| Unit::Plain.format(at));
        cell(&number, ' ')
    });
    line("CPU at", cells)
}

fn line(name: &str, cells: impl Iterator<Item = String>) -> String {
    let line = format!("{name:<NAME_WIDTH$}{}", cells.collect::<String>());
    format!("{}\n", line.trim_end())
}

/// `words` on the right of a cell, before a column for its mark.
fn cell(words: &str, mark: char) -> String {
    let width = CELL_WIDTH - 1;
    format!("{words:>width$}{mark}")
}

/// `F 1.31/9*`: winner, margin, blocks, and a star where the count names another.
fn words(of: &MapCell, measure: Measure, colour: Colour) -> String {
    let choice = measure(of);
    let Some(shown) = choice else { return cell(DASH, ' ') };
    let is_wrong = is_count_wrong(of, choice);
    let letter = shown.strategy.map_or('.', |strategy| Mark::of(strategy).letter);
    let mark = if is_wrong { '*' } else { ' ' };
    let margin = Unit::Plain.format(shown.margin);
    let words = cell(&format!("{letter} {margin}/{}", of.n), mark);
    if is_wrong { colour.alarm(&words) } else { words }
}

fn legend(map: &Map) -> String {
    let choices = map.cells.iter().flat_map(|cell| [cell.by_cpu, cell.by_p99]).flatten();
    let winners: BTreeSet<StrategyKind> = choices.filter_map(|choice| choice.strategy).collect();
    let letters: Vec<String> =
        winners.into_iter().map(|kind| format!("{} {kind}", Mark::of(kind).letter)).collect();
    let mut text = String::new();
    if !map.other_loads.is_empty() {
        let others = map.other_loads.join(", ");
        text += &wrap("load          ", &format!("{}; not shown here: {others}", map.load));
    }
    if !letters.is_empty() {
        text += &wrap("winner        ", &letters.join(", "));
    }
    for (word, meaning) in [
        (".             ", "no winner stands: a tie, too few blocks, or a noisy host"),
        ("1.31/9        ", "value of the runner-up over that of the best; blocks"),
        ("*             ", "the transmission count names another strategy than the winner"),
        ("k beta        ", "copies of a boundary change per firing: sharers times boundary share"),
        ("----          ", "where counts change from boundary to full: k beta = 1"),
    ] {
        text += &wrap(word, meaning);
    }
    if !map.predicted_cpu.is_empty() {
        let meaning = "k beta at which boundary and full should cost the same CPU, by the cost of \
                       samples in the fleets of the other sizes";
        text += &wrap("CPU at        ", meaning);
    }
    text
}
