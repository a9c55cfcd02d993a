//! Codes that are read as others.

use super::super::super::prelude::*;
use super::edges::zero_of;

/// Those whose last digit is more than a count, and less than the noise, at the rates of a stand at rest: deg/s, gon/s,
/// minutes of arc a second, and deg/h.
pub(super) const FORMS: [Form; 5] = [
    Form::new(1.0, 2),
    Form::new(10.0 / 9.0, 2),
    Form::new(60.0, 2),
    Form::new(60.0, 1),
    Form::new(3600.0, 1),
];

/// Multiplications that a reading goes through.
pub(super) const MULTIPLICATIONS: i32 = 2;

/// A code with two of its bits exchanged.
pub(super) fn with_exchanged(code: i32, (one, other): (u32, u32)) -> i32 {
    let differ = ((code >> one) ^ (code >> other)) & 1;
    code ^ (differ << one | differ << other)
}

/// A code whose lowest bit is the parity of the others. Frames of one kind spend their lowest bit so, against errors of the
/// line, and come by chance among the others.
pub(super) fn with_parity(code: i32) -> i32 {
    let others = code & !1;
    others | (others.count_ones() & 1) as i32
}

/// Shares of the codes when those further than a gate from the middle code are put between two others.
pub(super) fn law_of_gate(stand: &Stand, axis: usize, gate: i32) -> (i32, Vec<f64>) {
    let (mean, sigma) = mean_and_sigma(stand, axis);
    let (first, even) = law(stand, axis);
    let middle = mean.round() as i32;
    let edges = even_edges(first, even.len());
    // The mean of two readings.
    let halves = shares(&edges, mean, sigma / 2f64.sqrt());
    let far = |i: usize| (first + i as i32 - middle).abs() > gate;
    let out: f64 = (0..even.len()).filter(|i| far(*i)).map(|i| even[i]).sum();
    let law = (0..even.len())
        .map(|i| if far(i) { 0.0 } else { even[i] } + out * halves[i])
        .collect();
    (first, law)
}

/// How a rate is printed: the unit of a deg/s, and how many digits it gets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Form {
    unit: f64,
    digits: i32,
}

impl Form {
    pub(super) const fn new(unit: f64, digits: i32) -> Self {
        Self { unit, digits }
    }

    /// What is read again of the text.
    pub(super) fn read(self, code: i32) -> i32 {
        let rate = LSB * self.unit * f64::from(code);
        if code == 0 {
            return 0;
        }
        let place = 10f64.powi(rate.abs().log10().floor() as i32 + 1 - self.digits);
        ((rate / place).round() * place / self.unit / LSB).round() as i32
    }
}

/// A decimating filter whose register has no bit to spare: what is beyond its range comes out at the other end. So it is in
/// the frames that are taken at the larger of two gains.
pub(super) fn wrapped(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (_, sigma) = mean_and_sigma(stand, axis);
    let zero = zero_of(draw, stand, axis).round() as i32;
    let half = (sigma * draw.between(0.8, 1.6)).round().max(2.0) as i32;
    map(axis, move |code| {
        zero - half + (code - zero + half).rem_euclid(2 * half)
    })
}

/// Words kept as numbers of half precision, eleven bits of mantissa: beyond a power of two, which lies near the reading at
/// rest, only every second has a number of its own, and one between two goes to that whose mantissa is even. Some frames are
/// kept so.
pub(super) fn halved(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let zero = zero_of(draw, stand, axis).round() as i32;
    // Of a part that is mounted upside down, it is the readings below.
    let up = draw.sign() as i32;
    map(axis, move |code| {
        let off = up * (code - zero);
        if off > 0 {
            let mantissa = (0.5 * f64::from(off)).round_ties_even() as i32;
            zero + up * 2 * mantissa
        } else {
            code
        }
    })
}

/// A gain of one that a word of fractions cannot hold (Q15 ends at 0x7fff): the product is a little less than the reading
/// and, cut toward zero as integers are divided in C, one short of it, whatever the reading but zero. So are a gain and its
/// correction by two, and the code of zero takes five. Some frames go through it, others as they are.
pub(super) fn cut(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let zero = zero_of(draw, stand, axis).round() as i32;
    map(axis, move |code| {
        let q15 = |v: i64, _: i32| v * 0x7fff / 0x8000;
        zero + (0..MULTIPLICATIONS).fold(i64::from(code - zero), q15) as i32
    })
}

/// The bus is read bit by bit in software, and an interrupt that falls between two bits lets each be taken for the other:
/// the word has as many ones as before, at the wrong places.
pub(super) fn exchanged(draw: &mut Draw, stand: &Stand, axis: usize, wanted: f64) -> Shape {
    const PAIRS: [(u32, u32); 5] = [(0, 2), (1, 2), (0, 3), (1, 3), (2, 3)];
    let strength = |pair: (u32, u32)| {
        Known::map(stand, axis, 1.0, &|c| with_exchanged(c, pair)).strength(stand, axis)
    };
    // Some pairs, where the noise reaches over few codes, are not enough whatever their chance.
    let enough: Vec<_> = PAIRS
        .into_iter()
        .filter(|p| strength(*p) >= wanted)
        .collect();
    let pair = match enough.len() {
        0 => (2, 3),
        k => enough[draw.of_many(k)],
    };
    map(axis, move |c| with_exchanged(c, pair))
}

/// A gate against disturbances that was set too narrow: a reading beyond it is taken out, and the mean of the one before
/// and the one after put in its place. There is no rail on which readings would crowd: they are gone. Its strength is that
/// of its codes alone, the gate the widest, in whole counts, that has the wanted one, or the one that has most.
pub(super) fn gated(stand: &Stand, axis: usize, wanted: f64) -> Shape {
    let (mean, sigma) = mean_and_sigma(stand, axis);
    let known = |gate: i32| {
        let (first, law) = law_of_gate(stand, axis, gate);
        Known::codes(first, law)
    };
    let strength = |gate: i32| known(gate).strength(stand, axis);
    // Within a sigma few readings are left that were not made of others.
    let gates = || (sigma.ceil() as i32..=(5.0 * sigma).ceil() as i32).rev();
    let strongest = gates().max_by(|a, b| strength(*a).total_cmp(&strength(*b)));
    let gate = gates()
        .find(|gate| strength(*gate) >= wanted)
        .or(strongest)
        .unwrap_or(1);
    let middle = mean.round() as i32;
    let change = Change::made(move |counts, _| {
        let own = &counts[axis];
        let last = own.len() - 1;
        let given = |i: usize| {
            if (own[i] - middle).abs() <= gate {
                return own[i];
            }
            let (before, after) = (own[i.saturating_sub(1)], own[(i + 1).min(last)]);
            // Half counts upward and downward in turn.
            (before + after + (i % 2) as i32).div_euclid(2)
        };
        (0..own.len()).map(given).collect()
    });
    Shape::Fixed(known(gate), change)
}

/// Lines printed with few digits, and read again: in one of the forms that are strong enough, or the coarsest.
pub(super) fn printed(draw: &mut Draw, stand: &Stand, axis: usize, wanted: f64) -> Shape {
    let strong = |form: &&Form| {
        Known::map(stand, axis, 1.0, &|c| form.read(c)).strength(stand, axis) >= wanted
    };
    let enough: Vec<&Form> = FORMS.iter().filter(strong).collect();
    let form = match enough.len() {
        0 => FORMS[FORMS.len() - 1],
        k => *enough[draw.of_many(k)],
    };
    map(axis, move |code| form.read(code))
}

/// A rate printed by its whole and its hundredths, as "%d.%d" does: the zero of hundredths below ten is missing, and 1.05
/// is read again as 1.5. Some lines are printed so.
pub(super) fn without_zero(code: i32) -> i32 {
    const HUNDREDTHS: i32 = 100;
    let hundredths = (f64::from(HUNDREDTHS) * LSB * f64::from(code)).round() as i32;
    let part = hundredths.abs() % HUNDREDTHS;
    // What has one digit counts tenths.
    let read = if part < 10 { 10 * part } else { part };
    let whole = hundredths.abs() - part;
    let rate = f64::from(hundredths.signum() * (whole + read)) / f64::from(HUNDREDTHS);
    if part < 10 && part > 0 {
        (rate / LSB).round() as i32
    } else {
        code
    }
}
