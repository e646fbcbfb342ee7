//! Time to knowledge of a row by the number of hops that changes came over.

use super::LoadFigures;
use crate::results::figure::Figure;
use crate::results::statistics::Quantile;
use shared_types::wire::Stage;

/// Names of the numbers of hops, in the order of [`Stage::BY_HOPS`].
pub const HOPS: [&str; Stage::BY_HOPS.len()] = ["1", "2", "3", "4", "5+"];

/// What is known of changes that came over one number of hops.
#[derive(Clone, Copy, Debug)]
pub struct OverHops<'a> {
    row: &'a LoadFigures,
    stage: Stage,
    /// The number, from 1; that of the last stands for itself and all above.
    pub hops: u32,
    /// Its name, of [`HOPS`].
    pub name: &'static str,
    /// Changes that came over so many, one for each board that got to know it.
    pub n: u64,
}

impl OverHops<'_> {
    /// The number in words, as metrics have it.
    #[must_use]
    pub fn words(&self) -> &'static str {
        let name = self.stage.name();
        name.strip_prefix("knowledge-").unwrap_or(name)
    }

    /// Time to knowledge at `quantile`.
    #[must_use]
    pub fn figure(&self, quantile: Quantile) -> Option<&Figure> {
        self.row.figures.get(&format!("{}-{}", self.stage.name(), quantile.name))
    }
}

impl LoadFigures {
    /// Every number of hops that some change came over, ascending; none of runs that did not keep it.
    pub fn by_hops(&self) -> impl Iterator<Item = OverHops<'_>> {
        let all = (1..).zip(HOPS).zip(Stage::BY_HOPS);
        all.filter_map(|((hops, name), stage)| {
            let metric = format!("{}-{}", stage.name(), Quantile::P50.name);
            let n = self.figures.get(&metric)?.n;
            (n > 0).then_some(OverHops { row: self, stage, hops, name, n })
        })
    }
}
