//! From forces to motion: where a body is after a tick.
//!
//! Problem: what throws simulations apart is a light body between stiff springs, and a body that spins fast about no axis
//! of symmetry (Melder ch. 8.2.6 reports that theirs shut down). What the thesis does and prints is offered for comparison.
//!
//! | name | contact forces | turning | what it stands |
//! |---|---|---|---|
//! | `implicit` | of the end of the tick ([`crate::Solver`]) | angular momentum in W, axes at the tick's [middle](midpoint) | everything |
//! | `rk4` | at four [stages](rk4) of the tick, contact points frozen | the same four stages of quaternion and angular momentum | `k dt^2 / m` of some units |
//! | `thesis-euler` | of the beginning of the tick | Melder eq. 5.9, 5.12-5.14: [no gyroscopic torque](thesis_euler) | the same |
//! | `thesis-euler-gyroscopic` | of the beginning of the tick | Melder eq. 5.8, 5.12-5.14 | the same, and slow turning |
//! | `thesis-euler-printed` | of the beginning of the tick | Melder eq. 5.15 as printed: [runs away](thesis_euler) | nothing that turns |
//!
//! Invariant: whatever the integrator, the momentum that a body gets in a tick is the sum of its rows' forces (and gravity)
//! times the tick, and the forces on users are those times -1.

pub(crate) mod explicit;
mod midpoint;
pub(crate) mod rk4;
mod thesis_euler;

use nalgebra::Vector3;

use crate::body::Body;
use crate::wrench::Wrench;
pub(crate) use midpoint::mean_angular_velocity_W;
use thesis_euler::Gyroscopic;

/// How forces become motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Integrator {
    /// Contact forces of the end of the tick; the angular momentum is carried in W and turned into a turn at the tick's
    /// middle.
    #[default]
    Implicit,
    /// Classical Runge-Kutta.
    Rk4,
    /// As the thesis has it in normal use: without the gyroscopic torque.
    ThesisEuler,
    /// As the thesis has it with the gyroscopic torque.
    ThesisEulerGyroscopic,
    /// The same with that torque as the thesis prints it, which lost a factor.
    ThesisEulerPrinted,
}

impl Integrator {
    /// All of them, by what a scene calls them.
    pub const NAMES: [(&'static str, Self); 5] = [
        ("implicit", Self::Implicit),
        ("rk4", Self::Rk4),
        ("thesis-euler", Self::ThesisEuler),
        ("thesis-euler-gyroscopic", Self::ThesisEulerGyroscopic),
        ("thesis-euler-printed", Self::ThesisEulerPrinted),
    ];

    /// The one of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(of, _)| *of == name).map(|(_, integrator)| *integrator)
    }

    /// What a scene calls it.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(_, integrator)| *integrator == self).map_or("", |(name, _)| name)
    }

    /// Whether its contact forces are those of the end of the tick.
    pub(crate) fn is_implicit(self) -> bool {
        self == Self::Implicit
    }

    /// What becomes of the gyroscopic torque in the thesis' own integrators.
    fn gyroscopic(self) -> Gyroscopic {
        match self {
            Self::ThesisEulerGyroscopic => Gyroscopic::Corrected,
            Self::ThesisEulerPrinted => Gyroscopic::Printed,
            Self::Implicit | Self::Rk4 | Self::ThesisEuler => Gyroscopic::LeftOut,
        }
    }

    /// Moves a body by what it gets in a tick.
    pub(crate) fn advance(self, body: &mut Body, gets: &Gets, limits: &Limits, dt_s: f64) {
        //= melder#5.7
        let acceleration_W = gets.gravity_W + gets.wrench.force_W / body.mass.mass_kg;
        //= melder#5.10
        let velocity_W = limits.speed(body.velocity_W + acceleration_W * dt_s);
        match self {
            Self::Implicit => {
                body.velocity_W = velocity_W;
                body.centre_W += body.velocity_W * dt_s;
                if gets.is_free {
                    // The mean of both ends' velocities, which is exact.
                    body.centre_W -= gets.gravity_W * (0.5 * dt_s * dt_s);
                }
                if !body.rotation_locked {
                    body.angular_momentum_W += gets.wrench.torque_W * dt_s;
                    limits.spin(body);
                    midpoint::turn(body, dt_s);
                }
            }
            Self::Rk4 => rk4::advance(body, velocity_W, gets, limits, dt_s),
            Self::ThesisEuler | Self::ThesisEulerGyroscopic | Self::ThesisEulerPrinted => {
                body.velocity_W = velocity_W;
                //= melder#5.11
                body.centre_W += body.velocity_W * dt_s;
                thesis_euler::turn(body, &gets.wrench.torque_W, self.gyroscopic(), limits, dt_s);
            }
        }
        // The axes have turned under the angular momentum: about a thinner one it is a faster turn.
        limits.spin(body);
    }
}

/// What a body gets in a tick.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Gets {
    /// Of all rows.
    pub(crate) wrench: Wrench,
    /// \[m/s^2\]
    pub(crate) gravity_W: Vector3<f64>,
    /// Nothing touches it.
    pub(crate) is_free: bool,
    /// Nothing moves it.
    pub(crate) is_fixed: bool,
    /// Where the stages of [`rk4`] led.
    pub(crate) staged: rk4::Staged,
}

/// Nothing is faster.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    pub(crate) speed_m_s: f64,
    pub(crate) spin_rad_s: f64,
}

impl Limits {
    pub(crate) fn speed(&self, v: Vector3<f64>) -> Vector3<f64> {
        limited(v, self.speed_m_s)
    }

    pub(crate) fn spin(&self, body: &mut Body) {
        if midpoint::fastest(body) <= self.spin_rad_s {
            return;
        }
        let spin = body.angular_velocity_W().norm();
        if spin > self.spin_rad_s {
            body.angular_momentum_W *= self.spin_rad_s / spin;
        }
    }
}

pub(crate) fn limited(v: Vector3<f64>, most: f64) -> Vector3<f64> {
    let length = v.norm();
    if length > most { v * (most / length) } else { v }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_integrator_is_found_by_its_name() {
        for (name, integrator) in Integrator::NAMES {
            assert_eq!((Integrator::from_name(name), integrator.name()), (Some(integrator), name));
        }
        assert_eq!(Integrator::from_name("euler"), None);
        assert_eq!(Integrator::default().name(), "implicit");
    }
}
