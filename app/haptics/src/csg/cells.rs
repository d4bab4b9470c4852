//! What of a tree is left in each part of space.
//!
//! Problem: near any point only a few patches decide, but to find them in a tree of a hundred leaves, each had to be asked.
//!
//! Model: an octree over the cube that holds what is bounded of the solid. For each of its cells the tree is pruned once,
//! when the solid is built: a leaf that is nowhere within the cell's reach is gone, one that is everywhere has made its
//! join superfluous, and of the others only the patches are left that may matter. Cells are split until little is left.
//!
//! Frames: object frame B. Invariants: within [`REACH`] half edges around a cell, in balls around any point of it, its
//! part of the tree says what the whole says. The first cell is the whole tree and reaches everywhere.
//! Cost: a comparison or three for each level; building, time and memory in proportion to the boundary's area in cells.

use nalgebra::Vector3;

use super::patch::Patch;
use super::{CsgOp, Item, Step};

/// The tree's parts by place.
#[derive(Debug)]
pub(super) struct Cells {
    cells: Box<[Cell]>,
    steps: Box<[CellStep]>,
    items: Box<[Item]>,
    /// Half the edge of the cube around the origin.
    half_m: f64,
}

#[derive(Debug, Clone, Copy)]
struct Cell {
    /// The first of its eight children, or zero.
    children: u32,
    first: u32,
    count: u32,
    /// Patches of its leaves, all together.
    items: u32,
}

/// What an evaluation in a cell does next to its stack.
#[derive(Debug, Clone, Copy)]
pub(super) enum CellStep {
    /// Pushes a leaf, the intersection of these items; of none, everything.
    Leaf { first: u32, count: u32 },
    /// Joins the two on top.
    Join(CsgOp),
}

/// A part of the tree, in postfix order; without steps there is nothing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part<'c> {
    pub(super) steps: &'c [CellStep],
    items: &'c [Item],
    /// It is true in balls of up to this radius around the point that it was asked for.
    pub(super) reach_m: f64,
}

impl<'c> Part<'c> {
    pub(super) fn items(&self, first: u32, count: u32) -> &'c [Item] {
        &self.items[first as usize..(first + count) as usize]
    }
}

impl Cells {
    pub(super) fn build(patches: &[Patch], items: &[Item], steps: &[Step], extent_m: f64) -> Self {
        // Coarser where all of it would be too much.
        let build = |levels| Building::of_levels(levels, patches, items, steps, extent_m);
        let whole = || Building::of_whole(patches, items, steps);
        let Building { cells, steps, items, .. } =
            (1..=MAX_DEPTH).rev().find_map(build).unwrap_or_else(whole);
        Self { cells: cells.into(), steps: steps.into(), items: items.into(), half_m: extent_m }
    }

    /// The part that serves a ball of this radius around a point; a smaller ball, if that one's has more than `crowd` patches.
    #[inline(always)]
    pub(super) fn part(&self, point_B: &Vector3<f64>, radius_m: f64, crowd: u32) -> Part<'_> {
        let mut cell = &self.cells[0];
        let (mut centre_B, mut half_m, mut reach_m) = (Vector3::zeros(), self.half_m, f64::INFINITY);
        if point_B.amax() <= half_m {
            while cell.children != 0 && (radius_m <= REACH * 0.5 * half_m || cell.items > crowd) {
                half_m *= 0.5;
                let (octant, centre) = octant(point_B, &centre_B, half_m);
                (cell, centre_B, reach_m) =
                    (&self.cells[cell.children as usize + octant], centre, REACH * half_m);
            }
        }
        let steps = &self.steps[cell.first as usize..(cell.first + cell.count) as usize];
        Part { steps, items: &self.items, reach_m }
    }
}

/// Which eighth of a cell a point is in, and its centre; `half_m` is half the edge of the eighth.
#[inline(always)]
fn octant(point_B: &Vector3<f64>, centre_B: &Vector3<f64>, half_m: f64) -> (usize, Vector3<f64>) {
    let is_above: [bool; 3] = std::array::from_fn(|axis| point_B[axis] > centre_B[axis]);
    let index = usize::from(is_above[0]) | usize::from(is_above[1]) << 1 | usize::from(is_above[2]) << 2;
    (index, centre_B + Vector3::from(is_above.map(|above| if above { half_m } else { -half_m })))
}

struct Building<'p> {
    patches: &'p [Patch],
    /// Levels below the whole.
    levels: u32,
    /// Levels of patches that may still be looked at.
    looks: usize,
    cells: Vec<Cell>,
    steps: Vec<CellStep>,
    items: Vec<Item>,
}

/// Remainder of a part of the tree in some part of space.
pub(super) enum Left<S> {
    Nothing,
    Everything,
    Some(Vec<S>),
}

/// A step of an evaluation.
pub(super) trait OfTree: Copy {
    /// A leaf that is everywhere.
    const EVERYTHING: Self;
    /// Joins the two on top.
    fn join(op: CsgOp) -> Self;
}

impl OfTree for CellStep {
    const EVERYTHING: Self = Self::Leaf { first: 0, count: 0 };

    fn join(op: CsgOp) -> Self {
        Self::Join(op)
    }
}

impl<'p> Building<'p> {
    /// One cell, which is everywhere.
    fn of_whole(patches: &'p [Patch], items: &[Item], steps: &[Step]) -> Self {
        let cell = Cell { children: 0, first: 0, count: steps.len() as u32, items: items.len() as u32 };
        let steps = steps.iter().map(|step| match *step {
            Step::Leaf { first, count, .. } => CellStep::Leaf { first, count },
            Step::Join(op) => CellStep::Join(op),
        });
        let (steps, items) = (steps.collect(), items.to_vec());
        Self { patches, levels: 0, looks: MOST_LOOKS, cells: vec![cell], steps, items }
    }

    /// Cells of so many levels; `None`: that would be too much.
    fn of_levels(
        levels: u32,
        patches: &'p [Patch],
        items: &[Item],
        steps: &[Step],
        extent_m: f64,
    ) -> Option<Self> {
        let mut building = Self { levels, ..Self::of_whole(patches, items, steps) };
        building.split(0, &Vector3::zeros(), extent_m, 0)?;
        Some(building)
    }

    fn split(&mut self, index: usize, centre_B: &Vector3<f64>, half_m: f64, depth: u32) -> Option<()> {
        let cell = self.cells[index];
        if depth == self.levels || cell.items <= FEW {
            return Some(());
        }
        self.looks = self.looks.checked_sub(8 * (cell.items + cell.count) as usize)?;
        let children = self.cells.len();
        self.cells[index].children = children as u32;
        let half_m = 0.5 * half_m;
        let centre = |octant: usize| {
            let side = |axis: usize| if octant >> axis & 1 == 1 { half_m } else { -half_m };
            centre_B + Vector3::new(side(0), side(1), side(2))
        };
        for octant in 0..8 {
            let child = self.prune(cell, &centre(octant), half_m);
            self.cells.push(child);
        }
        for octant in 0..8 {
            self.split(children + octant, &centre(octant), half_m, depth + 1)?;
        }
        Some(())
    }

    /// What of a cell is left in one of its eighths.
    fn prune(&mut self, parent: Cell, centre_B: &Vector3<f64>, half_m: f64) -> Cell {
        let radius_m = (3f64.sqrt() + REACH) * half_m * JUST_ABOVE;
        let items_before = self.items.len();
        let mut stack = Vec::new();
        for index in parent.first..parent.first + parent.count {
            let left = match self.steps[index as usize] {
                CellStep::Leaf { first, count } => self.leaf(first, count, centre_B, radius_m),
                CellStep::Join(op) => {
                    let (b, a) = (stack.pop(), stack.pop());
                    join(op, a.unwrap_or(Left::Nothing), b.unwrap_or(Left::Nothing))
                }
            };
            stack.push(left);
        }
        let steps = match stack.pop().unwrap_or(Left::Nothing) {
            Left::Nothing => Vec::new(),
            Left::Everything => vec![CellStep::EVERYTHING],
            Left::Some(steps) => steps,
        };
        let first = self.steps.len() as u32;
        let of_step = |step: &CellStep| if let CellStep::Leaf { count, .. } = step { *count } else { 0 };
        let items = steps.iter().map(of_step).sum();
        if items == 0 {
            self.items.truncate(items_before);
        }
        self.steps.extend(&steps);
        Cell { children: 0, first, count: steps.len() as u32, items }
    }

    fn leaf(&mut self, first: u32, count: u32, centre_B: &Vector3<f64>, radius_m: f64) -> Left<CellStep> {
        let start = self.items.len();
        for index in first..first + count {
            let item = self.items[index as usize];
            let level = self.patches[usize::from(item.patch)].level(centre_B);
            let level = if item.is_flipped { -level } else { level };
            if level > radius_m {
                self.items.truncate(start);
                return Left::Nothing;
            }
            if level >= -radius_m {
                self.items.push(item);
            }
        }
        match (self.items.len() - start) as u32 {
            0 => Left::Everything,
            count => Left::Some(vec![CellStep::Leaf { first: start as u32, count }]),
        }
    }
}

/// Remainder of two that are joined.
pub(super) fn join<S: OfTree>(op: CsgOp, a: Left<S>, b: Left<S>) -> Left<S> {
    use Left::{Everything, Nothing, Some};
    match (op, a, b) {
        (CsgOp::Union, Nothing, left) | (CsgOp::Union, left, Nothing) => left,
        (CsgOp::Union, Everything, _) | (CsgOp::Union, _, Everything) => Everything,
        (CsgOp::Intersection, Nothing, _) | (CsgOp::Intersection, _, Nothing) => Nothing,
        (CsgOp::Intersection, Everything, left) | (CsgOp::Intersection, left, Everything) => left,
        (CsgOp::Difference, Nothing, _) | (CsgOp::Difference, _, Everything) => Nothing,
        (CsgOp::Difference, left, Nothing) => left,
        (CsgOp::Difference, Everything, Some(b)) => both(op, vec![S::EVERYTHING], b),
        (op, Some(a), Some(b)) => both(op, a, b),
    }
}

fn both<S: OfTree>(op: CsgOp, mut a: Vec<S>, b: Vec<S>) -> Left<S> {
    a.extend(b);
    a.push(S::join(op));
    Left::Some(a)
}

/// How far around a cell its part of the tree serves, in half edges.
const REACH: f64 = 1.0;
/// Levels below the whole: the smallest cells reach farther than a common neighbourhood.
const MAX_DEPTH: u32 = 5;
/// Of patches and steps, in all cells: eleven boxes that are near everywhere stay below it with all levels, a hundred shells
/// within shells do not.
const MOST_LOOKS: usize = 4_000_000;
/// Cells with no more patches than this are not split.
const FEW: u32 = 4;
/// So that rounding prunes nothing that matters.
const JUST_ABOVE: f64 = 1.0 + 1e-9;

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::super::near::Neighbourhood;
    use super::super::{Csg, CsgPart, CsgTree};
    use super::*;
    use crate::cuboid::Cuboid;
    use crate::cylinder::Cylinder;
    use crate::plane::Plane;
    use crate::sphere::Sphere;

    fn ball(radius_m: f64) -> CsgPart {
        Sphere::new(radius_m).unwrap().into()
    }

    fn bricks() -> CsgPart {
        let brick = Cuboid::new([0.012, 0.015, 0.018]).unwrap();
        let grid = (0..27).map(|i| {
            let place = Vector3::new(f64::from(i % 3), f64::from(i / 3 % 3), f64::from(i / 9)) * 0.02;
            CsgPart::at(brick, place - Vector3::repeat(0.02))
        });
        CsgTree::union(grid).into()
    }

    /// In all of them some places are far from one operand of an operation, or deep within it.
    fn solids() -> [CsgTree; 5] {
        let tilted = Isometry3::rotation(Vector3::new(0.3, 0.4, 0.5));
        let rod = CsgPart::new(Cylinder::new(0.008, 0.09).unwrap(), tilted);
        let below = CsgPart::from(Plane::new(Vector3::new(0.6, 0.8, 0.0), 0.005).unwrap());
        [
            CsgTree::difference([bricks(), ball(0.02)]),
            CsgTree::intersection([bricks(), ball(0.025), below.clone()]),
            CsgTree::difference([ball(0.035), bricks()]),
            CsgTree::difference([below, CsgTree::intersection([ball(0.03), bricks()]).into(), rod.clone()]),
            CsgTree::union([CsgTree::difference([rod, bricks()]).into(), ball(0.004)]),
        ]
    }

    fn spread(i: u32) -> Vector3<f64> {
        let along = |step: f64| 2.0 * (f64::from(i) * step).fract() - 1.0;
        Vector3::new(along(0.618_034), along(0.414_214), along(0.732_051))
    }

    #[test]
    fn what_is_left_in_a_cell_says_what_the_whole_tree_says() {
        for tree in solids() {
            let csg = Csg::build(&tree).unwrap();
            let mut answers = [0; 2];
            for i in 0..4000 {
                // Some of them beyond the cells.
                let anchor = spread(i) * 0.06;
                let wish_m = [1e-4, 1e-3, 4e-3, 0.05][i as usize % 4];
                for near in
                    [Neighbourhood::around(&csg, &anchor, wish_m), Neighbourhood::amid(&csg, &anchor, wish_m)]
                {
                    for j in 0..20 {
                        let p = anchor + spread(7 * i + j) * (near.radius_m / 3f64.sqrt());
                        let is_inside = csg.is_inside(&p);
                        assert_eq!(near.is_solid(near.sides(&csg, &p)), is_inside, "{p:?} {near:?}");
                        answers[usize::from(is_inside)] += 1;
                    }
                }
            }
            assert!(answers.iter().all(|&count| count > 500), "{answers:?}");
        }
    }

    /// Shells within shells, so that everything is near to many of them.
    fn onion(shells: u32) -> CsgTree {
        let shell = |i: u32| {
            let radius_m = f64::from(shells - i) / f64::from(shells);
            CsgTree::difference([ball(radius_m), ball(radius_m - 0.3 / f64::from(shells))]).into()
        };
        CsgTree::union((0..shells).map(shell).collect::<Vec<CsgPart>>())
    }

    #[test]
    fn a_solid_whose_leaves_are_near_everywhere_has_coarser_cells_and_bounded_work() {
        let deepest = |tree: &CsgTree| {
            let Csg { patches, items, steps, extent_m, .. } = Csg::build(tree).unwrap();
            let of_levels = |levels: &u32| Building::of_levels(*levels, &patches, &items, &steps, extent_m);
            let levels = (1..=MAX_DEPTH).rev().find(|levels| of_levels(levels).is_some());
            (levels, of_levels(&levels.unwrap_or(1)).map(|building| MOST_LOOKS - building.looks))
        };
        for tree in solids() {
            let (levels, looks) = deepest(&tree);
            assert_eq!(levels, Some(MAX_DEPTH), "{looks:?} looks");
        }
        let (levels, looks) = deepest(&onion(128));
        assert!(levels < Some(MAX_DEPTH), "{levels:?}, {looks:?} looks");
        // What is found there is still the same.
        let csg = Csg::build(&onion(128)).unwrap();
        for i in 0..1000 {
            let p = spread(i) * 0.5;
            let near = Neighbourhood::around(&csg, &p, 1e-4);
            assert_eq!(near.is_solid(near.sides(&csg, &p)), csg.is_inside(&p), "{p:?}");
        }
    }

    #[test]
    fn leaves_that_are_far_are_not_looked_at() {
        let [tree, ..] = solids();
        let csg = Csg::build(&tree).unwrap();
        let patches = |x: f64, y: f64, z: f64| {
            let part = csg.cells.part(&Vector3::new(x, y, z), 1e-3, u32::MAX);
            let count = |step: &CellStep| if let CellStep::Leaf { count, .. } = step { *count } else { 0 };
            part.steps.iter().map(count).sum::<u32>()
        };
        assert_eq!(csg.items.len(), 27 * 6 + 1);
        // In the air; on the face of a brick; deep in what the ball took away; between ball and bricks. Cells with few
        // patches are not split, whatever they are.
        assert!(patches(0.0, 0.032, 0.0) <= FEW);
        assert!((1..=6).contains(&patches(0.02, 0.0275, 0.02)));
        assert!(patches(0.0, 0.001, 0.0) <= FEW);
        assert!((1..=13).contains(&patches(0.02, 0.001, 0.001)));
    }

    /// Patches and steps that were looked at for the cells that there are.
    fn looks(cells: &Cells) -> usize {
        let split = cells.cells.iter().filter(|cell| cell.children != 0);
        split.map(|cell| 8 * (cell.items + cell.count) as usize).sum()
    }

    /// Boxes, each ten times as long and thin as the one before, across each other.
    fn needles() -> CsgTree {
        let needle = |i: i32| {
            let (long_m, thin_m) = (1e5 * 10f64.powi(-i), 1e-5 * 10f64.powi(i));
            CsgPart::at(Cuboid::new([thin_m, long_m, 1.0]).unwrap(), Vector3::x() * (1e-5 * f64::from(i)))
        };
        CsgTree::union((0..11).map(needle))
    }

    #[test]
    fn cells_of_extreme_solids_are_made_with_a_bounded_number_of_looks() {
        let built = |tree: &CsgTree| {
            let csg = Csg::build(tree).unwrap();
            (looks(&csg.cells), csg.cells.cells.len())
        };
        // 66 sides and 21 steps, eight times in each of 4681 cells, if each were near everywhere; none is.
        let (looks, cells) = built(&needles());
        println!("needles: {looks} looks, {cells} cells");
        assert!((1..8 * 4681 * (66 + 21) / 10).contains(&looks), "{looks} looks for {cells} cells");
        // A tree that would take more has fewer levels, and is left whole at the worst.
        for shells in [32, 64, 100, 128] {
            let (looks, cells) = built(&onion(shells));
            println!("{shells} shells: {looks} looks, {cells} cells");
            assert!(looks <= 4_000_000, "{shells} shells: {looks} looks for {cells} cells");
        }
    }
}
