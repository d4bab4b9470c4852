//! Why no mesh can be made of a triangle soup.

use super::soup::LARGEST_COORDINATE_M;
use super::uv::LARGEST_UV;
use std::fmt;

/// A defect that cannot be repaired. Faces and vertices are named by their index in the input, from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum MeshError {
    /// None at all, or more than indices can tell apart.
    Number {
        /// "faces" or "vertices".
        what: &'static str,
        /// How many there are.
        found: usize,
        /// The most there may be; the least is 1.
        allowed: usize,
    },
    /// A coordinate that is not finite, or larger than anything that can be felt.
    Coordinate {
        /// The first vertex with such a coordinate.
        vertex: usize,
        /// Its coordinates (m).
        value: [f64; 3],
    },
    /// A face refers to a vertex that is not there.
    Index {
        /// The first such face.
        face: usize,
        /// Its indices.
        found: [u32; 3],
        /// How many vertices there are.
        vertices: usize,
    },
    /// Every face was degenerate.
    NothingLeft {
        /// How many faces there were.
        faces: usize,
    },
    /// Every face that has an area was a sliver upon another one.
    OnlySlivers {
        /// Number of faces that there were.
        faces: usize,
    },
    /// Not as many triples of texture coordinates as faces.
    UvNumber {
        /// How many triples there are.
        found: usize,
        /// How many faces there are.
        faces: usize,
    },
    /// Not as many labels as faces.
    LabelNumber {
        /// Number of labels.
        found: usize,
        /// Number of faces.
        faces: usize,
    },
    /// A texture coordinate that is not finite, or larger than any picture is repeated.
    Uv {
        /// The first face with such a coordinate.
        face: usize,
        /// The coordinates of its corners.
        found: [[f64; 2]; 3],
    },
    /// More faces around a vertex than may be walked round within a tick.
    Valence {
        /// Where the vertex is (m).
        at_B: [f64; 3],
        /// How many faces meet there.
        faces: usize,
        /// The most there may be.
        allowed: usize,
    },
}

impl fmt::Display for MeshError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number { what, found, allowed } => {
                write!(f, "the mesh has {found} {what}; allowed are 1 to {allowed}")
            }
            Self::Coordinate { vertex, value: [x, y, z] } => write!(
                f,
                "vertex {vertex} is at [{x:?}, {y:?}, {z:?}]; allowed are finite numbers of metres, at most \
                 {LARGEST_COORDINATE_M:e} in size: correct the vertex or the unit"
            ),
            Self::Index { face, found: [a, b, c], vertices } => write!(
                f,
                "face {face} refers to vertices [{a}, {b}, {c}], but there are {vertices}, counted from 0: is the \
                 file cut short?"
            ),
            Self::NothingLeft { faces } => write!(
                f,
                "none of the {faces} faces has an area; allowed is a mesh with at least one proper triangle: was \
                 it scaled to nothing?"
            ),
            Self::OnlySlivers { faces } => write!(
                f,
                "the {faces} faces are slivers that lie upon each other, with nothing between; allowed is a mesh with at \
                 least one proper triangle: was it scaled to nothing?"
            ),
            Self::UvNumber { found, faces } => write!(
                f,
                "{found} faces have texture coordinates, but there are {faces} faces; allowed are three for each"
            ),
            Self::LabelNumber { found, faces } => {
                write!(f, "{found} faces have labels, but there are {faces} faces; allowed is one for each")
            }
            Self::Uv { face, found } => write!(
                f,
                "face {face} has the texture coordinates {found:?}; allowed are finite numbers, at most \
                 {LARGEST_UV:e} in size"
            ),
            Self::Valence { at_B, faces, allowed } => write!(
                f,
                "{faces} faces meet at {at_B:?} m; allowed are {allowed} around a vertex: divide the fan by a ring"
            ),
        }
    }
}

impl std::error::Error for MeshError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_names_the_offender_what_was_found_and_what_is_allowed() {
        let message = MeshError::Index { face: 7, found: [0, 1, 9], vertices: 8 }.to_string();
        assert_eq!(
            message,
            "face 7 refers to vertices [0, 1, 9], but there are 8, counted from 0: is the file cut short?"
        );
        let message = MeshError::Coordinate { vertex: 3, value: [0.0, f64::NAN, 1.0] }.to_string();
        assert!(message.starts_with("vertex 3 is at [0.0, NaN, 1.0]; allowed are finite"), "{message}");
    }
}
