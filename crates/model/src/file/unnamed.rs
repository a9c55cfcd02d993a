//! Terms without a name, as a model file has them.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::parser::{Parsed, Parser};
use super::*;
use crate::unnamed::{Column, ColumnSpec, Domain, MOST_KNOTS};

/// Keys that a term of any domain may have.
const KEYS: [&str; 5] = ["domain", "channels", "follows", "refines", "rms"];

impl<'a> Parser<'a> {
    /// A term that acts on some of the channels of a file, whose effects are known.
    pub(super) fn unnamed(
        &self,
        value: &Spanned<DeValue<'a>>,
        file: &ModelFile,
    ) -> Parsed<Unnamed> {
        let table = self.table(value, "unnamed")?;
        let at = value.span().start;
        let domain = self.domain(table, at)?;
        let channels = self.channels(table, "an unnamed term", &file.channels)?;
        match (domain, channels.len()) {
            (Domain::Cross, 2) => {}
            (Domain::Cross, n) => {
                return self.error(at, format!("a term of two axes names {n} channels"));
            }
            (_, 0) => return self.error(at, "an unnamed term needs channels".to_owned()),
            _ => {}
        }
        let follows = self.follows(table, domain, at)?;
        let refines = self.refines(table, domain, &channels, file)?;
        let unit = (file.channels.iter().find(|c| channels.contains(&c.name)))
            .map_or("deg/s", |c| c.unit.as_str());
        let specs = domain.columns(follows.is_some());
        for (key, _) in table {
            let name: &str = key.get_ref();
            if !KEYS.contains(&name) && !specs.iter().any(|s| s.name == name) {
                let names: Vec<_> = specs.iter().map(|s| s.name).collect();
                let names = names.join(", ");
                return self.error(
                    key.span().start,
                    format!("unknown key {name} in an unnamed term; this domain has {names}, rms"),
                );
            }
        }
        let Some(rms) = table.get("rms") else {
            return self.error(at, "an unnamed term needs rms, its size".to_owned());
        };
        Ok(Unnamed {
            domain,
            rms: self.parameter("rms", rms, &[unit.to_owned()], range::SIZE)?,
            columns: self.columns(table, domain, specs, unit, at)?,
            channels,
            follows,
            refines,
        })
    }

    fn domain(&self, table: &DeTable<'a>, at: usize) -> Parsed<Domain> {
        let Some(id) = table.get("domain") else {
            return self.error(at, "an unnamed term needs a domain".to_owned());
        };
        let text = self.string(id, "domain")?;
        match Domain::ALL.into_iter().find(|d| d.id() == text) {
            Some(domain) => Ok(domain),
            None => {
                let ids = Domain::ALL.map(Domain::id).join(", ");
                let what = format!("unknown domain {text}; known are {ids}");
                self.error(id.span().start, what)
            }
        }
    }

    fn follows(&self, table: &DeTable<'a>, domain: Domain, at: usize) -> Parsed<Option<String>> {
        let id = domain.id();
        match (table.get("follows"), domain.follows()) {
            (Some(v), None | Some(true)) => Ok(Some(self.string(v, "follows")?)),
            (Some(v), Some(false)) => {
                let what = format!("a term of the domain {id} follows no channel");
                self.error(v.span().start, what)
            }
            (None, Some(true)) => {
                self.error(at, format!("a term of the domain {id} needs follows = ..."))
            }
            (None, _) => Ok(None),
        }
    }

    fn refines(
        &self,
        table: &DeTable<'a>,
        domain: Domain,
        channels: &[String],
        file: &ModelFile,
    ) -> Parsed<Option<String>> {
        let Some(v) = table.get("refines") else {
            return Ok(None);
        };
        let cause = self.string(v, "refines")?;
        let there = |c: &String| {
            let acts = |e: &EffectModel| e.channels.is_empty() || e.channels.contains(c);
            file.effects.iter().any(|e| e.cause == cause && acts(e))
        };
        let tone = cause == crate::effects::wandering_line::ID && domain == Domain::Spectrum;
        if tone && channels.iter().all(there) {
            return Ok(Some(cause));
        }
        let what = format!(
            "refines is {cause:?}; it has to be a wandering_line that the file has on these channels, in a term of the spectrum"
        );
        self.error(v.span().start, what)
    }

    fn columns(
        &self,
        table: &DeTable<'a>,
        domain: Domain,
        specs: &[ColumnSpec],
        unit: &str,
        at: usize,
    ) -> Parsed<Vec<Column>> {
        let mut columns: Vec<Column> = vec![];
        let single = matches!(domain, Domain::Cross | Domain::Codes);
        for spec in specs {
            let Some(v) = table.get(spec.name) else {
                let what = format!("an unnamed term of {} needs {}", domain.id(), spec.name);
                return self.error(at, what);
            };
            let column = self.column(v, spec, unit)?;
            let count = column.values.len();
            let expected = match columns.first() {
                _ if single => 1,
                Some(first) => first.values.len(),
                None => count.max(1),
            };
            if count != expected {
                let what = format!("{} has {count} values; expected {expected}", spec.name);
                return self.error(v.span().start, what);
            }
            columns.push(column);
        }
        Ok(columns)
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
