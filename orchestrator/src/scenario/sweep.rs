//! The grid of a sweep: keys of the scenario, the values that each takes, and the cells that follow.
//!
//! `--vary key=v1,v2` varies any key that `--set` sets; commas inside brackets or quotes belong to a
//! value. The last axis varies fastest. `k-beta` is no key but an axis of its own, copies of a boundary
//! change per firing: it sets sharers and boundary fraction of networks and trace as the fleet's size
//! allows, and cells whose fleet is too small for it are left out. Not here: running the cells, and
//! where their results lie.

use super::error::ScenarioError;
use super::load::Override;
use serde::{Deserialize, Serialize};
use shared_types::limits::SWEEP_CELLS_MAX;

/// The axis of copies of a boundary change per firing.
pub const K_BETA: &str = "k-beta";

/// The axis of fleet sizes.
pub const SIZES: &str = "fleet.crafts";

/// Sharers are chosen so that about this share of the writes is of boundary facts.
const BETA_WANTED: f64 = 0.5;

/// What a preset varies unless something else is asked for.
#[must_use]
pub fn preset_axes(preset: &str) -> &'static [&'static str] {
    match preset {
        "map" => &["fleet.crafts=3,5,10,20", "k-beta=0.25,0.5,1,2,4,8"],
        "map-small" => &["fleet.crafts=4,10", "k-beta=0.5,1,2,4"],
        "lossy-links" => &["link.loss=0,0.1,0.25,0.5,0.75"],
        _ => &[],
    }
}

/// One key of the scenario and what it is set to.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Axis {
    /// Dotted, as `--set` takes it: `network.links`.
    pub key: String,
    /// As typed, in order.
    pub values: Vec<String>,
}

impl Axis {
    /// The argument of `--vary`: `network.links=100,200`.
    ///
    /// # Errors
    /// If it names no key, or not at least one value, or one twice.
    pub fn parse(argument: &str) -> Result<Self, ScenarioError> {
        let refused = |what: &str| {
            ScenarioError::without_place(
                format!("`--vary {argument}` {what}"),
                "write a key and its values: `--vary network.links=100,200,300`".to_owned(),
            )
        };
        let (key, values) = argument.split_once('=').ok_or_else(|| refused("varies nothing"))?;
        let values: Vec<String> =
            split_outside_brackets(values).iter().map(|value| value.trim().to_owned()).collect();
        if key.trim().is_empty() {
            return Err(refused("names no key"));
        }
        if values.iter().any(String::is_empty) {
            return Err(refused("has an empty value"));
        }
        let is_repeated = (1..values.len()).find(|&place| values[..place].contains(&values[place]));
        if let Some(place) = is_repeated {
            return Err(refused(&format!("has the value `{}` twice", values[place])));
        }
        Ok(Self { key: key.trim().to_owned(), values })
    }

    /// What sets the key to `value`.
    #[must_use]
    pub fn set_to(&self, value: &str) -> Override {
        Override::flag(format!("--vary {}={value}", self.key), &self.key, value)
    }

    /// The number that `value` is on the axis of copies.
    fn copies(value: &str) -> Result<f64, ScenarioError> {
        let copies = value.parse().ok().filter(|copies: &f64| copies.is_finite() && *copies > 0.0);
        copies.ok_or_else(|| {
            ScenarioError::without_place(
                format!("`--vary {K_BETA}={value}`: copies of a change are a number above 0"),
                "write numbers such as 0.5,1,2,4".to_owned(),
            )
        })
    }

    /// The last word of the key, which tells axes apart in tables unless two end alike.
    #[must_use]
    pub fn short_name(&self) -> &str {
        self.key.rsplit('.').next().unwrap_or(&self.key)
    }
}

/// What sets the keys of one cell; `None` if its fleet is too small for so many copies.
///
/// # Errors
/// If copies are varied without fleet sizes, or are no number.
pub fn overrides(axes: &[Axis], values: &[String]) -> Result<Option<Vec<Override>>, ScenarioError> {
    let mut overrides = Vec::new();
    for (axis, value) in axes.iter().zip(values) {
        if axis.key != K_BETA {
            overrides.push(axis.set_to(value));
            continue;
        }
        let copies = Axis::copies(value)?;
        let size = axes.iter().zip(values).find(|(axis, _)| axis.key == SIZES);
        let Some(crafts) = size.and_then(|(_, size)| size.parse::<u32>().ok()) else {
            return Err(ScenarioError::without_place(
                format!("`--vary {axis}` without fleet sizes", axis = K_BETA),
                format!("how many can share a fact follows from them: `--vary {SIZES}=5,10`"),
            ));
        };
        let Some((sharers, beta)) = sharers_and_beta(copies, crafts) else { return Ok(None) };
        for (key, value) in [
            ("network.linking", "shared".to_owned()),
            ("network.sharers", sharers.to_string()),
            ("trace.sharers", sharers.to_string()),
            ("trace.boundary-fraction", format!("{beta:?}")),
        ] {
            overrides.push(Override::flag(
                format!("--vary {K_BETA}={copies} ({key})"),
                key,
                &value,
            ));
        }
    }
    Ok(Some(overrides))
}

/// The sharers of a boundary fact and the share of boundary writes whose product is `copies`; `None` if
/// `crafts` are too few.
fn sharers_and_beta(copies: f64, crafts: u32) -> Option<(u32, f64)> {
    let others = crafts.saturating_sub(1);
    let wanted = (1..=others).find(|&sharers| copies / f64::from(sharers) <= BETA_WANTED);
    let sharers = wanted.unwrap_or(others);
    let beta = copies / f64::from(sharers.max(1));
    (sharers > 0 && beta <= 1.0).then_some((sharers, beta))
}

/// Every combination of values, one of each axis.
///
/// # Errors
/// If there is no axis, a key is varied twice, or there are more cells than a sweep takes.
pub fn grid(axes: &[Axis]) -> Result<Vec<Vec<String>>, ScenarioError> {
    let refused =
        |what: String, remedy: &str| ScenarioError::without_place(what, remedy.to_owned());
    if axes.is_empty() {
        let remedy = "name a key and its values: `--vary network.links=100,200,300`";
        return Err(refused("a sweep varies at least one key".to_owned(), remedy));
    }
    for (place, axis) in axes.iter().enumerate() {
        if axes[..place].iter().any(|earlier| earlier.key == axis.key) {
            let what = format!("`{}` is varied twice", axis.key);
            return Err(refused(what, "give all its values in one `--vary`"));
        }
    }
    let count = axes.iter().try_fold(1_usize, |count, axis| count.checked_mul(axis.values.len()));
    if count.is_none_or(|count| count > SWEEP_CELLS_MAX) {
        let what = count.map_or_else(|| "too many".to_owned(), |count| count.to_string());
        let what = format!("the grid has {what} cells, and a sweep takes {SWEEP_CELLS_MAX}");
        return Err(refused(what, "vary fewer keys or give fewer values"));
    }
    Ok(axes.iter().fold(vec![Vec::new()], |cells, axis| {
        let longer = |cell: &Vec<String>| {
            let cell = cell.clone();
            axis.values.iter().map(move |value| [cell.clone(), vec![value.clone()]].concat())
        };
        cells.iter().flat_map(longer).collect()
    }))
}

/// `text` at its commas, those inside brackets, braces and quotes left alone.
fn split_outside_brackets(text: &str) -> Vec<&str> {
    let (mut parts, mut start, mut depth, mut quote) = (Vec::new(), 0, 0_u32, None);
    for (at, letter) in text.char_indices() {
        match (quote, letter) {
            (Some(open), letter) if open == letter => quote = None,
            (Some(_), _) => {}
            (None, '"' | '\'') => quote = Some(letter),
            (None, '[' | '{') => depth += 1,
            (None, ']' | '}') => depth = depth.saturating_sub(1),
            (None, ',') if depth == 0 => {
                parts.push(&text[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&text[start..]);
    parts
}

#[cfg(test)]
mod tests {
    use super::{Axis, grid, overrides, preset_axes, sharers_and_beta};

    fn axis(argument: &str) -> Axis {
        Axis::parse(argument).expect("an axis")
    }

    #[test]
    fn commas_inside_a_value_do_not_part_it() {
        let lists = axis("replication.strategies=[\"full\", \"null\"],boundary");
        assert_eq!(lists.values, ["[\"full\", \"null\"]", "boundary"]);
        assert_eq!(axis("run.seed = 1, 2").values, ["1", "2"]);
        assert_eq!(axis("name=\"a,b\",c").values, ["\"a,b\"", "c"]);
        assert_eq!(axis("network.links=3").short_name(), "links");
    }

    #[test]
    fn what_varies_nothing_is_refused() {
        for (argument, why) in [
            ("run.seed", "varies nothing"),
            ("=1,2", "names no key"),
            ("run.seed=1,,2", "an empty value"),
            ("run.seed=1,2,1", "the value `1` twice"),
        ] {
            let error = Axis::parse(argument).expect_err(argument).to_string();
            assert!(error.contains(why), "{error}");
        }
        let refused = |axes: &[Axis]| grid(axes).expect_err("too little or much").to_string();
        assert!(refused(&[]).contains("at least one"));
        assert!(refused(&[axis("a=1"), axis("a=2")]).contains("varied twice"));
        let many: Vec<String> = (0..200).map(|value| value.to_string()).collect();
        let many = |key: &str| axis(&format!("{key}={}", many.join(",")));
        assert!(refused(&[many("a"), many("b")]).contains("40000 cells"));
    }

    #[test]
    fn copies_are_sharers_times_boundary_fraction() {
        for (copies, crafts, meant) in [
            (0.5, 10, Some((1, 0.5))),
            (0.25, 10, Some((1, 0.25))),
            (2.0, 10, Some((4, 0.5))),
            (8.0, 10, Some((9, 8.0 / 9.0))),
            (2.0, 3, Some((2, 1.0))),
            (4.0, 3, None),
            (1.0, 1, None),
        ] {
            assert_eq!(sharers_and_beta(copies, crafts), meant, "{copies} in {crafts}");
        }
        let axes = [axis("fleet.crafts=3,10"), axis("k-beta=4")];
        let of = |size: &str| overrides(&axes, &[size.to_owned(), "4".to_owned()]);
        assert!(of("3").expect("an axis of its own").is_none(), "too small");
        assert_eq!(of("10").expect("an axis of its own").map(|keys| keys.len()), Some(5));
        assert!(overrides(&axes[1..], &["4".to_owned()]).is_err(), "without sizes");
        assert!(overrides(&axes, &["10".to_owned(), "-1".to_owned()]).is_err());
    }

    #[test]
    fn presets_of_maps_have_axes() {
        for preset in ["map", "map-small"] {
            let axes: Vec<Axis> = preset_axes(preset).iter().map(|vary| axis(vary)).collect();
            let cells = grid(&axes).expect("a grid");
            let possible =
                cells.iter().filter(|cell| overrides(&axes, cell).expect("numbers").is_some());
            assert!(possible.count() > cells.len() / 2, "{preset}");
        }
        assert!(preset_axes("compare").is_empty());
    }

    #[test]
    fn the_last_axis_varies_fastest() {
        let cells = grid(&[axis("a=1,2"), axis("b=x,y,z")]).expect("six cells");
        let cells: Vec<String> = cells.iter().map(|cell| cell.concat()).collect();
        assert_eq!(cells, ["1x", "1y", "1z", "2x", "2y", "2z"]);
    }
}
