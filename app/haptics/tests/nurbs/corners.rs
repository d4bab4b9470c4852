//! Sharp solids of several patches: nobody leaks in at edges, corners and tips, and nobody outside is held there.

use crate::common::*;
use haptics::mesh::Sides;
use haptics::nurbs::make;
use haptics::{Friction, Nurbs, NurbsError, NurbsPatch, Surface};
use nalgebra::Vector3;
use std::sync::Arc;

/// Half of a cube's width, a cone's and a pyramid's radius and half their height.
const H: f64 = 0.05;

/// A flat patch between four corners; `turn` chooses which of them its parameters begin at, and which way they run.
fn flat([a, b, c, d]: [[f64; 3]; 4], turn: usize) -> NurbsPatch {
    let corners = match turn % 4 {
        0 => [a, b, c, d],
        1 => [b, a, d, c],
        2 => [a, c, b, d],
        _ => [d, c, b, a],
    };
    NurbsPatch {
        degree: [1, 1],
        knots: [vec![0.0, 0.0, 1.0, 1.0], vec![0.0, 0.0, 1.0, 1.0]],
        points: corners.map(|[x, y, z]| [x, y, z, 1.0]).to_vec(),
    }
}

fn cube() -> Vec<NurbsPatch> {
    let side = |k: usize| {
        let (axis, x) = (k % 3, if k < 3 { H } else { -H });
        let corner = |s: f64, t: f64| {
            let mut p = [0.0; 3];
            (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (x, s * H, t * H);
            p
        };
        flat([corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)], k)
    };
    (0..6).map(side).collect()
}

/// Four flanks whose upper edge has shrunk to the tip, and a bottom.
fn pyramid(tip_y: f64) -> Vec<NurbsPatch> {
    let corners = [[H, -H, H], [H, -H, -H], [-H, -H, -H], [-H, -H, H]];
    let tip = [0.0, tip_y, 0.0];
    let flank = |k: usize| flat([corners[k], corners[(k + 1) % 4], tip, tip], k);
    let bottom = flat([corners[0], corners[1], corners[3], corners[2]], 0);
    (0..4).map(flank).chain([bottom]).collect()
}

fn cone(tip_y: f64) -> Vec<NurbsPatch> {
    vec![make::revolved(1, &[0.0, 0.0, 1.0, 2.0, 2.0], &[[0.0, -H, 1.0], [H, -H, 1.0], [0.0, tip_y, 1.0]])]
}

/// How far outside the farthest of the sides' planes (m): its sign tells inside from outside.
type Outside = fn(&Vector3<f64>) -> f64;

struct Solid {
    name: &'static str,
    nurbs: Arc<Nurbs>,
    outside_m: Outside,
    /// Corners and tips; edges run between them or round.
    sharp: Vec<Vector3<f64>>,
}

fn solids() -> Vec<Solid> {
    let built = |patches: &[NurbsPatch]| Arc::new(Nurbs::build(patches).unwrap().0);
    let of = [H, -H];
    let corners = of.iter().flat_map(|&x| of.iter().flat_map(move |&y| of.map(|z| Vector3::new(x, y, z))));
    let corners: Vec<_> = corners.collect();
    let bottom = corners.iter().copied().filter(|c| c.y < 0.0);
    let tip = Vector3::new(0.0, H, 0.0);
    let ring = (0..12).map(|k| f64::from(k) * std::f64::consts::TAU / 12.0);
    let ring = ring.map(|angle| Vector3::new(angle.cos() * H, -H, angle.sin() * H));
    vec![
        Solid { name: "cube", nurbs: built(&cube()), outside_m: |p| p.amax() - H, sharp: corners.clone() },
        Solid {
            name: "pyramid",
            nurbs: built(&pyramid(H)),
            outside_m: |p| ((2.0 * p.x.abs().max(p.z.abs()) + p.y - H) / 5f64.sqrt()).max(-H - p.y),
            sharp: bottom.chain([tip]).collect(),
        },
        Solid {
            name: "cone",
            nurbs: built(&cone(H)),
            outside_m: |p| ((2.0 * p.x.hypot(p.z) + p.y - H) / 5f64.sqrt()).max(-H - p.y),
            sharp: ring.chain([tip]).collect(),
        },
    ]
}

/// Solids where a finger can leave through no other side than it is on: nothing about their sharp places is thin.
///
/// Less than a right angle is: pressed from one side through the other, a finger is held, as by a plate.
fn blunt_solids() -> Vec<Solid> {
    let built = |patches: &[NurbsPatch]| Arc::new(Nurbs::build(patches).unwrap().0);
    let tip = Vector3::new(0.0, -0.5 * H, 0.0);
    let cube = solids().swap_remove(0);
    vec![
        cube,
        Solid {
            name: "low pyramid",
            nurbs: built(&pyramid(tip.y)),
            outside_m: |p| ((0.5 * p.x.abs().max(p.z.abs()) + p.y + 0.5 * H) / 1.25f64.sqrt()).max(-H - p.y),
            sharp: vec![tip],
        },
        Solid {
            name: "low cone",
            nurbs: built(&cone(tip.y)),
            outside_m: |p| ((0.5 * p.x.hypot(p.z) + p.y + 0.5 * H) / 1.25f64.sqrt()).max(-H - p.y),
            sharp: vec![tip],
        },
    ]
}

impl Solid {
    /// On an edge or at a corner, or within a millimetre to nothing of it.
    fn sharp_place(&self, noise: &mut Noise) -> Vector3<f64> {
        let mut pick = || self.sharp[(noise.uniform() * self.sharp.len() as f64) as usize];
        let (a, b) = (pick(), pick());
        let along = if noise.uniform() < 0.5 { 0.0 } else { noise.uniform() };
        let off = if noise.uniform() < 0.3 { 0.0 } else { 10f64.powf(noise.between(-16.0, -3.0)) };
        // Between corners that share no edge it is on a side or inside: drawn out to the surface.
        let place = a.lerp(&b, along);
        let middle = Vector3::new(0.0, -0.8 * H, 0.0);
        let (mut low, mut high) = (0.0, 4.0);
        for _ in 0..60 {
            let share = (low + high) / 2.0;
            let is_out = (self.outside_m)(&middle.lerp(&place, share)) > 0.0;
            (low, high) = if is_out { (low, share) } else { (share, high) };
        }
        let place = if along == 0.0 { place } else { middle.lerp(&place, low) };
        place + noise.vector(1.0) * off
    }
}

#[test]
fn patches_without_an_area_are_left_out_and_told() {
    let (whole, of_whole) = Nurbs::build(&cube()).unwrap();
    assert_eq!((whole.sides(), of_whole.without_area, of_whole.first_without_area), (Sides::Solid, 0, None));
    let [a, b] = [[H; 3], [-H, H, H]];
    // Collapsed to a point, to an edge of the cube, to a part of it and back, and to a curve within the cube.
    let point = flat([a; 4], 0);
    let edge = flat([a, b, a, b], 0);
    let back = flat([a, [0.0, H, H], [0.3 * H, H, H], b], 0);
    let arc = [[0.01, 0.0, 0.0, 1.0], [0.01, 0.01, 0.0, 0.7], [0.0, 0.01, 0.0, 1.0]];
    let curve = NurbsPatch {
        degree: [2, 1],
        knots: [vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0], vec![0.0, 0.0, 1.0, 1.0]],
        points: [arc, arc].concat(),
    };
    let narrow = flat([a, b, [H, H + 1e-12, H], [-H, H + 1e-12, H]], 0);
    for (bad, turn) in [&point, &edge, &back, &curve, &narrow].into_iter().zip(0..) {
        for at in [0, 3, 6] {
            let mut patches = cube();
            patches.insert(at, bad.clone());
            let (nurbs, report) =
                Nurbs::build(&patches).unwrap_or_else(|error| panic!("{turn} {at}: {error}"));
            assert_eq!((report.without_area, report.first_without_area), (1, Some(at)), "{turn}");
            assert_eq!(
                (nurbs.sides(), report.seams, report.rims),
                (Sides::Solid, of_whole.seams, 0),
                "{turn} {at}"
            );
            assert!(
                report
                    .to_string()
                    .contains(&format!("1 patch without an area: left out (first: patch {at})"))
            );
            let p = Vector3::new(0.01, 0.6 * H, 0.02);
            assert_eq!(nurbs.surface(0.0).signed_distance(&p), whole.surface(0.0).signed_distance(&p));
        }
    }
    let alone = Nurbs::build(&[edge, point]).unwrap_err();
    assert_eq!(alone, NurbsError::NoArea { patches: 2 });
    assert_eq!(alone.to_string(), "of 2 patches none has an area; allowed: at least one with an area");
}

#[test]
fn sharp_solids_are_closed_and_know_inside_from_outside() {
    for solid in solids() {
        let Solid { name, nurbs, outside_m, .. } = &solid;
        assert_eq!(nurbs.sides(), Sides::Solid, "{name}");
        let surface = nurbs.surface(0.0);
        let mut noise = Noise(21);
        for i in 0..20_000 {
            let p = if i % 2 == 0 { noise.vector(1.5 * H) } else { solid.sharp_place(&mut noise) };
            let (expected, found) = (outside_m(&p), surface.signed_distance(&p));
            // In front of a corner the distance is greater than to any plane. 1e-14 m: so near a tip, derivatives that shrink
            // towards it are rounding, and it is anybody's.
            assert!(expected.abs() < 1e-14 || (expected > 0.0) == (found > 0.0), "{name} {p:?} {found:e}");
            let is_right =
                if expected < 0.0 { (found - expected).abs() < 1e-14 } else { found > expected - 1e-14 };
            assert!(is_right, "{name} {p:?}: {found:e} {expected:e}");
        }
    }
}

#[test]
fn nobody_comes_in_at_edges_corners_and_tips_unnoticed() {
    for solid in solids() {
        let Solid { name, nurbs, outside_m, .. } = &solid;
        let entities = [entity(nurbs.clone(), Friction::None)];
        let mut noise = Noise(22);
        let mut tried = 0;
        for trial in 0..30_000 {
            let place = solid.sharp_place(&mut noise);
            let from = place + noise.vector(1.0).normalize() * (6.0 * H);
            // Through the very place, and on, by very little or into the solid.
            let on = (place - from).normalize() * 10f64.powf(noise.between(-13.0, -1.7));
            let to = place + on;
            let ticks = [1, 1, 2, 7, 50][(noise.uniform() * 5.0) as usize];
            let mut finger = point_finger();
            finger.step(&entities, &from, DT);
            for tick in 1..=ticks {
                let share = f64::from(tick) / f64::from(ticks);
                finger.step(&entities, &from.lerp(&to, share), DT);
            }
            if outside_m(&to) < -1e-14 {
                tried += 1;
                assert!(finger.contact(0).is_some(), "{name} {trial}: {from:?} -> {to:?} in {ticks}");
            }
            // A way that keeps off the solid meets nothing.
            let mut way = (0..=2000).map(|k| from.lerp(&to, f64::from(k) / 2000.0));
            assert!(
                finger.contact(0).is_none() || way.any(|p| outside_m(&p) <= 2e-4),
                "{name} {trial}: {from:?} -> {to:?}"
            );
        }
        assert!(tried > 3000, "{name} {tried}");
    }
}

#[test]
fn about_sharp_places_a_finger_is_held_exactly_while_it_is_inside() {
    for solid in blunt_solids() {
        let Solid { name, nurbs, outside_m, .. } = &solid;
        for (seed, friction) in
            [(31, Friction::None), (32, Friction::coulomb(0.5).unwrap()), (33, stiction())]
        {
            let entities = [entity(nurbs.clone(), friction)];
            let mut noise = Noise(seed);
            let (mut inside, mut left) = (0, 0);
            for walk in 0..300 {
                let place = solid.sharp_place(&mut noise);
                let mut finger = point_finger();
                let mut hip = place + Vector3::new(place.x, 0.1 * H + place.y.abs(), place.z) * 0.3;
                finger.step(&entities, &hip, DT);
                let mut was_inside = false;
                let mut goal = place;
                for i in 0..300 {
                    if i % 15 == 0 {
                        // In and out around it: 2 mm, far less than it is to any other side.
                        goal = place + noise.vector(2e-3);
                    }
                    hip += (goal - hip) * 0.2;
                    let out = finger.step(&entities, &hip, DT);
                    let off_m = outside_m(&hip);
                    assert!(out.force_on_user_W.iter().all(|x| x.is_finite()));
                    // 1e-14 m is some roundings of 0.05 m.
                    let is_held = out.entity.is_some();
                    assert!(
                        off_m > -1e-14 || is_held,
                        "{name} {seed} {walk} {i}: free at {off_m:e}, {hip:?}"
                    );
                    assert!(
                        off_m < 1e-14 || !is_held,
                        "{name} {seed} {walk} {i}: held at {off_m:e}, {hip:?}"
                    );
                    inside += u32::from(off_m < 0.0);
                    left += u32::from(was_inside && off_m > 0.0);
                    was_inside = off_m < 0.0;
                }
            }
            assert!(inside > 2000 && left > 300, "{name} {inside} {left}");
        }
    }
}
