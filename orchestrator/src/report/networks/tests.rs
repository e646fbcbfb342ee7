//! The printed tables are read whole, and verdicts are what they say.

use super::published::{Kind, embedded};
use super::{Networks, TABLES, conditions};
use crate::report::table::Colour;
use crate::results::networks::{Condition, Mean, Measured};

#[test]
fn every_table_is_read_with_its_rows_and_conditions() {
    let tables = embedded();
    let numbers: Vec<u32> = tables.iter().map(|table| table.number).collect();
    assert_eq!(numbers, TABLES.collect::<Vec<_>>());
    let rows = |number: usize| tables[number - 1].rows.len();
    assert_eq!([1, 2, 4, 5, 10, 16, 18, 20].map(rows), [1, 1, 4, 6, 5, 3, 6, 4]);
    assert!(tables.iter().flat_map(|table| &table.rows).all(|row| !row.columns.is_empty()));
    let percents = tables.iter().filter(|table| table.kind == Kind::Percent);
    assert_eq!(percents.map(|table| table.rows.len()).sum::<usize>(), 25);
    assert_eq!(conditions(&[1, 2, 3]), [Condition::BASE]);
    assert_eq!(conditions(&[20]).len(), 4);
    let varied = conditions(&[17]);
    assert_eq!((varied[0].rules, varied[0].facts, varied[0].associations), (750, 750, 2));
}

/// The base networks, with the published counts but for the rules.
fn measured(rules: f64) -> Measured {
    let mut one = Measured::new(Condition::BASE);
    let mean = |value: f64| {
        let mut mean = Mean::default();
        [value, value].into_iter().for_each(|value| mean.add(value));
        mean
    };
    one.kept = [mean(685.6), mean(rules), mean(667.1)];
    one.kept_by_text = [mean(1.0); 3];
    one.prune_ns = mean(3000.0);
    one.unpruned.naive_ns = mean(500.0);
    one.pruned.naive_ns = mean(200.0);
    one
}

#[test]
fn one_percent_decides_on_remaining_counts() {
    let marks = |rules, by_text| {
        let text = Networks::new(&[2], &[measured(rules)], 2, by_text).text(Colour::Never);
        (text.contains("685.6="), text.contains("667.1="), text.matches('!').count())
    };
    assert_eq!(marks(938.9 * 1.009, false), (true, true, 1), "the legend alone");
    assert_eq!(marks(938.9 * 1.011, false), (true, true, 2));
    assert_eq!(marks(938.9, true), (false, false, 4), "the text's pruner is another");
    let text = Networks::new(&[2], &[measured(938.9)], 2, false).text(Colour::Never);
    assert!(text.contains("10.0 solves"), "{text}");
    assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
}

#[test]
fn what_the_source_says_of_itself_is_counted_again() {
    let derived = super::derived::Derived::of(&[]);
    let printed = format!("{derived:?}");
    // Preparation time 17; of the others the text gives what grows: 16 grow, 9 do not.
    assert!(printed.contains("helped_as_printed: [17, 9, 9, 5]"), "{printed}");
}
