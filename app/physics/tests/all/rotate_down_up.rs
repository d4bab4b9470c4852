//! Rotate-down and rotate-up (Melder ch. 6.2.3, 6.2.4): they are nobody's rule, they come out of the forces.
#![allow(non_snake_case)]

use crate::common;

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use common::*;
use haptics::Cuboid;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use physics::{FingerSettings, Settings, SoftFinger};

const EDGE: f64 = 0.05;
const MASS: f64 = 0.1;
/// Where the fingers hold: 3 mm inside of the corner's edge.
const IN: f64 = 3e-3;

/// A cube on a floor without friction, held at a corner seen along x: the fingers press its faces at x = +-25 mm.
struct Corner {
    world: World,
}

impl Corner {
    /// Turned about x by so much, its centre there.
    fn new(angle: f64, centre: Vector3<f64>, soft: SoftFinger) -> Self {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle);
        let pose = Isometry3::from_parts(Translation3::from(centre), turn);
        // Between cube and floor friction is the mean of both: none. Of the cube alone the fingers feel 1.5.
        let cube = object(Cuboid::new([EDGE; 3]).unwrap(), pose, 1000.0, 1.5);
        let state = body(&cube, MASS);
        let entities = vec![floor(0.0, 5000.0, 0.0), cube];
        let world = World::new(entities, &[(1, state)], Settings::default(), 2)
            .with_fingers(FingerSettings { soft, attachment: None });
        Self { world }
    }

    /// The place on the cube where the fingers hold, between them.
    fn hold(angle: f64, centre: Vector3<f64>) -> Vector3<f64> {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle);
        centre + turn * Vector3::new(0.0, EDGE / 2.0 - IN, EDGE / 2.0 - IN)
    }

    /// One tick with both fingers at this height and depth, 2 mm into the faces: 2 N each.
    fn hold_at(&mut self, at: Vector3<f64>) -> Vec<Vector3<f64>> {
        let x = EDGE / 2.0 - 2e-3;
        self.world.step(&[Vector3::new(-x, at.y, at.z), Vector3::new(x, at.y, at.z)])
    }

    fn go(&mut self, seconds: f64, from: Vector3<f64>, to: Vector3<f64>) {
        let ticks = (seconds / DT) as usize;
        for tick in 0..=ticks {
            let share = 0.5 - 0.5 * (PI * tick as f64 / ticks as f64).cos();
            self.hold_at(from + (to - from) * share);
        }
    }

    fn angle(&self) -> f64 {
        self.world.body().orientation.scaled_axis().x
    }

    /// By how much a face is off lying flat.
    fn off_flat(&self) -> f64 {
        let angle = self.angle().rem_euclid(FRAC_PI_2);
        angle.min(FRAC_PI_2 - angle)
    }
}

#[test]
fn held_at_a_corner_and_lowered_on_a_smooth_floor_a_cube_turns_until_it_lies_flat() {
    for lean in [0.1, -0.1, 0.5] {
        // It hangs with its centre nearly below the fingers.
        let angle = -FRAC_PI_4 + lean;
        let centre = Vector3::new(0.0, 0.08, 0.0);
        let mut corner = Corner::new(angle, centre, SoftFinger::POINT);
        let high = Corner::hold(angle, centre);
        // No higher than a cube's edge over the floor in the end.
        let low = Vector3::new(0.0, EDGE - IN, high.z);
        let mut lowest_before_contact = f64::INFINITY;
        for tick in 0..4000 {
            let share = 0.5 - 0.5 * (PI * f64::from(tick) / 4000.0).cos();
            corner.hold_at(high + (low - high) * share);
            if corner.world.manipulation.rows().len() == 2 {
                lowest_before_contact = lowest_before_contact.min(corner.off_flat());
            }
        }
        // Until it touched, it swung about hanging by its corner: never near to lying flat.
        assert!(lowest_before_contact > 0.15, "{lean}: {lowest_before_contact}");
        for _ in 0..3000 {
            corner.hold_at(low);
        }
        // The fingers hold the one side and the floor the other, on springs that give some tenths of a millimetre, over
        // 50 mm.
        assert!(corner.off_flat() < 6e-3, "{lean}: {}", corner.off_flat());
        assert!((corner.world.body().centre_W.y - EDGE / 2.0).abs() < 5e-4);
        assert!(corner.world.body().angular_velocity_W().norm() < 1e-2);
    }
}

#[test]
fn pads_that_hold_by_torsion_keep_it_from_turning() {
    // Of 20 mm: they hold m g 31 mm several times over.
    let pads = SoftFinger::default().with_model(physics::TorsionModel::Coulomb {
        pad_radius_m: 0.02,
        limit_surface: physics::LimitSurface::Ellipse,
    });
    let (angle, centre) = (-FRAC_PI_4 + 0.5, Vector3::new(0.0, 0.08, 0.0));
    let mut corner = Corner::new(angle, centre, pads);
    let high = Corner::hold(angle, centre);
    corner.go(1.0, high, high + Vector3::new(0.0, 0.02, 0.0));
    // The pads give by m g 15 mm over 1 N m/rad.
    assert!((corner.angle() - angle).abs() < 0.03, "{}", corner.angle());
}

#[test]
fn lifted_at_a_corner_a_cube_turns_until_its_centre_is_below_the_fingers() {
    let centre = Vector3::new(0.0, EDGE / 2.0 - MASS * G / (4.0 * 1000.0 * 5000.0 / 6000.0), 0.0);
    let mut corner = Corner::new(0.0, centre, SoftFinger::POINT);
    let low = Corner::hold(0.0, centre);
    for _ in 0..500 {
        corner.hold_at(low);
    }
    assert!(corner.off_flat() < 0.02);
    // Slowly: it turns on the floor, one edge sliding along below, while the fingers rise by what the diagonal is longer.
    let diagonal = (EDGE - 2.0 * IN) * std::f64::consts::FRAC_1_SQRT_2;
    let hanging = low.y - centre.y;
    let clear = low + Vector3::new(0.0, 0.03, 0.0);
    corner.go(4.0, low, clear);
    let mut touched = false;
    for _ in 0..6000 {
        corner.hold_at(clear);
        touched |= corner.world.manipulation.rows().len() > 2;
    }
    assert!(!touched, "it hangs free");
    let body = corner.world.body();
    // The centre is below the axis by the whole arm, the springs by m g / 2k; it still swings a little: nothing damps a
    // point.
    let arm = (clear.y - body.centre_W.y) - MASS * G / (2.0 * 1000.0);
    assert!(arm > hanging, "lower than it lay: {arm} {hanging}");
    assert!((arm - diagonal).abs() < 0.02 * diagonal, "{arm} {diagonal}");
    assert!((corner.off_flat() - FRAC_PI_4).abs() < 0.3, "{}", corner.off_flat());
}
