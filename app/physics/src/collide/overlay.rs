//! Contact points of a flat plate with whatever stands on it.
//!
//! Model (Melder ch. 6.2.1): seen along the contact's normal, the corners of what both cover are the contact points: corners
//! of one over the other, and crossings of their outlines. A round rim gives four points, equally spaced, of which one is
//! the deepest: so many equal springs press like the whole rim while all of them touch, and like its lowest point when it
//! tips. While it stands flat no point is the deepest, and the one of before stays.
//! Edges that are nearly parallel cross anywhere, now here and now there: of two boxes of one size
//! that stand on each other, all four pairs or none, as micrometres have it. With such crossings as
//! corners a stack had eight springs or four, and swayed for ever. A crossing counts as far as the
//! outline of what both cover turns there.
//! Signs: gaps along the normal, from B to A.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::Vector3;

use super::facet::{CORNERS, Facet, Line, Outline, Plate, RIM_IDS, View};
use super::spots::{Spot, Spots};

/// One of the two that meet.
#[derive(Debug, Clone, Copy)]
pub(super) struct Side {
    pub(super) facet: Facet,
    /// All within this distance of the facet belongs to it \[m\].
    pub(super) radius_m: f64,
}

/// What of the two, seen along `normal` from B to A.
pub(super) struct Overlay<'s> {
    pub(super) sides: [Side; 2],
    pub(super) normal: Vector3<f64>,
    /// The angles at which the rims' points begin, of A and of B.
    pub(super) angles: &'s mut [f64],
    pub(super) spots: &'s mut Spots,
}

const A: usize = 0;
const B: usize = 1;
/// Tilted by less, a rim stands flat \[rad\].
pub(super) const FLAT: f64 = 1e-4;
/// B's own numbers follow A's.
const OF_B: u32 = 24;
const EDGE_EDGE_IDS: u32 = 64;
const EDGE_RIM_IDS: u32 = 512;
const RIM_RIM_IDS: u32 = 768;
const LINE_IDS: u32 = 1024;
const POINT_ID: u32 = 1040;
/// Turn of an outline from which on it has a whole corner \[rad\].
const TURNS: f64 = 0.3;
/// Into how many pieces a rim is cut in search of another.
const PIECES: usize = 16;
/// Rims that lie on each other do not cross, whatever rounding says.
const SAME: f64 = 1e-9;
/// Halvings until such a crossing is found.
const HALVINGS: usize = 40;

impl Overlay<'_> {
    /// Appends all contact points.
    pub(super) fn find(&mut self) {
        match [self.sides[A].facet, self.sides[B].facet] {
            [Facet::Plate(a), Facet::Plate(b)] => {
                let views = [a.seen_along(&self.normal), b.seen_along(&self.normal)];
                if let [Some(a), Some(b)] = views {
                    self.plates([a, b]);
                }
            }
            [Facet::Plate(plate), other] => self.on_plate(&plate, other, A),
            [other, Facet::Plate(plate)] => self.on_plate(&plate, other, B),
            _ => {}
        }
        self.spots.thin_out(RIM_IDS..RIM_IDS + 8);
        self.spots.thin_out(RIM_IDS + OF_B..RIM_IDS + OF_B + 8);
    }

    /// A point of which both heights are known.
    fn push(&mut self, id: u32, on: [Vector3<f64>; 2], share: f64) {
        let [radius_a, radius_b] = self.sides.map(|side| side.radius_m);
        let gap_m = self.normal.dot(&(on[A] - on[B])) - radius_a - radius_b;
        let on_a = on[A] - self.normal * radius_a;
        self.spots.push_share(Spot { id, on_a, normal: self.normal, gap_m }, share);
    }

    /// A point of `of`'s outline over the other's plate.
    fn push_over(&mut self, id: u32, of: usize, point: &Vector3<f64>, other: &View) {
        self.push_share_over(id, of, point, other, 1.0);
    }

    /// The same, with a share of its depth.
    fn push_share_over(&mut self, id: u32, of: usize, point: &Vector3<f64>, other: &View, share: f64) {
        let seen = other.onto(point);
        self.push(id, if of == A { [*point, seen] } else { [seen, *point] }, share);
    }

    /// A line or a point over the plate of `plate_of`.
    fn on_plate(&mut self, plate: &Plate, other: Facet, plate_of: usize) {
        let of = 1 - plate_of;
        let Some(view) = plate.seen_along(&self.normal) else { return };
        match other {
            Facet::Line(Line { ends, ids, .. }) => {
                let Some(part) = view.covered_part(&ends) else { return };
                for ((at, _), id) in part.into_iter().zip(ids) {
                    self.push_over(LINE_IDS + id, of, &(ends[0] + (ends[1] - ends[0]) * at), &view);
                }
            }
            Facet::Point(point) if view.covers(&point) => self.push_over(POINT_ID, of, &point, &view),
            _ => {}
        }
    }

    /// Corners and rims of each over the other, then crossings, which give way to them.
    fn plates(&mut self, views: [View; 2]) {
        for of in [A, B] {
            self.corners(of, &views);
        }
        for of in [A, B] {
            self.rim(of, &views);
        }
        let outlines = views.map(|view| view.plate().outline);
        match outlines {
            [Outline::Square { .. }, Outline::Square { .. } | Outline::Disc { .. }] => {
                self.edges(A, &views);
            }
            [Outline::Disc { .. }, Outline::Square { .. }] => self.edges(B, &views),
            [Outline::Disc { .. }, Outline::Disc { .. }] => self.crossing_rims(&views),
            _ => {}
        }
    }

    fn corners(&mut self, of: usize, views: &[View; 2]) {
        let (plate, other) = (*views[of].plate(), &views[1 - of]);
        let Outline::Square { corners, .. } = plate.outline else { return };
        for ((s, t), number) in CORNERS.into_iter().zip(corners) {
            let corner = plate.at(s, t);
            if other.covers(&corner) {
                self.push_over(number + numbers_of(of), of, &corner, other);
            }
        }
    }

    /// Four points of a rim, and the one that is nearest on the other rim of the same form.
    fn rim(&mut self, of: usize, views: &[View; 2]) {
        let (plate, other) = (*views[of].plate(), &views[1 - of]);
        let Outline::Disc { cap, beyond } = plate.outline else { return };
        let angle = self.first_angle(of, &plate, other);
        let first_id = RIM_IDS + numbers_of(of);
        for quarter in 0..4_u32 {
            let point = plate.at_angle(angle + f64::from(quarter) * FRAC_PI_2);
            if other.covers(&point) {
                self.push_over(first_id + 4 * cap + quarter, of, &point, other);
            }
        }
        if other.covers(&beyond) {
            self.push_over(first_id + 4 * (1 - cap), of, &beyond, other);
        }
    }

    /// Where on the rim the gap is smallest, or where it was when it was last to be told.
    fn first_angle(&mut self, of: usize, plate: &Plate, other: &View) -> f64 {
        let sign = if of == A { 1.0 } else { -1.0 };
        let gap_m = |point: Vector3<f64>| sign * self.normal.dot(&(point - other.onto(&point)));
        let middle_m = gap_m(plate.centre);
        let (along_u, along_v) =
            (gap_m(plate.centre + plate.u) - middle_m, gap_m(plate.centre + plate.v) - middle_m);
        if along_u.hypot(along_v) > FLAT * plate.u.norm().max(plate.v.norm()) {
            self.angles[of] = (-along_v).atan2(-along_u);
        } else if let (B, Outline::Disc { .. }) = (of, other.plate().outline) {
            // Where A's begin: rims that lie on each other have their points at the same places.
            let first = other.plate().at_angle(self.angles[A]) - other.plate().centre;
            self.angles[B] = first.dot(&plate.v).atan2(first.dot(&plate.u));
        }
        self.angles[of]
    }

    /// Where the edges of `of`'s square enter and leave the other's plate.
    fn edges(&mut self, of: usize, views: &[View; 2]) {
        let (plate, other) = (*views[of].plate(), &views[1 - of]);
        let Outline::Square { corners, edges } = plate.outline else { return };
        for (k, edge) in edges.into_iter().enumerate() {
            let mut ends = [CORNERS[k], CORNERS[(k + 1) % 4]].map(|(s, t)| plate.at(s, t));
            // From the corner of the lower number, whichever face the edge is seen as part of.
            if corners[k] > corners[(k + 1) % 4] {
                ends.reverse();
            }
            let Some(part) = other.covered_part(&ends) else { continue };
            for (which, (at, cut)) in part.into_iter().enumerate().filter(|(_, (_, cut))| *cut < 4) {
                let id = match other.plate().outline {
                    Outline::Square { edges: others, .. } if of == A => {
                        EDGE_EDGE_IDS + edge * 16 + others[cut]
                    }
                    Outline::Square { edges: others, .. } => EDGE_EDGE_IDS + others[cut] * 16 + edge,
                    Outline::Disc { cap, .. } => EDGE_RIM_IDS + edge * 4 + cap * 2 + which as u32,
                    Outline::Endless => continue,
                };
                let share = match other.plate().outline {
                    Outline::Square { .. } => corner_share([plate.side(k), other.plate().side(cut)]),
                    _ => 1.0,
                };
                self.push_share_over(id, of, &(ends[0] + (ends[1] - ends[0]) * at), other, share);
            }
        }
    }

    /// Where two rims cross each other: found on A's.
    fn crossing_rims(&mut self, views: &[View; 2]) {
        let (plate, other) = (*views[A].plate(), &views[B]);
        let beyond = |angle: f64| {
            let (s, t) = other.place(&plate.at_angle(angle));
            s.hypot(t) - 1.0 - SAME
        };
        let step = TAU / PIECES as f64;
        let mut before = beyond(0.0);
        let mut crossings = 0;
        for piece in 0..PIECES {
            let (mut low, mut high) = (step * piece as f64, step * (piece + 1) as f64);
            let after = beyond(high);
            let begins_inside = before <= 0.0;
            before = after;
            if begins_inside == (after <= 0.0) {
                continue;
            }
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                if (beyond(middle) <= 0.0) == begins_inside { low = middle } else { high = middle }
            }
            self.push_over(RIM_RIM_IDS + crossings, A, &plate.at_angle(low), other);
            crossings += 1;
        }
    }
}

/// Share of a corner that two edges make which look there: all of one unless they look the same way.
fn corner_share([one, other]: [Vector3<f64>; 2]) -> f64 {
    // Twice the sine of half the turn.
    ((one - other).norm() / TURNS).min(1.0)
}

fn numbers_of(side: usize) -> u32 {
    if side == A { 0 } else { OF_B }
}
