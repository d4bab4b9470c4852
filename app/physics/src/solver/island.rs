//! Which bodies press each other: those are solved for together, and wake, sleep and are handed over together.
//!
//! Model: two bodies that something moves are of one island where a row joins them, whether or not it presses just now; what
//! nothing moves joins nobody. Found by union-find whose roots are the lowest numbers.
//! Invariant: islands come in the order of their first bodies, and bodies in theirs: the same rows give the same answer.
//! Cost: linear in rows and bodies, but for the way to a root, which halves whenever it is gone; no allocation.

use super::Motion;
use crate::row::Row;

/// The islands of a tick.
#[derive(Debug, Clone, Default)]
pub struct Islands {
    room: usize,
    /// Of each body one of its island that is no later; at the end, the first.
    roots: Vec<usize>,
    /// Of each body, its island.
    numbers: Vec<usize>,
    /// Where the bodies of each island begin in `members`.
    starts: Vec<usize>,
    members: Vec<usize>,
    /// Of each body, whether anything moves it.
    moves: Vec<bool>,
}

impl Islands {
    /// Room for so many bodies.
    pub fn with_capacity(bodies: usize) -> Self {
        let room = || Vec::with_capacity(bodies + 1);
        let moves = Vec::with_capacity(bodies);
        Self { room: bodies, roots: room(), numbers: room(), starts: room(), members: room(), moves }
    }

    /// The islands that these rows make of the bodies, each as the numbers of its bodies. A body that presses no other is
    /// one of its own; bodies beyond the room are left out.
    pub fn of(&mut self, rows: &[Row], motions: &[Motion]) -> impl ExactSizeIterator<Item = &[usize]> + '_ {
        let bodies = self.room.min(motions.len());
        self.roots.clear();
        self.roots.extend(0..bodies);
        self.moves.clear();
        let moves = |motion: &Motion| motion.is_movable() && motion.is_finite();
        self.moves.extend(motions[..bodies].iter().map(moves));
        for row in rows {
            if let Some([a, b]) = self.joins(row) {
                self.join(a, b);
            }
        }
        self.sort();
        self.iter()
    }

    /// Those that were found last.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &[usize]> + '_ {
        self.starts.windows(2).map(|bounds| &self.members[bounds[0]..bounds[1]])
    }

    /// The place of a body's island among them.
    pub fn island_of(&self, body: usize) -> Option<usize> {
        self.numbers.get(body).copied()
    }

    /// Whether a body is of an island of several.
    pub(crate) fn are_many(&self, body: usize) -> bool {
        self.island_of(body).is_some_and(|at| self.starts[at + 1] - self.starts[at] > 1)
    }

    /// The two bodies that a row joins.
    fn joins(&self, row: &Row) -> Option<[usize; 2]> {
        let other = row.other?;
        let moves = |body: usize| self.moves.get(body) == Some(&true);
        (other != row.body && moves(row.body) && moves(other)).then_some([row.body, other])
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.roots[a.max(b)] = a.min(b);
    }

    fn root(&mut self, mut body: usize) -> usize {
        while self.roots[body] != body {
            self.roots[body] = self.roots[self.roots[body]];
            body = self.roots[body];
        }
        body
    }

    /// Numbers islands and sorts their bodies, by counting.
    fn sort(&mut self) {
        let bodies = self.roots.len();
        self.numbers.clear();
        self.starts.clear();
        self.starts.push(0);
        for body in 0..bodies {
            let root = self.root(body);
            if root == body {
                self.starts.push(0);
            }
            let number = if root == body { self.starts.len() - 2 } else { self.numbers[root] };
            self.numbers.push(number);
            self.starts[number + 1] += 1;
        }
        (1..self.starts.len()).for_each(|at| self.starts[at] += self.starts[at - 1]);
        self.members.clear();
        self.members.resize(bodies, 0);
        // From the last one back, so that each place is counted down to where its island begins.
        for body in (0..bodies).rev() {
            let end = &mut self.starts[self.numbers[body] + 1];
            *end -= 1;
            self.members[*end] = body;
        }
        self.starts.rotate_left(1);
        if let Some(last) = self.starts.last_mut() {
            *last = bodies;
        }
    }
}
