//! What crosses between two threads when an island does: small pieces by value.

use nalgebra::Isometry3;

use crate::anchor::Anchor;
use crate::body::Body;
use crate::collide::Patch;
use crate::pair::{ANCHORS_AT_ONCE, Head};
use crate::sleep::Rest;

/// A piece of an island on its way.
#[derive(Debug, Clone, Copy)]
pub struct Parcel(pub(super) Content);

/// None is much larger than the others: a queue has room for the largest in each of its places.
#[derive(Debug, Clone, Copy)]
pub(super) enum Content {
    Body(Leaver),
    /// What two entities remember of each other, which then follows.
    Pair {
        body: u32,
        entity: u32,
        is_near: bool,
        head: Head,
    },
    /// Of that pair, from this number on.
    Anchors {
        first: u32,
        anchors: [Anchor; ANCHORS_AT_ONCE],
    },
    /// Of that pair, a place where a mesh touches.
    Place {
        number: u32,
        place: Patch,
    },
    /// The island is complete.
    End,
}

/// A body on its way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Leaver {
    pub(super) body: u32,
    pub(super) is_asleep: bool,
    pub(super) rest: Rest,
    pub(super) owed_j: f64,
    pub(super) state: Body,
    pub(super) previous_X_WB: Isometry3<f64>,
}

/// What a place in a queue takes \[bytes\]: of a cube on a floor four go, and an end.
const MOST_BYTES: usize = 384;
const _: () = assert!(size_of::<Parcel>() <= MOST_BYTES);

impl Parcel {
    /// Of no island: what a queue is filled with for its memory to be there.
    pub const EMPTY: Self = Self(Content::End);

    /// Which body this is, if it is one.
    pub fn body(&self) -> Option<usize> {
        match &self.0 {
            Content::Body(leaver) => Some(leaver.body as usize),
            _ => None,
        }
    }

    /// Whether it is the last one of its island.
    pub fn is_last(&self) -> bool {
        matches!(self.0, Content::End)
    }
}
