//! How much a TOML text holds, counted before a tree is made of it.
//!
//! Problem: a tree takes far more memory than its text: a table of one key has room for eleven, over a kilobyte for the two
//! bytes `a.` of a dotted name.
//! Model: the parser's own events are counted, so that what stands in comments and texts counts for nothing. Before that its
//! tokens are counted as they are cut, since the parser keeps all of them.
//! Cost: one pass without memory, and one with 24 bytes a token.

use toml_parser::Source;
use toml_parser::parser::{Event, EventKind, RecursionGuard, parse_document};

/// The most values in a file: a hundred thousand entities with ten each.
pub(crate) const MAX_VALUES: usize = 1 << 20;
/// The most tables: a hundred thousand entities with a shape each, and some more.
pub(crate) const MAX_TABLES: usize = 1 << 18;
/// The most tokens: three numbers with points, the key before and the spaces between them have twenty.
pub(crate) const MAX_TOKENS: usize = 8 * MAX_VALUES;
/// As deep as the parser of values goes.
const MAX_DEPTH: u32 = 80;

/// What a text would make.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct DocumentSize {
    /// Numbers, texts, arrays.
    values: usize,
    /// Under headers, in braces, and one for each point in a name.
    tables: usize,
}

/// What of a text is too much: the most, and of what.
pub(crate) fn excess(text: &str) -> Option<(usize, &'static str)> {
    if tokens(text) > MAX_TOKENS {
        return Some((MAX_TOKENS, "words and signs"));
    }
    let size = DocumentSize::of(text);
    let bounds = [(size.tables, MAX_TABLES, "tables"), (size.values, MAX_VALUES, "values")];
    bounds.into_iter().find(|(found, most, _)| found > most).map(|(_, most, what)| (most, what))
}

/// Spaces and comments among them: the parser keeps those, too.
fn tokens(text: &str) -> usize {
    Source::new(text).lex().count()
}

impl DocumentSize {
    fn of(text: &str) -> Self {
        let tokens = Source::new(text).lex().into_vec();
        let mut size = Self { values: 0, tables: 0 };
        let mut count = |event: Event| size.add(event.kind());
        // What is wrong with the text is told when it is parsed.
        parse_document(&tokens, &mut RecursionGuard::new(&mut count, MAX_DEPTH), &mut ());
        size
    }

    fn add(&mut self, event: EventKind) {
        match event {
            EventKind::StdTableOpen
            | EventKind::ArrayTableOpen
            | EventKind::InlineTableOpen
            | EventKind::KeySep => self.tables += 1,
            EventKind::Scalar | EventKind::ArrayOpen => self.values += 1,
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_and_values_are_counted_where_they_are_made() {
        for (text, tables, values) in [
            ("", 0, 0),
            ("a = 1.5", 0, 1),
            ("a.b.c = 1.5 # d.e = 1", 2, 1),
            ("[a.b]\n[[c]]\n'd.e' = \"f.g = 1, 2\"", 3, 1),
            ("a = [1, [2.0, 3], { b.c = 4 }]", 2, 6),
            ("a = { b = { c = 1 } }\n[d", 3, 1),
        ] {
            assert_eq!(DocumentSize::of(text), DocumentSize { values, tables }, "{text}");
        }
    }
}
