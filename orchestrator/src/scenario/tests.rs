//! Scenarios as users write them: presets, precedence, and what is refused where with which remedy.

mod bad_input;
mod levels;
mod precedence;
mod presets;
mod robustness;
