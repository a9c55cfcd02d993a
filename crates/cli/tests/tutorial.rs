//! docs/tutorial.md: its commands run, in their order, and say what the page shows.

mod common;

use common::{assert_success, folder, program};

#[test]
fn the_commands_of_the_tutorial_say_what_it_shows() {
    let page = include_str!("../../../docs/tutorial.md");
    let folder = folder("tutorial");
    let mut lines = page.lines();
    let mut commands = 0;
    while lines.by_ref().any(|line| line == "```console") {
        let mut said = String::new();
        for line in lines.by_ref().take_while(|line| *line != "```") {
            if let Some(command) = line.strip_prefix("$ imu-stand ") {
                let words: Vec<&str> = command.split_whitespace().collect();
                let output = program(&words).current_dir(&folder).output();
                let output = output.expect("the program starts");
                assert_success(&output);
                said = String::from_utf8_lossy(&output.stdout).into_owned();
                commands += 1;
            } else if let Some(name) = line.strip_prefix("$ mkdir ") {
                std::fs::create_dir(folder.join(name)).expect("a folder");
            } else if line != "..." {
                assert!(
                    said.lines().any(|own| own.trim_end() == line),
                    "docs/tutorial.md shows\n{line}\nand the program says\n{said}"
                );
            }
        }
    }
    assert!(commands > 10, "{commands} commands: is it the tutorial?");
}
