//! Writes the seeds of every body below the directory in `SEEDS`, a folder each; fuzzes nothing. A fuzzer
//! all the same: what is built to be fuzzed links with nothing else.

#![no_main]

use std::path::Path;

fn write() -> std::io::Result<()> {
    let root = std::env::var_os("SEEDS").expect("usage: SEEDS=DIR seeds -runs=0");
    for body in orchestrator::fuzzing::BODIES {
        let folder = Path::new(&root).join(body.name);
        std::fs::create_dir_all(&folder)?;
        for (number, seed) in (body.seeds)().iter().enumerate() {
            std::fs::write(folder.join(format!("seed-{number}")), seed)?;
        }
    }
    Ok(())
}

libfuzzer_sys::fuzz_target!(init: write().expect("the disk takes it"), |_bytes: &[u8]| {});
