//! Constructive solid geometry: solids made of closed forms by union, intersection and difference (Melder ch. 9.3).
//!
//! Problem: "a box with a bore and a rounded corner" is easily said and hard to tessellate. Raymaekers and Van Reeth
//! (2002) felt such trees without friction; Melder proposes a state machine with friction and leaves coplanar
//! boundaries, curved edges and corners open.
//!
//! Model: the leaves are taken apart into smooth [patches](patch), equal ones being one ([`flatten`]). Near any point only few
//! patches decide: a [`Neighbourhood`](near) lists them, at most eight, with the tree boiled down to a table of what is inside for
//! each of their 256 combinations of sides. With that table the operations are forgotten: a patch is a boundary
//! where crossing it changes the answer, a difference turns its second solid's normals by itself, and the seam between
//! two united parts, which the answer does not depend on, is no boundary. On these patches the god-object is walked
//! by [`walk`], its state being the patches that it rests on: one (a primitive of fig. 9.4), two (an edge) or more (a corner).
//! Where patches touch, as at each fillet, tangent planes do not tell them apart; there it tries out where it can go on
//! ([`detour`]).
//!
//! Frames and signs: object frame B; normals leave the material; the boundary belongs to the solid.
//! Cost: independent of the tree while the finger stays in its neighbourhood; a new one looks at the patches that the
//! [`cells`] have left of the tree there. In its clearing (see [`god`]) a god-object looks at what holds it only. No
//! recursion, no allocation.
//! Limits: of more than eight patches that meet in one point the eight nearest count. Parts thinner than
//! [`TOLERANCE`] times the solid's extent are not felt, and ledges lower than [`TIGHT`] times it hold nobody back.

mod advance;
mod cells;
mod corner;
mod crossings;
mod crowd;
mod csg_cone;
mod curved;
mod detour;
mod endless;
mod facets;
mod feet;
mod flatten;
mod foresight;
mod gather;
mod god;
mod hit;
mod kind;
mod near;
mod patch;
mod pressed_through;
mod rolling;
mod settle;
mod stand;
mod table;
mod tree;
mod walk;
mod way_out;

pub(crate) use csg_cone::CsgCone;
pub use facets::Facets;
pub(crate) use rolling::BallOnCsg;
pub use tree::{CsgError, CsgOp, CsgPart, CsgTree, MAX_DEPTH, MAX_LEAVES, PartShape};

use std::sync::atomic::{AtomicU64, Ordering};

use nalgebra::Vector3;

use cells::Cells;
use endless::Reach;
use flatten::Flat;
use patch::Patch;

/// A solid made of closed forms.
#[derive(Debug)]
pub struct Csg {
    /// Different from each other.
    patches: Box<[Patch]>,
    /// Of the leaves, which refer to them by number.
    items: Box<[Item]>,
    /// The tree in postfix order: no recursion is needed to evaluate it.
    steps: Box<[Step]>,
    /// The same, by place.
    cells: Cells,
    extent_m: f64,
    /// Nothing of it has a coordinate larger than that.
    has_end: bool,
    /// Of all solids that this process has built, which.
    identity: u64,
}

/// A leaf's half-space: a patch, or what a patch leaves out.
#[derive(Debug, Clone, Copy)]
struct Item {
    patch: u16,
    is_flipped: bool,
}

/// What an evaluation does next to its stack.
#[derive(Debug, Clone, Copy)]
enum Step {
    /// Pushes a leaf, which is the intersection of some items within a ball.
    Leaf { centre_B: Vector3<f64>, radius_m: f64, first: u32, count: u32 },
    /// Joins the two on top.
    Join(CsgOp),
}

impl Csg {
    /// A solid from its description.
    ///
    /// Errors: a tree without parts, too large or too deep, a pose or scale that is not finite, a leaf that is no
    /// simple form.
    pub fn build(tree: &CsgTree) -> Result<Self, CsgError> {
        let solid = Self::of(flatten::flatten(tree, 0.0)?);
        // Of planes alone nobody knows before how far they reach.
        let Reach { farthest_m, has_end } = solid.reach();
        let solid =
            if farthest_m > solid.extent_m { Self::of(flatten::flatten(tree, farthest_m)?) } else { solid };
        Ok(Self { has_end, ..solid })
    }

    fn of(flat: Flat) -> Self {
        let Flat { patches, items, steps, extent_m } = flat;
        let identity = BUILT.fetch_add(1, Ordering::Relaxed);
        let cells = Cells::build(&patches, &items, &steps, extent_m);
        Self { patches, items, steps, cells, extent_m, has_end: false, identity }
    }

    /// A bound of the distance to the boundary, negative inside; exact in sign and zero, and never larger than the
    /// distance itself (m).
    pub fn signed_distance(&self, point_B: &Vector3<f64>) -> f64 {
        let mut stack = [0.0; STACK];
        let mut top = 0;
        for step in &self.steps {
            match *step {
                Step::Leaf { centre_B, radius_m, first, count } => {
                    stack[top] = self.leaf_level(point_B, &centre_B, radius_m, first, count);
                    top += 1;
                }
                Step::Join(op) => {
                    let (a, b) = (stack[top - 2], stack[top - 1]);
                    stack[top - 2] = match op {
                        CsgOp::Union => a.min(b),
                        CsgOp::Intersection => a.max(b),
                        CsgOp::Difference => a.max(-b),
                    };
                    top -= 1;
                }
            }
        }
        stack[0]
    }

    fn leaf_level(
        &self,
        point_B: &Vector3<f64>,
        centre_B: &Vector3<f64>,
        radius_m: f64,
        first: u32,
        count: u32,
    ) -> f64 {
        if radius_m < f64::INFINITY {
            let outside_m = (point_B - centre_B).norm() - radius_m;
            if outside_m > FAR * radius_m {
                return outside_m;
            }
        }
        let items = &self.items[first as usize..(first + count) as usize];
        items.iter().fold(f64::NEG_INFINITY, |farthest, item| {
            let level = self.patches[usize::from(item.patch)].level(point_B);
            farthest.max(if item.is_flipped { -level } else { level })
        })
    }

    /// Whether a point belongs to the solid; its boundary does.
    pub fn is_inside(&self, point_B: &Vector3<f64>) -> bool {
        self.signed_distance(point_B) <= 0.0
    }

    /// How many smooth surfaces it is made of.
    pub fn patch_count(&self) -> usize {
        self.patches.len()
    }

    /// Largest coordinate of its bounded leaves, without its sign (m): what rounding errors are measured by.
    pub fn extent_m(&self) -> f64 {
        self.extent_m
    }

    /// True if nothing of it has a coordinate larger than [`Self::extent_m`]; of planes that seem to go on for ever false.
    pub fn has_end(&self) -> bool {
        self.has_end
    }

    /// Nearer to a patch than this is on it (m).
    fn tolerance_m(&self) -> f64 {
        TOLERANCE * self.extent_m
    }

    /// Where tangent planes do not tell, patches nearer to the god-object count as meeting there (m).
    fn tight_m(&self) -> f64 {
        TIGHT * self.extent_m
    }

    /// How far a god-object looks for a way over what is too low to be a ledge (m).
    fn ledge_m(&self) -> f64 {
        100.0 * self.tight_m()
    }
}

/// Nearer to a patch than this share of the extent is on it: a hundred times what iterating onto patches that meet under
/// ordinary angles leaves.
const TOLERANCE: f64 = 1e-12;
/// Ledges lower than this share of the extent hold nobody back: 10 nm on a solid of 0.1 m, far more than rounding makes of
/// surfaces that were meant to touch, and far less than can be felt.
const TIGHT: f64 = 1e-7;
/// Farther from a leaf's ball than this share of its radius, the ball stands for the leaf.
const FAR: f64 = 0.5;
/// Of an evaluation: a tree needs one place more than it is deep.
const STACK: usize = MAX_DEPTH + 2;

static BUILT: AtomicU64 = AtomicU64::new(0);
