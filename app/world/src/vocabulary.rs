//! The words a place in a file knows: those this version can do, those a later one will.
//!
//! The scene format is fixed as a whole, so that a file says the same in every version. A word
//! of the format that this version does not implement is told apart from a typing error.

use rt_core::likeness::nearest;

/// The words of one place: the keys of a table, or the kinds one may choose from.
#[derive(Debug)]
pub(crate) struct Vocabulary {
    /// What this version implements, in the order of the documentation.
    pub(crate) available: &'static [&'static str],
    /// What the format knows and this version does not implement.
    pub(crate) later: &'static [&'static str],
}

/// What a vocabulary says about a word.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// The word, as one of ours.
    Available(&'static str),
    /// Of the format, but not of this version.
    Later,
    /// Unknown; perhaps with the word that was meant, formatted for the reader.
    Unknown(Option<String>),
}

impl Vocabulary {
    /// What may be written, for the reader.
    pub(crate) fn list(&self) -> String {
        self.available.join(", ")
    }

    pub(crate) fn judge(&self, word: &str) -> Verdict {
        if let Some(known) = self.available.iter().find(|known| **known == word) {
            Verdict::Available(known)
        } else if self.later.contains(&word) {
            Verdict::Later
        } else {
            Verdict::Unknown(self.suggest(word))
        }
    }

    /// The nearest known word, if it is near enough to be what was meant.
    fn suggest(&self, word: &str) -> Option<String> {
        let lower = word.to_lowercase();
        let synonym = SYNONYMS.iter().find(|(other, ours)| *other == lower && self.available.contains(ours));
        if let Some((_, ours)) = synonym {
            return Some(format!("`{ours}`"));
        }
        let known = self.available.iter().chain(self.later);
        let meant = nearest(&lower, known.copied())?;
        let note = if self.later.contains(&meant) { ", which is not available in this version" } else { "" };
        Some(format!("`{meant}`{note}"))
    }
}

/// What other programs call things, and what they are called here, if the place knows that word.
const SYNONYMS: [(&str, &str); 30] = [
    ("ball", "sphere"),
    ("cube", "box"),
    ("cuboid", "box"),
    ("block", "box"),
    ("tube", "cylinder"),
    ("rod", "cylinder"),
    ("donut", "torus"),
    ("ring", "torus"),
    ("pill", "capsule"),
    ("obj", "mesh"),
    ("stl", "mesh"),
    ("model", "mesh"),
    ("floor", "plane"),
    ("ground", "plane"),
    ("diameter_m", "radius_m"),
    ("diameter", "radius_m"),
    ("height_m", "length_m"),
    ("extent", "size_m"),
    ("dimensions", "size_m"),
    ("pos", "position_m"),
    ("location", "position_m"),
    ("translation", "position_m"),
    ("rotation", "orientation_wxyz"),
    ("quaternion", "orientation_wxyz"),
    ("euler", "orientation_wxyz"),
    ("weight", "mass_kg"),
    ("color", "visual"),
    ("colour", "visual"),
    ("static", "movable"),
    ("dynamic", "movable"),
];

#[cfg(test)]
mod tests {
    use super::*;

    const WORDS: Vocabulary =
        Vocabulary { available: &["radius_m", "stiffness_n_per_m", "name"], later: &["mass_kg"] };

    #[test]
    fn a_slip_is_recognised_and_nonsense_is_not() {
        let meant = |word| WORDS.judge(word);
        assert_eq!(meant("radius"), Verdict::Unknown(Some("`radius_m`".into())));
        assert_eq!(meant("Name"), Verdict::Unknown(Some("`name`".into())));
        assert_eq!(meant("stiffness"), Verdict::Unknown(Some("`stiffness_n_per_m`".into())));
        assert_eq!(meant("wobble"), Verdict::Unknown(None));
        assert_eq!(meant(&"n".repeat(1 << 20)), Verdict::Unknown(None));
    }

    #[test]
    fn a_word_of_other_programs_leads_to_ours_where_the_place_knows_it() {
        let shapes = Vocabulary { available: &["sphere", "box"], later: &[] };
        assert_eq!(shapes.judge("cube"), Verdict::Unknown(Some("`box`".into())));
        assert_eq!(shapes.judge("Ball"), Verdict::Unknown(Some("`sphere`".into())));
        assert_eq!(WORDS.judge("cube"), Verdict::Unknown(None));
    }

    #[test]
    fn a_word_of_a_later_version_is_told_apart_from_a_slip() {
        assert_eq!(WORDS.judge("mass_kg"), Verdict::Later);
        let suggestion = "`mass_kg`, which is not available in this version".to_owned();
        assert_eq!(WORDS.judge("mass_gk"), Verdict::Unknown(Some(suggestion)));
        assert_eq!(WORDS.judge("name"), Verdict::Available("name"));
    }
}
