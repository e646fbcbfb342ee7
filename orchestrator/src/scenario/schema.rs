//! The JSON schema of the scenario file, for editors, and for what errors say about a key.

use serde_json::Value;
use shared_types::scenario::Scenario;

/// The schema of the scenario file (JSON Schema 2020-12).
#[must_use]
pub fn schema() -> Value {
    let mut schema = schemars::schema_for!(Scenario).to_value();
    // Serde's other name of the key, which schemars does not know of.
    if let Some(keys) = schema.pointer_mut("/$defs/Replication/properties") {
        keys["strategy"] = keys["strategies"].clone();
    }
    schema
}

/// What the schema says about the key that `path` leads to, as one line.
pub(super) fn description(path: &[&str]) -> Option<String> {
    let root = schema();
    let mut here = &root;
    for key in path {
        here = property(&root, here, key)?;
    }
    let text = here.get("description")?.as_str()?;
    Some(text.split_whitespace().collect::<Vec<_>>().join(" "))
}

/// The property `key` of an object, an optional object, or a list of objects.
fn property<'v>(root: &'v Value, at: &'v Value, key: &str) -> Option<&'v Value> {
    let at = match at.get("$ref").and_then(Value::as_str) {
        Some(reference) => root.pointer(reference.strip_prefix('#')?)?,
        None => at,
    };
    if let Some(found) = at.get("properties").and_then(|properties| properties.get(key)) {
        return Some(found);
    }
    if let Some(items) = at.get("items") {
        return property(root, items, key);
    }
    let choices = at.get("anyOf").or_else(|| at.get("oneOf"))?.as_array()?;
    choices.iter().find_map(|choice| property(root, choice, key))
}

#[cfg(test)]
mod tests {
    use super::{description, schema};

    #[test]
    fn every_key_of_every_section_is_described() {
        fn walk(value: &serde_json::Value, undescribed: &mut Vec<String>) {
            if let Some(properties) = value.get("properties").and_then(|found| found.as_object()) {
                for (key, property) in properties {
                    if property.get("description").is_none() {
                        undescribed.push(key.clone());
                    }
                }
            }
            match value {
                serde_json::Value::Object(entries) => {
                    entries.values().for_each(|entry| walk(entry, undescribed));
                }
                serde_json::Value::Array(items) => {
                    items.iter().for_each(|item| walk(item, undescribed));
                }
                _ => {}
            }
        }
        let mut undescribed = Vec::new();
        walk(&schema(), &mut undescribed);
        assert_eq!(undescribed, Vec::<String>::new());
    }

    #[test]
    fn every_key_of_a_resolved_preset_stands_in_the_schema() {
        fn walk(value: &toml::Value, path: &mut Vec<String>) {
            match value {
                toml::Value::Table(table) => {
                    for (key, value) in table {
                        path.push(key.clone());
                        let keys: Vec<&str> = path.iter().map(String::as_str).collect();
                        assert!(description(&keys).is_some(), "{path:?}");
                        walk(value, path);
                        path.pop();
                    }
                }
                toml::Value::Array(items) => items.iter().for_each(|item| walk(item, path)),
                _ => {}
            }
        }
        for preset in crate::scenario::PRESETS {
            let scenario = crate::scenario::load_text(preset.name, preset.text, &[]).unwrap();
            let written: toml::Table = scenario.to_toml().parse().unwrap();
            walk(&toml::Value::Table(written), &mut Vec::new());
        }
        assert!(description(&["replication", "strategy"]).is_some());
    }

    #[test]
    fn a_key_is_found_through_references_and_lists() {
        assert!(description(&["run", "turns"]).unwrap().starts_with("Most turns of one trial"));
        assert!(description(&["rule", "if"]).unwrap().starts_with("Its premises"));
        assert!(description(&["link", "from-positions", "range-m"]).unwrap().contains("radio"));
        assert_eq!(description(&["run", "velocity"]), None);
    }
}
