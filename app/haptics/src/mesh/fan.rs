//! The faces around a vertex, one after the other.

use super::place::{Facet, Side, next, previous};
use super::{MAX_VALENCE, Mesh};

/// A face seen from one of its corners.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sector<'m> {
    pub(crate) facet: Facet<'m>,
    pub(crate) corner: usize,
}

/// Calls `visit` for every face around a corner, and says whether the fan is closed.
///
/// From the given face on one way round; where the mesh ends, from there on the other way.
pub(crate) fn for_each_around<'m>(
    mesh: &'m Mesh,
    side: Side,
    corner: usize,
    mut visit: impl FnMut(Sector<'m>),
) -> bool {
    let first = Sector { facet: Facet::of(mesh, side), corner };
    visit(first);
    let mut visited = 1;
    for edge in [previous(corner), corner] {
        let (mut sector, mut edge) = (first, edge);
        while let Some((over, arrived_by)) = sector.over(mesh, edge) {
            if over.facet.side.face == side.face {
                return true;
            }
            visit(over);
            visited += 1;
            if visited >= MAX_VALENCE {
                return true;
            }
            // The corner's other edge leads on.
            edge = if arrived_by == over.corner { previous(over.corner) } else { over.corner };
            sector = over;
        }
    }
    false
}

impl<'m> Sector<'m> {
    /// The sector across one of the corner's two edges, and the edge of that face by which it was reached.
    pub(super) fn over(&self, mesh: &'m Mesh, edge: usize) -> Option<(Self, usize)> {
        let link = self.facet.face.links[edge];
        let facet = Facet::of(mesh, self.facet.side.across(link)?);
        let shared = link.edge();
        // Neighbours run along the shared edge in opposite directions, unless one of them is turned.
        let at_start_here = edge == self.corner;
        let at_start_there = at_start_here == link.is_turned();
        Some((Self { facet, corner: if at_start_there { shared } else { next(shared) } }, shared))
    }
}
