//! A body of three different moments that turns and that nothing presses: what becomes of its energy and angular momentum.

#![allow(non_snake_case)] // Names carry their frame.

use haptics::{Entity, Sphere};
use nalgebra::{Isometry3, Vector3};
use physics::{Body, Integrator, Manipulation, MassProperties, Settings};

/// Principal moments (kg m^2) of 100 g, none like another.
const MOMENTS: [f64; 3] = [5e-5, 1e-4, 1.3e-4];
/// Direction in which it spins, in its own axes: near none of them.
const AXIS: [f64; 3] = [0.3, 0.5, 0.8];
/// Nothing is cut short: what runs away is to be seen.
pub(super) const NO_LIMIT: f64 = f64::INFINITY;

/// Largest errors over all ticks, as shares of what it began with.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Errors {
    /// Of the energy.
    pub energy: f64,
    /// Of the angular momentum, its direction included.
    pub momentum: f64,
    /// Its fastest turning, as a multiple of the first.
    pub fastest: f64,
    /// When it was no number any more (s).
    pub lost_s: Option<f64>,
}

/// Lets it spin; `None`: told to stop.
pub fn errors(
    integrator: Integrator,
    spin_rad_s: f64,
    seconds: f64,
    dt_s: f64,
    stops: &dyn Fn() -> bool,
) -> Option<Errors> {
    let omega_W = Vector3::from(AXIS).normalize() * spin_rad_s;
    let mut free = FreeBody::new(integrator, MOMENTS, omega_W, NO_LIMIT)?;
    let start = *free.body();
    let (energy_j, momentum_W) = (start.kinetic_energy_j(), start.angular_momentum_W);
    let mut errors = Errors { fastest: 1.0, ..Errors::default() };
    for tick in 0..(seconds / dt_s).round() as u64 {
        if tick % 1000 == 0 && stops() {
            return None;
        }
        if !free.step(dt_s) {
            errors.lost_s = Some(tick as f64 * dt_s);
            break;
        }
        let body = free.body();
        errors.energy = errors.energy.max((body.kinetic_energy_j() / energy_j - 1.0).abs());
        let off = (body.angular_momentum_W - momentum_W).norm() / momentum_W.norm();
        errors.momentum = errors.momentum.max(off);
        errors.fastest = errors.fastest.max(body.angular_velocity_W().norm() / spin_rad_s);
    }
    Some(errors)
}

/// A body that nothing presses.
pub(super) struct FreeBody {
    entities: [Entity; 1],
    manipulation: Manipulation,
}

impl FreeBody {
    /// 100 g with these principal moments (kg m^2), its axes those of W, turning so (rad/s), no faster than the limit.
    /// `None`: numbers out of range.
    pub(super) fn new(
        integrator: Integrator,
        moments: [f64; 3],
        omega_W: Vector3<f64>,
        most_spin_rad_s: f64,
    ) -> Option<Self> {
        let sphere = Sphere::new(0.02).ok()?;
        let entity = Entity::new(sphere, Isometry3::identity(), 1000.0).ok()?;
        let mass = MassProperties::of_shape(&entity.shape, 0.1).ok()?.with_inertia(moments).ok()?;
        let body = Body::at_rest(mass, &entity.X_WB).moving(Vector3::zeros(), omega_W);
        let settings =
            Settings { gravity_W: Vector3::zeros(), integrator, most_spin_rad_s, ..Settings::default() };
        let entities = [entity];
        let manipulation = Manipulation::new(&entities, &[(0, body)], settings).ok()?;
        Some(Self { entities, manipulation })
    }

    /// `false`: it is no number any more.
    pub(super) fn step(&mut self, dt_s: f64) -> bool {
        self.manipulation.step(&mut self.entities, &mut [], dt_s).parked == 0
    }

    pub(super) fn body(&self) -> &Body {
        &self.manipulation.bodies()[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_keeps_a_spin_that_the_thesis_does_not() {
        let errors = |integrator| errors(integrator, 100.0, 5.0, 1e-3, &|| false).unwrap();
        let ours = errors(Integrator::Implicit);
        assert!(ours.momentum == 0.0 && ours.energy < 1e-3 && ours.lost_s.is_none(), "{ours:?}");
        for integrator in [Integrator::ThesisEuler, Integrator::ThesisEulerGyroscopic] {
            let theirs = errors(integrator);
            assert!(theirs.momentum > 0.1, "{integrator:?}: {theirs:?}");
        }
        let printed = errors(Integrator::ThesisEulerPrinted);
        assert!(printed.lost_s.is_some_and(|at| at < 0.1) && printed.fastest > 1e6, "{printed:?}");
    }
}
