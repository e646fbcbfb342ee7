//! From nothing to a fleet of processes: what it needs, where it lives, how it starts.
//!
//! The order of a start: `resources` refuses what the host cannot carry, `run_root` makes the place on
//! tmpfs and takes its lock, `placement` draws who runs where, `os_process` spawns. Watching and ending
//! the processes is `supervision`'s work.

pub mod beside;
pub mod craft_process;
pub mod host;
pub mod janitor;
pub mod leftovers;
pub mod os_process;
pub mod placement;
pub mod resources;
pub mod run_root;
