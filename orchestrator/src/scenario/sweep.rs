//! The grid of a sweep: keys of the scenario, the values that each takes, and the cells that follow.
//!
//! `--vary key=v1,v2` varies any key that `--set` sets; commas inside brackets or quotes belong to a
//! value. The last axis varies fastest. Not here: running the cells, and where their results lie.

use super::error::ScenarioError;
use super::load::Override;
use serde::{Deserialize, Serialize};
use shared_types::limits::SWEEP_CELLS_MAX;

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

    /// The last word of the key, which tells axes apart in tables unless two end alike.
    #[must_use]
    pub fn short_name(&self) -> &str {
        self.key.rsplit('.').next().unwrap_or(&self.key)
    }
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
    use super::{Axis, grid};

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
    fn the_last_axis_varies_fastest() {
        let cells = grid(&[axis("a=1,2"), axis("b=x,y,z")]).expect("six cells");
        let cells: Vec<String> = cells.iter().map(|cell| cell.concat()).collect();
        assert_eq!(cells, ["1x", "1y", "1z", "2x", "2y", "2z"]);
    }
}
