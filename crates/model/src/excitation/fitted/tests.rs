//! Tests of [`super`].

use super::*;

/// The excitation like that of a simulation of a world, and the same for a simulation of what was found.
fn there_and_back(
    stated: &[(&str, f64)],
) -> Result<[BTreeMap<String, f64>; 2], crate::simulate::SimulateError> {
    let mut model = ModelFile::paper();
    model.excitation = stated.iter().map(|(k, v)| ((*k).to_owned(), *v)).collect();
    let first = model
        .clone()
        .excited_like(&crate::simulate(&model, 600.0, 20.0, 3)?);
    let second = first
        .clone()
        .excited_like(&crate::simulate(&first, 600.0, 20.0, 4)?);
    Ok([first.excitation, second.excitation])
}

#[test]
fn a_world_is_found_again_in_size_and_pace() -> Result<(), Box<dyn std::error::Error>> {
    let worlds: [&[(&str, f64)]; 7] = [
        &[("self_heating_degc", 9.0), ("ambient_degc", 18.0)],
        &[("heater_degc", 6.0), ("heater_period_s", 200.0)],
        &[
            ("motor_duty", 0.8),
            ("motor_period_s", 75.0),
            ("supply_motor_v", 0.1),
        ],
        &[
            ("motor_duty", 0.6),
            ("motor_period_s", 50.0),
            ("motor_on", 0.3),
            ("motor_forward", 0.7),
        ],
        &[("supply_load_v", 0.06), ("vibration_g", 0.1)],
        &[("turn_dps", 12.0), ("turn_period_s", 40.0)],
        &[("sway_deg", 5.0), ("sway_period_s", 9.0)],
    ];
    for stated in worlds {
        let found = there_and_back(stated)?;
        for (key, value) in stated {
            for settings in &found {
                let got = *settings.get(*key).ok_or(format!("{key} is missing"))?;
                assert!(
                    (got / value - 1.0).abs() < 0.2,
                    "{key} is {value}, found {got} of {stated:?}"
                );
            }
        }
    }
    Ok(())
}

#[test]
fn a_motor_of_any_duties_is_one_of_as_much_mean_size_and_square() {
    // Duties of a triangle that rests between, mostly forward.
    let duty = |k: usize| match k % 700 {
        of @ 0..300 => of as f64 / 300.0,
        of @ 400..500 => -(of as f64 - 400.0) / 200.0,
        _ => 0.0,
    };
    let mut record = crate::simulate(&ModelFile::paper(), 600.0, 20.0, 5).unwrap();
    let pwm = |c: &mut Channel| {
        let own = c.values.iter_mut().enumerate();
        own.for_each(|(k, v)| *v = (255.0 * duty(k)).round());
    };
    let mut channels = record.channels.iter_mut();
    pwm(channels.find(|c| c.quantity == Quantity::Pwm).unwrap());
    let simulated = crate::simulate(&ModelFile::paper().excited_like(&record), 600.0, 20.0, 6);
    let moments = |record: &Record| {
        let duty = &record.all(Quantity::Pwm).next().unwrap().values;
        let size: Vec<f64> = duty.iter().map(|d| d.abs()).collect();
        [mean(duty), mean(&size), mean(&squares(duty)).sqrt()]
    };
    let (own, made) = (moments(&record), moments(&simulated.unwrap()));
    for (own, made) in own.into_iter().zip(made) {
        assert!((made / own - 1.0).abs() < 0.05, "{own} {made}");
    }
}

#[test]
fn what_does_not_move_is_not_stated() -> Result<(), Box<dyn std::error::Error>> {
    let [found, _] = there_and_back(&[])?;
    let keys: Vec<_> = found.keys().map(String::as_str).collect();
    assert_eq!(keys, ["ambient_degc", "supply_v"]);
    Ok(())
}
