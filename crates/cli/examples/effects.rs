//! `cargo xtask effects`: writes docs/effects.md and its figures; with `--check` it writes nothing and tells what is old.

use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let check = match std::env::args().nth(1).as_deref() {
        None => false,
        Some("--check") => true,
        Some(other) => {
            eprintln!("error: {other} is no option of this command");
            eprintln!("help:  cargo xtask effects [--check]");
            return ExitCode::from(2);
        }
    };
    let files = match imu_stand::report::exhibits::effects_page() {
        Ok(files) => files,
        Err(error) => {
            eprintln!("error: {error}");
            eprintln!("help:  mend the example in the effect's file in crates/model/src/effects/");
            return ExitCode::FAILURE;
        }
    };
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let old: Vec<_> = files
        .iter()
        .filter(|(path, text)| std::fs::read_to_string(root.join(path)).ok().as_ref() != Some(text))
        .collect();
    for (path, text) in &old {
        println!("{} {path}", if check { "old:" } else { "written:" });
        if check {
            continue;
        }
        let file = root.join(path);
        let folder = file.parent().unwrap_or(&root);
        if let Err(error) =
            std::fs::create_dir_all(folder).and_then(|()| std::fs::write(&file, text))
        {
            eprintln!("error: {}: {error}", file.display());
            eprintln!("help:  make room or rights for it");
            return ExitCode::FAILURE;
        }
    }
    println!(
        "{} of {} files were as they are made",
        files.len() - old.len(),
        files.len()
    );
    if check && !old.is_empty() {
        eprintln!("help:  cargo xtask effects renews them");
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}
