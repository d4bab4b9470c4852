//! Meshes that move: none sweeps through a finger at rest.

use crate::common::meshes::*;
use crate::common::*;
use crate::mesh_oracle::winding_number;
use haptics::mesh::Mesh;
use haptics::{Entity, Friction};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use std::sync::Arc;

/// A mesh on its way past a finger that rests at the origin: straight, and spinning about an axis of its own.
struct Pass {
    start: Vector3<f64>,
    velocity_m_s: Vector3<f64>,
    turned: UnitQuaternion<f64>,
    spin_rad_s: Vector3<f64>,
}

impl Pass {
    /// Aimed at the finger, so that it hits it more often than not.
    fn random(noise: &mut Noise, speed_m_s: f64) -> Self {
        let away = unit_vector(noise) * 0.15;
        let aim = noise.vector(0.02);
        let velocity_m_s = (aim - away).normalize() * speed_m_s;
        let turned = UnitQuaternion::from_scaled_axis(noise.vector(2.0));
        // Corners at 0.1 m move as fast as the middle, up to 2 m/s.
        let spin_rad_s = unit_vector(noise) * (speed_m_s * noise.uniform() / 0.1);
        Self { start: away, velocity_m_s, turned, spin_rad_s }
    }

    fn at(&self, t: f64) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_scaled_axis(self.spin_rad_s * t) * self.turned;
        Isometry3::from_parts(Translation3::from(self.start + self.velocity_m_s * t), turn)
    }
}

/// How many ticks found the finger inside, all of which it must have felt.
fn pass_by(mesh: &Arc<Mesh>, pass: &Pass, ticks: usize, dt_s: f64) -> usize {
    let mut finger = point_finger();
    let mut entity = touchable(mesh, Friction::Coulomb { mu: 0.3 });
    entity.move_to(pass.at(0.0));
    let mut inside = 0;
    for tick in 0..ticks {
        let X_WB = pass.at(tick as f64 * dt_s);
        entity.move_to(X_WB);
        let out = finger.step(std::slice::from_ref(&entity), &Vector3::zeros(), dt_s);
        let hip_B = X_WB.inverse_transform_point(&Vector3::zeros().into()).coords;
        if is_inside(mesh, &hip_B) {
            inside += 1;
            assert!(out.entity.is_some(), "tick {tick}: {hip_B:?}, {X_WB:?}");
        }
    }
    inside
}

/// By all faces where there are few of them; a finger within rounding of the surface is not judged.
fn is_inside(mesh: &Mesh, p: &Vector3<f64>) -> bool {
    if p.amax() > mesh.extent_m() {
        return false;
    }
    if mesh.faces().len() < 1000 { winding_number(mesh, p) > 0.75 } else { mesh.is_inside_unbounded(p) }
}

#[test]
fn no_mesh_sweeps_through_a_finger_at_rest() {
    let mut noise = Noise(4);
    for (name, mesh) in [("cube", cube()), ("plate", plate()), ("star", star()), ("bumpy", bumpy_sphere(100))]
    {
        let mut inside = 0;
        for pass in 0..40 {
            // From 0.01 m/s to 2 m/s; the slow ones in ticks that are as long as they may be at 100 Hz.
            let speed_m_s = 0.01 * 200_f64.powf(f64::from(pass) / 39.0);
            let dt_s = if speed_m_s < 0.1 { 1e-2 } else { DT };
            let ticks = (0.3 / speed_m_s / dt_s) as usize;
            inside += pass_by(&mesh, &Pass::random(&mut noise, speed_m_s), ticks, dt_s);
        }
        println!("{name}: {inside} ticks inside");
        assert!(inside > 100, "{name}: {inside}");
    }
}

#[test]
fn a_thin_plate_carries_a_finger_along_at_any_speed() {
    // A plate of 2 mm moves along its normal, up to its own thickness a tick: pressed right through it, the finger is
    // pushed ahead of it all the same.
    for speed_m_s in [0.01, 0.1, 0.5, 1.0, 2.0] {
        let mut plate: Entity = touchable(&plate(), Friction::Coulomb { mu: 0.5 });
        let at = |t: f64| Isometry3::translation(0.01, -0.0095 + speed_m_s * t, 0.007);
        plate.move_to(at(0.0));
        let mut finger = point_finger();
        for tick in 0..(0.05 / speed_m_s / DT) as usize {
            let t = tick as f64 * DT;
            plate.move_to(at(t));
            let out = step(&mut finger, &plate, &Vector3::zeros());
            // Its upper side passes the finger.
            let depth_m = -0.0085 + speed_m_s * t;
            let expected_n = if depth_m > 0.0 { K * depth_m } else { 0.0 };
            assert!(
                (out.force_on_user_W - Vector3::y() * expected_n).norm() < 1e-11,
                "{speed_m_s}, {t}: {out:?}"
            );
        }
    }
}

#[test]
fn a_spinning_plate_s_flat_sides_do_not_pass_a_finger() {
    // Like a paddle wheel about z: the plate's middle is at the axis, the finger 30 mm away from it.
    for speed_m_s in [0.05, 0.5, 2.0] {
        let mut paddle = touchable(&plate(), Friction::None);
        let turned = |t: f64| Isometry3::rotation(Vector3::z() * (-0.3 + speed_m_s / 0.03 * t));
        paddle.move_to(turned(0.0));
        let mut finger = point_finger();
        let at_rest = Vector3::new(0.03, 0.0, 0.004);
        let mut last_n = 0.0;
        for tick in 0..(0.035 / speed_m_s / DT) as usize {
            let X_WB = turned(tick as f64 * DT);
            paddle.move_to(X_WB);
            let out = step(&mut finger, &paddle, &at_rest);
            let hip_B = X_WB.inverse_transform_point(&at_rest.into()).coords;
            let depth_m = 1e-3 - hip_B.y;
            // Until the foot of the finger has come to the plate's end, it is held.
            let is_held = depth_m > 0.0 && hip_B.x < 0.0499;
            assert_eq!(out.entity.is_some(), is_held, "{hip_B:?}");
            last_n = out.force_on_user_W.norm();
            assert!((last_n - if is_held { K * depth_m } else { 0.0 }).abs() < 1e-11, "{hip_B:?}");
        }
        assert!(last_n > 0.0, "still ahead of it");
    }
}
