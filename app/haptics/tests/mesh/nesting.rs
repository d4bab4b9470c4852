//! Closed parts wound inward: cavities where they lie in other parts, turned outward where they do not.

use crate::common::flawed::{inverted, moved, noisy, together, turned};
use crate::common::meshes::*;
use crate::common::*;
use crate::mesh_oracle::winding_number;
use haptics::Friction;
use haptics::mesh::{Mesh, TriangleSoup, make};
use nalgebra::Vector3;
use std::f64::consts::FRAC_PI_4;
use std::sync::Arc;

/// Across its box from corner to corner.
fn rod() -> TriangleSoup {
    turned(make::cuboid([0.2, 0.02, 0.02]), [0.0, 0.0, FRAC_PI_4])
}

fn inverted_if(is_inward: bool, soup: TriangleSoup) -> TriangleSoup {
    if is_inward { inverted(soup) } else { soup }
}

#[test]
fn what_lies_in_the_box_of_another_part_and_not_in_the_part_is_no_cavity() {
    let at = [0.05, -0.05, 0.0];
    for [rod_is_inward, cube_is_inward] in [[false, true], [true, false], [true, true]] {
        let cube = moved(make::cuboid([0.02, 0.02, 0.01]), at);
        let both = together([inverted_if(rod_is_inward, rod()), inverted_if(cube_is_inward, cube)]);
        let (mesh, report) = Mesh::build(both).unwrap();
        let inward = usize::from(rod_is_inward) + usize::from(cube_is_inward);
        assert_eq!((report.inside_out.count, report.cavities.count), (inward, 0));
        assert_eq!(report.inside_out.first, Some(if rod_is_inward { 0 } else { 12 }));
        // From above onto the cube, and away.
        let entity = touchable(&Arc::new(mesh), Friction::None);
        let mut finger = point_finger();
        for (z, depth) in [(0.02, 0.0), (4e-3, 1e-3), (3e-3, 2e-3), (6e-3, 0.0), (0.045, 0.0)] {
            let out = step(&mut finger, &entity, &Vector3::new(at[0], at[1], z));
            let force = Vector3::z() * (K * depth);
            assert!((out.force_on_user_W - force).norm() < 1e-12, "rounding: {z}: {out:?}");
        }
    }
}

#[test]
fn a_cavity_of_one_part_stays_one_in_the_box_of_a_larger_part() {
    let hollow = together([make::cuboid([0.04; 3]), inverted(make::cuboid([0.02; 3]))]);
    let (mesh, report) = Mesh::build(together([inverted(rod()), moved(hollow, [0.05, -0.05, 0.0])])).unwrap();
    assert_eq!((report.inside_out.count, report.cavities.count), (1, 1));
    assert_eq!((report.inside_out.first, report.cavities.first), (Some(0), Some(24)));
    let times = |z: f64| winding_number(&mesh, &Vector3::new(0.05, -0.05, z));
    // A solid angle is rounded to some 1e-15 of a turn for each of 36 faces.
    assert!(times(0.0).abs() < 1e-12 && (times(0.015) - 1.0).abs() < 1e-12);
}

/// Stones in a grid, too far apart to touch, each wound at random; the rod passes through some of them.
#[test]
fn of_stones_about_a_rod_those_in_it_are_cavities_and_all_others_face_outward() {
    let (alone, _) = Mesh::build(rod()).unwrap();
    let mut told = 0;
    for seed in 0..40 {
        let mut noise = Noise(seed);
        let rod_is_inward = noise.uniform() < 0.5;
        let (mut parts, mut cavities) = (vec![inverted_if(rod_is_inward, rod())], 0);
        for (x, y) in (-5..=5).flat_map(|x| (-5..=5).map(move |y| (x, y))) {
            let is_inward = noise.uniform() < 0.5;
            let stone = turned(make::star(5, 4e-3, 2e-3, 2e-3), noise.vector(3.0).into());
            let at = Vector3::new(0.014 * f64::from(x), 0.014 * f64::from(y), 0.0) + noise.vector(2e-3);
            let stone = moved(inverted_if(is_inward, stone), at.into());
            // Two convex pieces of a surface: what has all of its vertices within the rod lies in it.
            let is_within = stone.vertices.iter().all(|v| winding_number(&alone, v) > 0.5);
            cavities += usize::from(is_within && is_inward != rod_is_inward);
            parts.push(stone);
        }
        let (_, report) = Mesh::build(together(parts)).unwrap();
        assert_eq!(report.cavities.count, cavities, "{seed}: {report}");
        told += cavities;
    }
    assert!(told > 50, "{told}");
}

/// As models come that were given a skin of two layers.
#[test]
fn a_trembling_box_within_a_box_is_nowhere_inside_out() {
    let (mut cavities, mut turned) = (0, 0);
    for seed in 0..500 {
        let mut noise = Noise(seed);
        let inner = make::cuboid([0.1 * (0.94 + 0.06 * noise.uniform()); 3]);
        let inner = noisy(inner, 2e-3 * noise.uniform(), seed);
        let outer_is_inward = noise.uniform() < 0.5;
        let both = [make::cuboid([0.1; 3]), inverted(inner)].map(|soup| inverted_if(outer_is_inward, soup));
        let (mesh, report) = Mesh::build(together(both)).unwrap();
        (cavities, turned) = (cavities + report.cavities.count, turned + report.inside_out.count);
        for _ in 0..100 {
            let p = Vector3::from_fn(|_, _| 0.13 * (noise.uniform() - 0.5));
            let times = winding_number(&mesh, &p);
            assert!(times > -1e-9, "{seed}: {times} at {p:?}: {report}");
        }
    }
    assert!(cavities > 50 && turned > 50, "both are met: {cavities} {turned}");
}
