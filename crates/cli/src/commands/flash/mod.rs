//! `imu-stand flash`: the image onto the board, by avrdude.

mod avrdude;
mod fuses;

use std::io::{IsTerminal, Read as _, Write as _};
use std::path::{Path, PathBuf};

use clap::Args;
use miette::{IntoDiagnostic, Result, WrapErr};
use serde::Serialize;

pub use avrdude::Programmer;
use avrdude::{parse_fuses, read_fuses, remedy, write_flash};
use fuses::{Deviation, Fuses};

/// What `flash` takes.
#[derive(Args)]
pub struct Arguments {
    /// The image, ELF or Intel hex; without it the one that `cargo xtask image` has built here
    image: Option<PathBuf>,
    #[command(flatten)]
    programmer: Programmer,
    /// Print the calls of avrdude that would be made, and make none
    #[arg(long)]
    dry_run: bool,
    /// Only read fuses and lock bits and say what they mean; write nothing
    #[arg(long, conflicts_with_all = ["write_fuses", "keep_fuses", "image", "dry_run"])]
    check: bool,
    /// Correct the fuses that the board needs otherwise; asks before it does
    #[arg(long, conflicts_with = "keep_fuses")]
    write_fuses: bool,
    /// Flash although fuses are not as the board needs them
    #[arg(long)]
    keep_fuses: bool,
    /// Flash a part that is locked: erasing unlocks it, and what was protected is gone
    #[arg(long)]
    unlock: bool,
    /// Answer yes to what is asked
    #[arg(long)]
    yes: bool,
    /// Write the result as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Print nothing but errors
    #[arg(long, short)]
    quiet: bool,
}

/// Where `cargo xtask image` puts it.
const BUILT: [&str; 2] = [
    "target/avr/avr-none/firmware/firmware.hex",
    "target/avr/avr-none/firmware/firmware.elf",
];
/// e_machine of AVR in an ELF header.
const EM_AVR: u16 = 83;

/// A file that can be flashed.
struct Image {
    path: PathBuf,
    is_elf: bool,
}

impl Image {
    /// Looks at the file, so that nothing is erased for one that avrdude then rejects.
    fn find(named: Option<&Path>) -> Result<Self> {
        let built = || BUILT.iter().map(PathBuf::from).find(|path| path.exists());
        let Some(path) = named.map(Path::to_owned).or_else(built) else {
            miette::bail!(
                help = "build it with `cargo xtask image`, or name a file: `imu-stand flash FILE --programmer usbasp`",
                "there is no image at {}",
                BUILT[0]
            );
        };
        let mut head = [0; 20];
        let length = std::fs::File::open(&path)
            .and_then(|mut file| {
                let mut length = 0;
                while length < head.len() {
                    match file.read(&mut head[length..])? {
                        0 => break,
                        count => length += count,
                    }
                }
                Ok(length)
            })
            .into_diagnostic()
            .wrap_err_with(|| format!("cannot read {}", path.display()))?;
        let is_elf = head.starts_with(b"\x7fELF");
        if is_elf && (length < 20 || u16::from_le_bytes([head[18], head[19]]) != EM_AVR) {
            miette::bail!(
                help = "`cargo xtask image` builds the board's",
                "{} is a program, and not one for an AVR",
                path.display()
            );
        }
        if !is_elf && head[0] != b':' {
            miette::bail!(
                help = "`cargo xtask image` builds both",
                "{} is neither ELF nor Intel hex",
                path.display()
            );
        }
        Ok(Self { path, is_elf })
    }
}

#[derive(Serialize)]
struct Answer {
    format: &'static str,
    fuses: Fuses,
    deviations: Vec<Deviation>,
    fuses_written: bool,
    image: Option<String>,
    written: bool,
}

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    super::Outputs::beside(&arguments.image).result("--json", arguments.json.as_ref())?;
    let programmer = &arguments.programmer;
    let image = (!arguments.check)
        .then(|| Image::find(arguments.image.as_deref()))
        .transpose()?;
    if let (true, Some(image)) = (arguments.dry_run, &image) {
        dry_run(arguments, image);
        return Ok(());
    }
    let mut fuses = read(programmer)?;
    let deviations = fuses.deviations();
    if !arguments.quiet {
        describe(fuses, &deviations);
    }
    let mut answer = Answer {
        format: "imu-stand-flash/1",
        fuses,
        deviations,
        fuses_written: false,
        image: image.as_ref().map(|image| super::name(&image.path)),
        written: false,
    };
    let Some(image) = image else {
        return super::write_json(arguments.json.as_ref(), &answer);
    };
    may_be_flashed(arguments, &answer)?;
    if !answer.deviations.is_empty() && !arguments.keep_fuses {
        fuses = write_fuses(arguments, fuses)?;
        answer.fuses = fuses;
        answer.deviations = fuses.deviations();
        answer.fuses_written = true;
    }
    call(programmer, &[write_flash(&image.path, image.is_elf)])?;
    answer.written = true;
    if !arguments.quiet {
        say!("{} is written and read back", image.path.display());
        if !fuses.keeps_eeprom() {
            say!("the EEPROM was erased with it (EESAVE): the board has its built-in set-up again");
        }
        say!("now: imu-stand board --port PORT info");
    }
    super::write_json(arguments.json.as_ref(), &answer)
}

/// Refuses a part that is locked, and fuses that are wrong, where the user has not said what to do about them.
fn may_be_flashed(arguments: &Arguments, answer: &Answer) -> Result<()> {
    let fuses = &answer.fuses;
    if fuses.is_locked() && !arguments.unlock {
        miette::bail!(
            help = "if what is on the part may go, add `--unlock`: flashing erases it, which lifts the lock",
            "the part is locked (lock bits {:#04x}): somebody wanted its content protected",
            fuses.lock
        );
    }
    if !answer.deviations.is_empty() && !arguments.keep_fuses && !arguments.write_fuses {
        let (low, high) = fuses.corrected();
        miette::bail!(
            help = format!(
                "add `--write-fuses` to write {low:#04x} and {high:#04x}, or `--keep-fuses` to flash all the same; \
                 docs/hardware.md tells what each bit does"
            ),
            "nothing is written: the fuses (low {:#04x}, high {:#04x}) are not what the board needs",
            fuses.low,
            fuses.high
        );
    }
    Ok(())
}

/// Prints the calls.
fn dry_run(arguments: &Arguments, image: &Image) {
    let programmer = &arguments.programmer;
    if let Some(lack) = programmer.lacks_port() {
        say!("# {lack}");
    }
    say!(
        "# fuses and lock bits are read first; where the board needs others, nothing is written without --write-fuses"
    );
    say!("{}", programmer.call(&read_fuses()));
    if arguments.write_fuses {
        say!("# as for a part as delivered; on another one SUT, BOOTSZ and SPIEN stay as they are");
        let new = Fuses {
            low: 0xe1,
            high: 0x99,
            lock: 0xff,
        };
        for operation in fuse_operations(new) {
            say!("{}", programmer.call(&[operation]));
        }
    }
    say!("# erases the part, writes, reads back; lock bits are never written");
    say!(
        "{}",
        programmer.call(&[write_flash(&image.path, image.is_elf)])
    );
}

/// High fuse first: with CKOPT programmed the crystal starts as soon as the low fuse asks for it.
fn fuse_operations(fuses: Fuses) -> Vec<String> {
    let (low, high) = fuses.corrected();
    let mut out = Vec::new();
    if high != fuses.high {
        out.push(format!("hfuse:w:{high:#04x}:m"));
    }
    if low != fuses.low {
        out.push(format!("lfuse:w:{low:#04x}:m"));
    }
    out
}

fn write_fuses(arguments: &Arguments, fuses: Fuses) -> Result<Fuses> {
    let (low, high) = fuses.corrected();
    let question = format!(
        "low fuse {:#04x} -> {low:#04x}, high fuse {:#04x} -> {high:#04x}. The part then needs the 16 MHz crystal to be \
         reached at all.",
        fuses.low, fuses.high
    );
    if !arguments.yes && !confirmed(&question)? {
        miette::bail!(
            help = "answer `yes`, or add `--yes` where nobody can be asked",
            "no fuse is written, and nothing is flashed"
        );
    }
    for operation in fuse_operations(fuses) {
        call(&arguments.programmer, &[operation])?;
    }
    let after = read(&arguments.programmer)?;
    if (after.low, after.high) != (low, high) {
        miette::bail!(
            help = "read them again with `--check`; a part that does not keep its fuses is damaged or badly supplied",
            "the fuses read low {:#04x}, high {:#04x} after {low:#04x}, {high:#04x} were written",
            after.low,
            after.high
        );
    }
    if !arguments.quiet {
        say!("fuses written and read back: low {low:#04x}, high {high:#04x}");
    }
    Ok(after)
}

/// Asks where somebody can answer.
fn confirmed(question: &str) -> Result<bool> {
    if !std::io::stdin().is_terminal() {
        return Ok(false);
    }
    eprint!("{question}\nWrite them? Type yes: ");
    std::io::stderr().flush().into_diagnostic()?;
    let mut line = String::new();
    std::io::stdin().read_line(&mut line).into_diagnostic()?;
    Ok(line.trim() == "yes")
}

fn describe(fuses: Fuses, deviations: &[Deviation]) {
    say!(
        "fuses: low {:#04x}, high {:#04x}; lock bits {:#04x}",
        fuses.low,
        fuses.high,
        fuses.lock
    );
    if deviations.is_empty() {
        say!("    as the board needs them");
    }
    for deviation in deviations {
        let lead = format!(
            "{} {}: ",
            deviation.fuse,
            if deviation.fails {
                "is wrong"
            } else {
                "could be better"
            }
        );
        say!("{}", imu_stand::text::item(&lead, deviation.means));
    }
}

fn read(programmer: &Programmer) -> Result<Fuses> {
    let out = call(programmer, &read_fuses())?;
    let Some([low, high, lock]) = parse_fuses(&out) else {
        miette::bail!(
            help = "this program knows avrdude 6.3 to 8: `avrdude -?` shows which one is called",
            "avrdude read the fuses and printed something else than three numbers: {}",
            out.trim()
        );
    };
    Ok(Fuses { low, high, lock })
}

/// The fuses of a board as a person reads them, and what is wrong with them or could be better; whether that must be put right.
pub fn fuses(programmer: &Programmer) -> Result<(String, Vec<(String, bool)>)> {
    let fuses = read(programmer)?;
    let found = format!(
        "low {:#04x}, high {:#04x}, lock bits {:#04x}",
        fuses.low, fuses.high, fuses.lock
    );
    let deviations = fuses.deviations();
    let told = deviations
        .iter()
        .map(|d| (format!("{}: {}", d.fuse, d.means), d.fails));
    Ok((found, told.collect()))
}

/// Calls avrdude; its standard output, or its words as an error.
fn call(programmer: &Programmer, operations: &[String]) -> Result<String> {
    let said = match programmer.run(operations) {
        Ok(said) => said,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => miette::bail!(
            help = "install it (Debian: `apt-get install avrdude`, macOS: `brew install avrdude`, Windows: its releases), or \
                    name it with `--avrdude PATH`",
            "{} is not here",
            programmer.avrdude.display()
        ),
        Err(error) => {
            return Err(error)
                .into_diagnostic()
                .wrap_err_with(|| format!("cannot start {}", programmer.avrdude.display()));
        }
    };
    if said.success {
        return Ok(said.out);
    }
    eprint!("{}", said.err);
    miette::bail!(
        help = remedy(&said.err),
        "avrdude failed: {}",
        programmer.call(operations)
    )
}
