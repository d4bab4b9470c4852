//! Triangles as a file or a generator gives them: nothing is known of how they hang together.

use super::{Link, MeshError};
use nalgebra::Vector3;

/// Points, and triples of them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TriangleSoup {
    /// In the object's frame B \[m\].
    pub vertices: Vec<Vector3<f64>>,
    /// Indices of three vertices each, counter-clockwise seen from outside where the source knows.
    pub faces: Vec<[u32; 3]>,
}

/// Products of four coordinates (a volume times a length) must stay finite; and nothing that is felt is larger.
pub(super) const LARGEST_COORDINATE_M: f64 = 1e9;

/// Each face may bring three vertices of its own, as in STL.
const MAX_VERTICES: usize = 3 * Link::MAX_FACES;

impl TriangleSoup {
    /// Refuses what no mesh can be made of: after this, indices and coordinates can be relied on.
    pub(super) fn validate(&self) -> Result<(), MeshError> {
        check_number("faces", self.faces.len(), Link::MAX_FACES)?;
        check_number("vertices", self.vertices.len(), MAX_VERTICES)?;
        let usable = |x: &f64| x.abs() <= LARGEST_COORDINATE_M;
        if let Some(vertex) = self.vertices.iter().position(|v| !v.iter().all(usable)) {
            return Err(MeshError::Coordinate { vertex, value: self.vertices[vertex].into() });
        }
        let vertices = self.vertices.len();
        let known = |index: &u32| (*index as usize) < vertices;
        if let Some(face) = self.faces.iter().position(|f| !f.iter().all(known)) {
            return Err(MeshError::Index { face, found: self.faces[face], vertices });
        }
        Ok(())
    }
}

fn check_number(what: &'static str, found: usize, allowed: usize) -> Result<(), MeshError> {
    if found == 0 || found > allowed {
        return Err(MeshError::Number { what, found, allowed });
    }
    Ok(())
}
