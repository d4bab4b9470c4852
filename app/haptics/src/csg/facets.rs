//! Facets of a solid: flat triangles on its boundary, for those who draw or measure it.
//!
//! Problem: walls and plates are thin, bores small and parts far from each other; a grid fine enough for all of them would have
//! millions of cells.
//! Model: the boundary lies on the leaves' patches. Each leaf's are taken as flat [`outline`]s, which are [`cut`] where others
//! decide; what is left of them is boundary whatever is thin. Edges along which two patches meet get the corners of both
//! ([`seam`]). What reaches beyond a cube around all bounded parts, and the corners of those without an end, is cut off there.
//! Accuracy: corners lie on the boundary, those of edges within what a chord misses of its arc: with [`FINEST`] steps around,
//! 0.12 % of the radius. Flat surfaces with straight edges are exact.
//! Where they are coarser, rings have more steps around and fewer around the tube, so that both miss as much (m).
//! Frames: object frame B. Cost: bounded by [`MOST_LOOKS`] and [`MOST_TRIANGLES`], where it is too much with coarser steps; a few
//! milliseconds of a dozen leaves.

mod cut;
mod outline;
mod polygon;
mod seam;

use std::collections::HashMap;

use nalgebra::Vector3;

use self::cut::{Cutter, Piece};
use self::outline::outline;
use super::cells::OfTree;
use super::patch::Patch;
use super::{Csg, CsgOp, Item};

/// Triangles on a solid's boundary.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Facets {
    /// Corners in the object's frame B (m).
    pub places: Vec<Vector3<f64>>,
    /// Normals of the boundary at each of them, out of the solid; unit length.
    pub normals: Vec<Vector3<f64>>,
    /// Three corners of each triangle, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Csg {
    /// Triangles on its boundary; what of it reaches beyond its bounded parts and its corners is cut off there.
    pub fn facets(&self) -> Facets {
        let solid = Solid::of(self);
        for around in STEPS_AROUND {
            if let Some(pieces) = solid.pieces(around)
                && triangles(&pieces) <= MOST_TRIANGLES
            {
                return solid.facets(&pieces);
            }
        }
        let Coarse { pieces, around, looks } = solid.coarse_pieces();
        // What the coarsest steps leave of both bounds makes finer ones.
        let finer = if around > COARSEST { solid.pieces_within(around, looks) } else { None };
        let finer = finer.filter(|finer| triangles(finer) <= MOST_TRIANGLES);
        solid.facets(&finer.unwrap_or(pieces))
    }
}

fn triangles(pieces: &[Piece]) -> usize {
    pieces.iter().map(|piece| piece.polygon.corners.len() - 2).sum()
}

/// A solid within a cube.
struct Solid {
    patches: Vec<Patch>,
    items: Vec<Item>,
    steps: Vec<Step>,
    /// Around each leaf, or its part in the cube.
    balls: Vec<(Vector3<f64>, f64)>,
    /// Of each patch, the size of the largest leaf that has it (m).
    sizes_m: Vec<f64>,
    /// Nearer to a patch than this is on it (m).
    on_m: f64,
}

/// Pieces with the coarsest steps.
struct Coarse {
    pieces: Vec<Piece>,
    /// With so many there would be as much as there may be.
    around: usize,
    /// Levels that may still be looked at.
    looks: usize,
}

/// Step of an evaluation with a stack.
#[derive(Debug, Clone, Copy)]
enum Step {
    /// Pushes a leaf, the intersection of these items; of none, everything.
    Leaf { leaf: u16, first: u32, count: u32 },
    /// Joins the two on top.
    Join(CsgOp),
}

impl OfTree for Step {
    const EVERYTHING: Self = Self::Leaf { leaf: 0, first: 0, count: 0 };

    fn join(op: CsgOp) -> Self {
        Self::Join(op)
    }
}

impl Solid {
    fn of(csg: &Csg) -> Self {
        let half_m = REACH * csg.extent_m;
        let around_cube = (Vector3::zeros(), half_m * 3f64.sqrt());
        let (mut balls, mut steps) = (Vec::new(), Vec::new());
        for step in &csg.steps {
            steps.push(match *step {
                super::Step::Leaf { centre_B, radius_m, first, count } => {
                    balls.push(if radius_m < f64::INFINITY { (centre_B, radius_m) } else { around_cube });
                    Step::Leaf { leaf: balls.len() as u16 - 1, first, count }
                }
                super::Step::Join(op) => Step::Join(op),
            });
        }
        let (mut patches, mut items) = (csg.patches.to_vec(), csg.items.to_vec());
        let first = items.len() as u32;
        for axis in 0..3 {
            for side in [1.0, -1.0] {
                items.push(Item { patch: patches.len() as u16, is_flipped: false });
                patches.push(Patch::Plane { normal_B: Vector3::ith(axis, side), offset_m: half_m });
            }
        }
        steps.extend([
            Step::Leaf { leaf: balls.len() as u16, first, count: 6 },
            Step::Join(CsgOp::Intersection),
        ]);
        balls.push(around_cube);
        let mut solid =
            Self { sizes_m: vec![0.0; patches.len()], patches, items, steps, balls, on_m: ON * half_m };
        for leaf in 0..solid.balls.len() {
            let (_, radius_m) = solid.balls[leaf];
            for patch in solid.leaf_items(leaf).iter().map(|item| usize::from(item.patch)).collect::<Vec<_>>()
            {
                solid.sizes_m[patch] = solid.sizes_m[patch].max(radius_m);
            }
        }
        solid
    }

    fn leaf_items(&self, leaf: usize) -> &[Item] {
        let is_it =
            |step: &&Step| matches!(step, Step::Leaf { leaf: other, .. } if usize::from(*other) == leaf);
        match self.steps.iter().find(is_it) {
            Some(Step::Leaf { first, count, .. }) => &self.items[*first as usize..(first + count) as usize],
            _ => &[],
        }
    }

    /// Of a leaf, all but one patch.
    fn others(&self, leaf: usize, patch: u16) -> Vec<Item> {
        self.leaf_items(leaf).iter().copied().filter(|item| item.patch != patch).collect()
    }

    /// Of the leaves before one that have a patch, all but that.
    fn leaves_with(&self, patch: u16, before: usize) -> Vec<Vec<Item>> {
        let has = |&leaf: &usize| self.leaf_items(leaf).iter().any(|item| item.patch == patch);
        (0..before).filter(has).map(|leaf| self.others(leaf, patch)).collect()
    }

    /// Pieces of the boundary with so many steps around what is curved; `None`: it takes too long.
    fn pieces(&self, around: usize) -> Option<Vec<Piece>> {
        self.pieces_within(around, MOST_LOOKS)
    }

    fn pieces_within(&self, around: usize, looks: usize) -> Option<Vec<Piece>> {
        let mut cutter = Cutter::new(self, around, looks);
        self.cut(&mut cutter, around, |cutter| !cutter.is_short).then(|| self.sewn(cutter.pieces))
    }

    /// As far as it does not take too long; from there on pieces are not cut.
    fn coarse_pieces(&self) -> Coarse {
        let mut cutter = Cutter::new(self, COARSEST, MOST_COARSE_LOOKS);
        self.cut(&mut cutter, COARSEST, |_| true);
        let looks = cutter.looks();
        let pieces = self.sewn(cutter.pieces);
        let times = |most: usize, of: usize| most as f64 / of.max(1) as f64;
        let times = times(looks, MOST_COARSE_LOOKS - looks).min(times(MOST_TRIANGLES, triangles(&pieces)));
        // Both grow with the square; half as many go from pole to pole.
        let around = COARSEST as f64 * (SPARE * times).sqrt();
        Coarse { pieces, around: (around as usize).min(FINEST) & !1, looks }
    }

    /// Cuts all faces of all leaves; false: it was told to stop.
    fn cut(&self, cutter: &mut Cutter<'_>, around: usize, goes_on: impl Fn(&Cutter<'_>) -> bool) -> bool {
        self.balls.iter().enumerate().all(|(leaf, (centre_B, radius_m))| {
            self.leaf_items(leaf).iter().all(|item| {
                let patch = &self.patches[usize::from(item.patch)];
                cutter.leaf_face(leaf, item.patch, outline(patch, centre_B, *radius_m, around));
                goes_on(cutter)
            })
        })
    }

    fn sewn(&self, mut pieces: Vec<Piece>) -> Vec<Piece> {
        seam::sew(&mut pieces, |seam| !seam.iter().all(|patch| self.patches[usize::from(*patch)].is_plane()));
        pieces
    }

    fn facets(&self, pieces: &[Piece]) -> Facets {
        let (mut made, mut known) = (Facets::default(), HashMap::new());
        for Piece { polygon, patch: number, is_flipped } in pieces {
            let (patch, middle) = (&self.patches[usize::from(*number)], polygon.middle());
            let sign = if *is_flipped { -1.0 } else { 1.0 };
            let mut around = Vec::with_capacity(polygon.corners.len());
            for corner in &polygon.corners {
                let place = corner.place;
                // Where many normals are as good, as at the tip of a cone, that of the piece is meant.
                let normal = sign * patch.look(&(place + ASIDE * (middle - place)), &middle).normal_B;
                let key = (*number, place.map(f64::to_bits), normal.map(|x| (x * ALIKE).round() as i32));
                around.push(*known.entry(key).or_insert_with(|| {
                    made.places.push(place);
                    made.normals.push(normal);
                    made.places.len() as u32 - 1
                }));
            }
            let outward = sign * patch.look(&middle, &middle).normal_B;
            if polygon.area().dot(&outward) < 0.0 {
                around.reverse();
            }
            made.triangles.extend(fan(&made.places, &around, &outward));
        }
        made
    }
}

/// Triangles of a polygon that is nearly flat and convex: from the corner from which the smallest one is largest.
fn fan<'a>(
    places: &[Vector3<f64>],
    around: &'a [u32],
    outward: &Vector3<f64>,
) -> impl Iterator<Item = [u32; 3]> + 'a {
    let place = |corner: usize| places[around[corner % around.len()] as usize];
    let area = |first: usize, k: usize| {
        let [a, b, c] = [first, first + k, first + k + 1].map(place);
        (b - a).cross(&(c - a)).dot(outward)
    };
    let count = around.len();
    let least = |first: &usize| (1..count - 1).map(|k| area(*first, k)).fold(f64::INFINITY, f64::min);
    let first = (0..count).max_by(|a, b| least(a).total_cmp(&least(b))).unwrap_or(0);
    (1..count - 1).map(move |k| [first, first + k, first + k + 1].map(|corner| around[corner % count]))
}

/// Steps around curved surfaces: the first that are not too many are taken.
const STEPS_AROUND: [usize; 4] = [FINEST, 40, 24, COARSEST];
/// Steps around what is curved.
const FINEST: usize = 64;
/// Fewer make no ball.
const COARSEST: usize = 12;
/// Of what there may be, what is asked for: cuts along curves do not grow with the square.
const SPARE: f64 = 0.95;
/// Of the extent: half the cube that holds all bounded parts; a cube that is not round numbers meets no face edge-on.
const REACH: f64 = 1.0173;
/// Of the extent: nearer surfaces are one (as in [`flatten`](super::flatten)).
const ON: f64 = 1e-11;
/// Triangles are no more, unless the coarsest steps make more.
const MOST_TRIANGLES: usize = 48_000;
/// Levels of patches that are looked at: about a tenth of a second.
const MOST_LOOKS: usize = 1_500_000;
/// The same with the coarsest steps, for hundreds of leaves: up to three seconds.
const MOST_COARSE_LOOKS: usize = 60_000_000;
/// Of the way to a piece's middle, from where its corners' normals are seen.
const ASIDE: f64 = 1e-6;
/// Of unit normals: more alike ones are one.
const ALIKE: f64 = 1e4;
