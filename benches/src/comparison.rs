//! What programs that compare the product with something have in common: the command line, and how
//! their result is printed.

use crate::raw::command::Format;
use clap::Args;
use serde_json::Value;
use std::error::Error;
use std::fmt::Display;
use std::path::PathBuf;
use std::process::ExitCode;

/// How the result is printed.
#[derive(Clone, Copy, Debug, Args)]
pub struct Output {
    /// How the result is printed; progress goes to standard error
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

/// Which executable is asked, and about what fleet.
#[derive(Clone, Debug, Args)]
pub struct Asked {
    /// The executable to ask; by default the one beside this program
    #[arg(long)]
    slateswarm: Option<PathBuf>,
    /// Crafts of a fleet
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(2..=128))]
    pub crafts: u32,
}

impl Asked {
    /// The executable `slateswarm`.
    ///
    /// # Errors
    /// If the system does not say where this program lies.
    pub fn slateswarm(&self) -> std::io::Result<PathBuf> {
        self.slateswarm.clone().map_or_else(|| beside("slateswarm"), Ok)
    }
}

/// A result that can be printed.
pub trait Outcome: Display {
    /// All of it.
    fn to_json(&self) -> Value;
}

/// The program called `name` beside this one.
///
/// # Errors
/// If the system does not say where this program lies.
pub fn beside(name: &str) -> std::io::Result<PathBuf> {
    Ok(std::env::current_exe()?.with_file_name(name))
}

impl Output {
    /// Compares, and ends the program with the result or with why there is none.
    pub fn conclude<O: Outcome>(
        self,
        compare: impl FnOnce() -> Result<O, Box<dyn Error>>,
    ) -> ExitCode {
        let result = if cfg!(debug_assertions) {
            Err("times of unoptimised programs mean nothing; build with --release".into())
        } else {
            compare()
        };
        match (result, self.format) {
            (Ok(outcome), Format::Text) => println!("{outcome}"),
            (Ok(outcome), Format::Json) => println!("{}", outcome.to_json()),
            (Err(error), _) => {
                eprintln!("error: {error}");
                return ExitCode::FAILURE;
            }
        }
        ExitCode::SUCCESS
    }
}
