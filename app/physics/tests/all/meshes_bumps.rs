//! Meshes with many bumps, finely cut, come to rest on what they touch: whichever bump comes down, wherever, it is found.
#![allow(non_snake_case)]

use crate::noise::Noise;
use crate::{common, meshes};

use common::*;
use haptics::mesh::{TriangleSoup, make};
use haptics::{Cuboid, Cylinder, Entity};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use physics::{ContactStiffness, Settings, Sleep};

const MASS: f64 = 0.2;

/// A lump with limbs of up to this length that end in broad feet, each of which may touch with hundreds of vertices.
fn limbed(noise: &mut Noise, limbs: usize, most_m: f64) -> TriangleSoup {
    let mut soup = make::uv_sphere(160, 120, 0.015);
    let limbs: Vec<(Vector3<f64>, f64)> =
        (0..limbs).map(|_| (noise.direction(), noise.within(0.3, 1.0) * most_m)).collect();
    for vertex in &mut soup.vertices {
        let way = vertex.normalize();
        let height = |(at, height): &(Vector3<f64>, f64)| {
            let away = (way - at).norm_squared();
            height * (2.0 * (-away / 0.05).exp()).min(1.0 - 0.5 * away)
        };
        *vertex += way * limbs.iter().map(height).fold(0.0, f64::max);
    }
    soup
}

/// Things to stand on, with their upper side at y = 0.
fn grounds() -> Vec<(&'static str, Entity)> {
    let slab = |size: [f64; 3]| {
        let at = Isometry3::translation(0.0, -0.5 * size[1], 0.0);
        object(Cuboid::new(size).unwrap(), at, 1000.0, 0.4)
    };
    let disc = Cylinder::new(2.0, 0.02).unwrap();
    let plate = meshes::build(make::cuboid([0.4, 0.02, 0.4]));
    let below = Isometry3::translation(0.0, -0.01, 0.0);
    vec![
        ("plane", floor(0.0, 1000.0, 0.4)),
        ("table", slab([1.2, 0.75, 0.8])),
        ("wide box", slab([4.0, 0.02, 4.0])),
        ("wide cylinder", object(disc, below, 1000.0, 0.4)),
        ("plate of triangles", object(plate, below, 1000.0, 0.4)),
    ]
}

/// Depth of the lowest vertex once it sleeps, of something that falls by 5 mm, turned at random (m).
fn rests_deep_m(soup: &TriangleSoup, ground: Entity, turn: UnitQuaternion<f64>) -> f64 {
    let lowest_m = |X_WB: &Isometry3<f64>| {
        let heights = soup.vertices.iter().map(|vertex| (X_WB * Point3::from(*vertex)).y);
        heights.fold(f64::INFINITY, f64::min)
    };
    let up_m = 5e-3 - lowest_m(&Isometry3::from_parts(Vector3::zeros().into(), turn));
    let X_WB = Isometry3::from_parts((Vector3::y() * up_m).into(), turn);
    let thing =
        object(meshes::build(soup.clone()), X_WB, 1000.0, 0.4).with_turning_friction(2e-4, 2e-4).unwrap();
    let bodies = [(1, body(&thing, MASS))];
    let contact_stiffness = ContactStiffness::ByMass { damping_ratio: 1.0 };
    let settings = Settings { contact_stiffness, sleep: Some(Sleep::default()), ..Settings::default() };
    let mut world = World::new(vec![ground, thing], &bodies, settings, 0);
    for _ in 0..6000 {
        if world.manipulation.awake().is_empty() {
            break;
        }
        world.step(&[]);
    }
    -lowest_m(&world.entities[1].X_WB)
}

#[test]
fn what_has_bumps_rests_as_deep_as_its_weight_presses_it() {
    for (name, ground) in grounds() {
        for seed in 8..16 {
            let noise = &mut Noise::new(seed);
            let deep_m = rests_deep_m(&limbed(noise, 10, 0.03), ground.clone(), noise.turn());
            // 10 um are a weight on one point. A bump that comes down beside others is found when it is as deep again, and a hundredth of the
            // thickness may be seen.
            assert!(deep_m < 1e-4, "{name}, {seed}: {deep_m} m");
        }
    }
}
