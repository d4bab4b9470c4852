//! What a key means.

/// What somebody asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Key {
    Leave,
    Pause,
    Reset,
    Help,
}

const ESCAPE: u8 = 0x1b;
const CTRL_C: u8 = 0x03;

/// The keys in what a terminal sent at once. An escape by itself is the key of that name, one with something behind it
/// an arrow or the like, which means nothing here.
pub(super) fn read(bytes: &[u8]) -> Vec<Key> {
    match bytes {
        [ESCAPE] => vec![Key::Leave],
        [ESCAPE, ..] => Vec::new(),
        _ => bytes.iter().filter_map(|byte| of(*byte)).collect(),
    }
}

fn of(byte: u8) -> Option<Key> {
    match byte {
        b'q' | b'Q' | CTRL_C => Some(Key::Leave),
        b'p' | b'P' => Some(Key::Pause),
        b'r' | b'R' => Some(Key::Reset),
        b'?' | b'h' => Some(Key::Help),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_key_means_what_the_help_says_and_others_nothing() {
        for (bytes, key) in [
            (&b"q"[..], Key::Leave),
            (b"\x1b", Key::Leave),
            (b"\x03", Key::Leave),
            (b"p", Key::Pause),
            (b"r", Key::Reset),
            (b"?", Key::Help),
        ] {
            assert_eq!(read(bytes), [key], "{bytes:?}");
        }
        for nothing in [&b""[..], b"x", b"\x1b[A", b"\x1bOq", b"\xff\x00"] {
            assert_eq!(read(nothing), [], "{nothing:?}");
        }
        assert_eq!(read(b"pxr"), [Key::Pause, Key::Reset], "typed faster than read");
    }
}
