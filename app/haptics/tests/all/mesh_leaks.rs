//! No finger gets into a mesh unnoticed: random approaches, also at what rounding likes least.
//!
//! The long version, a million approaches per mesh, takes about a minute:
//! `cargo test --release -p haptics --test all mesh_leaks:: -- --ignored`.
#![allow(non_snake_case)]

use crate::{common, mesh_oracle};

use common::meshes::*;
use common::path::{bumpy, rings};
use common::*;
use haptics::Friction;
use haptics::mesh::{Mesh, TriangleSoup, make};
use mesh_oracle::{corners, winding_number};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use std::sync::Arc;

/// Whether a point is surely inside: what is nearer to the surface than rounding is not judged.
type SurelyInside = fn(&Target, &Vector3<f64>) -> bool;

/// A mesh, and what is asked about it again and again.
struct Target {
    mesh: Arc<Mesh>,
    /// Distance of the nearest plane of a face from the origin \[m\].
    nearest_plane_m: f64,
    highest: Vector3<f64>,
}

impl Target {
    fn new(soup: TriangleSoup) -> Self {
        let mesh = built(soup);
        let nearest_plane_m = mesh.faces().iter().map(|face| face.offset_m).fold(f64::INFINITY, f64::min);
        let highest = *mesh.vertices().iter().max_by(|a, b| a.y.total_cmp(&b.y)).unwrap();
        Self { mesh, nearest_plane_m, highest }
    }
}

/// For meshes of few faces.
fn goes_round(target: &Target, p: &Vector3<f64>) -> bool {
    winding_number(&target.mesh, p) > 0.75
}

/// For convex balls around the origin: nearer to it than any face's plane.
fn below_all_planes(target: &Target, p: &Vector3<f64>) -> bool {
    p.norm() < target.nearest_plane_m * (1.0 - 1e-12)
}

/// For the bumpy ball: 2 % below its formula, more than faces of 316 meridians cut off.
fn below_the_bumps(target: &Target, p: &Vector3<f64>) -> bool {
    let (u, theta) = (p.z.atan2(p.x), (p.y / p.norm()).acos());
    // The largest coordinate is a little below 1.05 R.
    p.norm() < 0.98 * bumpy(u, theta) / 0.1 * target.mesh.extent_m() / 1.05
}

/// A place to go for: anywhere on a face, a corner, a point of an edge, the middle of an edge, a pole.
fn aim(target: &Target, noise: &mut Noise) -> Vector3<f64> {
    let mesh = &target.mesh;
    let any = |noise: &mut Noise, n: usize| (noise.uniform() * n as f64) as usize;
    let [a, b, c] = corners(mesh, any(noise, mesh.faces().len()));
    match any(noise, 6) {
        0 => a,
        1 => a + (b - a) * noise.uniform(),
        2 => (a + b) * 0.5,
        3 => target.highest,
        _ => {
            let (u, v) = (noise.uniform(), noise.uniform());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            a + (b - a) * u + (c - a) * v
        }
    }
}

/// How many ticks found the finger surely inside.
fn approach(at: &Target, is_surely_inside: SurelyInside, seed: u64, approaches: usize) -> usize {
    let (mesh, mut noise) = (&at.mesh, Noise(seed));
    let mut entity = touchable(mesh, Friction::None);
    let mut finger = point_finger();
    let mut inside = 0;
    for round in 0..approaches {
        // Half of them in the mesh's own frame, where nothing is rounded before it gets there.
        let axis = noise.vector(1.0);
        let X_WB = if round % 2 == 0 {
            Isometry3::identity()
        } else {
            Isometry3::from_parts(
                Translation3::from(noise.vector(1.0)),
                UnitQuaternion::from_scaled_axis(axis),
            )
        };
        entity.move_to(X_WB);
        entity.move_to(X_WB);
        finger.reset();
        let target = aim(at, &mut noise);
        // Further than the mesh is wide: outside.
        let from = target + unit_vector(&mut noise) * (4.0 * mesh.extent_m());
        // One tick outside, one anywhere on the way, often one right on the target, some beyond it.
        let beyond = 10_f64.powf(noise.between(-6.0, -1.0)) / 4.0;
        let before = noise.uniform();
        for share in [0.0, before, if round % 4 < 2 { 1.0 } else { 1.0 + 0.3 * beyond }, 1.0 + beyond] {
            let hip_B = from + (target - from) * share;
            let hip_W = X_WB.transform_point(&hip_B.into()).coords;
            let out = step(&mut finger, &entity, &hip_W);
            if share > 1.0 && is_surely_inside(at, &hip_B) {
                inside += 1;
                assert!(
                    out.entity.is_some(),
                    "seed {seed}, approach {round}: leaked at {hip_B:?} from {from:?} to {target:?}, {X_WB:?}"
                );
            }
        }
    }
    inside
}

fn scaled(mut soup: TriangleSoup, factor: f64) -> TriangleSoup {
    soup.vertices.iter_mut().for_each(|v| *v *= factor);
    soup
}

fn check_all(approaches: usize) {
    let balls = |n: usize| make::uv_sphere(n, rings(n), 0.1);
    let meshes: [(&str, TriangleSoup, SurelyInside); 7] = [
        ("cube", make::cuboid([0.1; 3]), goes_round),
        ("wedge", wedge(10.0), goes_round),
        ("groove", wedge(300.0), goes_round),
        ("star", make::star(5, 0.1, 0.04, 0.05), goes_round),
        ("small ball", balls(8), goes_round),
        ("ball", balls(316), below_all_planes),
        ("bumpy ball", make::bumpy_sphere(316, rings(316), 0.1), below_the_bumps),
    ];
    for (i, (name, soup, is_surely_inside)) in meshes.into_iter().enumerate() {
        // As large as a metre, and as a centimetre.
        for factor in [10.0, 0.1] {
            let target = Target::new(scaled(soup.clone(), factor));
            let inside = approach(&target, is_surely_inside, i as u64, approaches / 2);
            println!("{name}, {factor}: {inside} ticks inside");
            assert!(inside > approaches / 200, "{name}: only {inside} ticks were inside");
        }
    }
}

#[test]
fn from_the_bottom_of_a_groove_no_finger_gets_into_its_flanks() {
    // A god-object that lies on a face and on the groove's edge at once: let go by its face, it is the neighbour's.
    let mut noise = Noise(3);
    for degrees in (190..360).step_by(10) {
        let groove = built(wedge(f64::from(degrees)));
        let entity = touchable(&groove, Friction::None);
        let mut finger = point_finger();
        for round in 0..200 {
            finger.reset();
            let on_edge = Vector3::z() * noise.between(-0.04, 0.04);
            let angle = noise.between(-0.49, 0.49) * f64::from(degrees).to_radians();
            let depth = 10_f64.powf(noise.between(-5.0, -2.0));
            let inside = on_edge + Vector3::new(angle.sin(), -angle.cos(), 0.1) * depth;
            for hip in [on_edge + Vector3::y() * 0.2, on_edge, inside] {
                let out = step(&mut finger, &entity, &hip);
                let is_felt = out.entity.is_some();
                assert!(is_felt == (hip.y < 0.1) || hip == on_edge, "{degrees}, {round}: {hip:?}, {out:?}");
            }
        }
    }
}

#[test]
fn no_random_approach_gets_into_a_mesh_unnoticed() {
    check_all(20_000);
}

#[test]
#[ignore = "the long version"]
fn no_random_approach_of_a_million_gets_into_a_mesh_unnoticed() {
    check_all(1_000_000);
}
