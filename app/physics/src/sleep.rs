//! Bodies that rest cost nothing: whole islands of them fall asleep, and wake together.
//!
//! Model: an island is what is connected by pairs near enough to touch. When every body of one has moved slower than a
//! threshold for a while, and no finger has touched any, their velocities are set to zero and nobody steps them, nor their
//! pairs. What the contact points remember stays; so who wakes goes on from where it was, and a stack does not twitch.
//! An island wakes as a whole when a finger touches one of it or something that is awake comes near.
//! The thresholds are far below what can be seen or felt, and far above what rounding leaves of a contact at rest: a body
//! that begins to move, if ever so slowly, is past them long before the time is over.

use crate::solver::Motion;

/// What counts as rest, and for how long.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sleep {
    /// \[m/s\]
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

impl Sleep {
    /// Whether a body that moves so rests.
    pub(crate) fn is_rest(&self, motion: &Motion) -> bool {
        motion.velocity_W.norm_squared() <= self.speed_m_s.powi(2)
            && motion.angular_velocity_W.norm_squared() <= self.spin_rad_s.powi(2)
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
