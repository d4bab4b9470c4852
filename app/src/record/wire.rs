//! Protocol Buffers on the wire, as much of it as a recording needs.
//!
//! Model: a message is a sequence of fields, each with its number and one of three shapes: whole number (varint), eight
//! bytes, or bytes with their length. Fields that are zero are left out, as in every proto3 message; a negative zero is
//! not zero, so that every f64 reads back bit for bit. The messages are described to their readers by
//! [`descriptor`](super::descriptor), in the same encoding.
//! Cost: one pass, nothing is copied but the inside of nested messages, once per level.

/// A message being written.
#[derive(Debug, Default, Clone)]
pub(super) struct Message {
    bytes: Vec<u8>,
}

const VARINT: u64 = 0;
const EIGHT_BYTES: u64 = 1;
const BYTES: u64 = 2;
const FOUR_BYTES: u64 = 5;

impl Message {
    /// Without fields.
    pub(super) fn new() -> Self {
        Self::default()
    }

    /// What is written so far.
    pub(super) fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Bytes that are written.
    pub(super) fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    /// Takes out the fields before this byte, which one begins at.
    pub(super) fn cut(&mut self, at: usize) -> Vec<u8> {
        let behind = self.bytes.split_off(at);
        std::mem::replace(&mut self.bytes, behind)
    }

    /// Forgets its fields, not its memory.
    pub(super) fn clear(&mut self) {
        self.bytes.clear();
    }

    /// A number.
    pub(super) fn double(&mut self, field: u32, value: f64) -> &mut Self {
        if value.to_bits() != 0 {
            self.varint(u64::from(field) << 3 | EIGHT_BYTES);
            self.bytes.extend(value.to_le_bytes());
        }
        self
    }

    /// A whole number, a bool or a value of an enumeration.
    pub(super) fn whole(&mut self, field: u32, value: u64) -> &mut Self {
        if value != 0 { self.given(field, value) } else { self }
    }

    /// The same where zero is not nothing.
    pub(super) fn given(&mut self, field: u32, value: u64) -> &mut Self {
        self.varint(u64::from(field) << 3 | VARINT);
        self.varint(value);
        self
    }

    /// A text.
    pub(super) fn text(&mut self, field: u32, value: &str) -> &mut Self {
        if !value.is_empty() {
            self.chunk(field, value.as_bytes());
        }
        self
    }

    /// Whole numbers of four bytes each.
    pub(super) fn packed_fixed32(&mut self, field: u32, values: &[u32]) -> &mut Self {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.chunk(field, &bytes);
        self
    }

    /// A nested message, even if it has no fields: a reader then knows that it is there.
    pub(super) fn message(&mut self, field: u32, write: impl FnOnce(&mut Self)) -> &mut Self {
        self.varint(u64::from(field) << 3 | BYTES);
        // Most have less than 128 bytes: one byte for the length, and room is made where more are needed.
        let at = self.bytes.len();
        self.bytes.push(0);
        write(self);
        let length = self.bytes.len() - at - 1;
        if length < 0x80 {
            self.bytes[at] = length as u8;
        } else {
            let inside = self.bytes.split_off(at + 1);
            self.bytes.truncate(at);
            self.varint(length as u64);
            self.bytes.extend(inside);
        }
        self
    }

    fn chunk(&mut self, field: u32, bytes: &[u8]) {
        self.varint(u64::from(field) << 3 | BYTES);
        self.varint(bytes.len() as u64);
        self.bytes.extend(bytes);
    }

    fn varint(&mut self, value: u64) {
        let mut rest = value;
        while rest >= 0x80 {
            self.bytes.push(rest as u8 | 0x80);
            rest >>= 7;
        }
        self.bytes.push(rest as u8);
    }
}

/// A field's value, as it came over the wire.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Value<'a> {
    /// A whole number.
    Whole(u64),
    /// A number.
    Double(f64),
    /// A text, a nested message, or bytes.
    Bytes(&'a [u8]),
}

impl<'a> Value<'a> {
    /// As a number.
    pub(super) fn double(self) -> Option<f64> {
        if let Self::Double(value) = self { Some(value) } else { None }
    }

    /// As a whole number.
    pub(super) fn whole(self) -> Option<u64> {
        if let Self::Whole(value) = self { Some(value) } else { None }
    }

    /// As a text.
    pub(super) fn text(self) -> Option<&'a str> {
        self.bytes().and_then(|bytes| std::str::from_utf8(bytes).ok())
    }

    /// As bytes.
    pub(super) fn bytes(self) -> Option<&'a [u8]> {
        if let Self::Bytes(bytes) = self { Some(bytes) } else { None }
    }
}

/// Hands each field of a message to `take`; `None` if it is no message, or `take` does not believe a field.
pub(super) fn each_field<'a>(
    message: &'a [u8],
    mut take: impl FnMut(u32, Value<'a>) -> Option<()>,
) -> Option<()> {
    let mut rest = message;
    while !rest.is_empty() {
        let key = read_varint(&mut rest)?;
        let field = u32::try_from(key >> 3).ok()?;
        let value = match key & 7 {
            VARINT => Value::Whole(read_varint(&mut rest)?),
            EIGHT_BYTES => Value::Double(f64::from_le_bytes(take_bytes(&mut rest, 8)?.try_into().ok()?)),
            BYTES => {
                let length = usize::try_from(read_varint(&mut rest)?).ok()?;
                Value::Bytes(take_bytes(&mut rest, length)?)
            }
            FOUR_BYTES => Value::Bytes(take_bytes(&mut rest, 4)?),
            _ => return None,
        };
        take(field, value)?;
    }
    Some(())
}

fn take_bytes<'a>(rest: &mut &'a [u8], length: usize) -> Option<&'a [u8]> {
    let (taken, left) = rest.split_at_checked(length)?;
    *rest = left;
    Some(taken)
}

fn read_varint(rest: &mut &[u8]) -> Option<u64> {
    let mut value = 0;
    for shift in (0..64).step_by(7) {
        let byte = *take_bytes(rest, 1)?.first()?;
        value |= u64::from(byte & 0x7f) << shift;
        if byte < 0x80 {
            return Some(value);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_what_the_encoding_s_documentation_shows() {
        // From the public description of the encoding: field 1 = 150, field 2 = "testing".
        let mut message = Message::new();
        message.whole(1, 150).text(2, "testing");
        assert_eq!(message.bytes(), b"\x08\x96\x01\x12\x07testing");
        let mut outer = Message::new();
        outer.message(3, |inner| {
            inner.whole(1, 150);
        });
        assert_eq!(outer.bytes(), b"\x1a\x03\x08\x96\x01");
    }

    #[test]
    fn every_number_reads_back_bit_for_bit_also_the_negative_zero_and_long_messages() {
        let numbers = [-0.0, 0.0, 1e-308, f64::MAX, 0.1 + 0.2];
        let long = "x".repeat(300);
        let mut message = Message::new();
        message.message(7, |inner| {
            for (field, number) in (1..).zip(numbers) {
                inner.double(field, number);
            }
            inner.text(100, &long).whole(200, u64::MAX);
        });
        let mut back = [0.0f64; 5];
        let mut others = None;
        each_field(message.bytes(), |field, value| {
            assert_eq!(field, 7);
            each_field(value.bytes()?, |field, value| {
                match field {
                    1..=5 => back[field as usize - 1] = value.double()?,
                    100 => assert_eq!(value.text()?, long),
                    _ => others = value.whole(),
                }
                Some(())
            })
        })
        .expect("a message");
        assert_eq!(back.map(f64::to_bits), numbers.map(f64::to_bits));
        assert_eq!(others, Some(u64::MAX));
    }

    #[test]
    fn what_is_cut_or_no_message_at_all_is_refused() {
        let mut message = Message::new();
        message.text(1, "testing").double(2, 1.0);
        for length in 1..message.bytes().len() {
            let whole_field = length == 9;
            assert_eq!(
                each_field(&message.bytes()[..length], |_, _| Some(())).is_some(),
                whole_field,
                "{length}"
            );
        }
        assert_eq!(each_field(&[0xff; 30], |_, _| Some(())), None);
        assert_eq!(each_field(&[0x0f], |_, _| Some(())), None);
    }
}
