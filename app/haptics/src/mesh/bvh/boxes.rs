//! Faces that somebody else's measure picks, box by box.
//!
//! Problem: which of a million faces come near something that is no point, as another solid is.
//! Model: the measure is asked of each box by its middle and half its size, and answers `None` where nothing in it can
//! matter, else a key; boxes and runs of faces with the smallest key are opened first.
//! Cost: two calls a child; as many nodes and runs as are allowed, and no more.

use nalgebra::Vector3;

use super::Bvh;
use super::stack::Stack;

impl<const WIDTH: usize> Bvh<WIDTH> {
    /// Visits the numbers of the faces in all boxes that `key_of` gives a key, smallest keys first among siblings, until
    /// `visit` says `false`; both may use what the other has learned. Says whether all were visited, of which there may be more than `most_visits` nodes and runs.
    pub fn for_each_face_in_boxes<S>(
        &self,
        state: &mut S,
        key_of: impl Fn(&S, &Vector3<f64>, &Vector3<f64>) -> Option<f64>,
        mut visit: impl FnMut(&mut S, u32) -> bool,
        most_visits: usize,
    ) -> bool {
        let mut stack = Stack::<f64>::new();
        let mut visits = 0;
        while let Some((_, child)) = stack.pop() {
            visits += 1;
            if visits > most_visits {
                return false;
            }
            if child.count() > 0 {
                if !(child.index()..child.index() + child.count()).all(|face| visit(state, face as u32)) {
                    return false;
                }
                continue;
            }
            let node = &self.nodes[child.index()];
            let mut keys = [f64::INFINITY; WIDTH];
            for (i, key) in keys.iter_mut().enumerate() {
                let side = |side: usize| Vector3::from_fn(|axis, _| f64::from(node.bounds[side][axis][i]));
                let (low_B, high_B) = (side(0), side(1));
                if low_B.x <= high_B.x {
                    *key = key_of(state, &((low_B + high_B) * 0.5), &((high_B - low_B) * 0.5))
                        .unwrap_or(f64::INFINITY);
                }
            }
            stack.push(&keys, &node.children, f64::MAX);
        }
        true
    }
}
