//! `[fleet]`, `[[craft]]` and `[topology]`: who flies, on what it runs, who stands below whom.

use crate::transport::WakeMode;
use schemars::JsonSchema;
use serde::de::{MapAccess, Visitor, value::MapAccessDeserializer};
use serde::{Deserialize, Deserializer, Serialize};
use std::fmt;

/// `[fleet]`: how many crafts, and how their processes share the machine.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct Fleet {
    /// Crafts as a number (`craft-0`, `craft-1`, ...) or by tier
    /// (`{ orbital = 1, aerial = 2, ground = 6 }`: `orbital-0`, `aerial-0`, ...). Left out where
    /// `[[craft]]` lists them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crafts: Option<CraftCount>,
    /// How processes are pinned to cores; default `balanced`.
    pub pinning: Pinning,
    /// Cores that the fleet is confined to; default all that the process may use.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cores: Option<u32>,
    /// How an idle process waits: `poll`, `adaptive` or `block`; default `adaptive`.
    pub wake: WakeMode,
}

/// How many crafts there are.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum CraftCount {
    /// So many, all of tier `ground`.
    Number(u32),
    /// So many of each tier, in the order orbital, aerial, ground.
    ByTier(TierCounts),
}

impl CraftCount {
    /// How many crafts that are together.
    #[must_use]
    pub const fn total(&self) -> u64 {
        match self {
            Self::Number(crafts) => *crafts as u64,
            Self::ByTier(tiers) => tiers.orbital as u64 + tiers.aerial as u64 + tiers.ground as u64,
        }
    }
}

impl<'de> Deserialize<'de> for CraftCount {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberOrTiers;

        impl<'de> Visitor<'de> for NumberOrTiers {
            type Value = CraftCount;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("a number of crafts, or numbers by tier")
            }

            fn visit_i64<E: serde::de::Error>(self, number: i64) -> Result<Self::Value, E> {
                u32::try_from(number).map(CraftCount::Number).map_err(|_| {
                    E::invalid_value(serde::de::Unexpected::Signed(number), &"a number of crafts")
                })
            }

            fn visit_u64<E: serde::de::Error>(self, number: u64) -> Result<Self::Value, E> {
                u32::try_from(number).map(CraftCount::Number).map_err(|_| {
                    E::invalid_value(serde::de::Unexpected::Unsigned(number), &"a number of crafts")
                })
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                TierCounts::deserialize(MapAccessDeserializer::new(map)).map(CraftCount::ByTier)
            }
        }

        deserializer.deserialize_any(NumberOrTiers)
    }
}

/// Crafts of each tier.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct TierCounts {
    /// Orbiters; default 0.
    pub orbital: u32,
    /// Aerial crafts; default 0.
    pub aerial: u32,
    /// Ground crafts; default 0.
    pub ground: u32,
}

/// Where a craft works.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Tier {
    /// In orbit.
    Orbital,
    /// In the air.
    Aerial,
    /// On the ground.
    #[default]
    Ground,
}

/// How processes are placed on cores.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Pinning {
    /// Each process on one core, by a balanced random map drawn from the seed.
    #[default]
    Balanced,
    /// The kernel decides.
    Unpinned,
}

/// `[[craft]]`: one craft by name.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct CraftEntry {
    /// Its name: letters, digits, `-` and `_`; unique in the fleet.
    pub name: String,
    /// Its tier; default `ground`.
    #[serde(default)]
    pub tier: Tier,
    /// The craft above it in the tree; left out for the root, and under other trees than `listed`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub parent: Option<String>,
    /// Its group, for the strategy hybrid; every craft has one or none has.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub group: Option<String>,
    /// Where it is: x, y, z in metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position: Option<[f64; 3]>,
    /// Facts that hold on its board at the start; of a boundary fact on all that share it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub initial: Vec<String>,
    /// Facts whose assertion on its board completes the mission.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub r#final: Vec<String>,
}

/// `[topology]`: the tree of the hierarchy, and groups where `[[craft]]` does not state them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct TopologySection {
    /// The tree; default `listed` if a craft names its parent, else `binary`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tree: Option<Tree>,
    /// Puts so many consecutive crafts into one group each; left out where `[[craft]]` states groups
    /// or none are wanted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub group_size: Option<u32>,
}

/// Who stands below whom.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Tree {
    /// The published experiment's: the parent of craft v is (v - 1) / 2.
    Binary,
    /// The parent of craft v is v - 1.
    Chain,
    /// The first craft is the parent of all others.
    Star,
    /// As `parent` says.
    Listed,
}
