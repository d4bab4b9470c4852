//! Triangles as a file or a generator gives them: nothing is known of how they hang together.

use nalgebra::Vector3;

/// Points, and triples of them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TriangleSoup {
    /// In the object's frame B \[m\].
    pub vertices: Vec<Vector3<f64>>,
    /// Indices of three vertices each, counter-clockwise seen from outside where the source knows.
    pub faces: Vec<[u32; 3]>,
}
