//! Numbers of keys, for recordings.

use eframe::egui::Key;

/// Of a key, the number that X11 gives its symbol (`keysymdef.h`): of letters, the Unicode of the capital one. `None`: it has
/// none.
pub fn code(key: Key) -> Option<u32> {
    let function = Key::ALL.iter().position(|k| *k == Key::F1).zip(Key::ALL.iter().position(|k| *k == key));
    let number = function.and_then(|(first, at)| at.checked_sub(first)).filter(|number| *number < 35);
    if let Some(number) = number {
        return Some(0xffbe + number as u32);
    }
    Some(match key {
        Key::Backspace => 0xff08,
        Key::Tab => 0xff09,
        Key::Enter => 0xff0d,
        Key::Escape => 0xff1b,
        Key::Home => 0xff50,
        Key::ArrowLeft => 0xff51,
        Key::ArrowUp => 0xff52,
        Key::ArrowRight => 0xff53,
        Key::ArrowDown => 0xff54,
        Key::PageUp => 0xff55,
        Key::PageDown => 0xff56,
        Key::End => 0xff57,
        Key::Insert => 0xff63,
        Key::Delete => 0xffff,
        Key::Space => 0x20,
        Key::Minus => 0x2d,
        Key::Quote => 0x27,
        _ => {
            let mut symbol = key.symbol_or_name().chars();
            symbol.next().filter(|first| symbol.next().is_none() && first.is_ascii_graphic())?.into()
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_have_the_numbers_that_the_x11_protocol_gives_them() {
        let known = [
            (Key::A, 0x41),
            (Key::Z, 0x5a),
            (Key::Num0, 0x30),
            (Key::Space, 0x20),
            (Key::Minus, 0x2d),
            (Key::Plus, 0x2b),
            (Key::Backslash, 0x5c),
            (Key::F1, 0xffbe),
            (Key::F12, 0xffc9),
            (Key::F35, 0xffe0),
            (Key::Escape, 0xff1b),
            (Key::ArrowLeft, 0xff51),
        ];
        for (key, number) in known {
            assert_eq!(code(key), Some(number), "{key:?}");
        }
        let all: Vec<u32> = Key::ALL.iter().filter_map(|key| code(*key)).collect();
        let mut once = all.clone();
        once.sort_unstable();
        once.dedup();
        assert_eq!(once.len(), all.len(), "no two keys have one number");
        let none: Vec<Key> = Key::ALL.iter().filter(|key| code(**key).is_none()).copied().collect();
        assert_eq!(none, [Key::Copy, Key::Cut, Key::Paste, Key::BrowserBack]);
    }
}
