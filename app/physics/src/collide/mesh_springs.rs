//! Soft contacts of a mesh and another solid: all vertices of either that touch there, each its part of the springs.
//!
//! Problem: that of [`mesh_spread`], on what is no plane: near the rim of a box, on a cylinder, on another mesh. The few
//! vertices that have a role there take turns, and what they hold comes and goes with them.
//! Model: where one place alone is known, or several that go over into each other as in a bowl, all vertices within reach count, each
//! with its own normal and depth; nearby ones are told as one. Beside them count the points of a closed form, and the places where
//! edges are cut off.
//! Cost: a query for each place, and one more for each vertex within reach, both bounded: some hundreds of microseconds.

use super::mesh::{About, Contact, Told};
use super::mesh_corner::Corner;
use super::mesh_other::Solidity;
use super::mesh_solid::Place;
use super::mesh_span::Standing;
use super::mesh_spread::{self, How, Lows, Spread};
use super::{MAX_POINTS, mesh_found};
use haptics::mesh::Linear;

/// Tells all vertices that touch in any of these places, and what else was found; `false`: none is told, for they are too many.
pub(super) fn tell_springs<'p>(
    places: &(impl Iterator<Item = Place<'p>> + Clone),
    found: &[Contact],
    spread: &mut Spread,
    told: &mut Told<'_>,
) -> bool {
    let Some(first) = places.clone().next() else { return false };
    let others = || found.iter().filter(|contact| !first.is_vertex(contact));
    let room = MAX_POINTS.saturating_sub(others().count());
    let find = |lows: &mut Lows| {
        places.clone().all(|place| {
            lows.begin(place.number());
            place.find_of_mesh(lows) && place.find_of_other(lows)
        })
    };
    let how = How { room, most: MOST_VERTICES, ahead_m: first.meeting.travel_m };
    if room == 0 || !mesh_spread::tell(spread, &how, find, |contact| told.tell(contact)) {
        return false;
    }
    others().for_each(|contact| told.tell(contact));
    // What these hold comes and goes.
    spread.set_crowded(others().any(|contact| contact.gap_m < 0.0));
    true
}

impl Place<'_> {
    /// Finds the mesh's vertices; `false`: they are too many.
    fn find_of_mesh(&self, lows: &mut Lows) -> bool {
        let (mesh, (height, limits)) = (self.mesh, self.limits_of_mesh(0.0));
        let counts = |corner: Corner| match self.other.solid {
            Solidity::Mesh(_) => corner.sticks_out_here(mesh),
            Solidity::Form(_) => corner.is_bent_here(mesh),
        };
        let see = |corner| self.contact_of_vertex(corner).filter(|contact| self.is_here(contact));
        let standing = self.standing(height, &limits);
        lows.find(&Standing { reach_m: standing.reach_m + self.hollow_m(), ..standing }, counts, see)
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
        let standing = Standing { reach_m: standing.reach_m + self.hollow_m(), ..standing };
        lows.find(&standing, |corner| corner.sticks_out_here(second), see)
    }

    /// In a hollow, what lies higher over the plane of one place touches, too \[m\].
    fn hollow_m(&self) -> f64 {
        let own = &self.places.all[self.number()];
        let goes_on = self.places.all.iter().enumerate().any(|(at, patch)| {
            at != self.number() && patch.is_pressed() && !self.patches.all[at].is_known && own.is_pressed()
        });
        if goes_on { HOLLOW * self.mesh.extent_m() } else { 0.0 }
    }

    /// True of a vertex of either.
    fn is_vertex(&self, contact: &Contact) -> bool {
        let (_, id) = mesh_found::place_and_name(contact.id);
        match (About::point(id), self.other.solid) {
            (Some(About::Vertex(_)), _) => true,
            (Some(About::Other(number)), Solidity::Mesh(second)) => {
                (number as usize) < second.vertices().len()
            }
            _ => false,
        }
    }
}

/// Part of the mesh's extent that vertices lie higher in a hollow.
const HOLLOW: f64 = 0.1;
/// The most of which all count: for each the nearest point of the other one is sought.
const MOST_VERTICES: usize = 64;
