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
//! serves any number of contacts.

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
}

/// A friction model: implement it to plug in your own.
pub trait FrictionLaw {
    /// Does the god-object stay where it is? `true` ends the tick in [`FrictionState::Stick`].
    fn holds(&self, query: &FrictionQuery) -> bool;

    /// How far the god-object still has to move towards the surface point \[m\].
    ///
    /// Implicit in the tick: the answer `m` satisfies
    /// `gap - m = load * mu((travel + m) / dt)`. Negative when the god-object has gone too far; a
    /// negative answer *before* it moved means that it lies inside the friction circle, and it then
    /// stays, still in slip. A curve that falls with speed has several roots: document the choice.
    fn slide(&self, query: &FrictionQuery) -> f64;

    /// The largest ratio of tangential to normal force in this state at this speed \[m/s\].
    ///
    /// In [`FrictionState::Stick`] it bounds spring and damping together.
    fn ratio_limit(&self, state: FrictionState, speed_m_s: f64) -> f64;
}
