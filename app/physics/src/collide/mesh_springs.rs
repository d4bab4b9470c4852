//! Soft contacts of a mesh and another solid: all vertices of either that touch there, each a spring.
//!
//! Problem: that of [`mesh_spread`], on what is no plane: near the rim of a box, on a cylinder, on another mesh. The few
//! vertices that have a role there take turns, and what they hold comes and goes with them.
//! Model: where one place alone is known, its vertices within reach count, each with its own normal and depth; nearby ones
//! are told as one. Beside them count the points of a closed form, and the places where edges are cut off.
//! Cost: a query, and one more for each vertex within reach, both bounded: hundreds of microseconds, of
//! two meshes that stand on each other with hundreds of vertices some milliseconds.

use super::mesh::{About, Contact, Told};
use super::mesh_corner::Corner;
use super::mesh_other::Solidity;
use super::mesh_solid::Place;
use super::mesh_spread::{self, Lows, Spread};
use super::{MAX_POINTS, mesh_found};
use haptics::mesh::Linear;

impl Place<'_> {
    /// Tells all vertices that touch here, and what else was found; `false`: none is told, for they are too many.
    pub(super) fn tell_springs(&self, found: &[Contact], spread: &mut Spread, told: &mut Told<'_>) -> bool {
        let others = || found.iter().filter(|contact| !self.is_vertex(contact));
        let room = MAX_POINTS.saturating_sub(others().count());
        let find = |lows: &mut Lows| self.find_of_mesh(lows) && self.find_of_other(lows);
        if room == 0 || !mesh_spread::tell(spread, room, find, |contact| told.tell(contact)) {
            return false;
        }
        others().for_each(|contact| told.tell(contact));
        // What these hold comes and goes.
        spread.set_crowded(others().any(|contact| contact.gap_m < 0.0));
        true
    }

    /// Finds the mesh's vertices; `false`: they are too many.
    fn find_of_mesh(&self, lows: &mut Lows) -> bool {
        let (mesh, (height, limits)) = (self.mesh, self.limits_of_mesh(0.0));
        let counts = |corner: Corner| match self.other.solid {
            Solidity::Mesh(_) => corner.sticks_out_here(mesh),
            Solidity::Form(_) => corner.is_bent_here(mesh),
        };
        let see = |corner| self.contact_of_vertex(corner).filter(|contact| self.is_here(contact));
        lows.find(&self.standing(height, &limits), counts, see)
    }

    /// Finds those of another mesh.
    fn find_of_other(&self, lows: &mut Lows) -> bool {
        let Solidity::Mesh(second) = self.other.solid else { return true };
        let (mut of_second, limits) = ([Linear::ONE; 5], self.limits_of_other(0.0));
        let standing = self.other.standing(second, &self.meeting, &limits, &mut of_second);
        let see = |corner| {
            let own = self.other.own_vertex(second, corner);
            self.contact_of_own(&own).filter(|contact| self.is_here(contact))
        };
        lows.find(&standing, |corner| corner.sticks_out_here(second), see)
    }

    /// True of a vertex of either, in this place or in one that is taken for a part of it.
    fn is_vertex(&self, contact: &Contact) -> bool {
        let (place, id) = mesh_found::place_and_name(contact.id);
        if place != 0 && self.patches.all[place].is_known {
            return false;
        }
        match (About::point(id), self.other.solid) {
            (Some(About::Vertex(_)), _) => true,
            (Some(About::Other(number)), Solidity::Mesh(second)) => {
                (number as usize) < second.vertices().len()
            }
            _ => false,
        }
    }
}
