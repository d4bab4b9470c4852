//! A face of a mesh: plane, corners and what lies across each edge, in one cache line.

use nalgebra::Vector3;

use super::Sides;

/// A triangle of a mesh.
///
/// Edge `i` runs from corner `i` to corner `(i + 1) % 3`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(64))]
pub struct Face {
    /// Outward unit normal.
    pub normal_B: Vector3<f64>,
    /// `normal . x` of its plane \[m\].
    pub offset_m: f64,
    /// Indices of its vertices.
    pub vertices: [u32; 3],
    /// What lies across each edge.
    pub links: [Link; 3],
    /// From where its part of the mesh is felt.
    pub sides: Sides,
    /// Whether other faces of closed parts pass through it, of which no link tells.
    pub is_crossed: bool,
    /// Presence of another closed part beside it, touching or with a crack between them that no finger feels.
    pub is_beside: bool,
    /// It is a wall so low that no finger feels it, or has a vertex of one.
    pub is_at_ledge: bool,
}

/// The neighbour across an edge: which face, which of its edges is the shared one, and how it is wound.
///
/// Packed into a word: bits 3.. face, bit 2 winding, bits 0-1 edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Link(u32);

impl Link {
    /// No face across this edge: the mesh ends here.
    pub const BOUNDARY: Self = Self(u32::MAX);
    /// The most faces that a link can tell apart.
    pub const MAX_FACES: usize = (u32::MAX >> 3) as usize;

    /// The neighbour `face`, which shares its edge `edge` (0 to 2).
    ///
    /// `turned` says that it is wound the other way round: both faces run along the shared edge in the same
    /// direction. This happens only on surfaces that cannot be oriented.
    pub fn new(face: u32, edge: u8, turned: bool) -> Self {
        debug_assert!(edge < 3 && (face as usize) < Self::MAX_FACES);
        Self(face << 3 | u32::from(turned) << 2 | u32::from(edge))
    }

    /// Whether the mesh ends here.
    pub fn is_boundary(self) -> bool {
        self == Self::BOUNDARY
    }

    /// Index of the neighbour. Meaningless on a boundary.
    pub fn face(self) -> u32 {
        self.0 >> 3
    }

    /// The neighbour's edge that is the shared one, 0 to 2.
    pub fn edge(self) -> usize {
        (self.0 & 0b11) as usize
    }

    /// Whether the neighbour's outside is this face's inside.
    pub fn is_turned(self) -> bool {
        self.0 & 0b100 != 0
    }
}

const _: () = assert!(size_of::<Face>() == 64 && align_of::<Face>() == 64);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_tells_what_it_was_made_of() {
        for (face, edge, turned) in [(0, 0, false), (7, 2, true), (Link::MAX_FACES as u32 - 1, 1, true)] {
            let link = Link::new(face, edge, turned);
            assert_eq!((link.face(), link.edge(), link.is_turned()), (face, edge as usize, turned));
            assert!(!link.is_boundary());
        }
        assert!(Link::BOUNDARY.is_boundary());
    }
}
