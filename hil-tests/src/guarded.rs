//! Registers that an interrupt must not come between, read off the image's instructions: timer 1's 16-bit registers, whose two bytes
//! pass through one that they share (TEMP), and the EEPROM's control, where EEWE has to follow EEMWE within four cycles.
//!
//! Every way through the program is followed from the reset and from each vector, with what is known of the interrupt flag: `cli`
//! and an interrupt clear it, `sei` sets it, and what restores SREG restores it where the same register was read from SREG before.
//! Functions are followed for each state in which they are called.

use std::collections::{BTreeMap, BTreeSet};

use crate::calls::{Flow, decode, word};

/// ICR1L to TCNT1H, as `in` and `out` have them (2466T, register summary).
const TIMER_1: std::ops::RangeInclusive<u16> = 0x26..=0x2d;
const EECR: u16 = 0x1c;
const SREG: u16 = 0x3f;
/// EEWE and EEMWE.
const EEPROM_WRITES: [u16; 2] = [1, 2];

/// What an instruction does with what is watched here.
enum Deed {
    Nothing,
    /// `sei`, `cli`.
    Flag(bool),
    /// Reads SREG into a register.
    Saves(usize),
    /// Writes it from one.
    Restores(usize),
    /// Touches what has to be guarded.
    Guarded,
}

fn deed(code: u16) -> Deed {
    let address = code & 0xf | code >> 5 & 0x30;
    let register = usize::from(code >> 4 & 0x1f);
    match code {
        0x9478 => Deed::Flag(true),
        0x94f8 => Deed::Flag(false),
        _ if code & 0xf800 == 0xb000 && address == SREG => Deed::Saves(register),
        // r1 is zero (avr-gcc's convention): the start of the program.
        _ if code & 0xf800 == 0xb800 && address == SREG && register == 1 => Deed::Flag(false),
        _ if code & 0xf800 == 0xb800 && address == SREG => Deed::Restores(register),
        // `in` and `out`.
        _ if code & 0xf000 == 0xb000 && TIMER_1.contains(&address) => Deed::Guarded,
        _ if code & 0xf800 == 0xb800 && address == EECR => Deed::Guarded,
        // `sbi`: the read strobe needs no guard.
        _ if code & 0xff00 == 0x9a00 && code >> 3 & 0x1f == EECR => {
            if EEPROM_WRITES.contains(&(code & 7)) {
                Deed::Guarded
            } else {
                Deed::Nothing
            }
        }
        _ => Deed::Nothing,
    }
}

/// What is known at an instruction: whether interrupts may be on, and of each register whether it has an SREG with them on.
#[derive(Clone, Copy, PartialEq, Eq)]
struct State {
    on: bool,
    saved: [Option<bool>; 32],
}

impl State {
    /// What holds for both.
    fn join(self, other: Self) -> Self {
        let mut joined = self;
        joined.on |= other.on;
        for (mine, theirs) in joined.saved.iter_mut().zip(other.saved) {
            *mine = match (*mine, theirs) {
                (Some(a), Some(b)) => Some(a | b),
                _ => None,
            };
        }
        joined
    }
}

/// A walk over an image.
struct Walk<'a> {
    flash: &'a [u8],
    /// By function and whether interrupts may be on as it is called: whether they may be on behind it.
    known: BTreeMap<(usize, bool), bool>,
    bare: BTreeSet<usize>,
    guarded: BTreeSet<usize>,
}

impl Walk<'_> {
    /// Follows a function; whether interrupts may be on behind it.
    fn function(&mut self, entry: usize, on: bool) -> Result<bool, usize> {
        if let Some(&after) = self.known.get(&(entry, on)) {
            return Ok(after);
        }
        // Of a function that calls itself nothing is known; calls.rs finds those.
        self.known.insert((entry, on), true);
        let saved = [None; 32];
        let mut states = BTreeMap::from([(entry, State { on, saved })]);
        let (mut open, mut after) = (vec![entry], false);
        while let Some(at) = open.pop() {
            if at >= self.flash.len() / 2 {
                continue;
            }
            let mut state = states[&at];
            match deed(word(self.flash, at)) {
                Deed::Nothing => {}
                Deed::Flag(on) => state.on = on,
                Deed::Saves(register) => state.saved[register] = Some(state.on),
                Deed::Restores(register) => state.on = state.saved[register].unwrap_or(true),
                Deed::Guarded => {
                    self.guarded.insert(2 * at);
                    if state.on {
                        self.bare.insert(2 * at);
                    }
                }
            }
            let (length, flow) = decode(self.flash, at);
            let next = at + length;
            let ways = match flow {
                Flow::On => vec![next],
                Flow::Skip => vec![next, next + decode(self.flash, next).0],
                Flow::Branch(there) => vec![next, there],
                Flow::Jump(there) => vec![there],
                Flow::Call(there) if there == next => vec![next],
                Flow::Call(there) => {
                    state.on = self.function(there, state.on)?;
                    vec![next]
                }
                Flow::Return => {
                    after |= state.on;
                    vec![]
                }
                Flow::Indirect => return Err(2 * at),
            };
            for way in ways {
                let joined = states.get(&way).map_or(state, |there| there.join(state));
                if states.insert(way, joined) != Some(joined) {
                    open.push(way);
                }
            }
        }
        self.known.insert((entry, on), after);
        Ok(after)
    }
}

/// Byte addresses at which a guarded register is touched, and of those the ones where interrupts may be on.
///
/// # Errors
/// The byte address of a call or jump whose target is not in the instruction.
pub fn bare(flash: &[u8], vectors: usize) -> Result<[BTreeSet<usize>; 2], usize> {
    let mut walk = Walk {
        flash,
        known: BTreeMap::new(),
        bare: BTreeSet::new(),
        guarded: BTreeSet::new(),
    };
    for vector in 0..vectors {
        walk.function(2 * vector, false)?;
    }
    Ok([walk.guarded, walk.bare])
}

#[cfg(test)]
mod tests {
    use super::bare;

    fn flash(words: &[u16]) -> Vec<u8> {
        words.iter().flat_map(|word| word.to_le_bytes()).collect()
    }

    #[test]
    fn two_bytes_of_timer_1_are_guarded_by_cli_and_bare_without() {
        // sei; in r18, SREG; cli; in r24, TCNT1L; in r25, TCNT1H; out SREG, r18; ret.
        let image = [0x9478, 0xb72f, 0x94f8, 0xb58c, 0xb59d, 0xbf2f, 0x9508];
        let [guarded, open] = bare(&flash(&image), 1).expect("nothing indirect");
        assert_eq!((guarded.len(), open.len()), (2, 0));
        let [_, open] = bare(&flash(&image.map(|w| if w == 0x94f8 { 0 } else { w })), 1).unwrap();
        assert_eq!(open.into_iter().collect::<Vec<_>>(), [6, 8]);
    }

    #[test]
    fn what_is_restored_before_the_end_is_bare_again_where_interrupts_were_on() {
        // [sei;] in r0, SREG; cli; out SREG, r0; out EECR, r24; ret.
        for (first, expected) in [(0x9478, 1), (0x0000, 0)] {
            let image = flash(&[first, 0xb60f, 0x94f8, 0xbe0f, 0xbb8c, 0x9508]);
            let [_, open] = bare(&image, 1).expect("nothing indirect");
            assert_eq!(open.len(), expected);
        }
    }

    #[test]
    fn a_function_is_followed_for_each_state_it_is_called_in() {
        // rcall 4; sei; rcall 4; ret; 4: out OCR1AL, r24; ret. The first call is guarded, the second is not.
        let image = flash(&[0xd003, 0x9478, 0xd001, 0x9508, 0xbd8a, 0x9508]);
        let [_, open] = bare(&image, 1).expect("nothing indirect");
        assert_eq!(open.into_iter().collect::<Vec<_>>(), [8]);
        let image = flash(&[0xd003, 0x0000, 0xd001, 0x9508, 0xbd8a, 0x9508]);
        assert_eq!(bare(&image, 1).map(|[_, open]| open.len()), Ok(0));
    }

    #[test]
    fn the_read_strobe_of_the_eeprom_needs_no_guard_and_its_write_does() {
        for (code, expected) in [(0x9ae0, 0), (0x9ae1, 1), (0x9ae2, 1)] {
            let [_, open] = bare(&flash(&[0x9478, code, 0x9508]), 1).expect("nothing indirect");
            assert_eq!(open.len(), expected, "{code:#x}");
        }
    }
}
