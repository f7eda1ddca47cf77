//! Tables of numbers: CSV for people, the same columns in HDF5.

use std::path::Path;

/// One column.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Name, the CSV header.
    pub name: String,
    /// Unit, "1" for pure numbers.
    pub unit: String,
    /// Values; NaN where there is none, an empty field in CSV.
    pub values: Vec<f64>,
}

/// Columns of equal length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Name without ending, as in `profile`.
    pub name: String,
    /// The columns.
    pub columns: Vec<Column>,
}

impl Table {
    /// An empty table.
    pub fn new(name: &str) -> Table {
        Table {
            name: name.to_owned(),
            columns: Vec::new(),
        }
    }

    /// With one more column.
    pub fn with(mut self, name: &str, unit: &str, values: Vec<f64>) -> Table {
        self.columns.push(Column {
            name: name.to_owned(),
            unit: unit.to_owned(),
            values,
        });
        self
    }

    /// The values of a column; empty when there is none of that name.
    pub fn column(&self, name: &str) -> &[f64] {
        self.columns
            .iter()
            .find(|c| c.name == name)
            .map_or(&[], |c| &c.values)
    }

    /// Pairs of two columns where both are finite.
    pub fn pairs(&self, x: &str, y: &str) -> Vec<(f64, f64)> {
        let (x, y) = (self.column(x), self.column(y));
        x.iter()
            .zip(y)
            .map(|(x, y)| (*x, *y))
            .filter(|(x, y)| x.is_finite() && y.is_finite())
            .collect()
    }

    /// Rows of the longest column.
    pub fn rows(&self) -> usize {
        self.columns
            .iter()
            .map(|c| c.values.len())
            .max()
            .unwrap_or(0)
    }

    /// CSV with a header of column names. Numbers are written so that they read back to the bit.
    pub fn to_csv(&self) -> String {
        let mut text: String = self
            .columns
            .iter()
            .map(|c| c.name.as_str())
            .collect::<Vec<_>>()
            .join(",");
        text.push('\n');
        for row in 0..self.rows() {
            for (n, column) in self.columns.iter().enumerate() {
                if n > 0 {
                    text.push(',');
                }
                match column.values.get(row) {
                    Some(value) if value.is_finite() => text.push_str(&plain_number(*value)),
                    _ => {}
                }
            }
            text.push('\n');
        }
        text
    }

    /// Which unit each column of tables has, as CSV: file, column, unit.
    pub fn units(tables: &[&Table]) -> String {
        let mut text = String::from("file,column,unit\n");
        for table in tables {
            for column in &table.columns {
                text.push_str(&format!(
                    "{}.csv,{},{}\n",
                    table.name, column.name, column.unit
                ));
            }
        }
        text
    }

    /// Reads what [`Table::to_csv`] wrote; units are not in CSV.
    pub fn from_csv(path: &Path) -> Result<Table, csv::Error> {
        let name = path
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let mut reader = csv::Reader::from_path(path)?;
        let mut table = Table::new(&name);
        for header in reader.headers()?.iter() {
            table = table.with(header, "", Vec::new());
        }
        for record in reader.records() {
            for (column, field) in table.columns.iter_mut().zip(record?.iter()) {
                column.values.push(field.parse().unwrap_or(f64::NAN));
            }
        }
        Ok(table)
    }
}

fn plain_number(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || (1e-4..1e7).contains(&size) {
        format!("{value}")
    } else {
        format!("{value:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_stand_beside_the_columns() {
        let table = Table::new("front")
            .with("t", "s", vec![])
            .with("x", "m", vec![]);
        assert_eq!(
            Table::units(&[&table]),
            "file,column,unit\nfront.csv,t,s\nfront.csv,x,m\n"
        );
    }

    #[test]
    fn csv_reads_back_to_the_bit() {
        let values = vec![1.0 / 3.0, -2.5e-17, 6.02e23, f64::NAN, 0.0];
        let table = Table::new("t")
            .with("z", "m", values.clone())
            .with("u", "m/s", vec![1.0; 5]);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        std::fs::write(&path, table.to_csv()).unwrap();
        let again = Table::from_csv(&path).unwrap();
        for (a, b) in values.iter().zip(again.column("z")) {
            assert!(a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()));
        }
    }
}
