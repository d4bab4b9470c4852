//! Steepness of heights all over a surface, against waves.

use crate::common::pictures::*;
use haptics::mesh::{Mesh, TriangleSoup};
use haptics::{Csg, CsgTree, Cuboid, Plane, Shape, Sphere};
use nalgebra::Vector3;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

const SIZE_M: f64 = 0.01;

/// Steepest slope of a wave so high, and the part of it that is steeper than 2.
fn of_wave(amplitude_m: f64) -> (f64, f64) {
    let steepest = amplitude_m * kept() * PI / SIZE_M;
    (steepest, if steepest > 2.0 { (2.0 / steepest).acos() / FRAC_PI_2 } else { 0.0 })
}

#[test]
fn a_wave_is_as_steep_as_its_height_and_length_say() {
    let plane: Shape = Plane::new(Vector3::new(1.0, 2.0, -0.5), 3.0).unwrap().into();
    let thin_box: Shape = Cuboid::new([0.4, 0.003, 0.4]).unwrap().into();
    for shape in [plane, thin_box] {
        for amplitude_m in [1e-3, -5e-3, 0.01, 0.04] {
            let survey = sized(&wave(), amplitude_m, SIZE_M).survey(&shape).expect("it can be gone over");
            let (steepest, too_steep) = of_wave(f64::abs(amplitude_m));
            // Eight thousand places: the steepest is missed by the square of a part in a hundred, shares by one in a hundred.
            assert!(
                (survey.steepest / steepest - 1.0).abs() < 1e-3,
                "{amplitude_m}: {survey:?}, not {steepest}"
            );
            assert!(
                (survey.too_steep - too_steep).abs() < 0.01,
                "{amplitude_m}: {survey:?}, not {too_steep}"
            );
        }
    }
}

/// A square of two triangles, a picture for every 10 mm.
#[test]
fn on_a_mesh_it_goes_by_area() {
    let places = [[0.0, 0.0], [0.1, 0.0], [0.1, -0.1], [0.0, -0.1]];
    let vertices = places.map(|[x, z]| Vector3::new(x, 0.0, z)).to_vec();
    let faces = vec![[0, 1, 2], [0, 2, 3]];
    let uv: Vec<_> =
        faces.iter().map(|face: &[u32; 3]| face.map(|at| places[at as usize].map(|x| x / SIZE_M))).collect();
    let shape = Shape::from(Arc::new(Mesh::build_with_uv(TriangleSoup { vertices, faces }, &uv).unwrap().0));
    let survey = repeated(&wave(), 0.01, [1.0; 2]).survey(&shape).expect("it can be gone over");
    let (steepest, too_steep) = of_wave(0.01);
    assert!((survey.steepest / steepest - 1.0).abs() < 1e-3, "{survey:?}, not {steepest}");
    assert!((survey.too_steep - too_steep).abs() < 0.01, "{survey:?}, not {too_steep}");
}

#[test]
fn what_is_even_or_has_no_coordinates_is_not_steep() {
    let ball: Shape = Sphere::new(0.03).unwrap().into();
    let survey = sized(&even(1.0), 1e-3, SIZE_M).survey(&ball).expect("it can be gone over");
    // It fades towards the poles, over a tenth of the radius.
    assert!(survey.steepest < 1.0 && survey.too_steep == 0.0, "{survey:?}");
    let boxes = [0.1, 0.2].map(|side_m| Cuboid::new([side_m; 3]).unwrap());
    let joined = Shape::from(Arc::new(Csg::build(&CsgTree::union(boxes)).unwrap()));
    assert_eq!(sized(&wave(), 1e-3, SIZE_M).survey(&joined), None);
}
