//! What came over a line, in numbers, and what silence means.

use wire::LinkCounts;
use wire::link::Losses;

/// Speed of a board in which none is stored.
const USUAL_BAUD: u16 = 38_400;

/// What came over a line so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Heard {
    /// Bytes.
    pub bytes: u64,
    /// Frames, and what was none.
    pub counts: LinkCounts,
    /// Samples lost, and by whom.
    pub losses: Losses,
}

impl std::fmt::Display for Heard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.bytes == 0 {
            return f.write_str("not a byte");
        }
        let (counts, lost) = (&self.counts, &self.losses);
        write!(
            f,
            "{} bytes, {} frames in order, {} rejected",
            self.bytes,
            counts.frames,
            counts.rejected()
        )?;
        if counts.rejected() > 0 {
            write!(
                f,
                " ({} stuffing, {} CRC, {} length, {} unknown)",
                counts.bad_cobs,
                counts.bad_crc,
                counts.bad_length,
                counts.unknown_version + counts.unknown_kind + counts.unknown_value
            )?;
        }
        if lost.device + lost.line + lost.unattributed == 0 {
            // Where nothing was understood, nobody knows of samples.
            return match counts.frames {
                0 => Ok(()),
                _ => f.write_str("; no sample lost"),
            };
        }
        write!(
            f,
            "; samples lost: {} by the board, {} by the line, {} unattributed",
            lost.device, lost.line, lost.unattributed
        )
    }
}

impl Heard {
    /// What has come since `before`.
    #[must_use]
    pub fn since(&self, before: &Heard) -> Heard {
        let (now, then) = (&self.counts, &before.counts);
        let (lost, had) = (&self.losses, &before.losses);
        Heard {
            bytes: self.bytes - before.bytes,
            counts: LinkCounts {
                frames: now.frames - then.frames,
                bad_cobs: now.bad_cobs - then.bad_cobs,
                bad_crc: now.bad_crc - then.bad_crc,
                bad_length: now.bad_length - then.bad_length,
                unknown_version: now.unknown_version - then.unknown_version,
                unknown_kind: now.unknown_kind - then.unknown_kind,
                unknown_value: now.unknown_value - then.unknown_value,
            },
            losses: Losses {
                received: lost.received - had.received,
                device: lost.device - had.device,
                line: lost.line - had.line,
                unattributed: lost.unattributed.saturating_sub(had.unattributed),
                out_of_order: lost.out_of_order - had.out_of_order,
                restarts: lost.restarts - had.restarts,
            },
        }
    }

    /// What silence of this kind means, and what to do.
    #[must_use]
    pub fn remedy(&self, baud: u32) -> String {
        if self.bytes == 0 {
            return "the line is dead: is the board powered, does the PC's TXD go to the board's RXD (between 9-pin connectors by \
                    a straight cable: docs/hardware.md), and is this its port?"
                .to_owned();
        }
        if self.counts.unknown_version > 0 {
            return "board and program speak different versions of the format: flash the firmware that came with this \
                    program, or use the program that came with the firmware"
                .to_owned();
        }
        if self.counts.frames == 0 {
            let other = match baud == u32::from(USUAL_BAUD) {
                true => "try `--baud` with the one that was stored, or see whether another device is at this port".to_owned(),
                false => format!("try `--baud {USUAL_BAUD}`, or the one you set"),
            };
            return format!(
                "bytes arrive but no frame: the speed is probably not {baud} baud. After a reset the board has what is \
                 stored, {USUAL_BAUD} if nothing is: {other}"
            );
        }
        "the board talks but does not hear: check the wire from the PC's TXD to PD0 (docs/hardware.md); `board health` of a \
         moment ago would show rx_framing and rx_bad_frame"
            .to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn silence_is_explained_by_what_was_heard() {
        let none = Heard::default();
        assert!(none.remedy(38_400).contains("dead"));
        let mut noise = Heard {
            bytes: 100,
            ..Heard::default()
        };
        assert_eq!(
            noise.to_string(),
            "100 bytes, 0 frames in order, 0 rejected"
        );
        assert!(noise.remedy(9600).contains("9600 baud"));
        assert!(noise.remedy(9600).contains("`--baud 38400`"));
        let usual = noise.remedy(38_400);
        assert!(
            !usual.contains("--baud 38400") && usual.contains("another device"),
            "{usual}"
        );
        noise.counts.frames = 3;
        assert!(noise.to_string().ends_with("no sample lost"));
        assert!(noise.remedy(9600).contains("does not hear"));
        noise.counts.unknown_version = 1;
        assert!(noise.remedy(9600).contains("version"));
    }
}
