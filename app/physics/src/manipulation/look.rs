//! What can be asked about the bodies between two ticks.

use super::{Manipulation, Parked};
use crate::body::Body;
use crate::broad_phase::BroadPhase;
use crate::grasp::{self, GraspQuality};
use crate::grasp_axis::GraspAxis;
use crate::roster::Standing;
use crate::row::Row;
use crate::solver::Islands;

impl Manipulation {
    /// How well the fingers held a body in the last tick. Not part of a tick: it takes up to 20 microseconds.
    pub fn grasp_quality(&self, body: usize) -> Option<GraspQuality> {
        let state = self.roster.bodies.get(body)?;
        let Some(place) = self.roster.place(body) else { return Some(GraspQuality::default()) };
        let weight_W = self.settings.gravity_W * state.mass.mass_kg;
        // Arms are those of the tick's beginning: any centre will do.
        Some(grasp::quality(&self.room.rows, self.pressing, place, (&state.centre_W, &weight_W)))
    }

    /// The line between the two fingers that held a body in the last tick.
    pub fn grasp_axis(&self, body: usize) -> Option<GraspAxis> {
        self.roster.place(body).and_then(|_| self.hand.axis(body))
    }

    /// The bodies, in the order in which they were given.
    pub fn bodies(&self) -> &[Body] {
        &self.roster.bodies
    }

    /// The bodies that may not be as they were when [`Self::forget_changes`] was last called.
    pub fn changed(&self) -> &[u32] {
        &self.changed
    }

    /// Number of times that pairs of entities near each other, or contact points, were left out for want of room.
    pub fn left_out(&self) -> u64 {
        self.pairs.left_out
    }

    /// Number of pairs of entities that are near each other.
    pub fn pair_count(&self) -> usize {
        self.pairs.key_count()
    }

    /// Number of pairs that have room.
    pub fn pair_room(&self) -> usize {
        self.pairs.room()
    }

    /// Somebody has taken note of all changes.
    pub fn forget_changes(&mut self) {
        for body in self.changed.drain(..) {
            self.has_changed[body as usize] = false;
        }
    }

    pub(super) fn note_change(&mut self, body: usize) {
        if !std::mem::replace(&mut self.has_changed[body], true) {
            self.changed.push(body as u32);
        }
    }

    /// Whether the entity of this number is a body.
    pub fn is_body(&self, entity: usize) -> bool {
        self.body_of(entity).is_some()
    }

    /// Which body the entity of this number is.
    pub fn body_of(&self, entity: usize) -> Option<usize> {
        self.roster.numbers.get(entity).copied().flatten().map(|body| body as usize)
    }

    /// Which entity a body is.
    pub fn entity_of(&self, body: usize) -> usize {
        self.roster.entities[body]
    }

    /// What becomes of a body in a tick.
    pub fn standing(&self, body: usize) -> Standing {
        self.roster.standing(body)
    }

    /// Where all entities are, roughly.
    pub fn broad_phase(&self) -> &BroadPhase {
        &self.broad_phase
    }

    /// The contact points of the last tick, with their forces. Their bodies are [places](Self::awake).
    pub fn rows(&self) -> &[Row] {
        &self.room.rows
    }

    /// Which bodies were in touch in the last tick, by their places among those that are awake.
    pub fn islands(&self) -> &Islands {
        self.room.solver.islands()
    }

    /// The numbers of the bodies that are stepped, in ascending order; their places here are what rows call bodies.
    pub fn awake(&self) -> &[usize] {
        self.roster.awake()
    }

    /// What the springs between entities hold after the last tick, less what bodies [owe](Self::owed_j) \[J\]; with the bodies'
    /// kinetic energy and gravity's it never grows while no finger presses.
    pub fn elastic_energy_j(&self) -> f64 {
        self.pairs.iter().map(|(_, pair)| pair.elastic_energy_j()).sum::<f64>() - self.owed_j()
    }

    /// What the bodies that are stepped here have got by turning in finite steps, and have not paid back yet \[J\].
    pub fn owed_j(&self) -> f64 {
        let is_here = |body: &usize| !self.roster.standing(*body).is_away();
        (0..self.roster.bodies.len()).filter(is_here).map(|body| self.roster.owed_j[body]).sum()
    }

    /// Of each pair of entities what its springs may press with in the next tick \[J\], and its rows of the last tick.
    pub fn springs(&self) -> impl Iterator<Item = ([usize; 2], f64, &[Row])> {
        self.pairs
            .iter()
            .map(|(_, pair)| (pair.entities, pair.elastic_energy_j(), pair.rows(&self.room.rows)))
    }

    /// Bodies that do not move any more, in the order in which they were parked: the last [`Made::parked`](crate::Made::parked) of them in the last
    /// tick.
    pub fn parked(&self) -> &[Parked] {
        &self.parked
    }
}
