//! Pieces of a patch, cut where other patches decide what is boundary.
//!
//! Model: on a piece of a patch the tree is pruned to what is not the same all over the piece. If only the patch itself is
//! left, crossing it is going in or out everywhere on the piece, or nowhere. Else the piece is cut: exactly along planes, along
//! curved patches once it is small enough for their bend, and until then it is halved. Halves that turn out to be alike are
//! put together again, so that pieces are small only where something curved goes through.
//! Of patches with different numbers that lie upon each other, as a ball in the end of a capsule, crossing one is crossing all.
//! Invariant: of leaves that share a patch the first one has what lies on several, of patches upon each other that of the lowest
//! number; no piece is there twice.
//! Cost: bounded by [`Cutter::looks`].

use nalgebra::Vector3;

use super::super::cells::{Left, join};
use super::super::patch::Patch;
use super::super::{CsgOp, Item};
use super::polygon::{Polygon, UNCUT};
use super::{Solid, Step};

/// A piece of the boundary.
#[derive(Debug)]
pub(super) struct Piece {
    pub(super) polygon: Polygon,
    pub(super) patch: u16,
    /// True if the solid is where the patch says that outside is.
    pub(super) is_flipped: bool,
}

/// Part of the tree that decides on a piece.
#[derive(Debug, Default)]
pub(super) struct Rest {
    steps: Vec<Step>,
    /// Of the leaf that the piece is looked at for: it is within all of them.
    own: Vec<Item>,
    /// Of earlier leaves with the same patch: what is within all of one has been there.
    earlier: Vec<Vec<Item>>,
}

/// Outcome of cutting a piece.
enum Kept {
    Nothing,
    Whole { is_flipped: bool },
    Parts,
}

#[derive(Clone, Copy, PartialEq)]
enum Side {
    Inside,
    Outside,
    Both,
    /// All of the piece lies on it: with its inside where the piece's patch has it, or not.
    Along {
        is_opposed: bool,
    },
}

pub(super) struct Cutter<'s> {
    solid: &'s Solid,
    /// Curves are followed in so many steps around.
    around: usize,
    /// Levels that may still be looked at.
    looks: usize,
    /// Out of looks, pieces are taken as their middle is, and no longer cut.
    pub(super) is_short: bool,
    patch: u16,
    /// Sides of patches along which the piece was cut.
    known: Vec<(u16, bool)>,
    items: Vec<Item>,
    /// Patches that the piece lies along, and whether their insides are opposed.
    along: Vec<(u16, bool)>,
    pub(super) pieces: Vec<Piece>,
}

/// The places of a piece.
struct Spread {
    middle: Vector3<f64>,
    radius_m: f64,
    /// Below or above the corners of a piece, on its patch.
    feet: Vec<Vector3<f64>>,
}

impl<'s> Cutter<'s> {
    pub(super) fn new(solid: &'s Solid, around: usize, looks: usize) -> Self {
        Self {
            solid,
            around,
            looks,
            is_short: false,
            patch: 0,
            known: Vec::new(),
            items: solid.items.clone(),
            along: Vec::new(),
            pieces: Vec::new(),
        }
    }

    /// Levels that may still be looked at.
    pub(super) fn looks(&self) -> usize {
        self.looks
    }

    /// Cuts pieces of a leaf's patch.
    pub(super) fn leaf_face(&mut self, leaf: usize, patch: u16, pieces: Vec<Polygon>) {
        let before = self.items.len();
        self.patch = patch;
        let all = Rest {
            steps: self.solid.steps.clone(),
            own: self.solid.others(leaf, patch),
            earlier: self.solid.leaves_with(patch, leaf),
        };
        let (middle, radius_m) = self.solid.balls[leaf];
        let spread = Spread { middle, radius_m, feet: Vec::new() };
        if let Some(rest) = self.prune(&all, &spread) {
            for polygon in pieces {
                self.cut(polygon, &rest);
            }
        }
        self.items.truncate(before);
    }

    fn cut(&mut self, polygon: Polygon, rest: &Rest) -> Kept {
        let before = (self.items.len(), self.along.len());
        let spread = self.spread(&polygon);
        let kept = match self.prune(rest, &spread) {
            Some(rest) => self.cut_by(polygon, &rest),
            None => Kept::Nothing,
        };
        self.items.truncate(before.0);
        self.along.truncate(before.1);
        kept
    }

    fn cut_by(&mut self, polygon: Polygon, rest: &Rest) -> Kept {
        let Some(by) = self.next(rest) else { return self.keep(polygon, rest) };
        let patch = self.solid.patches[usize::from(by)];
        if !patch.is_plane() && polygon.longest().norm() > self.small_m(by, &polygon.middle()) {
            let halves = polygon.halves();
            return self.parts(polygon, halves, rest, None);
        }
        let on = self.solid.on_m;
        let parts = polygon.split(&|place: &Vector3<f64>| patch.level(&self.foot(place)), on, by);
        let [below, above] = &parts;
        if below.is_none() || above.is_none() {
            self.known.push((by, below.is_some()));
            let kept = self.cut(polygon, rest);
            self.known.pop();
            return kept;
        }
        self.parts(polygon, parts, rest, Some(by))
    }

    fn parts(&mut self, whole: Polygon, parts: [Option<Polygon>; 2], rest: &Rest, by: Option<u16>) -> Kept {
        let before = self.pieces.len();
        let kept = [true, false].into_iter().zip(parts).map(|(is_below, part)| {
            let Some(part) = part else { return Kept::Nothing };
            self.known.extend(by.map(|by| (by, is_below)));
            let kept = self.cut(part, rest);
            self.known.truncate(self.known.len() - usize::from(by.is_some()));
            kept
        });
        match kept.collect::<Vec<_>>()[..] {
            [Kept::Whole { is_flipped }, Kept::Whole { is_flipped: also }] if is_flipped == also => {
                self.pieces.truncate(before);
                self.pieces.push(Piece { polygon: whole, patch: self.patch, is_flipped });
                Kept::Whole { is_flipped }
            }
            [Kept::Nothing, Kept::Nothing] => Kept::Nothing,
            _ => Kept::Parts,
        }
    }

    /// The patch to cut by, if any.
    fn next(&self, rest: &Rest) -> Option<u16> {
        let in_steps = rest.steps.iter().flat_map(|step| match *step {
            Step::Leaf { first, count, .. } => &self.items[first as usize..(first + count) as usize],
            Step::Join(_) => &[],
        });
        let items = rest.own.iter().chain(rest.earlier.iter().flatten()).chain(in_steps);
        let patches = items.map(|item| item.patch).filter(|&patch| !self.is_own(patch));
        let is_plane = |patch: &u16| self.solid.patches[usize::from(*patch)].is_plane();
        patches.clone().find(is_plane).or_else(|| patches.clone().next())
    }

    /// Keeps a piece on which the patch alone decides, if it does.
    fn keep(&mut self, polygon: Polygon, rest: &Rest) -> Kept {
        let [below, above] = [true, false].map(|is_below| self.is_solid(&rest.steps, is_below));
        if below == above {
            return Kept::Nothing;
        }
        self.pieces.push(Piece { polygon, patch: self.patch, is_flipped: above });
        Kept::Whole { is_flipped: above }
    }

    /// True if a tree of one patch has that side of it inside.
    fn is_solid(&self, steps: &[Step], is_below: bool) -> bool {
        let mut stack = Vec::new();
        for step in steps {
            match *step {
                Step::Leaf { first, count, .. } => {
                    let items = &self.items[first as usize..(first + count) as usize];
                    let is_opposed = |item: &Item| self.along.contains(&(item.patch, true));
                    stack.push(items.iter().all(|item| item.is_flipped ^ is_opposed(item) != is_below));
                }
                Step::Join(op) => {
                    let (b, a) = (stack.pop().unwrap_or(false), stack.pop().unwrap_or(false));
                    stack.push(match op {
                        CsgOp::Union => a || b,
                        CsgOp::Intersection => a && b,
                        CsgOp::Difference => a && !b,
                    });
                }
            }
        }
        stack.pop().unwrap_or(false)
    }

    /// Part of the tree that decides on a piece; `None`: nothing of it is boundary, or it has been there.
    fn prune(&mut self, rest: &Rest, spread: &Spread) -> Option<Rest> {
        let mut left = Rest::default();
        for &item in &rest.own {
            match self.side(item, spread) {
                Side::Inside | Side::Along { is_opposed: false } => {}
                Side::Outside | Side::Along { is_opposed: true } => return None,
                Side::Both => left.own.push(item),
            }
        }
        let before = self.along.len();
        left.steps = self.prune_steps(&rest.steps, spread)?;
        let lower: Vec<u16> = self.along[before..]
            .iter()
            .map(|(patch, _)| *patch)
            .filter(|patch| *patch < self.patch)
            .collect();
        let all = self.solid.balls.len();
        let along =
            lower.into_iter().flat_map(|patch| self.solid.leaves_with(patch, all)).collect::<Vec<_>>();
        for items in rest.earlier.iter().chain(&along) {
            let sides: Vec<(Item, Side)> =
                items.iter().map(|&item| (item, self.side(item, spread))).collect();
            let is_out = |side: &Side| matches!(side, Side::Outside | Side::Along { is_opposed: true });
            let open = sides.iter().filter(|(_, side)| *side == Side::Both);
            let open: Vec<Item> = open.map(|(item, _)| *item).collect();
            if sides.iter().any(|(_, side)| is_out(side)) {
                continue;
            }
            if open.is_empty() {
                return None;
            }
            left.earlier.push(open);
        }
        Some(left)
    }

    /// `None`: it is the same on all of both sides.
    fn prune_steps(&mut self, steps: &[Step], spread: &Spread) -> Option<Vec<Step>> {
        let mut stack: Vec<Left<Step>> = Vec::new();
        for step in steps {
            let left = match *step {
                Step::Leaf { leaf, first, count } => self.prune_leaf(leaf, (first, count), spread),
                Step::Join(op) => {
                    let (b, a) = (stack.pop(), stack.pop());
                    join(op, a.unwrap_or(Left::Nothing), b.unwrap_or(Left::Nothing))
                }
            };
            stack.push(left);
        }
        match stack.pop() {
            Some(Left::Some(steps)) => Some(steps),
            _ => None,
        }
    }

    fn prune_leaf(&mut self, leaf: u16, (first, count): (u32, u32), spread: &Spread) -> Left<Step> {
        let (centre, radius_m) = self.solid.balls[usize::from(leaf)];
        if (spread.middle - centre).norm() > spread.radius_m + radius_m + self.solid.on_m {
            return Left::Nothing;
        }
        let start = self.items.len();
        for index in first..first + count {
            let item = self.items[index as usize];
            match if self.is_own(item.patch) { Side::Both } else { self.side(item, spread) } {
                Side::Inside => {}
                Side::Outside => {
                    self.items.truncate(start);
                    return Left::Nothing;
                }
                Side::Both => self.items.push(item),
                Side::Along { is_opposed } => {
                    self.along.push((item.patch, is_opposed ^ item.is_flipped));
                    self.items.push(item);
                }
            }
        }
        match (self.items.len() - start) as u32 {
            0 => Left::Everything,
            count => Left::Some(vec![Step::Leaf { leaf, first: start as u32, count }]),
        }
    }

    /// On which side of an item's surface a piece is, or what is within its spread.
    fn side(&mut self, item: Item, spread: &Spread) -> Side {
        let of_patch = self.side_of_patch(item.patch, spread);
        match of_patch {
            Side::Inside if item.is_flipped => Side::Outside,
            Side::Outside if item.is_flipped => Side::Inside,
            Side::Along { is_opposed } => Side::Along { is_opposed: is_opposed ^ item.is_flipped },
            Side::Inside | Side::Outside | Side::Both => of_patch,
        }
    }

    fn side_of_patch(&mut self, number: u16, spread: &Spread) -> Side {
        let told = |is_inside: bool| if is_inside { Side::Inside } else { Side::Outside };
        if let Some((_, is_inside)) = self.known.iter().find(|(known, _)| *known == number) {
            return told(*is_inside);
        }
        self.looks = self.looks.saturating_sub(1);
        self.is_short |= self.looks == 0;
        let patch = &self.solid.patches[usize::from(number)];
        let level = patch.level(&spread.middle);
        if level.abs() > spread.radius_m {
            return told(level < 0.0);
        }
        if spread.feet.is_empty() {
            return Side::Both;
        }
        if self.is_short {
            return told(level < 0.0);
        }
        self.looks = self.looks.saturating_sub(spread.feet.len());
        let on_m = self.solid.on_m;
        let levels = spread.feet.iter().map(|foot| patch.level(foot));
        let (least, most) =
            levels.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), level| (level.min(a), level.max(b)));
        match (least >= -on_m, most <= on_m) {
            (true, true) if level.abs() <= on_m => {
                let [normal, own] = [number, self.patch].map(|number| {
                    self.solid.patches[usize::from(number)].look(&spread.middle, &spread.feet[0]).normal_B
                });
                Side::Along { is_opposed: normal.dot(&own) < 0.0 }
            }
            (true, true) => told(level < 0.0),
            (false, true) if patch.is_convex() => Side::Inside,
            (true, false) if patch.is_plane() => Side::Outside,
            _ => Side::Both,
        }
    }

    /// The piece's patch, or one that it lies along.
    fn is_own(&self, patch: u16) -> bool {
        patch == self.patch || self.along.iter().any(|(along, _)| *along == patch)
    }

    /// The place on the patch below or above one on its pieces.
    fn foot(&self, place: &Vector3<f64>) -> Vector3<f64> {
        let patch = &self.solid.patches[usize::from(self.patch)];
        let mut foot = *place;
        if let Patch::Curved(_) = patch {
            for _ in 0..FOOT_STEPS {
                let look = patch.look(&foot, place);
                foot -= look.normal_B * look.height_m;
                if look.height_m.abs() <= self.solid.on_m || patch.is_distance() {
                    break;
                }
            }
        }
        foot
    }

    fn spread(&mut self, polygon: &Polygon) -> Spread {
        let middle = self.foot(&polygon.middle());
        let out_m = polygon.corners.iter().map(|corner| (corner.place - middle).norm()).fold(0.0, f64::max);
        self.looks = self.looks.saturating_sub(polygon.corners.len());
        let feet = polygon.corners.iter().map(|corner| self.foot(&corner.place)).collect();
        Spread { middle, radius_m: out_m + self.solid.on_m, feet }
    }

    /// A piece no longer than this is cut by a curved patch at once.
    fn small_m(&self, patch: u16, place: &Vector3<f64>) -> f64 {
        let least_m = self.solid.sizes_m[usize::from(patch)] * LEAST_BEND;
        let bend_m = self.solid.patches[usize::from(patch)].smallest_radius_m(place);
        bend_m.max(least_m) * std::f64::consts::TAU / self.around as f64
    }
}

/// True of an edge that was cut along a patch.
pub(super) fn is_seam(cut: u16) -> bool {
    cut != UNCUT
}

/// Newton steps onto a patch from the chord of a piece.
const FOOT_STEPS: usize = 3;
/// Of a leaf's size: sharper bends, as at the tip of a cone, are not followed.
const LEAST_BEND: f64 = 1.0 / 256.0;
