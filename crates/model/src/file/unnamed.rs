//! Terms without a name, as a model file has them.

use toml::Spanned;
use toml::de::DeValue;

use super::parser::{Parsed, Parser};
use super::*;
use crate::unnamed::{Column, ColumnSpec, Domain, MOST_KNOTS};

impl<'a> Parser<'a> {
    /// A term that acts on some of the channels of a file, whose effects are known.
    pub(super) fn unnamed(
        &self,
        value: &Spanned<DeValue<'a>>,
        file: &ModelFile,
    ) -> Parsed<Unnamed> {
        let channels = &file.channels;
        let table = self.table(value, "unnamed")?;
        let at = value.span().start;
        let Some(id) = table.get("domain") else {
            return self.error(at, "an unnamed term needs a domain".to_owned());
        };
        let text = self.string(id, "domain")?;
        let Some(domain) = Domain::ALL.into_iter().find(|d| d.id() == text) else {
            let ids = Domain::ALL.map(Domain::id).join(", ");
            return self.error(
                id.span().start,
                format!("unknown domain {text}; known are {ids}"),
            );
        };
        let mut names = vec![];
        if let Some(v) = table.get("channels") {
            for name in self.array(v, "channels")? {
                let text = self.string(name, "channels")?;
                if !channels.iter().any(|c| c.name == text) {
                    return self.error(
                        name.span().start,
                        format!(
                            "an unnamed term names channel {text}, which the file does not have"
                        ),
                    );
                }
                names.push(text);
            }
        }
        match (domain, names.len()) {
            (Domain::Cross, 2) => {}
            (Domain::Cross, n) => {
                return self.error(at, format!("a term of two axes names {n} channels"));
            }
            (_, 0) => return self.error(at, "an unnamed term needs channels".to_owned()),
            _ => {}
        }
        let follows = match (table.get("follows"), domain.follows()) {
            (Some(v), None | Some(true)) => Some(self.string(v, "follows")?),
            (Some(v), Some(false)) => {
                let what = format!("a term of the domain {text} follows no channel");
                return self.error(v.span().start, what);
            }
            (None, Some(true)) => {
                return self.error(
                    at,
                    format!("a term of the domain {text} needs follows = ..."),
                );
            }
            (None, _) => None,
        };
        let refines = match table.get("refines") {
            None => None,
            Some(v) => {
                let cause = self.string(v, "refines")?;
                let there = |c: &String| {
                    let acts = |e: &EffectModel| e.channels.is_empty() || e.channels.contains(c);
                    file.effects.iter().any(|e| e.cause == cause && acts(e))
                };
                let tone =
                    cause == crate::effects::wandering_line::ID && domain == Domain::Spectrum;
                if !tone || !names.iter().all(there) {
                    let what = format!(
                        "refines is {cause:?}; it has to be a wandering_line that the file has on these channels, in a term of the spectrum"
                    );
                    return self.error(v.span().start, what);
                }
                Some(cause)
            }
        };
        let unit = (channels.iter().find(|c| names.contains(&c.name)))
            .map_or("deg/s", |c| c.unit.as_str());
        let specs = domain.columns(follows.is_some());
        for (key, _) in table {
            let name: &str = key.get_ref();
            let known = ["domain", "channels", "follows", "refines", "rms"];
            if !known.contains(&name) && !specs.iter().any(|s| s.name == name) {
                let names: Vec<_> = specs.iter().map(|s| s.name).collect();
                return self.error(
                    key.span().start,
                    format!(
                        "unknown key {name} in an unnamed term; this domain has {}, rms",
                        names.join(", ")
                    ),
                );
            }
        }
        let Some(rms) = table.get("rms") else {
            return self.error(at, "an unnamed term needs rms, its size".to_owned());
        };
        let rms = self.parameter("rms", rms, &[unit.to_owned()], range::SIZE)?;
        let mut columns: Vec<Column> = vec![];
        for spec in specs {
            let Some(v) = table.get(spec.name) else {
                return self.error(at, format!("an unnamed term of {text} needs {}", spec.name));
            };
            let column = self.column(v, spec, unit)?;
            let length = columns
                .first()
                .map_or(column.values.len(), |c| c.values.len());
            let one = domain == Domain::Cross || domain == Domain::Codes;
            if column.values.len() != length || length == 0 || (one && length != 1) {
                let expected = if one || length == 0 { 1 } else { length };
                return self.error(
                    v.span().start,
                    format!(
                        "{} has {} values; expected {expected}{}",
                        spec.name,
                        column.values.len(),
                        if one {
                            ""
                        } else {
                            " as the column before it, and at least one"
                        }
                    ),
                );
            }
            columns.push(column);
        }
        Ok(Unnamed {
            domain,
            channels: names,
            follows,
            refines,
            rms,
            columns,
        })
    }

    fn column(
        &self,
        value: &Spanned<DeValue<'a>>,
        spec: &ColumnSpec,
        channel_unit: &str,
    ) -> Parsed<Column> {
        let (mut values, mut unit) = (None, None);
        for (key, v) in self.table(value, spec.name)? {
            match &**key.get_ref() {
                "values" => values = Some((self.array(v, "values")?, v.span().start)),
                "unit" => unit = Some((self.string(v, "unit")?, v.span().start)),
                other => {
                    let what = format!(
                        "unknown key {other} in {}; known are values, unit",
                        spec.name
                    );
                    return self.error(key.span().start, what);
                }
            }
        }
        let at = value.span().start;
        let (Some((values, start)), Some((unit, unit_at))) = (values, unit) else {
            return self.error(at, format!("{} needs values and unit", spec.name));
        };
        let wanted = spec
            .unit
            .map(|u| if u == "deg/s" { channel_unit } else { u });
        if let Some(wanted) = wanted.filter(|w| *w != unit) {
            return self.error(
                unit_at,
                format!("{} is in {unit:?}; its unit is {wanted:?}", spec.name),
            );
        }
        if values.len() > MOST_KNOTS {
            return self.error(start, format!("more than {MOST_KNOTS} values"));
        }
        let mut numbers: Vec<f64> = vec![];
        for v in values {
            let number = self.ranged(v, spec.name, spec.range)?;
            if spec.rises && numbers.last().is_some_and(|last| *last >= number) {
                let what = format!("{} has to rise from each value to the next", spec.name);
                return self.error(v.span().start, what);
            }
            numbers.push(number);
        }
        Ok(Column {
            unit,
            values: numbers,
        })
    }
}
