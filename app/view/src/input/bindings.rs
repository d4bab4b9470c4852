//! Which keys do what.

use super::action::{Action, KNOWN, NAMES};
use super::chord::{ALLOWED, Chord};
use eframe::egui::{Key, Modifiers};
use std::path::Path;
use world::{KeyLine, Location, SceneError, parse_key_lines, read_key_lines};

/// Which keys do what; no key does two things.
#[derive(Debug, Clone, PartialEq)]
pub struct Bindings {
    /// In the order in which actions are explained.
    keys: Vec<(Chord, Action)>,
}

/// What a key means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bound {
    /// What is to be done.
    pub action: Action,
    /// A little of it only.
    pub is_fine: bool,
}

impl Default for Bindings {
    /// What is built in.
    fn default() -> Self {
        let chords = |keys: &'static [&'static str]| keys.iter().filter_map(|key| Chord::parse(key));
        let keys = KNOWN.iter().flat_map(|known| chords(known.keys).map(|chord| (chord, known.action)));
        Self { keys: keys.collect() }
    }
}

/// Who said that a key does something.
enum Said {
    BuiltIn,
    Line(usize),
}

impl Bindings {
    /// What is built in, but for the actions that a file names: those have the keys that it says.
    ///
    /// # Errors
    /// The first thing found to be wrong, with its place and what is allowed there.
    pub fn read(file: &Path) -> Result<Self, SceneError> {
        Self::of_lines(&read_key_lines(file, &NAMES)?)
    }

    /// The same of a text; `file` is named in errors, and not opened.
    ///
    /// # Errors
    /// As [`Bindings::read`].
    pub fn parse(text: &str, file: &Path) -> Result<Self, SceneError> {
        Self::of_lines(&parse_key_lines(text, file, &NAMES)?)
    }

    fn of_lines(lines: &[KeyLine]) -> Result<Self, SceneError> {
        let built_in = Self::default();
        let is_said = |action: Action| lines.iter().any(|line| line.action == action.name());
        let kept = built_in.keys.iter().filter(|(_, action)| !is_said(*action));
        let mut taken: Vec<(Chord, Action, Said)> =
            kept.map(|(chord, action)| (*chord, *action, Said::BuiltIn)).collect();
        for line in lines {
            let Some(known) = KNOWN.iter().find(|known| known.name == line.action) else { continue };
            for (text, at) in &line.keys {
                let chord = Chord::parse(text).ok_or_else(|| no_key(text, at))?;
                if let Some((_, other, said)) = taken.iter().find(|(key, ..)| *key == chord) {
                    return Err(twice(chord, *other, said, at));
                }
                taken.push((chord, known.action, Said::Line(at.line)));
            }
        }
        let place = |action: Action| KNOWN.iter().position(|known| known.action == action);
        taken.sort_by_key(|(_, action, _)| place(*action));
        Ok(Self { keys: taken.into_iter().map(|(chord, action, _)| (chord, action)).collect() })
    }

    /// What a key means; `None`: it is bound to nothing.
    pub fn bound(&self, key: Key, held: Modifiers) -> Option<Bound> {
        let chord = Chord::new(key, held);
        let action =
            |chord: Chord| self.keys.iter().find(|(key, _)| *key == chord).map(|(_, action)| *action);
        if let Some(action) = action(chord) {
            return Some(Bound { action, is_fine: false });
        }
        let fine = action(chord.without_shift()).filter(|action| held.shift && action.has_fine_step());
        fine.map(|action| Bound { action, is_fine: true })
    }

    /// The keys of an action.
    pub fn keys(&self, action: Action) -> impl Iterator<Item = Chord> {
        self.keys.iter().filter(move |(_, bound)| *bound == action).map(|(chord, _)| *chord)
    }
}

fn no_key(text: &str, at: &Location) -> SceneError {
    let found = format!("the string {text:?}");
    SceneError::OutOfRange { at: Box::new(at.clone()), found, allowed: ALLOWED.into() }
}

fn twice(chord: Chord, other: Action, said: &Said, at: &Location) -> SceneError {
    let who = match said {
        Said::BuiltIn => "which is built in".into(),
        Said::Line(line) => format!("on line {line}"),
    };
    let first = format!("by {}, {who}", other.name());
    SceneError::Duplicate { at: Box::new(at.clone()), found: format!("the key {chord}"), first }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::action::Step;

    fn parse(text: &str) -> Result<Bindings, String> {
        Bindings::parse(text, Path::new("k.toml")).map_err(|error| error.to_string())
    }

    fn written(bindings: &Bindings, action: Action) -> Vec<String> {
        bindings.keys(action).map(|chord| chord.to_string()).collect()
    }

    #[test]
    fn every_built_in_key_is_a_key_and_does_one_thing() {
        let bindings = Bindings::default();
        assert_eq!(bindings.keys.len(), KNOWN.iter().map(|known| known.keys.len()).sum::<usize>());
        for (at, (chord, _)) in bindings.keys.iter().enumerate() {
            assert!(bindings.keys[..at].iter().all(|(other, _)| other != chord), "{chord} twice");
        }
        assert!(KNOWN.iter().all(|known| !known.keys.is_empty() && known.says.len() <= 36));
    }

    #[test]
    fn the_file_in_config_says_what_is_built_in() {
        let text = include_str!("../../../../config/keys.toml");
        assert_eq!(parse(text), Ok(Bindings::default()));
        let unsaid: Vec<&str> =
            NAMES.into_iter().filter(|name| !text.contains(&format!("\n{name} = "))).collect();
        assert!(unsaid.is_empty(), "{unsaid:?}");
    }

    #[test]
    fn a_file_binds_other_keys_to_the_actions_that_it_names() {
        let bindings = parse("[keys]\nexit = [\"F4\", \"Ctrl+X\"]").unwrap_err();
        assert!(bindings.starts_with("k.toml:2: keys.exit[0]: found the key F4, already taken by highlight"));
        let bindings = parse("[keys]\nexit = \"Ctrl+W\"\nhelp = []\npause = [\"Escape\", \"H\"]").unwrap();
        assert_eq!(written(&bindings, Action::Exit), ["Ctrl+W"]);
        assert_eq!(written(&bindings, Action::Help), [""; 0]);
        assert_eq!(written(&bindings, Action::Pause), ["Escape", "H"]);
        assert_eq!(written(&bindings, Action::Reset), ["Backspace"]);
        assert_eq!(parse(""), Ok(Bindings::default()));
    }

    #[test]
    fn what_is_wrong_is_told_with_line_and_key_and_what_is_allowed() {
        let refused = |text: &str| parse(text).unwrap_err();
        let said = refused("[keys]\n\nexti = \"A\"\n");
        assert!(
            said.starts_with("k.toml:3: keys.exti: unknown key (did you mean `exit`?); allowed: exit, help,")
        );
        assert_eq!(
            refused("[keys]\nexit = [\"Ctrl+Q\", \"Ctl+A\"]\n"),
            format!("k.toml:2: keys.exit[1]: found the string \"Ctl+A\"; allowed: {ALLOWED}")
        );
        assert_eq!(
            refused("[keys]\nexit = \"Z\"\npause = \"Z\"\n"),
            "k.toml:3: keys.pause: found the key Z, already taken by exit, on line 2; \
             allowed: a value used only once"
        );
        assert_eq!(
            refused("[keys]\npause = \"H\"\n"),
            "k.toml:2: keys.pause: found the key H, already taken by help, which is built in; \
             allowed: a value used only once"
        );
        assert_eq!(
            refused("[keys]\npause = 3\n"),
            "k.toml:2: keys.pause: found 3; \
             allowed: a key such as \"Ctrl+Q\", or an array of keys"
        );
        let said = Bindings::read(Path::new("/there/is/none.toml")).unwrap_err().to_string();
        assert!(said.starts_with("/there/is/none.toml: no such file"), "{said}");
    }

    #[test]
    fn shift_makes_steps_finer_where_it_is_bound_to_nothing_else() {
        let bindings = Bindings::default();
        let bound = |key, held| bindings.bound(key, held).map(|bound| (bound.action, bound.is_fine));
        let right = Action::Move([1, 0, 0]);
        assert_eq!(bound(Key::ArrowRight, Modifiers::NONE), Some((right, false)));
        assert_eq!(bound(Key::ArrowRight, Modifiers::SHIFT), Some((right, true)));
        assert_eq!(bound(Key::ArrowRight, Modifiers::CTRL), Some((Action::Turn([0, 0, -1]), false)));
        assert_eq!(bound(Key::ArrowRight, Modifiers::ALT), None);
        assert_eq!(bound(Key::K, Modifiers::NONE), Some((Action::Stiffness(Step::More), false)));
        assert_eq!(bound(Key::K, Modifiers::SHIFT), Some((Action::Stiffness(Step::Less), false)));
        assert_eq!(bound(Key::P, Modifiers::SHIFT), None, "only steps have finer ones");
        // A command key is Ctrl, and is told twice.
        assert_eq!(bound(Key::Q, Modifiers::CTRL | Modifiers::COMMAND), Some((Action::Exit, false)));
    }
}
