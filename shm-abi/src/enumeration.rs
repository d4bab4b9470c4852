//! Enumerations that travel as words.
//!
//! A word from outside may hold a value that a later minor version has added: it becomes `None`, never
//! something else. The values themselves are not in the layout hash; `tests/golden/values.txt` holds them.

/// Gives an enumeration its way back from a word. Every variant must be listed, or this does not compile.
macro_rules! from_word {
    ($type:ident { $($variant:ident),+ $(,)? }) => {
        impl $type {
            /// What stands behind a word, if this version knows it.
            pub fn from_word(word: u64) -> Option<Self> {
                // The match is never taken; it is what refuses a list that lacks a variant.
                let _: fn(Self) = |value| match value { $(Self::$variant => (),)+ };
                [$(Self::$variant),+].into_iter().find(|value| *value as u64 == word)
            }
        }
    };
}
pub(crate) use from_word;
