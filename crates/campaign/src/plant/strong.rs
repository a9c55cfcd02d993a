//! Effects of the library whose strength is a d', one row each: what their parameters are drawn from.

use super::{Asked, Drawn, LibraryEffect, Value, Values};
use crate::motor;
use crate::random::Draw;
use crate::series::{each, one_if};
use crate::stand::{Needs, Stand};
use crate::strength::{Meter, of_common, of_variance, size_for};

/// How one is drawn on a stand whose excitation may gain a turn or a sway.
pub type How = fn(&mut Draw, &mut Stand, Asked) -> Drawn;
type Row = LibraryEffect<How>;

/// The motor's bias by physics: it follows the current of a motor that has to spin up, not the command.
pub(super) const CURRENT: &str = "motor_bias by current";

const fn row(id: u16, cause: &'static str, how: How) -> Row {
    Row::new(id, cause, how)
}

/// The rows, by number. What is asked beyond the usual has its reason in docs/power.md, "Bars".
#[rustfmt::skip]
pub const STRONG: [Row; 25] = [
    row(100, "temperature", |_, s, a| size(s, a, "slope")).needs(Needs::TEMPERATURE),
    row(101, "temperature_quadratic", parabola).needs(Needs::TEMPERATURE),
    row(102, "warm_up", warm_up),
    row(103, "rate_ramp", |_, s, a| size(s, a, "slope")),
    row(104, "line", line).asked(8.0, 1.7),
    row(105, "am_line", am_line).asked(13.0, 2.5),
    row(106, "motor_bias", motor_bias).needs(Needs::MOTOR),
    row(107, "motor_bias", by_current).needs(Needs::MOTOR).called(CURRENT),
    row(108, "motor_noise", motor_noise).needs(Needs::MOTOR),
    row(109, "g_sensitivity", g_sensitivity).needs(Needs::VIBRATION),
    row(110, "supply_sensitivity", |_, s, a| size(s, a, "slope")).needs(Needs::SUPPLY),
    row(111, "bias_step", bias_step).asked(8.0, 1.5),
    row(112, "cross_axis", cross_axis).on_a_moving_base(),
    Row { true_parts: &["base_motion"], ..row(113, "scale_error", scale_error).asked(10.0, 2.0).on_a_moving_base() },
    row(114, "gauss_markov", gauss_markov),
    row(115, "flicker", flicker),
    row(116, "low_pass", low_pass),
    row(117, "telegraph", telegraph).asked(10.0, 2.0),
    row(118, "common_noise", common_noise).on_all_channels(),
    row(119, "noise_change", noise_change).asked(10.0, 2.0),
    row(120, "narrow_band", narrow_band),
    row(121, "wandering_line", wandering_line),
    row(122, "quantization_noise", quantization_noise),
    row(123, "correlated_noise", correlated_noise),
    row(124, "shock", shock).asked(8.0, 1.7),
];

/// Largest process, deg/s rms: slower ones, which a random walk hides better, would need more for the strength, and what
/// moves that much below 1 Hz is a turn of the base to anyone who has the gyro alone.
pub const LARGEST_RMS: f64 = 0.25;
/// Below that frequency, Hz.
pub const TURNS_BELOW_HZ: f64 = 1.0;

/// A shape whose size is one parameter.
fn size(stand: &Stand, asked: Asked, name: &'static str) -> Drawn {
    shape(stand, asked, &[], (name, asked.sign))
}

/// A shape of these parameters, whose size is another.
fn shape(stand: &Stand, asked: Asked, shape: &[Value], size: Value) -> Drawn {
    Drawn::shape(stand, asked, (shape, &[size]), &[])
}

/// Measured beyond a straight line, for a parabola that a line fits is none.
fn parabola(draw: &mut Draw, stand: &mut Stand, asked: Asked) -> Drawn {
    let lean = draw.between(-5.0, 5.0);
    let sized = [("slope", asked.sign * lean), ("curvature", asked.sign)];
    let line = stand.world.temperature[asked.axis].clone();
    Drawn::shape(stand, asked, (&[], &sized), &[line])
}

fn warm_up(draw: &mut Draw, stand: &mut Stand, asked: Asked) -> Drawn {
    let tau = draw.by_ratio(stand.seconds / 60.0, stand.seconds / 4.0);
    let values = [("time_constant", tau)];
    shape(stand, asked, &values, ("amplitude", asked.sign))
}

fn line(draw: &mut Draw, stand: &mut Stand, asked: Asked) -> Drawn {
    let f = draw.by_ratio(0.05, 0.49 * stand.rate_hz);
    let values = [("frequency", f), ("phase", draw.between(-3.1, 3.1))];
    shape(stand, asked, &values, ("amplitude", 1.0))
}

fn am_line(draw: &mut Draw, stand: &mut Stand, asked: Asked) -> Drawn {
    let frequency = draw.between(0.05, 0.45) * stand.rate_hz;
    let values = [
        ("frequency", frequency),
        ("modulation_frequency", draw.by_ratio(0.02, 0.2 * frequency)),
        ("depth", draw.between(0.5, 1.0)),
        ("phase", draw.between(-3.1, 3.1)),
        ("modulation_phase", draw.between(-3.1, 3.1)),
    ];
    shape(stand, asked, &values, ("amplitude", 1.0))
}

fn motor_bias(draw: &mut Draw, stand: &mut Stand, asked: Asked) -> Drawn {
    let both = stand.world.duty.iter().any(|d| *d < 0.0);
    let values = [("by_magnitude", one_if(both && draw.chance(0.4)))];
    shape(stand, asked, &values, ("at_full_duty", asked.sign))
}

fn by_current(draw: &mut Draw, stand: &mut Stand, asked: Asked) -> Drawn {
    let unit = motor::current(draw, &stand.world.duty, stand.rate_hz);
    let meter = Meter::new(stand, asked.axis);
    let (size, strength) = meter.sized(&meter.energy(&unit), asked.wanted);
    Drawn {
        signal: Some(each(&unit, |v| asked.sign * size * v)),
        ..Drawn::of(vec![], strength)
    }
}

fn motor_noise(_: &mut Draw, stand: &mut Stand, asked: Asked) -> Drawn {
    let law = |size: f64| each(&stand.world.duty, |d| 1.0 + size * (d * d));
    let size = size_for(asked.wanted, &|x| of_variance(&law(x)));
    let values = vec![("variance_increase_at_full_duty", size)];
    Drawn::of(values, of_variance(&law(size)))
}

fn noise_change(draw: &mut Draw, stand: &mut Stand, asked: Asked) -> Drawn {
    let seconds = stand.seconds;
    let length = seconds * draw.between(0.1, 0.4);
    let start = draw.between(0.02 * seconds, 0.98 * seconds - length);
    let inside = length / seconds;
    let strength = |x: f64| {
        let square = (1.0 + inside * x).ln() - inside * (1.0 + x).ln();
        (stand.samples() as f64 * square).max(0.0).sqrt()
    };
    let size = size_for(asked.wanted, &strength);
    let (end, louder) = (start + length, ("variance_increase", size));
    let values = vec![("start", start), ("end", end), louder];
    Drawn::of(values, strength(size))
}

fn g_sensitivity(draw: &mut Draw, stand: &mut Stand, asked: Asked) -> Drawn {
    let axis = draw.one_of(&["acc_x", "acc_y", "acc_z"]);
    size(stand, asked, axis)
}

fn bias_step(draw: &mut Draw, stand: &mut Stand, asked: Asked) -> Drawn {
    let at = stand.seconds * draw.between(0.1, 0.9);
    shape(stand, asked, &[("time", at)], ("height", asked.sign))
}

/// A half sine or a ring that several readings see: one alone is as well a disturbed word.
fn shock(draw: &mut Draw, stand: &mut Stand, asked: Asked) -> Drawn {
    let mut values = vec![
        ("time", stand.seconds * draw.between(0.05, 0.95)),
        ("duration", draw.by_ratio(4.0 / stand.rate_hz, 0.9)),
    ];
    let mut sign = asked.sign;
    if draw.chance(0.5) {
        values.push(("frequency", stand.rate_hz * draw.between(0.05, 0.45)));
        values.push(("phase", draw.between(-3.1, 3.1)));
        sign = 1.0;
    }
    shape(stand, asked, &values, ("peak", sign))
}

fn cross_axis(draw: &mut Draw, stand: &mut Stand, asked: Asked) -> Drawn {
    let (turn, period) = (draw.between(7.0, 28.0), draw.between(15.0, 60.0));
    stand.excitation = vec![("turn_dps", turn), ("turn_period_s", period)];
    size(stand, asked, "from_gyro_z")
}

fn scale_error(draw: &mut Draw, stand: &mut Stand, asked: Asked) -> Drawn {
    let (sway, period) = (draw.between(2.0, 8.0), draw.between(5.0, 20.0));
    stand.excitation = vec![("sway_deg", sway), ("sway_period_s", period)];
    // Amplitude of the rate, and how well rate and tilt give it: sqrt(2 / n) of their white noise.
    let w = std::f64::consts::TAU / period;
    let n = stand.samples() as f64;
    let tilt = (4.7f64 / 800.0).to_degrees() * w;
    let error = ((2.0 / n) * (stand.white(asked.axis) + tilt * tilt)).sqrt() / (sway * w);
    let relative = asked.sign * (asked.wanted * error).min(0.5);
    Drawn::of(vec![("relative", relative)], relative.abs() / error)
}

/// A process of the size that is as strong as asked, or of the largest: size, strength, density by bin.
fn of_density(
    stand: &Stand,
    asked: Asked,
    largest: f64,
    density: &dyn Fn(f64, f64) -> f64,
) -> (f64, f64, Vec<f64>) {
    let meter = Meter::new(stand, asked.axis);
    let all = |size: f64| each(meter.omega(), |w| density(size, w));
    let strength = |size: f64| meter.of_density(&all(size));
    let size = size_for(asked.wanted, &strength).min(largest);
    (size, strength(size), all(size))
}

/// Density of a process of variance 1 with one pole, rad per sample.
fn one_pole(pole: f64, w: f64) -> f64 {
    (1.0 - pole * pole) / (1.0 + pole * pole - 2.0 * pole * w.cos())
}

/// A process with one pole whose time is drawn anew until it is as strong as wanted, or else the strongest of many: the
/// time, the size, the strength and the density. The pole is exp(-`per_time` / samples of the time).
fn strongest(
    draw: &mut Draw,
    stand: &Stand,
    asked: Asked,
    (times, per_time): ((f64, f64), f64),
) -> (f64, f64, f64, Vec<f64>) {
    const TRIES: usize = 40;
    let mut drawn = || {
        let time = draw.by_ratio(times.0, times.1);
        let pole = (-per_time / (time * stand.rate_hz)).exp();
        let density = |size: f64, w: f64| size * size * one_pole(pole, w);
        let (size, strength, all) = of_density(stand, asked, LARGEST_RMS, &density);
        (time, size, strength, all)
    };
    let mut best = drawn();
    for _ in 0..TRIES {
        if best.2 >= 0.99 * asked.wanted {
            break;
        }
        let other = drawn();
        if other.2 > best.2 {
            best = other;
        }
    }
    best
}

fn gauss_markov(draw: &mut Draw, stand: &mut Stand, asked: Asked) -> Drawn {
    let (tau, sigma, strength, density) = strongest(draw, stand, asked, ((0.2, 10.0), 1.0));
    let values = vec![("sigma", sigma), ("correlation_time", tau)];
    Drawn::process(values, strength, density)
}

fn telegraph(draw: &mut Draw, stand: &mut Stand, asked: Asked) -> Drawn {
    let (dwell, half, strength, density) = strongest(draw, stand, asked, ((3.0, 40.0), 2.0));
    let values = vec![("half_height", half), ("dwell_time", dwell)];
    Drawn::process(values, strength, density)
}

/// A band about a centre, of the width that is called so: rms, strength, centre and width, density. Some hundred independent
/// values of the envelope, and no wider than a tenth of the centre.
fn band(
    draw: &mut Draw,
    stand: &Stand,
    asked: Asked,
    wide: &'static str,
) -> (f64, f64, Values, Vec<f64>) {
    let centre = draw.by_ratio(0.03, 0.45) * stand.rate_hz;
    let width = draw.by_ratio(30.0, 300.0) / (std::f64::consts::PI * stand.seconds);
    let width = width.min(0.1 * centre);
    let per_sample = std::f64::consts::TAU / stand.rate_hz;
    let (pole, turn) = ((-0.5 * per_sample * width).exp(), per_sample * centre);
    let density =
        |rms: f64, w: f64| 0.5 * rms * rms * (one_pole(pole, w - turn) + one_pole(pole, w + turn));
    let (rms, strength, all) = of_density(stand, asked, f64::INFINITY, &density);
    let values = vec![("center_frequency", centre), (wide, width)];
    (rms, strength, values, all)
}

fn narrow_band(draw: &mut Draw, stand: &mut Stand, asked: Asked) -> Drawn {
    let (rms, strength, values, density) = band(draw, stand, asked, "bandwidth");
    Drawn::process([vec![("rms", rms)], values].concat(), strength, density)
}

fn wandering_line(draw: &mut Draw, stand: &mut Stand, asked: Asked) -> Drawn {
    let (rms, strength, values, density) = band(draw, stand, asked, "linewidth");
    let values = [vec![("amplitude", rms * 2f64.sqrt())], values].concat();
    Drawn::process(values, strength, density)
}

/// Two-sided density B^2 / (2 pi f): B^2 / w per sample.
fn flicker(_: &mut Draw, stand: &mut Stand, asked: Asked) -> Drawn {
    let (b, strength, density) = of_density(stand, asked, LARGEST_RMS, &|b, w| b * b / w);
    Drawn::process(vec![("bias_instability", b * 3600.0)], strength, density)
}

/// With another axis the other way about: what goes the same way is common noise.
fn correlated_noise(draw: &mut Draw, stand: &mut Stand, asked: Asked) -> Drawn {
    let other = (asked.axis + 1 + draw.of_many(2)) % 3;
    let with = ["with_gyro_x", "with_gyro_y", "with_gyro_z"][other];
    let n = stand.samples() as f64;
    let strength = |r: f64| (-n * (1.0 - r * r).ln()).sqrt();
    let r = (1.0 - (-asked.wanted.powi(2) / n).exp()).sqrt();
    Drawn::of(vec![(with, -r)], strength(r))
}

/// The angle's rounding of standard deviation q, differenced: 2 (q f_s)^2 (1 - cos w) per sample.
fn quantization_noise(_: &mut Draw, stand: &mut Stand, asked: Asked) -> Drawn {
    let rate = stand.rate_hz;
    let density = |q: f64, w: f64| 2.0 * (q * rate).powi(2) * (1.0 - w.cos());
    let (q, strength, density) = of_density(stand, asked, f64::INFINITY, &density);
    Drawn::process(vec![("q", q)], strength, density)
}

fn low_pass(_: &mut Draw, stand: &mut Stand, asked: Asked) -> Drawn {
    let white = stand.white(asked.axis);
    let of = |rho: f64| rho.min(0.7);
    let density = |rho: f64, w: f64| match of(rho) {
        rho if rho <= 0.3 => white * (2.0 * rho * w.cos()),
        rho => white * (one_pole(rho, w) - 1.0),
    };
    let (rho, strength, density) = of_density(stand, asked, f64::INFINITY, &density);
    Drawn::process(vec![("lag1_correlation", of(rho))], strength, density)
}

fn common_noise(_: &mut Draw, stand: &mut Stand, asked: Asked) -> Drawn {
    let whites: Vec<f64> = (0..3).map(|i| stand.white(i)).collect();
    let strength = |s: f64| of_common(&whites, s * s, stand.samples());
    let sigma = size_for(asked.wanted, &strength);
    Drawn::of(vec![("sigma", sigma)], strength(sigma))
}
