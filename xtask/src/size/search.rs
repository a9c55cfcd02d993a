//! The options of avr-gcc with which the C reference takes least flash: `cargo xtask size --search-flags`.
//!
//! The options in `flags` stay. Every other one that avr-gcc tells of `-Os`, and three of the AVR's own, is turned over, one
//! at a time: on where it is off, off where it is on. One that makes the image smaller, and takes no more static SRAM, stays as
//! it is then; the next is tried beside it. That goes round until none has made it smaller for a whole round, in which those
//! that were taken are left out again as well. The order is avr-gcc's, so the same compiler finds the same options.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::sync::atomic::{AtomicU32, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use super::{Cost, build_with, gcc, measure, reference_folder};
use crate::image::{self, Sizes};
use crate::step::{Failure, Pace, Progress, commit, date, said_by};

/// What `--write` writes.
const PAGE: &str = "docs/c-flags.txt";
const HELP: &str =
    "cargo xtask size --search-flags [OPTION...] [--write], with options of avr-gcc to begin with";
/// What avr-gcc does not tell among its optimizers.
const OF_THE_AVR: [&str; 3] = ["-mcall-prologues", "-maccumulate-args", "-mstrict-X"];

/// Options beside those in `flags`.
type Options = Vec<String>;

/// What is asked for.
#[derive(Debug, Default, PartialEq)]
struct Asked {
    from: Options,
    write: bool,
}

impl Asked {
    fn of(arguments: &[String]) -> Result<Self, Failure> {
        let mut asked = Self::default();
        for word in arguments {
            match word.as_str() {
                "--write" => asked.write = true,
                option if option.starts_with("-f") || option.starts_with("-m") => {
                    asked.from.push(word.clone());
                }
                _ => {
                    let what = format!("`cargo xtask size --search-flags`: it knows no {word}");
                    return Err(Failure::new(&what, HELP));
                }
            }
        }
        Ok(asked)
    }
}

/// An option that was taken, or left out again, and the image since.
struct Found {
    what: String,
    image: PathBuf,
    sizes: Sizes,
}

/// Searches, prints what was found, and keeps it where that is asked for.
///
/// # Errors
/// No compiler, or the reference does not build.
pub fn search(root: &Path, arguments: &[String]) -> Result<(), Failure> {
    let asked = Asked::of(arguments)?;
    let candidates = candidates(root)?;
    let folder = root.join("target/avr/search");
    let no_folder = |error: std::io::Error| {
        let what = format!("{}: {error}", folder.display());
        Failure::new(&what, "make room or rights for it")
    };
    std::fs::create_dir_all(&folder).map_err(no_folder)?;
    let built = |options: &[String], name: &str| -> Option<(PathBuf, Sizes)> {
        let image = folder.join(name);
        build_with(root, options, &image, Stdio::null()).ok()?;
        let sizes = image::sizes(&image).ok()?;
        Some((image, sizes))
    };
    let begun = |options: &[String], name: &str, what: String| -> Result<Found, Failure> {
        let (image, sizes) = built(options, name).ok_or_else(|| {
            let what = format!("the C reference does not build with {what}");
            Failure::new(&what, "`cargo xtask size` shows the compiler's own message")
        })?;
        Ok(Found { what, image, sizes })
    };
    let mut all = vec![begun(&[], "0.elf", "flags".to_owned())?];
    if !asked.from.is_empty() {
        all.push(begun(&asked.from, "1.elf", asked.from.join(" "))?);
    }
    let (builds, most) = (AtomicUsize::new(0), all[0].sizes.sram);
    let from = all.last().map_or(u32::MAX, |found| found.sizes.flash);
    let progress = Mutex::new(Progress::new("search", Pace::Rarer(0)));
    let smallest = AtomicU32::new(from);
    let mut taken = asked.from.clone();
    let flash = |options: &[String], worker: usize| {
        let number = builds.fetch_add(1, Ordering::Relaxed) + 1;
        if let Ok(mut progress) = progress.lock() {
            let least = smallest.load(Ordering::Relaxed);
            progress.tick(&format!("{number} builds, {least} B with the best"));
        }
        let (_, sizes) = built(options, &format!("worker-{worker}.elf"))?;
        (sizes.sram <= most).then_some(sizes.flash)
    };
    let mut failure = None;
    least(
        &candidates,
        &mut taken,
        from,
        flash,
        |options, what, flash| {
            smallest.store(flash, Ordering::Relaxed);
            match begun(options, &format!("{}.elf", all.len()), what.to_owned()) {
                Ok(found) => all.push(found),
                Err(why) => failure = Some(why),
            }
        },
    );
    // A builder that panicked has said so.
    let progress = progress
        .into_inner()
        .unwrap_or_else(PoisonError::into_inner);
    progress.end();
    failure.map_or(Ok(()), Err)?;
    let images: Vec<&Path> = all.iter().map(|found| found.image.as_path()).collect();
    let costs = measure(root, &images);
    if let Err(why) = &costs {
        println!("stack and cycles are not measured: {why}");
    }
    let compiler = said_by(&mut gcc(root, &["--version"]));
    let head = format!(
        "# `cargo xtask size --search-flags --write` writes this: the options of least flash for the C reference (measurements.md, \
         The image).\n# {}, commit {}; {}; {} options, {} builds\n",
        date(),
        commit(root),
        compiler.lines().next().unwrap_or_default(),
        candidates.len(),
        builds.into_inner()
    );
    let page = format!("{head}\n{}", table(&all, costs.ok().as_deref(), &taken));
    print!("{page}");
    if asked.write {
        std::fs::write(root.join(PAGE), page)
            .map_err(|error| Failure::new(&format!("{PAGE}: {error}"), "is it writable?"))?;
    }
    Ok(())
}

/// What may be turned over beside `flags`.
fn candidates(root: &Path) -> Result<Options, Failure> {
    let told = said_by(&mut gcc(root, &["-Os", "-Q", "--help=optimizers"]));
    let flags = reference_folder(root).join("flags");
    let flags = std::fs::read_to_string(&flags).map_err(|error| {
        Failure::new(&format!("{}: {error}", flags.display()), "is it all there?")
    })?;
    let mut all: Options = OF_THE_AVR.map(str::to_owned).to_vec();
    all.extend(turned_over(&told, &flags));
    if all.len() == OF_THE_AVR.len() {
        return Err(Failure::new(
            "avr-gcc does not tell its optimizers",
            "is it installed (apt-get install gcc-avr avr-libc), or does AVR_GCC name it?",
        ));
    }
    Ok(all)
}

/// The other way round of each option that is on or off in `-Q --help=optimizers`, but for those that `flags` sets.
fn turned_over(told: &str, flags: &str) -> Options {
    let name = |option: &str| option.trim_start_matches("-f").replacen("no-", "", 1);
    let set: Vec<String> = flags.split_whitespace().map(name).collect();
    let lines = told.lines().filter_map(|line| {
        let (option, state) = line.trim().split_once(char::is_whitespace)?;
        let bare = option.strip_prefix("-f")?;
        match state.trim() {
            "[enabled]" => Some((bare, format!("-fno-{bare}"))),
            "[disabled]" => Some((bare, option.to_owned())),
            _ => None,
        }
    });
    lines
        .filter(|(bare, _)| !set.iter().any(|name| name == bare))
        .map(|(_, option)| option)
        .collect()
}

/// With one more option, or without it where it is there; what was done.
fn with(taken: &[String], option: &String) -> (Options, String) {
    let mut options: Options = taken.iter().filter(|o| *o != option).cloned().collect();
    if options.len() < taken.len() {
        return (options, format!("without {option}"));
    }
    options.push(option.clone());
    (options, option.clone())
}

/// Goes round the candidates until none makes less than `best`; as many at a time as there are cores, which finds the same. `flash`
/// builds, on a core of that number, and is nothing where that fails; `found` is told the options, what was done, and the flash.
fn least(
    candidates: &[String],
    taken: &mut Options,
    mut best: u32,
    flash: impl Fn(&[String], usize) -> Option<u32> + Sync,
    mut found: impl FnMut(&[String], &str, u32),
) {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    // The next to try, and how many in a row have made it no smaller.
    let (mut next, mut since) = (0, 0);
    while since < candidates.len() {
        let batch: Vec<(Options, String)> = (0..cores.min(candidates.len() - since))
            .map(|k| with(taken, &candidates[(next + k) % candidates.len()]))
            .collect();
        let sizes: Vec<Option<u32>> = std::thread::scope(|scope| {
            let flash = &flash;
            let threads: Vec<_> = (batch.iter().enumerate())
                .map(|(core, (options, _))| scope.spawn(move || flash(options, core)))
                .collect();
            let joined = threads.into_iter().map(|thread| thread.join());
            joined.map(|size| size.ok().flatten()).collect()
        });
        let smaller = sizes.iter().position(|size| size.is_some_and(|s| s < best));
        let tried = smaller.map_or(batch.len(), |at| at + 1);
        (next, since) = ((next + tried) % candidates.len(), since + tried);
        if let Some(at) = smaller {
            let (options, what) = &batch[at];
            best = sizes[at].unwrap_or(best);
            taken.clone_from(options);
            since = 0;
            found(taken, what, best);
        }
    }
}

/// One line for each that was taken.
fn table(all: &[Found], costs: Option<&[Cost]>, taken: &[String]) -> String {
    let mut text =
        "flash, B  SRAM, B  stack, B  cycles a sample  by a correction  with\n".to_owned();
    for (k, found) in all.iter().enumerate() {
        let Sizes { flash, sram } = &found.sizes;
        let costs = costs.and_then(|costs| costs.get(k)).map_or_else(
            || format!("{:>8}  {:>15}  {:>15}", "-", "-", "-"),
            |c| format!("{:>8}  {:>15}  {:>15}", c.stack, c.cycles, c.corrected),
        );
        let _ = writeln!(text, "{flash:>8}  {sram:>7}  {costs}  {}", found.what);
    }
    let _ = writeln!(text, "\nleast: @flags {}", taken.join(" "));
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Options {
        text.split_whitespace().map(str::to_owned).collect()
    }

    #[test]
    fn what_is_asked_is_read_and_what_is_not_known_is_refused() {
        let asked = Asked::of(&words("-mcall-prologues --write -fno-gcse")).expect("all known");
        assert_eq!(asked.from, words("-mcall-prologues -fno-gcse"));
        assert!(asked.write);
        for wrong in ["--accept", "-Os", "flags"] {
            assert!(Asked::of(&words(wrong)).is_err(), "{wrong}");
        }
    }

    #[test]
    fn each_option_is_turned_over_but_those_of_the_flags() {
        let told = "The following options control optimizations:\n  -O<number>                  \t\t\n  -falign-jumps               \t[enabled]\n  \
                    -fconserve-stack            \t[disabled]\n  -fjump-tables   \t[disabled]\n  -fdefer-pop   \t[enabled]\n  \
                    -fvect-cost-model=[unlimited|dynamic|cheap]    \tunlimited\n";
        let flags = "-Os -fno-jump-tables\n-fdefer-pop\n";
        assert_eq!(
            turned_over(told, flags),
            words("-fno-align-jumps -fconserve-stack")
        );
    }

    /// 100 less what each option is worth: a is worth 5, c 2, and b 3 without a; with both, b costs.
    fn flash(options: &[String], _: usize) -> Option<u32> {
        let has = |option: &str| options.iter().any(|o| o == option);
        if has("-fno-build") {
            return None;
        }
        let b = match (has("-fb"), has("-fa")) {
            (true, false) => 97,
            (true, true) => 101,
            (false, _) => 100,
        };
        Some(b - u32::from(has("-fa")) * 5 - u32::from(has("-fc")) * 2)
    }

    #[test]
    fn what_makes_it_smaller_is_taken_and_left_out_again_where_that_is_smaller_still() {
        let (mut taken, mut told) = (Options::new(), Vec::new());
        let candidates = words("-fno-build -fb -fa -fc");
        least(&candidates, &mut taken, 100, flash, |_, what, size| {
            told.push(format!("{what} {size}"));
        });
        // b first, for it comes first; a beside it is worth 1; c; and b goes again.
        let way = ["-fb 97", "-fa 96", "-fc 94", "without -fb 93"];
        assert_eq!(told, way);
        assert_eq!(taken, words("-fa -fc"));
        // From there on nothing is found.
        least(&candidates, &mut taken, 93, flash, |_, what, _| {
            panic!("{what}")
        });
    }
}
