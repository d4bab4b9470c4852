//! The way of an entity that is moved by an order.
//!
//! Model: a path of least jerk from where it is to where it is to be, no faster than [`MOST_SPEED_M_S`] and sped up by no more
//! than [`MOST_ACCELERATION_M_S2`], for each of its points: where that takes longer than was asked for, it takes longer. A
//! finger that stands in its way feels k times the way of a tick more in each tick, at most. It waits, and stops on its way,
//! until what it comes near is in the fast list and, where that cannot step all in a tick, has had its turn. All that is moved
//! at a time waits together: parts of a tray do not leave each other behind.

use super::order::{Move, Turn};
use crate::fast_step::{FastStep, Hold};
use nalgebra::{Isometry3, UnitQuaternion};
use physics::collide::bounding_ball;

/// How fast a point of an entity is moved at most \[m/s\].
pub const MOST_SPEED_M_S: f64 = 0.5;
/// How much its speed changes at most \[m/s^2\].
pub const MOST_ACCELERATION_M_S2: f64 = 5.0;
/// Largest change per time of the share of its speed with which it goes, where something has to come first \[1/s\]: from its
/// largest speed that is the largest acceleration, and it stands within the way for which it looks ahead.
pub(super) const MOST_PACE_PER_S: f64 = MOST_ACCELERATION_M_S2 / MOST_SPEED_M_S;
/// After so long a wait others that are moved at the time do not wait for it \[s\]: a thing that has left the world never comes.
const LONGEST_WAIT_S: f64 = 2.0;
/// Of what has no end, points so far from its frame's origin count \[m\].
const ENDLESS_M: f64 = 1.0;

/// An entity's way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Path {
    pub(super) entity: usize,
    wanted: Move,
    stage: Stage,
    /// Answer of [`Self::look`] in this tick.
    hold: Hold,
    /// For how long something has been on its way to here (s).
    waited_s: f64,
    /// Of a body: it had been parked, and is put where it is to be at once. From out of the world the way is long.
    was_parked: bool,
    /// Where it goes then: the newest order that came meanwhile.
    pub(super) then: Option<Move>,
}

#[derive(Debug, Clone, Copy)]
enum Stage {
    /// Who has it is asked.
    Waits,
    Goes {
        from_W: Isometry3<f64>,
        to_W: Isometry3<f64>,
        over_s: f64,
        passed_s: f64,
    },
    /// It is there, and a tick later at rest.
    Rests {
        to_W: Isometry3<f64>,
    },
    /// And is let go.
    Ends,
}

impl Stage {
    /// Pose of the entity so much time (s) later; where it does not go anywhere the origin, for nobody.
    fn place_after(&self, dt_s: f64) -> Isometry3<f64> {
        match self {
            Self::Goes { from_W, to_W, over_s, passed_s } if passed_s + dt_s < *over_s => {
                between(from_W, to_W, least_jerk((passed_s + dt_s) / over_s))
            }
            Self::Goes { to_W, .. } | Self::Rests { to_W } => *to_W,
            Self::Waits | Self::Ends => Isometry3::identity(),
        }
    }
}

/// What is next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Next {
    GoesOn,
    /// There is no going on while fingers feel anything.
    NeedsSilence,
    Done,
    /// Too much is near it.
    Undone,
    /// Too much came near it, or what is moved along, on its way: it stands where it is, and is let go or goes where a newer order has it.
    Stopped,
}

/// A tick, as it is for all that is moved.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tick {
    /// Time by which they go on (s): none while something that is here has to have its turn first.
    pub(super) dt_s: f64,
    /// None sets out before all of them [are clear](Path::look).
    pub(super) is_clear: bool,
    /// Their ways end here: one [meets too much](Path::meets_too_much), and what belongs together stays together.
    pub(super) stops: bool,
    /// No finger feels anything.
    pub(super) is_silent: bool,
}

impl Path {
    pub(super) fn new(wanted: &Move) -> Self {
        Self {
            entity: wanted.entity,
            wanted: *wanted,
            stage: Stage::Waits,
            hold: Hold::Coming,
            waited_s: 0.0,
            was_parked: false,
            then: None,
        }
    }

    /// Asks whether what it comes near within this tick (s) is ready for it: whether all of that is here, and for how much of the
    /// tick it may go on where something waits for its turn, 0 to 1. Whoever goes nowhere has nothing against any.
    pub(super) fn look(&mut self, step: &mut FastStep, dt_s: f64) -> (bool, f64) {
        let goes = matches!(self.stage, Stage::Goes { .. });
        self.hold = match &self.stage {
            Stage::Waits => step.call(self.entity),
            Stage::Goes { .. } => step.look_ahead(self.entity, &self.stage.place_after(dt_s)),
            // It is where it is to be, and comes near nothing.
            Stage::Rests { .. } | Stage::Ends => Hold::Ready,
        };
        self.waited_s = if self.hold == Hold::Coming { self.waited_s + dt_s } else { 0.0 };
        let is_clear = match self.hold {
            Hold::Ready => true,
            Hold::Coming => self.is_left_alone(),
            Hold::TooMuch => !goes,
        };
        (is_clear, if goes { step.pace_of_driven(self.entity) } else { 1.0 })
    }

    /// Others do not wait for it any more: what it waits for may never come.
    fn is_left_alone(&self) -> bool {
        self.waited_s > LONGEST_WAIT_S
    }

    /// True if more than can be called over is on its way.
    pub(super) fn meets_too_much(&self) -> bool {
        matches!(self.stage, Stage::Goes { .. }) && self.hold == Hold::TooMuch
    }

    /// A tick.
    pub(super) fn advance(&mut self, step: &mut FastStep, tick: &Tick) -> Next {
        let Tick { dt_s, is_clear, stops, is_silent } = *tick;
        self.was_parked |= matches!(self.stage, Stage::Waits) && step.is_parked(self.entity);
        let becomes_other = step.is_body(self.entity) && step.is_felt_at(self.entity);
        let place_W = self.stage.place_after(dt_s);
        let is_left_alone = self.is_left_alone();
        match &mut self.stage {
            Stage::Waits if self.hold == Hold::TooMuch => Next::Undone,
            Stage::Goes { .. } if stops => {
                self.stage = Stage::Ends;
                Next::Stopped
            }
            Stage::Waits if !is_clear || self.hold == Hold::Coming => Next::GoesOn,
            Stage::Goes { .. } if is_left_alone => Next::GoesOn,
            Stage::Goes { .. } if dt_s == 0.0 => Next::GoesOn,
            Stage::Waits if becomes_other && !is_silent => Next::NeedsSilence,
            Stage::Waits => {
                step.take_hold(self.entity);
                self.set_out(step);
                Next::GoesOn
            }
            Stage::Goes { over_s, passed_s, .. } => {
                if step.drive(self.entity, place_W) {
                    *passed_s += dt_s;
                    if *passed_s >= *over_s {
                        self.stage = Stage::Rests { to_W: place_W };
                    }
                }
                Next::GoesOn
            }
            Stage::Rests { to_W } => {
                if step.drive(self.entity, *to_W) {
                    self.stage = Stage::Ends;
                }
                Next::GoesOn
            }
            Stage::Ends => match self.then.take() {
                Some(next) => {
                    self.wanted = next;
                    self.set_out(step);
                    Next::GoesOn
                }
                None if becomes_other && !is_silent => Next::NeedsSilence,
                None => {
                    step.let_go(self.entity);
                    Next::Done
                }
            },
        }
    }

    fn set_out(&mut self, step: &mut FastStep) {
        let Some(entity) = step.entities().get(self.entity) else { return };
        let from_W = entity.X_WB;
        let rotation = match self.wanted.turn {
            Turn::Not => from_W.rotation,
            Turn::To(rotation) => rotation,
            Turn::By(turn) => turn * from_W.rotation,
        };
        let place_W = self.wanted.to_W.unwrap_or(from_W.translation.vector);
        let to_W = Isometry3::from_parts(place_W.into(), rotation);
        if std::mem::take(&mut self.was_parked) {
            step.put(self.entity, to_W);
            self.stage = Stage::Rests { to_W };
            return;
        }
        let radius_m =
            bounding_ball(&entity.shape).map_or(ENDLESS_M, |(middle, radius_m)| middle.norm() + radius_m);
        let way_m =
            (place_W - from_W.translation.vector).norm() + radius_m * from_W.rotation.angle_to(&rotation);
        let over_s = self.wanted.over_s.max(least_s(way_m));
        self.stage = Stage::Goes { from_W, to_W, over_s, passed_s: 0.0 };
    }
}

pub(super) fn between(from_W: &Isometry3<f64>, to_W: &Isometry3<f64>, part: f64) -> Isometry3<f64> {
    let place_W = from_W.translation.vector.lerp(&to_W.translation.vector, part);
    let turn: UnitQuaternion<f64> = to_W.rotation * from_W.rotation.inverse();
    // Half a turn has no shorter side, and is taken about some axis.
    let rotation = UnitQuaternion::from_scaled_axis(turn.scaled_axis() * part) * from_W.rotation;
    Isometry3::from_parts(place_W.into(), rotation)
}

/// Which part of a way is behind one after this part of its time.
pub(super) fn least_jerk(t: f64) -> f64 {
    t * t * t * (10.0 - 15.0 * t + 6.0 * t * t)
}

/// The least time for a way of this length (s): the path's fastest is 15/8 of its mean, and its largest acceleration
/// 10 / sqrt(3) of way over time squared.
pub fn least_s(way_m: f64) -> f64 {
    let by_speed_s = 1.875 * way_m / MOST_SPEED_M_S;
    by_speed_s.max((10.0 / 3.0_f64.sqrt() * way_m / MOST_ACCELERATION_M_S2).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shortest_ways_in_time_are_as_fast_or_as_sharp_as_allowed_and_never_more() {
        for way_m in [1e-3, 0.02, 0.1, 0.5, 2.0] {
            let (over_s, n) = (least_s(way_m), 100_000_u32);
            let place = |i: u32| way_m * least_jerk(f64::from(i) / f64::from(n));
            let dt_s = over_s / f64::from(n);
            let speed = (0..n).map(|i| (place(i + 1) - place(i)) / dt_s).fold(0.0, f64::max);
            // Second differences of steps of 1e-5: rounding is 1e-16 / 1e-10 of the mean.
            let coarse = (1..100_u32).map(|i| {
                (place(1000 * (i + 1)) - 2.0 * place(1000 * i) + place(1000 * (i - 1)))
                    / (1000.0 * dt_s).powi(2)
            });
            let sharpest = coarse.fold(0.0, f64::max);
            let (used_speed, used_sharp) = (speed / MOST_SPEED_M_S, sharpest / MOST_ACCELERATION_M_S2);
            assert!(
                used_speed <= 1.0 + 1e-9 && used_sharp <= 1.0 + 1e-9,
                "{way_m}: {used_speed} {used_sharp}"
            );
            // Of a hundred points one is nearly where it is sharpest.
            assert!(used_speed.max(used_sharp) > 0.999, "{way_m}: {used_speed} {used_sharp}");
        }
    }
}
