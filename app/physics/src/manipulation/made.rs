//! What a tick took and did, and who was parked in it.

/// What a tick took and did.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Made {
    /// Contact points, those of fingers among them.
    pub rows: usize,
    /// Rounds of the solver: of the island that took most.
    pub sweeps: usize,
    /// What was left of its equations, as a share of all forces ([`Solved::residual`](crate::Solved::residual)).
    pub residual: f64,
    /// Islands for which it found no answer.
    pub unsolved: usize,
    /// Bodies that were parked in this tick: the last so many of [`Manipulation::parked`](crate::Manipulation::parked).
    pub parked: usize,
    /// Bodies that were stepped.
    pub awake: usize,
    /// Bodies that would have been, and wait for their [turn](crate::Manipulation::step_at_most).
    pub held: usize,
}

/// A body that does not move any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parked {
    /// Index of the entity.
    pub entity: usize,
    /// What became of it.
    pub why: Reason,
}

/// Why a body was parked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// It was farther from the origin than [`Settings::world_radius_m`](crate::Settings::world_radius_m).
    LeftTheWorld,
    /// Where it was or how it moved was no number any more.
    NotANumber,
}
