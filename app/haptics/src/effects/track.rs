//! What a guide leads along: a plane, a line, or a path through points.
//!
//! Frames: world. Cost: linear in the points of a path, at most [`MAX_PATH_POINTS`].

use nalgebra::Vector3;

use crate::error::{ParameterError, finite};

/// The most points of a path.
pub const MAX_PATH_POINTS: usize = 256;

/// Where a guided finger may go without feeling anything.
#[derive(Debug, Clone, PartialEq)]
pub struct Track(Kind);

#[derive(Debug, Clone, PartialEq)]
enum Kind {
    Plane { point_W: Vector3<f64>, normal_W: Vector3<f64> },
    Line { point_W: Vector3<f64>, direction_W: Vector3<f64> },
    Path(Box<[Vector3<f64>]>),
}

/// The track's point nearest to a finger.
#[derive(Debug, Clone, Copy)]
pub(super) struct Foot {
    pub(super) point_W: Vector3<f64>,
    direction: Direction,
}

/// Unit vectors.
#[derive(Debug, Clone, Copy)]
enum Direction {
    Along(Vector3<f64>),
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
        Ok(Self(Kind::Path(points_W.into())))
    }

    pub(super) fn foot(&self, p_W: &Vector3<f64>) -> Foot {
        match &self.0 {
            Kind::Plane { point_W, normal_W } => Foot {
                point_W: p_W - normal_W * normal_W.dot(&(p_W - point_W)),
                direction: Direction::Normal(*normal_W),
            },
            Kind::Line { point_W, direction_W } => Foot {
                point_W: point_W + direction_W * direction_W.dot(&(p_W - point_W)),
                direction: Direction::Along(*direction_W),
            },
            Kind::Path(points_W) => foot_on_path(points_W, p_W),
        }
    }
}

impl Foot {
    /// The part of a velocity that leaves the track, for a finger at `off_W` from here.
    ///
    /// Beyond the end of a path that is all of it; between, the part along the track fades in over a millimetre, so
    /// that passing the end gives no step.
    pub(super) fn across(&self, velocity_W: &Vector3<f64>, off_W: &Vector3<f64>) -> Vector3<f64> {
        match &self.direction {
            Direction::Normal(normal_W) => normal_W * normal_W.dot(velocity_W),
            Direction::Along(along_W) => {
                let beyond = off_W.dot(along_W);
                let free = 1.0 - beyond * beyond / (off_W.norm_squared() + END_M * END_M);
                velocity_W - along_W * (along_W.dot(velocity_W) * free)
            }
        }
    }
}

fn foot_on_path(points_W: &[Vector3<f64>], p_W: &Vector3<f64>) -> Foot {
    let feet = points_W.windows(2).map(|pair| foot_on_segment(&pair[0], &pair[1], p_W));
    let far = |foot: &Foot| (p_W - foot.point_W).norm_squared();
    // The first of equally near ones. There are two points at least.
    let nearer = |best: Foot, foot: Foot| if far(&foot) < far(&best) { foot } else { best };
    feet.reduce(nearer).unwrap_or(Foot { point_W: *p_W, direction: Direction::Along(Vector3::x()) })
}

fn foot_on_segment(from_W: &Vector3<f64>, to_W: &Vector3<f64>, p_W: &Vector3<f64>) -> Foot {
    let way_W = to_W - from_W;
    let fraction = (way_W.dot(&(p_W - from_W)) / way_W.norm_squared()).clamp(0.0, 1.0);
    Foot { point_W: from_W + way_W * fraction, direction: Direction::Along(way_W / way_W.norm()) }
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

/// How far beyond the end of a path the movement along it is damped in full, about \[m\].
const END_M: f64 = 1e-3;
