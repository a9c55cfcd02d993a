//! The model file as it is read: every error names its line.

use super::*;
use crate::effect::{Effect, ParameterSpec};

pub(super) struct Parser<'a> {
    pub(super) text: &'a str,
}

pub(super) type Parsed<T> = Result<T, ModelFileError>;

impl<'a> Parser<'a> {
    pub(super) fn error<T>(&self, at: usize, what: String) -> Parsed<T> {
        let line = 1 + self
            .text
            .get(..at)
            .unwrap_or(self.text)
            .matches('\n')
            .count();
        Err(ModelFileError { line, what })
    }

    pub(super) fn table<'t>(
        &self,
        value: &'t Spanned<DeValue<'a>>,
        name: &str,
    ) -> Parsed<&'t DeTable<'a>> {
        match value.get_ref() {
            DeValue::Table(table) => Ok(table),
            _ => self.error(value.span().start, format!("{name} has to be a table")),
        }
    }

    pub(super) fn array<'t>(
        &self,
        value: &'t Spanned<DeValue<'a>>,
        name: &str,
    ) -> Parsed<Vec<&'t Spanned<DeValue<'a>>>> {
        match value.get_ref() {
            DeValue::Array(array) => Ok(array.iter().collect()),
            _ => self.error(value.span().start, format!("{name} has to be an array")),
        }
    }

    pub(super) fn string(&self, value: &Spanned<DeValue<'a>>, name: &str) -> Parsed<String> {
        match value.get_ref() {
            DeValue::String(s) => Ok(s.to_string()),
            _ => self.error(
                value.span().start,
                format!("{name} has to be a text in quotes"),
            ),
        }
    }

    fn number(&self, value: &Spanned<DeValue<'a>>, name: &str) -> Parsed<f64> {
        let number = match value.get_ref() {
            DeValue::Float(f) => f.as_str().replace('_', "").parse().ok(),
            DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix())
                .ok()
                .map(|i| i as f64),
            _ => None,
        };
        match number {
            Some(n) if f64::is_finite(n) => Ok(n),
            _ => self.error(
                value.span().start,
                format!("{name} has to be a finite number"),
            ),
        }
    }

    /// A number of a range.
    pub(super) fn ranged(
        &self,
        value: &Spanned<DeValue<'a>>,
        name: &str,
        range: Range,
    ) -> Parsed<f64> {
        let number = self.number(value, name)?;
        match range.refuses(name, number) {
            None => Ok(number),
            Some(what) => self.error(value.span().start, what),
        }
    }

    pub(super) fn file(&self) -> Parsed<ModelFile> {
        let document = DeTable::parse(self.text).map_err(|e| ModelFileError {
            line: 1 + self
                .text
                .get(..e.span().map_or(0, |s| s.start))
                .unwrap_or("")
                .matches('\n')
                .count(),
            what: e.message().to_owned(),
        })?;
        let mut file = ModelFile::default();
        let mut format = None;
        for (key, value) in document.get_ref() {
            match &**key.get_ref() {
                "format" => format = Some((self.string(value, "format")?, value.span().start)),
                "stand" => file.stand = self.string(value, "stand")?,
                "rate_hz" => file.rate_hz = self.ranged(value, "rate_hz", range::POSITIVE)?,
                "fitted_on" => file.fitted_on = Some(self.fitted_on(value)?),
                "excitation" => file.excitation = self.excitation(value)?,
                "channel" => file.channels = self.all_channels(value)?,
                "effect" | "unnamed" => {}
                other => {
                    return self.error(key.span().start, format!(
                        "unknown key {other}; known are format, stand, rate_hz, fitted_on, excitation, channel, effect, unnamed"
                    ));
                }
            }
        }
        self.check_format(format)?;
        if file.rate_hz <= 0.0 {
            return self.error(0, "rate_hz is missing or not positive".to_owned());
        }
        if let Some(value) = document.get_ref().get("effect") {
            for v in self.array(value, "effect")? {
                file.effects
                    .push(self.effect(v, &file.channels, file.rate_hz)?);
                if file.effects.len() > range::MOST_EFFECTS {
                    let what = format!("more than {} effects", range::MOST_EFFECTS);
                    return self.error(v.span().start, what);
                }
            }
        }
        if let Some(value) = document.get_ref().get("unnamed") {
            for v in self.array(value, "unnamed")? {
                file.unnamed.push(self.unnamed(v, &file)?);
                if file.unnamed.len() > range::MOST_EFFECTS {
                    let what = format!("more than {} unnamed terms", range::MOST_EFFECTS);
                    return self.error(v.span().start, what);
                }
            }
        }
        Ok(file)
    }

    fn fitted_on(&self, value: &Spanned<DeValue<'a>>) -> Parsed<FittedOn> {
        let mut on = FittedOn::default();
        for (key, v) in self.table(value, "fitted_on")? {
            match &**key.get_ref() {
                "file" => on.file = self.string(v, "file")?,
                "hash" => on.hash = Some(self.string(v, "hash")?),
                "seconds" => on.seconds = self.number(v, "seconds")?,
                other => {
                    return self.error(
                        key.span().start,
                        format!("unknown key {other} in fitted_on; known are file, hash, seconds"),
                    );
                }
            }
        }
        Ok(on)
    }

    fn excitation(&self, value: &Spanned<DeValue<'a>>) -> Parsed<BTreeMap<String, f64>> {
        let mut all = BTreeMap::new();
        for (key, v) in self.table(value, "excitation")? {
            let name: &str = key.get_ref();
            if !SETTINGS.iter().any(|s| s.key == name) {
                let known: Vec<_> = SETTINGS.iter().map(|s| s.key).collect();
                return self.error(
                    key.span().start,
                    format!("unknown excitation {name}; known are {}", known.join(", ")),
                );
            }
            all.insert(
                name.to_owned(),
                self.ranged(v, name, range::of_setting(name))?,
            );
        }
        Ok(all)
    }

    pub(super) fn parameter(
        &self,
        name: &str,
        value: &Spanned<DeValue<'a>>,
        units: &[String],
        range: Range,
    ) -> Parsed<Parameter> {
        let (mut number, mut error, mut unit) = (None, None, None);
        for (key, v) in self.table(value, name)? {
            match &**key.get_ref() {
                "value" => number = Some(self.ranged(v, name, range)?),
                "std_error" => error = Some(self.ranged(v, "std_error", range::SIZE)?),
                "unit" => unit = Some((self.string(v, "unit")?, v.span().start)),
                other => {
                    return self.error(
                        key.span().start,
                        format!("unknown key {other} in {name}; known are value, std_error, unit"),
                    );
                }
            }
        }
        let at = value.span().start;
        let Some(number) = number else {
            return self.error(at, format!("{name} has no value"));
        };
        match unit {
            Some((u, _)) if units.contains(&u) => Ok(Parameter {
                value: number,
                std_error: error,
                unit: u,
            }),
            Some((u, at)) => self.error(
                at,
                format!("{name} is in {u:?}; its unit is {:?}", units[0]),
            ),
            None => self.error(at, format!("{name} has no unit; it is {:?}", units[0])),
        }
    }

    /// Whether the file is of the format that is read.
    fn check_format(&self, format: Option<(String, usize)>) -> Parsed<()> {
        match format {
            Some((f, _)) if f == FORMAT => Ok(()),
            Some((f, at)) => self.error(
                at,
                format!("format is {f:?}, this program reads {FORMAT:?}"),
            ),
            None => self.error(
                0,
                format!("no format line; the first one has to be format = {FORMAT:?}"),
            ),
        }
    }

    fn all_channels(&self, value: &Spanned<DeValue<'a>>) -> Parsed<Vec<ChannelModel>> {
        let mut channels: Vec<ChannelModel> = vec![];
        for v in self.array(value, "channel")? {
            let channel = self.channel(v)?;
            let at = v.span().start;
            if channels.iter().any(|c| c.name == channel.name) {
                return self.error(at, format!("a second channel {}", channel.name));
            }
            channels.push(channel);
            if channels.len() > range::MOST_CHANNELS {
                return self.error(at, format!("more than {} channels", range::MOST_CHANNELS));
            }
        }
        Ok(channels)
    }

    fn channel(&self, value: &Spanned<DeValue<'a>>) -> Parsed<ChannelModel> {
        let table = self.table(value, "channel")?;
        let mut channel = ChannelModel::default();
        for (key, v) in table {
            match &**key.get_ref() {
                "name" => channel.name = self.string(v, "name")?,
                "unit" => channel.unit = self.string(v, "unit")?,
                "lsb" => channel.lsb = Some(self.ranged(v, "lsb", range::STEP)?),
                _ => {}
            }
        }
        let at = value.span().start;
        if channel.name.is_empty() || channel.unit.is_empty() {
            return self.error(at, "a channel needs a name and a unit".to_owned());
        }
        for (key, v) in table {
            let name: &str = key.get_ref();
            if matches!(name, "name" | "unit" | "lsb") {
                continue;
            }
            let Some((_, spec)) = BASELINE.iter().find(|(n, _)| *n == name) else {
                return self.error(
                    key.span().start,
                    format!(
                        "unknown key {name} in a channel; known are name, unit, lsb, {}",
                        BASELINE.map(|b| b.0).join(", ")
                    ),
                );
            };
            let units = [baseline_unit(spec, &channel.unit)];
            let range = if name == "bias" {
                range::ANY
            } else {
                range::SIZE
            };
            let parameter = self.parameter(name, v, &units, range)?;
            channel.baseline.insert(name.to_owned(), parameter);
        }
        Ok(channel)
    }

    /// The channels that something acts on.
    pub(super) fn channels(
        &self,
        table: &DeTable<'a>,
        of: &str,
        known: &[ChannelModel],
    ) -> Parsed<Vec<String>> {
        let mut names = vec![];
        let Some(v) = table.get("channels") else {
            return Ok(names);
        };
        for name in self.array(v, "channels")? {
            let text = self.string(name, "channels")?;
            if !known.iter().any(|c| c.name == text) {
                let what = format!("{of} names channel {text}, which the file does not have");
                return self.error(name.span().start, what);
            }
            names.push(text);
        }
        Ok(names)
    }

    fn effect(
        &self,
        value: &Spanned<DeValue<'a>>,
        channels: &[ChannelModel],
        rate_hz: f64,
    ) -> Parsed<EffectModel> {
        let table = self.table(value, "effect")?;
        let at = value.span().start;
        let Some(cause) = table.get("cause") else {
            return self.error(at, "an effect needs a cause".to_owned());
        };
        let id = self.string(cause, "cause")?;
        let Some(known) = effect(&id) else {
            let ids: Vec<_> = crate::effects::EFFECTS.iter().map(|e| e.id()).collect();
            return self.error(
                cause.span().start,
                format!("unknown effect {id}; known are {}", ids.join(", ")),
            );
        };
        let mut found = EffectModel {
            cause: id.clone(),
            ..EffectModel::default()
        };
        found.channels = self.channels(table, &format!("effect {id}"), channels)?;
        let unit = found
            .channels
            .first()
            .and_then(|n| channels.iter().find(|c| c.name == *n))
            .or(channels.first())
            .map_or("deg/s", |c| c.unit.as_str());
        for (key, v) in table {
            let name: &str = key.get_ref();
            if matches!(name, "cause" | "channels") {
                continue;
            }
            let spec = self.spec_of(known, name, key.span().start)?;
            let units = [if unit == "deg/s" {
                spec.unit.to_owned()
            } else {
                unit_on(spec.unit, unit)
            }];
            let range = range::of_parameter(name, spec.unit, rate_hz);
            let parameter = self.parameter(name, v, &units, range)?;
            found.parameters.insert(name.to_owned(), parameter);
        }
        if let Some(missing) = known
            .parameters()
            .iter()
            .find(|p| p.required && !found.parameters.contains_key(p.name))
        {
            return self.error(
                at,
                format!(
                    "effect {id} needs {} = {{ value = ..., unit = {:?} }}",
                    missing.name, missing.unit
                ),
            );
        }
        Ok(found)
    }

    /// What is known of a parameter of an effect.
    fn spec_of(&self, known: &dyn Effect, name: &str, at: usize) -> Parsed<&'static ParameterSpec> {
        match known.parameters().iter().find(|p| p.name == name) {
            Some(spec) => Ok(spec),
            None => {
                let names: Vec<_> = known.parameters().iter().map(|p| p.name).collect();
                self.error(
                    at,
                    format!(
                        "unknown parameter {name} of {}; it has {}",
                        known.id(),
                        names.join(", ")
                    ),
                )
            }
        }
    }
}
