//! The files of a capture: opened when the board has said how it is set, another one where it is set anew, and ended.

use std::path::{Path, PathBuf};

use imu_stand::capture::{Calibration, Live, Restart};
use imu_stand::link::Link;
use miette::Result;
use wire::{Corrected, Hello, Sample};

use super::super::{name, write_json};
use super::{Answer, Capture, HELLO_WITHIN};

impl Capture<'_> {
    pub(super) fn sample(&mut self, sample: &Sample) -> Result<()> {
        let now = self.now();
        let Some(live) = &mut self.live else {
            self.waiting.push((*sample, now));
            return Ok(());
        };
        let (place, restart) = live.push(sample, now)?;
        self.missing += place.missing;
        if let Some(Restart { instants, .. }) = restart {
            self.restarts += 1;
            self.alert(&format!(
                "the board has started anew; {} sample instants are without data",
                instants - 1
            ));
            self.motor_is_off()?;
        }
        Ok(())
    }

    /// What the board made of a sample's rates. The file gets columns for it where the board said in time that it corrects.
    pub(super) fn corrected(&mut self, corrected: &Corrected) -> Result<()> {
        self.corrects = true;
        let Some(live) = &mut self.live else {
            return Ok(());
        };
        if live.has_corrected() {
            live.corrected(corrected);
            return Ok(());
        }
        let calibration = Calibration {
            corrected: true,
            ..live.calibration().clone()
        };
        self.tell("the board corrects its rates from here on: another file goes on")?;
        self.close()?;
        self.open(&calibration, &[])
    }

    pub(super) fn hello(&mut self, hello: &Hello) -> Result<()> {
        let calibration = self.arguments.calibration(Some(hello), self.corrects);
        let before = self.restarts_of_board.replace(hello.restarts);
        let Some(live) = &mut self.live else {
            let [major, minor, patch] = hello.firmware;
            let about = [
                ("firmware".to_owned(), format!("{major}.{minor}.{patch}")),
                ("board_id".to_owned(), hello.board_id.to_string()),
            ];
            return self.open(&calibration, &about);
        };
        live.hello(hello, before);
        if live.fits(&calibration) {
            return Ok(());
        }
        self.tell("the board is set differently from here on: another file goes on")?;
        self.close()?;
        self.open(&calibration, &[])
    }

    /// Opens the file, or the next one, and puts in what has waited for it.
    fn open(&mut self, calibration: &Calibration, about: &[(String, String)]) -> Result<()> {
        let out = &self.arguments.out;
        let resumes = self.files.is_empty() && self.arguments.resume && out.exists();
        let path = if self.files.is_empty() {
            out.clone()
        } else {
            free_name(out, self.files.len() + 1)
        };
        let live = if resumes {
            let live = Live::resume(&path, calibration)?;
            let before = live.start_unix_s();
            self.start_s = self.start_unix_s - before;
            let waited = &mut self.waiting;
            waited
                .iter_mut()
                .for_each(|(_, time)| *time += self.start_s);
            (self.start_unix_s, self.rows) = (before, 0);
            live
        } else {
            Live::create(&path, calibration, about, Some(self.start_unix_s))?
        };
        self.live = Some(live);
        self.files.push(name(&path));
        if resumes {
            self.tell("the capture was resumed")?;
        }
        for (sample, time) in std::mem::take(&mut self.waiting) {
            if let Some(live) = &mut self.live {
                self.missing += live.push(&sample, time)?.0.missing;
            }
        }
        Ok(())
    }

    /// A board that cannot hear (one wire only) says how it is set at its start alone.
    pub(super) fn give_up_on_hello(&mut self) -> Result<()> {
        let Some((_, first)) = self.waiting.first() else {
            return Ok(());
        };
        if self.live.is_some() || self.now() - first < HELLO_WITHIN.as_secs_f64() {
            return Ok(());
        }
        self.open(&self.arguments.calibration(None, self.corrects), &[])?;
        self.tell(
            "the board has not said how it is set: rate and ranges are assumed to be the built-in ones (20 Hz, 320 deg/s, \
             1.5 g)",
        )
    }

    /// Ends the file.
    fn close(&mut self) -> Result<()> {
        let Some(live) = self.live.take() else {
            return Ok(());
        };
        self.rows += live.rows();
        Ok(live.finish()?)
    }

    pub(super) fn finish(&mut self, link: &Link) -> Result<()> {
        if self.live.is_none() && !self.waiting.is_empty() {
            // Ended while samples waited for the hello.
            self.waiting[0].1 -= HELLO_WITHIN.as_secs_f64() + 1.0;
            self.give_up_on_hello()?;
        }
        if self.is_terminal && !self.arguments.quiet {
            eprintln!();
        }
        let heard = link.heard();
        if self.live.is_none() && self.files.is_empty() {
            miette::bail!(
                help = heard.remedy(link.baud()),
                "no sample arrived on {}; the raw bytes are kept in {}; heard: {heard}",
                link.name(),
                raw_path(&self.arguments.out).display()
            );
        }
        let now = self.now();
        if let Some(live) = &mut self.live {
            let what = format!("the capture ends; {heard}");
            live.note(now, &what)?;
        }
        self.close()?;
        let answer = Answer {
            format: "imu-stand-captured/1",
            files: self.files.clone(),
            seconds: now,
            rows: self.rows,
            missing: self.missing,
            lost_by_board: heard.losses.device,
            lost_by_line: heard.losses.line,
            lost_unattributed: heard.losses.unattributed,
            frames_rejected: heard.counts.rejected(),
            restarts: self.restarts,
            reconnections: self.reconnections,
        };
        if !self.arguments.quiet {
            say!(
                "{}: {} samples, {} missing",
                answer.files.join(", "),
                answer.rows,
                answer.missing
            );
            say!("line: {heard}");
        }
        write_json(self.arguments.json.as_ref(), &answer)
    }
}

/// The raw bytes' file: run.csv and run.csv.gz have run.raw.
pub(super) fn raw_path(out: &Path) -> PathBuf {
    let plain = if out.extension().is_some_and(|e| e == "gz") {
        out.with_extension("")
    } else {
        out.to_owned()
    };
    plain.with_extension("raw")
}

/// run-2.csv for run.csv.
pub(super) fn free_name(out: &Path, number: usize) -> PathBuf {
    let name = name(out);
    let (stem, ending) = name.split_once('.').unwrap_or((&name, "csv"));
    (number..)
        .map(|number| out.with_file_name(format!("{stem}-{number}.{ending}")))
        .find(|path| !path.exists())
        .unwrap_or_else(|| out.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_go_with_the_capture() {
        assert_eq!(raw_path(Path::new("a/run.csv.gz")), Path::new("a/run.raw"));
        assert_eq!(raw_path(Path::new("run.csv")), Path::new("run.raw"));
        assert_eq!(
            free_name(Path::new("no-such/run.csv.gz"), 2),
            Path::new("no-such/run-2.csv.gz")
        );
    }
}
