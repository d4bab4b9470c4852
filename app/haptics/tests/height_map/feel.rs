//! Height maps against closed forms: waves on planes and balls, both forms, signs, dents, friction and touch.

use crate::common::pictures::*;
use crate::common::*;
use haptics::{
    Algorithm, Border, Cuboid, Entity, Finger, Friction, HeightForm, HeightGrid, HeightMap, HeightMapError,
    PictureScale, Shape, Sphere,
};
use nalgebra::{Isometry3, Vector3};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// Half a millimetre, five of them in a centimetre: slopes up to 0.16.
const AMPLITUDE_M: f64 = 5e-4;
const SIZE_M: f64 = 0.01;

/// Height and slope of the wave at x on a plane: its picture's middle is at 0, and so is the middle of its fall.
fn wave_at(x: f64) -> (f64, f64) {
    let angle = TAU * (x / SIZE_M + 0.5);
    let height_m = AMPLITUDE_M * (0.5 + 0.5 * kept() * angle.sin());
    (height_m, AMPLITUDE_M * 0.5 * kept() * TAU / SIZE_M * angle.cos())
}

fn places() -> impl Iterator<Item = (f64, f64)> {
    let mut noise = Noise(3);
    (0..500).map(move |_| (noise.between(-0.03, 0.03), noise.between(1e-4, 4e-3)))
}

#[test]
fn along_the_force_a_wave_adds_its_height_times_the_stiffness() {
    let map = sized(&wave(), AMPLITUDE_M, SIZE_M).with_form(HeightForm::AlongForce);
    let entity = with(table(Friction::None), map);
    for (x, depth) in places() {
        let force = force_at(&entity, &Vector3::new(x, -depth, 0.004));
        let expected = Vector3::y() * (K * (depth + wave_at(x).0));
        assert!((force - expected).norm() <= K * AMPLITUDE_M * WAVE_ERROR, "{x} {depth}: {force} {expected}");
    }
}

#[test]
fn along_the_force_means_along_friction_too() {
    let mu = 0.4;
    let map = sized(&wave(), AMPLITUDE_M, SIZE_M).with_form(HeightForm::AlongForce);
    let entity = with(table(Friction::coulomb(mu).unwrap()), map);
    let mut finger = point_finger();
    for i in 0..2000 {
        let (x, depth) = (f64::from(i) * 2e-5, 2e-3);
        let out = tick(&mut finger, &entity, &Vector3::new(x, -depth, 0.0));
        if i < 100 {
            continue;
        }
        // The god-object lags by mu d, and the height is that below it.
        let (h, _) = wave_at(x - mu * depth);
        let plain = K * depth * Vector3::new(-mu, 1.0, 0.0);
        let expected = plain + plain.normalize() * (K * h);
        assert!((out.force_on_user_W - expected).norm() <= K * AMPLITUDE_M * WAVE_ERROR, "{x}");
        assert!((ratio(&out, &Vector3::y()) - mu).abs() < 1e-12, "{x}");
    }
}

#[test]
fn a_raised_surface_pushes_along_its_own_normal() {
    let entity = with(table(Friction::None), sized(&wave(), AMPLITUDE_M, SIZE_M));
    for (x, depth) in places() {
        let force = force_at(&entity, &Vector3::new(x, -depth, 0.004));
        let (h, slope) = wave_at(x);
        let expected = Vector3::new(-slope, 1.0, 0.0) * (K * (depth + h));
        let tolerance =
            K * (AMPLITUDE_M * WAVE_ERROR + (depth + h) * SLOPE_ERROR * AMPLITUDE_M * PI / SIZE_M);
        assert!((force - expected).norm() <= tolerance, "{x} {depth}: {force} {expected}");
    }
}

#[test]
fn a_raised_surface_reports_itself() {
    let entity = with(table(Friction::None), sized(&wave(), AMPLITUDE_M, SIZE_M));
    let mut finger = point_finger();
    for (x, depth) in places() {
        tick(&mut finger, &entity, &Vector3::new(x, -depth, 0.0));
        let contact = *finger.contact(0).unwrap();
        let (h, slope) = wave_at(x);
        let expected = Vector3::new(x, h, 0.0);
        assert!((contact.god_object_W - expected).norm() <= AMPLITUDE_M * WAVE_ERROR);
        let normal = Vector3::new(-slope, 1.0, 0.0).normalize();
        assert!((contact.normal_W - normal).norm() <= SLOPE_ERROR * AMPLITUDE_M * PI / SIZE_M);
        // The force is along that normal to rounding.
        assert!((contact.force_on_user_W - contact.normal_W * contact.normal_force_n).norm() < 1e-14);
        tick(&mut finger, &entity, &Vector3::new(x, 0.1, 0.0));
    }
}

#[test]
fn up_the_picture_is_away_from_the_viewer_on_a_table() {
    // v is along -z: rising with v, the wave falls with z.
    let entity = with(table(Friction::None), sized(&wave_up(), AMPLITUDE_M, SIZE_M));
    for (z, depth) in places() {
        let force = force_at(&entity, &Vector3::new(0.003, -depth, -z));
        let (h, slope) = wave_at(z);
        let expected = Vector3::new(0.0, 1.0, slope) * (K * (depth + h));
        let tolerance =
            K * (AMPLITUDE_M * WAVE_ERROR + (depth + h) * SLOPE_ERROR * AMPLITUDE_M * PI / SIZE_M);
        assert!((force - expected).norm() <= tolerance, "{z} {depth}: {force} {expected}");
    }
}

#[test]
fn a_wave_around_a_ball_leans_the_force_east_and_west() {
    let (radius, times) = (0.05, 24.0);
    let map = repeated(&wave(), 1e-4, [times, 1.0]).with_zero_level(1.0).unwrap();
    let entity = with(ball(radius, Friction::None), map);
    let mut noise = Noise(5);
    for _ in 0..300 {
        let (longitude, latitude) = (noise.between(-PI, PI), noise.between(-1.2, 1.2));
        let depth = noise.between(5e-4, 3e-3);
        let out =
            Vector3::new(longitude.sin() * latitude.cos(), latitude.sin(), longitude.cos() * latitude.cos());
        let east = Vector3::new(longitude.cos(), 0.0, -longitude.sin());
        let force = force_at(&entity, &(out * (radius - depth)));
        let angle = times * longitude + PI * times;
        let h = 1e-4 * (0.5 * kept() * angle.sin() - 0.5);
        let slope = 0.5e-4 * kept() * times * angle.cos() / (radius * latitude.cos());
        let expected = (out - east * slope) * (K * (depth + h));
        let tolerance =
            K * 1e-4 * (WAVE_ERROR + (depth + h) * SLOPE_ERROR * 0.5 * times / (radius * latitude.cos()));
        assert!((force - expected).norm() <= tolerance, "{longitude} {latitude}: {force} {expected}");
    }
}

#[test]
fn a_wave_up_a_ball_leans_the_force_north_and_south() {
    let (radius, times) = (0.05, 9.0);
    let entity = with(ball(radius, Friction::None), repeated(&wave_up(), -1e-4, [1.0, times]));
    for i in 1..100 {
        let latitude = -1.3 + 0.026 * f64::from(i);
        let (out, north) = (
            Vector3::new(0.0, latitude.sin(), latitude.cos()),
            Vector3::new(0.0, latitude.cos(), -latitude.sin()),
        );
        let depth = 2e-3;
        let force = force_at(&entity, &(out * (radius - depth)));
        let angle = times * (2.0 * latitude + PI);
        let h = -1e-4 * (0.5 + 0.5 * kept() * angle.sin());
        let slope = -0.5e-4 * kept() * times * 2.0 * angle.cos() / radius;
        let expected = (out - north * slope) * (K * (depth + h));
        let tolerance = K * 1e-4 * (WAVE_ERROR + depth * SLOPE_ERROR * times / radius);
        assert!((force - expected).norm() <= tolerance, "{latitude}: {force} {expected}");
    }
}

#[test]
fn a_turned_entity_takes_its_picture_along() {
    let X_WB = Isometry3::new(Vector3::new(0.1, -0.2, 0.3), Vector3::new(0.4, 1.1, -0.7));
    let map = sized(&wave(), AMPLITUDE_M, SIZE_M);
    let still = with(table(Friction::None), map);
    let turned = Entity { X_WB, previous_X_WB: X_WB, ..still.clone() };
    for (x, depth) in places().take(100) {
        let hip_B = Vector3::new(x, -depth, 0.001);
        let expected = X_WB * force_at(&still, &hip_B);
        let force = force_at(&turned, &(X_WB * nalgebra::Point3::from(hip_B)).coords);
        // Positions of half a metre are rounded to 1e-16, slopes are per texel of 0.16 mm.
        assert!((force - expected).norm() < 1e-11, "{}", (force - expected).norm());
    }
}

#[test]
fn white_is_raised_and_a_negative_amplitude_a_zero_level_or_inversion_carve_it() {
    let (hip, depth) = (Vector3::new(0.0, -2e-3, 0.0), 2e-3);
    let map = |value: f32| sized(&even(value), 1e-3, 0.1);
    let zero = |map: HeightMap, level| map.with_zero_level(level).unwrap();
    for (map, expected_m) in [
        (map(0.0), 0.0),
        (map(1.0), 1e-3),
        (map(0.5), 0.5e-3),
        (zero(map(1.0), 1.0), 0.0),
        (zero(map(0.0), 1.0), -1e-3),
        (zero(map(0.25), 0.5), -0.25e-3),
        (map(1.0).inverted(), 0.0),
        (map(0.25).inverted(), 0.75e-3),
        (zero(map(0.25).inverted(), 0.5), 0.25e-3),
        (map(0.25).inverted().inverted(), 0.25e-3),
        (sized(&even(1.0), -1e-3, 0.1), -1e-3),
        (sized(&even(0.25), -1e-3, 0.1).inverted(), -0.75e-3),
    ] {
        let [low, high] = map.range_m();
        // Products and differences of numbers of a millimetre.
        assert!((low - expected_m).abs() < 1e-18 && (high - expected_m).abs() < 1e-18);
        for form in [HeightForm::AlongForce, HeightForm::Gradient] {
            let force = force_at(&with(table(Friction::None), map.clone().with_form(form)), &hip);
            assert!(
                (force - Vector3::y() * (K * (depth + expected_m))).norm() < 1e-14,
                "{form:?} {expected_m}"
            );
        }
    }
}

#[test]
fn a_raised_surface_is_touched_at_its_own_height_and_without_a_step() {
    for shape in [
        Shape::from(haptics::Plane::new(Vector3::y(), 0.0).unwrap()),
        Sphere::new(0.05).unwrap().into(),
        Cuboid::new([0.1; 3]).unwrap().into(),
        haptics::Ellipsoid::new([0.05, 0.04, 0.06]).unwrap().into(),
        Shape::own(Sphere::new(0.05).unwrap()),
    ] {
        // Not at the pole of anything, where heights fade.
        let out = if shape == table(Friction::None).shape { Vector3::y() } else { Vector3::x() };
        let top = if out == Vector3::y() { 0.0 } else { 0.05 };
        // Even, so that its height is exact; as high as the highest, and half as high as that.
        for (value, h) in [(1.0, 1e-3), (0.5, 0.5e-3)] {
            let mut values = vec![value; 16 * 16];
            values[0] = 1.0;
            let grid = Arc::new(HeightGrid::new(16, 16, values).unwrap());
            let map = HeightMap::new(grid, 1e-3, PictureScale::Size([0.1; 2])).unwrap();
            assert_eq!(map.lift_m(&shape, 0.0), 1e-3);
            let entity = with(entity(shape.clone(), Friction::None), map);
            let mut finger = point_finger();
            for i in 0..300 {
                let above = 2.005e-3 - 1e-5 * f64::from(i);
                let out = tick(&mut finger, &entity, &(out * (top + above)));
                // 1e-15: roundings of positions of 0.05 m, times 500 N/m.
                let expected = K * (h - above).max(0.0);
                assert!((out.force_on_user_W.norm() - expected).abs() < 1e-13, "{shape:?} {above}");
                assert_eq!(out.entity.is_some(), above < h, "{shape:?} {above} {h}");
            }
        }
    }
}

#[test]
fn along_the_force_and_where_a_shape_cannot_grow_touch_begins_at_the_base() {
    let map = sized(&even(1.0), 1e-3, 0.05);
    let scaled =
        haptics::Scaled::new(haptics::Cylinder::new(0.05, 0.1).unwrap().into(), [1.0, 1.0, 0.8]).unwrap();
    for (entity, top) in [
        (with(table(Friction::None), map.clone().with_form(HeightForm::AlongForce)), 0.0),
        (with(entity(scaled, Friction::None), map), 0.05),
    ] {
        assert_eq!(entity.height_map.as_ref().unwrap().lift_m(&entity.shape, 0.0), 0.0);
        let mut finger = point_finger();
        for (above, expected) in [(1e-3, 0.0), (1e-6, 0.0), (-1e-6, K * 1.001e-3)] {
            let force = tick(&mut finger, &entity, &(Vector3::y() * (top + above))).force_on_user_W;
            assert!((force.norm() - expected).abs() < 1e-13, "{above}: {force}");
        }
    }
}

#[test]
fn above_a_dent_the_finger_is_free() {
    // Black stays at the surface, white is carved a millimetre deep.
    for (form, friction) in [
        (HeightForm::Gradient, Friction::None),
        (HeightForm::Gradient, stiction()),
        (HeightForm::AlongForce, Friction::None),
        (HeightForm::AlongForce, stiction()),
    ] {
        let map = sized(&wave(), -1e-3, SIZE_M).with_form(form);
        let entity = with(table(friction.clone()), map);
        let mut finger = point_finger();
        let (mut free, mut pressed) = (0, 0);
        for i in 0..4000 {
            let x = 1e-5 * f64::from(i);
            let out = tick(&mut finger, &entity, &Vector3::new(x, -0.4e-3, 0.0));
            assert_eq!(out.entity.is_some(), out.force_on_user_W.norm() > 0.0, "{form:?} {x}");
            assert!(out.force_on_user_W.y >= -1e-12, "{form:?} {x}: it pulls");
            let h = 2.0 * -wave_at(x).0;
            let lag = if matches!(friction, Friction::None) { 1e-8 } else { MU_S * 0.4e-3 };
            if h < -0.4e-3 - lag * 1e-3 * PI / SIZE_M - 1e-7 && matches!(friction, Friction::None) {
                assert_eq!(out.entity, None, "{form:?} {x} {h}");
                free += 1;
            } else if h > -0.4e-3 + lag + 1e-7 {
                assert_eq!(out.entity, Some(0), "{form:?} {x} {h}");
                pressed += 1;
            }
        }
        assert!(pressed > 200 && (free > 200 || !matches!(friction, Friction::None)), "{free} {pressed}");
    }
}

#[test]
fn coming_down_into_a_dent_strains_nothing() {
    // Sideways above the dent, then down: as if the finger had come from above.
    let map = sized(&even(1.0), -1e-3, SIZE_M);
    let entity = with(table(Friction::coulomb(0.8).unwrap()), map);
    // With the usual ramp, which is for what begins inside: this does not, even where the first tick is.
    let mut finger = Finger::new(0.0, 1).unwrap();
    for i in 0..400 {
        let out = tick(&mut finger, &entity, &Vector3::new(1e-5 * f64::from(i), -0.5e-3, 0.0));
        assert_eq!(out.entity, None);
    }
    for i in 0..100 {
        let depth = 0.5e-3 + 1e-5 * f64::from(i);
        let out = tick(&mut finger, &entity, &Vector3::new(399e-5, -depth, 0.0));
        assert!(out.force_on_user_W.x.abs() < 1e-15, "{out:?}");
        assert!((out.force_on_user_W.y - K * (depth - 1e-3).max(0.0)).abs() < 1e-14, "{depth}");
    }
    assert!(finger.contact(0).is_some());
    // And it leaves as it came.
    assert_eq!(tick(&mut finger, &entity, &Vector3::new(0.0, 0.001, 0.0)).entity, None);
}

#[test]
fn friction_is_borne_by_the_leaning_normal() {
    let mu = 0.3;
    let entity = with(table(Friction::coulomb(mu).unwrap()), sized(&wave(), AMPLITUDE_M, SIZE_M));
    let mut finger = point_finger();
    let mut slid = 0;
    for i in 0..4000 {
        tick(&mut finger, &entity, &Vector3::new(1e-5 * f64::from(i), -2e-3, 0.0));
        let contact = finger.contact(0).unwrap();
        let normal_n = contact.force_on_user_W.dot(&contact.normal_W);
        let tangential_n = (contact.force_on_user_W - contact.normal_W * normal_n).norm();
        assert!((normal_n - contact.normal_force_n).abs() < 1e-14);
        assert!(tangential_n <= mu * normal_n * (1.0 + 1e-13));
        if contact.friction == haptics::FrictionState::Slip {
            assert!((tangential_n / normal_n - mu).abs() < 1e-12);
            slid += 1;
        }
    }
    assert!(slid > 3000, "{slid}");
}

#[test]
fn a_round_finger_feels_the_picture_where_it_touches() {
    let radius = 0.01;
    let map = sized(&wave(), AMPLITUDE_M, SIZE_M);
    for entity in [with(table(Friction::None), map.clone()), with(ball(0.05, Friction::None), map)] {
        let top = if matches!(entity.shape, Shape::Form(haptics::Form::Sphere(_))) { 0.05 } else { 0.0 };
        let mut round = finger(radius);
        let mut point = point_finger();
        for i in 0..200 {
            let angle = 1e-3 * f64::from(i);
            let out = if top > 0.0 { Vector3::new(angle.sin(), angle.cos(), 0.0) } else { Vector3::y() };
            let at = if top > 0.0 { out * top } else { Vector3::x() * (0.05 * angle) };
            let round_n = tick(&mut round, &entity, &(at + out * (radius - 1e-3))).force_on_user_W;
            let point_n = tick(&mut point, &entity, &(at - out * 1e-3)).force_on_user_W;
            // On a ball the centre and the point see it from elsewhere, to rounding in the same direction.
            assert!((round_n - point_n).norm() < 1e-11, "{round_n} {point_n}");
        }
    }
}

#[test]
fn every_algorithm_feels_the_same_relief() {
    for form in [HeightForm::AlongForce, HeightForm::Gradient] {
        let entity = with(table(Friction::None), sized(&rough(16, 4), AMPLITUDE_M, SIZE_M).with_form(form));
        for (x, depth) in places().take(100) {
            let path = [0.01, -depth].map(|y| Vector3::new(x, y, 0.002));
            let felt = |algorithm: Algorithm| {
                let entity = entity.clone().with_algorithm(algorithm);
                let mut finger = point_finger();
                path.map(|hip| tick(&mut finger, &entity, &hip).force_on_user_W)[1]
            };
            let expected = felt(Algorithm::FrictionCone);
            for algorithm in [Algorithm::VectorField, Algorithm::ClassicGodObject] {
                let force = felt(algorithm.clone());
                assert!((force - expected).norm() < 1e-12, "{algorithm:?}: {force} {expected}");
            }
        }
    }
}

#[test]
fn beyond_a_clamped_picture_its_border_goes_on_and_is_level() {
    let map = sized(&picture(8, |u, _| u), 1e-3, SIZE_M).with_border(Border::Clamp);
    let entity = with(table(Friction::None), map);
    for (x, expected_m) in
        [(-1.0, 1.0 / 16.0), (-0.0064, 1.0 / 16.0), (0.0064, 15.0 / 16.0), (1e3, 15.0 / 16.0)]
    {
        let force = force_at(&entity, &Vector3::new(x, -2e-3, 0.0));
        assert!((force - Vector3::y() * (K * (2e-3 + 1e-3 * expected_m))).norm() < 1e-13, "{x}: {force}");
    }
    // In the middle it rises by a millimetre over a centimetre.
    let force = force_at(&entity, &Vector3::new(0.0, -2e-3, 0.0));
    assert!((force - Vector3::new(-0.1, 1.0, 0.0) * (K * 2.5e-3)).norm() < 1e-13, "{force}");
}

#[test]
fn what_cannot_be_a_height_map_is_refused_in_words() {
    let told = |result: Result<HeightGrid, HeightMapError>| result.unwrap_err().to_string();
    assert_eq!(
        told(HeightGrid::new(0, 3, vec![])),
        "a picture of 0 x 3 texels; allowed are 1 to 4096 along each side"
    );
    assert_eq!(told(HeightGrid::new(2, 2, vec![0.0; 3])), "3 heights for 4 texels; allowed is one for each");
    assert_eq!(
        told(HeightGrid::new(2, 1, vec![0.0, f32::NAN])),
        "texel 1 is NaN; allowed are numbers from 0 (black) to 1 (white)"
    );
    let of =
        |amplitude_m, scale| HeightMap::new(even(1.0), amplitude_m, scale).map_err(|error| error.to_string());
    let size = PictureScale::Size([0.1; 2]);
    assert_eq!(of(f64::NAN, size).unwrap_err(), "amplitude_m is NaN; allowed is a number from -1 to 1");
    assert_eq!(of(1.5, size).unwrap_err(), "amplitude_m is 1.5; allowed is a number from -1 to 1");
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(
            of(0.1, PictureScale::Repeat([1.0, bad])).unwrap_err(),
            format!("repeat is {bad}; allowed is a finite number > 0")
        );
    }
    assert!(of(0.1, size).unwrap().with_zero_level(-0.1).is_err());
}

#[test]
fn a_picture_that_does_not_fit_its_shape_is_refused() {
    let size = sized(&even(1.0), 1e-3, 0.1);
    let repeat = |times| repeated(&even(1.0), 1e-3, times);
    let mesh = || haptics::mesh::make::cuboid([0.1; 3]);
    let plain = Shape::from(Arc::new(haptics::mesh::Mesh::build(mesh()).unwrap().0));
    let with_uv = haptics::mesh::Mesh::build_with_uv(mesh(), &[[[0.0; 2]; 3]; 12]).unwrap().0;
    let with_uv = Shape::from(Arc::new(with_uv));
    let plane = table(Friction::None).shape;
    let sphere = ball(0.1, Friction::None).shape;
    let torus = Shape::from(haptics::Torus::new(0.1, 0.02).unwrap());
    let cuboid = Shape::from(Cuboid::new([0.1; 3]).unwrap());
    for (map, shape, expected) in [
        (&size, &plane, Ok(())),
        (&repeat([2.0; 2]), &plane, Err(HeightMapError::Endless)),
        (&repeat([3.0, 1.5]), &sphere, Ok(())),
        (&repeat([2.5, 1.0]), &sphere, Err(HeightMapError::Seam { found: 2.5 })),
        (&repeat([1.0, 0.5]), &torus, Err(HeightMapError::Seam { found: 0.5 })),
        (&repeat([1.3, 0.5]), &cuboid, Ok(())),
        (&size, &torus, Ok(())),
        (&repeat([1.5; 2]), &plain, Err(HeightMapError::NoCoordinates)),
        (&repeat([1.5; 2]), &with_uv, Ok(())),
        (&size, &with_uv, Err(HeightMapError::NoMetres)),
    ] {
        assert_eq!(map.check_fit(shape), expected, "{map:?} {shape:?}");
    }
    let own = Shape::own(Flat);
    assert_eq!(size.check_fit(&own), Err(HeightMapError::NoCoordinates));
}

/// A surface that knows no coordinates.
#[derive(Debug)]
struct Flat;

impl haptics::Surface for Flat {
    fn signed_distance(&self, point_B: &Vector3<f64>) -> f64 {
        point_B.y
    }
    fn nearest(&self, point_B: &Vector3<f64>) -> haptics::SurfacePoint {
        haptics::SurfacePoint {
            point_B: Vector3::new(point_B.x, 0.0, point_B.z),
            normal_B: Vector3::y(),
            feature: haptics::Feature::Surface,
            piece: 0,
        }
    }
    fn entry(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<haptics::SurfacePoint> {
        (from_B.y > 0.0 && to_B.y <= 0.0).then(|| self.nearest(to_B))
    }
    fn settle(&self, _: &haptics::SurfacePoint, on_tangent_plane_B: &Vector3<f64>) -> haptics::SurfacePoint {
        self.nearest(on_tangent_plane_B)
    }
    fn grown(&self, _: f64) -> Option<Self> {
        None
    }
}

#[test]
fn a_map_that_does_not_fit_is_no_relief_but_does_no_harm() {
    // Nobody is forced to ask first.
    for (shape, map) in [
        (Shape::own(Flat), sized(&rough(8, 1), 1e-3, 0.01)),
        (table(Friction::None).shape, repeated(&rough(8, 1), 1e-3, [3.0; 2]).with_zero_level(0.0).unwrap()),
    ] {
        let entity = with(entity(shape, Friction::None), map);
        let mut finger = Finger::new(0.0, 1).unwrap();
        for i in 0..100 {
            let out = tick(
                &mut finger,
                &entity,
                &Vector3::new(1e-4 * f64::from(i), 1e-3 - 1e-4 * f64::from(i), 0.0),
            );
            assert!(out.force_on_user_W.x.abs() < 1e-12 && out.force_on_user_W.y.is_finite());
        }
    }
}
