//! What the Friction Cone Algorithm asks of a friction model.
//!
//! Model: a law is a curve of friction ratio against speed plus a rule for when sliding starts and
//! ends (Melder ch. 4.1.2: any model that can be drawn as friction against velocity). It never sees
//! geometry, only lengths in the tangent plane of the god-object: the gap D = |G - S| and the load,
//! which is the normal force expressed as spring depth, N / k. Without contact damping the load
//! is the depth d itself.
//!
//! Signs: the gap is measured against the direction of motion, positive while the god-object lags
//! behind the surface point. A slide is positive towards it.
//!
//! Invariants a law keeps: finite answers for finite queries; no memory of its own, so that one law
//! serves any number of contacts. What it has to remember of a contact it keeps in that contact's
//! [`FrictionMemory`].

/// Whether a contact holds or slides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum FrictionState {
    /// The god-object holds its place on the surface.
    #[default]
    Stick,
    /// The god-object slides, or has slid and has not yet been caught again.
    Slip,
}

/// What a law is told. Fields may be added: build it with `..Default::default()`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FrictionQuery {
    /// State at the end of the last tick.
    pub state: FrictionState,
    /// Signed distance of the god-object behind the surface point, along the tangent plane \[m\].
    pub gap_m: f64,
    /// Normal force over stiffness \[m\]; the depth of penetration when there is no damping.
    pub load_m: f64,
    /// How far the god-object has already been moved in this tick, in the same direction \[m\].
    pub travel_m: f64,
    /// Length of the tick \[s\]; not positive when unknown, and then speeds count as zero.
    pub dt_s: f64,
    /// How far the HIP has moved along the tangent plane since the last tick \[m\], >= 0.
    pub hip_travel_m: f64,
    /// The part of the gap along that motion of the HIP \[m\]: negative while the HIP comes back
    /// towards the god-object, zero where it has not moved.
    pub gap_along_hip_m: f64,
    /// How far the god-object moved in the last tick \[m\], >= 0; below what counts as rest, zero.
    pub last_travel_m: f64,
    /// Stiffness of the contact \[N/m\], > 0: for models in newtons.
    pub stiffness_n_per_m: f64,
}

impl FrictionQuery {
    /// Speed of the HIP along the tangent plane \[m/s\]; zero where time is unknown.
    pub fn hip_speed_m_s(&self) -> f64 {
        if self.dt_s > 0.0 { self.hip_travel_m / self.dt_s } else { 0.0 }
    }
}

/// What a law remembers of one contact: as many numbers as the hungriest model needs, all zero when
/// the contact begins.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FrictionMemory {
    /// Whatever the law makes of them.
    pub words: [f64; MEMORY_WORDS],
}

/// Numbers in a [`FrictionMemory`].
pub const MEMORY_WORDS: usize = 24;

/// A friction model: implement it to plug in your own.
pub trait FrictionLaw {
    /// Does the god-object stay where it is? `true` ends the tick in [`FrictionState::Stick`].
    ///
    /// Asked first and exactly once in a tick, so that this is the place to go on in `memory`.
    fn holds(&self, query: &FrictionQuery, memory: &mut FrictionMemory) -> bool;

    /// How far the god-object still has to move towards the surface point \[m\].
    ///
    /// Implicit in the tick: the answer `m` of a model with a curve satisfies
    /// `gap - m = load * mu((travel + m) / dt)`. Negative when the god-object has gone too far; a
    /// negative answer *before* it moved means that it lies inside the friction circle, and it then
    /// stays, still in slip. A curve that falls with speed has several roots: document the choice.
    fn slide(&self, query: &FrictionQuery, memory: &FrictionMemory) -> f64;

    /// Radius of the circle within which the god-object is held \[m\]: while the contact sticks, it
    /// bounds spring, damping and drag together. Asked after `holds`, with the memory as that left it.
    fn held_limit_m(&self, query: &FrictionQuery, memory: &FrictionMemory) -> f64;

    /// Whether [`Self::drag_m`] can be anything but zero; where it cannot, nobody asks.
    fn drags(&self) -> bool {
        true
    }

    /// What is felt beside the spring, against the motion of the HIP \[m of spring\].
    ///
    /// For models whose force depends on the speed in a way that no place of the god-object shows.
    fn drag_m(&self, query: &FrictionQuery, memory: &FrictionMemory) -> f64 {
        let _ = (query, memory);
        0.0
    }
}
