//! The description of a solid made of others, and what can be wrong with it.

use std::fmt;

use nalgebra::{Isometry3, Vector3};

use crate::error::ParameterError;
use crate::shape::Form;

/// A node of a tree: parts, and what becomes of them.
#[derive(Debug, Clone, PartialEq)]
pub struct CsgTree {
    /// What becomes of the parts.
    pub op: CsgOp,
    /// At least one.
    pub parts: Vec<CsgPart>,
}

/// How solids are joined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CsgOp {
    /// What is in any of them.
    Union,
    /// What is in all of them.
    Intersection,
    /// What is in the first and in no other.
    Difference,
}

/// A part of a tree: a shape, where it is, and how large.
#[derive(Debug, Clone, PartialEq)]
pub struct CsgPart {
    /// The shape.
    pub shape: PartShape,
    /// Its pose in the frame of the tree that it is a part of.
    pub pose: Isometry3<f64>,
    /// Factors along its own axes, applied before the pose.
    pub scale: [f64; 3],
}

/// What a part can be.
#[derive(Debug, Clone, PartialEq)]
pub enum PartShape {
    /// A closed form with sharp edges.
    Form(Form),
    /// A tree in turn.
    Tree(CsgTree),
}

/// The most leaves of a tree.
pub const MAX_LEAVES: usize = 256;
/// The most trees within each other.
pub const MAX_DEPTH: usize = 16;

impl CsgTree {
    /// What is in any of the parts.
    pub fn union(parts: impl IntoIterator<Item = impl Into<CsgPart>>) -> Self {
        Self::of(CsgOp::Union, parts)
    }

    /// What is in all of the parts.
    pub fn intersection(parts: impl IntoIterator<Item = impl Into<CsgPart>>) -> Self {
        Self::of(CsgOp::Intersection, parts)
    }

    /// What is in the first part and in no other.
    pub fn difference(parts: impl IntoIterator<Item = impl Into<CsgPart>>) -> Self {
        Self::of(CsgOp::Difference, parts)
    }

    fn of(op: CsgOp, parts: impl IntoIterator<Item = impl Into<CsgPart>>) -> Self {
        Self { op, parts: parts.into_iter().map(Into::into).collect() }
    }
}

impl CsgPart {
    /// A closed form in this pose.
    pub fn new(form: impl Into<Form>, pose: Isometry3<f64>) -> Self {
        Self { shape: PartShape::Form(form.into()), pose, scale: [1.0; 3] }
    }

    /// A tree in this pose.
    pub fn tree(tree: CsgTree, pose: Isometry3<f64>) -> Self {
        Self { shape: PartShape::Tree(tree), pose, scale: [1.0; 3] }
    }

    /// A closed form moved to a place.
    pub fn at(form: impl Into<Form>, place: Vector3<f64>) -> Self {
        Self::new(form, Isometry3::from_parts(place.into(), nalgebra::UnitQuaternion::identity()))
    }

    /// Scaled by these factors along its own axes.
    pub fn scaled(self, scale: [f64; 3]) -> Self {
        Self { scale, ..self }
    }
}

impl From<CsgTree> for CsgPart {
    fn from(tree: CsgTree) -> Self {
        Self::tree(tree, Isometry3::identity())
    }
}

impl<F: Into<Form>> From<F> for CsgPart {
    fn from(form: F) -> Self {
        Self::new(form, Isometry3::identity())
    }
}

/// A tree that is no solid.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum CsgError {
    /// A union, intersection or difference of nothing.
    NoParts,
    /// More leaves than a tick can look at.
    TooManyLeaves,
    /// Trees in trees in trees.
    TooDeep,
    /// A pose with a number that is not finite.
    NoPose,
    /// A scale that is not finite or not positive.
    Refused(ParameterError),
    /// A leaf with rounded edges, as a ball feels it.
    Rounded,
}

impl fmt::Display for CsgError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoParts => {
                write!(f, "a union, intersection or difference has no parts; allowed is at least one")
            }
            Self::TooManyLeaves => {
                write!(f, "the tree has more than {MAX_LEAVES} leaves; allowed are as many at most")
            }
            Self::TooDeep => {
                write!(f, "more than {MAX_DEPTH} trees lie within each other; allowed are as many at most")
            }
            Self::NoPose => write!(f, "the pose of a part is not finite; allowed are finite numbers"),
            Self::Refused(error) => error.fmt(f),
            Self::Rounded => {
                write!(f, "a leaf was grown by a ball's radius; allowed are forms as they were made")
            }
        }
    }
}

impl std::error::Error for CsgError {}

impl From<ParameterError> for CsgError {
    fn from(error: ParameterError) -> Self {
        Self::Refused(error)
    }
}
