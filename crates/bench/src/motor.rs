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

#[cfg(test)]
mod tests {
    use super::*;

    /// The equations by steps of a microsecond, forward.
    fn exact(p: &MotorPart, duty: f64, seconds: f64) -> (f64, f64) {
        let (mut i, mut w, dt) = (0.0f64, 0.0f64, 1e-6);
        for _ in 0..(seconds / dt) as u32 {
            let torque = p.constant * i - p.viscous * w;
            let net = if w == 0.0 && torque.abs() <= p.coulomb {
                0.0
            } else {
                torque
                    - p.coulomb
                        * if w == 0.0 {
                            torque.signum()
                        } else {
                            w.signum()
                        }
            };
            i += dt * (duty * p.driver_v - p.resistance_ohm * i - p.constant * w) / p.inductance_h;
            w += dt * net / p.inertia;
        }
        (i, w)
    }

    #[test]
    fn it_spins_up_as_its_equations_say_either_way() {
        let part = MotorPart::default();
        for duty in [1.0, 0.4, -0.6] {
            let mut motor = Motor::new(part.clone());
            let mut passed = 0;
            for (ms, tolerance) in [(20, 0.06), (100, 0.03), (1500, 0.002)] {
                while passed < ms {
                    motor.step(duty, 1e-3);
                    passed += 1;
                }
                let (i, w) = exact(&part, duty, f64::from(ms) * 1e-3);
                let off_w = (motor.speed_rad_s() / w - 1.0).abs();
                let off_i = (motor.current_a() / i - 1.0).abs();
                assert!(
                    off_w < tolerance && off_i < tolerance,
                    "{duty}, {ms} ms: {off_w} {off_i}"
                );
            }
            let table = motor.speed_rad_s() * part.table_ratio * 180.0 / std::f64::consts::PI;
            assert!((motor.table_dps() - table).abs() < 1e-9);
        }
    }

    #[test]
    fn a_duty_beyond_full_is_full_and_friction_stops_it() {
        let part = MotorPart::default();
        let (mut full, mut beyond) = (Motor::new(part.clone()), Motor::new(part));
        (0..500).for_each(|_| {
            full.step(1.0, 1e-3);
            beyond.step(3.0, 1e-3);
        });
        assert_eq!(full.speed_rad_s(), beyond.speed_rad_s());
        (0..5_000).for_each(|_| full.step(0.0, 1e-3));
        assert_eq!(full.speed_rad_s(), 0.0);
        assert!(full.current_a().abs() < 1e-6);
    }
}
