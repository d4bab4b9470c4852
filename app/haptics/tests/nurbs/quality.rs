//! What a finger feels of curved patches: friction to nine digits, no steps over seams, no surprises from strange input.

use crate::common::*;
use haptics::mesh::{Mesh, TriangleSoup};
use haptics::nurbs::{MAX_DEGREE, make};
use haptics::{ContactState, Friction, Nurbs, NurbsError, NurbsPatch, Shape, Surface};
use nalgebra::Vector3;
use std::sync::Arc;

fn built(patches: &[NurbsPatch]) -> Arc<Nurbs> {
    Arc::new(Nurbs::build(patches).unwrap().0)
}

/// Smooth bodies: none of these has a crease.
fn smooth() -> Vec<(&'static str, Arc<Nurbs>)> {
    vec![
        ("vase", built(&make::vase(0.1))),
        ("mouse", built(&make::mouse(0.1))),
        ("sheet", built(&make::sheet(8, 0.1, 0.004))),
    ]
}

/// A walk on the surface over its seams, `depth_m` below it.
fn walk(nurbs: &Nurbs, depth_m: f64, ticks: u32) -> Vec<Vector3<f64>> {
    let surface = nurbs.surface(0.0);
    let at = |i: u32| {
        let t = f64::from(i) / f64::from(ticks) * std::f64::consts::TAU;
        let aside = Vector3::new(0.02 * t.cos(), 0.0, 0.03 * t.sin());
        // Of the vase its outside, of the others the top.
        let far = aside * 20.0 + Vector3::y() * 0.05;
        let down = surface.entry(&(aside + Vector3::y()), &(aside - Vector3::y()));
        let at = if nurbs.parts() == 16 { surface.nearest(&far) } else { down.unwrap() };
        at.point_B - at.normal_B * depth_m
    };
    (0..ticks).map(at).collect()
}

#[test]
fn sliding_friction_is_mu_to_nine_digits_and_sticks_below() {
    for (name, nurbs) in smooth() {
        let entities = [entity(nurbs.clone(), stiction())];
        let mut finger = point_finger();
        finger.step(&entities, &walk(&nurbs, -1e-3, 1)[0], DT);
        let (mut slid, mut stuck, mut was_stuck) = (0, 0, true);
        for hip in walk(&nurbs, 2e-3, 4000) {
            let out = finger.step(&entities, &hip, DT);
            let normal = finger.contact(0).unwrap().normal_W;
            match out.friction {
                ContactState::Slip => {
                    assert!((ratio(&out, &normal) - MU_D).abs() < 1e-9, "{name} {}", ratio(&out, &normal));
                    slid += 1;
                }
                _ => {
                    assert!(ratio(&out, &normal) <= MU_S * (1.0 + 1e-9), "{name}");
                    stuck += 1;
                }
            }
            was_stuck &= out.friction == ContactState::Stick;
        }
        assert!(slid > 20 && stuck >= 10 && !was_stuck, "{name} {slid} {stuck}");
    }
}

#[test]
fn over_seams_the_force_changes_no_faster_than_the_finger_moves() {
    for (name, nurbs) in smooth() {
        for friction in [Friction::None, Friction::coulomb(0.3).unwrap()] {
            let entities = [entity(nurbs.clone(), friction)];
            let mut finger = point_finger();
            finger.step(&entities, &walk(&nurbs, -1e-3, 1)[0], DT);
            let path = walk(&nurbs, 1e-3, 20_000);
            let mut last: Option<Vector3<f64>> = None;
            for (i, hip) in path.iter().enumerate() {
                let force = finger.step(&entities, hip, DT).force_on_user_W;
                if let Some(last) = last.filter(|_| i > 2000) {
                    let moved = (hip - path[i - 1]).norm();
                    // A millimetre deep on a curvature of less than 1 / 4 mm, force turns by less than
                    // depth / radius per move, and friction by as much again.
                    assert!(
                        (force - last).norm() <= 3.0 * K * moved,
                        "{name} {i}: {} {moved}",
                        (force - last).norm()
                    );
                }
                last = Some(force);
            }
        }
    }
}

fn tessellated(nurbs: &Nurbs, n: u32) -> Mesh {
    let mut soup = TriangleSoup { vertices: Vec::new(), faces: Vec::new() };
    for part in 0..nurbs.parts() {
        let first = soup.vertices.len() as u32;
        let share = |i: u32| f64::from(i) / f64::from(n);
        for (j, i) in (0..=n).flat_map(|j| (0..=n).map(move |i| (j, i))) {
            soup.vertices.push(nurbs.at(part, share(i), share(j)).0);
        }
        for (j, i) in (0..n).flat_map(|j| (0..n).map(move |i| (j, i))) {
            let a = first + i + j * (n + 1);
            let (b, c, d) = (a + 1, a + n + 1, a + n + 2);
            soup.faces.extend([[a, b, d], [a, d, c]]);
        }
    }
    // Seams and poles are where rounding puts them: to be welded they must agree to the last bit.
    soup.vertices.iter_mut().for_each(|v| v.apply(|x| *x = (*x * 1e13).round() / 1e13 + 0.0));
    Mesh::build(soup).unwrap().0
}

/// How far the middles of facets' longest edges lie off the surface, at most.
fn farthest_below(nurbs: &Nurbs, n: u32) -> f64 {
    let at = |part: usize, i: f64, j: f64| nurbs.at(part, i / f64::from(n), j / f64::from(n)).0;
    let cells = (0..nurbs.parts())
        .flat_map(|part| (0..n).flat_map(move |j| (0..n).map(move |i| (part, f64::from(i), f64::from(j)))));
    let below = |(part, i, j): (usize, f64, f64)| {
        (at(part, i + 0.5, j + 0.5) - (at(part, i, j) + at(part, i + 1.0, j + 1.0)) / 2.0).norm()
    };
    cells.map(below).fold(0.0, f64::max)
}

#[test]
fn a_tessellation_comes_closer_with_the_square_of_its_width() {
    let nurbs = built(&make::mouse(0.1));
    let path = walk(&nurbs, 1e-3, 500);
    let forces = |shape: Shape| {
        let entities = [entity(shape, Friction::None)];
        let mut finger = point_finger();
        finger.step(&entities, &walk(&nurbs, -5e-3, 1)[0], DT);
        path.iter().map(|hip| finger.step(&entities, hip, DT)).collect::<Vec<_>>()
    };
    let exact = forces(nurbs.clone().into());
    assert!(exact.iter().all(|out| out.entity.is_some()));
    let mut errors = Vec::new();
    for n in [16, 32, 64] {
        let of_mesh = forces(Arc::new(tessellated(&nurbs, n)).into());
        // Depths, not directions: a facet's normal is off by its width.
        let off = |(a, b): (&haptics::FingerOutput, &haptics::FingerOutput)| {
            a.force_on_user_W.norm() - b.force_on_user_W.norm()
        };
        errors.push(exact.iter().zip(&of_mesh).map(off).map(f64::abs).sum::<f64>() / 500.0);
    }
    // A quarter each time; a tenth aside for where the path happens to meet facets.
    for pair in errors.windows(2) {
        assert!((0.22..0.28).contains(&(pair[1] / pair[0])), "{errors:?}");
    }
    // No deeper than facets lie below the surface where they do most, K times that; on average a good part of that.
    let below_m = farthest_below(&nurbs, 64);
    // Cells up to 2 mm long, on radii of some centimetres.
    assert!((1e-6..2e-5).contains(&below_m), "{below_m}");
    assert!((0.1..1.0).contains(&(errors[2] / (K * below_m))), "{errors:?} {below_m}");
}

#[test]
fn nothing_strange_makes_it_panic_or_gives_a_force_that_is_none() {
    let strange =
        [f64::NAN, f64::INFINITY, -f64::INFINITY, f64::MAX, f64::MIN, 1e154, 1e-160, 5e-324, -0.0, 0.0, 0.03];
    for (name, nurbs) in smooth() {
        for radius in [0.0, 0.004] {
            let entities = [entity(nurbs.clone(), stiction())];
            let mut finger = finger(radius);
            let mut noise = Noise(5);
            for _ in 0..3000 {
                let mut pick = || match (noise.uniform() * 2.0) as u32 {
                    0 => strange[(noise.uniform() * strange.len() as f64) as usize],
                    _ => noise.between(-0.06, 0.06),
                };
                let hip = Vector3::new(pick(), pick(), pick());
                let out = finger.step(&entities, &hip, DT);
                assert!(out.force_on_user_W.iter().all(|x| x.is_finite()), "{name} {hip:?} {out:?}");
                assert!(out.god_object_W.iter().all(|x| x.is_finite()), "{name} {hip:?} {out:?}");
            }
        }
    }
}

/// A prism's walls with a groove: straight patches of degree 1, creased outward and inward.
fn groove(angle: f64) -> Vec<NurbsPatch> {
    let (s, c) = angle.sin_cos();
    // Two slopes that meet along z in the bottom of a valley, turned up by `angle` on either side.
    let sheet = |x: f64| NurbsPatch {
        degree: [1, 1],
        knots: [vec![0.0, 0.0, 1.0, 1.0], vec![0.0, 0.0, 1.0, 1.0]],
        points: vec![
            [0.0, 0.0, -0.1, 1.0],
            [x * c, 0.1 * s, -0.1, 1.0],
            [0.0, 0.0, 0.1, 1.0],
            [x * c, 0.1 * s, 0.1, 1.0],
        ],
    };
    vec![sheet(0.1), sheet(-0.1)]
}

#[test]
fn in_a_groove_the_finger_rests_on_both_sides_at_once() {
    for angle in [0.3, 0.7, 1.2f64] {
        for friction in [Friction::None, Friction::coulomb(0.1).unwrap()] {
            let nurbs = built(&groove(angle));
            let entities = [entity(nurbs, friction)];
            let mut finger = point_finger();
            // Down in the valley, off its middle.
            for tick in 0..=200 {
                let t = f64::from(tick) / 200.0;
                let hip = Vector3::new(0.002 - 0.0015 * t, 0.01 - 0.015 * t, 0.001);
                finger.step(&entities, &hip, DT);
            }
            let hip = Vector3::new(0.0005, -0.005, 0.001);
            let mut out = finger.step(&entities, &hip, DT);
            for _ in 0..5 {
                out = finger.step(&entities, &hip, DT);
            }
            // Held in the bottom: the force points back at it, along z there is friction or nothing.
            assert!(out.god_object_W.x.abs() < 1e-9, "{angle} {out:?}");
            let expected = (Vector3::new(0.0, 0.0, out.god_object_W.z) - hip) * K;
            assert!((out.force_on_user_W - expected).norm() < 1e-7, "{angle} {out:?} {expected:?}");
        }
    }
}

#[test]
fn patches_that_are_none_are_refused_in_words() {
    let good = make::mouse(0.1);
    let refused = |change: &dyn Fn(&mut NurbsPatch)| {
        let mut patches = good.clone();
        change(&mut patches[1]);
        Nurbs::build(&patches).unwrap_err().to_string()
    };
    assert_eq!(Nurbs::build(&[]).unwrap_err(), NurbsError::NoPatch);
    let message = refused(&|patch| patch.degree = [0, 2]);
    assert_eq!(message, "patch 1: degree u: found 0; allowed: 1 to 7");
    let message = refused(&|patch| patch.knots[1][3] = f64::NAN);
    assert_eq!(message, "patch 1: knots v: found NaN; allowed: finite numbers");
    let message = refused(&|patch| patch.points.truncate(8));
    assert!(message.starts_with("patch 1: points: found 8 points; allowed: 3 x 3 = 9"), "{message}");
    let message = refused(&|patch| patch.points[2][3] = -1.0);
    assert!(message.contains("points[2]") && message.contains("above 0"), "{message}");
    let thrice = [good.clone(), good].concat();
    let message = Nurbs::build(&thrice).unwrap_err().to_string();
    assert!(message.contains("two patches at an edge"), "{message}");
}

#[test]
fn any_knot_vector_and_degree_is_the_spline_that_de_boor_gives() {
    let mut noise = Noise(3);
    for degree in 1..=7 {
        for (clamped, repeat) in [(true, 1), (false, 1), (true, degree.min(3)), (false, degree.min(2))] {
            let count = degree + 6;
            let mut knots: Vec<f64> = Vec::new();
            let mut at = 0.0;
            while knots.len() < count + degree + 1 {
                at += noise.between(0.3, 1.0);
                let times = if knots.len() > degree { repeat } else { 1 };
                (0..times).for_each(|_| knots.push(at));
            }
            knots.truncate(count + degree + 1);
            if clamped {
                let (first, last) = (knots[degree], knots[count]);
                knots[..degree].fill(first);
                knots[count + 1..].fill(last);
            }
            let points: Vec<[f64; 4]> = (0..count * 2)
                .map(|k| {
                    [
                        k as f64 % count as f64 + noise.uniform(),
                        noise.uniform(),
                        (k / count) as f64,
                        noise.between(0.5, 2.0),
                    ]
                })
                .collect();
            let patch = NurbsPatch {
                degree: [degree, 1],
                knots: [knots.clone(), vec![0.0, 0.0, 1.0, 1.0]],
                points: points.clone(),
            };
            if patch.check(0).is_err() {
                continue;
            }
            let (nurbs, report) = Nurbs::build(&[patch]).unwrap();
            assert!(report.elements >= nurbs.parts());
            // Parts begin anew where a knot is as often there as the degree; walk over all of the spline instead.
            let mut x = knots[degree];
            let inner = &knots[degree..=count];
            let cuts: Vec<f64> = {
                let mut cuts = vec![inner[0]];
                for &k in inner {
                    let often = knots.iter().filter(|&&other| other == k).count() >= degree;
                    if often && k > cuts[cuts.len() - 1] && k < inner[inner.len() - 1] {
                        cuts.push(k);
                    }
                }
                cuts.push(inner[inner.len() - 1]);
                cuts
            };
            assert_eq!(nurbs.parts(), cuts.len() - 1, "degree {degree}");
            while x < knots[count] {
                let part = cuts.windows(2).position(|c| c[0] <= x && x < c[1]).unwrap();
                let u = (x - cuts[part]) / (cuts[part + 1] - cuts[part]);
                for (v, row) in [(0.0, 0), (1.0, 1)] {
                    let expected = de_boor(&points[row * count..(row + 1) * count], &knots, degree, x);
                    let off = nurbs.at(part, u, v).0 - expected;
                    // Coordinates up to 14 and some tens of roundings.
                    assert!(off.norm() < 1e-12, "degree {degree} {x} {off:?}");
                }
                x += 0.0371;
            }
        }
    }
}

/// The textbook's recursion, on weighted points.
fn de_boor(points: &[[f64; 4]], knots: &[f64], degree: usize, x: f64) -> Vector3<f64> {
    fn basis(knots: &[f64], i: usize, p: usize, x: f64) -> f64 {
        if p == 0 {
            return f64::from(u8::from(knots[i] <= x && x < knots[i + 1]));
        }
        let part = |numerator: f64, denominator: f64, b: f64| {
            if denominator > 0.0 { numerator / denominator * b } else { 0.0 }
        };
        part(x - knots[i], knots[i + p] - knots[i], basis(knots, i, p - 1, x))
            + part(knots[i + p + 1] - x, knots[i + p + 1] - knots[i + 1], basis(knots, i + 1, p - 1, x))
    }
    let mut sum = [0.0; 4];
    for (i, [px, py, pz, w]) in points.iter().enumerate() {
        let b = basis(knots, i, degree, x) * w;
        for (sum, part) in sum.iter_mut().zip([px * b, py * b, pz * b, b]) {
            *sum += part;
        }
    }
    Vector3::new(sum[0], sum[1], sum[2]) / sum[3]
}

/// A square sheet of `spans` by `spans` polynomials of the highest degree, with this height at each control point (m).
fn polynomials(spans: usize, height: impl Fn(usize) -> f64) -> NurbsPatch {
    let count = spans + MAX_DEGREE;
    let knots: Vec<f64> = (0..count + MAX_DEGREE + 1)
        .map(|knot| knot.clamp(MAX_DEGREE, count) as f64 - MAX_DEGREE as f64)
        .collect();
    let point = |index: usize| [(index % count) as f64, height(index), (index / count) as f64, 1.0];
    NurbsPatch {
        degree: [MAX_DEGREE; 2],
        knots: [knots.clone(), knots],
        points: (0..count * count).map(point).collect(),
    }
}

/// Sound patches, and less than a megabyte in a file.
#[test]
fn patches_whose_polynomials_or_cells_would_fill_the_memory_are_refused() {
    assert!(Nurbs::build(&[polynomials(4, |_| 0.0)]).is_ok());
    let refused = |patch: NurbsPatch| Nurbs::build(&[patch]).unwrap_err();
    // 64 control points of 32 bytes for each polynomial, twice: 180 MB.
    assert!(matches!(refused(polynomials(210, |_| 0.0)), NurbsError::TooLarge { .. }));
    // A quarter of that, but each of them falls into hundreds of cells.
    let jagged = |index: usize| if index.is_multiple_of(2) { 50.0 } else { -50.0 };
    assert!(matches!(refused(polynomials(100, jagged)), NurbsError::TooLarge { .. }));
}
