//! Meshes that are convex, and those that are not by very little.

use haptics::mesh::{Mesh, TriangleSoup, make};
use nalgebra::Vector3;

fn inner_m(soup: TriangleSoup) -> Option<f64> {
    Mesh::build(soup).unwrap().0.convex_inner_m()
}

/// Cut in four so often, each vertex moved out by this share, by the way to it from the middle.
fn cut_cube(often: usize, moved: impl Fn(&Vector3<f64>) -> f64) -> TriangleSoup {
    let mut soup = make::cuboid([0.1; 3]);
    for _ in 0..often {
        soup = cut_in_four(&soup);
    }
    for vertex in &mut soup.vertices {
        *vertex *= 1.0 + moved(&vertex.normalize());
    }
    soup
}

fn cut_in_four(soup: &TriangleSoup) -> TriangleSoup {
    let mut cut = TriangleSoup { vertices: vec![], faces: vec![] };
    for face in &soup.faces {
        let [a, b, c] = face.map(|vertex| soup.vertices[vertex as usize]);
        let first = cut.vertices.len() as u32;
        cut.vertices.extend([a, b, c, (a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5]);
        cut.faces.extend([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]].map(|at| at.map(|at| first + at)));
    }
    cut
}

#[test]
fn convex_solids_are_told_with_the_ball_that_is_in_them() {
    let cube = inner_m(make::cuboid([0.1, 0.2, 0.3])).unwrap();
    assert!((cube - 0.05).abs() < 1e-15, "{cube}");
    let ball = inner_m(make::uv_sphere(64, 32, 0.05)).unwrap();
    // The middles of its faces lie within by half the square of an angle.
    assert!((0.0497..0.05).contains(&ball), "{ball}");
    let flat = inner_m(cut_cube(4, |_| 0.0)).unwrap();
    assert!((flat - 0.05).abs() < 1e-15, "{flat}");
    // Seven digits, as files have them.
    let turn = nalgebra::UnitQuaternion::from_euler_angles(0.3, 0.5, 0.7);
    let mut written = cut_cube(4, |_| 0.0);
    written
        .vertices
        .iter_mut()
        .for_each(|vertex| *vertex = (turn * *vertex).map(|part| f64::from(part as f32)));
    assert!(inner_m(written).is_some());
}

#[test]
fn what_is_hollow_anywhere_or_consists_of_parts_is_not_convex() {
    assert_eq!(inner_m(make::torus(24, 12, 0.1, 0.03)), None);
    assert_eq!(inner_m(make::torus(600, 300, 0.1, 0.03)), None, "finely cut");
    assert_eq!(inner_m(make::star(5, 0.1, 0.04, 0.05)), None);
    assert_eq!(inner_m(make::bumpy_sphere(48, 24, 0.1)), None);
    // Dents of a tenth of a millimetre, and of a hundredth.
    for deep in [1e-3, 1e-4] {
        let dented =
            cut_cube(4, |way| if way.y > 0.8 { -deep * (1.0 - (1.0 - way.y) / 0.2).max(0.0) } else { 0.0 });
        assert_eq!(inner_m(dented), None, "{deep}");
    }
    // One vertex of many, which few faces see.
    let mut pressed = cut_cube(6, |_| 0.0);
    let top = Vector3::y() * 0.05;
    pressed.vertices.iter_mut().filter(|at| (**at - top).norm() < 1e-9).for_each(|at| at.y -= 1e-4);
    assert_eq!(inner_m(pressed), None);
    // A dish of 50 m radius, cut so finely that no edge tells: 25 um deep.
    let mut dish = cut_cube(6, |_| 0.0);
    for at in dish.vertices.iter_mut().filter(|at| at.y > 0.049_999) {
        at.y -= (0.005 - at.x * at.x - at.z * at.z) / 100.0;
    }
    assert_eq!(inner_m(dish), None);
    // Two parts, of which one is so small that hardly a face of the other looks at it.
    let mut ball = make::uv_sphere(400, 200, 0.05);
    let first = ball.vertices.len() as u32;
    let grain = make::cuboid([2e-6; 3]);
    let place = Vector3::new(1.0, 2.0, 3.0).normalize() * 0.050_003;
    ball.vertices.extend(grain.vertices.iter().map(|vertex| vertex + place));
    ball.faces.extend(grain.faces.iter().map(|face| face.map(|vertex| vertex + first)));
    assert_eq!(inner_m(ball), None);
    let mut two = make::cuboid([0.1; 3]);
    let first = two.vertices.len() as u32;
    let other = make::cuboid([0.1; 3]);
    two.vertices.extend(other.vertices.iter().map(|vertex| vertex + Vector3::x() * 0.3));
    two.faces.extend(other.faces.iter().map(|face| face.map(|vertex| vertex + first)));
    assert_eq!(inner_m(two), None);
    let room = Mesh::build(make::cuboid([1.0; 3])).unwrap().0.into_sheet();
    assert_eq!(room.convex_inner_m(), None);
    let mut open = make::cuboid([0.1; 3]);
    open.faces.truncate(10);
    let open = Mesh::build_closing(open, haptics::mesh::CloseHoles::UpTo(0.0)).unwrap().0;
    assert_eq!(open.convex_inner_m(), None);
}
