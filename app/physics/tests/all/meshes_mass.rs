//! Mass properties of meshes against closed forms.
#![allow(non_snake_case)]

use crate::meshes as common_meshes;

use std::sync::Arc;

use haptics::mesh::{Mesh, TriangleSoup, make};
use haptics::{Cuboid, Shape, Sphere};
use nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};
use physics::{BodyError, MassProperties};

fn shape(soup: TriangleSoup) -> Shape {
    Arc::new(Mesh::build(soup).unwrap().0).into()
}

fn of(soup: TriangleSoup, mass: f64) -> MassProperties {
    MassProperties::of_shape(&shape(soup), mass).unwrap()
}

fn moved(mut soup: TriangleSoup, pose: &Isometry3<f64>) -> TriangleSoup {
    soup.vertices.iter_mut().for_each(|v| *v = (pose * Point3::from(*v)).coords);
    soup
}

fn assert_near(got: &Matrix3<f64>, expected: &Matrix3<f64>, relative: f64) {
    let error = (got - expected).norm() / expected.norm();
    assert!(error < relative, "{error:e}\n{got}{expected}");
}

#[test]
fn a_box_of_triangles_is_as_heavy_to_turn_as_a_box() {
    let size = [0.03, 0.05, 0.11];
    let (mesh, form) = (
        of(make::cuboid(size), 0.2),
        MassProperties::of_shape(&Cuboid::new(size).unwrap().into(), 0.2).unwrap(),
    );
    // A dozen sums of a handful of products.
    assert!(mesh.centre_B.norm() < 1e-16);
    assert!((mesh.principal_kg_m2 - form.principal_kg_m2).norm() < 1e-14 * form.principal_kg_m2.norm());
    // What is symmetric about its frame's axes keeps them, each in its place.
    assert!(mesh.axes_BP.angle() < 1e-12, "{}", mesh.axes_BP);
}

#[test]
fn a_tetrahedron_is_as_its_closed_form_says() {
    // Corners at 0 and at 1 on each axis: m (3/80) (diagonal 2, others 1/3) about the centre (1/4, 1/4, 1/4).
    let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let soup = TriangleSoup {
        vertices: corners.map(Vector3::from).to_vec(),
        faces: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    };
    let mass = of(soup, 2.0);
    assert!((mass.centre_B - Vector3::repeat(0.25)).norm() < 1e-15);
    // Integrals: mean of x^2 is 1/10, of xy 1/20; about the centre 3/80 and -1/80.
    let spread = |i: usize, j: usize| if i == j { 3.0 / 80.0 } else { -1.0 / 80.0 };
    let spread = Matrix3::from_fn(spread);
    let inertia = (Matrix3::from_diagonal_element(spread.trace()) - spread) * 2.0;
    assert_near(&mass.inertia_B(), &inertia, 1e-14);
    // About the space diagonal m 2 (3 - (-1)) / 80 less..: 2 (tr - 1/80) with the eigenvalues 1/80, 4/80, 4/80.
    let mut moments: Vec<f64> = mass.principal_kg_m2.iter().copied().collect();
    moments.sort_by(f64::total_cmp);
    for (got, expected) in moments.iter().zip([10.0 / 80.0, 10.0 / 80.0, 16.0 / 80.0]) {
        assert!((got - expected).abs() < 1e-14, "{moments:?}");
    }
}

#[test]
fn a_sphere_and_a_torus_of_triangles_are_short_of_the_round_ones_by_what_their_facets_cut_off() {
    let radius = 0.04;
    for (nu, nv) in [(100, 51), (316, 159)] {
        let mesh = of(make::uv_sphere(nu, nv, radius), 0.3);
        let form = MassProperties::of_shape(&Sphere::new(radius).unwrap().into(), 0.3).unwrap();
        // Facets lie below the sphere by up to (1 - cos(pi / nu)) + (1 - cos(pi / 2 nv)) of the radius; inertia goes with
        // its square.
        let (around, along) = (std::f64::consts::PI / nu as f64, std::f64::consts::PI / (2 * nv) as f64);
        let cut = (1.0 - around.cos()) + (1.0 - along.cos());
        let share = mesh.principal_kg_m2.component_div(&form.principal_kg_m2);
        assert!(share.iter().all(|share| (1.0 - 2.2 * cut..1.0).contains(share)), "{share} {cut}");
    }
    let (ring, tube) = (0.05, 0.02);
    let mesh = of(make::torus(384, 192, ring, tube), 1.0);
    // m (R^2 + 3/4 r^2) about the axis, m (R^2 / 2 + 5/8 r^2) across it.
    let axial: f64 = ring * ring + 0.75 * tube * tube;
    let across = 0.5 * ring * ring + 0.625 * tube * tube;
    let cut = 2.0 * (std::f64::consts::PI / 192.0).powi(2);
    for (axis, expected) in [(0, across), (1, axial), (2, across)] {
        let got = mesh.principal_kg_m2[axis];
        assert!((got / expected - 1.0).abs() < cut, "{axis}: {got} {expected}");
    }
}

#[test]
fn where_a_mesh_lies_in_its_frame_changes_nothing_but_where_its_centre_and_axes_are() {
    let soup = || make::star(5, 0.05, 0.02, 0.03);
    let base = of(soup(), 0.4);
    for (seed, far) in [(1.0_f64, 0.1), (2.0, 10.0), (3.0, 1000.0)] {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(seed, 0.3 - seed, seed * seed * 0.2));
        let pose = Isometry3::from_parts(Vector3::new(far, -0.3 * far, 0.7 * far).into(), turn);
        let got = of(moved(soup(), &pose), 0.4);
        let R = turn.to_rotation_matrix();
        // Coordinates are rounded by 1e-16 of where they are; its size is 0.05.
        let rounding = 1e-15 * (1.0 + far / 0.05);
        assert!((got.centre_B - (pose * Point3::from(base.centre_B)).coords).norm() < rounding);
        assert_near(&got.inertia_B(), &(R * base.inertia_B() * R.transpose()), 10.0 * rounding);
    }
}

#[test]
fn an_angle_has_the_moments_of_the_two_boxes_it_is_made_of() {
    let (mesh, parts) = (of(common_meshes::angle(), 0.3), common_meshes::ANGLE_PARTS);
    let volume = |(_, size): &([f64; 3], [f64; 3])| size.iter().product::<f64>();
    let total: f64 = parts.iter().map(volume).sum();
    let centre: Vector3<f64> = parts.iter().map(|part| Vector3::from(part.0) * (volume(part) / total)).sum();
    let mut inertia = Matrix3::zeros();
    for part in &parts {
        let mass_kg = 0.3 * volume(part) / total;
        let own = MassProperties::of_shape(&Cuboid::new(part.1).unwrap().into(), mass_kg).unwrap();
        let r = Vector3::from(part.0) - centre;
        inertia += own.inertia_B()
            + (Matrix3::from_diagonal_element(r.norm_squared()) - r * r.transpose()) * mass_kg;
    }
    assert!((mesh.centre_B - centre).norm() < 1e-16);
    assert_near(&mesh.inertia_B(), &inertia, 1e-14);
}

#[test]
fn a_quarter_of_a_million_triangles_are_summed_as_exactly_as_a_thousand() {
    // The same sphere, each face cut into 4 four times over: facets that lie in the same planes.
    let coarse = make::uv_sphere(32, 17, 0.05);
    let mut fine = coarse.clone();
    (0..4).for_each(|_| fine = common_meshes::cut_in_four(&fine));
    assert!(fine.faces.len() > 250_000);
    let far = Isometry3::translation(0.4, -0.2, 0.1);
    let (coarse, fine) = (of(moved(coarse, &far), 1.0), of(moved(fine, &far), 1.0));
    // New corners are rounded, too: by 1e-16 of where they are, 0.4, eight sizes away; their errors do not add up.
    assert!((coarse.centre_B - fine.centre_B).norm() < 1e-15);
    assert_near(&fine.inertia_B(), &coarse.inertia_B(), 1e-13);
}

#[test]
fn open_meshes_and_those_that_enclose_nothing_are_refused_with_what_to_do() {
    let mut open = make::cuboid([0.1; 3]);
    open.faces.pop();
    let refused = MassProperties::of_shape(&shape(open), 1.0).unwrap_err();
    assert!(matches!(refused, BodyError::OpenMesh { faces: 11 }), "{refused:?}");
    let text = refused.to_string();
    assert!(text.contains("inertia_kg_m2") && text.contains("centre_of_mass_m"), "{text}");
    // What to do instead.
    let given = MassProperties::given(1.0, Vector3::y() * 0.01, [2e-3, 1e-3, 2e-3]).unwrap();
    assert_eq!((given.centre_B.y, given.principal_kg_m2.x), (0.01, 2e-3));
    let endless = Vector3::new(0.0, f64::NAN, 0.0);
    assert!(MassProperties::given(1.0, endless, [1e-3; 3]).is_err());
    assert!(MassProperties::given(1.0, Vector3::zeros(), [1e-3, 1e-3, 3e-3]).is_err());
    let strip = shape(make::mobius_strip(40, 4, 0.05, 0.02));
    assert!(matches!(MassProperties::of_shape(&strip, 1.0), Err(BodyError::OpenMesh { .. })));
    let flat = shape(make::cuboid([0.1, 1e-14, 0.1]));
    let refused = MassProperties::of_shape(&flat, 1.0).unwrap_err();
    assert!(matches!(refused, BodyError::NoVolume { .. }), "{refused:?}");
}
