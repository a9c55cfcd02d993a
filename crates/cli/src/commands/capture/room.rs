//! A disk without room, while the board goes on: what arrives waits in memory, and is tried again.

use miette::Result;

use super::Capture;

/// Bytes of the line that may wait: an hour and more of the fastest default line (38400 baud), four hours of a board at 20 Hz.
const MOST: usize = 16 << 20;

/// Why nothing is written at the moment.
#[derive(Debug, Default)]
pub(super) struct Room {
    /// What the system said; `None` while there is room.
    why: Option<String>,
}

impl Room {
    /// Whether something waits.
    pub fn is_short(&self) -> bool {
        self.why.is_some()
    }
}

impl Capture<'_> {
    /// Tells whoever watches that something could not be written, once.
    pub(super) fn short_of_room(&mut self, why: &dyn std::fmt::Display) {
        if self.room.why.is_none() {
            self.alert(&format!(
                "cannot write ({why}): what arrives is kept in memory, up to {} MiB of the line, and tried again each second; \
                 make room",
                MOST >> 20
            ));
            self.room.why = Some(why.to_string());
        }
    }

    /// Writes what has come, and what has waited.
    pub(super) fn flush(&mut self) -> Result<()> {
        let mut written = self.raw.flush().map_err(|error| error.to_string());
        if let Some(live) = &mut self.live {
            let rows = live.flush();
            written = written.and(rows.map_err(|error| match error {
                imu_stand::CaptureError::Io { source, .. } => source.to_string(),
                other => other.to_string(),
            }));
        }
        if let Err(why) = written {
            self.short_of_room(&why);
            if self.raw.waiting() > MOST {
                miette::bail!(
                    help = "make room, and go on with `--resume`",
                    "{} bytes of the line wait for room on the disk ({why}), and no more are kept",
                    self.raw.waiting()
                );
            }
        } else if let Some(why) = self.room.why.take() {
            self.tell(&format!(
                "what had waited in memory is written; before that: {why}"
            ))?;
        }
        Ok(())
    }

    /// What is lost where the capture ends while something waits.
    pub(super) fn end_of_room(&mut self) -> Result<()> {
        let Err(why) = self.raw.flush() else {
            return Ok(());
        };
        let bytes = self.raw.waiting();
        miette::bail!(
            help = "make room, and go on with `--resume`: it puts in what the raw bytes hold",
            "the last {bytes} bytes of the line are not on the disk and are lost ({why}): {} holds what came before",
            self.raw.name()
        );
    }
}
