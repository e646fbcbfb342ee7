//! What this executable does when a test starts it: a craft as the launcher starts one (`agent`), or a
//! small part (`play ROLE READY-FILE`).

use agent::process::startup::{AgentArguments, take_first_steps};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use shared_types::transport::RunPaths;
use std::ffi::OsString;
use std::io::Write as _;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// The craft that never looks whether it shall end.
pub(crate) const HANGING_CRAFT: u32 = 3;

/// Exit code of a craft whose first steps failed.
pub(crate) const REFUSED: u8 = 2;

/// Plays the part that `arguments` name, `None` if they name none.
pub(crate) fn play(arguments: &[OsString]) -> Option<ExitCode> {
    match arguments {
        [verb, options @ ..] if verb == "agent" => Some(play_craft(options)),
        [verb, role, ready] if verb == "play" => {
            Some(play_role(role.to_str().expect("role"), Path::new(ready)))
        }
        _ => None,
    }
}

/// A craft without ports: takes the first steps, says so in a file of the run, waits for its end.
fn play_craft(options: &[OsString]) -> ExitCode {
    let arguments = AgentArguments::from_command_line(options.iter().cloned()).expect("options");
    let ending = match take_first_steps(&arguments) {
        Ok(ending) => ending,
        Err(error) => {
            eprintln!("{error}");
            return ExitCode::from(REFUSED);
        }
    };
    let root = RunPaths::below(&arguments.base, arguments.run).root();
    say(&root.join(format!("craft-{}", arguments.craft)), std::process::id());
    if arguments.craft.0 == HANGING_CRAFT {
        sleep_for_ever();
    }
    while !ending.is_requested() {
        // A signal ends the wait without having asked for anything; look and wait on.
        let _interrupted = poll(&mut [PollFd::new(&ending, PollFlags::IN)], None);
    }
    ending.begin();
    ExitCode::SUCCESS
}

fn play_role(role: &str, ready: &Path) -> ExitCode {
    let is_deaf = Arc::new(AtomicBool::new(false));
    if role == "deaf" {
        signal_hook::flag::register(signal_hook::consts::SIGTERM, is_deaf).expect("handler");
    }
    match role {
        "sleep" | "deaf" => {
            say(ready, std::process::id());
            sleep_for_ever()
        }
        "quit" => say(ready, std::process::id()),
        "fail" => {
            say(ready, std::process::id());
            eprintln!("no fuel");
            return ExitCode::from(7);
        }
        "babble" => {
            say(ready, std::process::id());
            eprint!("{}", "x".repeat(1_000_000));
        }
        "descriptors" => {
            say(ready, std::process::id());
            for entry in std::fs::read_dir("/proc/self/fd").expect("own descriptors") {
                let path = entry.expect("entry").path();
                let target = std::fs::read_link(&path).expect("target");
                eprintln!("{} {}", path.display(), target.display());
            }
        }
        "orchestrator" => {
            super::runs::play_orchestrator(ready);
            sleep_for_ever()
        }
        _ => return ExitCode::from(99),
    }
    ExitCode::SUCCESS
}

/// Writes a line into a file, so that it is there as a whole or not at all.
pub(crate) fn say(path: &Path, line: impl std::fmt::Display) {
    let draft = path.with_extension("draft");
    let mut file = std::fs::File::create(&draft).expect("file");
    writeln!(file, "{line}").expect("file");
    std::fs::rename(draft, path).expect("file");
}

fn sleep_for_ever() -> ! {
    loop {
        let _interrupted = poll(&mut [], Some(&Timespec { tv_sec: 3600, tv_nsec: 0 }));
    }
}
