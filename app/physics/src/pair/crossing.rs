//! What of a pair crosses to another thread: its head, the anchors in use, and of meshes the places where they touch.
//!
//! Invariant: who gets all of it in order goes on as the one that gave it, to the bit; what is not sent is not read.

use super::{Anchor, Ledger, MAX_POINTS, Pair, Surfacing};
use crate::collide::{Patch, Patches, Searched, Spread};

/// What every pair has.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Head {
    entities: [u32; 2],
    surfacing: Surfacing,
    words: [f64; 8],
    searched: Option<Searched>,
    spread: Spread,
    ledger: Ledger,
    count: u32,
    remembers: bool,
    has_mesh: bool,
    is_new: bool,
}

/// So many anchors cross at once.
pub(crate) const ANCHORS_AT_ONCE: usize = 2;

impl Pair {
    /// All but its anchors and places.
    pub(crate) fn head(&self) -> Head {
        Head {
            entities: self.entities.map(|entity| entity as u32),
            surfacing: self.surfacing,
            words: self.memory.words,
            searched: self.patches().and_then(Patches::searched),
            spread: self.patches().map_or_else(Spread::default, |patches| patches.spread),
            ledger: self.ledger,
            count: self.count as u32,
            remembers: self.remembers,
            has_mesh: self.has_mesh,
            is_new: self.is_new,
        }
    }

    /// Becomes the pair of this head, in the place of one that has ended.
    pub(crate) fn begin_as(&mut self, head: &Head) {
        self.begin(head.entities.map(|entity| entity as usize), head.has_mesh, head.surfacing, head.is_new);
        (self.ledger, self.remembers) = (head.ledger, head.remembers);
        self.count = (head.count as usize).min(MAX_POINTS);
        self.make_room(self.count);
        self.memory.words = head.words;
        if head.has_mesh {
            self.memory.patches.go_on_from(head.searched);
            self.memory.patches.spread = head.spread;
        }
    }

    /// Its anchors from this one on, as many as cross at once, the last ones twice if need be; `None`: there are no more.
    pub(crate) fn anchors_from(&self, first: usize) -> Option<[Anchor; ANCHORS_AT_ONCE]> {
        let used = self.anchors[..self.count].get(first..).filter(|used| !used.is_empty())?;
        Some(std::array::from_fn(|at| used[at.min(used.len() - 1)]))
    }

    /// Takes in what [`Self::anchors_from`] gave.
    pub(crate) fn put_anchors(&mut self, first: usize, anchors: &[Anchor; ANCHORS_AT_ONCE]) {
        for (own, anchor) in self.anchors[..self.count].iter_mut().skip(first).zip(anchors) {
            *own = *anchor;
        }
    }

    /// The next place from this number on that is not as a new one, and its number.
    pub(crate) fn place_from(&self, first: usize) -> Option<(usize, Patch)> {
        self.patches()?.used_from(first)
    }

    /// Takes in what [`Self::place_from`] gave.
    pub(crate) fn put_place(&mut self, number: usize, place: &Patch) {
        self.memory.patches.put(number, place);
    }

    fn patches(&self) -> Option<&Patches> {
        self.has_mesh.then_some(&self.memory.patches)
    }
}
