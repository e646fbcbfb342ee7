//! The embedded tables are what the source printed, and hold what is claimed of them.

use super::{PUBLISHED_STRATEGIES, Published, PublishedRow, Verdict};
use shared_types::wire::StrategyKind;

#[test]
fn tables_are_read_as_printed() {
    let published = Published::embedded();
    assert_eq!(published.table(20), None);
    assert!(published.runs.iter().all(|runs| runs.rows.len() == 10));
    let row = published.table(24).unwrap().rows[6];
    let wanted = PublishedRow {
        label: 7,
        proposed: 26,
        full: 30,
        limited: 234,
        central: 3080,
        hierarchy: 76,
    };
    assert_eq!(row, wanted);
    let means = published.means_of(5).unwrap();
    assert_eq!((means.proposed, means.full, means.hierarchy), (8.6, 12.0, 15.6));
    assert_eq!(means.requests(StrategyKind::Hybrid), None);
}

#[test]
fn table_25_is_the_mean_of_the_others() {
    let published = Published::embedded();
    for runs in &published.runs {
        let means = published.means_of(runs.crafts).unwrap();
        for strategy in PUBLISHED_STRATEGIES {
            let sum: u64 = runs.rows.iter().filter_map(|row| row.requests(strategy)).sum();
            let mean = means.requests(strategy).unwrap();
            let difference = f64::from(u32::try_from(sum).unwrap()) / 10.0 - mean;
            assert!(difference.abs() < 1e-9, "table {}, {strategy}", runs.table);
        }
    }
}

#[test]
fn identities_hold_on_every_row_where_the_source_is_consistent() {
    let published = Published::embedded();
    let mut counts = [0; 4];
    for runs in &published.runs {
        for row in &runs.rows {
            for strategy in PUBLISHED_STRATEGIES {
                counts[runs.verdict(row, strategy) as usize] += 1;
            }
            assert!(row.proposed <= row.full);
        }
    }
    // 40 rows of full and central, 30 of limited; 10 of limited and hierarchy for two boards;
    // 40 of proposed and 30 of hierarchy that only chance decides.
    assert_eq!(counts[Verdict::Reproduced as usize], 110);
    assert_eq!(counts[Verdict::SourceInconsistent as usize], 20);
    assert_eq!(counts[Verdict::NotReproduced as usize], 0);
    assert_eq!(counts[Verdict::Unchecked as usize], 70);
}

#[test]
fn changed_row_breaks_its_identity() {
    let published = Published::embedded();
    let runs = published.table(22).unwrap();
    let mut row = runs.rows[0];
    row.central += 1;
    row.limited -= 1;
    assert_eq!(runs.verdict(&row, StrategyKind::Central), Verdict::NotReproduced);
    assert_eq!(runs.verdict(&row, StrategyKind::Limited), Verdict::NotReproduced);
    row.full += 1;
    assert_eq!(runs.verdict(&row, StrategyKind::Full), Verdict::NotReproduced);
}

#[test]
fn two_boards_are_printed_as_no_rule_explains() {
    let runs = Published::embedded().table(21).unwrap().clone();
    for row in &runs.rows {
        assert_eq!((row.limited, row.hierarchy), (row.full, row.full));
    }
}

#[test]
fn ratios_to_proposed_are_the_ones_we_print_beside_the_slip() {
    let published = Published::embedded();
    let rounded = |strategy: StrategyKind, digits: f64| -> Vec<f64> {
        let ratio = |row: &PublishedRow<f64>| row.requests(strategy).unwrap() / row.proposed;
        published.means.iter().map(|row| (ratio(row) * digits).round() / digits).collect()
    };
    assert_eq!(rounded(StrategyKind::Limited, 10.0), [3.8, 2.0, 4.0, 9.0]);
    assert_eq!(rounded(StrategyKind::Hierarchy, 10.0), [3.8, 1.4, 1.8, 3.0]);
    assert_eq!(rounded(StrategyKind::Central, 1.0), [392.0, 210.0, 143.0, 116.0]);
}
