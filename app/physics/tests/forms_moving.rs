//! Contact points while forms move through each other: the same seen from either side, continuous, and finite.
#![allow(non_snake_case)]

#[path = "common/solids.rs"]
mod solids;

use haptics::Form;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use physics::collide::{ContactPoint, PairMemory, is_collidable};
use solids::*;

const REACH: f64 = 1e-3;

/// Force (N) and torque (N m) about B's origin, of springs of 1000 N/m.
fn wrench(points: &[ContactPoint], about: &Vector3<f64>) -> [Vector3<f64>; 2] {
    points.iter().fold([Vector3::zeros(); 2], |[force, torque], point| {
        let f = point.normal_W * (1000.0 * (-point.gap_m).max(0.0));
        [force + f, torque + (point.point_W - about).cross(&f)]
    })
}

/// Two forms, as deep in each other as wanted, and what the pair remembers of how they came there.
fn overlapping(
    a: &Form,
    b: &Form,
    depth: f64,
    noise: &mut Noise,
) -> (Isometry3<f64>, Isometry3<f64>, PairMemory) {
    let X_WB = pose(noise.turn(), Vector3::new(0.03, -0.02, 0.01));
    let (turn, away) = (noise.turn(), noise.direction());
    let aside = noise.direction() * 0.01;
    let at = |distance: f64| pose(turn, X_WB.translation.vector + aside + away * distance);
    let mut memory = PairMemory::default();
    let mut distance = 0.15;
    loop {
        let found = points(a, &at(distance), b, &X_WB, 1.0, &mut memory);
        let gap = deepest(&found);
        if gap < -depth {
            return (at(distance), X_WB, memory);
        }
        // Never farther in a step than there is room.
        distance -= (0.5 * (gap + depth)).clamp(2e-6, 1e-3);
        if distance < -0.15 {
            // It went past.
            return overlapping(a, b, depth, noise);
        }
    }
}

fn pairs() -> Vec<(String, Form, Form)> {
    let forms: Vec<_> = all().into_iter().chain(scaled()).collect();
    let mut pairs = Vec::new();
    for (name_a, a) in &forms {
        for (name_b, b) in &forms {
            if is_collidable(&(*a).into(), &(*b).into()) {
                pairs.push((format!("{name_a} on {name_b}"), *a, *b));
            }
        }
    }
    pairs
}

#[test]
fn continuity_look() {
    for (name, a, b) in pairs() {
        let mut noise = Noise(5);
        let mut worst = (0.0_f64, 0.0);
        let begin = std::time::Instant::now();
        for trial in 0..6 {
            let (X_WA, X_WB, memory) = overlapping(&a, &b, 3e-4, &mut noise);
            let (along, axis) = (noise.direction(), noise.direction());
            let most_jump = |steps: usize| {
                let mut memory = memory;
                let mut last: Option<[Vector3<f64>; 2]> = None;
                let mut most = 0.0_f64;
                let mut before: Vec<ContactPoint> = Vec::new();
                for step in 0..steps {
                    let s = step as f64 / steps as f64;
                    let turn = UnitQuaternion::from_scaled_axis(axis * (0.05 * s));
                    let X = pose(turn * X_WA.rotation, X_WA.translation.vector + along * (1e-3 * s));
                    let found = points(&a, &X, &b, &X_WB, REACH, &mut memory);
                    if -deepest(&found) > 1.5e-3 {
                        break;
                    }
                    let now = wrench(&found, &X.translation.vector);
                    if let Some(last) = last {
                        let jump = (now[0] - last[0]).norm().max((now[1] - last[1]).norm() / 0.02);
                        if jump > 5e-3 {
                            println!("{name} {trial} at {step} of {steps}: {jump}");
                            for p in before.iter() {
                                println!(
                                    "   - {} {:?} n {:?} {:.3e}",
                                    p.id,
                                    (X_WB.inverse() * nalgebra::Point3::from(p.point_W)).coords.data.0,
                                    (X_WB.rotation.inverse() * p.normal_W).data.0,
                                    p.gap_m
                                );
                            }
                            for p in found.iter() {
                                println!(
                                    "   + {} {:?} n {:?} {:.3e}",
                                    p.id,
                                    (X_WB.inverse() * nalgebra::Point3::from(p.point_W)).coords.data.0,
                                    (X_WB.rotation.inverse() * p.normal_W).data.0,
                                    p.gap_m
                                );
                            }
                        }
                        most = most.max((now[0] - last[0]).norm()).max((now[1] - last[1]).norm() / 0.02);
                    }
                    last = Some(now);
                    before = found;
                }
                most
            };
            let (coarse, fine) = (most_jump(1000), most_jump(10_000));
            if fine > 0.3 * coarse {
                println!("   {trial}: {coarse:.1e} {fine:.1e}");
            }
            if fine > worst.0 {
                worst = (fine, coarse);
            }
        }
        let bad = if worst.0 > 0.3 * worst.1 { "BAD" } else { "" };
        println!(
            "{name}: {:.1e} {:.1e} {:.1} us {bad}",
            worst.1,
            worst.0,
            begin.elapsed().as_secs_f64() * 1e6 / 66000.0
        );
    }
}
