//! Vertices that lie farthest out, against a search through all of them.

use crate::common::Noise;
use crate::common::meshes::unit_vector;
use haptics::mesh::{Linear, Mesh, make};
use nalgebra::Vector3;

/// So small that a tick can look at all of each.
fn meshes() -> Vec<Mesh> {
    let soups = [
        make::cuboid([0.1, 0.2, 0.3]),
        make::bumpy_sphere(12, 7, 0.1),
        make::star(7, 0.1, 0.04, 0.05),
        make::torus(10, 6, 0.1, 0.03),
    ];
    soups.into_iter().map(|soup| Mesh::build(soup).unwrap().0).collect()
}

fn point(mesh: &Mesh, corner: u32) -> Vector3<f64> {
    mesh.vertices()[mesh.faces()[(corner / 3) as usize].vertices[(corner % 3) as usize] as usize]
}

#[test]
fn the_largest_product_of_two_counts_is_found_within_limits_and_above_what_is_known() {
    let mut noise = Noise(5);
    let (mut found, mut none) = (0, 0);
    for mesh in meshes() {
        for _ in 0..2000 {
            let mut linear = |reach: f64| Linear::new(noise.vector(1.0), noise.vector(reach).x);
            let (first, second) = (linear(0.1), linear(0.1).at_most(0.05));
            let limits = [linear(0.2), linear(0.2)];
            let score = |p: &Vector3<f64>| {
                let (f, g) = (first.at(p), second.at(p));
                let counts = f > 0.0 && g > 0.0 && limits.iter().all(|limit| limit.at(p) >= 0.0);
                if counts { f * g } else { 0.0 }
            };
            let most = mesh.vertices().iter().map(score).fold(0.0, f64::max);
            match mesh.outlying([&first, &second], &limits, 0.0, 1000) {
                Some((corner, product)) => {
                    assert_eq!(product, most);
                    assert_eq!(score(&point(&mesh, corner)), product);
                    found += 1;
                }
                None => {
                    assert_eq!(most, 0.0);
                    none += 1;
                }
            }
            assert_eq!(mesh.outlying([&first, &second], &limits, most, 1000), None);
        }
    }
    assert!(found > 1000 && none > 1000, "{found} {none}");
}

#[test]
fn vertices_within_limits_are_visited_all_and_no_others() {
    let mut noise = Noise(6);
    for mesh in meshes() {
        for _ in 0..500 {
            let mut linear = || Linear::new(noise.vector(1.0), noise.vector(0.1).x);
            let limits = [linear(), linear(), linear()];
            let mut visited = vec![false; mesh.vertices().len()];
            let visit = |corner| {
                visited[mesh.faces()[(corner / 3) as usize].vertices[(corner % 3) as usize] as usize] = true;
                true
            };
            let all = mesh.for_each_vertex_within(&limits, visit, 256);
            for (vertex, visited) in mesh.vertices().iter().zip(visited) {
                let counts = limits.iter().all(|limit| limit.at(vertex) >= 0.0);
                // Only where there was too much to look at may any be missing.
                assert!(counts == visited || counts && !all);
            }
        }
    }
}

#[test]
fn too_much_to_look_at_is_said() {
    let (mesh, _) = Mesh::build(make::uv_sphere(100, 51, 0.1)).unwrap();
    assert!(!mesh.for_each_vertex_within(&[Linear::ONE], |_| true, 256));
    assert!(mesh.for_each_vertex_within(&[Linear::new(Vector3::y(), -0.0999)], |_| true, 256));
    assert!(!mesh.for_each_vertex_within(&[Linear::new(Vector3::y(), -0.0999)], |_| false, 256));
}

#[test]
fn what_lies_farthest_out_is_told_to_a_hair_in_any_direction_once_it_was_sought() {
    let mut noise = Noise(5);
    let soups = [make::bumpy_sphere(200, 100, 0.05), make::star(7, 0.05, 0.02, 0.01), make::cuboid([0.1; 3])];
    for (soup, off_m) in soups.into_iter().zip([1e-4, 0.0, 0.0]) {
        let mesh = Mesh::build(soup).unwrap().0;
        assert_eq!(mesh.extreme(&Vector3::x()), None, "nobody has asked for it");
        mesh.find_extremes();
        for _ in 0..1000 {
            let along = unit_vector(&mut noise);
            let corner = mesh.extreme(&along).unwrap();
            let far = along.dot(&point(&mesh, corner));
            let farthest = mesh.vertices().iter().map(|vertex| along.dot(vertex)).fold(f64::MIN, f64::max);
            // Half a cell is 2.25 degrees: 50 mm by the square of that are 0.08 mm. Of few corners each has its cell.
            assert!(far >= farthest - off_m && far <= farthest, "{} m", farthest - far);
        }
        assert_eq!(mesh.extreme(&Vector3::repeat(f64::NAN)), None);
    }
}
