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
    for (name, measure) in MEASURES {
        text += &format!("\n{}\n", colour.heading(&clip(name, WIDTH)));
        for sizes in map.sizes.chunks(SIZES_BESIDE) {
            text += &panel(map, sizes, measure, colour);
        }
    }
    text + "\n" + &legend(map)
}

fn panel(map: &Map, sizes: &[u32], measure: Measure, colour: Colour) -> String {
    let heads = sizes.iter().map(|size| format!("{:>CELL_WIDTH$}", format!("{size} crafts")));
    let mut text = format!("{:<NAME_WIDTH$}{}\n", "k beta", heads.collect::<String>());
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
            found
                .map_or_else(|| format!("{DASH:>CELL_WIDTH$}"), |cell| words(cell, measure, colour))
        });
        text += &format!("{:<NAME_WIDTH$}", Unit::Plain.format(k_beta));
        text += &format!("{}\n", cells.collect::<String>());
    }
    if !map.predicted_cpu.is_empty() {
        let crossings = sizes.iter().map(|&size| {
            let crossing = map.predicted_cpu.iter().find(|(known, _)| *known == size);
            let number =
                crossing.map_or_else(|| DASH.to_owned(), |&(_, at)| Unit::Plain.format(at));
            format!("{number:>CELL_WIDTH$}")
        });
        text += &format!("{:<NAME_WIDTH$}{}\n", "CPU at", crossings.collect::<String>());
    }
    text
}

/// `F 1.31/9*`: winner, margin, blocks, and a star where the count names another.
fn words(cell: &MapCell, measure: Measure, colour: Colour) -> String {
    let choice = measure(cell);
    let Some(shown) = choice else { return format!("{DASH:>CELL_WIDTH$}") };
    let is_wrong = is_count_wrong(cell, choice);
    let letter = shown.strategy.map_or('.', |strategy| Mark::of(strategy).letter);
    let mark = if is_wrong { '*' } else { ' ' };
    let margin = Unit::Plain.format(shown.margin);
    let words = format!("{:>CELL_WIDTH$}", format!("{letter} {margin}/{}{mark}", cell.n));
    if is_wrong { colour.alarm(&words) } else { words }
}

fn legend(map: &Map) -> String {
    let choices = map.cells.iter().flat_map(|cell| [cell.by_cpu, cell.by_p99]).flatten();
    let winners: BTreeSet<StrategyKind> = choices.filter_map(|choice| choice.strategy).collect();
    let letters: Vec<String> =
        winners.into_iter().map(|kind| format!("{} {kind}", Mark::of(kind).letter)).collect();
    let mut text = String::new();
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
