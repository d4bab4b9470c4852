//! What of a convex form looks towards the other: a flat plate, a line, or a point.
//!
//! Model: of a box the face that looks there most, or an edge; of cylinders and cones a cap, or the line of the side that is
//! nearest; of a capsule its axis; of all else the farthest point.
//! Frames: that in which the forms meet. Everything is of the core; see [`Convex`].
//! Identity: corners of a box have numbers 0 to 7, edges 0 to 11, caps 0 (top) and 1 (bottom). Points on a rim are counted
//! from the cap's first number on.

use nalgebra::Vector3;

use super::axis::unit;
use super::convex::{Convex, Core};

/// What looks towards the other.
#[derive(Debug, Clone, Copy)]
pub(super) enum Facet {
    Point(Vector3<f64>),
    Line(Line),
    Plate(Plate),
}

/// A piece of an edge, of a side or of an axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Line {
    pub(super) ends: [Vector3<f64>; 2],
    /// Which features the ends are.
    pub(super) ids: [u32; 2],
    /// How round the form is across the line \[m\]; 0: an edge.
    pub(super) bend_m: f64,
}

/// A flat piece: all `centre + s u + t v` with `|s|, |t| <= 1` or `s^2 + t^2 <= 1`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plate {
    pub(super) centre: Vector3<f64>,
    pub(super) u: Vector3<f64>,
    pub(super) v: Vector3<f64>,
    /// Outward.
    pub(super) normal: Vector3<f64>,
    pub(super) outline: Outline,
}

#[derive(Debug, Clone, Copy)]
pub(super) enum Outline {
    /// Corners against the clock from `(1, 1)` on in s, t, and the edges that lead from each to the next.
    Square { corners: [u32; 4], edges: [u32; 4] },
    /// A cap, and the point of the other rim that looks there most.
    Disc { cap: u32, beyond: Vector3<f64> },
    /// A plane.
    Endless,
}

/// Of the point of a cap's rim that looks at the other most; three more follow.
pub(super) const RIM_IDS: u32 = 16;

/// Corners of a square in s, t.
pub(super) const CORNERS: [(f64, f64); 4] = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];

impl Facet {
    /// What of the form looks in this direction, flat pieces first.
    pub(super) fn of(form: &Convex<'_>, toward: &Vector3<f64>) -> Self {
        let own = form.own_direction(toward);
        match form.core {
            Core::Box { half_m } => Self::Plate(face(form, &half_m, &own)),
            Core::Frustum { half_m, radii_m: [bottom_m, top_m] } => {
                let across_m = own.x.hypot(own.z);
                // Of the side's normal, not of unit length.
                let slant = (2.0 * half_m).hypot(bottom_m - top_m);
                let side = (across_m * 2.0 * half_m + own.y * (bottom_m - top_m)) / slant;
                let is_top = own.y > 0.0;
                let radius_m = if is_top { top_m } else { bottom_m };
                if own.y.abs() >= side && radius_m > 0.0 {
                    Self::Plate(cap(form, is_top, half_m, [bottom_m, top_m], &own))
                } else {
                    Self::Line(side_line(form, half_m, [bottom_m, top_m], &own))
                }
            }
            _ => Self::edge_of(form, toward),
        }
    }

    /// The same without flat pieces.
    pub(super) fn edge_of(form: &Convex<'_>, toward: &Vector3<f64>) -> Self {
        let own = form.own_direction(toward);
        match form.core {
            Core::Box { half_m } => {
                let along = own.iamin();
                let ends = [1.0, -1.0].map(|sign| {
                    let mut end = half_m.zip_map(&own, f64::copysign);
                    end[along] = half_m[along] * sign;
                    end
                });
                let ids = ends.map(|end| corner_number(&end));
                Self::Line(Line { ends: ends.map(|end| form.placed_point(&end)), ids, bend_m: 0.0 })
            }
            Core::Frustum { half_m, radii_m } => Self::Line(side_line(form, half_m, radii_m, &own)),
            Core::Segment { half_m, swollen_m } if half_m > 0.0 => {
                let swell = unit(&own).unwrap_or_else(Vector3::y) * swollen_m;
                let ends = [half_m, -half_m].map(|y| form.placed_point(&(Vector3::y() * y + swell)));
                let bend_m = form.radius_m + form.placed_vector(&swell).norm();
                Self::Line(Line { ends, ids: [RIM_IDS, RIM_IDS + 4], bend_m })
            }
            _ => Self::Point(form.support(toward)),
        }
    }
}

/// Bit i is set where coordinate i is positive.
fn corner_number(corner: &Vector3<f64>) -> u32 {
    (0..3).fold(0, |number, axis| number | u32::from(corner[axis] > 0.0) << axis)
}

/// The edge between two corners that differ in one coordinate.
fn edge_number(a: u32, b: u32) -> u32 {
    let axis = (a ^ b).trailing_zeros();
    let both = a & b;
    let (low, high) = [(1, 2), (0, 2), (0, 1)][axis as usize % 3];
    axis * 4 + (both >> low & 1) + 2 * (both >> high & 1)
}

fn face(form: &Convex<'_>, half_m: &Vector3<f64>, own: &Vector3<f64>) -> Plate {
    let axis = own.iamax();
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    let along = |axis: usize, length_m: f64| {
        let mut vector = Vector3::zeros();
        vector[axis] = length_m;
        vector
    };
    let out = along(axis, half_m[axis].copysign(own[axis]));
    let (u, v) = (along(i, half_m[i]), along(j, half_m[j]));
    let corners = CORNERS.map(|(s, t)| corner_number(&(out + u * s + v * t)));
    let edges = [0, 1, 2, 3].map(|k| edge_number(corners[k], corners[(k + 1) % 4]));
    Plate {
        centre: form.placed_point(&out),
        u: form.placed_vector(&u),
        v: form.placed_vector(&v),
        normal: form.rotation * along(axis, 1.0_f64.copysign(own[axis])),
        outline: Outline::Square { corners, edges },
    }
}

/// Points of both rims that look there most, the upper one's first.
fn side_line(form: &Convex<'_>, half_m: f64, [bottom_m, top_m]: [f64; 2], own: &Vector3<f64>) -> Line {
    let out = unit(&Vector3::new(own.x, 0.0, own.z)).unwrap_or_else(Vector3::x);
    let at = |radius_m: f64, y: f64| form.placed_point(&(out * radius_m + Vector3::y() * y));
    let bend_m = form.placed_vector(&(out * (0.5 * (bottom_m + top_m)))).norm();
    Line { ends: [at(top_m, half_m), at(bottom_m, -half_m)], ids: [RIM_IDS, RIM_IDS + 4], bend_m }
}

fn cap(form: &Convex<'_>, is_top: bool, half_m: f64, radii_m: [f64; 2], own: &Vector3<f64>) -> Plate {
    let side = side_line(form, half_m, radii_m, own);
    let (sign, radius_m) = if is_top { (1.0, radii_m[1]) } else { (-1.0, radii_m[0]) };
    Plate {
        centre: form.placed_point(&(Vector3::y() * (half_m * sign))),
        u: form.placed_vector(&(Vector3::x() * radius_m)),
        v: form.placed_vector(&(Vector3::z() * radius_m)),
        normal: form.rotation * (Vector3::y() * sign),
        outline: Outline::Disc { cap: u32::from(!is_top), beyond: side.ends[usize::from(is_top)] },
    }
}

/// A plate as seen along a direction: where on it other points lie.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    plate: Plate,
    along: Vector3<f64>,
    to_s: Vector3<f64>,
    to_t: Vector3<f64>,
    /// How far to go along the direction per height above the plate.
    per_height: f64,
}

impl Plate {
    /// Without bounds.
    pub(super) fn endless(centre: Vector3<f64>, normal: Vector3<f64>) -> Self {
        Self { centre, u: Vector3::zeros(), v: Vector3::zeros(), normal, outline: Outline::Endless }
    }

    pub(super) fn at(&self, s: f64, t: f64) -> Vector3<f64> {
        self.centre + self.u * s + self.v * t
    }

    /// The direction in which the edge of this number looks, along the plate.
    pub(super) fn side(&self, edge: usize) -> Vector3<f64> {
        let way = [self.v, -self.u, -self.v, self.u][edge];
        way / way.norm()
    }

    /// The point at an angle of the rim.
    pub(super) fn at_angle(&self, angle: f64) -> Vector3<f64> {
        let (sine, cosine) = angle.sin_cos();
        self.at(cosine, sine)
    }

    /// `None` where it is seen from its edge.
    pub(super) fn seen_along(&self, along: &Vector3<f64>) -> Option<View> {
        let facing = self.normal.dot(along);
        if facing.abs() < EDGE_ON {
            return None;
        }
        let (across_v, across_u) = (self.v.cross(along), self.u.cross(along));
        let (of_u, of_v) = (self.u.dot(&across_v), self.v.dot(&across_u));
        let dual = |across: Vector3<f64>, of: f64| if of == 0.0 { Vector3::zeros() } else { across / of };
        Some(View {
            plate: *self,
            along: *along,
            to_s: dual(across_v, of_u),
            to_t: dual(across_u, of_v),
            per_height: facing.recip(),
        })
    }
}

/// A plate that is seen at a smaller sine than this carries nothing.
const EDGE_ON: f64 = 0.3;
/// Points this far beyond the outline still lie on it, in shares of its size: rounding.
const ON_OUTLINE: f64 = 1e-9;

impl View {
    pub(super) fn plate(&self) -> &Plate {
        &self.plate
    }

    /// Where on the plate a point is seen, in s and t.
    pub(super) fn place(&self, point: &Vector3<f64>) -> (f64, f64) {
        let from = point - self.plate.centre;
        (from.dot(&self.to_s), from.dot(&self.to_t))
    }

    /// The point of the plate's plane that is seen where this point is.
    pub(super) fn onto(&self, point: &Vector3<f64>) -> Vector3<f64> {
        let height_m = self.plate.normal.dot(&(self.plate.centre - point));
        point + self.along * (height_m * self.per_height)
    }

    pub(super) fn covers(&self, point: &Vector3<f64>) -> bool {
        let (s, t) = self.place(point);
        match self.plate.outline {
            Outline::Square { .. } => s.abs().max(t.abs()) <= 1.0 + ON_OUTLINE,
            Outline::Disc { .. } => s * s + t * t <= 1.0 + 2.0 * ON_OUTLINE,
            Outline::Endless => true,
        }
    }

    /// Which part of a line is seen over the plate, and which edges of the plate cut it off there (4: none).
    pub(super) fn covered_part(&self, ends: &[Vector3<f64>; 2]) -> Option<[(f64, usize); 2]> {
        let [(s, t), (s_end, t_end)] = [self.place(&ends[0]), self.place(&ends[1])];
        let (ds, dt) = (s_end - s, t_end - t);
        match self.plate.outline {
            Outline::Endless => Some([(0.0, 4), (1.0, 4)]),
            Outline::Square { .. } => {
                // In the order of the edges: t = 1, s = -1, t = -1, s = 1.
                clip([(t, dt), (-s, -ds), (-t, -dt), (s, ds)])
            }
            Outline::Disc { .. } => {
                let (a, b, c) = (ds * ds + dt * dt, s * ds + t * dt, s * s + t * t - 1.0);
                let root = (b * b - a * c).max(0.0).sqrt();
                if a == 0.0 || b * b < a * c {
                    return None;
                }
                let [enters, leaves] = [(-b - root) / a, (-b + root) / a];
                let first = if enters > 0.0 { (enters, 0) } else { (0.0, 4) };
                let last = if leaves < 1.0 { (leaves, 0) } else { (1.0, 4) };
                (first.0 <= last.0).then_some([first, last])
            }
        }
    }
}

/// What of `0..1` is left where all `from + change x <= 1`.
fn clip(bounds: [(f64, f64); 4]) -> Option<[(f64, usize); 2]> {
    let (mut first, mut last) = ((0.0, 4), (1.0, 4));
    for (edge, (from, change)) in bounds.into_iter().enumerate() {
        let room = 1.0 - from;
        if change.abs() < 1e-12 {
            if room < -ON_OUTLINE {
                return None;
            }
            continue;
        }
        let crossing = room / change;
        if change > 0.0 && crossing < last.0 {
            last = (crossing, edge);
        } else if change < 0.0 && crossing > first.0 {
            first = (crossing, edge);
        }
    }
    (first.0 <= last.0).then_some([first, last])
}
