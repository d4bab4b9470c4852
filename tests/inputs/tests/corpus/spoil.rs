//! Ugly inputs from good ones: cut, doubled, swapped, with flipped bits and extreme numbers.
//!
//! Without coverage feedback, but in every `cargo test`. The generator is Marsaglia's xorshift, so that a round is the same
//! everywhere.

/// A source of numbers.
pub(crate) struct Random(u64);

impl Random {
    /// Of this round of a target.
    pub(crate) fn of(name: &str, round: u64) -> Self {
        let seed = name.bytes().fold(0xcbf2_9ce4_8422_2325, |hash: u64, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
        });
        let mut random = Self(seed ^ round.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        for _ in 0..8 {
            random.below(2);
        }
        random
    }

    /// From 0 to one less than this.
    pub(crate) fn below(&mut self, most: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % most.max(1)
    }
}

/// One to four changes; `other` is spliced in at times.
pub(crate) fn spoilt(good: &[u8], other: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = good.to_vec();
    for _ in 0..=random.below(4) {
        spoil_once(&mut bytes, other, random);
    }
    bytes.truncate(MOST_BYTES);
    bytes
}

fn spoil_once(bytes: &mut Vec<u8>, other: &[u8], random: &mut Random) {
    let at = random.below(bytes.len() + 1);
    let end = (at + random.below(64)).min(bytes.len());
    match random.below(9) {
        0 => bytes.truncate(at),
        1 => drop(bytes.drain(at..end)),
        2 => {
            let piece = bytes[at..end].to_vec();
            bytes.splice(at..at, piece);
        }
        3 => {
            let piece: Vec<u8> = other[random.below(other.len() + 1)..].iter().take(256).copied().collect();
            bytes.splice(at..end, piece);
        }
        4 => bytes[at..end].reverse(),
        5 | 6 => {
            if let Some(byte) = bytes.get_mut(at) {
                *byte ^= 1 << random.below(8);
            }
        }
        7 => bytes[at..end].fill([0, 0xff, b' ', b'[', b'9'][random.below(5)]),
        _ => {
            let end = bytes[at..].iter().position(|b| !b.is_ascii_digit()).map_or(end, |length| at + length);
            bytes.splice(at..end, UGLY[random.below(UGLY.len())].bytes());
        }
    }
}

const UGLY: [&str; 16] = [
    "1e308",
    "-1e308",
    "5e-324",
    "nan",
    "inf",
    "-1",
    "0",
    "1e6",
    "-0.0",
    "18446744073709551615",
    "4294967296",
    "\u{1b}[2J",
    "\"\"\"",
    "\n",
    ",",
    "\u{202e}",
];
/// More are a matter of time only.
const MOST_BYTES: usize = 1 << 16;
