//! docs/tutorial.md and docs/howto.md: their commands run, in their order, and say what the pages show.

mod common;

use std::fmt::Write as _;
use std::path::Path;

use common::{assert_success, folder, program};

/// Files that a page lets its reader write: blocks of TOML whose first line is their name.
fn write_files(page: &str, folder: &Path) {
    for block in page.split("```toml\n# ").skip(1) {
        let (name, rest) = block.split_once('\n').expect("a name");
        let (text, _) = rest.split_once("```").expect("an end");
        std::fs::write(folder.join(name), text).expect("a file of the page");
    }
}

/// Runs the commands of a page in a folder; `between` may do there what the reader does between them. Their number.
fn follow(name: &str, page: &str, folder: &Path, between: &dyn Fn()) -> usize {
    let mut lines = page.lines();
    let mut commands = 0;
    while lines.by_ref().any(|line| line == "```console") {
        let mut said = String::new();
        for line in lines.by_ref().take_while(|line| *line != "```") {
            if let Some(command) = line.strip_prefix("$ imu-stand ") {
                between();
                let words: Vec<&str> = command.split_whitespace().collect();
                let output = program(&words).current_dir(folder).output();
                let output = output.expect("the program starts");
                assert_success(&output);
                said = String::from_utf8_lossy(&output.stdout).into_owned();
                commands += 1;
            } else if let Some(name) = line.strip_prefix("$ mkdir ") {
                std::fs::create_dir(folder.join(name)).expect("a folder");
            } else if line != "..." {
                assert!(
                    said.lines().any(|own| own.trim_end() == line),
                    "docs/{name} shows\n{line}\nand the program says\n{said}"
                );
            }
        }
    }
    commands
}

#[test]
fn the_commands_of_the_tutorial_say_what_it_shows() {
    let page = include_str!("../../../docs/tutorial.md");
    let folder = folder("tutorial");
    let commands = follow("tutorial.md", page, &folder, &|| {});
    assert!(commands > 10, "{commands} commands: is it the tutorial?");
}

/// The log of another logger, of the rehearsal's readings: counts, and degC of a thermometer.
fn log_of(rehearsal: &str) -> String {
    let mut log = "# Gyro scale: 131 LSB/(deg/s)\nms,gx,gy,gz,temp_degC\n".to_owned();
    let rows = rehearsal
        .lines()
        .filter(|line| line.starts_with(|c: char| c.is_ascii_digit()));
    for (k, row) in rows.enumerate() {
        let cells: Vec<&str> = row.split(',').collect();
        let temp: f64 = cells[6].parse().expect("counts of a thermometer");
        let _ = writeln!(
            log,
            "{},{},{},{},{:.2}",
            20 * k,
            cells[3],
            cells[4],
            cells[5],
            25.0 + 0.1453 * temp
        );
    }
    log
}

#[test]
fn the_commands_of_the_how_to_say_what_it_shows() {
    let page = include_str!("../../../docs/howto.md");
    let folder = folder("howto");
    write_files(page, &folder);
    let record = || {
        if let Ok(rehearsal) = std::fs::read_to_string(folder.join("rehearsal.csv")) {
            std::fs::write(folder.join("log.csv"), log_of(&rehearsal)).expect("a log");
        }
    };
    let commands = follow("howto.md", page, &folder, &record);
    assert!(commands > 3, "{commands} commands: is it the how-to?");
}
