//! The view as plain text of 80 columns: what stays on a terminal when it has ended, and what goes elsewhere.

use std::fmt::Write;

use super::{AXES, Point, Snapshot};
use crate::report::plot::{number as digits, tidy};

/// A number, or a dash where there is none.
pub(super) fn number(value: Option<f64>, width: usize, decimals: usize) -> String {
    match value {
        Some(value) => format!("{value:>width$.decimals$}"),
        None => format!("{:>width$}", "-"),
    }
}

/// A deviation with its interval.
pub(super) fn interval(point: &Point) -> String {
    let [low, value, high] = [point.low, point.deviation, point.high].map(|v| digits(v, 3));
    format!("{value} [{low}..{high}]")
}

impl Snapshot {
    /// What is missing, and who lost it.
    pub(super) fn losses(&self) -> String {
        if self.missing == 0 {
            return "0 missing".to_owned();
        }
        let (board, line) = (self.lost_by_board, self.lost_by_line);
        format!("{} missing (board {board}, line {line})", self.missing)
    }

    /// Flags of the last second.
    pub(super) fn state(&self) -> String {
        match self.flags.is_empty() {
            true => "in order".to_owned(),
            false => self.flags.join(", "),
        }
    }

    /// The board's counters.
    pub(super) fn counted(&self) -> String {
        match self.counters.as_deref() {
            None => "not sent yet".to_owned(),
            Some([]) => "all 0".to_owned(),
            Some(counters) => counters
                .iter()
                .map(|(name, count)| format!("{name} {count}"))
                .collect::<Vec<_>>()
                .join(", "),
        }
    }

    /// Both kinds of jitter, and the board's clock against this computer's.
    pub(super) fn clocks(&self) -> String {
        let scaled = |value: Option<f64>, factor: f64, unit: &str| {
            value.map_or_else(|| "-".to_owned(), |v| format!("{:.1} {unit}", v * factor))
        };
        let mut out = format!(
            "jitter: sampling {}, arrival {}",
            scaled(self.sampling_jitter_s, 1e6, "us"),
            scaled(self.arrival_jitter_s, 1e3, "ms")
        );
        if let Some(ppm) = self.clock_ppm {
            let _ = write!(out, "; clock {ppm:+.0} ppm");
        }
        out
    }

    /// A page.
    #[must_use]
    pub fn page(&self, port: &str, board: &str) -> String {
        let mut out = String::new();
        let _ = writeln!(out, "{board}, on {port}");
        let _ = writeln!(
            out,
            "{:.0} s at {:.4} Hz: {} samples, {}, {} restarts, {} frames rejected",
            self.seconds,
            self.rate_hz,
            self.samples,
            self.losses(),
            self.restarts,
            self.rejected
        );
        let _ = writeln!(out, "{}\n", self.clocks());
        let _ = writeln!(out, "last second    deg/s       rms    degC      m/s^2");
        for (k, axis) in AXES.iter().enumerate() {
            let gyro = &self.gyros[k];
            let _ = writeln!(
                out,
                "  {axis}       {} {} {} {}",
                number(gyro.mean_dps, 11, 4),
                number(gyro.rms_dps, 9, 4),
                number(gyro.temp_c, 7, 2),
                number(self.acc_mps2[k], 10, 3)
            );
        }
        let pwm = self
            .pwm
            .map_or_else(|| "-".to_owned(), |pwm| pwm.to_string());
        let _ = writeln!(
            out,
            "  supply {} V   motor {pwm}",
            number(self.supply_v, 6, 3)
        );
        let _ = writeln!(out, "  {}\n", self.state());
        self.allan_table(&mut out);
        let _ = writeln!(out, "\nboard's counters: {}", self.counted());
        out
    }

    /// Deviations by averaging time, an axis a column.
    fn allan_table(&self, out: &mut String) {
        let _ = writeln!(out, "Allan deviation, deg/s, with 95 % intervals");
        let mut taus: Vec<f64> = self.allan.iter().flatten().map(|p| p.tau_s).collect();
        taus.sort_by(f64::total_cmp);
        taus.dedup();
        if taus.is_empty() {
            let _ = writeln!(out, "  not enough samples yet");
            return;
        }
        let names = AXES.map(|axis| format!("{:>24}", format!("gyro {axis}")));
        let _ = writeln!(out, "{:>8}{}", "tau", names.join(""));
        for tau in taus {
            let _ = write!(out, "{:>8}", format!("{} s", tidy(tau, 4)));
            for points in &self.allan {
                let point = points.iter().find(|p| p.tau_s == tau);
                let cell = point.map_or_else(|| "-".to_owned(), interval);
                let _ = write!(out, "{cell:>24}");
            }
            let _ = writeln!(out);
        }
    }
}
