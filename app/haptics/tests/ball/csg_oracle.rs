//! Balls on trees of shapes, beside a dense sample of the same solids' boundaries.
//!
//! The sample is slow and obvious: rays through a grid of points, along which the boolean expression of the solid is
//! bisected wherever it changes. Nothing is shared with the trees. Its points lie on the boundary to 1e-12 m: one that
//! is nearer to a ball's centre than the radius is a leak, however coarse the sample is.

use std::collections::HashMap;

use crate::common::meshes::Roaming;
use crate::common::*;
use crate::trees::{self, Inside, random_tree, touchable};
use haptics::{Entity, FingerOutput, Friction};
use nalgebra::Vector3;

/// Points of a boundary, in boxes.
struct Sample {
    boxes: HashMap<[i32; 3], Vec<Vector3<f64>>>,
    pitch_m: f64,
}

const BOX_M: f64 = 2e-3;

impl Sample {
    fn of(contains: &Inside<'_>, size_m: f64, pitch_m: f64) -> Self {
        let mut here = Self { boxes: HashMap::new(), pitch_m };
        let count = (2.2 * size_m / pitch_m) as i32;
        let at = |i: i32| (f64::from(i) + 0.4142) * pitch_m - 1.1 * size_m;
        let node = |[i, j, k]: [i32; 3]| Vector3::new(at(i), at(j), at(k));
        let index = |[i, j, k]: [i32; 3]| ((i * count + j) * count + k) as usize;
        // Rays along all three axes meet in the same nodes: each is asked once.
        let is_inside: Vec<bool> = nodes(count).map(|n| contains(&node(n))).collect();
        for n in nodes(count) {
            for axis in 0..3 {
                let mut before = n;
                before[axis] -= 1;
                if n[axis] > 0 && is_inside[index(before)] != is_inside[index(n)] {
                    here.add(bisected(contains, node(before), node(n)));
                }
            }
        }
        here
    }

    fn add(&mut self, p: Vector3<f64>) {
        self.boxes.entry(key(&p)).or_default().push(p);
    }

    /// How far the nearest point is, up to `at_most_m`.
    fn distance(&self, p: &Vector3<f64>, at_most_m: f64) -> f64 {
        let reach = (at_most_m / BOX_M).ceil() as i32;
        let [a, b, c] = key(p);
        let mut least = at_most_m * at_most_m;
        for i in -reach..=reach {
            for j in -reach..=reach {
                for k in -reach..=reach {
                    for q in self.boxes.get(&[a + i, b + j, c + k]).into_iter().flatten() {
                        least = least.min((q - p).norm_squared());
                    }
                }
            }
        }
        least.sqrt()
    }
}

/// All nodes of a cubic grid, the last coordinate first.
fn nodes(count: i32) -> impl Iterator<Item = [i32; 3]> {
    (0..count).flat_map(move |i| (0..count).flat_map(move |j| (0..count).map(move |k| [i, j, k])))
}

fn key(p: &Vector3<f64>) -> [i32; 3] {
    [p.x, p.y, p.z].map(|x| (x / BOX_M).floor() as i32)
}

fn bisected(contains: &Inside<'_>, mut a: Vector3<f64>, mut b: Vector3<f64>) -> Vector3<f64> {
    let is_inside = contains(&a);
    for _ in 0..36 {
        let middle = 0.5 * (a + b);
        if contains(&middle) == is_inside { a = middle } else { b = middle }
    }
    0.5 * (a + b)
}

/// Walks a ball over a solid; what it does may not go through the sample, and where it rests must be where the spring
/// wants it.
fn roam(
    name: &str,
    entity: &Entity,
    contains: &Inside<'_>,
    sample: &Sample,
    size_m: f64,
    radius_m: f64,
) -> [u32; 3] {
    let mut finger = finger(radius_m);
    let mut roaming = Roaming::new(11, size_m + radius_m, 4e-4);
    let (mut touched, mut leaks, mut unsettled) = (0, 0, 0);
    let mut hip = Vector3::zeros();
    for i in 0..4000 {
        // Every now and then it waits.
        if i % 40 < 30 {
            hip = roaming.next();
        }
        let out = finger.step(std::slice::from_ref(entity), &hip, DT);
        assert!(out.force_on_user_W.iter().all(|x| x.is_finite()), "{name} {i}");
        if out.entity.is_none() {
            if contains(&hip) || sample.distance(&hip, radius_m) < radius_m * (1.0 - 1e-6) {
                println!("{name} r {radius_m} tick {i}: not felt at {hip:?}");
                leaks += 1;
            }
            continue;
        }
        touched += 1;
        let centre = out.god_object_W;
        if contains(&centre) || sample.distance(&centre, radius_m) < radius_m * (1.0 - 1e-6) {
            if leaks < 3 {
                println!(
                    "{name} r {radius_m} tick {i}: at {centre:?}, {} inside {}",
                    sample.distance(&centre, radius_m),
                    contains(&centre)
                );
            }
            leaks += 1;
        }
        if i % 40 == 39 && !is_settled(contains, sample, &out, &hip, radius_m) {
            if unsettled < 3 {
                println!("{name} r {radius_m} tick {i}: unsettled at {centre:?} for {hip:?}");
            }
            unsettled += 1;
        }
    }
    [touched, leaks, unsettled]
}

/// Whether all steps that lead nearer to the HIP lead into the material.
fn is_settled(
    contains: &Inside<'_>,
    sample: &Sample,
    out: &FingerOutput,
    hip: &Vector3<f64>,
    radius_m: f64,
) -> bool {
    let centre = out.god_object_W;
    let way = hip - centre;
    let length = way.norm();
    // What a sample of this pitch does not see of a surface that a ball of this radius touches.
    let unseen_m = sample.pitch_m * sample.pitch_m / radius_m;
    let step_m = (10.0 * unseen_m).max(0.02 * radius_m);
    if length < 2.0 * step_m {
        return true;
    }
    let towards = way / length;
    let mut noise = Noise(3);
    (0..60).all(|i| {
        let direction = if i == 0 { towards } else { (noise.vector(0.6) + towards).normalize() };
        let there = centre + direction * step_m;
        // Nearer by a good part of the step.
        let nearer = length - (there - hip).norm() > 0.35 * step_m;
        let is_blocked =
            |p: &Vector3<f64>| sample.distance(p, radius_m + unseen_m) < radius_m + 0.5 * unseen_m;
        !nearer || is_blocked(&there) || reaches_into(contains, &there, radius_m)
    })
}

/// Whether the outer tenth of a ball has material in it: of thin edges the sample may see nothing.
fn reaches_into(contains: &Inside<'_>, centre: &Vector3<f64>, radius_m: f64) -> bool {
    let mut noise = Noise(5);
    (0..200_000).any(|_| {
        let direction = noise.vector(1.0).normalize();
        contains(&(centre + direction * (radius_m * noise.between(0.9, 1.0))))
    })
}

#[test]
fn on_every_tree_a_ball_keeps_its_distance_and_rests_where_the_spring_wants_it() {
    let mut bad = Vec::new();
    for tree in trees::all() {
        let sample = Sample::of(&tree.contains, tree.size_m, 5e-4);
        let entity = touchable(&tree.tree, Friction::None);
        for radius_m in [1.5e-3, 5e-3] {
            let [touched, leaks, unsettled] =
                roam(tree.name, &entity, &tree.contains, &sample, tree.size_m, radius_m);
            println!(
                "{:>20} r {radius_m}: touched {touched}, leaks {leaks}, unsettled {unsettled}",
                tree.name
            );
            if leaks + unsettled > 0 || touched < 300 {
                bad.push((tree.name, radius_m, touched, leaks, unsettled));
            }
        }
    }
    assert!(bad.is_empty(), "{bad:?}");
}

#[test]
fn on_random_trees_too() {
    let mut bad = Vec::new();
    for seed in 0..8 {
        let (tree, contains) = random_tree(1000 + seed);
        let sample = Sample::of(&*contains, 0.05, 5e-4);
        let entity = touchable(&tree, Friction::None);
        let radius_m = [2e-3, 4e-3, 8e-3][seed as usize % 3];
        let name = format!("random {seed}");
        let [touched, leaks, unsettled] = roam(&name, &entity, &*contains, &sample, 0.04, radius_m);
        println!("{name:>20} r {radius_m}: touched {touched}, leaks {leaks}, unsettled {unsettled}");
        if leaks + unsettled > 0 {
            bad.push((seed, touched, leaks, unsettled));
        }
    }
    assert!(bad.is_empty(), "{bad:?}");
}
