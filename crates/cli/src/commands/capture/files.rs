//! The files of a capture: opened when the board has said how it is set, another one where it is set anew, and ended.

use imu_stand::capture::{
    Calibration, DIGITS, Live, PART, Place, RAW, RAW_FROM, Restart, free_name, raw_path,
};
use imu_stand::link::Link;
use miette::Result;
use wire::{Corrected, Hello, Sample};

use super::super::{name, write_json};
use super::losses::{Apart, by_whom};
use super::{Answer, Capture, HELLO_WITHIN};

impl Capture<'_> {
    pub(super) fn sample(&mut self, sample: &Sample) -> Result<()> {
        let now = self.now();
        if self.live.is_none() {
            self.waiting.push((*sample, now));
            return Ok(());
        }
        if self.is_due(now) {
            self.rotate()?;
        }
        self.put(sample, now)
    }

    /// Puts a sample into the file that is open.
    fn put(&mut self, sample: &Sample, now: f64) -> Result<()> {
        let Some(live) = &mut self.live else {
            return Ok(());
        };
        let (place, restart) = live.push(sample, now)?;
        let Place { missing, .. } = place;
        self.missing += missing;
        self.last_s = now;
        let cause = self.holes.charge(missing, restart.is_some());
        if let Some(Restart { instants, .. }) = restart {
            self.restarts += 1;
            self.alert(&format!(
                "the board has started anew; {} sample instants are without data",
                instants - 1
            ));
            self.motor_is_off()?;
        } else if let Some(cause) = cause {
            self.tell(&format!(
                "{missing} sample instants before the last row are without data: {cause}"
            ))?;
        }
        Ok(())
    }

    /// Whether another file is to begin.
    fn is_due(&self, now: f64) -> bool {
        // What waits for room goes where it was read.
        if self.room.is_short() {
            return false;
        }
        let rotate = self.arguments.rotate;
        rotate.is_some_and(|rotate| rotate.is_due(self.last_s, now, self.size))
    }

    /// Begins another file: the rows go on in it, and the bytes from this sample's frame on.
    fn rotate(&mut self) -> Result<()> {
        let Some(live) = self.live.take() else {
            return Ok(());
        };
        let (path, part) = free_name(&self.arguments.out, self.part + 1, DIGITS);
        self.raw.next(&raw_path(&path))?;
        let about = self.about(part, self.raw.offset());
        self.rows += live.rows();
        let next = live.next_part(&path, &about)?;
        (self.part, self.size) = (part, 0);
        self.files.push(name(&path));
        self.live = Some(next);
        // Raw bytes that are decoded alone need the set-up.
        self.asks = true;
        Ok(())
    }

    /// What a file's header says beside what its counts mean.
    fn about(&self, part: u64, raw_from: u64) -> Vec<(String, String)> {
        let mut about = self.board.clone();
        let mut add = |key: &str, value: String| about.push((key.to_owned(), value));
        add(PART, part.to_string());
        add(RAW, self.raw.name());
        add(RAW_FROM, raw_from.to_string());
        about
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
        self.open(&calibration)
    }

    pub(super) fn hello(&mut self, hello: &Hello) -> Result<()> {
        let calibration = self.arguments.calibration(Some(hello), self.corrects);
        let before = self.restarts_of_board.replace(hello.restarts);
        let [major, minor, patch] = hello.firmware;
        self.board = vec![
            ("firmware".to_owned(), format!("{major}.{minor}.{patch}")),
            ("board_id".to_owned(), hello.board_id.to_string()),
        ];
        let Some(live) = &mut self.live else {
            return self.open(&calibration);
        };
        live.hello(hello, before);
        if live.fits(&calibration) {
            return Ok(());
        }
        self.tell("the board is set differently from here on: another file goes on")?;
        self.close()?;
        self.open(&calibration)
    }

    /// Opens the file, or the next one, and puts in what has waited for it.
    fn open(&mut self, calibration: &Calibration) -> Result<()> {
        let resumed = match (self.files.is_empty(), &self.resumes) {
            (true, Some((path, part))) => Some((path.clone(), *part)),
            _ => None,
        };
        let is_resumed = resumed.is_some();
        let (path, live) = if let Some((path, part)) = resumed {
            let live = Live::resume(&path, calibration)?;
            let before = live.start_unix_s();
            self.start_s = self.start_unix_s - before;
            let waited = &mut self.waiting;
            waited
                .iter_mut()
                .for_each(|(_, time)| *time += self.start_s);
            (self.start_unix_s, self.part, self.rows) = (before, part, 0);
            self.last_s = live.last_host_s();
            self.holes.next = Apart::NotRunning;
            (path, live)
        } else {
            let (path, part) = self.next_name();
            let is_first = self.files.is_empty();
            if self.arguments.rotate.is_some() && !is_first {
                self.raw.next(&raw_path(&path))?;
            }
            // Samples that have waited for the first file are in the raw bytes of this run.
            let raw_from = if is_first {
                self.raw.began()
            } else {
                self.raw.offset()
            };
            let about = self.about(part, raw_from);
            let live = Live::create(&path, calibration, &about, Some(self.start_unix_s))?;
            (self.part, self.last_s, self.size) = (part, self.now(), 0);
            (path, live)
        };
        self.live = Some(live);
        self.files.push(name(&path));
        if is_resumed {
            self.remark("the capture was resumed")?;
        }
        for (sample, time) in std::mem::take(&mut self.waiting) {
            self.put(&sample, time)?;
        }
        Ok(())
    }

    /// Name and number of the file that begins.
    fn next_name(&self) -> (std::path::PathBuf, u64) {
        let out = &self.arguments.out;
        match (self.files.is_empty(), self.arguments.rotate.is_some()) {
            (true, _) => (super::first_name(self.arguments), 1),
            (false, rotates) => {
                let digits = if rotates { DIGITS } else { 0 };
                free_name(out, self.part + 1, digits)
            }
        }
    }

    /// A board that cannot hear (one wire only) says how it is set at its start alone.
    pub(super) fn give_up_on_hello(&mut self) -> Result<()> {
        let Some((_, first)) = self.waiting.first() else {
            return Ok(());
        };
        if self.live.is_some() || self.now() - first < HELLO_WITHIN.as_secs_f64() {
            return Ok(());
        }
        self.open(&self.arguments.calibration(None, self.corrects))?;
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
        self.holes.next = Apart::No;
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
                self.raw.path().display()
            );
        }
        let now = self.now();
        if let Some(live) = &mut self.live {
            let what = format!("the capture ends; {heard}");
            live.note(now, &what)?;
        }
        let held = self.end_of_room();
        held.and(self.close())?;
        let answer = Answer {
            format: "imu-stand-captured/1",
            files: self.files.clone(),
            seconds: now,
            rows: self.rows,
            missing: self.missing,
            lost_by_board: heard.losses.device,
            lost_by_line: heard.losses.line,
            lost_unattributed: heard.losses.unattributed,
            apart: self.holes.lost,
            put_in_from_raw: self.put_in,
            frames_rejected: heard.counts.rejected(),
            restarts: self.restarts,
            reconnections: self.reconnections,
        };
        if !self.arguments.quiet {
            say(&answer);
            say!("line: {heard}");
        }
        write_json(self.arguments.json.as_ref(), &answer)
    }
}

/// Says what was captured, and who lost what is missing.
fn say(answer: &Answer) {
    let by_whom = by_whom(&[
        ("by the board", answer.lost_by_board),
        ("by the line", answer.lost_by_line),
        ("while the port was gone", answer.apart.lost_while_port_gone),
        (
            "while the capture did not run",
            answer.apart.lost_while_not_running,
        ),
        ("while the board started", answer.apart.lost_by_restart),
        ("by nobody known", answer.lost_unattributed),
    ]);
    say!(
        "{}: {} samples, {} missing{by_whom}",
        answer.files.join(", "),
        answer.rows,
        answer.missing
    );
}
