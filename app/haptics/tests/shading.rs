//! Force shading: the shaded normals themselves. That they are continuous over the surface is what all of it is for.
#![allow(non_snake_case)]

mod common;

use common::meshes::{built, bumpy_sphere, cube, star, uv_sphere};
use common::*;
use haptics::mesh::{Mesh, make};
use haptics::{Feature, Shading, ShadingForm, Shape, SurfacePoint};
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;
use std::sync::Arc;

/// No edge is a crease.
const NONE: f64 = PI;

fn of_face(mesh: &Mesh, face: usize, point_B: Vector3<f64>) -> SurfacePoint {
    let normal_B = mesh.faces()[face].normal_B;
    SurfacePoint { point_B, normal_B, feature: Feature::Face, piece: face as u32 }
}

/// The shaded normal at a point of a face.
fn shaded(shading: &Shading, mesh: &Arc<Mesh>, face: usize, point_B: Vector3<f64>) -> Vector3<f64> {
    let shape = Shape::from(Arc::clone(mesh));
    shading.normal_at(&shape, &of_face(mesh, face, point_B))
}

fn corners(mesh: &Mesh, face: usize) -> Matrix3<f64> {
    let corners = mesh.faces()[face].vertices.map(|vertex| mesh.vertices()[vertex as usize]);
    Matrix3::from_columns(&corners)
}

/// Meshes with edges and vertices of all kinds: convex, concave, saddles, slivers at poles, turned, with a rim.
fn meshes() -> Vec<(&'static str, Arc<Mesh>)> {
    vec![
        ("cube", cube()),
        ("star", star()),
        ("coarse ball", uv_sphere(8)),
        ("bumpy ball", bumpy_sphere(24)),
        ("wedge", built(make::wedge(0.6, 0.1, 0.1))),
        ("pit", built(pit())),
        ("klein bottle", built(make::klein_bottle(20, 10, 0.1))),
        ("mobius strip", built(make::mobius_strip(24, 2, 0.1, 0.03))),
    ]
}

/// A block with an upside-down pyramid in its top.
fn pit() -> haptics::mesh::TriangleSoup {
    let mut soup = make::cuboid([0.08; 3]);
    let top: Vec<usize> = (0..soup.faces.len())
        .filter(|&face| soup.faces[face].iter().all(|&v| soup.vertices[v as usize].y > 0.0))
        .collect();
    let tip = soup.vertices.len() as u32;
    soup.vertices.push(Vector3::zeros());
    let rim: Vec<[u32; 2]> = top
        .iter()
        .flat_map(|&face| [0, 1, 2].map(|i| [soup.faces[face][i], soup.faces[face][(i + 1) % 3]]))
        .collect();
    let outer = rim.iter().filter(|[a, b]| !rim.contains(&[*b, *a]));
    let sides: Vec<[u32; 3]> = outer.map(|[a, b]| [*a, *b, tip]).collect();
    soup.faces.retain(|face| !face.iter().all(|&v| soup.vertices[v as usize].y > 0.0));
    soup.faces.extend(sides);
    soup
}

fn shadings(mesh: &Mesh, crease: f64) -> Vec<(String, Shading)> {
    let form = ShadingForm::Rotate;
    let mut all = vec![("interpolated".into(), Shading::interpolated(mesh, crease, form).unwrap())];
    for length_m in [0.5e-3, 5e-3, 1.0] {
        let shading = Shading::regions(mesh, length_m, crease, form).unwrap();
        all.push((format!("regions of {length_m} m"), shading));
    }
    all
}

/// Every edge that two faces share, with the angle between their normals: face, edge, face over it, cosine.
fn edges(mesh: &Mesh) -> impl Iterator<Item = (usize, usize, usize, f64)> + '_ {
    mesh.faces().iter().enumerate().flat_map(move |(index, face)| {
        (0..3).filter(move |&edge| !face.links[edge].is_boundary()).map(move |edge| {
            let link = face.links[edge];
            let over = &mesh.faces()[link.face() as usize];
            let sign = if link.is_turned() { -1.0 } else { 1.0 };
            (index, edge, link.face() as usize, sign * face.normal_B.dot(&over.normal_B))
        })
    })
}

//= melder#4.25 type=test
//= melder#4.28 type=test
//= melder#4.29 type=test
#[test]
fn on_an_edge_both_faces_have_the_same_shaded_normal() {
    // Right to the ends, where regions overlap and vertices take over.
    let shares = [0.0, 1e-12, 1e-9, 1e-6, 1e-3, 0.03, 0.1, 0.25, 0.5, 0.77, 0.999, 1.0 - 1e-9, 1.0];
    for crease in [NONE, 0.8] {
        for (name, mesh) in meshes() {
            for (how, shading) in shadings(&mesh, crease) {
                let mut compared = 0;
                for (face, edge, over, cos) in edges(&mesh) {
                    // Creases are allowed to leap; a tenth of a degree off the limit, rounding does not decide.
                    if cos < crease.min(haptics::mesh::SHARPEST_CREASE_RAD).cos() + 1e-3 {
                        continue;
                    }
                    let at = corners(&mesh, face);
                    let (start, end) = (at.column(edge).into_owned(), at.column((edge + 1) % 3).into_owned());
                    let turned = if mesh.faces()[face].links[edge].is_turned() { -1.0 } else { 1.0 };
                    for share in shares {
                        let point = start + (end - start) * share;
                        let [here, there] = [face, over].map(|face| shaded(&shading, &mesh, face, point));
                        // Positions are rounded to 1e-17 m; against distances of 1e-13 m from a vertex that is a
                        // ratio off by 1e-4, of what is mixed in by 1e-12 / 1e-3 there.
                        let leap = (here - there * turned).norm();
                        assert!(leap <= 1e-11, "{name}, {how}: {leap} at {share} of edge {edge} of {face}");
                        compared += 1;
                    }
                }
                assert!(compared >= 26, "{name}, {how}: {compared}");
            }
        }
    }
}

/// The largest change of the shaded normal per way, in steps of this length, over straight ways through faces.
fn steepest_per_m(shading: &Shading, mesh: &Arc<Mesh>, seed: u64, step_m: f64) -> f64 {
    let mut noise = Noise(seed);
    let mut steepest = 0.0_f64;
    for _ in 0..4000 {
        let face = (noise.uniform() * mesh.faces().len() as f64) as usize;
        let at = corners(mesh, face);
        // From near a corner as often as from anywhere.
        let near = noise.uniform().powi(6);
        let split = noise.uniform();
        let weights = Vector3::new(1.0 - near, near * split, near * (1.0 - split));
        let from = at * weights;
        let towards = at * Vector3::from_fn(|_, _| noise.uniform()).normalize();
        let along = towards - from;
        let flat = along - mesh.faces()[face].normal_B * mesh.faces()[face].normal_B.dot(&along);
        let to = from + flat.normalize() * step_m;
        if (at.try_inverse().unwrap_or_else(Matrix3::zeros) * to).min() < 0.0 {
            continue;
        }
        let [a, b] = [from, to].map(|point| shaded(shading, mesh, face, point));
        steepest = steepest.max((a - b).norm() / step_m);
    }
    steepest
}

#[test]
fn a_shaded_normal_changes_no_faster_than_its_regions_are_short() {
    // Continuous means: a hundredth of the step, a hundredth of the change. A leap would make it a hundred times steeper.
    for (name, mesh) in meshes() {
        for (how, shading) in shadings(&mesh, NONE) {
            let [coarse, fine] = [1e-6, 1e-8].map(|step_m| steepest_per_m(&shading, &mesh, 3, step_m));
            assert!(fine <= 1.5 * coarse + 1e-6, "{name}, {how}: {fine} per m, and {coarse} in larger steps");
        }
    }
}
