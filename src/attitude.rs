//! Attitude by quaternion, in fixed point; what it computes, with a twin in double precision, is in [`wire::correction`].
//!
//! q turns the body's axes into those in which it began, z up; the rates turn it sample by sample. At rest the accelerometer
//! says which way is up; nothing says which way is ahead.
//!
//! All of it is sums of products of 32-bit numbers. They stand in tables in the flash, two bytes for each product: as code each
//! would take thirty.
//!
//! | quantity | format |
//! |---|---|
//! | q | Q2.30 |
//! | half the angle of a sample | Q32 rad: below half a radian about each axis |
//! | rates | Q12.20 deg/s |
//! | acceleration | counts in Q22 |

use wire::correction::ACC_ZERO;
use zerocopy::little_endian::I32;

use crate::math::mul;

/// Half of the angle that a rate of 1 deg/s makes in a timer tick of 4 us, rad: pi / 360 4e-6, Q55.
const HALF_TICK: i32 = 1_257_642_267;
/// A third, Q32.
const THIRD: i32 = 0x5555_5555;
/// A length of 1, of which the squares are taken off, Q28.
const LENGTH: i32 = 1 << 28;

/// The numbers that are worked on, by their places.
type Cells = [i32; 16];
/// q: w, x, y, z.
const Q: u16 = 0;
/// Scratch: half of up in the body's axes, Q27, behind its own first cell; then q as it is turned.
const T: u16 = 4;
/// Half angles behind a cell that is for what the length takes off.
const H: u16 = 8;
/// Rates; then the acceleration.
const V: u16 = 12;
/// A number of its own; as the second factor it stands for 1.
const K: u16 = 15;

/// To a cell is added the product of two others over 2^32.
const fn add(to: u16, a: u16, b: u16) -> u16 {
    to << 8 | a << 4 | b
}

/// It is taken off.
const fn less(to: u16, a: u16, b: u16) -> u16 {
    add(to, a, b) | 1 << 15
}

const fn double(cell: u16) -> u16 {
    add(cell, cell, K)
}

const fn clear(cell: u16) -> u16 {
    less(cell, cell, K)
}

macro_rules! in_flash {
    ($name:ident = [$($step:expr,)*]) => {
        #[cfg_attr(target_arch = "avr", allow(unsafe_code), unsafe(link_section = ".progmem.data"))]
        static $name: [u16; [$($step),*].len()] = [$($step),*];
    };
}

// The half angles: K is the time in ticks, Q14, T the half angle of a rate and a tick.
in_flash! { ANGLES = [
    add(T + 1, K, T),
    double(T + 1), double(T + 1), double(T + 1), double(T + 1),
    add(H + 1, V, T + 1),
    double(H + 1), double(H + 1), double(H + 1),
    add(H + 2, V + 1, T + 1),
    double(H + 2), double(H + 2), double(H + 2),
    add(H + 3, V + 2, T + 1),
    double(H + 3), double(H + 3), double(H + 3),
] }

// A 66th of what the body has to be turned by for the accelerometer's up to be up: the cross product of what it reads, 248 counts
// at 1.5 g, with up as q has it: 2 (x z - w y), 2 (y z + w x), 1 - 2 (x x + y y).
in_flash! { LEAN = [
    clear(T + 1), add(T + 1, Q + 1, Q + 3), less(T + 1, Q, Q + 2),
    add(T + 2, Q + 2, Q + 3), add(T + 2, Q, Q + 1),
    less(T + 3, Q + 1, Q + 1), less(T + 3, Q + 2, Q + 2),
    add(H + 1, V + 1, T + 3), less(H + 1, V + 2, T + 2),
    add(H + 2, V + 2, T + 1), less(H + 2, V, T + 3),
    add(H + 3, V, T + 2), less(H + 3, V + 1, T + 1),
] }

// q (1 - h^2/3, h), as tan h is h / (1 - h^2/3) to the fourth order; K is a third. Then what its length lacks of 1.
in_flash! { TURN = [
    clear(T), add(T, K, H + 1), less(H, T, H + 1),
    clear(T), add(T, K, H + 2), less(H, T, H + 2),
    clear(T), add(T, K, H + 3), less(H, T, H + 3),
    clear(T), add(T, Q, K), add(T, Q, H),
    less(T, Q + 1, H + 1), less(T, Q + 2, H + 2), less(T, Q + 3, H + 3),
    clear(T + 1), add(T + 1, Q + 1, K), add(T + 1, Q + 1, H),
    add(T + 1, Q, H + 1), add(T + 1, Q + 2, H + 3), less(T + 1, Q + 3, H + 2),
    clear(T + 2), add(T + 2, Q + 2, K), add(T + 2, Q + 2, H),
    add(T + 2, Q, H + 2), less(T + 2, Q + 1, H + 3), add(T + 2, Q + 3, H + 1),
    clear(T + 3), add(T + 3, Q + 3, K), add(T + 3, Q + 3, H),
    add(T + 3, Q, H + 3), add(T + 3, Q + 1, H + 2), less(T + 3, Q + 2, H + 1),
    clear(H), add(H, V, K),
    less(H, T, T), less(H, T + 1, T + 1), less(H, T + 2, T + 2), less(H, T + 3, T + 3),
    // Half of that is Q32 in eight times as much: brought to length 1 by q (3 - q.q) / 2.
    double(H), double(H), double(H),
    clear(Q), add(Q, T, K), add(Q, T, H),
    clear(Q + 1), add(Q + 1, T + 1, K), add(Q + 1, T + 1, H),
    clear(Q + 2), add(Q + 2, T + 2, K), add(Q + 2, T + 2, H),
    clear(Q + 3), add(Q + 3, T + 3, K), add(Q + 3, T + 3, H),
] }

/// Where it begins: level.
#[inline(never)]
pub fn begin(q: &mut [I32; 4]) {
    *q = [I32::ZERO; 4];
    q[0].set(1 << 30);
}

/// Turns by `rate`, Q12.20 deg/s, over so many timer ticks, [`wire::correction::LONGEST_TICKS`] at the most; with `acc`, counts, a little towards
/// where that is up.
pub fn step(q: &mut [I32; 4], rate: &[I32; 3], ticks: u16, acc: Option<&[u16; 3]>) {
    // By a pointer, as a stack's place is reached up to its 63rd byte, and the last cell would lie behind it.
    let mut cells: Cells = [0; 16];
    let cells = crate::math::somewhere(&mut cells);
    for (cell, q) in cells.iter_mut().zip(q.iter()) {
        *cell = q.get();
    }
    for (cell, rate) in cells.iter_mut().skip(V as usize).zip(rate) {
        *cell = rate.get();
    }
    cells[K as usize] = i32::from(ticks) << 14;
    cells[T as usize] = HALF_TICK;
    run(cells, &ANGLES);
    if let Some(acc) = acc {
        for (cell, counts) in cells.iter_mut().skip(V as usize).zip(acc) {
            *cell = i32::from(counts.cast_signed().wrapping_sub(ACC_ZERO) << 6) << 16;
        }
        cells[T as usize + 3] = LENGTH / 2;
        run(cells, &LEAN);
    }
    cells[K as usize] = THIRD;
    cells[V as usize] = LENGTH;
    run(cells, &TURN);
    for (q, cell) in q.iter_mut().zip(&*cells) {
        q.set(*cell);
    }
}

/// Works through a table.
#[inline(never)]
fn run(cells: &mut Cells, table: &'static [u16]) {
    for step in table {
        let [low, high] = read(step).to_le_bytes();
        let mut term = cells[usize::from(low >> 4)];
        if low & 15 != K as u8 {
            term = mul(term, cells[usize::from(low & 15)]);
        }
        change(&mut cells[usize::from(high & 15)], term, high & 1 << 7 != 0);
    }
}

/// Adds, or takes off.
fn change(to: &mut i32, mut term: i32, minus: bool) {
    if minus {
        term = term.wrapping_neg();
    }
    *to = to.wrapping_add(term);
}

/// What stands there in the flash.
#[cfg(not(target_arch = "avr"))]
fn read(step: &'static u16) -> u16 {
    *step
}

/// What stands there in the flash.
#[cfg(target_arch = "avr")]
#[allow(unsafe_code)]
fn read(step: &'static u16) -> u16 {
    let found: u16;
    // SAFETY: reads two bytes of the flash.
    unsafe {
        core::arch::asm!(
            "lpm {0:l}, Z+",
            "lpm {0:h}, Z",
            out(reg_pair) found,
            inout("Z") step => _,
            options(pure, readonly, nostack),
        );
    }
    found
}
