//! Header of a PLY file.

use crate::model::{ModelError, shown};
use std::collections::HashSet;

pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// Beginning of the data: byte, and line.
    pub(super) end: usize,
    pub(super) lines: usize,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
    line: usize,
}

pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: Kind,
}

#[derive(Clone, Copy)]
pub(super) enum Kind {
    One(Number),
    List { count: Number, item: Number },
}

#[derive(Clone, Copy)]
pub(super) enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Header {
    pub(super) fn read(bytes: &[u8]) -> Result<Self, ModelError> {
        let (mut encoding, mut elements) = (None, Vec::<Element>::new());
        let (mut at, mut line) = (0, 0);
        loop {
            let rest = &bytes[at..];
            line += 1;
            let Some(length) = rest.iter().position(|&byte| byte == b'\n') else {
                let found = if line == 1 { shown(rest) } else { "the end of the file".into() };
                let allowed =
                    if line == 1 { "`ply`, and a header that ends in `end_header`" } else { "`end_header`" };
                return Err(wrong(line, found, allowed));
            };
            at += length + 1;
            let said = rest[..length].trim_ascii();
            let words: Vec<&[u8]> =
                said.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).take(6).collect();
            if line == 1 {
                if words != [b"ply"] {
                    return Err(wrong(line, shown(said), "`ply`, as every PLY file begins"));
                }
                continue;
            }
            match words[..] {
                [] | [b"comment" | b"obj_info", ..] => {}
                [b"format", kind, b"1.0"] if encoding.is_none() => encoding = Some(encoding_of(line, kind)?),
                [b"element", name, count] => elements.push(Element::new(line, name, count)?),
                [b"property", ref words @ ..] => {
                    let Some(element) = elements.last_mut() else {
                        return Err(wrong(line, "a property of no element".into(), "`element` before it"));
                    };
                    element.properties.push(property(line, words, said)?);
                }
                [b"end_header"] => break,
                _ => return Err(wrong(line, shown(said), KEYWORDS)),
            }
        }
        let encoding = encoding.ok_or_else(|| wrong(line, "a header without `format`".into(), FORMATS))?;
        let mut names = HashSet::new();
        for element in &elements {
            if !names.insert(&element.name) {
                return Err(element.wrong(format!("a second element `{}`", element.name), "one of each name"));
            }
        }
        Ok(Self { encoding, elements, end: at, lines: line })
    }

    /// Of all elements that have properties.
    pub(super) fn instances(&self) -> Option<u64> {
        let counts = self.elements.iter().filter(|element| !element.properties.is_empty());
        counts.map(|element| element.count).try_fold(0_u64, u64::checked_add)
    }

    pub(super) fn count_of(&self, name: &str) -> u64 {
        self.elements.iter().find(|element| element.name == name).map_or(0, |element| element.count)
    }

    /// Compares what the header promises with the length of the file.
    pub(super) fn check_length(&self, length: usize) -> Result<(), ModelError> {
        let mut left = (length - self.end) as u64;
        for element in &self.elements {
            // The last word of a text needs no space behind it.
            let slack = u64::from(self.encoding == Encoding::Text);
            let least = element
                .properties
                .iter()
                .map(|property| property.kind.least_bytes(self.encoding))
                .sum::<u64>();
            match element.count.checked_mul(least).filter(|bytes| *bytes <= left + slack) {
                Some(bytes) => left = left.saturating_sub(bytes),
                None => {
                    let found = format!(
                        "{} of element `{}`, for which {left} bytes are left",
                        element.count, element.name
                    );
                    return Err(element.wrong(
                        found,
                        &format!("{least} bytes or more for each; the file may be cut short"),
                    ));
                }
            }
        }
        Ok(())
    }
}

impl Element {
    fn new(line: usize, name: &[u8], count: &[u8]) -> Result<Self, ModelError> {
        let number = std::str::from_utf8(count).ok().and_then(|text| text.parse().ok());
        let Some(count) = number else { return Err(wrong(line, shown(count), "a number of instances")) };
        let name = String::from_utf8_lossy(&name[..name.len().min(LONGEST_NAME)]).into_owned();
        Ok(Self { name, count, properties: Vec::new(), line })
    }

    pub(super) fn wrong(&self, found: String, allowed: &str) -> ModelError {
        wrong(self.line, found, allowed)
    }
}

impl Kind {
    fn least_bytes(self, encoding: Encoding) -> u64 {
        match (encoding, self) {
            // A digit and what parts it from the next word.
            (Encoding::Text, _) => 2,
            (_, Self::One(number) | Self::List { count: number, .. }) => number.bytes() as u64,
        }
    }
}

impl Number {
    pub(super) fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

fn property(line: usize, words: &[&[u8]], said: &[u8]) -> Result<Property, ModelError> {
    let number = |word: &[u8]| number(line, word);
    let (name, kind) = match *words {
        [b"list", count, item, name] => (name, Kind::List { count: number(count)?, item: number(item)? }),
        [kind, name] => (name, Kind::One(number(kind)?)),
        _ => return Err(wrong(line, shown(said), "`property TYPE NAME` or `property list TYPE TYPE NAME`")),
    };
    let name = String::from_utf8_lossy(&name[..name.len().min(LONGEST_NAME)]).into_owned();
    Ok(Property { name, kind })
}

fn number(line: usize, word: &[u8]) -> Result<Number, ModelError> {
    Ok(match word {
        b"char" | b"int8" => Number::I8,
        b"uchar" | b"uint8" => Number::U8,
        b"short" | b"int16" => Number::I16,
        b"ushort" | b"uint16" => Number::U16,
        b"int" | b"int32" => Number::I32,
        b"uint" | b"uint32" => Number::U32,
        b"float" | b"float32" => Number::F32,
        b"double" | b"float64" => Number::F64,
        _ => return Err(wrong(line, shown(word), "char, uchar, short, ushort, int, uint, float or double")),
    })
}

fn encoding_of(line: usize, word: &[u8]) -> Result<Encoding, ModelError> {
    match word {
        b"ascii" => Ok(Encoding::Text),
        b"binary_little_endian" => Ok(Encoding::LittleEndian),
        b"binary_big_endian" => Ok(Encoding::BigEndian),
        _ => Err(wrong(line, shown(word), FORMATS)),
    }
}

fn wrong(line: usize, found: String, allowed: &str) -> ModelError {
    ModelError::Line { line, found, allowed: allowed.into() }
}

const FORMATS: &str =
    "`format ascii 1.0`, `format binary_little_endian 1.0` or `format binary_big_endian 1.0`";
const KEYWORDS: &str = "`format`, `comment`, `obj_info`, `element`, `property` or `end_header`";
/// For messages.
const LONGEST_NAME: usize = 40;
