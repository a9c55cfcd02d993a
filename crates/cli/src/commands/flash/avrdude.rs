//! Calls of avrdude.

use std::path::{Path, PathBuf};
use std::process::Command;

use clap::Args;

/// How to reach the part.
#[derive(Args)]
pub struct Programmer {
    /// The programmer, as `avrdude -c` has it: usbasp, avrispmkII, stk500v1, stk500v2, linuxspi, ...
    #[arg(long, short = 'c', value_name = "NAME")]
    pub programmer: String,
    /// Where the programmer is, as `avrdude -P` has it; USB ones mostly need none
    #[arg(long, short = 'P', value_name = "PORT")]
    pub programmer_port: Option<String>,
    /// Speed of the line to a serial programmer (not of the board's own)
    #[arg(long, value_name = "BAUD")]
    pub programmer_baud: Option<u32>,
    /// Bit clock of the programming, us. 10 is slow enough for a new part, which runs at 1 MHz
    #[arg(long, default_value_t = 10.0, value_name = "US")]
    pub bit_clock_us: f64,
    /// The program to call
    #[arg(long, default_value = "avrdude", value_name = "PATH")]
    pub avrdude: PathBuf,
}

/// What avrdude said.
#[derive(Debug)]
pub struct Said {
    /// Whether it ended with 0.
    pub success: bool,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
}

/// Programmers on a serial line, which avrdude looks for at its own default port where none is named.
const SERIAL: [&str; 17] = [
    "arduino",
    "arduino_as_isp",
    "avr109",
    "avr910",
    "avr911",
    "avrisp",
    "avrispv2",
    "buspirate",
    "butterfly",
    "jtag1",
    "jtagmkI",
    "mib510",
    "stk500",
    "stk500v1",
    "stk500v2",
    "urclock",
    "wiring",
];

impl Programmer {
    /// What is missing in the calls: the port of a serial programmer.
    pub fn lacks_port(&self) -> Option<String> {
        let is_serial = SERIAL.contains(&self.programmer.as_str());
        (is_serial && self.programmer_port.is_none()).then(|| {
            format!(
                "{} is on a serial line: say which, `--programmer-port /dev/ttyUSB0` (COM3 on Windows); without it avrdude takes \
                 its own default port, where most often there is none",
                self.programmer
            )
        })
    }

    /// Arguments of a call with these operations (`-U`).
    pub fn arguments(&self, operations: &[String]) -> Vec<String> {
        let mut out: Vec<String> = ["-p", "m16", "-c", &self.programmer]
            .map(str::to_owned)
            .to_vec();
        if let Some(port) = &self.programmer_port {
            out.extend(["-P".to_owned(), port.clone()]);
        }
        if let Some(baud) = self.programmer_baud {
            out.extend(["-b".to_owned(), baud.to_string()]);
        }
        out.extend(["-B".to_owned(), self.bit_clock_us.to_string()]);
        for operation in operations {
            out.extend(["-U".to_owned(), operation.clone()]);
        }
        out
    }

    /// The call as a shell takes it.
    pub fn call(&self, operations: &[String]) -> String {
        std::iter::once(self.avrdude.display().to_string())
            .chain(self.arguments(operations))
            .map(|word| quoted(&word))
            .collect::<Vec<_>>()
            .join(" ")
    }

    /// Calls it and waits.
    ///
    /// # Errors
    /// It cannot be started.
    pub fn run(&self, operations: &[String]) -> std::io::Result<Said> {
        let output = Command::new(&self.avrdude)
            .args(self.arguments(operations))
            .output()?;
        Ok(Said {
            success: output.status.success(),
            out: String::from_utf8_lossy(&output.stdout).into_owned(),
            err: String::from_utf8_lossy(&output.stderr).into_owned(),
        })
    }
}

/// A word for a POSIX shell.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:,=+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

/// Operations that read fuses and lock bits, each as one number on a line of standard output.
pub fn read_fuses() -> Vec<String> {
    ["lfuse", "hfuse", "lock"]
        .map(|memory| format!("{memory}:r:-:h"))
        .to_vec()
}

/// The numbers that [`read_fuses`] printed.
pub fn parse_fuses(out: &str) -> Option<[u8; 3]> {
    let values: Vec<u8> = out
        .lines()
        .filter_map(|line| u8::from_str_radix(line.trim().strip_prefix("0x")?, 16).ok())
        .collect();
    values.try_into().ok()
}

/// The operation that erases the part, writes the image and reads it back.
pub fn write_flash(image: &Path, is_elf: bool) -> String {
    format!(
        "flash:w:{}:{}",
        image.display(),
        if is_elf { 'e' } else { 'i' }
    )
}

/// What avrdude's complaint most likely means.
pub fn remedy(said: &str) -> &'static str {
    let has = |text: &str| said.contains(text);
    if has("can't find programmer") || has("cannot find programmer") || has("unknown programmer") {
        "`avrdude -c '?'` lists the programmers that it knows"
    } else if has("ermission denied") || has("EPERM") {
        "you may not use the programmer: on Linux add a udev rule for it, or join the group `dialout` where it is serial"
    } else if has("invalid device signature") || has("expected signature") {
        "the part on the programmer is no ATmega16 (signature 1E 94 03), or the connection is bad"
    } else if has("verification error") || has("verification mismatch") {
        "what was read back differs: a lower bit clock (`--bit-clock-us 50`), shorter wires, a steady supply"
    } else if has("not in sync") || has("target doesn't answer") || has("initialization failed") {
        "the programmer does not reach the part: is the board powered, the connector the right way round, the crystal \
         running? A slower bit clock helps a slow part: `--bit-clock-us 50`"
    } else if has("can't open")
        || has("cannot open")
        || has("unable to open")
        || has("could not find")
    {
        "avrdude does not find the programmer: is it plugged in? A serial one needs `--programmer-port`"
    } else {
        "the lines above are avrdude's own words; docs/hardware.md shows the connector"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_call_can_be_pasted_into_a_shell() {
        let programmer = Programmer {
            programmer: "stk500v1".to_owned(),
            programmer_port: Some("/dev/ttyUSB0".to_owned()),
            programmer_baud: Some(19_200),
            bit_clock_us: 10.0,
            avrdude: "avrdude".into(),
        };
        let operation = write_flash(Path::new("my image's.hex"), false);
        assert_eq!(
            programmer.call(&[operation]),
            r"avrdude -p m16 -c stk500v1 -P /dev/ttyUSB0 -b 19200 -B 10 -U 'flash:w:my image'\''s.hex:i'"
        );
    }

    #[test]
    fn a_serial_programmer_without_a_port_is_told() {
        let of = |name: &str, port: Option<&str>| {
            let programmer = Programmer {
                programmer: name.to_owned(),
                programmer_port: port.map(str::to_owned),
                programmer_baud: None,
                bit_clock_us: 10.0,
                avrdude: "avrdude".into(),
            };
            programmer.lacks_port()
        };
        let said = of("avrisp", None).expect("no port");
        assert!(said.contains("--programmer-port /dev/ttyUSB0"), "{said}");
        assert_eq!(of("avrisp", Some("/dev/ttyS0")), None);
        assert_eq!(of("usbasp", None), None);
        assert_eq!(of("avrispmkII", None), None);
    }

    #[test]
    fn fuses_are_three_numbers_or_nothing() {
        assert_eq!(parse_fuses("0xe1\n0x99\n0xff\n"), Some([0xe1, 0x99, 0xff]));
        assert_eq!(parse_fuses("0xe1\n0x99\n"), None);
        assert_eq!(parse_fuses(""), None);
    }
}
