//! Sharp meshes that come down on each other. Convex ones do not get into each other, whatever of them touches, and slide off; of
//! those with hollows it is counted how many do.
#![allow(non_snake_case)]

use std::f64::consts::TAU;

use crate::{common, meshes, noise};

use common::*;
use haptics::mesh::{TriangleSoup, make};
use haptics::{Entity, Shape};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use noise::Noise;
use physics::{Body, ContactStiffness, Settings};

/// From a base over x and y with so many corners to a top of this share of it.
fn frustum(sides: u32, radius_m: f64, top: f64, length_m: f64) -> TriangleSoup {
    let corner = |at: u32| {
        let (sin, cos) = (TAU * f64::from(at) / f64::from(sides)).sin_cos();
        [radius_m * cos, radius_m * sin]
    };
    let outline: Vec<_> = (0..sides).map(corner).collect();
    let fan: Vec<_> = (2..sides).map(|at| [0, at - 1, at]).collect();
    let mut soup = meshes::prism(&outline, &fan, length_m);
    for vertex in soup.vertices.iter_mut().filter(|vertex| vertex.z > 0.0) {
        (vertex.x, vertex.y) = (vertex.x * top, vertex.y * top);
    }
    soup
}

/// Tetrahedron, pyramid, cone, roof, wedge, bars, plank, plate and cube, of 1 to 80 mm.
fn sharp() -> Vec<TriangleSoup> {
    let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let tetrahedron = TriangleSoup {
        vertices: corners.map(|at| Vector3::from(at) * 0.015).into(),
        faces: vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]],
    };
    let roof = [[-0.02, -0.02], [0.02, -0.02], [0.02, 0.0], [0.0, 0.02], [-0.02, 0.0]];
    vec![
        tetrahedron,
        frustum(4, 0.025, 0.02, 0.03),
        frustum(8, 0.02, 0.1, 0.05),
        meshes::prism(&roof, &[[0, 1, 2], [0, 2, 4], [2, 3, 4]], 0.08),
        meshes::prism(&[[-0.002, 0.0], [0.0, -0.04], [0.002, 0.0]], &[[0, 1, 2]], 0.08),
        frustum(3, 0.01, 1.0, 0.08),
        frustum(12, 0.01, 1.0, 0.08),
        make::cuboid([0.02, 0.004, 0.2]),
        make::cuboid([0.06, 0.001, 0.06]),
        make::cuboid([0.03; 3]),
    ]
}

/// Directions along which a convex solid's overlap with another is measured.
struct Polytope {
    corners: Vec<Vector3<f64>>,
    normals: Vec<Vector3<f64>>,
    edges: Vec<Vector3<f64>>,
}

impl Polytope {
    fn of(soup: &TriangleSoup) -> Self {
        let at = |corner: u32| soup.vertices[corner as usize];
        let (mut normals, mut edges) = (vec![], vec![]);
        let note = |all: &mut Vec<Vector3<f64>>, way: Vector3<f64>| {
            let way = way.normalize();
            if !all.iter().any(|one: &Vector3<f64>| one.cross(&way).norm() < 1e-9) {
                all.push(way);
            }
        };
        for [a, b, c] in soup.faces.iter().copied() {
            note(&mut normals, (at(b) - at(a)).cross(&(at(c) - at(a))));
            [(a, b), (b, c), (c, a)].into_iter().for_each(|(a, b)| note(&mut edges, at(b) - at(a)));
        }
        Self { corners: soup.vertices.clone(), normals, edges }
    }

    fn placed(&self, X_W: &Isometry3<f64>) -> Self {
        let turned = |ways: &[Vector3<f64>]| ways.iter().map(|way| X_W * way).collect();
        let corners = self.corners.iter().map(|at| (X_W * Point3::from(*at)).coords).collect();
        Self { corners, normals: turned(&self.normals), edges: turned(&self.edges) }
    }

    /// Depth in each other (m): the least overlap along all normals and all that is across two edges.
    fn depth_m(&self, other: &Self) -> f64 {
        let across = self.edges.iter().flat_map(|a| other.edges.iter().map(|b| a.cross(b)));
        let across = across.filter_map(|way| way.try_normalize(1e-9));
        let ways = self.normals.iter().chain(&other.normals).copied().chain(across);
        let overlap_m = |way: Vector3<f64>| {
            let ends = [self, other].map(|one| {
                let along = one.corners.iter().map(|at| way.dot(at));
                along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)])
            });
            (ends[0][1] - ends[1][0]).min(ends[1][1] - ends[0][0])
        };
        ways.map(overlap_m).fold(f64::INFINITY, f64::min)
    }
}

/// A solid that consists of convex ones.
struct Solid {
    soup: TriangleSoup,
    parts: Vec<Polytope>,
}

impl Solid {
    fn convex(soup: TriangleSoup) -> Self {
        Self { parts: vec![Polytope::of(&soup)], soup }
    }

    /// A prism over an outline, of which each triangle makes a convex one.
    fn prism(outline: &[[f64; 2]], triangles: &[[u32; 3]], depth: f64) -> Self {
        let part = |corners: &[u32; 3]| {
            let outline = corners.map(|corner| outline[corner as usize]);
            Polytope::of(&meshes::prism(&outline, &[[0, 1, 2]], depth))
        };
        Self { soup: meshes::prism(outline, triangles, depth), parts: triangles.iter().map(part).collect() }
    }

    /// Angle, channel and stars.
    fn hollow() -> Vec<Self> {
        let angle = [[0.0, 0.0], [0.05, 0.0], [0.05, 0.008], [0.008, 0.008], [0.008, 0.05], [0.0, 0.05]];
        let channel = [
            [-0.03, 0.0],
            [0.03, 0.0],
            [0.03, 0.04],
            [0.022, 0.04],
            [0.022, 0.008],
            [-0.022, 0.008],
            [-0.022, 0.04],
            [-0.03, 0.04],
        ];
        let of_channel = [[0, 1, 4], [0, 4, 5], [1, 2, 3], [1, 3, 4], [0, 5, 6], [0, 6, 7]];
        let star = |tips: u32, inner_m: f64| {
            let corner = |at: u32| {
                let (sin, cos) = (0.5 * TAU * f64::from(at) / f64::from(tips)).sin_cos();
                [sin, -cos].map(|part| part * if at.is_multiple_of(2) { 0.015 } else { inner_m })
            };
            let outline: Vec<_> = (0..2 * tips).map(corner).collect();
            let mut triangles: Vec<_> =
                (0..tips).map(|tip| [(2 * tip + 2 * tips - 1) % (2 * tips), 2 * tip, 2 * tip + 1]).collect();
            triangles.extend((2..tips).map(|at| [1, 2 * at - 1, 2 * at + 1]));
            Self::prism(&outline, &triangles, 0.06)
        };
        vec![
            Self::prism(&angle, &[[0, 1, 2], [0, 2, 3], [0, 3, 5], [3, 4, 5]], 0.06),
            Self::prism(&channel, &of_channel, 0.05),
            star(5, 0.007),
            star(8, 0.009),
        ]
    }
}

/// Depth of one at a place in another at its own (m): of those of their parts.
fn depth_m(solids: [&Solid; 2], poses: [&Isometry3<f64>; 2]) -> f64 {
    let [a, b] =
        [0, 1].map(|at| solids[at].parts.iter().map(|part| part.placed(poses[at])).collect::<Vec<_>>());
    let all = a.iter().flat_map(|a| b.iter().map(|b| a.depth_m(b)));
    all.fold(f64::NEG_INFINITY, f64::max)
}

/// One that may move, at a fixed one.
fn world([lower, upper]: [Entity; 2], moving: impl Fn(Body) -> Body) -> World {
    let entities = vec![lower, upper];
    let bodies = [(1, moving(body(&entities[1], 0.05)))];
    let contact_stiffness = ContactStiffness::ByMass { damping_ratio: 1.0 };
    World::new(entities, &bodies, Settings { contact_stiffness, ..Settings::default() }, 0)
}

/// One comes down on another that is fixed, as they are turned, 0.1 mm above it; how deep it gets in 0.4 s, and is at the end (m).
fn depths_m(solids: [&Solid; 2], noise: &mut Noise) -> [f64; 2] {
    let X_WA = Isometry3::from_parts(Vector3::zeros().into(), noise.turn());
    let (aside, turn) = (noise.vector(0.006), noise.turn());
    let above = |high_m: f64| Isometry3::from_parts(Vector3::new(aside.x, high_m, aside.z).into(), turn);
    let depth_m = |X_WB: &Isometry3<f64>| depth_m(solids, [&X_WA, X_WB]);
    // From above, since what is below it may be free again.
    let (mut low_m, mut high_m) = (-0.3, 0.3);
    let is_in = |high_m: f64| depth_m(&above(high_m)) > -1e-4;
    let first = (0..600).map(|at| 0.3 - 1e-3 * f64::from(at)).find(|at| is_in(*at));
    if let Some(first) = first {
        (low_m, high_m) = (first, first + 1e-3);
    }
    for _ in 0..20 {
        let middle_m = 0.5 * (low_m + high_m);
        *(if is_in(middle_m) { &mut low_m } else { &mut high_m }) = middle_m;
    }
    let [lower, upper]: [Shape; 2] = solids.map(|solid| meshes::build(solid.soup.clone()).into());
    let entities = [object(lower, X_WA, 1000.0, 0.5), object(upper, above(high_m), 1000.0, 0.5)];
    let mut world = world(entities, |body| body);
    let mut depths = [f64::NEG_INFINITY; 2];
    for tick in 0..400 {
        world.step(&[]);
        if tick % 4 == 3 {
            depths[1] = depth_m(&world.entities[1].X_WB);
            depths[0] = depths[0].max(depths[1]);
        }
    }
    depths
}

#[test]
fn sharp_convex_meshes_hardly_get_into_each_other_and_none_lodges() {
    let sharp: Vec<_> = sharp().into_iter().map(Solid::convex).collect();
    let noise = &mut Noise::new(7);
    let (mut all, mut deep) = (0, 0);
    for (a, lower) in sharp.iter().enumerate() {
        for (b, upper) in sharp.iter().enumerate() {
            let [deepest_m, last_m] = depths_m([lower, upper], noise);
            // What swings down at 1 m/s moves by 1 mm in a tick.
            assert!(deepest_m < 1e-3, "{a} under {b}: {deepest_m:e} m");
            assert!(last_m < 1e-4, "{a} under {b}, at the end: {last_m:e} m");
            (all, deep) = (all + 1, deep + usize::from(deepest_m > 2e-4));
        }
    }
    assert!(all >= 5 * deep, "{deep} of {all}");
}

#[test]
fn those_with_hollows_get_into_each_other_for_a_while_at_most() {
    let hollow = Solid::hollow();
    let convex: Vec<_> = sharp().into_iter().map(Solid::convex).collect();
    let noise = &mut Noise::new(11);
    let (mut all, mut deep) = (0, 0);
    for (a, lower) in hollow.iter().enumerate() {
        for (b, upper) in hollow.iter().chain(&convex).enumerate() {
            let [deepest_m, last_m] = depths_m([lower, upper], noise);
            assert!(deepest_m < 8e-3, "{a} under {b}: {deepest_m:e} m");
            assert!(last_m < 3e-4, "{a} under {b}, at the end: {last_m:e} m");
            (all, deep) = (all + 1, deep + usize::from(deepest_m > 3e-4));
        }
    }
    assert!(5 * deep <= 2 * all, "{deep} of {all}");
}

/// A ball with 80 tips, each third of which is long.
fn spiky() -> TriangleSoup {
    let mut soup = make::uv_sphere(8, 6, 0.03);
    let round = std::mem::take(&mut soup.faces);
    for (at, [a, b, c]) in round.into_iter().enumerate() {
        let middle = [a, b, c].map(|corner| soup.vertices[corner as usize]).into_iter().sum::<Vector3<f64>>();
        let tip = soup.vertices.len() as u32;
        soup.vertices.push(middle.normalize() * if at % 3 == 0 { 0.06 } else { 0.031 });
        soup.faces.extend([[a, b, tip], [b, c, tip], [c, a, tip]]);
    }
    soup
}

#[test]
fn a_ball_with_many_tips_rests_on_a_groove_and_not_in_it() {
    let groove = [[-0.05, -0.03], [0.05, -0.03], [0.05, 0.03], [0.0, -0.02], [-0.05, 0.03]];
    let groove = meshes::build(meshes::prism(&groove, &[[0, 1, 3], [1, 2, 3], [0, 3, 4]], 0.08));
    let (ball, noise) = (meshes::build(spiky()), &mut Noise::new(3));
    for case in 0..16 {
        let place = Vector3::new(0.0, 0.11, 0.0) + noise.vector(0.02);
        let entities = [
            object(groove.clone(), Isometry3::identity(), 1000.0, 0.4),
            object(ball.clone(), Isometry3::from_parts(place.into(), noise.turn()), 1000.0, 0.4),
        ];
        let mut world = world(entities, |body| body);
        (0..1200).for_each(|_| drop(world.step(&[])));
        let corners = ball.vertices().iter().map(|at| (world.entities[1].X_WB * Point3::from(*at)).coords);
        let inside = corners.filter(|at| groove.is_inside(at)).map(|at| groove.nearest(&at).distance_m);
        let deepest_m = inside.fold(0.0, f64::max);
        assert!(deepest_m < 5e-4, "{case}: {deepest_m:e} m");
    }
}

/// A box with a dent of a millimetre is not convex; it comes down on a cube that is free, with an edge.
#[test]
fn meshes_that_are_nearly_convex_hold_as_convex_ones_do() {
    let noise = &mut Noise::new(3);
    for dent_m in [0.0, 1e-6, 1e-4, 1e-3] {
        let mut block = meshes::cut_in_four(&make::cuboid([0.05, 0.03, 0.04]));
        // The middle of a side.
        let middle = block.vertices.iter_mut().filter(|at| at.x.abs() < 1e-9 && at.z.abs() < 1e-9);
        middle.filter(|at| at.y > 0.0).for_each(|at| at.y -= dent_m);
        let dented = Solid { parts: vec![Polytope::of(&block)], soup: block };
        let cube = Solid::convex(make::cuboid([0.03; 3]));
        for _ in 0..6 {
            let [deepest_m, last_m] = depths_m([&cube, &dented], noise);
            // The hull stands over the dent. What is found when it is in already is let out slowly, or with the load.
            assert!(deepest_m < 1e-3 + dent_m, "{dent_m}: {deepest_m:e} m");
            assert!(last_m < 5e-4 + dent_m, "{dent_m}, at the end: {last_m:e} m");
        }
    }
}

/// A slab of 1 m by 20 mm, cut into 12288 faces, and a bar of twelve sides with an edge so deep in it, leaning a little.
#[test]
fn what_overlaps_a_finely_cut_slab_is_held_by_the_side_that_it_is_at() {
    let mut slab = make::cuboid([1.0, 0.02, 1.0]);
    for _ in 0..5 {
        slab = meshes::cut_in_four(&slab);
    }
    let slab: Shape = meshes::build(slab).into();
    let bar: Shape = meshes::build(frustum(12, 0.01, 1.0, 0.08)).into();
    for (deep_m, leaning) in [(1e-6, 0.0), (1e-5, 0.1), (3e-4, 0.0), (3e-4, 0.1), (1e-3, 0.05)] {
        let turn = UnitQuaternion::from_euler_angles(0.0, 0.3, leaning);
        let at = Isometry3::from_parts(Vector3::new(0.02, 0.02 - deep_m, 0.03).into(), turn);
        let lower = object(slab.clone(), Isometry3::identity(), 1000.0, 0.5);
        let mut world = world([lower, object(bar.clone(), at, 1000.0, 0.5)], |body| body);
        for _ in 0..200 {
            world.step(&[]);
        }
        // It may turn to a side, which is 0.34 mm nearer than an edge.
        let y = world.entities[1].X_WB.translation.y;
        assert!(y > 0.02 - deep_m - 1e-3, "{deep_m} m, {leaning}: {y} m");
    }
}

/// A ball of 1800 faces on a box, and on the same of triangles: it loses what its corners take.
#[test]
fn a_ball_of_triangles_rolls_on_a_box_as_on_one_of_triangles() {
    let size_m = [1.0, 0.02, 1.0];
    let [radius_m, speed_m_s] = [0.015, 0.3];
    let ball: Shape = meshes::build(make::uv_sphere(60, 30, radius_m)).into();
    let boxes: [Shape; 2] =
        [haptics::Cuboid::new(size_m).unwrap().into(), meshes::build(make::cuboid(size_m)).into()];
    let speeds = boxes.map(|shape| {
        let at = Isometry3::translation(-0.1, 0.01 + radius_m, 0.0);
        let lower = object(shape, Isometry3::identity(), 1000.0, 0.5);
        let (velocity, spin) = (Vector3::x() * speed_m_s, -Vector3::z() * (speed_m_s / radius_m));
        let mut world =
            world([lower, object(ball.clone(), at, 1000.0, 0.5)], |body| body.moving(velocity, spin));
        for _ in 0..400 {
            world.step(&[]);
        }
        world.manipulation.bodies()[0].velocity_W.x
    });
    assert!(speeds.iter().all(|speed| *speed > 0.6 * speed_m_s), "{speeds:?}");
}

/// Two angles across each other, one 30 mm deep in the other: loops come and go there.
#[test]
fn what_is_deep_in_another_with_hollows_is_not_thrown_out_of_it() {
    // Cut so that loops of another shape come there at once.
    let mut soup = Solid::hollow().swap_remove(0).soup;
    soup.vertices.rotate_left(6);
    soup.faces =
        vec![[2, 1, 0], [3, 2, 0], [3, 0, 5], [5, 4, 3], [6, 7, 8], [6, 8, 9], [11, 6, 9], [9, 10, 11]];
    soup.faces.extend((0..6).flat_map(|a| {
        let b = (a + 1) % 6;
        [[a, b, b + 6], [a, b + 6, a + 6]]
    }));
    let angle: Shape = meshes::build(soup).into();
    let lower = Isometry3::from_parts(
        Vector3::zeros().into(),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), TAU / 8.0),
    );
    let turn = lower.rotation * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), TAU / 4.0);
    for aside in 0..24 {
        let above = Vector3::y() * (0.011 + 2e-6 * f64::from(aside));
        let upper = Isometry3::from_parts(above.into(), turn);
        let entities = [lower, upper].map(|at| object(angle.clone(), at, 1000.0, 0.5));
        let mut world = world(entities, |body| body);
        for tick in 0..100 {
            world.step(&[]);
            // Let out at 0.2 m/s, at the end of an arm, and what it falls.
            let speed_m_s = world.manipulation.bodies()[0].velocity_W.norm();
            assert!(speed_m_s < 0.6 + 9.81e-3 * f64::from(tick), "{aside} at {tick}: {speed_m_s} m/s");
        }
    }
}
