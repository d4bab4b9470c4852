//! Pins in bores of their own size, recessed: the corner between the pin's top and the bore's wall is one of two parts, whose walls
//! coincide below it but for rounding, or for a crack that is none to a finger.

use crate::common::meshes::*;
use crate::common::*;
use haptics::Friction;
use haptics::mesh::{Mesh, TriangleSoup};
use nalgebra::{Rotation3, Vector3};
use std::f64::consts::TAU;

const RADIUS_M: f64 = 0.012;
/// Of the pin's top below that of the ring.
const RECESS_M: f64 = 0.009;
const TOP_M: f64 = 0.023;
/// Width of a crack that is none, in meshes of this size (`beside.rs`: a share of 2e-4 of the largest coordinate).
const CRACK_M: f64 = 4e-6;

/// A pin and a ring around it.
struct Assembly {
    corners: u32,
    turn: Rotation3<f64>,
    /// Between the pin and the bore; negative where they overlap.
    gap_m: f64,
    /// End of the pin: the smaller of two parts is moved.
    pin_low_m: f64,
    is_single: bool,
}

impl Assembly {
    fn any(case: usize, noise: &mut Noise) -> Self {
        let turn = Rotation3::from_scaled_axis(Vector3::from_fn(|_, _| noise.between(-3.0, 3.0)));
        Self {
            corners: [4, 6, 12, 24][case % 4],
            turn: if case.is_multiple_of(3) { Rotation3::identity() } else { turn },
            gap_m: if case % 5 < 3 { 0.0 } else { noise.between(-CRACK_M, CRACK_M) },
            pin_low_m: if case % 7 < 3 { -0.06 } else { 0.0 },
            is_single: case.is_multiple_of(2),
        }
    }

    fn soup(&self) -> TriangleSoup {
        let corners = self.corners;
        let mut soup = TriangleSoup { vertices: Vec::new(), faces: Vec::new() };
        let mut circle = |radius_m: f64, z_m: f64| {
            let first = soup.vertices.len() as u32;
            soup.vertices.extend((0..corners).map(|corner| {
                let angle = TAU * f64::from(corner) / f64::from(corners);
                let vertex = self.turn * Vector3::new(radius_m * angle.cos(), radius_m * angle.sin(), z_m);
                if self.is_single { vertex.map(|x| f64::from(x as f32)) } else { vertex }
            }));
            first
        };
        let [pin_low, pin_high] = [self.pin_low_m, TOP_M - RECESS_M].map(|z_m| circle(RADIUS_M, z_m));
        let [bore_low, bore_high] = [0.005, TOP_M].map(|z_m| circle(RADIUS_M + self.gap_m, z_m));
        let [ring_low, ring_high] = [0.005, TOP_M].map(|z_m| circle(2.0 * RADIUS_M, z_m));
        let mut band = |from: u32, to: u32| {
            for a in 0..corners {
                let b = (a + 1) % corners;
                soup.faces.extend([[from + a, from + b, to + b], [from + a, to + b, to + a]]);
            }
        };
        band(pin_low, pin_high);
        band(bore_high, bore_low);
        band(bore_low, ring_low);
        band(ring_low, ring_high);
        band(ring_high, bore_high);
        for a in 1..corners - 1 {
            soup.faces.extend([
                [pin_low, pin_low + a + 1, pin_low + a],
                [pin_high, pin_high + a, pin_high + a + 1],
            ]);
        }
        soup
    }
}

#[test]
fn no_point_that_slides_from_a_pin_to_the_wall_of_its_bore_gets_between_the_two() {
    let (mut noise, mut fallen, mut held) = (Noise(17), Vec::new(), Vec::new());
    for case in 0..800 {
        let assembly = Assembly::any(case, &mut noise);
        let turn = assembly.turn;
        let friction = if case % 8 < 6 { Friction::None } else { Friction::coulomb(0.4).unwrap() };
        let pin = touchable(&built(assembly.soup()), friction);
        let mut finger = point_finger();
        let (angle, deep_m) = (noise.between(0.0, TAU), noise.between(1e-3, 6e-3));
        let out = Vector3::new(angle.cos(), angle.sin(), 0.0);
        let low_m = TOP_M - RECESS_M - deep_m;
        // Down on the pin, beyond the bore's wall, along it, up, and away.
        let beyond = out * (RADIUS_M * noise.between(1.05, 1.6));
        let along = Vector3::new(-out.y, out.x, 0.0) * (RADIUS_M * noise.between(-0.5, 0.5));
        let ends = [
            Vector3::z() * (TOP_M + 0.01),
            Vector3::z() * low_m,
            beyond + Vector3::z() * low_m,
            beyond + along + Vector3::z() * low_m,
            beyond + along + Vector3::z() * (TOP_M + 0.03),
            Vector3::z() * 0.1,
        ];
        let (mut touched, mut least_m) = (0, f64::INFINITY);
        for (leg, ends) in ends.windows(2).enumerate() {
            for tick in 0..100 {
                let hip = turn * (ends[0] + (ends[1] - ends[0]) * (f64::from(tick) / 100.0));
                let felt = step(&mut finger, &pin, &hip);
                if leg < 3 && felt.entity.is_some() {
                    let height_m = (turn.inverse() * felt.god_object_W).z - (TOP_M - RECESS_M);
                    least_m = least_m.min(height_m);
                    touched += 1;
                }
            }
        }
        assert!(touched > 200, "{case}: {touched}");
        // Vertices of single precision are off by 1e-9.
        if least_m < -1e-8 {
            fallen.push(case);
        }
        if step(&mut finger, &pin, &(turn * Vector3::new(0.0, 0.0, 0.1))).entity.is_some() {
            held.push(case);
        }
    }
    assert!(fallen.is_empty() && held.is_empty(), "{fallen:?} {held:?}");
}

#[test]
fn walls_that_fit_are_moved_by_little_and_once() {
    let mut noise = Noise(18);
    for case in 0..100 {
        let assembly = Assembly::any(case, &mut noise);
        let (mesh, report) = Mesh::build(assembly.soup()).unwrap();
        let gaps = report.narrow_gaps;
        // What overlaps by more than rounding already is let be.
        assert!(gaps.faces > 0 && (gaps.moved > 0 || assembly.gap_m < 0.0), "{case}: {report}");
        let mut moved = 0;
        for vertex in mesh.vertices() {
            let nearest = assembly
                .soup()
                .vertices
                .into_iter()
                .min_by(|a, b| (a - vertex).norm().total_cmp(&(b - vertex).norm()))
                .unwrap();
            let by_m = (nearest - vertex).norm();
            // Off two faces, which are at right angles to each other at most, and nothing along the pin.
            assert!(by_m <= 1.001 * gaps.moved_by_m * 2_f64.sqrt(), "{case}: {by_m:e}");
            let along_m = (assembly.turn.inverse() * (nearest - vertex)).z;
            assert!(along_m.abs() < 1e-11, "{case}: {along_m:e}");
            moved += usize::from(by_m > 1e-9);
        }
        assert_eq!(moved, gaps.moved, "{case}");
        let again = TriangleSoup {
            vertices: mesh.vertices().to_vec(),
            faces: mesh.faces().iter().map(|face| face.vertices).collect(),
        };
        let (_, report) = Mesh::build(again).unwrap();
        assert_eq!(report.narrow_gaps.moved, 0, "{case}: {report}");
    }
}
