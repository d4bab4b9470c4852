//! Bodies that rest cost nothing: whole islands of them fall asleep, and wake together.
//!
//! Model: an island is what is connected by pairs near enough to touch. When every body of one has gone no farther than a
//! threshold for a while, and no finger has touched any, their velocities are set to zero and nobody steps them, nor their
//! pairs. What trembles on the spot rests, whatever its speed of the moment. What the contact points remember stays; so who wakes goes on from where it was, and a stack does not twitch.
//! An island wakes as a whole when a finger touches one of it or something that is awake comes near.
//! The thresholds are far below what can be seen or felt, and far above what rounding leaves of a contact at rest: a body
//! that begins to move, if ever so slowly, is past them long before the time is over.

use nalgebra::Vector3;

use crate::solver::Motion;

/// What counts as rest, and for how long.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sleep {
    /// A body that goes steadily, and no faster than this, rests \[m/s\].
    pub speed_m_s: f64,
    /// \[rad/s\]
    pub spin_rad_s: f64,
    /// \[s\]
    pub after_s: f64,
}

impl Default for Sleep {
    fn default() -> Self {
        Self { speed_m_s: 1e-6, spin_rad_s: 1e-5, after_s: 0.5 }
    }
}

/// For how long a body has been where it is, and how far it has gone meanwhile.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Rest {
    /// \[s\]
    pub(crate) lasts_s: f64,
    /// \[m\]
    way_W: Vector3<f64>,
    /// As a vector, for it is small \[rad\].
    turn_W: Vector3<f64>,
}

impl Rest {
    /// A tick in which the body moved so; what has gone too far begins anew.
    pub(crate) fn go_on(&mut self, motion: &Motion, sleep: &Sleep, dt_s: f64) {
        self.lasts_s += dt_s;
        self.way_W += motion.velocity_W * dt_s;
        self.turn_W += motion.angular_velocity_W * dt_s;
        let [way_m, turn_rad] = [sleep.speed_m_s, sleep.spin_rad_s].map(|speed| speed * sleep.after_s);
        if self.way_W.norm_squared() > way_m.powi(2) || self.turn_W.norm_squared() > turn_rad.powi(2) {
            *self = Self::default();
        }
    }
}

/// Sets of bodies, joined two by two.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sets {
    /// Of each, another one of its set nearer to the first one, or itself.
    above: Vec<usize>,
}

impl Sets {
    pub(crate) fn with_capacity(bodies: usize) -> Self {
        Self { above: Vec::with_capacity(bodies) }
    }

    /// So many sets of one.
    pub(crate) fn begin(&mut self, bodies: usize) {
        self.above.clear();
        self.above.extend(0..bodies);
    }

    /// The first of a body's set.
    pub(crate) fn first(&mut self, mut body: usize) -> usize {
        while self.above[body] != body {
            self.above[body] = self.above[self.above[body]];
            body = self.above[body];
        }
        body
    }

    /// Makes one set of two.
    pub(crate) fn join(&mut self, one: usize, other: usize) {
        let [one, other] = [self.first(one), self.first(other)];
        self.above[one.max(other)] = one.min(other);
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;

    const DT_S: f64 = 1e-3;

    /// The longest rest of a body whose velocity and spin at a tick are these factors of the thresholds (s).
    fn longest_s(velocity: impl Fn(usize) -> f64, spin: impl Fn(usize) -> f64) -> f64 {
        let sleep = Sleep::default();
        let (mut rest, mut longest_s) = (Rest::default(), 0.0_f64);
        for tick in 0..2000 {
            let motion = Motion {
                velocity_W: Vector3::z() * (sleep.speed_m_s * velocity(tick)),
                angular_velocity_W: Vector3::x() * (sleep.spin_rad_s * spin(tick)),
                inverse_mass: 1.0,
                inverse_inertia_W: Matrix3::identity(),
            };
            rest.go_on(&motion, &sleep, DT_S);
            longest_s = longest_s.max(rest.lasts_s);
        }
        longest_s
    }

    #[test]
    fn what_creeps_steadily_rests_below_the_thresholds_and_never_above() {
        let after_s = Sleep::default().after_s;
        // The longest while: 0.99 of a threshold is past it after 0.505 s.
        assert!(longest_s(|_| 0.99, |_| 0.0) >= after_s && longest_s(|_| 0.0, |_| 0.99) >= after_s);
        for above in [1.01, 10.0] {
            assert!(longest_s(|_| above, |_| 0.0) < after_s && longest_s(|_| 0.0, |_| above) < after_s);
        }
    }

    #[test]
    fn what_trembles_on_the_spot_rests_whatever_its_speed_of_the_moment() {
        // Two ticks one way and two back, as contacts do that come and go.
        let trembles = |tick: usize| if tick % 4 < 2 { 50.0 } else { -50.0 };
        assert!(longest_s(trembles, trembles) > 1.9);
        // The same, and a way on top that nobody would see.
        let creeps = |tick: usize| trembles(tick) + 1.5;
        assert!(longest_s(creeps, trembles) < 0.5 && longest_s(trembles, creeps) < 0.5);
    }
}
