//! Plates thinner than what a walk's arithmetic can tell apart: held from the side that was touched, and free again in front
//! of it and beyond the rim.

use crate::common::meshes::*;
use crate::common::*;
use haptics::mesh::{Mesh, TriangleSoup};
use haptics::{Entity, Friction};
use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};
use std::sync::Arc;

/// A plate somewhere in space; its frame P has the plate's middle plane in y = 0.
struct Plate {
    mesh: Arc<Mesh>,
    X_BP: nalgebra::Isometry3<f64>,
    half_m: [f64; 2],
    thickness_m: f64,
}

/// Link between its two layers.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    /// A closed box, both layers cut along the same diagonal.
    Box,
    /// The same, cut along different ones: as thin as rounding it is a fold.
    Crossed,
    /// Two sheets that look the same way.
    Skins,
}

const KINDS: [Kind; 3] = [Kind::Box, Kind::Crossed, Kind::Skins];

impl Plate {
    fn new(kind: Kind, half_m: [f64; 2], thickness_m: f64, X_BP: nalgebra::Isometry3<f64>) -> Self {
        let corner = |i: usize, y: f64| {
            let [x, z] = [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]][i];
            (X_BP * Point3::new(x * half_m[0], y, z * half_m[1])).coords
        };
        let at = |y: f64| (0..4).map(move |i| corner(i, y));
        let vertices = at(0.5 * thickness_m).chain(at(-0.5 * thickness_m)).collect();
        let mut faces = vec![[0, 1, 2], [0, 2, 3]];
        faces.extend(match kind {
            Kind::Box => [[4, 6, 5], [4, 7, 6]],
            Kind::Crossed => [[5, 4, 7], [5, 7, 6]],
            Kind::Skins => [[4, 5, 6], [4, 6, 7]],
        });
        if kind != Kind::Skins {
            faces.extend((0..4).flat_map(|i| {
                let (j, below) = ((i + 1) % 4, 4 + i);
                [[i, below, 4 + j], [i, 4 + j, j]]
            }));
        }
        Self { mesh: built(TriangleSoup { vertices, faces }), X_BP, half_m, thickness_m }
    }

    fn in_plate(&self, p_B: &Vector3<f64>) -> Vector3<f64> {
        self.X_BP.inverse_transform_point(&Point3::from(*p_B)).coords
    }

    /// Distance of its foot from the rim, within (m).
    fn within_m(&self, p: &Vector3<f64>) -> f64 {
        (self.half_m[0] - p.x.abs()).min(self.half_m[1] - p.z.abs())
    }

    /// Farther in front than this, whatever rounding does, a finger is free: RELEASE of `facing.rs`, of the extent.
    fn bound_m(&self) -> f64 {
        4.0 * 1e-13 * self.mesh.extent_m() + self.thickness_m
    }
}

/// From which side a point is held by a plate without thickness: that from which it came through, until its foot leaves the rim.
#[derive(Debug, Clone, Copy)]
struct Held {
    side: f64,
}

fn any_place(noise: &mut Noise, offset_m: f64) -> nalgebra::Isometry3<f64> {
    let turn = UnitQuaternion::new(noise.vector(2.0));
    nalgebra::Isometry3::from_parts(Translation3::from(unit_vector(noise) * offset_m), turn)
}

fn any_plate(noise: &mut Noise, kind: Kind) -> Plate {
    let half_m = [0.0; 2].map(|_| noise.between(0.01, 0.1));
    let offset_m = if noise.uniform() < 0.3 { 0.0 } else { 10.0 * noise.uniform().powi(2) };
    let extent_m = offset_m.max(half_m[0]);
    let least_m = f64::EPSILON * extent_m;
    let thickness_m = least_m * (1e-6 / least_m).powf(noise.uniform().powi(2));
    Plate::new(kind, half_m, thickness_m, any_place(noise, offset_m))
}

/// Walls of a few roundings height have normals that are good to a tenth (`repair.rs`): below the rim, they hold or let go within
/// this share of the depth.
const TILT: f64 = 0.15;

/// Follows a roaming finger for so many ticks; says in how many it was held.
fn follow(plate: &Plate, entity: &Entity, seed: u64, ticks: u32, told: &str) -> Result<u32, String> {
    let mut finger = point_finger();
    // All over the plate, or about a corner of it.
    let (about, width_m) = [([0.0; 2], 0.06), (plate.half_m, 2e-3)][seed as usize % 2];
    let mut roaming = Roaming::new(seed, width_m, width_m / 60.0);
    let (mut held, mut touched): (Option<Held>, u32) = (None, 0);
    let mut last: Option<Vector3<f64>> = None;
    let is_smooth = matches!(entity.friction, Friction::None);
    for tick in 0..ticks {
        let mut p = roaming.next();
        (p.x, p.z) = (p.x + about[0], p.z + about[1]);
        p.y *= 0.1;
        let hip = (plate.X_BP * Point3::from(p)).coords;
        let p = plate.in_plate(&hip);
        let out = step(&mut finger, entity, &hip);
        held = match (held, last) {
            (Some(Held { side }), _) if side * p.y > 0.0 || plate.within_m(&p) < 0.0 => None,
            (Some(held), _) => Some(held),
            (None, Some(last)) if last.y * p.y < 0.0 => {
                let met = last + (p - last) * (last.y / (last.y - p.y));
                // Through within the rim and out of it in one step, it may be held at the rim or not.
                if plate.within_m(&p).min(plate.within_m(&last)) < 0.0 {
                    break;
                }
                (plate.within_m(&met) > 0.0).then(|| Held { side: last.y.signum() })
            }
            _ => None,
        };
        if p.y.abs() < plate.bound_m() {
            // Within the plate, or within rounding of it, it may be held from either side, or by the rim.
            break;
        }
        last = Some(p);
        if plate.within_m(&p).abs() < TILT * p.y.abs() + plate.thickness_m {
            let side = held.map_or(p.y.signum(), |held| held.side);
            held = out.entity.map(|_| Held { side });
            continue;
        }
        let told = || format!("{told}, tick {tick}: {p:?} {held:?}\n{out:?}");
        if out.entity.is_some() != held.is_some() {
            return Err(told());
        }
        let Some(Held { side }) = held else { continue };
        touched += 1;
        let force = plate.X_BP.inverse_transform_vector(&out.force_on_user_W);
        let expected = Vector3::y() * (side * K * (p.y.abs() + 0.5 * plate.thickness_m));
        let slack = K * plate.bound_m() + 1e-9;
        let is_right =
            if is_smooth { (force - expected).norm() } else { (force.y - expected.y).abs() } <= slack;
        if !is_right {
            return Err(told());
        }
    }
    Ok(touched)
}

#[test]
fn plates_of_any_thickness_hold_from_the_side_that_was_touched_and_let_go() {
    let (mut touched, mut wrong) = (0, Vec::new());
    // A hundred times as many were right, too.
    for seed in 0..600 {
        let mut noise = Noise(seed);
        let kind = KINDS[seed as usize % 3];
        let plate = any_plate(&mut noise, kind);
        let (thickness_m, extent_m) = (plate.thickness_m, plate.mesh.extent_m());
        let eps = thickness_m / (f64::EPSILON * extent_m);
        let told = format!("{kind:?} {seed}, {thickness_m:e} m thick, {eps:.0} eps, extent {extent_m:.2} m");
        for friction in [Friction::None, Friction::coulomb(0.5).unwrap()] {
            match follow(&plate, &touchable(&plate.mesh, friction), seed, 600, &told) {
                Ok(ticks) => touched += ticks,
                Err(told) => wrong.push(told),
            }
        }
    }
    assert!(wrong.is_empty(), "{} of 1200\n{}", wrong.len(), wrong[..wrong.len().min(8)].join("\n"));
    assert!(touched > 50_000, "{touched}");
}

#[test]
fn a_fin_that_only_stands_on_a_sheet_does_not_let_a_finger_through() {
    let mut lost = 0;
    for seed in 0..2000 {
        let mut noise = Noise(seed);
        let X_BP = any_place(&mut noise, 10.0 * noise_share(seed));
        let at = |x: f64, y: f64, z: f64| (X_BP * Point3::new(x, y, z)).coords;
        let lean = noise.between(-0.01, 0.01);
        // No vertex of the sheet is one of the fin's.
        let vertices = vec![
            at(-0.1, 0.0, -0.1),
            at(0.0, 0.0, 0.13),
            at(0.1, 0.0, -0.1),
            at(-0.01, 0.0, -0.05),
            at(0.01, 0.0, 0.04),
            at(lean, 0.05, 0.0),
        ];
        let mesh = built(TriangleSoup { vertices, faces: vec![[0, 1, 2], [3, 4, 5]] });
        let entity = touchable(&mesh, Friction::None);
        let mut finger = point_finger();
        // Against the fin, down along it, and through the sheet below.
        for (x, y) in [(-0.03, 0.01), (8e-3, 0.01), (8e-3, -2e-3)] {
            let out = step(&mut finger, &entity, &at(x, y, 1e-3));
            lost += u32::from(x > 0.0 && out.entity.is_none());
        }
    }
    assert_eq!(lost, 0);
}

/// From 0 to 1, many of them small.
fn noise_share(seed: u64) -> f64 {
    Noise(!seed).uniform().powi(2)
}
