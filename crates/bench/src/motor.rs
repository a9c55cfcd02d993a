//! The DC motor: L di/dt = u - R i - k w, J dw/dt = k i - b w - friction.

use crate::scenario::MotorPart;

/// Current and speed of the motor.
#[derive(Clone, Debug)]
pub struct Motor {
    part: MotorPart,
    current_a: f64,
    speed_rad_s: f64,
}

impl Motor {
    /// At rest.
    #[must_use]
    pub fn new(part: MotorPart) -> Self {
        Motor {
            part,
            current_a: 0.0,
            speed_rad_s: 0.0,
        }
    }

    /// Moves on by `dt` s at a duty of -1..1. Implicit Euler in both states, so that the step may be longer than L/R.
    pub fn step(&mut self, duty: f64, dt: f64) {
        let p = &self.part;
        let electrical = p.inductance_h / dt + p.resistance_ohm;
        let mechanical = p.inertia / dt + p.viscous;
        let emf = duty.clamp(-1.0, 1.0) * p.driver_v + p.inductance_h / dt * self.current_a;
        // k i - (J/dt + b) w = friction - J/dt w_old, (L/dt + R) i + k w = emf.
        let solve = |friction: f64| {
            let momentum = p.inertia / dt * self.speed_rad_s - friction;
            let speed = (p.constant * emf + electrical * momentum)
                / (electrical * mechanical + p.constant * p.constant);
            (speed, (emf - p.constant * speed) / electrical)
        };
        let (free, _) = solve(0.0);
        let (speed, current) = solve(p.coulomb * free.signum());
        if free == 0.0 || speed.signum() != free.signum() {
            // Friction holds: it takes what torque is needed, up to its limit.
            self.speed_rad_s = 0.0;
            self.current_a = emf / electrical;
        } else {
            self.speed_rad_s = speed;
            self.current_a = current;
        }
    }

    /// Winding current, A, signed as the duty.
    #[must_use]
    pub fn current_a(&self) -> f64 {
        self.current_a
    }

    /// Rotor, rad/s.
    #[must_use]
    pub fn speed_rad_s(&self) -> f64 {
        self.speed_rad_s
    }

    /// The table, deg/s.
    #[must_use]
    pub fn table_dps(&self) -> f64 {
        (self.speed_rad_s * self.part.table_ratio).to_degrees()
    }
}
