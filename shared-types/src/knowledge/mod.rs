//! What crafts know: facts with versions, and the networks of rules and actions over them.
//!
//! A [`FleetNetwork`] is built once per trial (generated, or compiled from a mission file), is then
//! immutable, and travels as one rkyv archive in shared memory. Everything that reasons reads it
//! through a [`FleetView`], which is the same whether the network lies in the builder's memory or in
//! the archive: slices of 32-bit numbers, read in place. Not here: the state of a board while it runs
//! (agent, `blackboard`), and how networks are made (orchestrator, `scenario`).

mod board;
mod csr;
mod detour;
mod fact;
mod fleet;
pub mod grid;

pub use board::{Assignment, BoardNetwork, BoardView, Literal, Target};
pub use csr::{Csr, CsrView};
pub use fact::{Change, FactState, Value, Version};
pub use fleet::{
    ArchivedFleetNetwork, FleetNetwork, FleetView, NetworkError, Topology, TopologyView,
};
