//! Which of a model's effects a correction makes better, and which it would make worse.
//!
//! A coefficient c that is known to e takes c off and leaves e: of c^2 the part c^2 - e^2 is real, so that it is worth it where
//! c^2 > 2 e^2. A scale that was held against the tilt of accelerometers is as good as that: the tilt is side / up, so the scale
//! of both is in it, and the zero of the one that points up, as a share of 1 g. Below these it says nothing of the gyro.

use model::ModelFile;
use model::file::EffectModel;
use model::parameter::Parameter;

/// Standard errors from which on a coefficient is more than its error.
const WORTH: f64 = std::f64::consts::SQRT_2;
/// Tolerance of a tilt by accelerometers, 1: the root of the squares of 0.075 for each sensitivity (MMA7260QT data sheet: 740 to
/// 860 mV/g) and 0.206 for the zero of the one that points up (165 mV at 800 mV/g).
const TILT_TOLERANCE: f64 = 0.23;
/// Standard errors beyond which a size is not chance (95 %).
const NORMAL_95: f64 = 1.96;
/// Causes whose coefficients multiply channels of their own, and stand alone.
const ALONE: [&str; 2] = ["cross_axis", "g_sensitivity"];

/// Takes out of the model of a diagnosis what a correction by it would make worse; says what, and why.
pub fn keep_what_is_worth_it(model: &mut ModelFile) -> Vec<String> {
    keep(model, |effect| {
        scale_is_beyond_tilt(effect).and_then(|()| is_more_than_its_error(effect))
    })
}

/// The same of any model: a scale may have been told by turns that gravity counts, and stays.
pub fn keep_what_is_more_than_its_error(model: &mut ModelFile) -> Vec<String> {
    keep(model, is_more_than_its_error)
}

fn keep(
    model: &mut ModelFile,
    worth: impl Fn(&mut EffectModel) -> Result<(), String>,
) -> Vec<String> {
    let mut refused = Vec::new();
    model.effects.retain_mut(|effect| match worth(effect) {
        Ok(()) => true,
        Err(why) => {
            refused.push(format!(
                "{} on {} is not corrected: {why}",
                effect.cause,
                effect.channels.join(", ")
            ));
            false
        }
    });
    refused
}

fn is_worth(p: &Parameter) -> bool {
    p.std_error
        .is_none_or(|error| p.value.abs() > WORTH * error)
}

fn scale_is_beyond_tilt(effect: &mut EffectModel) -> Result<(), String> {
    if effect.cause == "scale_error"
        && let Some(relative) = effect.parameters.get("relative")
    {
        let error = NORMAL_95 * relative.std_error.unwrap_or(0.0);
        if relative.value.abs() < TILT_TOLERANCE + error {
            return Err(format!(
                "{:.1} +- {:.1} % against the tilt of accelerometers, whose scales and zeros make it {:.0} % by themselves; a rate table tells",
                100.0 * relative.value,
                100.0 * error,
                100.0 * TILT_TOLERANCE
            ));
        }
    }
    Ok(())
}

fn is_more_than_its_error(effect: &mut EffectModel) -> Result<(), String> {
    if ALONE.contains(&effect.cause.as_str()) {
        for p in effect.parameters.values_mut().filter(|p| !is_worth(p)) {
            p.value = 0.0;
        }
    }
    let mut sizes = effect.parameters.values().filter(|p| p.std_error.is_some());
    if sizes.clone().next().is_some() && sizes.all(|p| !is_worth(p)) {
        return Err("it is no larger than its own uncertainty".to_owned());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(effect: &str) -> (ModelFile, Vec<String>) {
        let mut text = ModelFile::paper().to_toml();
        text.push_str(effect);
        let mut model = ModelFile::parse(&text).expect("a model");
        let refused = keep_what_is_worth_it(&mut model);
        (model, refused)
    }

    #[test]
    fn a_scale_within_what_the_accelerometers_make_of_a_tilt_is_refused_and_one_beyond_it_is_not() {
        for (relative, error, stays) in [
            (0.22, 0.001, false),
            (-0.24, 0.01, false),
            (0.3, 0.01, true),
        ] {
            let (model, refused) = kept(&format!(
                "[[effect]]\ncause = \"scale_error\"\nchannels = [\"gyro_x\"]\nrelative = {{ value = {relative}, std_error = {error}, unit = \"1\" }}\n"
            ));
            assert_eq!(model.effects.len(), usize::from(stays), "{relative}");
            assert_eq!(refused.is_empty(), stays);
            assert!(
                refused
                    .iter()
                    .all(|why| why.starts_with("scale_error on gyro_x is not corrected: "))
            );
        }
    }

    #[test]
    fn a_scale_that_turns_told_stays_and_what_is_no_more_than_its_error_goes() {
        let mut text = ModelFile::paper().to_toml();
        text.push_str("[[effect]]\ncause = \"scale_error\"\nchannels = [\"gyro_z\"]\nrelative = { value = 0.01, std_error = 0.001, unit = \"1\" }\n");
        text.push_str("[[effect]]\ncause = \"g_sensitivity\"\nchannels = [\"gyro_x\"]\nacc_x = { value = -0.02, std_error = 0.017, unit = \"deg/s/g\" }\nacc_y = { value = 0.005, std_error = 0.017, unit = \"deg/s/g\" }\n");
        let mut model = ModelFile::parse(&text).expect("a model");
        let refused = keep_what_is_more_than_its_error(&mut model);
        let left: Vec<&str> = model.effects.iter().map(|e| e.cause.as_str()).collect();
        assert_eq!(left, ["scale_error"]);
        assert!(
            refused[0].starts_with("g_sensitivity on gyro_x is not corrected: "),
            "{refused:?}"
        );
    }

    #[test]
    fn what_is_smaller_than_its_own_error_is_refused_by_itself_where_it_stands_alone() {
        let slope = |value: f64| {
            kept(&format!(
                "[[effect]]\ncause = \"temperature\"\nchannels = [\"gyro_y\"]\nslope = {{ value = {value}, std_error = 0.02, unit = \"deg/s/degC\" }}\n"
            ))
        };
        assert_eq!(slope(-0.029).0.effects.len(), 1);
        let (model, refused) = slope(-0.028);
        assert!(model.effects.is_empty());
        assert!(
            refused[0].ends_with("no larger than its own uncertainty"),
            "{refused:?}"
        );
        let (model, refused) = kept(
            "[[effect]]\ncause = \"cross_axis\"\nchannels = [\"gyro_y\"]\nfrom_gyro_x = { value = 0.05, std_error = 0.001, unit = \"1\" }\nfrom_gyro_z = { value = 0.01, std_error = 0.02, unit = \"1\" }\n",
        );
        let share = |of: &str| model.effects[0].parameters[of].value;
        assert_eq!((share("from_gyro_x"), share("from_gyro_z")), (0.05, 0.0));
        assert!(refused.is_empty());
    }
}
