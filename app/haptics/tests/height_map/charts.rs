//! Coordinates along surfaces: their gradients against what they do, seams, poles, and what runs which way.

use crate::common::pictures::*;
use crate::common::*;
use crate::solids;
use haptics::{Chart, Coordinate, Cuboid, Form, Friction, Plane, Scaled, Shape, Surface, SurfacePoint};
use nalgebra::Vector3;
use std::f64::consts::{PI, TAU};

fn chart(form: &Form, at: &SurfacePoint) -> Chart {
    form.chart(at).expect("every closed form has one")
}

fn along(v: &Vector3<f64>, normal: &Vector3<f64>) -> Vector3<f64> {
    v - normal * normal.dot(v)
}

/// Solids whose surface is where their chart is: those that have not grown.
fn forms() -> Vec<(&'static str, Form, f64)> {
    let solids = solids::all().into_iter().filter(|solid| !solid.name.starts_with("grown"));
    let mut forms: Vec<_> = solids.map(|solid| (solid.name, solid.form, solid.size_m)).collect();
    let slanted = Plane::new(Vector3::new(0.3, 0.5, -0.7), 0.01).unwrap();
    forms.extend([("table", solids::plane(), 0.1), ("slanted plane", slanted.into(), 0.1)]);
    forms
}

#[test]
fn gradients_are_how_coordinates_change_along_the_surface() {
    for (name, form, size_m) in forms() {
        let mut noise = Noise(11);
        let mut compared = 0;
        for _ in 0..2000 {
            let at = form.nearest(&noise.vector(size_m));
            let here = chart(&form, &at);
            if here.weight < 0.05 {
                // Near the axis the longitude turns within few steps.
                continue;
            }
            let step_m = 1e-7;
            let direction = along(&noise.vector(1.0), &at.normal_B).normalize() * step_m;
            let [ahead, behind] = [1.0, -1.0].map(|side| form.settle(&at, &(at.point_B + direction * side)));
            if ahead.piece != at.piece || behind.piece != at.piece {
                continue;
            }
            let moved = ahead.point_B - behind.point_B;
            let (ahead, behind) = (chart(&form, &ahead), chart(&form, &behind));
            let rate = |of: fn(&Chart) -> Coordinate| {
                let mut difference = of(&ahead).at_m - of(&behind).at_m;
                if of(&here).closes {
                    difference -= (difference / of(&here).length_m).round() * of(&here).length_m;
                }
                // Over a chord of 2e-7 m: roundings of 0.1 m are 1e-9 of it, and what is left of bends is seen with the
                // square of its share in the distance from the axis, 0.3 mm at the least, where u runs tenfold.
                (difference - of(&here).gradient_B.dot(&moved)) / step_m
            };
            assert!(rate(|c| c.u).abs() < 3e-6, "{name}: u by {} at {at:?}", rate(|c| c.u));
            assert!(rate(|c| c.v).abs() < 1e-6, "{name}: v by {} at {at:?}", rate(|c| c.v));
            let weight = (ahead.weight - behind.weight - here.weight_gradient_B.dot(&moved)) / step_m;
            assert!(weight.abs() < 1e-4, "{name}: weight by {weight} at {at:?}");
            for gradient in [here.u.gradient_B, here.v.gradient_B, here.weight_gradient_B] {
                assert!(
                    gradient.dot(&at.normal_B).abs() <= 1e-12 * gradient.norm(),
                    "{name}: not along the surface"
                );
            }
            compared += 1;
        }
        assert!(compared > 500, "{name}: {compared}");
    }
}

#[test]
fn coordinates_keep_within_their_lengths_around_the_middle() {
    for (name, form, size_m) in forms() {
        let mut noise = Noise(12);
        let (mut least, mut most) = ([f64::MAX; 2], [f64::MIN; 2]);
        for _ in 0..20_000 {
            let at = form.nearest(&noise.vector(size_m));
            let chart = chart(&form, &at);
            for (axis, along) in [chart.u, chart.v].iter().enumerate() {
                if along.length_m.is_finite() && along.length_m > 0.0 {
                    let share = along.at_m / along.length_m;
                    (least[axis], most[axis]) = (least[axis].min(share), most[axis].max(share));
                }
            }
        }
        // Both ends are come near to; roundings may lead just beyond.
        if form.chart(&form.nearest(&Vector3::x())).unwrap().u.length_m.is_finite() {
            for axis in 0..2 {
                assert!((-0.5 - 1e-12..-0.45).contains(&least[axis]), "{name} {axis}: {least:?}");
                assert!((0.45..0.5 + 1e-12).contains(&most[axis]), "{name} {axis}: {most:?}");
            }
        }
    }
}

#[test]
fn seen_from_outside_u_runs_right_and_v_up() {
    // Right x up points at the viewer.
    for (name, form, size_m) in forms() {
        let mut noise = Noise(13);
        for _ in 0..500 {
            let at = form.nearest(&noise.vector(size_m));
            let chart = chart(&form, &at);
            let handed = chart.u.gradient_B.cross(&chart.v.gradient_B).dot(&at.normal_B);
            if chart.weight == 0.0 {
                continue; // At a tip there is no direction.
            }
            assert!(handed > 0.0, "{name}: {at:?} {chart:?}");
            let is_level = at.normal_B.y.abs() > 0.99;
            let is_inner_tube = name.contains("torus") && along(&Vector3::y(), &at.normal_B).norm() < 0.1;
            if !is_level && !is_inner_tube && !name.contains("torus") {
                assert!(chart.v.gradient_B.y > 0.0, "{name}: v runs down at {at:?}");
            }
        }
    }
}

#[test]
fn axes_of_flat_pieces_are_as_documented() {
    let of = |normal: Vector3<f64>| {
        let plane = Form::from(Plane::new(normal, 0.0).unwrap());
        let chart = chart(&plane, &plane.nearest(&Vector3::zeros()));
        (chart.u.gradient_B, chart.v.gradient_B)
    };
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    assert_eq!(of(y), (x, -z), "a table, seen from above");
    assert_eq!(of(-y), (x, z), "a ceiling, seen from below");
    assert_eq!(of(z), (x, y), "a wall before the viewer");
    assert_eq!(of(-z), (-x, y));
    assert_eq!(of(x), (-z, y));
    assert_eq!(of(-x), (z, y));
    let cuboid = Form::from(Cuboid::new([0.2, 0.1, 0.06]).unwrap());
    for normal in [x, -x, y, -y, z, -z] {
        let chart = chart(&cuboid, &cuboid.nearest(&(normal * 0.2)));
        assert_eq!((chart.u.gradient_B, chart.v.gradient_B), of(normal));
        let expected =
            [chart.u, chart.v].map(|along| along.gradient_B.abs().dot(&Vector3::new(0.2, 0.1, 0.06)));
        assert_eq!([chart.u.length_m, chart.v.length_m], expected);
    }
}

#[test]
fn round_surfaces_begin_in_front_and_close_behind() {
    for (name, form, _) in
        forms().into_iter().filter(|(name, ..)| !name.contains("plane") && *name != "table")
    {
        let at = |x: f64, z: f64| chart(&form, &form.nearest(&Vector3::new(x, 0.0, z))).u;
        if name == "box" {
            continue;
        }
        assert!(at(0.0, 0.2).at_m.abs() < 1e-15, "{name}: u = 0 in front");
        assert!(at(0.2, 0.2).at_m > 0.0, "{name}: to the east");
        let (left, right) = (at(-1e-12, -0.2), at(1e-12, -0.2));
        assert!(
            left.closes && (right.at_m - left.at_m - left.length_m).abs() < 1e-9,
            "{name}: {left:?} {right:?}"
        );
    }
}

#[test]
fn a_stretched_ball_has_the_longitudes_of_the_ball() {
    let ellipsoid = Scaled::new(haptics::Sphere::new(0.05).unwrap().into(), [1.5, 0.8, 0.6]).unwrap();
    let mut noise = Noise(14);
    for _ in 0..200 {
        let on_ball = noise.vector(1.0).normalize();
        let at = on_ball.component_mul(&Vector3::new(0.075, 0.04, 0.03));
        let chart = chart(&ellipsoid, &ellipsoid.nearest(&at));
        let share = [chart.u.at_m / chart.u.length_m, chart.v.at_m / chart.v.length_m];
        assert!((share[0] - on_ball.x.atan2(on_ball.z) / TAU).abs() < 1e-12);
        assert!((share[1] - on_ball.y.asin() / PI).abs() < 1e-7, "the sine is flat at poles");
    }
}

/// Largest change of force over a walk around the form at this depth, in steps of a share of the round.
fn largest_step(form: &Form, path: impl Fn(f64) -> Vector3<f64>, steps: usize, depth_m: f64) -> f64 {
    // Whole numbers of pictures, rough ones; carved, so that every form may be met at its surface.
    let map = repeated(&rough(8, 21), 2e-4, [2.0, 2.0]).with_zero_level(1.0).unwrap();
    let entity = with(entity(*form, Friction::None), map);
    let mut finger = point_finger();
    let mut last: Option<Vector3<f64>> = None;
    let mut largest = 0.0_f64;
    for i in 0..=steps {
        let at = form.nearest(&path(i as f64 / steps as f64));
        let force = tick(&mut finger, &entity, &(at.point_B - at.normal_B * depth_m)).force_on_user_W;
        assert!(force.iter().all(|x| x.is_finite()));
        if let Some(last) = last.filter(|_| i > 1) {
            largest = largest.max((force - last).norm());
        }
        last = Some(force);
    }
    largest
}

#[test]
fn nothing_jumps_at_seams_or_over_poles() {
    for (name, form, size_m) in forms() {
        let has_edges = name == "box" || name.contains("cylinder") || name.contains("cone");
        if has_edges || name == "table" || name.contains("plane") {
            continue; // Seams of straight sides are in the next test.
        }
        let around = |t: f64| Vector3::new((TAU * t).sin(), 0.1, (TAU * t).cos()) * size_m * 1.5;
        let over =
            |t: f64, z: f64| Vector3::new((TAU * t).sin() * size_m * 1.5, (TAU * t).cos() * size_m * 1.5, z);
        let (through, past) = (|t: f64| over(t, 0.0), |t: f64| over(t, 1e-3));
        type Path<'p> = &'p dyn Fn(f64) -> Vector3<f64>;
        let paths: [(&str, Path<'_>); 3] = [("around", &around), ("through", &through), ("past", &past)];
        for (way, path) in paths {
            if way != "around" && name.contains("torus") {
                continue; // It is no closed path on a ring.
            }
            let [coarse, fine] = [5_000, 20_000].map(|steps| largest_step(&form, path, steps, 1e-3));
            // A step of the force would stay what it is; what is continuous falls with the step, four times.
            assert!(fine < 0.5 * coarse, "{name} {way}: {fine} after {coarse}");
            // And poles are not steeper than the fade lets them be: tens of times the slope at the equator.
            assert!(coarse < 0.5, "{name} {way}: {coarse}");
        }
    }
}

#[test]
fn straight_sides_have_no_step_at_their_seam() {
    for (name, form, size_m) in forms() {
        if !name.contains("cone") && !name.contains("cylinder") && !name.contains("torus") {
            continue;
        }
        let around = |t: f64| Vector3::new((TAU * t).sin(), 0.05, (TAU * t).cos()) * size_m * 1.5;
        let [coarse, fine] = [5_000, 20_000].map(|steps| largest_step(&form, around, steps, 1e-3));
        assert!(fine < 0.5 * coarse && coarse < 0.5, "{name}: {fine} after {coarse}");
    }
}

#[test]
fn at_poles_and_tips_everything_is_finite_and_nothing_stands() {
    for (name, form, size_m) in forms() {
        for side in [1.0, -1.0] {
            for aside in [0.0, 1e-300, 1e-18, 1e-9] {
                let at = form.nearest(&Vector3::new(aside, side * size_m * 2.0, 0.0));
                let map = repeated(&rough(8, 3), 1e-3, [2.0; 2]);
                let (h, slope) = map.height(&Shape::Form(form), &at);
                assert!(h.is_finite() && slope.iter().all(|x| x.is_finite()), "{name} {aside}: {h} {slope}");
                let is_pole = ["sphere", "capsule", "ellipsoid", "scaled capsule"].contains(&name);
                assert!(
                    !is_pole || h.abs() <= 1e-3 * (3.0 * (aside / (0.1 * 0.02)).powi(2)),
                    "{name} {aside}: {h}"
                );
            }
        }
    }
}

#[test]
fn slopes_are_how_heights_change_along_the_surface() {
    for (name, form, size_m) in forms() {
        let shape = Shape::Form(form);
        let mut noise = Noise(15);
        let sized_map = sized(&rough(8, 4), 2e-4, 0.03).with_zero_level(0.3).unwrap();
        let repeated_map = repeated(&rough(8, 5), 2e-4, [2.0; 2]).with_zero_level(0.9).unwrap();
        for map in [sized_map.clone(), sized_map.inverted(), repeated_map.clone(), repeated_map.inverted()] {
            let mut steepest = 0.0_f64;
            for _ in 0..1000 {
                let at = form.nearest(&noise.vector(size_m));
                let step_m = 1e-7;
                let direction = along(&noise.vector(1.0), &at.normal_B).normalize() * step_m;
                let [ahead, behind] =
                    [1.0, -1.0].map(|side| form.settle(&at, &(at.point_B + direction * side)));
                if ahead.piece != at.piece || behind.piece != at.piece {
                    continue;
                }
                let slope = map.height(&shape, &at).1;
                let risen_m = map.height(&shape, &ahead).0 - map.height(&shape, &behind).0;
                let error = (risen_m - slope.dot(&(ahead.point_B - behind.point_B))) / step_m;
                // Slopes change by at most 5 A / p^2 = 1000 per metre between texels p of a millimetre, squeezed ones
                // near poles included: 1e-4 over the step.
                assert!(error.abs() < 2e-4, "{name}: {error} beside {slope} at {at:?}");
                steepest = steepest.max(slope.norm());
            }
            let is_endless = chart(&form, &form.nearest(&Vector3::x())).u.length_m.is_infinite();
            assert!(steepest > 0.005 || is_endless, "{name}: {steepest}");
        }
    }
}

#[test]
fn a_picture_of_a_given_size_closes_around_all_the_same() {
    for (name, form, _) in forms() {
        let u = chart(&form, &form.nearest(&(Vector3::x() * 0.2))).u;
        if !u.closes {
            continue;
        }
        // 0.37 of the way around: three pictures of a third are nearest.
        let map = sized(&rough(8, 6), 1e-3, 0.37 * u.length_m);
        let near_seam = |x: f64| map.height(&Shape::Form(form), &form.nearest(&Vector3::new(x, 0.004, -0.2)));
        let (left, right) = (near_seam(-1e-9), near_seam(1e-9));
        // Slopes of at most 1e-3 over texels of some millimetres, over 2e-9 m.
        assert!(
            (left.0 - right.0).abs() < 1e-9 && (left.1 - right.1).norm() < 1e-5,
            "{name}: {left:?} {right:?}"
        );
        // And it is three of them: a third of the way around it is the same again.
        let at = |turn: f64| {
            let (x, z) = (turn * TAU).sin_cos();
            map.height(&Shape::Form(form), &form.nearest(&(Vector3::new(x, 0.01, z) * 0.2))).0
        };
        if !name.contains("scaled") && !name.contains("elliptic") && name != "ellipsoid" {
            for turn in [0.03, 0.11, 0.29] {
                assert!((at(turn) - at(turn + 1.0 / 3.0)).abs() < 1e-12, "{name} {turn}");
            }
        }
    }
}
