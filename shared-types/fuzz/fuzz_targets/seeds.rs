//! Writes the seeds of every body below the directory that is named, a folder each.

fn main() -> std::io::Result<()> {
    let root = std::env::args_os().nth(1).expect("usage: seeds DIR");
    for body in shared_types::fuzzing::BODIES {
        let folder = std::path::Path::new(&root).join(body.name);
        std::fs::create_dir_all(&folder)?;
        for (number, seed) in (body.seeds)().iter().enumerate() {
            std::fs::write(folder.join(format!("seed-{number}")), seed)?;
        }
    }
    Ok(())
}
