//! What cylinders and cones share: a straight side around the y axis between two flat caps.
//!
//! Model: in the half-plane through the axis (distance rho from it, height y) the side is a straight line with the
//! outward normal `(normal_rho, normal_y)`, which slants where the radii differ. The solid is convex: how far a point
//! lies before it is told by the farthest of side and cap.
//!
//! Grown by a ball's radius, its rims are round: the surface is that at the radius from the solid within.
//!
//! Frames and signs: object frame B, y up, centred, bottom at -length/2. Pieces: top, bottom, side, round rims; where
//! several are as near, the first counts. On the axis the side lies towards +x.
//! Invariant: points it returns lie on the side or a cap to rounding. Cost: a square root or two per question.

use nalgebra::Vector3;

use crate::chart::Chart;
use crate::convex::{Edged, Level, around_y, direction_or};
use crate::error::{ParameterError, above_zero, at_least_zero};
use crate::surface::{Feature, Surface, SurfacePoint};

/// The solid between two parallel discs around the y axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Frustum {
    pub(crate) half_length_m: f64,
    pub(crate) radius_bottom_m: f64,
    pub(crate) radius_top_m: f64,
    /// Radius half way up.
    radius_middle_m: f64,
    /// Radius per height.
    slope: f64,
    normal_rho: f64,
    normal_y: f64,
    /// Radius of the rims, around the solid \[m\].
    rounding_m: f64,
}

pub(crate) const TOP: u32 = 0;
pub(crate) const BOTTOM: u32 = 1;
pub(crate) const SIDE: u32 = 2;
pub(crate) const TOP_RIM: u32 = 3;
pub(crate) const BOTTOM_RIM: u32 = 4;

impl Frustum {
    /// Errors: a radius not finite or negative, both zero, a length not finite or not positive.
    pub(crate) fn new(
        radius_bottom_m: f64,
        radius_top_m: f64,
        length_m: f64,
    ) -> Result<Self, ParameterError> {
        at_least_zero("radius_bottom_m", radius_bottom_m)?;
        at_least_zero("radius_top_m", radius_top_m)?;
        let half_length_m = above_zero("length_m", length_m)? * 0.5;
        // Corrected: the printed half difference is no radius of the middle.
        //= melder#7.10
        let radius_middle_m =
            above_zero("radius_bottom_m + radius_top_m", radius_bottom_m + radius_top_m)? / 2.0;
        // Corrected: with y up and the base at -l/2 the printed slope has the wrong sign.
        //= melder#7.9
        let slope = (radius_top_m - radius_bottom_m) / length_m;
        let slant = slope.hypot(1.0);
        Ok(Self {
            half_length_m,
            radius_bottom_m,
            radius_top_m,
            radius_middle_m,
            slope,
            normal_rho: 1.0 / slant,
            normal_y: -slope / slant,
            rounding_m: 0.0,
        })
    }

    /// Radius of the side at a height \[m\].
    pub(crate) fn radius_at(&self, y_m: f64) -> f64 {
        //= melder#7.11
        (self.radius_middle_m + self.slope * y_m).max(0.0)
    }

    fn radius_of_cap(&self, piece: u32) -> f64 {
        if piece == TOP || piece == TOP_RIM { self.radius_top_m } else { self.radius_bottom_m }
    }

    /// How far a point lies before the side, along the side's normal \[m\].
    fn before_side(&self, rho_m: f64, y_m: f64) -> f64 {
        //= melder#7.13
        self.normal_rho * (rho_m - (self.radius_middle_m + self.slope * y_m))
    }

    fn side_normal(&self, outward_B: &Vector3<f64>) -> Vector3<f64> {
        outward_B * self.normal_rho + Vector3::y() * self.normal_y
    }

    fn on_side(&self, point_B: &Vector3<f64>) -> SurfacePoint {
        // Corrected: on the axis the printed quotient is 0/0, here it is +x.
        //= melder#7.14
        let (rho_m, outward_B) = around_y(point_B);
        let y_m = point_B.y - self.normal_y * self.before_side(rho_m, point_B.y);
        self.at_side(y_m.clamp(-self.half_length_m, self.half_length_m), outward_B)
    }

    fn at_side(&self, y_m: f64, outward_B: Vector3<f64>) -> SurfacePoint {
        // Corrected: the printed point lies level with H; on a slanted side the nearest one does not.
        //= melder#7.15
        let point_B = outward_B * self.radius_at(y_m) + Vector3::y() * y_m;
        let normal_B = self.side_normal(&outward_B);
        SurfacePoint { point_B, normal_B, feature: Feature::Surface, piece: SIDE }
    }

    fn on_cap(&self, piece: u32, point_B: &Vector3<f64>) -> SurfacePoint {
        let normal_B = cap_normal(piece);
        let (rho_m, radius_m) = (around_y(point_B).0, self.radius_of_cap(piece));
        let shrink = if rho_m > radius_m { radius_m / rho_m } else { 1.0 };
        let point_B = Vector3::new(point_B.x * shrink, normal_B.y * self.half_length_m, point_B.z * shrink);
        SurfacePoint { point_B, normal_B, feature: Feature::Face, piece }
    }

    /// Whether the foot on a piece's plane or cone lies beyond that piece.
    fn is_over_rim(&self, piece: u32, point_B: &Vector3<f64>) -> bool {
        let rho_m = around_y(point_B).0;
        if piece != SIDE {
            return rho_m > self.radius_of_cap(piece);
        }
        let foot_y_m = point_B.y - self.normal_y * self.before_side(rho_m, point_B.y);
        foot_y_m.abs() > self.half_length_m
    }

    /// Along the side; over a rim the cap takes over where the path crosses it.
    fn settle_on_side(&self, from_B: &Vector3<f64>, target_B: &Vector3<f64>) -> SurfacePoint {
        let (rho_m, outward_B) = around_y(target_B);
        let y_m = target_B.y - self.normal_y * self.before_side(rho_m, target_B.y);
        let over_m = y_m.abs() - self.half_length_m;
        if over_m.is_nan() || over_m <= 0.0 {
            return self.at_side(y_m, outward_B);
        }
        let rise_m = (y_m - from_B.y).abs();
        let part = if rise_m > over_m { 1.0 - over_m / rise_m } else { 0.0 };
        let crossing_B = from_B + (target_B - from_B) * part;
        let cap = if y_m < 0.0 { BOTTOM } else { TOP };
        let (_, outward_B) = around_y(&crossing_B);
        self.on_cap(cap, &(outward_B * self.radius_of_cap(cap)))
    }

    /// Straight over the cap; over the rim the side takes over.
    fn settle_on_cap(&self, cap: u32, from_B: &Vector3<f64>, target_B: &Vector3<f64>) -> SurfacePoint {
        let radius_m = self.radius_of_cap(cap);
        if around_y(target_B).0 <= radius_m {
            return self.on_cap(cap, target_B);
        }
        let crossing_B = leaves_circle(from_B, target_B, radius_m);
        let outward_B = if radius_m > 0.0 { around_y(&crossing_B).1 } else { around_y(target_B).1 };
        self.at_side(cap_normal(cap).y * self.half_length_m, outward_B)
    }
}

impl Edged for Frustum {
    fn is_round(&self) -> bool {
        self.rounding_m > 0.0
    }

    fn sharp_level(&self, point_B: &Vector3<f64>) -> Level {
        //= melder#7.12
        let (rho_m, outward_B) = around_y(point_B);
        //= melder#7.8
        let before_cap_m = point_B.y.abs() - self.half_length_m;
        let before_side_m = self.before_side(rho_m, point_B.y);
        if before_side_m > before_cap_m {
            let gradient_B = self.side_normal(&outward_B);
            return Level { height_m: before_side_m, gradient_B, piece: SIDE };
        }
        let piece = if point_B.y < 0.0 { BOTTOM } else { TOP };
        Level { height_m: before_cap_m, gradient_B: cap_normal(piece), piece }
    }

    fn round_level(&self, point_B: &Vector3<f64>) -> Level {
        let flat = self.sharp_level(point_B);
        let over_rim = flat.height_m > 0.0 && self.is_over_rim(flat.piece, point_B);
        if !over_rim {
            return Level { height_m: flat.height_m - self.rounding_m, ..flat };
        }
        let rim_B = self.on(flat.piece, point_B).point_B;
        let away_B = point_B - rim_B;
        let gradient_B = direction_or(&away_B, flat.gradient_B);
        let piece = if rim_B.y < 0.0 { BOTTOM_RIM } else { TOP_RIM };
        Level { height_m: away_B.norm() - self.rounding_m, gradient_B, piece }
    }

    fn on(&self, piece: u32, point_B: &Vector3<f64>) -> SurfacePoint {
        if piece == SIDE { self.on_side(point_B) } else { self.on_cap(piece, point_B) }
    }

    fn on_round(&self, point_B: &Vector3<f64>) -> SurfacePoint {
        let level = self.round_level(point_B);
        let within = match level.piece {
            TOP_RIM => self.on_cap(TOP, point_B),
            BOTTOM_RIM => self.on_cap(BOTTOM, point_B),
            piece => self.on(piece, point_B),
        };
        // What a ball touches there is the rim itself, or the tip.
        let feature = match level.piece {
            TOP_RIM | BOTTOM_RIM if self.radius_of_cap(level.piece) == 0.0 => Feature::Vertex,
            TOP_RIM | BOTTOM_RIM => Feature::Edge,
            _ => within.feature,
        };
        SurfacePoint {
            point_B: within.point_B + level.gradient_B * self.rounding_m,
            normal_B: level.gradient_B,
            feature,
            piece: level.piece,
        }
    }
}

fn cap_normal(piece: u32) -> Vector3<f64> {
    if piece == BOTTOM { -Vector3::y() } else { Vector3::y() }
}

/// Where a level path leaves the circle of this radius around the y axis, which it begins in and ends outside of.
fn leaves_circle(from_B: &Vector3<f64>, to_B: &Vector3<f64>, radius_m: f64) -> Vector3<f64> {
    let (x, z) = (from_B.x, from_B.z);
    let (dx, dz) = (to_B.x - x, to_B.z - z);
    // |from + u path| = radius for the larger root; `within` is clamped since from may lie on the rim.
    let (a, b) = (dx * dx + dz * dz, x * dx + z * dz);
    let within = (radius_m * radius_m - x * x - z * z).max(0.0);
    let root = (b * b + a * within).sqrt();
    let part = if b > 0.0 { within / (b + root) } else { (root - b) / a };
    if part.is_nan() { *to_B } else { from_B + (to_B - from_B) * part.clamp(0.0, 1.0) }
}

impl Surface for Frustum {
    fn signed_distance(&self, point_B: &Vector3<f64>) -> f64 {
        self.height_m(point_B)
    }

    fn nearest(&self, point_B: &Vector3<f64>) -> SurfacePoint {
        self.nearest_point(point_B)
    }

    fn entry(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<SurfacePoint> {
        self.entered(from_B, to_B)
    }

    fn settle(&self, from: &SurfacePoint, on_tangent_plane_B: &Vector3<f64>) -> SurfacePoint {
        if self.is_round() {
            self.on_round(on_tangent_plane_B)
        } else if from.piece == SIDE {
            self.settle_on_side(&from.point_B, on_tangent_plane_B)
        } else {
            self.settle_on_cap(from.piece, &from.point_B, on_tangent_plane_B)
        }
    }

    /// All tangent planes of the side are as far from the middle of the axis.
    fn tangent_offset(&self, at: &SurfacePoint) -> f64 {
        let within_m = match at.piece {
            SIDE => self.normal_rho * self.radius_middle_m,
            TOP | BOTTOM => self.half_length_m,
            rim => {
                let y_m = if rim == TOP_RIM { self.half_length_m } else { -self.half_length_m };
                at.normal_B.x.hypot(at.normal_B.z) * self.radius_of_cap(rim) + at.normal_B.y * y_m
            }
        };
        within_m + self.rounding_m
    }

    /// Caps are flat; on the side the centre of curvature is where the normal meets the axis. Whoever is deeper below
    /// a round rim than its radius has gone past its middle.
    fn holds_outside(&self, at: &SurfacePoint, depth_m: f64) -> bool {
        match at.piece {
            TOP | BOTTOM => true,
            SIDE => depth_m * self.normal_rho < around_y(&at.point_B).0,
            _ => false,
        }
    }

    /// Caps have their own, rims that of the side.
    fn chart(&self, at: &SurfacePoint) -> Option<Chart> {
        if matches!(at.piece, TOP | BOTTOM) {
            let lengths_m = [2.0 * self.radius_of_cap(at.piece); 2];
            return Some(Chart::flat(&at.point_B, &cap_normal(at.piece), lengths_m));
        }
        let radius_m = self.radius_bottom_m.max(self.radius_top_m);
        let [along_m, length_m] = [at.point_B.y, 2.0 * self.half_length_m].map(|y_m| y_m / self.normal_rho);
        Some(Chart::revolved(at, radius_m, along_m, length_m, false))
    }

    fn grown(&self, radius_m: f64) -> Option<Self> {
        Some(Self { rounding_m: self.rounding_m + radius_m, ..*self })
    }
}

/// A public shape that is a frustum and answers as one.
macro_rules! is_a_frustum {
    ($shape:ident) => {
        impl Surface for $shape {
            fn signed_distance(&self, point_B: &Vector3<f64>) -> f64 {
                self.0.signed_distance(point_B)
            }

            fn nearest(&self, point_B: &Vector3<f64>) -> SurfacePoint {
                self.0.nearest(point_B)
            }

            fn entry(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<SurfacePoint> {
                self.0.entry(from_B, to_B)
            }

            fn settle(&self, from: &SurfacePoint, on_tangent_plane_B: &Vector3<f64>) -> SurfacePoint {
                self.0.settle(from, on_tangent_plane_B)
            }

            fn tangent_offset(&self, at: &SurfacePoint) -> f64 {
                self.0.tangent_offset(at)
            }

            fn holds_outside(&self, at: &SurfacePoint, depth_m: f64) -> bool {
                self.0.holds_outside(at, depth_m)
            }

            fn chart(&self, at: &SurfacePoint) -> Option<crate::chart::Chart> {
                self.0.chart(at)
            }

            fn grown(&self, radius_m: f64) -> Option<Self> {
                self.0.grown(radius_m).map(Self)
            }
        }
    };
}
pub(crate) use is_a_frustum;
