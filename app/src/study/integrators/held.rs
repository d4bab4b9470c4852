//! A ball between two still fingers, pushed once: whether it stays.

use haptics::{Entity, Finger, Friction, Sphere};
use nalgebra::{Isometry3, Vector3};
use physics::{Body, Integrator, Manipulation, MassProperties, Settings, Touch};

const RADIUS_M: f64 = 0.02;
/// How deep each finger is.
const SQUEEZE_M: f64 = 1e-3;
/// The fingers' one jump, together.
const PUSH_M: f64 = 1e-4;
/// When they jump, and how long it is watched.
const PUSHED_S: f64 = 0.1;
const WATCHED_S: f64 = 1.0;
/// Swinging about the new place it gets twice as far as the push and no farther; beyond this it is thrown.
const THROWN_M: f64 = 4.0 * PUSH_M;

/// Whether a ball of this mass stays between two fingers at this stiffness.
///
/// Weightless, so that soft fingers hold what is heavy; the fingers stand still but for a push of 0.1 mm.
pub fn stays(integrator: Integrator, mass_kg: f64, stiffness_n_per_m: f64, damping: f64, dt_s: f64) -> bool {
    let hand = Hand::new(integrator, mass_kg, stiffness_n_per_m, damping);
    hand.is_some_and(|mut hand| hand.holds(dt_s))
}

struct Hand {
    entities: [Entity; 1],
    manipulation: Manipulation,
    fingers: [Finger; 2],
}

impl Hand {
    /// `None`: numbers out of range, which nobody holds.
    fn new(integrator: Integrator, mass_kg: f64, stiffness_n_per_m: f64, damping: f64) -> Option<Self> {
        let sphere = Sphere::new(RADIUS_M).ok()?;
        let entity = Entity::new(sphere, Isometry3::identity(), stiffness_n_per_m).ok()?;
        let entity = entity.with_friction(Friction::coulomb(0.8).ok()?).ok()?.with_damping(damping).ok()?;
        let body = Body::at_rest(MassProperties::of_shape(&entity.shape, mass_kg).ok()?, &entity.X_WB);
        let settings = Settings { gravity_W: Vector3::zeros(), integrator, ..Settings::default() };
        let manipulation = Manipulation::new(std::slice::from_ref(&entity), &[(0, body)], settings).ok()?;
        let finger = Finger::new(0.0, 1).ok()?.with_ramp_in(0.0).ok()?;
        Some(Self { entities: [entity], manipulation, fingers: [finger.clone(), finger] })
    }

    fn holds(&mut self, dt_s: f64) -> bool {
        // From outside in, so that each finger knows its side.
        self.step([RADIUS_M + SQUEEZE_M, -RADIUS_M - SQUEEZE_M], dt_s);
        let inside_m = RADIUS_M - SQUEEZE_M;
        for tick in 0..(WATCHED_S / dt_s).round() as u64 {
            let pushed_m = if tick as f64 * dt_s < PUSHED_S { 0.0 } else { PUSH_M };
            self.step([inside_m + pushed_m, -inside_m + pushed_m], dt_s);
            let body = &self.manipulation.bodies()[0];
            if body.centre_W.norm() > THROWN_M || !self.manipulation.parked().is_empty() {
                return false;
            }
        }
        true
    }

    fn step(&mut self, hips_x: [f64; 2], dt_s: f64) {
        let mut touches = [None; 2];
        for (index, (finger, x)) in self.fingers.iter_mut().zip(hips_x).enumerate() {
            finger.step(&self.entities, &Vector3::new(x, 0.0, 0.0), dt_s);
            touches[index] = finger.contact(0).map(|contact| Touch::of(contact, index));
        }
        let mut given: Vec<Touch> = touches.into_iter().flatten().collect();
        self.manipulation.step(&mut self.entities, &mut given, dt_s);
    }
}

#[cfg(test)]
mod tests {
    use super::{stays as stays_at, *};

    #[test]
    fn euler_fails_where_the_spring_is_as_stiff_as_theory_says_and_the_default_does_not() {
        // Two springs, symplectic Euler: 2 k dt^2 / m < 4.
        let limit = |mass: f64| 2.0 * mass / 1e-6;
        for mass in [1e-3, 0.03] {
            let stays = |integrator, share: f64| stays_at(integrator, mass, share * limit(mass), 0.0, 1e-3);
            assert!(
                stays(Integrator::ThesisEuler, 0.8) && !stays(Integrator::ThesisEuler, 1.05),
                "{mass} kg"
            );
            for share in [0.1, 1.0, 10.0] {
                assert!(stays(Integrator::Implicit, share), "{mass} kg, {share}");
            }
        }
    }
}
