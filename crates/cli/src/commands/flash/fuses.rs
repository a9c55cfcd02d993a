//! Fuse and lock bits of the ATmega16: what the board needs, and what each bit means. A bit that is 0 is programmed.
//!
//! Source: ATmega16 data sheet (2466 Rev. T), "Memory Programming" and "System Clock"; Microchip's device file.

/// Lock bits of a part that can be read and written.
const UNLOCKED: u8 = 0x3f;

/// One setting, which may have several bits.
struct Setting {
    name: &'static str,
    /// Of the 16 bits high:low.
    mask: u16,
    /// Values under the mask that the board works with; the first is the one that is written.
    good: &'static [u16],
    /// What goes wrong otherwise.
    otherwise: &'static str,
    /// Whether the board fails with a wrong one, or is worse.
    is_needed: bool,
}

const SETTINGS: [Setting; 8] = [
    Setting {
        name: "CKSEL",
        mask: 0x000f,
        good: &[0x000f, 0x000e],
        otherwise: "the part does not run from its 16 MHz crystal (as delivered: from 1 MHz of its own), so the line has \
                    the wrong speed and the sampling clock no crystal's accuracy",
        is_needed: true,
    },
    Setting {
        name: "CKOPT",
        mask: 0x1000,
        good: &[0x0000],
        otherwise: "a crystal above 8 MHz may not start without full swing",
        is_needed: true,
    },
    Setting {
        name: "BODEN",
        mask: 0x0040,
        good: &[0x0000],
        otherwise: "without the brown-out detector the part runs on a sagging supply, spoils its EEPROM and leaves the \
                    motor as it is",
        is_needed: true,
    },
    Setting {
        name: "BODLEVEL",
        mask: 0x0080,
        good: &[0x0000],
        otherwise: "2.7 V is too low for 16 MHz, which wants 4.5 V",
        is_needed: true,
    },
    Setting {
        name: "BOOTRST",
        mask: 0x0100,
        good: &[0x0100],
        otherwise: "the part starts in the boot section, where nothing is",
        is_needed: true,
    },
    Setting {
        name: "EESAVE",
        mask: 0x0800,
        good: &[0x0000],
        otherwise: "flashing erases the EEPROM, and with it the stored set-up: bias, scale, number of the board",
        is_needed: false,
    },
    Setting {
        name: "JTAGEN",
        mask: 0x4000,
        good: &[0x4000],
        otherwise: "JTAG keeps PC2 to PC5, and its TDO draws current; the firmware uses none of them",
        is_needed: false,
    },
    Setting {
        name: "OCDEN",
        mask: 0x8000,
        good: &[0x8000],
        otherwise: "the debugger's clock runs on in sleep",
        is_needed: false,
    },
];

/// What a part is set to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Fuses {
    /// Low byte.
    pub low: u8,
    /// High byte.
    pub high: u8,
    /// Lock bits.
    pub lock: u8,
}

/// A setting that is not as the board wants it.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Deviation {
    /// Name in the data sheet.
    pub fuse: &'static str,
    /// What it means.
    pub means: &'static str,
    /// Whether the board fails with it.
    pub fails: bool,
}

impl Fuses {
    fn word(self) -> u16 {
        u16::from_be_bytes([self.high, self.low])
    }

    /// What is not as the board wants it.
    pub fn deviations(self) -> Vec<Deviation> {
        SETTINGS
            .iter()
            .filter(|s| !s.good.contains(&(self.word() & s.mask)))
            .map(|s| Deviation {
                fuse: s.name,
                means: s.otherwise,
                fails: s.is_needed,
            })
            .collect()
    }

    /// Low and high byte with those settings corrected and all others, SUT, BOOTSZ and SPIEN among them, as they are.
    pub fn corrected(self) -> (u8, u8) {
        let mut word = self.word();
        for setting in &SETTINGS {
            if !setting.good.contains(&(word & setting.mask)) {
                word = word & !setting.mask | setting.good.first().copied().unwrap_or(0);
            }
        }
        let [high, low] = word.to_be_bytes();
        (low, high)
    }

    /// Whether reading or writing is locked.
    pub fn is_locked(self) -> bool {
        self.lock & UNLOCKED != UNLOCKED
    }

    /// Whether a chip erase spares the EEPROM.
    pub fn keeps_eeprom(self) -> bool {
        self.high & 0x08 == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// docs/hardware.md: crystal of 16 MHz, slow start, brown-out detector at 4.0 V; full swing, no JTAG, EEPROM kept,
    /// start at 0.
    const OURS: Fuses = Fuses {
        low: 0x3f,
        high: 0xc1,
        lock: 0xff,
    };
    const AS_DELIVERED: Fuses = Fuses {
        low: 0xe1,
        high: 0x99,
        lock: 0xff,
    };

    #[test]
    fn a_new_part_deviates_in_what_its_factory_settings_are() {
        let names: Vec<&str> = AS_DELIVERED.deviations().iter().map(|d| d.fuse).collect();
        assert_eq!(
            names,
            ["CKSEL", "CKOPT", "BODEN", "BODLEVEL", "EESAVE", "JTAGEN"]
        );
        assert!(!AS_DELIVERED.is_locked() && !AS_DELIVERED.keeps_eeprom());
    }

    #[test]
    fn the_boards_own_fuses_deviate_in_nothing() {
        assert_eq!(OURS.deviations(), []);
        assert_eq!(OURS.corrected(), (OURS.low, OURS.high));
        assert!(OURS.keeps_eeprom());
    }

    #[test]
    fn correcting_touches_nothing_else() {
        let (low, high) = AS_DELIVERED.corrected();
        // SUT stays 10, BOOTSZ 00; the programmer's way in, SPIEN, stays programmed.
        assert_eq!((low, high), (0x2f, 0xc1));
        for low in 0..=255 {
            for high in 0..=255 {
                let any = Fuses { low, high, lock: 0 };
                let (low, high) = any.corrected();
                let then = Fuses { low, high, lock: 0 };
                assert_eq!(then.deviations(), [], "{any:?}");
                assert_eq!((any.low ^ low) & 0x30, 0, "{any:?}");
                assert_eq!((any.high ^ high) & 0x26, 0, "{any:?}");
            }
        }
    }
}
