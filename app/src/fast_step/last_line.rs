//! Last line before a force is commanded: no change of it that nothing moved for.
//!
//! Problem: a hand is thrown by what a force does from one tick to the next, whoever makes it do so: a contact that drops out
//! for a tick and comes back, a normal that turns over, an algorithm or an effect with a step in it. Each of them bounds its
//! own; this is for what nobody thought of, and knows nothing of how a force was found.
//!
//! Model: a finger's force is taken in parts, one of each contact and one of all that is felt beside them. Each part may
//! change since the last tick, seen as a vector,
//! - by what was moved: the stiffness times the way of the HIP in the entity's frame, dampers by both velocities, the turn of
//!   the entity, ramps, heights, what effects say of themselves ([`haptics::Contact::explained_n`],
//!   [`haptics::FingerEffects::explained_n`]); of bodies and ties also by what the tick's own step moves them, and of every
//!   part by what orders do to stiffness and strength;
//! - by falling: a surface may be let go of at any time. A god-object that is held by less than before goes to the nearest
//!   place that is free, on a plane through where it is or below: its new force is the old one's part in another direction.
//!   So it lies in the ball over the old force as its diameter;
//! - by turning without falling as much, up to [`MOST_TURN_N`] in a tick: where several edges are passed at once, and where a shaded normal turns.
//!
//! What is beyond is cut to the nearest allowed force, and the rest comes on within [`RETURN_S`].
//!
//! Frames and signs: W; forces on the user.
//! Invariants: what is within the bounds passes to the bit. No allocation after `new`.
//! Cost: a square root for each contact.

use super::objects::Objects;
use super::ordered::{FADE_S, MOST_SHARE};
use haptics::{Finger, FingerEffects};
use nalgebra::Vector3;

/// What was cut from a finger's force in a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    /// Which finger.
    pub finger: usize,
    /// Whose contact; `None`: what is felt beside contacts.
    pub entity: Option<u32>,
    /// How much (N).
    pub force_n: f64,
}

/// A part of a finger's force, as it was commanded.
#[derive(Debug, Clone, Copy, Default)]
struct Part {
    entity: u32,
    force_W: Vector3<f64>,
    /// What a body's own motion within the tick explains (N).
    given_n: f64,
    /// How fast what was cut comes on (N/s); zero: nothing is missing.
    returns_n_per_s: f64,
    /// What was cut for the first time (N).
    cut_n: f64,
}

/// A finger's last line.
#[derive(Debug)]
pub(super) struct LastLine {
    /// Of the contacts, in the order of their entities.
    last: Vec<Part>,
    /// Room for those of the next tick.
    next: Vec<Part>,
    beside: Part,
    strength: f64,
    /// Where the HIP was (m).
    hip_W: Vector3<f64>,
}

/// A tick of a finger.
pub(super) struct Line<'a> {
    /// Its number.
    pub(super) index: usize,
    pub(super) finger: &'a Finger,
    pub(super) felt: &'a FingerEffects,
    /// Of all forces.
    pub(super) strength: f64,
    /// Force of contacts that is felt beside them since this tick (N).
    pub(super) left_n: f64,
    pub(super) dt_s: f64,
    /// Where the HIP is (m).
    pub(super) hip_W: Vector3<f64>,
}

impl LastLine {
    /// Of a finger that has felt nothing yet.
    pub(super) fn new(finger: &Finger) -> Self {
        let room = || Vec::with_capacity(finger.capacity());
        Self { last: room(), next: room(), beside: Part::default(), strength: 1.0, hip_W: Vector3::zeros() }
    }

    /// Nothing is commanded.
    pub(super) fn reset(&mut self) {
        self.last.clear();
        self.beside = Part::default();
    }

    /// What was cut in the last tick for the first time.
    pub(super) fn cuts(&self, finger: usize) -> impl Iterator<Item = Cut> {
        let of = move |part: &Part, entity| Cut { finger, entity, force_n: part.cut_n };
        let contacts = self.last.iter().map(move |part| of(part, Some(part.entity)));
        contacts.chain([of(&self.beside, None)]).filter(|cut| cut.force_n > 0.0)
    }

    /// The force that is commanded in place of this one (N). Bodies are owed what is cut from their contacts.
    pub(super) fn hold(
        &mut self,
        force_W: Vector3<f64>,
        line: &Line<'_>,
        objects: &mut Objects,
        entities: &[haptics::Entity],
    ) -> Vector3<f64> {
        let faded = (line.strength - std::mem::replace(&mut self.strength, line.strength)).abs();
        let faded = faded.min(2.0 * line.dt_s / FADE_S);
        let (mut held_W, mut beside_W) = (force_W, force_W);
        let mut before = self.last.iter().peekable();
        self.next.clear();
        for contact in line.finger.contacts() {
            let entity = contact.entity as u32;
            while before.next_if(|part| part.entity < entity).is_some() {}
            let was = before.next_if(|part| part.entity == entity).copied().unwrap_or_default();
            let (whole_W, given_n) = objects.touched(line.index, contact, entities);
            let wanted_W = whole_W * line.strength;
            beside_W -= wanted_W;
            let mut explained_n = contact.explained_n * line.strength + given_n + was.given_n;
            if faded > 0.0 {
                explained_n += faded * whole_W.norm();
            }
            let part = was.follow(wanted_W, explained_n, line.dt_s);
            if part.returns_n_per_s > 0.0 {
                let changed_W = part.force_W - wanted_W;
                held_W += changed_W;
                objects.owe_to(line.index, contact.entity, changed_W);
            }
            if self.next.len() < self.next.capacity() {
                self.next.push(Part { entity, given_n, ..part });
            }
        }
        std::mem::swap(&mut self.last, &mut self.next);
        let way_m = (line.hip_W - std::mem::replace(&mut self.hip_W, line.hip_W)).norm();
        let given_n = objects.tie_n(line.index, way_m) + objects.pulled_n(line.index);
        let others_n = line.felt.explained_n() + line.left_n;
        let mut explained_n = others_n * line.strength + given_n + self.beside.given_n;
        if faded > 0.0 {
            explained_n += faded * beside_W.norm() / line.strength.max(faded);
        }
        let part = self.beside.follow(beside_W, explained_n, line.dt_s);
        if part.returns_n_per_s > 0.0 {
            held_W += part.force_W - beside_W;
        }
        self.beside = Part { given_n, ..part };
        held_W
    }
}

impl Part {
    /// Goes to this force, or as far as it may.
    #[inline]
    fn follow(&self, to_W: Vector3<f64>, explained_n: f64, dt_s: f64) -> Self {
        let was_n = self.force_W.norm();
        let moved_n = explained_n + SLACK_N + MOST_SHARE * was_n + self.returns_n_per_s * dt_s;
        let most_n = was_n + moved_n;
        let turned_n = 0.5 * was_n + moved_n + MOST_TURN_N;
        let off_W = to_W - self.force_W * 0.5;
        if to_W.norm_squared() <= most_n * most_n && off_W.norm_squared() <= turned_n * turned_n {
            return Self { force_W: to_W, ..Self::default() };
        }
        self.cut(to_W, most_n, turned_n)
    }

    #[cold]
    #[inline(never)]
    fn cut(&self, to_W: Vector3<f64>, most_n: f64, turned_n: f64) -> Self {
        let half_W = self.force_W * 0.5;
        // Both balls hold zero, so that what is shortened stays within the first one.
        let force_W = (half_W + (to_W - half_W).cap_magnitude(turned_n)).cap_magnitude(most_n);
        let missing_n = (to_W - force_W).norm();
        Self {
            force_W,
            returns_n_per_s: self.returns_n_per_s.max(missing_n / RETURN_S),
            cut_n: if self.returns_n_per_s > 0.0 { 0.0 } else { missing_n },
            ..Self::default()
        }
    }
}

/// Below what a finger feels (N): what walks over a surface of a metre resolve, and roundings.
const SLACK_N: f64 = 0.01;
/// By how much a force may turn in a tick without falling as much (N).
const MOST_TURN_N: f64 = 0.5;
/// In which what was cut comes back (s).
const RETURN_S: f64 = 0.02;
