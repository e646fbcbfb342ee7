//! The command `slateswarm`: reads the command line and ends with the verb's exit code.
//!
//! A craft's process is this same executable with the verb `agent`, so that versions cannot differ.

use agent::process::startup::AgentArguments;
use clap::Parser;
use orchestrator::cli::Cli;
use orchestrator::commands;
use orchestrator::launch::beside::end_with_parent;
use orchestrator::outcome::Outcome;
use std::process::ExitCode;

fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1);
    if arguments.next().is_some_and(|verb| verb == "agent") {
        return agent(arguments);
    }
    if let Err(what) = end_with_parent() {
        eprintln!("slateswarm: {what}");
        return ExitCode::from(Outcome::Usage.code());
    }
    let cli = Cli::parse();
    let outcome = commands::carry_out(&cli).unwrap_or_else(|refusal| {
        refusal.print();
        Outcome::Usage
    });
    ExitCode::from(outcome.code())
}

/// Lives as a craft.
fn agent(arguments: impl Iterator<Item = std::ffi::OsString>) -> ExitCode {
    let arguments = match AgentArguments::from_command_line(arguments) {
        Ok(arguments) => arguments,
        Err(error) => {
            eprintln!("slateswarm: {error}");
            return ExitCode::from(Outcome::Usage.code());
        }
    };
    match agent::process::run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("slateswarm: {error}");
            ExitCode::from(Outcome::Usage.code())
        }
    }
}
