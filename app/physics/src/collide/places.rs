//! Room for the places where a mesh touches, which pairs without a mesh do without.
//!
//! Model: the room is there from the beginning ([`Default`]), or made when a mesh is first met ([`Places::later`]): for who has
//! no deadlines, and thousands of pairs that are of forms.
//! Invariant: of what has its room from the beginning nothing allocates or frees.

use std::ops::{Deref, DerefMut};
use std::sync::LazyLock;

use super::Patches;

/// Places of a pair.
#[derive(Debug, Clone)]
pub struct Places(Option<Box<Patches>>);

/// Places of who has met no mesh yet.
static NONE: LazyLock<Patches> = LazyLock::new(Patches::default);

impl Places {
    /// Without room until it is needed.
    pub const fn later() -> Self {
        Self(None)
    }
}

impl Default for Places {
    fn default() -> Self {
        Self(Some(Box::default()))
    }
}

impl PartialEq for Places {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl Deref for Places {
    type Target = Patches;

    fn deref(&self) -> &Patches {
        self.0.as_deref().unwrap_or_else(|| &NONE)
    }
}

impl DerefMut for Places {
    fn deref_mut(&mut self) -> &mut Patches {
        self.0.get_or_insert_default()
    }
}
