//! The files that the rules are about.

use crate::rust_text::{RustFile, mark_modules_for_tests};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Directories with Rust code; build outputs and results of runs lie elsewhere.
const CRATES: [&str; 4] = ["shared-types", "agent", "orchestrator", "benches"];

/// Entries that are no part of the repository.
const NOT_OURS: [&str; 6] = [".git", "target", "runs", "__pycache__", "corpus", "artifacts"];

/// The repository that this test was built in.
pub(crate) struct Repository {
    root: PathBuf,
}

impl Repository {
    pub(crate) fn find() -> Self {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned();
        Self { root }
    }

    pub(crate) fn read(&self, path: &str) -> String {
        std::fs::read_to_string(self.root.join(path)).unwrap()
    }

    /// Every Rust file of the workspace, sorted by path.
    pub(crate) fn rust_files(&self) -> Vec<RustFile> {
        let mut paths = Vec::new();
        for directory in CRATES {
            self.walk(&self.root.join(directory), &mut paths);
        }
        paths.retain(|path| path.ends_with(".rs"));
        let texts = self.texts(paths);
        let mut files: Vec<RustFile> =
            texts.iter().map(|(path, source)| RustFile::new(path, source)).collect();
        mark_modules_for_tests(&mut files);
        files
    }

    /// Path and content of every text that the repository tracks; without git, of every text that is
    /// not ignored.
    pub(crate) fn tracked_texts(&self) -> Vec<(String, String)> {
        let paths = self.output("git", &["ls-files", "-z"]).map_or_else(
            || {
                let mut paths = Vec::new();
                self.walk(&self.root, &mut paths);
                paths
            },
            |listed| listed.split_terminator('\0').map(str::to_owned).collect(),
        );
        self.texts(paths)
    }

    /// What `cargo tree` says of each dependency: licence, a tab, the package.
    pub(crate) fn cargo_tree_with_licences(&self) -> String {
        let cargo = std::env::var("CARGO").unwrap();
        let arguments = "tree --workspace --offline --locked --prefix none --format {l}\t{p}";
        self.output(&cargo, &arguments.split(' ').collect::<Vec<_>>()).unwrap()
    }

    /// Standard output of a program that succeeds in the repository's root.
    #[expect(clippy::disallowed_methods, reason = "git and cargo know what belongs to the project")]
    fn output(&self, program: &str, arguments: &[&str]) -> Option<String> {
        let output = Command::new(program).args(arguments).current_dir(&self.root).output().ok()?;
        output.status.success().then(|| String::from_utf8(output.stdout).unwrap())
    }

    fn walk(&self, directory: &Path, paths: &mut Vec<String>) {
        for entry in std::fs::read_dir(directory).unwrap() {
            let entry = entry.unwrap();
            if NOT_OURS.iter().any(|name| entry.file_name() == *name) {
                continue;
            }
            if entry.file_type().unwrap().is_dir() {
                self.walk(&entry.path(), paths);
            } else {
                let path = entry.path().strip_prefix(&self.root).unwrap().to_owned();
                paths.push(path.into_os_string().into_string().unwrap());
            }
        }
    }

    /// The texts at `paths`, sorted; what is deleted or no text is left out.
    fn texts(&self, mut paths: Vec<String>) -> Vec<(String, String)> {
        paths.sort();
        paths
            .into_iter()
            .filter_map(|path| {
                Some((
                    path.clone(),
                    String::from_utf8(std::fs::read(self.root.join(path)).ok()?).ok()?,
                ))
            })
            .collect()
    }
}
