use adis16250::Word;
use wire::correction::{self, FORMAT, Inputs, NUMBERS, Numbers, Twin};
use zerocopy::FromZeros;

use super::*;
use crate::acquire::Job;

mod attitude;
mod gate;
mod warming;

/// An EEPROM, and nothing else.
struct Eeprom([u8; 512]);

impl Board for Eeprom {
    fn send(&mut self, _: u8, _: &[u8]) -> bool {
        true
    }
    fn room(&self) -> u8 {
        191
    }
    fn set_motor(&mut self, _: i16) {}
    fn keep_alive(&mut self) {}
    fn host_is_there(&self) -> bool {
        false
    }
    fn is_stopped(&self) -> bool {
        false
    }
    fn forget_stop(&mut self) {}
    fn set_period(&mut self, _: u16, _: u8) {}
    fn set_baud(&mut self, _: u16) {}
    fn set_acc_range(&mut self, _: u8) {}
    fn post(&mut self, _: Job) -> bool {
        false
    }
    fn eeprom_read(&mut self, address: u16) -> u8 {
        self.0[usize::from(address)]
    }
    fn eeprom_is_ready(&mut self) -> bool {
        true
    }
    fn eeprom_write(&mut self, address: u16, byte: u8) {
        self.0[usize::from(address)] = byte;
    }
    fn reboot(&mut self) {}
    fn reset_cause(&self) -> u8 {
        0
    }
    fn kept(&self) -> [u16; 2] {
        unreachable!()
    }
    fn keep(&mut self, _: [u16; 2]) {
        unreachable!()
    }
    fn restarts(&self) -> u16 {
        0
    }
    fn stack_free(&self) -> u16 {
        0
    }
    fn ticks_since(&self) -> u16 {
        0
    }
}

impl Eeprom {
    fn erased() -> Self {
        Self([0xff; 512])
    }

    fn put(&mut self, copy: usize, numbers: &Numbers) {
        let bytes = correction::bytes(numbers);
        let at = usize::from(COPIES[copy]);
        self.0[at..at + bytes.len()].copy_from_slice(&bytes);
        let crc = wire::crc::crc32c(&bytes).to_le_bytes();
        self.0[at + bytes.len()..at + STORED_LEN].copy_from_slice(&crc);
    }
}

/// SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn between(&mut self, low: i64, high: i64) -> i64 {
        low + (self.next() % (high - low + 1).unsigned_abs()).cast_signed()
    }

    /// About normal: twelve uniform numbers less six.
    fn normal(&mut self) -> f64 {
        let uniform = |x: u64| (x >> 11) as f64 / (1u64 << 53) as f64;
        (0..12).map(|_| uniform(self.next())).sum::<f64>() - 6.0
    }
}

/// Any numbers under a header in order.
fn numbers(random: &mut Random, edges: bool) -> Numbers {
    let mut all = [0i16; NUMBERS];
    for number in &mut all {
        *number = match random.next() % 4 {
            0 if edges => i16::MIN,
            1 if edges => i16::MAX,
            _ => random.next() as i16,
        };
    }
    let format = i16::from_le_bytes([FORMAT, 0]);
    let shift = random.between(0, 7) as i16;
    let range = random.next() as i16;
    all[..6].copy_from_slice(&[format, 77, shift, SENS_AVG.cast_signed(), range, 0]);
    all
}

/// SENS/AVG of the built-in set-up.
const SENS_AVG: u16 = 0x0402;
const Q20: f64 = 1_048_576.0;

fn raw(rate: [i16; 3], temp: [i16; 3], supply: u16, acc: [u16; 3]) -> Raw {
    Raw {
        gyro: rate.map(|rate| Word(rate.cast_unsigned() & 0x3fff)),
        temp: temp.map(|t| Word(t.cast_unsigned() & 0x0fff)),
        supply: [Word(supply); 3],
        acc,
        ..Raw::new()
    }
}

/// The scale in double precision.
fn scale() -> f64 {
    f64::from(Config::default().set_up.scale[0].get()) / f64::from(1 << 24)
}

/// A rate in counts.
fn in_counts(dps: f64) -> i16 {
    (dps / scale()).round().clamp(-8192.0, 8191.0) as i16
}

/// A correction on a board.
struct OnBoard {
    board: Eeprom,
    correction: Correction,
}

impl OnBoard {
    fn with(copy: usize, numbers: &Numbers) -> Self {
        let mut board = Eeprom::erased();
        board.put(copy, numbers);
        let mut correction = Correction::new();
        assert!(correction.on(&mut board));
        Self { board, correction }
    }

    /// A sample in order: its rates, and the frame.
    fn step(&mut self, raw: &Raw, duty: i16) -> ([f64; 3], Corrected) {
        let out = self.step_of(raw, duty, &Config::default(), true);
        (out.rate.map(|rate| f64::from(rate.get()) / Q20), out)
    }

    fn step_of(&mut self, raw: &Raw, duty: i16, config: &Config, in_order: bool) -> Corrected {
        let board = &mut self.board;
        self.correction.end(board);
        (self.correction).step(board, raw, 0, duty, config, in_order);
        self.correction.turn(raw);
        self.correction.frame
    }
}

/// The larger size. What is no number is not small, which `f64::max` would make it.
fn worse(worst: f64, off: f64) -> f64 {
    assert!(off.is_finite(), "{off}");
    worst.max(off.abs())
}

/// The same sample for the twin.
fn inputs(raw: &Raw, duty: i16) -> Inputs {
    Inputs {
        rate: raw.gyro.map(|word| f64::from(word.signed_14()) * scale()),
        temp: raw.temp.map(Word::signed_12),
        supply: raw.supply[0].unsigned_12(),
        acc: raw.acc,
        duty,
        t_ticks: raw.t_ticks,
        in_order: true,
    }
}

/// Coefficients and inputs over their whole ranges, edges among them: never a wrap, never 1e-4 deg/s off the twin.
#[test]
fn the_models_terms_are_those_of_the_twin_over_the_whole_range() {
    let mut random = Random(25);
    let mut worst = 0.0f64;
    for draw in 0..4_000 {
        let numbers = numbers(&mut random, draw % 2 == 0);
        let mut board = OnBoard::with(draw % 2, &numbers);
        let mut twin = Twin::new(&correction::Correction::from_numbers(&numbers).unwrap());
        let raw = raw(
            [0; 3].map(|_| random.between(-8192, 8191) as i16),
            [0; 3].map(|_| random.between(-2048, 2047) as i16),
            random.between(0, 4095) as u16,
            [0; 3].map(|_| random.between(0, 1023) as u16),
        );
        let duty = random.between(-255, 255) as i16;
        let (got, _) = board.step(&raw, duty);
        for (got, wanted) in got.into_iter().zip(twin.step(&inputs(&raw, duty))) {
            worst = worse(worst, got - wanted);
        }
    }
    println!("worst of 12000: {worst:.2e} deg/s");
    assert!(worst < 1e-4, "{worst}");
}

/// An hour at 20 Hz: the paper's noise and others, a temperature that wanders, the motor now and then. Of the filter's bias the
/// fixed point may cost a tenth of its own standard deviation, rms (a mean on the gate's edge is taken by one
/// and refused by the other); of the model's terms, which the twin takes with the board's bias,
/// the bound of the test above.
#[test]
fn the_filter_follows_the_twin_for_an_hour() {
    for seed in 1..=8 {
        let mut random = Random(seed);
        let meant = correction::Correction {
            number: 1,
            block_shift: 4,
            sens_avg: SENS_AVG,
            temp_range: [-20, 80],
            bias: [0.7, -1.3, 0.02],
            temperature: [0.003, -0.01, 0.0],
            temperature_squared: [1e-6, 0.0, -2e-6],
            motor: [0.001, 0.0, -0.0007],
            matrix: [[0.004, 0.0, 0.02], [0.01, -0.007, 0.0], [-0.02, 0.001, 0.0]],
            noise: [0.0096, 0.0026, 0.04],
            walk: [8e-7, 1e-7, 3e-6],
            ..correction::Correction::default()
        };
        let numbers = meant.numbers().unwrap();
        let mut board = OnBoard::with(0, &numbers);
        let mut twin = Twin::new(&correction::Correction::from_numbers(&numbers).unwrap());
        let (mut worst, mut of_sigma) = (0.0f64, 0.0f64);
        for n in 0..72_000u32 {
            let duty = if n % 9_000 > 8_000 { 150 } else { 0 };
            let temp = [0, 1, 2].map(|k| {
                (100.0 * (f64::from(n) / 4000.0 + f64::from(k)).sin() + random.normal()) as i16
            });
            // The world is as the model has it.
            let rate = [0, 1, 2].map(|k| {
                let t = 100.0 * (f64::from(n) / 4000.0 + k as f64).sin();
                let model =
                    meant.bias[k] + t * (meant.temperature[k] + t * meant.temperature_squared[k]);
                in_counts([0.39, 0.2, 0.8][k] * random.normal() - 0.5 - model)
            });
            let raw = raw(rate, temp, 2730, [512, 512, 760]);
            let told = [0, 1, 2].map(|axis| {
                let its = &twin.axes[axis];
                (its.bias, (meant.noise[axis] / its.known).sqrt())
            });
            let (got, frame) = board.step(&raw, duty);
            let wanted = twin.step(&inputs(&raw, duty));
            for axis in 0..3 {
                let (bias, sigma) = told[axis];
                let off = f64::from(frame.bias[axis].get()) / Q20 - bias;
                if sigma.is_finite() {
                    of_sigma += (off / sigma).powi(2) / 216_000.0;
                }
                worst = worse(worst, got[axis] + off - wanted[axis]);
            }
        }
        println!(
            "seed {seed}: terms {worst:.2e} deg/s, bias {:.3} of its sigma, rms",
            of_sigma.sqrt()
        );
        assert!(worst < 1e-4, "{worst}");
        assert!(of_sigma.sqrt() < 0.1, "{of_sigma}");
    }
}

#[test]
fn with_any_numbers_and_any_inputs_nothing_wraps_or_panics() {
    let mut random = Random(7);
    for draw in 0..300 {
        let mut board = OnBoard::with(1, &numbers(&mut random, draw % 2 == 0));
        for _ in 0..600 {
            let near = random.next().is_multiple_of(2);
            let size = if near { 9 } else { 8191 };
            let raw = raw(
                [0; 3].map(|_| random.between(-size, size) as i16),
                [0; 3].map(|_| random.next() as i16),
                random.next() as u16,
                [random.between(0, 1023) as u16; 3],
            );
            let duty = if near {
                0
            } else {
                random.between(-255, 255) as i16
            };
            board.step(&raw, duty);
            for axis in &board.correction.axes {
                assert!((-192..768).contains(&axis.noise), "{}", axis.noise);
            }
        }
    }
}

#[test]
fn gyros_set_up_otherwise_are_not_corrected_and_it_is_said() {
    let mut board = OnBoard::with(0, &numbers(&mut Random(3), false));
    let raw = raw([100, -8192, 0], [0; 3], 2730, [512; 3]);
    let mut config = Config::default();
    config.set_up.gyro_filter = 3;
    let out = board.step_of(&raw, 0, &config, true);
    assert_eq!((out.state, out.correction.get()), (0, 77));
    let out = board.step_of(&raw, 0, &Config::default(), false);
    assert_eq!(out.state & (APPLIED | NOT_IN_ORDER), APPLIED | NOT_IN_ORDER);
    assert_eq!(out.state & AT_REST, 0);
}

/// A copy is written over byte by byte, and the power fails behind any of them: what is found is the old one or the new.
#[test]
fn a_cut_at_any_byte_leaves_a_correction_that_is_whole() {
    let mut random = Random(11);
    let (old, mut new) = (numbers(&mut random, false), numbers(&mut random, false));
    (new[0], new[1]) = (i16::from_le_bytes([FORMAT, 1]), 78);
    for over in [false, true] {
        let mut after = Eeprom::erased();
        after.put(0, &old);
        if over {
            let mut older = numbers(&mut random, false);
            older[0] = i16::from_le_bytes([FORMAT, 255]);
            after.put(1, &older);
        }
        let before = after.0;
        after.put(1, &new);
        for cut in 0..=STORED_LEN {
            let at = usize::from(COPIES[1]);
            let mut board = Eeprom(before);
            board.0[at..at + cut].copy_from_slice(&after.0[at..at + cut]);
            let mut correction = Correction::new();
            assert!(correction.on(&mut board));
            let wanted = if cut == STORED_LEN { 2 } else { 1 };
            assert_eq!(correction.in_use(), wanted, "{cut}");
        }
    }
    assert!(!Correction::new().on(&mut Eeprom::erased()));
    assert!(!Correction::new().on(&mut Eeprom([0; 512])));
}

#[test]
fn a_steady_turn_and_a_driven_motor_are_no_rest_and_a_wrong_noise_shows() {
    let meant = correction::Correction {
        block_shift: 4,
        sens_avg: SENS_AVG,
        temp_range: [-25, 25],
        noise: [0.01; 3],
        walk: [1e-7; 3],
        ..correction::Correction::default()
    };
    let mut board = OnBoard::with(0, &meant.numbers().unwrap());
    let mut random = Random(2);
    let mut noise_off = 0;
    let mut run = |mean: f64, sigma: f64, duty: i16, blocks: usize| {
        let mut last = Corrected::new_zeroed();
        noise_off = 0;
        for _ in 0..16 * blocks {
            let rate = [0; 3].map(|_| in_counts(mean + sigma * random.normal()));
            last = board.step(&raw(rate, [0, 0, 104], 2730, [512; 3]), duty).1;
            noise_off += u32::from(last.state & NOISE_OFF != 0);
        }
        last
    };
    let bias = |out: &Corrected| f64::from(out.bias[0].get()) / Q20;
    // Block means of the variance that it was told: 16 samples of 0.4 deg/s.
    let rested = run(0.3, 0.4, 0, 400);
    assert!((bias(&rested) - 0.3).abs() < 0.03, "{}", bias(&rested));
    assert_eq!(
        rested.state,
        APPLIED | FILTERED | AT_REST | EXTRAPOLATED | YAW_FREE
    );
    let sigma = (0.01 / (f64::from(rested.known[0].get()) / 256.0)).sqrt();
    assert!((0.004..0.02).contains(&sigma), "{sigma}");
    let turning = run(2.0, 0.4, 0, 50);
    assert_eq!(turning.state & REFUSED, REFUSED);
    let fast = run(40.0, 0.4, 0, 50);
    assert_eq!(fast.state & AT_REST, 0);
    let driven = run(0.3, 0.4, 90, 50);
    assert_eq!(driven.state & AT_REST, 0);
    assert_eq!(bias(&driven), bias(&turning), "nothing was learned");
    // Nine times the variance that it was told.
    run(0.3, 1.2, 0, 1200);
    assert!(noise_off > 16 * 60, "{noise_off}");
}

/// A correction that changes nothing, of gyros with this noise: the attitude alone.
fn plain(noise: f64) -> correction::Correction {
    correction::Correction {
        block_shift: 4,
        sens_avg: SENS_AVG,
        temp_range: [-25, 25],
        noise: [noise; 3],
        walk: [1e-9; 3],
        ..correction::Correction::default()
    }
}

/// Motor steps with a surge that dies away with 0.2 s: what is left is what the noise of a reading leaves.
#[test]
fn the_surge_behind_a_step_of_the_motor_is_taken_off() {
    let surge = 2.0 / 255.0;
    let meant = correction::Correction {
        follow: 1.0 - (-0.05f64 / 0.2).exp(),
        surge: [-surge, 0.0, surge / 2.0],
        ..plain(0.0096)
    };
    let numbers = meant.numbers().unwrap();
    let mut board = OnBoard::with(0, &numbers);
    let mut twin = Twin::new(&correction::Correction::from_numbers(&numbers).unwrap());
    let (mut speed, mut worst, mut left, mut read) = (0.0, 0.0f64, 0.0f64, 0.0f64);
    for n in 0..4_000u32 {
        let duty = [0i16, 200, -255, 90, 0][n as usize / 100 % 5];
        let ahead = f64::from(duty) - speed;
        speed += (1.0 - (-0.05f64 / 0.2).exp()) * ahead;
        let rate = [surge, 0.0, -surge / 2.0].map(|surge| in_counts(surge * ahead));
        let raw = Raw {
            t_ticks: n * 12_500,
            ..raw(rate, [0; 3], 2730, [512, 512, 760])
        };
        let biases = twin.axes.map(|axis| axis.bias);
        let (got, frame) = board.step(&raw, duty);
        let wanted = twin.step(&inputs(&raw, duty));
        for axis in 0..3 {
            let off = f64::from(frame.bias[axis].get()) / Q20 - biases[axis];
            worst = worse(worst, got[axis] + off - wanted[axis]);
        }
        left = left.max(got[0].abs());
        read = read.max(f64::from(rate[0]).abs() * scale());
    }
    println!("twin {worst:.1e}, left {left:.3} of {read:.3} deg/s");
    assert!(worst < 1e-4, "{worst}");
    assert!(left < 0.06 && read > 3.0, "{left} {read}");
}

/// A sway below 4 deg/s with the motor off: about x, and a hundredth of it about the others. Slow or fast, the filter learns
/// nothing of it, and what it has learned at rest stays.
#[test]
fn a_sway_is_no_rest() {
    for (dps, period_s, shift) in [
        (3.5, 8.0, 4),
        (3.5, 3.0, 4),
        (3.8, 20.0, 4),
        (3.5, 4.0, 6),
        (2.5, 6.0, 7),
    ] {
        let meant = correction::Correction {
            block_shift: shift,
            noise: [0.16 / f64::from(1 << shift); 3],
            ..plain(0.0)
        };
        let mut board = OnBoard::with(0, &meant.numbers().unwrap());
        let mut random = Random(5);
        let mut run = |dps: f64, seconds: u32| {
            let mut learned = 0;
            let mut last = Corrected::new_zeroed();
            for n in 0..20 * seconds {
                let turn = dps * (std::f64::consts::TAU * f64::from(n) / 20.0 / period_s).sin();
                let rate = [turn, 0.01 * turn, -0.01 * turn]
                    .map(|turn| in_counts(0.3 + turn + 0.4 * random.normal()));
                let bias = last.bias[0].get();
                last = board.step(&raw(rate, [0; 3], 2730, [512; 3]), 0).1;
                learned += u32::from(last.bias[0].get() != bias);
            }
            (learned, f64::from(last.bias[0].get()) / Q20)
        };
        let (learned, rested) = run(0.0, 300);
        let blocks = 6_000 >> shift;
        assert!(
            learned + 2 + blocks / 50 >= blocks,
            "{learned} of {blocks} blocks at rest"
        );
        let (learned, swayed) = run(dps, 600);
        println!(
            "{dps} deg/s, {period_s} s, blocks of {}: {learned} of {} learned, {rested:.4} -> {swayed:.4}",
            1 << shift,
            12_000 >> shift
        );
        assert!(learned <= 2 + (12_000 >> shift) / 50, "{learned}");
        assert!((swayed - rested).abs() < 0.01, "{rested} {swayed}");
    }
}
