//! Balls on trees of shapes, beside a dense sample of the same solids' boundaries.
//!
//! The sample is slow and obvious: rays through a grid of points, along which the boolean expression of the solid is
//! bisected wherever it changes. Nothing is shared with the trees. Its points lie on the boundary to 1e-12 m: one that
//! is nearer to a ball's centre than the radius is a leak, however coarse the sample is. It is taken where it is asked for.

use std::cell::RefCell;
use std::collections::HashMap;

use crate::common::meshes::Roaming;
use crate::common::*;
use crate::trees::{self, Inside, random_tree, touchable};
use haptics::{Entity, FingerOutput, Friction};
use nalgebra::Vector3;

/// Points of a boundary, in boxes: of each node the crossings on the way to it from those before it.
struct Sample<'c> {
    contains: &'c Inside<'c>,
    boxes: RefCell<HashMap<[i32; 3], Vec<Vector3<f64>>>>,
}

/// Between nodes (m), and how many of them a box has along each side.
const PITCH_M: f64 = 5e-4;
const NODES: i32 = 4;
const BOX_M: f64 = NODES as f64 * PITCH_M;

impl<'c> Sample<'c> {
    fn of(contains: &'c Inside<'c>) -> Self {
        Self { contains, boxes: RefCell::default() }
    }

    /// Crossings of the boundary on the way to a box' nodes.
    fn crossings(&self, number: [i32; 3]) -> Vec<Vector3<f64>> {
        // Off the planes of the solids.
        let node = |n: [i32; 3]| Vector3::from(n.map(|i| (f64::from(i) + 0.4142) * PITCH_M));
        let here = |at: i32| {
            let side = NODES + 1;
            let within = [at / (side * side), at / side % side, at % side];
            std::array::from_fn(|axis| number[axis] * NODES - 1 + within[axis])
        };
        // Rays along all three axes meet in the same nodes: each is asked once, and those before the first ones.
        let steps = [(NODES + 1).pow(2), NODES + 1, 1];
        let is_inside: Vec<bool> =
            (0..(NODES + 1).pow(3)).map(|at| (self.contains)(&node(here(at)))).collect();
        let mut found = Vec::new();
        for at in 0..(NODES + 1).pow(3) {
            if steps.iter().any(|step| at / step % (NODES + 1) == 0) {
                continue;
            }
            for step in steps {
                if is_inside[(at - step) as usize] != is_inside[at as usize] {
                    found.push(bisected(self.contains, node(here(at - step)), node(here(at))));
                }
            }
        }
        found
    }

    /// How far the nearest point is, up to `at_most_m`.
    fn distance(&self, p: &Vector3<f64>, at_most_m: f64) -> f64 {
        let mut boxes = self.boxes.borrow_mut();
        let mut least = at_most_m * at_most_m;
        let number = |x: f64| (x / BOX_M).floor() as i32;
        // A box' crossings reach as far below it as nodes are apart.
        let [a, b, c]: [_; 3] =
            std::array::from_fn(|axis| number(p[axis] - at_most_m)..=number(p[axis] + at_most_m + PITCH_M));
        for i in a {
            for j in b.clone() {
                for k in c.clone() {
                    let low = Vector3::new(f64::from(i), f64::from(j), f64::from(k)) * BOX_M;
                    let nearest = p.sup(&low.add_scalar(-PITCH_M)).inf(&low.add_scalar(BOX_M));
                    if (nearest - p).norm_squared() > least {
                        continue;
                    }
                    let crossings = boxes.entry([i, j, k]).or_insert_with(|| self.crossings([i, j, k]));
                    for q in crossings {
                        least = least.min((*q - p).norm_squared());
                    }
                }
            }
        }
        least.sqrt()
    }
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
    sample: &Sample<'_>,
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
    sample: &Sample<'_>,
    out: &FingerOutput,
    hip: &Vector3<f64>,
    radius_m: f64,
) -> bool {
    let centre = out.god_object_W;
    let way = hip - centre;
    let length = way.norm();
    // What a sample of this pitch does not see of a surface that a ball of this radius touches.
    let unseen_m = PITCH_M * PITCH_M / radius_m;
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
        let sample = Sample::of(&tree.contains);
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
        let sample = Sample::of(&*contains);
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
