//! What integrators throw away that take forces from the beginning of a tick.
//!
//! Model: a body on the springs and dampers of a contact, four points for a face, one for what is round, or of a finger. A tick
//! of such an integrator multiplies what moves there by a matrix of two rows; where one of its eigenvalues is larger than 1 in
//! size, every swing is larger than the last one. With `c = k dt^2 / m` and `d = b dt / m`, Euler's method with the new
//! velocity stands `c + 2 d < 4`; the finger's spring is described from where the body would be at the tick's end, which makes d
//! larger by c. The eigenvalues z of the equation give `1 + z + z^2/2 + z^3/6 + z^4/24` to Runge and Kutta.

use crate::rig::{Rig, in_words};
use haptics::{Entity, Form, Shape};
use nalgebra::Complex;
use physics::{ContactDamping, Integrator};

/// The warning of them, if there are any.
pub(super) fn all(rig: &Rig, entities: &[Entity]) -> Option<String> {
    let integrator = rig.integrator();
    let dt_s = rig.period_ns as f64 / 1e9;
    let masses: Vec<_> = rig.masses(entities).collect();
    let contacts = rig.contacts(entities);
    let inverse_kg =
        |index: usize| masses.iter().find(|(of, _)| *of == index).map_or(0.0, |(_, mass_kg)| mass_kg.recip());
    let on_fingers = |entity: &Entity, mass_kg: f64| {
        let [c, d] =
            [entity.stiffness_n_per_m * dt_s * dt_s / mass_kg, entity.damping_n_s_per_m * dt_s / mass_kg];
        entity.is_haptic
            && growth(integrator, c, if integrator == Integrator::Rk4 { d } else { c + d }) > GROWS
    };
    let on_others = |index: usize| {
        let entity = &entities[index];
        let others = entities.iter().enumerate().filter(|(other, _)| *other != index);
        let others = others.filter(|(_, other)| other.is_collidable && other.space == entity.space);
        others
            .map(|(other, b)| (points(entity).min(points(b)), b, inverse_kg(index) + inverse_kg(other)))
            .any(|(points, other, gives_per_kg)| {
                let (k, damping) = contacts.between(entity, other);
                let b = match damping {
                    ContactDamping::Constant(b) => b,
                    ContactDamping::Ratio(ratio) => 2.0 * ratio * (k / gives_per_kg).sqrt(),
                };
                let gives = points * gives_per_kg * dt_s;
                growth(integrator, k * dt_s * gives, b * gives) > GROWS
            })
    };
    let is_thrown = |&&(index, mass_kg): &&(usize, f64)| {
        let entity = &entities[index];
        on_fingers(entity, mass_kg) || entity.is_collidable && on_others(index)
    };
    let thrown = masses.iter().filter(is_thrown).map(|(index, _)| rig.scene.entities[*index].name.clone());
    let names: Vec<String> = thrown.collect();
    (integrator != Integrator::Implicit && !names.is_empty()).then(|| {
        format!(
            "`integrator = \"{}\"` throws away {}: too light for springs and dampers as stiff at {} Hz; leave out \
             `integrator`, which is to compare with only",
            integrator.name(),
            in_words(&names),
            dt_s.recip()
        )
    })
}

/// Contact points on something flat.
fn points(entity: &Entity) -> f64 {
    match &entity.shape {
        Shape::Form(Form::Sphere(_) | Form::Ellipsoid(_)) => 1.0,
        _ => 4.0,
    }
}

/// By how much a swing is larger after a tick, with the spring's and the damper's share of the inertia.
fn growth(integrator: Integrator, c: f64, d: f64) -> f64 {
    match integrator {
        Integrator::Implicit => 0.0,
        Integrator::Rk4 => roots(-d, c)
            .map(|z| (1.0 + z * (1.0 + z * (0.5 + z * (1.0 / 6.0 + z / 24.0)))).norm())
            .into_iter()
            .fold(0.0, f64::max),
        _ => roots(2.0 - c - d, 1.0 - d).map(|z| z.norm()).into_iter().fold(0.0, f64::max),
    }
}

/// Of `z^2 - sum z + product`.
fn roots(sum: f64, product: f64) -> [Complex<f64>; 2] {
    let half = Complex::from(0.5 * sum);
    let apart = (half * half - product).sqrt();
    [half + apart, half - apart]
}

/// Without a damper nothing shrinks.
const GROWS: f64 = 1.0 + 1e-9;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eulers_method_stands_what_the_closed_form_says_and_rk4_a_little_more() {
        let euler = |c, d| growth(Integrator::ThesisEuler, c, d) > 1.0;
        for (c, d) in [(3.99, 0.0), (1.0, 1.49), (0.01, 1.98)] {
            assert!(!euler(c, d) && euler(c, d + 0.02), "{c} {d}");
        }
        // Without a damper up to omega dt = 2 sqrt 2, with nothing else up to 2.785.
        let rk4 = |c, d| growth(Integrator::Rk4, c, d) > 1.0;
        assert!(!rk4(7.99, 0.0) && rk4(8.01, 0.0));
        assert!(!rk4(1e-9, 2.784) && rk4(1e-9, 2.787));
    }
}
