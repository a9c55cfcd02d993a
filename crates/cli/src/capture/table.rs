//! Named columns of numbers, of which a record is made: what files of arrays, logs and data frames have in common.

/// Named columns of one length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Their names.
    pub names: Vec<String>,
    /// Their numbers, NaN where there is none.
    pub columns: Vec<Vec<f64>>,
    /// What else the file says, as `key: value`; a unit as `unit of COLUMN`.
    pub about: Vec<(String, String)>,
    /// What a reader of the results has to know.
    pub notes: Vec<String>,
}

impl Table {
    /// Adds a column of a known unit.
    pub(super) fn add(&mut self, name: &str, unit: &str, values: Vec<f64>) {
        self.names.push(name.to_owned());
        self.columns.push(values);
        self.about
            .push((format!("unit of {name}"), unit.to_owned()));
    }
}
