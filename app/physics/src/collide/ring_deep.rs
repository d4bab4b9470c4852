//! A ring that is deep in something: all of it presses that is in there.
//!
//! Problem: inside a solid the nearest way out leaps from side to side along the ring, and with it the deepest places come
//! and go. A force that is made at places leaps with them, or is lost where they are on no side's.
//! Model: the circle in the tube is cut into pieces. Level by level of depth, each run of neighbours that are deeper is one
//! contact, and presses with a spring as long as the level is thick, of which each piece has the same part. So one place
//! presses with its depth, as a point does; two do so each, until they are one where the ridge between them is as deep. A run
//! of more than half the ring presses with three springs, all of it with four: quarters that lie as deep, as on a plate.
//! A piece presses along the slope of the solid's distance, measured over [`SOFT`] across the ring and two pieces along it:
//! where sides meet inside the solid it turns from one way out to the other within as much.
//! Pieces are told as [`NODES`] points of the ring, a piece in parts by its two nearest.
//! Frames: that of the other one, B. Identity: a node is the ring's own.
//! Invariant: the force is a continuous function of the pose, and of nothing else. Where no point of the circle moves by more
//! than `x`, loads shift by a few times `x`, and directions by `sqrt((4 / (3 SOFT tube))^2 + (1 / length of a piece)^2) x`
//! (`tests/all/rings_through.rs`). Where the ways out of its pieces cancel, as in the middle of a slab, so do forces.
//! Error: an edge between two pieces is found less deep by up to a seventieth of the tube's radius; rings of more than
//! [`THIN`] tubes have longer pieces than a third of that, and pass by what is smaller.
//! Cost: at most [`MOST_PIECES`] distances, fewer the farther they are, and three more for each piece that presses.

use std::f64::consts::TAU;

use haptics::Torus;
use nalgebra::{Isometry3, Vector3};

use super::spots::Spot;

/// Pieces of a ring that is less than three times as large as its tube, and of a thin one.
const LEAST_PIECES: usize = 48;
const MOST_PIECES: usize = 192;
/// From this many of its tubes on a ring has no more pieces.
const THIN: f64 = 12.0;
const NODES: usize = 8;
/// Across the ring slopes are measured at this share of the tube's radius.
const SOFT: f64 = 0.25;

/// A ring in the frame of what it is in.
pub(super) struct DeepRing<'r> {
    X_BA: &'r Isometry3<f64>,
    ring_m: f64,
    tube_m: f64,
    pieces: usize,
    /// From the middle of a piece to the next one's \[m\].
    pub(super) step_m: f64,
    /// Between these shares of the tube's radius what all of it presses with takes the place of what else is known.
    begins: [f64; 2],
}

/// Points of the ring, and with which part of its depth each counts.
pub(super) type Nodes = [Option<(Spot, f64)>; NODES];

impl<'r> DeepRing<'r> {
    pub(super) fn new(X_BA: &'r Isometry3<f64>, torus: &Torus, begins: [f64; 2]) -> Self {
        let (ring_m, tube_m) = (torus.ring_radius_m(), torus.tube_radius_m());
        let mut pieces = LEAST_PIECES;
        while pieces < MOST_PIECES && (THIN * tube_m) * (pieces as f64) < ring_m * MOST_PIECES as f64 {
            pieces *= 2;
        }
        let step_m = 2.0 * ring_m * (0.5 * TAU / pieces as f64).sin();
        Self { X_BA, ring_m, tube_m, pieces, step_m, begins }
    }

    /// How much of what all of it presses with counts, of which the deepest place is so deep (m).
    pub(super) fn part(&self, depth_m: f64) -> f64 {
        let [from_m, to_m] = self.begins.map(|share| share * self.tube_m);
        // Not a number: not at all.
        ((depth_m - from_m) / (to_m - from_m)).clamp(0.0, 1.0).max(0.0)
    }

    /// How deep its deepest piece is, if that counts, else 0 \[m\]. `near_m` says how far a point is outside
    /// (m): exactly, if it is less than what it is given, and else no more than it is.
    pub(super) fn deepest_m(&self, mut near_m: impl FnMut(&Vector3<f64>, f64) -> f64) -> f64 {
        let shallow_m = (1.0 - self.begins[0]) * self.tube_m;
        let mut least_m = shallow_m;
        self.for_each(shallow_m, |_, at| {
            let outside_m = near_m(at, shallow_m);
            least_m = least_m.min(outside_m);
            outside_m
        });
        if least_m < shallow_m { self.tube_m - least_m } else { 0.0 }
    }

    /// What presses, of which this part counts; `outside_m`: how far a point is outside, negative inside (m).
    pub(super) fn press(&self, part: f64, outside_m: impl Fn(&Vector3<f64>) -> f64) -> Nodes {
        let mut depths_m = [f64::NEG_INFINITY; MOST_PIECES];
        // One more on either side of what touches tells the slope.
        self.for_each(self.tube_m + self.step_m, |piece, at| {
            let own_m = outside_m(at);
            depths_m[piece] = self.tube_m - own_m;
            own_m
        });
        let depths_m = &depths_m[..self.pieces];
        let loads_m = loads_m(depths_m);
        let mut nodes = [Node::default(); NODES];
        for piece in (0..self.pieces).filter(|&piece| loads_m[piece] > 0.0) {
            let load_m = loads_m[piece];
            let of_piece = Node {
                load_m,
                push_m: self.slope(piece, depths_m, &outside_m) * load_m,
                at_m: self.at(piece, 0.0, 0.0) * load_m,
                depth_m: depths_m[piece] * load_m,
            };
            let place = (piece * NODES) as f64 / self.pieces as f64;
            let (node, beyond) = (place as usize, place.fract());
            nodes[node].add(&of_piece, 1.0 - beyond);
            nodes[(node + 1) % NODES].add(&of_piece, beyond);
        }
        let mut told = [None; NODES];
        for (number, (told, node)) in told.iter_mut().zip(&nodes).enumerate() {
            *told = node.told(number as u32, part, self.tube_m);
        }
        told
    }

    /// Visits all pieces, but those that are farther outside than this (m) since another one is so far, as `visit` says.
    fn for_each(&self, within_m: f64, mut visit: impl FnMut(usize, &Vector3<f64>) -> f64) {
        let mut piece = 0;
        while piece < self.pieces {
            let farther_m = visit(piece, &self.at(piece, 0.0, 0.0)) - within_m;
            let passed = if farther_m > 0.0 { (farther_m / self.step_m).min(FAR_PIECES) as usize } else { 0 };
            piece += passed.max(1);
        }
    }

    fn angle(&self, piece: usize) -> (f64, f64) {
        (TAU * piece as f64 / self.pieces as f64).sin_cos()
    }

    /// The middle of a piece, and a point so far away from it, out of the ring and along its axis (m).
    fn at(&self, piece: usize, out_m: f64, up_m: f64) -> Vector3<f64> {
        let (sine, cosine) = self.angle(piece);
        let radius_m = self.ring_m + out_m;
        self.X_BA.rotation * Vector3::new(radius_m * cosine, up_m, radius_m * sine)
            + self.X_BA.translation.vector
    }

    /// How the distance grows about a piece.
    fn slope(
        &self,
        piece: usize,
        depths_m: &[f64],
        outside_m: &impl Fn(&Vector3<f64>) -> f64,
    ) -> Vector3<f64> {
        let soft_m = SOFT * self.tube_m;
        let (mut out, mut up) = (0.0, 0.0);
        for (across, along) in THIRDS {
            let own_m = outside_m(&self.at(piece, soft_m * across, soft_m * along));
            out += own_m * across / (1.5 * soft_m);
            up += own_m * along / (1.5 * soft_m);
        }
        let [last_m, next_m] = [self.pieces - 1, 1].map(|by| depths_m[(piece + by) % self.pieces]);
        let (beside, _) = self.angle(1);
        let on = (last_m - next_m) / (2.0 * self.ring_m * beside);
        let (sine, cosine) = self.angle(piece);
        self.X_BA.rotation * Vector3::new(out * cosine - on * sine, up, out * sine + on * cosine)
    }
}

/// Three directions across the ring.
const THIRDS: [(f64, f64); 3] = [(1.0, 0.0), (-0.5, SINE_60), (-0.5, -SINE_60)];
const SINE_60: f64 = 0.866_025_403_784_438_6;
/// So many pieces are passed at most at once.
const FAR_PIECES: f64 = 6.0;

/// What is told of some pieces, each by its load.
#[derive(Debug, Clone, Copy, Default)]
struct Node {
    load_m: f64,
    push_m: Vector3<f64>,
    at_m: Vector3<f64>,
    depth_m: f64,
}

impl Node {
    fn add(&mut self, other: &Self, part: f64) {
        self.load_m += other.load_m * part;
        self.push_m += other.push_m * part;
        self.at_m += other.at_m * part;
        self.depth_m += other.depth_m * part;
    }

    /// As a contact point, if any of its pieces presses.
    fn told(&self, number: u32, part: f64, tube_m: f64) -> Option<(Spot, f64)> {
        let pushes_m = self.push_m.norm();
        if !(self.load_m > 0.0 && pushes_m > 0.0) {
            return None;
        }
        let normal = self.push_m / pushes_m;
        // No shallower than what it presses with.
        let depth_m = (self.depth_m / self.load_m).max(pushes_m);
        let on_a = self.at_m / self.load_m - normal * tube_m;
        Some((Spot { id: number, on_a, normal, gap_m: -depth_m }, part * pushes_m / depth_m))
    }
}

/// With what each piece presses that is so deep (m).
fn loads_m(depths_m: &[f64]) -> [f64; MOST_PIECES] {
    let pieces = depths_m.len();
    // From the shallowest piece around to itself.
    let first = (0..pieces).min_by(|&a, &b| depths_m[a].total_cmp(&depths_m[b])).unwrap_or(0);
    let depth_m = |at: usize| depths_m[(first + at) % pieces];
    // Changes from each piece to the next.
    let mut changes_m = [0.0; MOST_PIECES + 1];
    let mut press = |from: usize, to: usize, thick_m: f64| {
        if thick_m > 0.0 {
            let each_m = thick_m * springs(to - from, pieces) / (to - from) as f64;
            changes_m[from] += each_m;
            changes_m[to] -= each_m;
        }
    };
    // Runs that are not at their end yet: where they began, and from which level on they are deeper than what is around.
    let mut open = [(0, 0.0); MOST_PIECES + 1];
    let mut count = 0;
    for at in 0..=pieces {
        let here_m = if at < pieces { depth_m(at).max(0.0) } else { 0.0 };
        let mut from = at;
        // All that is deeper ends here, down to this level.
        while count > 0 && open[count - 1].1 > here_m {
            count -= 1;
            let (began, level_m) = open[count];
            let below_m = if count > 0 { open[count - 1].1 } else { 0.0 };
            press(began, at, level_m - below_m.max(here_m));
            from = began;
        }
        if here_m > 0.0 && (count == 0 || open[count - 1].1 < here_m) {
            open[count] = (from, here_m);
            count += 1;
        }
    }
    let mut loads_m = [0.0; MOST_PIECES];
    let mut load_m = 0.0_f64;
    for at in 0..pieces {
        load_m += changes_m[at];
        // Rounding leaves something where nothing presses.
        loads_m[(first + at) % pieces] = if depth_m(at) > 0.0 { load_m.max(0.0) } else { 0.0 };
    }
    loads_m
}

/// As many as quarters of the ring lie in a run, the first in its middle.
fn springs(long: usize, pieces: usize) -> f64 {
    match long {
        long if long == pieces => 4.0,
        long if 2 * long > pieces => 3.0,
        _ => 1.0,
    }
}
