//! Places where a finger feels several things at once: whether the loop stands their sum.
//!
//! Model: a finger is put to places in and about each thing that another one reaches into. What it touches there adds up
//! along the normals, `K = sum k n n'`; the largest eigenvalue of K is what the loop feels along its axis.
//! Cost: some sixty places for each such thing, and none for things that lie apart.

#![allow(non_snake_case)] // Frames are capital letters.

use super::warnings::Stands;
use crate::rig::{Rig, in_words};
use haptics::{Entity, Finger, Hip, Shape, Surface};
use nalgebra::{Matrix3, Vector3};
use physics::collide::bounding_ball;
use std::collections::BTreeMap;

/// Warnings of them, of the stiffest sums first.
pub(super) fn too_stiff(rig: &Rig, entities: &[Entity], stands: &mut Stands) -> Vec<String> {
    let mut found: BTreeMap<Vec<usize>, Sum> = BTreeMap::new();
    for (index, near) in neighbours(entities).into_iter().enumerate().filter(|(_, near)| near.len() > 1) {
        for radius_m in radii(rig) {
            for place_W in places(&entities[index]) {
                let Some((touched, sum)) = sum_at(entities, &near, entities[index].space, radius_m, &place_W)
                else {
                    continue;
                };
                let kept = found.entry(touched).or_insert(sum);
                if sum.stiffness_n_per_m > kept.stiffness_n_per_m {
                    *kept = sum;
                }
            }
        }
    }
    let mut beyond: Vec<(f64, String)> = found
        .into_iter()
        .filter_map(|(touched, sum)| {
            let limit = stands.limit(sum.damping_n_s_per_m)?;
            let names: Vec<String> =
                touched.iter().map(|&index| rig.scene.entities[index].name.clone()).collect();
            let (k, at) = (sum.stiffness_n_per_m, sum.place_W);
            let told = format!(
                "{} together may buzz: a finger at ({:.3}, {:.3}, {:.3}) feels {k:.0} N/m of them, and a lightly held \
                 Premium stands {limit:.0}",
                in_words(&names), at.x, at.y, at.z
            );
            (k > limit).then_some((k, told))
        })
        .collect();
    beyond.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    let more = beyond.len().saturating_sub(MOST_TOLD);
    let mut told: Vec<String> = beyond.into_iter().take(MOST_TOLD).map(|(_, told)| told).collect();
    if more > 0 {
        told.push(format!("and {more} more groups of things are too stiff together"));
    }
    told
}

/// What a finger feels at a place along the stiffest axis.
#[derive(Debug, Clone, Copy)]
struct Sum {
    stiffness_n_per_m: f64,
    damping_n_s_per_m: f64,
    place_W: Vector3<f64>,
}

/// `None` where less than two things take part.
fn sum_at(
    entities: &[Entity],
    near: &[u32],
    space: u32,
    radius_m: f64,
    place_W: &Vector3<f64>,
) -> Option<(Vec<usize>, Sum)> {
    let mut probe = Finger::new(radius_m, near.len()).ok()?.within(space);
    probe.step_near(entities, near, Hip { position_W: *place_W, velocity_W: None }, 1e-3);
    let each = || probe.contacts().map(|contact| (contact.entity, contact.normal_W));
    let along = |entity: usize, share: f64| entities[entity].felt_stiffness_n_per_m() * share;
    let total: Matrix3<f64> = each().map(|(entity, n_W)| n_W * n_W.transpose() * along(entity, 1.0)).sum();
    if !total.iter().all(|value| value.is_finite()) {
        return None;
    }
    let eigen = total.symmetric_eigen();
    let stiffest = eigen.eigenvalues.imax();
    let (k, axis_W) = (eigen.eigenvalues[stiffest], eigen.eigenvectors.column(stiffest).into_owned());
    let share = |n_W: &Vector3<f64>| n_W.dot(&axis_W).powi(2);
    let b = each().map(|(entity, n_W)| entities[entity].felt_damping_n_s_per_m() * share(&n_W)).sum();
    let touched: Vec<usize> = each()
        .filter(|(entity, n_W)| along(*entity, share(n_W)) > TAKES_PART * k)
        .map(|(entity, _)| entity)
        .collect();
    let sum = Sum { stiffness_n_per_m: k, damping_n_s_per_m: b, place_W: *place_W };
    (touched.len() > 1).then_some((touched, sum))
}

/// Of each entity that fingers feel, itself and those in its space that may reach into it; ascending.
fn neighbours(entities: &[Entity]) -> Vec<Vec<u32>> {
    let ball = |entity: &Entity| {
        bounding_ball(&entity.shape).map(|(c, r)| (entity.X_WB.transform_point(&c.into()).coords, r))
    };
    let balls: Vec<_> = entities.iter().map(ball).collect();
    // Swept along x: what has no end is near to everything.
    let begin = |index: usize| balls[index].map_or(f64::NEG_INFINITY, |(centre, radius)| centre.x - radius);
    let end = |index: usize| balls[index].map_or(f64::INFINITY, |(centre, radius)| centre.x + radius);
    let mut order: Vec<usize> = (0..entities.len()).filter(|&index| entities[index].is_haptic).collect();
    order.sort_by(|&a, &b| begin(a).total_cmp(&begin(b)));
    let mut near = vec![Vec::new(); entities.len()];
    let mut open: Vec<usize> = Vec::new();
    for next in order {
        open.retain(|&other| end(other) >= begin(next));
        open.push(next);
        for &other in &open {
            let apart = balls[other].zip(balls[next]).is_some_and(|((p, r), (q, s))| (p - q).norm() > r + s);
            if !apart && entities[other].space == entities[next].space {
                near[next].push(other as u32);
                if other != next {
                    near[other].push(next as u32);
                }
            }
        }
    }
    near.iter_mut().for_each(|near| near.sort_unstable());
    near
}

/// In it and about it; of what has no end, below the place nearest to its origin.
fn places(entity: &Entity) -> Vec<Vector3<f64>> {
    let place = |p_B: Vector3<f64>| entity.X_WB.transform_point(&p_B.into()).coords;
    let Some((centre_B, radius_m)) = bounding_ball(&entity.shape) else {
        let Shape::Form(form) = &entity.shape else { return Vec::new() };
        let at = form.nearest(&Vector3::zeros());
        return vec![place(at.point_B - at.normal_B * BELOW_M)];
    };
    let signs = [-1.0, 0.0, 1.0];
    let directions =
        signs.iter().flat_map(|x| signs.iter().flat_map(move |y| signs.map(|z| Vector3::new(*x, *y, z))));
    let directions = directions.filter(|d| *d != Vector3::zeros()).map(|d| d.normalize());
    let along = |d: Vector3<f64>| SHARES.map(|share| centre_B + d * (share * radius_m));
    directions.flat_map(along).chain([centre_B]).map(place).collect()
}

/// Of the scene's fingers, each once.
fn radii(rig: &Rig) -> Vec<f64> {
    let mut radii: Vec<f64> = rig.scene.fingers.iter().map(|finger| finger.radius_m).collect();
    radii.sort_by(f64::total_cmp);
    radii.dedup();
    radii
}

/// Of the way from a thing's centre to the ball around it.
const SHARES: [f64; 4] = [0.25, 0.5, 0.75, 0.95];
/// As deep as a finger presses.
const BELOW_M: f64 = 1e-3;
/// Of the stiffness along an axis: what adds less is not named.
const TAKES_PART: f64 = 0.05;
const MOST_TOLD: usize = 10;
