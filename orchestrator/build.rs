//! Puts the commit that is checked out into `SLATESWARM_COMMIT`, so that results can name it.
//!
//! Reads git's files itself, so building needs no git; without a repository the commit is `unknown`.
//! Whether the tree was changed since is not seen here: the digest of the executable, which
//! results carry as well, tells two builds of one commit apart.

use std::path::{Path, PathBuf};

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let crate_directory = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let commit = crate_directory.ancestors().find_map(commit_of).unwrap_or_default();
    let is_commit = commit.len() >= 40 && commit.bytes().all(|byte| byte.is_ascii_hexdigit());
    let name = if is_commit { &commit[..12] } else { "unknown" };
    println!("cargo::rustc-env=SLATESWARM_COMMIT={name}");
}

/// The commit checked out in `root`, `None` if that is no work tree.
fn commit_of(root: &Path) -> Option<String> {
    let marker = root.join(".git");
    // In a linked work tree `.git` is a file that says where its own directory lies.
    let own = match std::fs::read_to_string(&marker) {
        Ok(text) => root.join(text.strip_prefix("gitdir:")?.trim()),
        Err(_) => marker,
    };
    let head = read_watched(&own.join("HEAD"))?;
    let Some(reference) = head.trim().strip_prefix("ref:").map(str::trim) else {
        return Some(head.trim().to_owned());
    };
    let shared = match std::fs::read_to_string(own.join("commondir")) {
        Ok(text) => own.join(text.trim()),
        Err(_) => own,
    };
    read_watched(&shared.join(reference)).map(|commit| commit.trim().to_owned()).or_else(|| {
        let packed = read_watched(&shared.join("packed-refs"))?;
        packed
            .lines()
            .find_map(|line| line.strip_suffix(reference)?.split(' ').next().map(str::to_owned))
    })
}

/// The text of a file, which from now on triggers a new build when it changes.
fn read_watched(path: &Path) -> Option<String> {
    let text = std::fs::read_to_string(path).ok()?;
    println!("cargo::rerun-if-changed={}", path.display());
    Some(text)
}
