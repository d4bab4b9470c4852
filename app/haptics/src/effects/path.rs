//! A polyline, and places on it.
//!
//! Model: straight pieces from point to point; one that ends where it began is closed, and goes on there. Going down means
//! along the path, as long as every step brings it nearer to the finger: to the next local minimum of the distance. On a
//! piece the nearest place is the projection; on the outer side of a corner it is the corner itself.
//! Frames: world. Cost: linear in the pieces; going down mostly looks at one or two.

use nalgebra::Vector3;

use super::track::{END_M, Foot};

/// The way through some points.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Path {
    points_W: Box<[Vector3<f64>]>,
    is_closed: bool,
}

/// A place on a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spot {
    piece: usize,
    /// Of the piece, 0 to 1.
    share: f64,
}

/// Within which a place may move.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ball {
    pub(super) centre_W: Vector3<f64>,
    pub(super) radius_m: f64,
}

impl Path {
    /// Through two points at least, no two in a row the same.
    pub(super) fn new(points_W: &[Vector3<f64>]) -> Self {
        let is_closed = points_W.len() > 2 && points_W.first() == points_W.last();
        Self { points_W: points_W.into(), is_closed }
    }

    /// The place nearest to a point, the first of equally near ones.
    pub(super) fn nearest(&self, p_W: &Vector3<f64>) -> Spot {
        let spots = (0..self.pieces()).map(|piece| Spot { piece, share: self.share(piece, p_W) });
        let far = |spot: &Spot| (p_W - self.point(spot)).norm_squared();
        let nearer = |best: (Spot, f64), spot: Spot| {
            let far = far(&spot);
            if far < best.1 { (spot, far) } else { best }
        };
        spots.fold((Spot { piece: 0, share: 0.0 }, f64::INFINITY), nearer).0
    }

    /// From a place down towards a point, until the distance has a minimum or the way leaves the ball.
    pub(super) fn descend(&self, from: Spot, p_W: &Vector3<f64>, within: &Ball) -> Spot {
        let mut at = from;
        for _ in 0..=self.pieces() {
            let next = Spot { share: self.share(at.piece, p_W), ..at };
            if let Some(part) = within.left(&self.point(&at), &self.point(&next)) {
                return Spot { share: at.share + (next.share - at.share) * part, ..at };
            }
            match self.beyond(&next).filter(|other| self.share(other.piece, p_W) != other.share) {
                Some(other) => at = other,
                None => return next,
            }
        }
        at
    }

    pub(super) fn point(&self, spot: &Spot) -> Vector3<f64> {
        let (from_W, to_W) = self.ends(spot.piece);
        from_W + (to_W - from_W) * spot.share
    }

    /// With the directions in which a finger is free there: the piece's, and beside a corner in part the next one's.
    pub(super) fn foot(&self, spot: &Spot) -> Foot {
        let (along_W, length_m) = self.direction(spot.piece);
        let (is_late, from_end) = (spot.share > 0.5, spot.share.min(1.0 - spot.share));
        let corner = Spot { share: if is_late { 1.0 } else { 0.0 }, ..*spot };
        let other_W = self.beyond(&corner).map(|other| self.direction(other.piece).0);
        let width_m = END_M.min(0.5 * length_m);
        let part = other_W.map_or(0.0, |_| 0.5 * (1.0 - from_end * length_m / width_m).max(0.0));
        Foot::along(self.point(spot), [(along_W, 1.0 - part), (other_W.unwrap_or(along_W), part)])
    }

    /// The same place as the end of the next piece, if it is the end of one.
    fn beyond(&self, spot: &Spot) -> Option<Spot> {
        let last = self.pieces() - 1;
        let (piece, share) = match (spot.share, spot.piece) {
            (1.0, piece) if piece < last => (piece + 1, 0.0),
            (1.0, _) if self.is_closed => (0, 0.0),
            (0.0, piece) if piece > 0 => (piece - 1, 1.0),
            (0.0, _) if self.is_closed => (last, 1.0),
            _ => return None,
        };
        Some(Spot { piece, share })
    }

    /// Projection of a point on a piece, 0 to 1.
    fn share(&self, piece: usize, p_W: &Vector3<f64>) -> f64 {
        let (from_W, to_W) = self.ends(piece);
        let way_W = to_W - from_W;
        let share = (way_W.dot(&(p_W - from_W)) / way_W.norm_squared()).clamp(0.0, 1.0);
        if share.is_nan() { 0.0 } else { share }
    }

    /// Unit vector and length (m).
    fn direction(&self, piece: usize) -> (Vector3<f64>, f64) {
        let (from_W, to_W) = self.ends(piece);
        let length_m = (to_W - from_W).norm();
        ((to_W - from_W) / length_m, length_m)
    }

    fn ends(&self, piece: usize) -> (Vector3<f64>, Vector3<f64>) {
        let point = |at: usize| self.points_W.get(at).copied().unwrap_or_default();
        (point(piece), point(piece + 1))
    }

    fn pieces(&self) -> usize {
        self.points_W.len() - 1
    }
}

impl Ball {
    /// At which part of the straight way from a point within to another one it is left; `None`: not at all.
    fn left(&self, from_W: &Vector3<f64>, to_W: &Vector3<f64>) -> Option<f64> {
        if (to_W - self.centre_W).norm_squared() <= self.radius_m * self.radius_m {
            return None;
        }
        let (way_W, off_W) = (to_W - from_W, from_W - self.centre_W);
        let (a, b) = (way_W.norm_squared(), way_W.dot(&off_W));
        let room = (self.radius_m * self.radius_m - off_W.norm_squared()).max(0.0);
        let part = ((b * b + a * room).sqrt() - b) / a;
        Some(if part.is_nan() { 0.0 } else { part.clamp(0.0, 1.0) })
    }
}
