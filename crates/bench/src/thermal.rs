//! Temperatures of the board and the three gyro dies.

use std::f64::consts::TAU;

use crate::scenario::ThermalPart;

/// Two stages of first order: room and heater warm the board, the board warms the dies, and each stage heats itself.
///
/// tau dT/dt = T_outside + rise - T, solved exactly over a step in which the outside is constant.
#[derive(Clone, Debug)]
pub struct Thermal {
    part: ThermalPart,
    board_c: f64,
    die_c: [f64; 3],
}

impl Thermal {
    /// At power-on of the record, after `powered_before_s` of self-heating at the room's first temperature.
    #[must_use]
    pub fn new(part: ThermalPart) -> Self {
        let warmed = |rise: f64, tau: f64| rise * (1.0 - (-part.powered_before_s / tau).exp());
        let room = part.room_at(0.0);
        let board_c = room + warmed(part.board_rise_c, part.board_tau_s);
        let die_c = part
            .die_tau_s
            .map(|tau| board_c + warmed(part.die_rise_c, tau));
        Thermal {
            part,
            board_c,
            die_c,
        }
    }

    /// Moves on by `dt` s to the time `t` s.
    pub fn step(&mut self, t: f64, dt: f64) {
        let outside = self.part.room_at(t) + self.part.heater_at(t);
        let approach = |from: f64, to: f64, tau: f64| to + (from - to) * (-dt / tau).exp();
        self.board_c = approach(
            self.board_c,
            outside + self.part.board_rise_c,
            self.part.board_tau_s,
        );
        for (die, tau) in self.die_c.iter_mut().zip(self.part.die_tau_s) {
            *die = approach(*die, self.board_c + self.part.die_rise_c, tau);
        }
    }

    /// The board, degC.
    #[must_use]
    pub fn board_c(&self) -> f64 {
        self.board_c
    }

    /// The gyro dies, degC.
    #[must_use]
    pub fn die_c(&self) -> [f64; 3] {
        self.die_c
    }
}

impl ThermalPart {
    /// Room temperature at `t` s, degC.
    #[must_use]
    pub fn room_at(&self, t: f64) -> f64 {
        let swing = (TAU * (t / self.swing_period_s + self.swing_phase)).sin();
        self.room_c + self.drift_c_h * t / 3600.0 + self.swing_c * swing
    }

    /// What the heater adds at `t` s, degC: on in the first half of each period.
    #[must_use]
    pub fn heater_at(&self, t: f64) -> f64 {
        if (t / self.heater_period_s).rem_euclid(1.0) < 0.5 {
            self.heater_c
        } else {
            0.0
        }
    }
}
