//! What meshes answer, against slow and obvious oracles; and that nothing slips through them.
#![allow(non_snake_case)]

mod common;
mod mesh_oracle;

use common::Noise;
use haptics::mesh::{Mesh, Sides, TriangleSoup, make};
use mesh_oracle as oracle;
use nalgebra::Vector3;

fn mesh(soup: TriangleSoup) -> Mesh {
    Mesh::build(soup).expect("a mesh").0
}

fn tiny_triangle() -> TriangleSoup {
    let vertices =
        vec![Vector3::new(0.01, 0.0, 0.0), Vector3::new(0.0, 0.02, 0.0), Vector3::new(0.0, 0.0, 0.03)];
    TriangleSoup { vertices, faces: vec![[0, 1, 2]] }
}

/// A disc of slivers: a thousand triangles, each two thousand times longer than wide at its end.
fn slivers() -> TriangleSoup {
    let n = 1000_u32;
    let rim = |i: u32| {
        let angle = 0.003 * f64::from(i) / 6.0;
        Vector3::new(0.1 * angle.cos(), 1e-4 * (0.3 * f64::from(i)).sin(), 0.1 * angle.sin())
    };
    let vertices = std::iter::once(Vector3::zeros()).chain((0..=n).map(rim)).collect();
    TriangleSoup { vertices, faces: (1..=n).map(|i| [0, i + 1, i]).collect() }
}

/// Small meshes of every kind, for oracles that look at every face.
fn small_meshes() -> Vec<(&'static str, Mesh)> {
    vec![
        ("cube", mesh(make::cuboid([0.05, 0.05, 0.05]))),
        ("plate", mesh(make::cuboid([0.1, 0.0005, 0.1]))),
        ("wedge", mesh(make::wedge(0.05, 0.05, 0.1))),
        ("star", mesh(make::star(5, 0.1, 0.03, 0.02))),
        ("sphere", mesh(make::uv_sphere(32, 16, 0.1))),
        ("metre-sized bumpy sphere", mesh(make::bumpy_sphere(48, 24, 1.0))),
        ("bumpy sphere of a centimetre", mesh(make::bumpy_sphere(48, 24, 0.01))),
        ("torus", mesh(make::torus(40, 20, 0.1, 0.03))),
        ("Klein bottle", mesh(make::klein_bottle(40, 20, 0.1))),
        ("triangle", mesh(tiny_triangle())),
        ("slivers", mesh(slivers())),
    ]
}

/// A point of the mesh at which things may go wrong: in a face, on an edge, on a vertex.
fn target(mesh: &Mesh, noise: &mut Noise) -> Vector3<f64> {
    let face = (noise.uniform() * mesh.faces().len() as f64) as usize;
    let [a, b, c] = oracle::corners(mesh, face);
    let (u, v) = (noise.uniform(), noise.uniform());
    match (noise.uniform() * 4.0) as u32 {
        0 => a,
        1 => a + (b - a) * u,
        2 => a + (b - a) * 0.5,
        _ => {
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            a + (b - a) * u + (c - a) * v
        }
    }
}

/// Far away and close by, in powers of ten.
fn reach(mesh: &Mesh, noise: &mut Noise) -> f64 {
    mesh.extent_m() * 10f64.powf(noise.between(-6.0, 0.7))
}

#[test]
fn the_nearest_point_is_the_one_that_looking_at_every_face_finds() {
    for (name, mesh) in small_meshes() {
        let mut noise = Noise(1);
        for _ in 0..2000 {
            let p = target(&mesh, &mut noise) + noise.vector(1.0) * reach(&mesh, &mut noise);
            let (found, expected) = (mesh.nearest(&p), oracle::distance(&mesh, &p));
            // Points are some 10 roundings of coordinates this large off; the oracle's regions lose another digit
            // on slivers.
            let tolerance = 1e-13 * (mesh.extent_m() + p.amax());
            assert!((found.distance_m - expected).abs() <= tolerance, "{name}: {p:?} {found:?} {expected}");
            assert!(((p - found.point_B).norm() - found.distance_m).abs() <= tolerance, "{name}: {found:?}");
        }
    }
}

#[test]
fn the_first_hit_is_the_one_that_looking_at_every_face_finds() {
    for (name, mesh) in small_meshes() {
        let mut noise = Noise(2);
        let mut hits = 0;
        for i in 0..4000 {
            let at = target(&mesh, &mut noise);
            let path = noise.vector(1.0) * reach(&mesh, &mut noise);
            // Every other segment may end before it is there.
            let from = at - path * noise.uniform();
            let to = if i % 2 == 0 { from + path } else { at + path * noise.between(-0.5, 0.5) };
            // A face has its say a little inside its rim for certain, a little outside it perhaps.
            let surely = oracle::first_fraction(&mesh, &from, &to, 1e-6);
            let perhaps = oracle::first_fraction(&mesh, &from, &to, -1e-6);
            let found = mesh.first_hit(&from, &to);
            hits += u32::from(found.is_some());
            // Starts and ends on the surface are decided by rounding.
            let length = (to - from).norm();
            let slack = 1e-12 * mesh.extent_m() / length;
            match (found, surely) {
                (None, Some(fraction)) => {
                    assert!(1.0 - fraction < slack || fraction < slack, "{name}: {from:?} {to:?} {surely:?}");
                }
                (Some(hit), _) => {
                    let latest = surely.unwrap_or(f64::INFINITY);
                    assert!(hit.fraction <= latest + slack + 1e-9, "{name}: {hit:?} {surely:?}");
                    let earliest = perhaps.unwrap_or(if hit.fraction == 0.0 || hit.fraction > 1.0 - slack {
                        hit.fraction
                    } else {
                        f64::INFINITY
                    });
                    assert!(
                        hit.fraction == 0.0 || hit.fraction >= earliest - slack - 1e-9,
                        "{name}: {hit:?} {perhaps:?}"
                    );
                }
                (None, None) => (),
            }
        }
        assert!(hits > 500, "{name}: {hits}");
    }
}

#[test]
fn inside_is_where_the_mesh_goes_around_once() {
    for (name, mesh) in small_meshes() {
        if mesh.sides() == Sides::Sheet {
            assert!(!mesh.is_inside(&Vector3::zeros()));
            continue;
        }
        let mut noise = Noise(3);
        for _ in 0..2000 {
            let p = target(&mesh, &mut noise) + noise.vector(1.0) * reach(&mesh, &mut noise);
            let times = oracle::winding_number(&mesh, &p);
            assert_eq!(mesh.is_inside(&p), times > 0.5, "{name}: {p:?} {times}");
        }
    }
}

#[test]
fn the_clearance_is_never_more_than_the_distance() {
    for (name, mesh) in small_meshes() {
        let mut noise = Noise(4);
        for _ in 0..2000 {
            let p = target(&mesh, &mut noise) + noise.vector(1.0) * reach(&mesh, &mut noise);
            let distance = oracle::distance(&mesh, &p);
            let at_most = distance * noise.between(0.0, 3.0);
            let clearance = mesh.clearance(&p, at_most);
            assert!(clearance <= distance + 1e-15 * mesh.extent_m(), "{name}: {p:?} {clearance} {distance}");
            assert!((0.0..=at_most).contains(&clearance));
        }
    }
}

#[test]
fn nothing_slips_into_a_closed_mesh() {
    let meshes = [
        ("cube", mesh(make::cuboid([0.05, 0.05, 0.05]))),
        ("sphere", mesh(make::uv_sphere(100, 50, 0.1))),
        ("bumpy sphere", mesh(make::bumpy_sphere(316, 158, 0.1))),
    ];
    for (name, mesh) in meshes {
        let mut noise = Noise(5);
        for _ in 0..333_334 {
            let at = target(&mesh, &mut noise);
            // These shapes are stars around their middle: towards it is inside, away from it outside.
            let (from, to) = (at * noise.between(1.01, 4.0), at * noise.between(-0.5, 0.99));
            assert!(mesh.first_hit(&from, &to).is_some(), "{name}: {from:?} {to:?}");
        }
    }
}
