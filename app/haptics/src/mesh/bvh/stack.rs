//! What a query still has to visit: nodes and runs of faces, each with the number that may rule it out.

use super::{Child, STACK};

/// A stack of constant size on the stack.
pub(super) struct Stack<Key> {
    entries: [(Key, Child); STACK],
    len: usize,
}

impl<Key: Copy + Default + PartialOrd> Stack<Key> {
    /// Holds the root.
    pub(super) fn new() -> Self {
        Self { entries: [(Key::default(), Child(0)); STACK], len: 1 }
    }

    #[inline(always)]
    pub(super) fn pop(&mut self) -> Option<(Key, Child)> {
        #[cfg(test)]
        POPPED.set(POPPED.get() + 1);
        self.len = self.len.checked_sub(1)?;
        self.entries.get(self.len).copied()
    }

    /// Puts those children on whose key is at most `limit`; the one with the smallest key comes off first.
    #[inline(always)]
    pub(super) fn push<const N: usize>(&mut self, keys: &[Key; N], children: &[Child; N], limit: Key) {
        let bottom = self.len;
        for i in 0..N {
            if keys[i] <= limit {
                self.insert(bottom, keys[i], children[i]);
            }
        }
    }

    /// Insertion sort, downward from the top: there are rarely more than two to sort.
    #[inline(always)]
    fn insert(&mut self, bottom: usize, key: Key, child: Child) {
        // The depth of the tree makes this impossible; stopping short beats a panic inside a tick.
        debug_assert!(self.len < STACK);
        if self.len >= STACK {
            return;
        }
        let mut at = self.len;
        while at > bottom && self.entries[at - 1].0 < key {
            self.entries[at] = self.entries[at - 1];
            at -= 1;
        }
        self.entries[at] = (key, child);
        self.len += 1;
    }
}

#[cfg(test)]
thread_local! {
    /// What queries of this thread have taken off their stacks: nodes and runs of faces, visited or ruled out.
    pub(crate) static POPPED: std::cell::Cell<usize> = const { std::cell::Cell::new(0) };
}
