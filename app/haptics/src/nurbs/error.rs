//! Refuses patches that are no surface, and sets of them that nobody could touch.

use std::fmt;

/// Why patches were refused. Patches, directions (`u`, `v`) and indices count as the caller gave them, from 0.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum NurbsError {
    /// There is none.
    NoPatch,
    /// None of them has an area.
    NoArea {
        /// How many there are.
        patches: usize,
    },
    /// Something about one patch.
    Patch {
        /// Which one.
        patch: usize,
        /// Which part of it, such as `degree u`.
        part: String,
        /// Found in its place.
        found: String,
        /// What is allowed.
        allowed: String,
    },
    /// More than two patches along one line: nobody could say what lies beyond.
    TooManyAtEdge {
        /// Three that meet there.
        patches: [usize; 3],
        /// A point of the edge (m).
        point_B: [f64; 3],
    },
    /// More memory than a surface is meant to take.
    TooLarge {
        /// The most that it takes (bytes).
        most_bytes: usize,
    },
}

impl fmt::Display for NurbsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoPatch => write!(f, "found no patch; allowed: at least one"),
            Self::NoArea { patches } => {
                write!(f, "of {patches} patches none has an area; allowed: at least one with an area")
            }
            Self::Patch { patch, part, found, allowed } => {
                write!(f, "patch {patch}: {part}: found {found}; allowed: {allowed}")
            }
            Self::TooManyAtEdge { patches: [a, b, c], point_B: [x, y, z] } => write!(
                f,
                "patches {a}, {b} and {c} have an edge through ({x}, {y}, {z}) in common; allowed: two patches at an edge"
            ),
            Self::TooLarge { most_bytes } => write!(
                f,
                "the patches would take more than {} MB of memory; allowed: fewer or simpler patches, or a lower degree",
                most_bytes >> 20
            ),
        }
    }
}

impl std::error::Error for NurbsError {}
