//! Long random walks over every closed form, resting and moving.

use crate::common::*;
use crate::solids::{self, Solid};
use haptics::{ContactState, Cylinder, Ellipsoid, Entity, Feature, Friction, Surface};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

/// A walk that goes in and out near the surface and, slowly, all over it.
struct Walk {
    noise: Noise,
    u: f64,
    v: f64,
    hip: Vector3<f64>,
}

impl Walk {
    fn new(seed: u64) -> Self {
        Self { noise: Noise(seed), u: 0.1, v: 0.3, hip: Vector3::y() }
    }

    fn next(&mut self, solid: &Solid, i: u32) -> Vector3<f64> {
        self.u += 2e-3 * self.noise.gaussian();
        self.v += 2e-3 * self.noise.gaussian();
        // Mostly a few millimetres deep, now and then out.
        let aim = 0.92 + 0.13 * f64::from((i / 200).is_multiple_of(4));
        self.hip += (solid.point(self.u, self.v) * aim - self.hip) * 0.05 + self.noise.vector(1e-4);
        self.hip
    }
}

/// Of so many ticks on each solid.
fn roam_without_friction(ticks: u32) {
    for solid in solids::all() {
        let entity = entity(solid.form, Friction::None);
        let (mut finger, mut walk) = (point_finger(), Walk::new(31));
        let (mut inside, mut entered) = (0, 0);
        for i in 0..ticks {
            let was_inside = (solid.contains)(&walk.hip);
            let hip = walk.next(&solid, i);
            let out = finger.step(std::slice::from_ref(&entity), &hip, DT);
            let is_inside = solid.form.signed_distance(&hip) <= 0.0;
            assert!(out.entity.is_some() || !is_inside, "{} popped through at {hip:?}", solid.name);
            let Some(contact) = finger.contact(0) else { continue };
            inside += 1;
            entered += u32::from(!was_inside);
            // The force has no part across the normal, and the god-object none left to go: 1e-12 of the depth and a
            // few roundings of its position.
            let force = out.force_on_user_W;
            assert!((force - contact.normal_W * contact.normal_force_n).norm() <= 1e-15 * force.norm());
            let lag = contact.god_object_W - hip;
            let left = (lag - contact.normal_W * lag.dot(&contact.normal_W)).norm();
            assert!(left <= 1e-12 * lag.norm() + 1e-15 * solid.size_m, "{}: {left} left", solid.name);
            if !is_inside {
                // Pressed right through: a wall between the finger and where it came from, and no way round nearby.
                assert!(solid.form.holds_outside(&solid.form.nearest(&contact.god_object_W), lag.norm()));
                let nearest = solid.distance_near(&hip, &contact.god_object_W);
                assert!(lag.norm() <= nearest + 1e-11, "{}: free, but held at {hip:?}", solid.name);
            }
        }
        assert!(inside > ticks / 5 * 2 && entered > ticks / 5000, "{}: {inside} {entered}", solid.name);
    }
}

#[test]
fn on_long_walks_whoever_is_inside_is_felt_and_nothing_is_left_to_slide() {
    roam_without_friction(25_000);
}

/// `cargo test --release -p haptics --test shapes walks:: -- --ignored`
#[test]
#[ignore = "a minute"]
fn on_walks_of_a_million_ticks_whoever_is_inside_is_felt_and_nothing_is_left_to_slide() {
    roam_without_friction(1_000_000);
    roam_with_friction(1_000_000);
}

/// Of so many ticks on each solid.
fn roam_with_friction(ticks: u32) {
    for solid in solids::all() {
        let entity = entity(solid.form, stiction());
        let (mut finger, mut walk, mut slips) = (point_finger(), Walk::new(32), 0);
        for i in 0..ticks {
            let hip = walk.next(&solid, i);
            let out = finger.step(std::slice::from_ref(&entity), &hip, DT);
            let Some(contact) = finger.contact(0) else { continue };
            assert!(out.force_on_user_W.dot(&contact.normal_W) >= 0.0);
            let share = ratio(&out, &contact.normal_W);
            // Of depths of a millimetre, positions of 0.1 m rounded to 1e-17 are 1e-14; of the rest below.
            let rounding = 1e-15 / (contact.normal_force_n / K) + 1e-14;
            assert!(share <= MU_S + rounding || contact.normal_force_n < 1e-9, "{}: {share}", solid.name);
            let spring = contact.god_object_W - hip;
            let depth = spring.dot(&contact.normal_W);
            let gap = (spring - contact.normal_W * depth).norm();
            // A god-object that has slid this tick is on the rim of the dynamic circle; one inside it has not moved.
            if contact.friction != haptics::FrictionState::Slip
                || depth < 1e-4
                || gap < MU_D * depth * (1.0 - 1e-9)
            {
                continue;
            }
            slips += 1;
            // Flat pieces: rounding alone, and 1e-9 promised. Curved ones rest within 1e-12 of the depth.
            let tolerance = if contact.feature == Feature::Face { 1e-12 } else { 1e-11 };
            assert!((share - MU_D).abs() < tolerance, "{}: {share}", solid.name);
            assert!((gap / depth - MU_D).abs() < tolerance, "{}: {}", solid.name, gap / depth);
        }
        assert!(slips > ticks / 200, "{}: {slips}", solid.name);
    }
}

#[test]
fn sliding_it_bears_the_dynamic_coefficient_on_every_shape() {
    roam_with_friction(25_000);
}

/// Rounds a smooth shape with the HIP at nine tenths of its surface points.
fn work_around(solid: &Solid, at: impl Fn(f64) -> Vector3<f64>) -> f64 {
    let entity = entity(solid.form, Friction::None);
    let (mut finger, mut work, mut before) = (point_finger(), 0.0, None);
    finger.step(std::slice::from_ref(&entity), &(at(0.0) * 2.0), DT);
    let ticks = 4000;
    for i in 0..=ticks {
        let hip = at(f64::from(i) / f64::from(ticks));
        let out = finger.step(std::slice::from_ref(&entity), &hip, DT);
        assert!(out.entity.is_some());
        if let Some((hip_before, force_before)) = before.replace((hip, out.force_on_user_W)) {
            work += 0.5 * (out.force_on_user_W + force_before).dot(&(hip - hip_before));
        }
    }
    work
}

#[test]
fn a_closed_frictionless_loop_costs_no_work() {
    for solid in solids::all() {
        let loops = [
            // Around the axis, a little above the middle.
            work_around(&solid, |t| {
                solid.point(t, if solid.name.contains("torus") { 0.2 } else { 0.45 }) * 0.95
            }),
        ];
        for work in loops {
            // The trapezoid rule over a closed smooth loop of 4000 ticks has an error far below rounding; rests within
            // 1e-12 of 5 mm at 500 N/m over 0.4 m of path make 1e-12 J. Friction of 0.001 would cost 1e-3 J.
            assert!(work.abs() < 2e-12, "{}: {work}", solid.name);
        }
    }
    for (name, radii) in [("lozenge", [0.06, 0.02, 0.04]), ("ball", [0.03, 0.03, 0.03])] {
        let solid = Solid { name, ..solids::ellipsoid(radii) };
        let over = work_around(&solid, |t| {
            let (s, c) = (std::f64::consts::TAU * t).sin_cos();
            Vector3::new(radii[0] * c * 0.9, radii[1] * s * 0.9, 0.2 * radii[2] * s)
        });
        assert!(over.abs() < 2e-12, "{name}: {over}");
    }
}

/// Moves the shape at `speed` over a finger at rest at the origin, turning at up to 20 rad/s.
fn sweep(solid: &Solid, speed: f64, noise: &mut Noise, law: &Friction) {
    let direction = noise.vector(1.0).normalize();
    let spin = noise.vector(10.0 * speed.min(1.0));
    let turned = UnitQuaternion::from_scaled_axis(noise.vector(2.0));
    let aside = direction.cross(&noise.vector(1.0)).normalize() * noise.between(0.0, 0.5 * solid.size_m);
    let pose = |t: f64| {
        let rotation = UnitQuaternion::from_scaled_axis(spin * t) * turned;
        Isometry3::from_parts((direction * (speed * t) + aside).into(), rotation)
    };
    let mut entity = Entity { X_WB: pose(-2.0), ..entity(solid.form, law.clone()) };
    let mut finger = point_finger();
    // From just out of reach, in at most 400 ticks, until the finger is a few millimetres inside.
    let start = -1.8 * solid.size_m / speed;
    entity.move_to(pose(start));
    entity.move_to(pose(start));
    let mut first = None;
    let ticks = 3000;
    for i in 0..ticks {
        let t = start + f64::from(i) * DT.max(1e-3 * solid.size_m / speed);
        entity.move_to(pose(t));
        let was = finger.contact(0).is_some();
        let out = finger.step(std::slice::from_ref(&entity), &Vector3::zeros(), DT);
        let hip_B = entity.X_WB.inverse_transform_point(&nalgebra::Point3::origin()).coords;
        let is_inside = solid.form.signed_distance(&hip_B) <= 0.0;
        assert!(out.entity.is_some() || !is_inside, "{} at {speed} m/s swept past", solid.name);
        let Some(contact) = finger.contact(0) else { continue };
        if !was && first.is_none() {
            first = Some(contact.normal_W);
            // It comes on with the side that meets the finger, at the speed of the material there.
            let entry_B = entity.X_WB.inverse_transform_point(&contact.god_object_W.into());
            let moved = (entity.X_WB * entry_B - entity.previous_X_WB * entry_B) / DT;
            assert!(
                contact.normal_W.dot(&moved) > -1e-6 * moved.norm(),
                "{}: entered from behind",
                solid.name
            );
        }
    }
}

#[test]
fn moving_shapes_never_sweep_past_a_resting_finger() {
    for solid in solids::all() {
        let mut noise = Noise(33);
        for speed in [0.01, 0.03, 0.1, 0.3, 1.0, 2.0] {
            for law in [Friction::None, stiction()] {
                for _ in 0..3 {
                    sweep(&solid, speed, &mut noise, &law);
                }
            }
        }
    }
}

#[test]
fn thin_plates_at_two_metres_per_second_carry_the_finger_along() {
    let coin = Solid { name: "coin", ..solids::cylinder(0.05, 5e-4) };
    for solid in [solids::cuboid([0.1, 5e-4, 0.1]), coin] {
        for speed in [0.01, 0.1, 0.5, 2.0] {
            for law in [Friction::None, stiction()] {
                let mut plate = entity(solid.form, law);
                let mut finger = point_finger();
                for i in -20..40 {
                    // Down onto the finger, with a tilt and a turn about the vertical.
                    let t = f64::from(i) * DT + 3e-4;
                    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.1, 5.0 * t, 0.05));
                    plate.move_to(Isometry3::from_parts(Vector3::new(1e-3, -speed * t, 0.0).into(), turn));
                    if i == -20 {
                        plate.previous_X_WB = plate.X_WB;
                    }
                    let out = finger.step(std::slice::from_ref(&plate), &Vector3::zeros(), DT);
                    let is_past = speed * t > 0.0;
                    let lead = speed * t.abs() > 4e-4;
                    assert!(out.entity.is_some() || !is_past, "{} at {speed}: lost at {t}", solid.name);
                    assert!(
                        out.entity.is_none() || is_past || !lead,
                        "{} at {speed}: felt early",
                        solid.name
                    );
                    assert!(!is_past || out.force_on_user_W.y < 0.0, "pushed ahead of the plate");
                }
            }
        }
    }
}

#[test]
fn a_finger_resting_on_a_moving_shape_rides_along() {
    for solid in solids::all() {
        let mut entity = entity(solid.form, Friction::coulomb(1.0).unwrap());
        let top = solid.form.nearest(&solid.point(0.1, 0.3));
        let (out_B, in_B) = (top.point_B + top.normal_B * 1e-3, top.point_B - top.normal_B * 2e-3);
        let mut finger = point_finger();
        finger.step(std::slice::from_ref(&entity), &out_B, DT);
        for i in 1..2000 {
            let t = f64::from(i) * DT;
            let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(3.0, -2.0, 1.0) * t);
            entity.move_to(Isometry3::from_parts(
                Vector3::new(0.5 * t, 0.0, 0.1 * (9.0 * t).sin()).into(),
                rotation,
            ));
            let hip = entity.X_WB * nalgebra::Point3::from(in_B);
            let out = finger.step(std::slice::from_ref(&entity), &hip.coords, DT);
            assert_eq!(out.friction, ContactState::Stick, "{}", solid.name);
            let expected = entity.X_WB * top.normal_B * (K * 2e-3);
            // Positions of 1 m rounded and rotated twice, times the stiffness.
            assert!(
                (out.force_on_user_W - expected).norm() < 1e-12,
                "{}: {}",
                solid.name,
                out.force_on_user_W
            );
        }
    }
}

#[test]
fn very_flat_and_very_long_ellipsoids_come_to_rest_too() {
    let mut noise = Noise(34);
    for radii in [[1e-4, 0.1, 0.1], [0.1, 1e-4, 1e-4], [0.1, 0.01, 1e-4], [0.05, 0.05, 0.05 * (1.0 - 1e-12)]]
    {
        let shape = Ellipsoid::new(radii).unwrap();
        for _ in 0..20_000 {
            let u = noise.vector(1.0).normalize().component_mul(&Vector3::from(radii));
            for factor in [0.0, 1e-9, 0.3, 0.999_999, 1.0, 1.5, 1e6] {
                let p = u * factor;
                let at = shape.nearest(&p);
                assert!(
                    (at.normal_B.norm() - 1.0).abs() < 1e-15
                        && shape.signed_distance(&at.point_B).abs() < 1e-15
                );
                // Stationary: what is left lies along the normal, to the rounding of the coordinates where it is steep.
                let lag = p - at.point_B;
                let left = lag.cross(&at.normal_B).norm();
                let sharpest = 0.1f64.powi(2) / 1e-4;
                let tolerance =
                    1e-15 * (lag.norm() + 0.1) * (1.0 + lag.norm() / sharpest.recip().min(1e-7)).min(1e3);
                assert!(left <= tolerance.max(1e-13), "{radii:?} {p:?}: {left} of {}", lag.norm());
            }
        }
    }
}

#[test]
fn a_cylinder_is_smooth_around_and_flat_on_top() {
    let cylinder = Cylinder::new(0.03, 0.08).unwrap();
    assert_eq!(cylinder.nearest(&Vector3::new(0.029, 0.0, 0.0)).feature, Feature::Surface);
    assert_eq!(cylinder.nearest(&Vector3::new(0.0, 0.039, 0.0)).feature, Feature::Face);
}
