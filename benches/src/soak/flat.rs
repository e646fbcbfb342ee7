//! What grew while a fleet was soaked.
//!
//! The first third is warm-up. After it, nothing may grow: the middle value of the last third is held
//! against that of the middle third. A life that lasted for most of the soak is judged by itself; of a
//! craft that dies again and again, its lives are, one after the other. A peak that passes, such as files
//! of the dead beside those of a successor, is no growth.

use super::verdict::Drift;
use super::watch::{Cost, Look, Looks};
use shared_types::ids::{CraftId, Incarnation};
use std::collections::BTreeMap;

/// What memory may grow by in the last third and still be flat: what allocators and page tables move
/// by, bytes.
pub const GROWTH_BYTES_MAX: u64 = 1 << 20;

/// Fewest looks that show a drift.
const LOOKS_MIN: usize = 9;

/// Fewest lives of a craft that show one.
const LIVES_MIN: usize = 6;

/// A quantity in the course of time: the middle value of each third.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Thirds(pub [u64; 3]);

impl Thirds {
    /// The thirds of `values`, which are in order of time.
    #[must_use]
    pub fn of(values: impl IntoIterator<Item = u64>) -> Self {
        let values: Vec<u64> = values.into_iter().collect();
        let mut thirds = [0; 3];
        for (third, values) in thirds.iter_mut().zip(values.chunks(values.len().div_ceil(3).max(1)))
        {
            *third = middle(values.iter().copied());
        }
        Self(thirds)
    }

    /// By how much the last third is above the middle one.
    const fn growth(self) -> u64 {
        self.0[2].saturating_sub(self.0[1])
    }
}

/// The upper one of the two middle values, or the middle one; 0 of nothing.
pub(super) fn middle(values: impl IntoIterator<Item = u64>) -> u64 {
    let mut values: Vec<u64> = values.into_iter().collect();
    values.sort_unstable();
    values.get(values.len() / 2).copied().unwrap_or(0)
}

/// A quantity of a process: its name, its unit, its value, and by how much it may grow.
type Quantity = (&'static str, &'static str, fn(&Cost) -> u64, u64);

const OF_PROCESSES: [Quantity; 3] = [
    ("resident memory", "bytes", |cost| cost.resident_bytes, GROWTH_BYTES_MAX),
    ("proportional memory", "bytes", |cost| cost.proportional_bytes, GROWTH_BYTES_MAX),
    ("descriptors", "open", |cost| cost.descriptors, 0),
];

/// Everything that grew.
#[must_use]
pub fn growths(looks: &Looks) -> Vec<Drift> {
    if looks.len() < LOOKS_MIN {
        let what = format!("{} looks show no drift; {LOOKS_MIN} may", looks.len());
        return vec![Drift::new(what)];
    }
    let (lasting, mortal) = crafts(looks);
    let mut growths = Vec::new();
    let orchestrator: Vec<Cost> = looks.iter().map(|look| look.orchestrator).collect();
    growths.extend(of_process("the orchestrator", &orchestrator));
    for (craft, costs) in lasting {
        growths.extend(of_process(&format!("craft {}", craft.0), &costs));
    }
    for (craft, lives) in mortal.into_iter().filter(|(_, lives)| lives.len() >= LIVES_MIN) {
        growths.extend(of_process(&format!("craft {}, life after life,", craft.0), &lives));
    }
    let mut judge = |unit: &str, value: fn(&Look) -> u64, growth_max: u64| {
        growths.extend(growth("shared memory", unit, looks.iter().map(value), growth_max));
    };
    judge("files", |look| look.shared_files, 0);
    judge("bytes", |look| look.shared_bytes, GROWTH_BYTES_MAX);
    growths
}

fn of_process(name: &str, costs: &[Cost]) -> Vec<Drift> {
    let quantities = OF_PROCESSES.into_iter();
    let growths = quantities.filter_map(|(what, unit, value, growth_max)| {
        growth(&format!("{what} of {name}"), unit, costs.iter().map(value), growth_max)
    });
    growths.collect()
}

fn growth(
    name: &str,
    unit: &str,
    values: impl Iterator<Item = u64>,
    growth_max: u64,
) -> Option<Drift> {
    let thirds = Thirds::of(values);
    let [_, before, after] = thirds.0;
    let what = || Drift::new(format!("{name} grew from {before} to {after} {unit}"));
    (thirds.growth() > growth_max).then(what)
}

/// By craft, what was seen of a process.
type ByCraft = BTreeMap<CraftId, Vec<Cost>>;

/// Crafts whose one life lasted for more than half of the looks, with what each look saw; and the others,
/// with what each of their lives usually took.
fn crafts(looks: &Looks) -> (ByCraft, ByCraft) {
    let mut lives: BTreeMap<(CraftId, Incarnation), Vec<Cost>> = BTreeMap::new();
    for look in looks {
        for (&life, &cost) in &look.crafts {
            lives.entry(life).or_default().push(cost);
        }
    }
    let (mut lasting, mut mortal) = (ByCraft::new(), ByCraft::new());
    for ((craft, _), costs) in lives {
        if 2 * costs.len() > looks.len() {
            lasting.insert(craft, costs);
        } else {
            mortal.entry(craft).or_default().push(usual(&costs));
        }
    }
    (lasting, mortal)
}

fn usual(costs: &[Cost]) -> Cost {
    let of = |value: fn(&Cost) -> u64| middle(costs.iter().map(value));
    Cost {
        resident_bytes: of(|cost| cost.resident_bytes),
        proportional_bytes: of(|cost| cost.proportional_bytes),
        descriptors: of(|cost| cost.descriptors),
    }
}

#[cfg(test)]
mod tests {
    use super::{Drift, GROWTH_BYTES_MAX, Thirds, growths};
    use crate::soak::watch::{Cost, Look, Looks};
    use shared_types::ids::{CraftId, Incarnation};

    const PLAIN: Cost =
        Cost { resident_bytes: 9 << 20, proportional_bytes: 3 << 20, descriptors: 30 };

    fn plus(more: Cost) -> Cost {
        Cost {
            resident_bytes: PLAIN.resident_bytes + more.resident_bytes,
            proportional_bytes: PLAIN.proportional_bytes + more.proportional_bytes,
            descriptors: PLAIN.descriptors + more.descriptors,
        }
    }

    /// `count` looks at an orchestrator and two crafts; the second craft lives `life_looks` looks at a
    /// time and has `more` at each look.
    fn looks(count: u64, life_looks: u64, more: impl Fn(u64) -> Cost) -> Looks {
        let look = |number: u64| {
            let life = u32::try_from(number / life_looks).unwrap();
            Look {
                orchestrator: PLAIN,
                crafts: [
                    ((CraftId(0), Incarnation(0)), PLAIN),
                    ((CraftId(1), Incarnation(life)), plus(more(number))),
                ]
                .into(),
                shared_files: 40,
                shared_bytes: 5 << 20,
            }
        };
        (0..count).map(look).collect()
    }

    fn told(looks: &Looks) -> Vec<String> {
        growths(looks).iter().map(Drift::to_string).collect()
    }

    #[test]
    fn what_is_flat_after_the_warm_up_has_not_grown() {
        let warm_up = |number: u64| Cost { resident_bytes: number.min(9) << 20, ..Cost::default() };
        assert_eq!(told(&looks(30, 30, warm_up)), [""; 0]);
        let waves = |number: u64| Cost { descriptors: number % 2, ..Cost::default() };
        assert_eq!(told(&looks(30, 30, waves)), [""; 0]);
        let peak = |number: u64| Cost { descriptors: u64::from(number == 28), ..Cost::default() };
        assert_eq!(told(&looks(30, 30, peak)), [""; 0]);
        let within_a_life =
            |number: u64| Cost { resident_bytes: (number % 5) << 20, ..Cost::default() };
        assert_eq!(told(&looks(60, 5, within_a_life)), [""; 0]);
    }

    #[test]
    fn every_leak_is_named_with_its_process() {
        let leak =
            |number: u64| Cost { resident_bytes: number * GROWTH_BYTES_MAX / 8, ..Cost::default() };
        let found = told(&looks(30, 30, leak));
        assert!(found.len() == 1 && found[0].contains("resident memory of craft 1"), "{found:?}");
        let leak = |number: u64| Cost { descriptors: number / 20, ..Cost::default() };
        let found = told(&looks(30, 30, leak));
        assert!(found.len() == 1 && found[0].contains("descriptors of craft 1"), "{found:?}");
        let from_life_to_life = |number: u64| Cost { descriptors: number / 5, ..Cost::default() };
        let found = told(&looks(60, 5, from_life_to_life));
        assert!(found.len() == 1 && found[0].contains("craft 1, life after life,"), "{found:?}");
        let mut files = looks(30, 30, |_| Cost::default());
        files[20..].iter_mut().for_each(|look| look.shared_files += 1);
        assert_eq!(told(&files), ["shared memory grew from 40 to 41 files"]);
        files[20..].iter_mut().for_each(|look| look.orchestrator.descriptors += 1);
        assert_eq!(told(&files).len(), 2);
    }

    #[test]
    fn too_few_looks_are_no_verdict() {
        assert_eq!(told(&looks(8, 8, |_| Cost::default())).len(), 1);
        assert_eq!(Thirds::of([]), Thirds([0; 3]));
    }
}
