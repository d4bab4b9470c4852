//! A tree of boxes that changes: what is near is found without looking at the rest.
//!
//! Model: a binary tree, each node a box around its two children's; a leaf is put beside the node where the tree's boxes
//! grow least, and the way back to the root is kept balanced by rotations as in an AVL tree (the dynamic trees of physics
//! engines since Presson's). Walks need no stack: a node knows its parent.
//! Invariants: all memory is there from the beginning; heights of siblings differ by 1 at most, so that a way from the root
//! is no longer than 1.44 times the binary logarithm of the leaves.
//! Cost: putting in and taking out is logarithmic; a query visits what overlaps, and its ancestors.

use super::aabb::Aabb;
use nalgebra::Vector3;

/// Leaves with a number each.
#[derive(Debug, Clone)]
pub(crate) struct Tree {
    nodes: Box<[Node]>,
    root: u32,
    /// The first of the nodes without use; the next one is its parent.
    free: u32,
}

/// A leaf's place, or an inner node's.
type Place = u32;

#[derive(Debug, Clone, Copy)]
struct Node {
    around: Aabb,
    parent: Place,
    /// Of a leaf: nothing, and its number.
    children: [Place; 2],
    /// Of a leaf 0.
    height: u32,
}

const NOWHERE: Place = u32::MAX;

impl Tree {
    /// Room for so many leaves.
    pub(crate) fn with_capacity(leaves: usize) -> Self {
        let count = (2 * leaves).saturating_sub(1).min(NOWHERE as usize - 1);
        let zero = Aabb { low_W: Vector3::zeros(), high_W: Vector3::zeros() };
        let node = |place: usize| Node {
            around: zero,
            parent: if place + 1 < count { place as Place + 1 } else { NOWHERE },
            children: [NOWHERE; 2],
            height: 0,
        };
        let nodes: Box<[_]> = (0..count).map(node).collect();
        Self { free: if nodes.is_empty() { NOWHERE } else { 0 }, nodes, root: NOWHERE }
    }

    /// Puts all of these in, of which none is there yet: halves beside each other along the way that their middles are spread
    /// most, in much less time than one by one. Tells where each has its place.
    pub(crate) fn fill(&mut self, leaves: &mut [(u32, Aabb)], mut put: impl FnMut(u32, Place)) {
        if let Some(root) = self.subtree(leaves, NOWHERE, &mut put) {
            self.root = root;
        }
    }

    /// `None`: of nothing, or there is no room.
    fn subtree(
        &mut self,
        leaves: &mut [(u32, Aabb)],
        parent: Place,
        put: &mut impl FnMut(u32, Place),
    ) -> Option<Place> {
        if let [] | [_] = leaves {
            let &(number, around) = leaves.first()?;
            let leaf = self.take()?;
            self.nodes[leaf as usize] = Node { around, parent, children: [NOWHERE, number], height: 0 };
            put(number, leaf);
            return Some(leaf);
        }
        let twice_middle_W = |around: &Aabb| around.low_W + around.high_W;
        let first_W = twice_middle_W(&leaves[0].1);
        let all = leaves.iter().fold((first_W, first_W), |(low_W, high_W), (_, around)| {
            let middle_W = twice_middle_W(around);
            (low_W.inf(&middle_W), high_W.sup(&middle_W))
        });
        let axis = (all.1 - all.0).imax();
        let half = leaves.len() / 2;
        // Where several are at one place their numbers decide: everywhere the same tree.
        leaves.select_nth_unstable_by(half, |(one, a), (other, b)| {
            twice_middle_W(a)[axis].total_cmp(&twice_middle_W(b)[axis]).then(one.cmp(other))
        });
        let joint = self.take()?;
        let (low, high) = leaves.split_at_mut(half);
        let children = [self.subtree(low, joint, put)?, self.subtree(high, joint, put)?];
        self.nodes[joint as usize].children = children;
        self.nodes[joint as usize].parent = parent;
        self.refit(joint);
        Some(joint)
    }

    /// The box of a leaf.
    pub(crate) fn around(&self, leaf: Place) -> &Aabb {
        &self.nodes[leaf as usize].around
    }

    /// Puts a leaf in; `None` where there is no room.
    pub(crate) fn insert(&mut self, number: u32, around: Aabb) -> Option<Place> {
        let leaf = self.take()?;
        self.nodes[leaf as usize] = Node { around, parent: NOWHERE, children: [NOWHERE, number], height: 0 };
        if self.root == NOWHERE {
            self.root = leaf;
            return Some(leaf);
        }
        let Some(joint) = self.take() else {
            self.give_back(leaf);
            return None;
        };
        let sibling = self.cheapest_sibling(&around);
        let above = self.nodes[sibling as usize].parent;
        self.nodes[joint as usize] = Node {
            around: around.with(self.around(sibling)),
            parent: above,
            children: [sibling, leaf],
            height: self.nodes[sibling as usize].height + 1,
        };
        self.replace_child(above, sibling, joint);
        self.nodes[sibling as usize].parent = joint;
        self.nodes[leaf as usize].parent = joint;
        self.mend_upwards(above);
        Some(leaf)
    }

    /// Takes a leaf out.
    pub(crate) fn remove(&mut self, leaf: Place) {
        let joint = self.nodes[leaf as usize].parent;
        self.give_back(leaf);
        if joint == NOWHERE {
            self.root = NOWHERE;
            return;
        }
        let Node { parent: above, children, .. } = self.nodes[joint as usize];
        let sibling = if children[0] == leaf { children[1] } else { children[0] };
        self.nodes[sibling as usize].parent = above;
        self.replace_child(above, joint, sibling);
        self.give_back(joint);
        self.mend_upwards(above);
    }

    /// Visits the numbers of all leaves that overlap, in no order that means anything.
    pub(crate) fn visit(&self, around: &Aabb, mut found: impl FnMut(u32)) {
        let mut at = self.root;
        while at != NOWHERE {
            let node = &self.nodes[at as usize];
            if node.around.overlaps(around) {
                if node.height > 0 {
                    at = node.children[0];
                    continue;
                }
                found(node.children[1]);
            }
            at = self.next_branch(at);
        }
    }

    /// Where a walk goes on that has seen all below this node.
    fn next_branch(&self, mut at: Place) -> Place {
        loop {
            let above = self.nodes[at as usize].parent;
            if above == NOWHERE {
                return NOWHERE;
            }
            let [first, second] = self.nodes[above as usize].children;
            if at == first {
                return second;
            }
            at = above;
        }
    }

    /// Beside which node a box makes the boxes above it grow least.
    fn cheapest_sibling(&self, around: &Aabb) -> Place {
        let mut at = self.root;
        loop {
            let node = &self.nodes[at as usize];
            if node.height == 0 {
                return at;
            }
            let joined = node.around.with(around).cost();
            // All that is put below has this node's growth to pay as well.
            let grows = 2.0 * (joined - node.around.cost());
            let below = node.children.map(|child| {
                let child = &self.nodes[child as usize];
                let joined = child.around.with(around).cost();
                grows + if child.height == 0 { joined } else { joined - child.around.cost() }
            });
            if 2.0 * joined < below[0].min(below[1]) {
                return at;
            }
            at = node.children[usize::from(below[1] < below[0])];
        }
    }

    fn mend_upwards(&mut self, mut at: Place) {
        while at != NOWHERE {
            at = self.balanced(at);
            self.refit(at);
            at = self.nodes[at as usize].parent;
        }
    }

    fn refit(&mut self, at: Place) {
        let [first, second] = self.nodes[at as usize].children.map(|child| self.nodes[child as usize]);
        let node = &mut self.nodes[at as usize];
        node.around = first.around.with(&second.around);
        node.height = 1 + first.height.max(second.height);
    }

    /// Rotates the higher child of a node into its place, if it is higher by more than one; returns what is in its place then.
    fn balanced(&mut self, at: Place) -> Place {
        let children = self.nodes[at as usize].children;
        let [first, second] = children.map(|child| self.nodes[child as usize].height);
        if first.abs_diff(second) <= 1 {
            return at;
        }
        let side = usize::from(second > first);
        let up = children[side];
        let grandchildren = self.nodes[up as usize].children;
        let [one, other] = grandchildren.map(|child| self.nodes[child as usize].height);
        // The higher one stays below it.
        let stays = usize::from(other > one);
        let (kept, moved) = (grandchildren[stays], grandchildren[1 - stays]);
        let above = self.nodes[at as usize].parent;
        self.nodes[up as usize].children = [at, kept];
        self.nodes[up as usize].parent = above;
        self.replace_child(above, at, up);
        self.nodes[at as usize].parent = up;
        self.nodes[at as usize].children[side] = moved;
        self.nodes[moved as usize].parent = at;
        self.refit(at);
        up
    }

    fn replace_child(&mut self, above: Place, old: Place, new: Place) {
        match self.nodes.get_mut(above as usize) {
            Some(above) => above.children[usize::from(above.children[1] == old)] = new,
            None => self.root = new,
        }
    }

    fn take(&mut self) -> Option<Place> {
        let place = self.free;
        self.free = self.nodes.get(place as usize)?.parent;
        Some(place)
    }

    fn give_back(&mut self, place: Place) {
        self.nodes[place as usize].parent = self.free;
        self.free = place;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Height of what is below a node, with everything checked that should hold there.
    fn checked(tree: &Tree, at: Place, above: Place) -> u32 {
        let node = &tree.nodes[at as usize];
        assert_eq!(node.parent, above);
        if node.height == 0 {
            return 0;
        }
        let [first, second] = node.children.map(|child| checked(tree, child, at));
        assert!(first.abs_diff(second) <= 1, "balanced: {first} and {second}");
        assert!(node.children.iter().all(|child| node.around.contains(tree.around(*child))));
        assert_eq!(node.height, 1 + first.max(second));
        node.height
    }

    fn random(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (*seed >> 11) as f64 / (1u64 << 53) as f64
    }

    #[test]
    fn what_a_changing_tree_finds_is_what_overlaps() {
        let mut seed = 1;
        let mut tree = Tree::with_capacity(300);
        let mut leaves: Vec<Option<(Place, Aabb)>> = vec![None; 300];
        for round in 0..20_000 {
            let number = (random(&mut seed) * 300.0) as usize;
            let mut point = || Vector3::from_fn(|_, _| random(&mut seed));
            let around = Aabb::of_ball(&point(), 0.05).swept(&(point() * 0.1));
            match leaves[number].take() {
                Some((leaf, _)) => tree.remove(leaf),
                None => leaves[number] = Some((tree.insert(number as u32, around).expect("room"), around)),
            }
            if round % 100 == 0 && tree.root != NOWHERE {
                checked(&tree, tree.root, NOWHERE);
                let mut found = Vec::new();
                tree.visit(&around, |number| found.push(number as usize));
                found.sort_unstable();
                let overlaps =
                    |leaf: &Option<(Place, Aabb)>| leaf.is_some_and(|(_, own)| own.overlaps(&around));
                let expected: Vec<_> = (0..300).filter(|&number| overlaps(&leaves[number])).collect();
                assert_eq!(found, expected);
            }
        }
    }

    #[test]
    fn a_tree_that_is_filled_at_once_is_balanced_and_finds_what_overlaps() {
        let mut seed = 1;
        for count in [0, 1, 2, 3, 7, 100, 1000] {
            let mut boxes: Vec<(u32, Aabb)> = (0..count)
                .map(|number| {
                    // Some are where others are.
                    let at = Vector3::from_fn(|_, _| (10.0 * random(&mut seed)).round());
                    (number, Aabb::of_ball(&at, 0.7))
                })
                .collect();
            let sorted = boxes.clone();
            let mut tree = Tree::with_capacity(count as usize);
            let mut places = vec![NOWHERE; count as usize];
            tree.fill(&mut boxes, |number, place| places[number as usize] = place);
            if count > 0 {
                checked(&tree, tree.root, NOWHERE);
            }
            for (number, around) in &sorted {
                assert_eq!(tree.around(places[*number as usize]), around);
                let mut found = Vec::new();
                tree.visit(around, |number| found.push(number));
                found.sort_unstable();
                let expected = sorted.iter().filter(|(_, other)| other.overlaps(around));
                assert_eq!(found, expected.map(|(number, _)| *number).collect::<Vec<_>>());
            }
            // It goes on as any other.
            places.iter().rev().for_each(|place| tree.remove(*place));
            assert_eq!(tree.root, NOWHERE);
        }
    }

    #[test]
    fn a_full_tree_takes_nothing_more_and_an_empty_one_finds_nothing() {
        let around = Aabb::of_ball(&Vector3::zeros(), 1.0);
        let mut tree = Tree::with_capacity(2);
        tree.visit(&around, |_| panic!("nothing is there"));
        let first = tree.insert(7, around).expect("room");
        tree.insert(8, around).expect("room");
        assert_eq!(tree.insert(9, around), None);
        tree.remove(first);
        let mut found = Vec::new();
        tree.visit(&around, |number| found.push(number));
        assert_eq!(found, [8]);
        assert_eq!(Tree::with_capacity(0).insert(0, around), None);
    }
}
