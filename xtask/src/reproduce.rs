//! Whether the image depends on the folder that it is built in.

use std::path::Path;
use std::time::Instant;

use crate::image;
use crate::mutants::tree::Tree;
use crate::step::{Failure, Pace};

/// Builds the image here and from a copy of the tree in another folder with a target folder of its own, and compares the hex files.
///
/// # Errors
/// Toolchain, build, or another byte.
pub fn check(root: &Path) -> Result<(), Failure> {
    let copy = Tree::copy(root, "elsewhere")?;
    let mut hex = Vec::new();
    for folder in [root, copy.root()] {
        let from = Instant::now();
        let path = image::build(folder, &mut Pace::Rarer(0))?
            .elf
            .with_extension("hex");
        println!("{}: {:.0} s", path.display(), from.elapsed().as_secs_f64());
        hex.push(std::fs::read_to_string(&path).map_err(|error| {
            Failure::new(&format!("{}: {error}", path.display()), "run it again")
        })?);
    }
    match difference(&hex[0], &hex[1]) {
        None => {
            println!("the same image, to the byte");
            Ok(())
        }
        Some(line) => Err(Failure::new(
            &format!("the image depends on its folder: line {line} of firmware.hex differs"),
            "paths are in the image (`file!()`, panics), or debug information, which they make longer, moves what `--relax` takes out",
        )),
    }
}

/// The first line, from 1, in which two files differ.
fn difference(one: &str, other: &str) -> Option<usize> {
    if one == other {
        return None;
    }
    let same = one.lines().zip(other.lines()).take_while(|(a, b)| a == b);
    Some(same.count() + 1)
}

#[cfg(test)]
mod tests {
    use super::difference;

    #[test]
    fn another_byte_and_another_length_are_told_by_their_line() {
        assert_eq!(difference(":00\n:01\n", ":00\n:01\n"), None);
        assert_eq!(difference(":00\n:01\n", ":00\n:02\n"), Some(2));
        assert_eq!(difference(":00\n", ":00\n:02\n"), Some(2));
        assert_eq!(difference("", ":00\n"), Some(1));
    }
}
