//! What a guide leads along: a plane, a line, or a path through points.
//!
//! Frames: world. Cost: linear in the points of a path, at most [`MAX_PATH_POINTS`].

use nalgebra::Vector3;

use super::path::Path;
use crate::error::{ParameterError, finite};

/// The most points of a path.
pub const MAX_PATH_POINTS: usize = 256;

/// Where a guided finger may go without feeling anything.
#[derive(Debug, Clone, PartialEq)]
pub struct Track(pub(super) Kind);

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Kind {
    Plane { point_W: Vector3<f64>, normal_W: Vector3<f64> },
    Line { point_W: Vector3<f64>, direction_W: Vector3<f64> },
    Path(Path),
}

/// A place of the track that a finger is drawn to.
#[derive(Debug, Clone, Copy)]
pub(super) struct Foot {
    pub(super) point_W: Vector3<f64>,
    direction: Direction,
}

/// Unit vectors.
#[derive(Debug, Clone, Copy)]
enum Direction {
    /// By their parts, which add up to 1.
    Along([(Vector3<f64>, f64); 2]),
    Normal(Vector3<f64>),
}

impl Track {
    /// All points of a plane, given by one of them and a normal of any length.
    ///
    /// Errors: a normal without direction, a point that is not finite.
    pub fn plane(point_W: Vector3<f64>, normal_W: Vector3<f64>) -> Result<Self, ParameterError> {
        let normal_W = direction("normal", normal_W)?;
        Ok(Self(Kind::Plane { point_W: place("point_m", point_W)?, normal_W }))
    }

    /// All points of a line without ends, given by one of them and a direction of any length.
    ///
    /// Errors: a direction without length, a point that is not finite.
    pub fn line(point_W: Vector3<f64>, direction_W: Vector3<f64>) -> Result<Self, ParameterError> {
        let direction_W = direction("direction", direction_W)?;
        Ok(Self(Kind::Line { point_W: place("point_m", point_W)?, direction_W }))
    }

    /// Straight from point to point; a closed path ends where it began.
    ///
    /// Errors: less than two points or more than [`MAX_PATH_POINTS`], two equal ones in a row, one that is not finite.
    pub fn path(points_W: &[Vector3<f64>]) -> Result<Self, ParameterError> {
        if !(2..=MAX_PATH_POINTS).contains(&points_W.len()) {
            let (parameter, value) = ("number of points_m", points_W.len() as f64);
            return Err(ParameterError::OutOfRange { parameter, value, allowed: "a number from 2 to 256" });
        }
        for point_W in points_W {
            place("points_m", *point_W)?;
        }
        for pair in points_W.windows(2) {
            direction("way from one of points_m to the next", pair[1] - pair[0])?;
        }
        Ok(Self(Kind::Path(Path::new(points_W))))
    }

    /// The nearest place.
    pub(super) fn foot(&self, p_W: &Vector3<f64>) -> Foot {
        match &self.0 {
            Kind::Plane { point_W, normal_W } => Foot::on_plane(point_W, normal_W, p_W),
            Kind::Line { point_W, direction_W } => Foot::on_line(point_W, direction_W, p_W),
            Kind::Path(path) => path.foot(&path.nearest(p_W)),
        }
    }
}

impl Foot {
    /// On a plane through a point.
    pub(super) fn on_plane(point_W: &Vector3<f64>, normal_W: &Vector3<f64>, p_W: &Vector3<f64>) -> Self {
        let foot_W = p_W - normal_W * normal_W.dot(&(p_W - point_W));
        Self { point_W: foot_W, direction: Direction::Normal(*normal_W) }
    }

    /// On a line through a point.
    pub(super) fn on_line(point_W: &Vector3<f64>, along_W: &Vector3<f64>, p_W: &Vector3<f64>) -> Self {
        let foot_W = point_W + along_W * along_W.dot(&(p_W - point_W));
        Self::along(foot_W, [(*along_W, 1.0), (*along_W, 0.0)])
    }

    /// Here, with the directions of the track and their parts, which add up to 1.
    pub(super) fn along(point_W: Vector3<f64>, directions_W: [(Vector3<f64>, f64); 2]) -> Self {
        Self { point_W, direction: Direction::Along(directions_W) }
    }

    /// The part of a velocity that leaves the track, for a finger at `off_W` from here.
    ///
    /// Beyond the end of a path that is all of it; between, the part along the track fades in over a millimetre, so
    /// that passing the end gives no step.
    pub(super) fn across(&self, velocity_W: &Vector3<f64>, off_W: &Vector3<f64>) -> Vector3<f64> {
        match &self.direction {
            Direction::Normal(normal_W) => normal_W * normal_W.dot(velocity_W),
            Direction::Along(directions_W) => {
                let along = |(along_W, part): &(Vector3<f64>, f64)| {
                    let beyond = off_W.dot(along_W);
                    let free = 1.0 - beyond * beyond / (off_W.norm_squared() + END_M * END_M);
                    along_W * (along_W.dot(velocity_W) * free * part)
                };
                velocity_W - directions_W.iter().map(along).sum::<Vector3<f64>>()
            }
        }
    }
}

fn place(parameter: &'static str, point: Vector3<f64>) -> Result<Vector3<f64>, ParameterError> {
    point.iter().try_for_each(|value| finite(parameter, *value).map(|_| ()))?;
    Ok(point)
}

fn direction(parameter: &'static str, v: Vector3<f64>) -> Result<Vector3<f64>, ParameterError> {
    let length = v.norm();
    // Its square is used as well.
    if !length.is_normal() || !(length * length).is_normal() {
        return Err(ParameterError::NoDirection { parameter, value: v.into() });
    }
    Ok(v / length)
}

/// How far beyond the end of a path the movement along it is damped in full, and how far from a corner its directions
/// turn from one to the other, about \[m\].
pub(super) const END_M: f64 = 1e-3;
