//! What keys and mouse do, for people.

use super::action::{Group, KNOWN};
use super::bindings::Bindings;

/// A line of the help.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum HelpLine {
    /// What follows is about this.
    Title(&'static str),
    /// What a key, or a movement of the mouse, does.
    Does {
        /// The keys.
        keys: String,
        /// What they do.
        says: &'static str,
    },
}

const MOUSE: [(&str, &str); 7] = [
    ("left drag, wheel", "the hand: across, and in depth"),
    ("left click", "choose a thing"),
    ("right drag", "camera around what is in the middle"),
    ("middle drag", "camera across"),
    ("Ctrl+wheel", "camera towards the pointer"),
    ("right held, WASD RF", "camera flies; R up, F down"),
    ("Shift with steps", "finer ones"),
];

/// Two columns of it.
pub fn help(bindings: &Bindings) -> [Vec<HelpLine>; 2] {
    let group = |title, group| {
        let known = KNOWN.iter().filter(move |known| known.group == group);
        let does = known.filter_map(|known| {
            let keys: Vec<String> = bindings.keys(known.action).map(|chord| chord.to_string()).collect();
            (!keys.is_empty()).then(|| HelpLine::Does { keys: keys.join(", "), says: known.says })
        });
        [HelpLine::Title(title)].into_iter().chain(does)
    };
    let mouse = MOUSE.iter().map(|(keys, says)| HelpLine::Does { keys: (*keys).into(), says });
    let left = group("Run", Group::Run).chain(group("Picture", Group::Picture));
    let right = group("What is chosen, else the hand", Group::Things);
    [left.collect(), right.chain([HelpLine::Title("Mouse")]).chain(mouse).collect()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_actions_are_explained_with_the_keys_that_they_have() {
        let bindings = Bindings::parse(
            "[keys]\npause = [\"Z\", \"Ctrl+Z\"]\nreset = []",
            std::path::Path::new("k.toml"),
        );
        let lines = help(&bindings.unwrap()).concat();
        let keys_of = |what: &str| {
            lines.iter().find_map(|line| match line {
                HelpLine::Does { keys, says } if *says == what => Some(keys.as_str()),
                _ => None,
            })
        };
        assert_eq!(keys_of("let things stand still, or go on"), Some("Z, Ctrl+Z"));
        assert_eq!(keys_of("put everything where it began"), None);
        assert_eq!(keys_of("close the window, end the run"), Some("Escape, Ctrl+Q"));
        let does = lines.iter().filter(|line| matches!(line, HelpLine::Does { .. })).count();
        assert_eq!(does, KNOWN.len() - 1 + MOUSE.len());
        // Rows of 18 points in a window of 800, with what stands around them.
        assert!(help(&Bindings::default()).iter().all(|column| column.len() <= 40));
    }
}
