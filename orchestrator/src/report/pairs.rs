//! How much slower or faster than one of them strategies are, fleet size beside fleet size.

use super::table::{Colour, DASH, short, wrap};
use crate::results::inference::{Comparison, Verdict, blocks_needed};
use crate::results::pairs::{Compared, Control};
use crate::results::summary::Summary;
use shared_types::wire::StrategyKind;

/// Fewest blocks for which ratios are worth a place on the first screen.
const BLOCKS_MIN: u64 = 2;

/// Columns of a strategy's name.
const NAME_WIDTH: usize = 16;

/// Columns of a fleet size.
const SIZE_WIDTH: usize = 16;

/// Fleet sizes side by side.
const SIZES_BESIDE: usize = 4;

/// Signs of a number.
const SIGNS: usize = 4;

/// One line a strategy, with a ratio, its interval and a mark for each fleet size; empty for a run of
/// one block, which carries no comparison.
pub(super) fn ratios(summary: &Summary, colour: Colour) -> String {
    let compared = &summary.timing.compared;
    let Some(blocks) = compared.iter().map(|pair| pair.comparison.blocks).max() else {
        return String::new();
    };
    if blocks < BLOCKS_MIN {
        return String::new();
    }
    let base = compared[0].base;
    let title = format!("median turn time over that of {base}, and 95 % interval, {blocks} blocks");
    let mut text = format!("\n{}\n", colour.heading(&title));
    for sizes in summary.sizes().chunks(SIZES_BESIDE) {
        text += &section(compared, sizes);
    }
    text + &meaning(compared, base) + &controls(summary)
}

/// What the controls say, a line each.
fn controls(summary: &Summary) -> String {
    let lines = summary.timing.controls.iter().map(|control| {
        let Control { size, strategy, planted_percent, is_right, comparison } = control;
        let what = match planted_percent {
            0 => "beside itself".to_owned(),
            percent => format!("slowed by {percent} %"),
        };
        let said = match is_right {
            Some(true) => "as it should",
            Some(false) => "NOT AS IT SHOULD",
            None => "nothing to say",
        };
        let (verdict, ratio) = (comparison.verdict.name(), short(Some(comparison.ratio), SIGNS));
        format!("control, {size} crafts: {strategy} {what}: {ratio}, {verdict}: {said}\n")
    });
    lines.collect()
}

fn section(compared: &[Compared], sizes: &[u32]) -> String {
    let of_size = |size: u32| compared.iter().filter(move |pair| pair.size == size);
    let heads = sizes.iter().map(|size| format!("{size} crafts "));
    let mut text = ratio_line("", heads);
    let is_shown = |strategy: &StrategyKind| {
        sizes.iter().any(|&size| of_size(size).any(|pair| pair.strategy == *strategy))
    };
    for strategy in StrategyKind::ALL.into_iter().filter(is_shown) {
        let cells = sizes.iter().map(|&size| {
            of_size(size)
                .find(|pair| pair.strategy == strategy)
                .map_or_else(String::new, |pair| ratio_cell(&pair.comparison))
        });
        text += &ratio_line(strategy.name(), cells);
    }
    let floors = sizes.iter().map(|&size| {
        let floor = of_size(size).find_map(|pair| pair.comparison.floor);
        floor.map_or_else(|| format!("{DASH} "), |floor| format!("{} ", short(Some(floor), SIGNS)))
    });
    text + &ratio_line("A-A floor", floors)
}

/// A name and one cell a column.
pub(super) fn ratio_line(name: &str, cells: impl Iterator<Item = String>) -> String {
    let cells: String = cells.map(|cell| format!("{cell:>SIZE_WIDTH$}")).collect();
    let line = format!("{name:<NAME_WIDTH$}{cells}");
    format!("{}\n", line.trim_end())
}

/// `1.31 1.22-1.40>`.
pub(super) fn ratio_cell(comparison: &Comparison) -> String {
    let number = |value: f64| short(Some(value), SIGNS);
    let interval = comparison
        .interval
        .map_or_else(|| DASH.to_owned(), |(low, high)| format!("{}-{}", number(low), number(high)));
    let mark = match comparison.verdict {
        Verdict::Winner if comparison.ratio < 1.0 => '<',
        Verdict::Winner => '>',
        Verdict::Tie => '=',
        Verdict::TooFewBlocks | Verdict::Noisy => ' ',
    };
    format!("{} {interval}{mark}", number(comparison.ratio))
}

fn meaning(compared: &[Compared], base: StrategyKind) -> String {
    let has = |verdict| compared.iter().any(|pair| pair.comparison.verdict == verdict);
    let mut text = String::new();
    if has(Verdict::Noisy) {
        text += "the host was noisy: no winner of times is named\n";
    }
    if has(Verdict::TooFewBlocks) {
        let (count, needed) = (compared.len(), blocks_needed(compared.len()));
        text += &format!(
            "too few blocks to name a winner of times among {count} comparisons: `--blocks {needed}` may\n"
        );
    }
    if has(Verdict::Winner) || has(Verdict::Tie) {
        text += &wrap("< > =         ", &format!("faster, slower than {base}; a tie"));
    }
    text
}
