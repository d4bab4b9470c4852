//! TOML as it is written: numbers that read back as they were, strings, tables of one line.

use rt_core::plain_text::is_harmful;
use std::fmt::Write;

/// Lines of TOML.
#[derive(Debug, Default)]
pub(super) struct Toml(pub(super) String);

impl Toml {
    pub(super) fn line(&mut self, line: &str) {
        self.0.push_str(line.trim_end());
        self.0.push('\n');
    }

    pub(super) fn comment(&mut self, comment: &str) {
        // What somebody wrote must neither end the comment nor act on a terminal.
        let comment: String = comment.chars().map(|c| if is_harmful(c) { ' ' } else { c }).collect();
        self.line(&format!("# {comment}"));
    }

    pub(super) fn key(&mut self, key: &str, value: &str) {
        self.line(&format!("{key} = {value}"));
    }

    pub(super) fn number(&mut self, key: &str, value: f64) {
        self.key(key, &number(value));
    }

    pub(super) fn numbers(&mut self, key: &str, values: &[f64]) {
        self.key(key, &numbers(values));
    }
}

/// With a point or an exponent, so that it is a number and no integer.
pub(super) fn number(value: f64) -> String {
    format!("{value:?}")
}

pub(super) fn numbers(values: &[f64]) -> String {
    format!("[{}]", values.iter().map(|value| number(*value)).collect::<Vec<_>>().join(", "))
}

pub(super) fn string(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if is_harmful(c) => {
                // Writing to a string cannot fail.
                let _ = write!(quoted, "\\U{:08X}", c as u32);
            }
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}
