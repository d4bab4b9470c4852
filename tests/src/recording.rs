//! A recording read back.

use std::path::Path;

/// Columns by name.
#[derive(Debug)]
pub struct Table {
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// Reads a file; every row must have the header's number of cells.
    pub fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).expect("a recording");
        assert!(text.ends_with('\n'), "{} ends in the middle of a row", path.display());
        let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
        let columns = lines.next().expect("a header");
        let rows: Vec<_> = lines.collect();
        for (index, row) in rows.iter().enumerate() {
            assert_eq!(row.len(), columns.len(), "row {index} of {}", path.display());
        }
        Self { columns, rows }
    }

    /// How many rows there are.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is nothing but the header.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// A column of texts.
    pub fn texts(&self, column: &str) -> Vec<&str> {
        let index = self.columns.iter().position(|name| name == column);
        let index = index.unwrap_or_else(|| panic!("no column {column} among {:?}", self.columns));
        self.rows.iter().map(|row| row[index].as_str()).collect()
    }

    /// A column of numbers.
    pub fn numbers(&self, column: &str) -> Vec<f64> {
        self.texts(column).into_iter().map(|text| text.parse().expect("a number")).collect()
    }

    /// Three columns `{name}_x|y|z`.
    pub fn vectors(&self, name: &str) -> Vec<nalgebra::Vector3<f64>> {
        let [x, y, z] = ["x", "y", "z"].map(|axis| self.numbers(&format!("{name}_{axis}")));
        (0..self.len()).map(|row| nalgebra::Vector3::new(x[row], y[row], z[row])).collect()
    }
}
