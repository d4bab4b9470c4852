//! Bodies that integrators throw away which take forces from the beginning of a tick.
//!
//! Model: a body on the springs and dampers of all contacts that it begins with, or of any other, four points for a face, one for
//! what is round, or of a finger; as it hops, rocks or rolls. A tick of such an integrator multiplies what moves there by a
//! matrix of two rows; where one of its eigenvalues is larger than 1 in size, every swing is larger than the last one. With
//! `c = k dt^2 / m` and `d = b dt / m`, Euler's method with the new velocity stands `c + 2 d < 4`; the finger's spring is
//! described from where the body would be at the tick's end, which makes d larger by c. The eigenvalues z of the
//! equation give `1 + z + z^2/2 + z^3/6 + z^4/24` to Runge and Kutta.

#![allow(non_snake_case)] // Frames are capital letters.

use super::near::Pair;
use crate::rig::{Rig, in_words};
use haptics::{Entity, Form, Shape};
use nalgebra::{Complex, Isometry3};
use physics::{Aabb, Body, Integrator};
use std::collections::BTreeMap;

/// The warning of them, if there are any.
pub(super) fn all(rig: &Rig, entities: &[Entity], pairs: &[Pair]) -> Option<String> {
    let integrator = rig.integrator();
    if integrator == Integrator::Implicit {
        return None;
    }
    let dt_s = rig.period_ns as f64 / 1e9;
    let gives: BTreeMap<usize, f64> = rig
        .bodies(entities)
        .filter_map(|body| body.ok().map(|(index, body)| (index, gives_per_kg(&entities[index], &body))))
        .collect();
    let contacts = rig.contacts(entities);
    let gives_per_kg = |index: usize| gives.get(&index).copied().unwrap_or(0.0);
    let on_fingers = |index: usize| {
        let (entity, gives_per_kg) = (&entities[index], gives_per_kg(index) / points(&entities[index]));
        let c = entity.stiffness_n_per_m * dt_s * dt_s * gives_per_kg;
        let d = entity.damping_n_s_per_m * dt_s * gives_per_kg;
        entity.is_haptic
            && growth(integrator, c, if integrator == Integrator::Rk4 { d } else { c + d }) > GROWS
    };
    // Of a spring matrix the largest eigenvalue is no larger than the largest sum of a row.
    let shares = |index: usize, other: usize| {
        let points = points(&entities[index]).min(points(&entities[other])) / points(&entities[index]);
        let [one, both] = [gives_per_kg(index), (gives_per_kg(index) * gives_per_kg(other)).sqrt()]
            .map(|per_kg| per_kg * points);
        let (k, damping) = contacts.between(&entities[index], &entities[other]);
        [k * dt_s, damping.n_s_per_m(k, gives_per_kg(index))]
            .map(|by_velocity| by_velocity * dt_s * (one + both))
    };
    let grows = |[c, d]: [f64; 2]| growth(integrator, c, d) > GROWS;
    let mut touched: Vec<Vec<usize>> = vec![Vec::new(); entities.len()];
    for pair in pairs {
        touched[pair.one].push(pair.other);
        touched[pair.other].push(pair.one);
    }
    let alike = alike(entities, gives_per_kg);
    let on_others = |index: usize| {
        let of_all = touched[index].iter().map(|&other| shares(index, other));
        let of_all = of_all.fold([0.0; 2], |[c, d], one| [c + one[0], d + one[1]]);
        // Of others that are alike one tells for all.
        let mut others = alike.iter().filter(|group| entities[group[0]].space == entities[index].space);
        let other_than = |group: &Vec<usize>| group.iter().copied().find(|&other| other != index);
        grows(of_all)
            || others.any(|group| other_than(group).is_some_and(|other| grows(shares(index, other))))
    };
    let is_thrown = |index: &usize| on_fingers(*index) || entities[*index].is_collidable && on_others(*index);
    let thrown = gives.keys().filter(|index| is_thrown(index));
    let names: Vec<String> = thrown.map(|&index| rig.scene.entities[index].name.clone()).collect();
    (!names.is_empty()).then(|| {
        format!(
            "`integrator = \"{}\"` may throw away {}: they are light for springs and dampers as stiff at {} Hz; leave out \
             `integrator`, which is to compare with only",
            integrator.name(),
            in_words(&names),
            dt_s.recip()
        )
    })
}

/// Entities that contacts are made with, in groups within which these are the same; two of each group are enough.
fn alike(entities: &[Entity], gives_per_kg: impl Fn(usize) -> f64) -> Vec<Vec<usize>> {
    let mut groups: BTreeMap<_, Vec<usize>> = BTreeMap::new();
    for (index, entity) in entities.iter().enumerate().filter(|(_, entity)| entity.is_collidable) {
        let stiffness =
            (entity.stiffness_n_per_m.to_bits(), entity.contact_stiffness_n_per_m.map(f64::to_bits));
        let gives = (gives_per_kg(index).to_bits(), points(entity).to_bits());
        let key =
            (entity.space, entity.is_stiffness_said, stiffness, entity.damping_n_s_per_m.to_bits(), gives);
        let group = groups.entry(key).or_default();
        if group.len() < 2 {
            group.push(index);
        }
    }
    groups.into_values().collect()
}

/// The most that a body gives way to springs at all its points on something flat, by the stiffness of one (1/kg): as it hops,
/// as it rocks about an axis of its own, or as a round one rolls.
fn gives_per_kg(entity: &Entity, body: &Body) -> f64 {
    let hops = points(entity) / body.mass.mass_kg;
    let Some(around) =
        Aabb::of_shape(&entity.shape, &Isometry3::identity()).filter(|_| !body.rotation_locked)
    else {
        return hops;
    };
    let half_m = (around.high_W - around.low_W) * 0.5;
    let inertia_B = body.mass.inertia_B().diagonal();
    let rocks = (0..3).flat_map(|axis| [(axis + 1) % 3, (axis + 2) % 3].map(|arm| (axis, arm)));
    let rocks = rocks.map(|(axis, arm)| points(entity) * half_m[arm] * half_m[arm] / inertia_B[axis]);
    let is_round = points(entity) == 1.0;
    if is_round { hops + rocks.fold(0.0, f64::max) } else { rocks.fold(hops, f64::max) }
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
        _ => roots(2.0 - c - d, 1.0 - d).map(Complex::norm).into_iter().fold(0.0, f64::max),
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
