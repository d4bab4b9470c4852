//! Open parts that cross: a point on one of them meets the others, and is let go on the side from which it came.
#![allow(non_snake_case)]

use std::sync::Arc;

use crate::common::flawed::together;
use crate::common::meshes::*;
use crate::common::*;
use haptics::mesh::{Mesh, TriangleSoup, make};
use haptics::{Entity, Finger, FingerOutput, Friction};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

/// A mesh of four-cornered sheets, each a part of its own.
fn quads(quads: &[[[f64; 3]; 4]]) -> TriangleSoup {
    let mut all = TriangleSoup::default();
    for corners in quads {
        let first = all.vertices.len() as u32;
        all.vertices.extend(corners.iter().copied().map(Vector3::from));
        all.faces.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    all
}

fn turned(mut soup: TriangleSoup, turn: &Isometry3<f64>) -> TriangleSoup {
    soup.vertices.iter_mut().for_each(|at| *at = (turn * nalgebra::Point3::from(*at)).coords);
    soup
}

const FLOOR: [[f64; 3]; 4] = [[-0.05, 0.0, -0.05], [-0.05, 0.0, 0.05], [0.05, 0.0, 0.05], [0.05, 0.0, -0.05]];

/// Through these places at 0.1 m/s.
fn stroke(finger: &mut Finger, entity: &Entity, places: &[Vector3<f64>]) -> FingerOutput {
    let mut last = step(finger, entity, &places[0]);
    for (from, to) in places.iter().zip(&places[1..]) {
        let ticks = ((to - from).norm() / 1e-4).ceil().max(1.0);
        for tick in 1..=ticks as u32 {
            last = step(finger, entity, &(from + (to - from) * (f64::from(tick) / ticks)));
        }
    }
    last
}

/// Outputs of a point at the end of a stroke, and of a ball of 0.1 mm.
fn felt(mesh: &Arc<Mesh>, places: &[Vector3<f64>]) -> [FingerOutput; 2] {
    let entity = touchable(mesh, Friction::None);
    [0.0, 1e-4].map(|radius_m| stroke(&mut finger(radius_m), &entity, places))
}

/// A wall of two sheets with an upright edge between them, and tubes of four.
#[test]
fn around_the_upright_edges_of_an_open_wall_a_finger_is_let_go() {
    let corner = [[-0.02, 0.0], [0.0, 0.0], [0.0, -0.02]];
    let tube = [[-0.02, 0.0], [0.0, 0.0], [0.0, -0.02], [-0.02, -0.02], [-0.02, 0.0]];
    let walls = |outline: &[[f64; 2]]| {
        let mut all = TriangleSoup::default();
        all.vertices.extend(outline.iter().flat_map(|[x, z]| [-0.01, 0.03].map(|y| Vector3::new(*x, y, *z))));
        let sides = 0..outline.len() as u32 - 1;
        all.faces.extend(sides.flat_map(|at| {
            let [a, b, c, d] = [2 * at, 2 * at + 2, 2 * at + 3, 2 * at + 1];
            [[a, b, c], [a, c, d]]
        }));
        all
    };
    // Along one of its walls, around the edge, and away.
    let strokes: [&[[f64; 3]]; 3] = [
        &[
            [-0.01, 0.01, 0.02],
            [-0.01, -1e-3, 0.02],
            [-0.0102, -1e-3, -0.002],
            [0.002, -1e-3, -0.0021],
            [0.02, -1e-3, -0.0105],
            [0.03, 0.03, -0.01],
        ],
        &[
            [0.02, 0.01, -0.01],
            [0.02, -1e-3, -0.01],
            [-0.002, -1e-3, -0.0102],
            [-0.0021, -1e-3, 0.002],
            [-0.0105, -1e-3, 0.02],
            [-0.01, 0.03, 0.03],
        ],
        &[
            [0.02, 0.01, 0.015],
            [0.02, -1e-3, 0.015],
            [-0.005, -1e-3, -0.004],
            [0.02, -1e-3, -0.013],
            [0.03, 0.03, -0.01],
        ],
    ];
    for case in 0..20 {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.1 + 0.3 * f64::from(case));
        let turn = Isometry3::from_parts(Vector3::new(0.0013, 0.0, -0.0007).into(), turn);
        let floor = || if case % 2 == 0 { quads(&[FLOOR]) } else { moved_cuboid() };
        for outline in [&corner[..], &tube] {
            let mesh = built(together([floor(), turned(walls(outline), &turn)]));
            for (number, stroke) in strokes.iter().enumerate() {
                let places: Vec<_> =
                    stroke.iter().map(|at| (turn * nalgebra::Point3::from(*at)).coords).collect();
                let met = &places[..4.min(places.len() - 1)];
                let [point, ball] = felt(&mesh, &met[..3]);
                let difference = (point.force_on_user_W - ball.force_on_user_W).norm();
                // A ball is pushed by its radius more, by each of three walls.
                assert!(difference < 3.0 * K * 1e-4, "{case} {number}: {point:?} {ball:?}");
                assert!(ball.force_on_user_W.norm() > 1.5 * K * 1e-3, "{case} {number}: {ball:?}");
                let [point, ball] = felt(&mesh, &places);
                assert!(point.entity.is_none() && ball.entity.is_none(), "{case} {number}: {point:?}");
            }
        }
    }
}

fn moved_cuboid() -> TriangleSoup {
    turned(make::cuboid([0.1, 0.04, 0.1]), &Isometry3::translation(0.0, -0.02, 0.0))
}

/// A wall that leans, with rims that are slanted: along its foot to the end, off it, and away.
#[test]
fn at_the_end_of_a_leaning_wall_a_finger_is_let_go() {
    for lean in [-60.0_f64, -45.0, -20.0, 0.0, 20.0, 45.0, 60.0] {
        for slant in [-45.0_f64, 45.0] {
            let [lean, slant] = [lean, slant].map(|angle| angle.to_radians().tan());
            let at = |y: f64, z: f64| [y * lean, y, z + y * slant];
            let wall = [at(-0.01, -0.015), at(-0.01, 0.015), at(0.02, 0.015), at(0.02, -0.015)];
            for floor in [quads(&[FLOOR]), moved_cuboid()] {
                let mesh = built(together([floor, quads(&[wall])]));
                for side in [1.0, -1.0] {
                    let way = [
                        [0.02, 0.01, 0.0],
                        [0.02, -1e-3, 0.0],
                        [-0.002, -1e-3, 0.0],
                        [-0.002, -1e-3, 0.017],
                        [-0.002, -1e-3, 0.03],
                        [-0.03, -1e-3, 0.03],
                        [-0.04, 0.03, 0.04],
                    ];
                    let places = way.map(|[x, y, z]| Vector3::new(side * x, y, z));
                    let [point, ball] = felt(&mesh, &places);
                    let told = || format!("{lean} {slant} {side}: {point:?} {ball:?}");
                    assert!(point.entity.is_none() && ball.entity.is_none(), "{}", told());
                }
            }
        }
    }
}

/// Two walls that lie on one another, of which one ends a millimetre before the other.
#[test]
fn past_the_ends_of_walls_that_are_one_a_finger_is_let_go() {
    let wall = |z: f64| [[0.0, -0.01, -0.03], [0.0, -0.01, z], [0.0, 0.03, z], [0.0, 0.03, -0.03]];
    let way = [
        [0.03, 0.01, 7e-3],
        [0.03, -1e-3, 7e-3],
        [-4e-3, -1e-3, 7e-3],
        [-4e-3, -1e-3, 0.035],
        [-0.03, -1e-3, 0.035],
    ];
    let places = way.map(Vector3::from);
    for floor in [quads(&[FLOOR]), moved_cuboid()] {
        for cells in [1, 3] {
            let mut other = quads(&[wall(0.029)]);
            if cells > 1 {
                other = sheet(cells, 0.1, |_, _| 0.0);
                for at in &mut other.vertices {
                    *at = Vector3::new(0.0, 0.01 + 0.4 * at.x, -5e-4 + 0.59 * at.z);
                }
            }
            let mesh = built(together([floor.clone(), quads(&[wall(0.03)]), other]));
            let [point, ball] = felt(&mesh, &places[..4]);
            for (felt, radius_m) in [(point, 0.0), (ball, 1e-4)] {
                let on_floor_m = (felt.force_on_user_W.norm() / K - 1e-3 - radius_m).abs();
                assert!(on_floor_m < 1e-6, "{cells}: {felt:?}");
            }
        }
    }
}

/// Several sheets through one upright line, as trees of pictures are made: into the wedge between two of them, and out again.
#[test]
fn in_the_wedge_of_sheets_that_cross_in_one_line_a_finger_is_let_go() {
    for count in [2, 3, 4, 6] {
        let sheet = |number: u32| {
            let angle = 0.2 + std::f64::consts::PI * f64::from(number) / f64::from(count);
            let at = |along: f64, y: f64| [along * angle.cos(), y, along * angle.sin()];
            [at(-0.03, -0.01), at(0.03, -0.01), at(0.03, 0.03), at(-0.03, 0.03)]
        };
        let sheets = quads(&(0..count).map(sheet).collect::<Vec<_>>());
        let floors = [Some(quads(&[FLOOR])), Some(moved_cuboid()), None];
        for (number, floor) in floors.into_iter().enumerate() {
            let has_floor = floor.is_some();
            let mesh = built(together([floor.unwrap_or_default(), sheets.clone()]));
            for wedge in 0..count {
                let angle = 0.2 + std::f64::consts::PI * (f64::from(wedge) + 0.5) / f64::from(count);
                let at = |along: f64, aside: f64, y: f64| {
                    Vector3::new(
                        along * angle.cos() - aside * angle.sin(),
                        y,
                        along * angle.sin() + aside * angle.cos(),
                    )
                };
                let into = [at(0.025, 0.0, 0.01), at(0.025, 0.0, -1e-3), at(-0.012, 1e-3, -1e-3)];
                let [point, ball] = felt(&mesh, &into);
                assert!(ball.force_on_user_W.norm() > 5e-3 * K, "{count} {number} {wedge}: {ball:?}");
                let difference = (point.force_on_user_W - ball.force_on_user_W).norm();
                // In a wedge of the angle a, a ball is held as far before the line as its radius over sin(a / 2).
                let half = 0.5 * std::f64::consts::PI / f64::from(count);
                let most_m = 1e-4 * (1.0 + 1.0 / half.sin());
                assert!(difference < K * most_m, "{count} {number} {wedge}: {point:?} {ball:?}");
                for out in [at(0.04, 0.0, -1e-3), at(0.03, 0.0, 0.04)] {
                    let mut places = into.to_vec();
                    places.push(out);
                    let [point, _] = felt(&mesh, &places);
                    let on_floor_n = if has_floor { K * (-out.y).max(0.0) } else { 0.0 };
                    let off_n = (point.force_on_user_W.norm() - on_floor_n).abs();
                    assert!(off_n < 1e-6, "{count} {number} {wedge}: {point:?}");
                }
            }
        }
    }
}

/// More leaves than are looked at, somewhere else in the mesh: a wall holds as before.
/// The wall ends aslant over the floor: where its end leads back to the crease the spring is never but partly borne by what does
/// not move. Drawn along the crease at a depth of some millimetres, and past its end.
#[test]
fn at_the_end_of_a_crease_that_is_cut_aslant_a_finger_does_not_stand() {
    const ENDS_AT: f64 = 0.2;
    let mut random = Noise(7);
    for case in 0..150 {
        let (angle, on_floor, sinks) =
            (random.between(0.1, 1.2), random.between(0.1, 0.5), random.between(-0.4, 0.0));
        let (deep_m, a_tick_m) = if case % 2 == 0 { (5e-3, 5e-5) } else { (2e-3, 1e-4) };
        let (sin, cos) = f64::sin_cos(angle);
        let on_wall = |x: f64, height: f64| [x, height * sin, height * cos];
        let rim = |height: f64| on_wall(height / ENDS_AT.tan(), height);
        let wall = [on_wall(-0.015, -0.004), rim(-0.004), rim(0.008), on_wall(-0.015, 0.008)];
        let entity = touchable(&built(quads(&[FLOOR, wall])), Friction::None);
        let mut finger = finger(0.0);
        let [bisector, wall_normal] =
            [[0.0, (0.5 * angle).sin(), (0.5 * angle).cos()], [0.0, -cos, sin]].map(Vector3::from);
        let pull = -(Vector3::y() * on_floor + wall_normal * (1.0 - on_floor)).normalize();
        let start = Vector3::x() * -5e-3 + bisector * 1e-3;
        let mut before = None;
        for tick in 0..200 + (0.01 / a_tick_m) as u32 {
            let (pressed, along) = (f64::from(tick.min(200)) / 200.0, f64::from(tick.saturating_sub(200)));
            let hip = start + pull * (deep_m * pressed) + Vector3::new(1.0, sinks, 0.0) * (along * a_tick_m);
            let felt = step(&mut finger, &entity, &hip);
            let borne = felt.force_on_user_W.norm() / (K * (felt.god_object_W - hip).norm());
            let stands = before
                .replace(felt.god_object_W)
                .is_some_and(|before| (before - felt.god_object_W).norm() < 1e-6);
            assert!(felt.entity.is_none() || !stands || borne > 0.97, "{case} {tick}: {borne} {felt:?}");
        }
    }
}

#[test]
fn a_wall_holds_beside_a_heap_of_leaves() {
    let mut noise = Noise(3);
    let mut leaves = Vec::new();
    for _ in 0..1100 {
        let turn = UnitQuaternion::new(noise.vector(2.0));
        let corner = |x: f64, z: f64| (Vector3::x() * 0.2 + turn * Vector3::new(x, 0.0, z)).into();
        leaves.push([corner(-0.02, -0.02), corner(-0.02, 0.02), corner(0.02, 0.02), corner(0.02, -0.02)]);
    }
    let wall = [[0.0, -0.01, -0.03], [0.0, -0.01, 0.03], [0.0, 0.03, 0.03], [0.0, 0.03, -0.03]];
    let mesh = built(together([quads(&leaves), quads(&[FLOOR, wall])]));
    let places = [[-0.02, 0.01, 1e-3], [-0.02, -1e-3, 1e-3], [0.01, -1e-3, 1e-3]].map(Vector3::from);
    let [point, _] = felt(&mesh, &places);
    assert!((point.force_on_user_W - Vector3::new(-0.01, 1e-3, 0.0) * K).norm() < 1e-4 * K, "{point:?}");
    let places: Vec<_> = places.into_iter().chain([Vector3::new(-0.03, 0.01, 1e-3)]).collect();
    let [point, _] = felt(&mesh, &places);
    assert!(point.entity.is_none(), "{point:?}");
}

/// As many closed boxes that pass through each other that nobody looks at all of them: in doubt, sheets cross.
#[test]
fn a_wall_holds_beside_a_heap_of_boxes() {
    let mut noise = Noise(4);
    let boxes = (0..400).map(|_| {
        let turn = UnitQuaternion::new(noise.vector(2.0));
        let place = Isometry3::from_parts((Vector3::x() * 0.2 + noise.vector(2e-3)).into(), turn);
        turned(make::cuboid([0.02; 3]), &place)
    });
    let boxes = together(boxes);
    let wall = [[0.0, -0.01, -0.03], [0.0, -0.01, 0.03], [0.0, 0.03, 0.03], [0.0, 0.03, -0.03]];
    let mesh = built(together([quads(&[FLOOR, wall]), boxes]));
    let places = [[-0.02, 0.01, 1e-3], [-0.02, -1e-3, 1e-3], [0.01, -1e-3, 1e-3]].map(Vector3::from);
    let [point, _] = felt(&mesh, &places);
    assert!((point.force_on_user_W - Vector3::new(-0.01, 1e-3, 0.0) * K).norm() < 1e-4 * K, "{point:?}");
}

/// Among leaves that cross, wherever a hand rests: the god-object comes to rest, and the whole spring is felt.
#[test]
fn among_leaves_that_cross_a_finger_comes_to_rest() {
    let mut held = 0;
    for seed in 0..200 {
        let mut noise = Noise(seed);
        let leaves = (0..16).map(|_| {
            let (turn, middle) = (UnitQuaternion::new(noise.vector(2.0)), noise.vector(0.02));
            let corner = |x: f64, z: f64| (middle + turn * Vector3::new(x, 0.0, z)).into();
            [corner(-0.01, -0.01), corner(-0.01, 0.01), corner(0.01, 0.01), corner(0.01, -0.01)]
        });
        let entity = touchable(&built(quads(&leaves.collect::<Vec<_>>())), Friction::None);
        let mut finger = point_finger();
        let mut from = Vector3::x() * 0.05;
        for _ in 0..20 {
            let to = noise.vector(0.03);
            stroke(&mut finger, &entity, &[from, to]);
            let rests = (0..100).map(|_| step(&mut finger, &entity, &to)).last().unwrap();
            from = to;
            if rests.entity.is_none() {
                continue;
            }
            held += 1;
            let spring = (rests.god_object_W - to) * K;
            let again = step(&mut finger, &entity, &to);
            let moves_m = (again.god_object_W - rests.god_object_W).norm();
            // What it is let down by is one radius, along one of two walls.
            let off_n = (rests.force_on_user_W - spring).norm();
            assert!(
                moves_m < 1e-9 && off_n < 2e-5 * K + 0.02 * spring.norm(),
                "{seed}: {moves_m} m, {rests:?}, {to:?}"
            );
        }
    }
    assert!(held > 300, "{held}");
}

/// A point that rolls is where it would be if nothing crossed the surface elsewhere, however fast it goes: over flat faces and round
/// ones, and along their edges.
#[test]
fn a_point_that_rolls_feels_what_one_that_walks_does() {
    let wall = [[0.055, -0.01, -0.04], [0.055, -0.01, 0.04], [0.06, 0.03, 0.04], [0.06, 0.03, -0.04]];
    let far = || quads(&[wall, wall.map(|[x, y, z]| [x + 0.5 * z, y, z])]);
    let flat = |_: f64, _: f64| 0.0;
    let dome = |x: f64, z: f64| (0.08_f64.powi(2) - x * x - z * z).sqrt() - 0.08;
    let ridges = |x: f64, _: f64| 2e-3 - 2.0 * (x.rem_euclid(8e-3) - 4e-3).abs();
    for (name, soup, ways_m) in [
        ("flat", sheet(1, 0.1, flat), [1e-4, 1e-3, 4e-3]),
        ("flat", sheet(40, 0.1, flat), [1e-4, 1e-3, 4e-3]),
        ("dome", sheet(50, 0.1, dome), [1e-4, 5e-4, 1e-3]),
        ("ridges", sheet(50, 0.1, ridges), [1e-4, 5e-4, 1e-3]),
    ] {
        for scale in [1.0, 0.1] {
            let scaled = |mut soup: TriangleSoup| {
                soup.vertices.iter_mut().for_each(|at| *at *= scale);
                soup
            };
            let [rolled, walked] =
                [together([soup.clone(), far()]), soup.clone()].map(|soup| built(scaled(soup)));
            assert!(rolled.point_radius_m() > 0.0 && walked.point_radius_m() == 0.0);
            for (friction, is_along, way_m) in
                [Friction::None, Friction::coulomb(0.4).unwrap()].into_iter().flat_map(|friction| {
                    [true, false].into_iter().flat_map(move |is_along| {
                        let friction = friction.clone();
                        ways_m.into_iter().map(move |way_m| (friction.clone(), is_along, way_m * scale))
                    })
                })
            {
                let [mut one, mut other] = [0; 2].map(|_| finger(0.0));
                let entities = [&rolled, &walked].map(|mesh| touchable(mesh, friction.clone()));
                let mut noise = Noise(11);
                let mut hip = Vector3::new(0.0, 2e-3, 0.0) * scale;
                let mut aim = hip;
                // In a groove it is rubbed by both walls.
                if name == "ridges" && !matches!(friction, Friction::None) {
                    continue;
                }
                let mut touched = 0;
                for tick in 0..2000 {
                    if (aim - hip).norm() < way_m {
                        // Along edges, or anywhere.
                        let z = if is_along { 0.0 } else { noise.between(-0.015, 0.015) };
                        let x = noise.between(-0.015, 0.015);
                        let height = if name == "dome" { dome(x, z) } else { 0.0 };
                        aim = Vector3::new(x, height + noise.between(-2e-3, 5e-4), z) * scale;
                    }
                    hip += (aim - hip) * (way_m / (aim - hip).norm()).min(1.0);
                    let [rolls, walks] = [(&mut one, &entities[0]), (&mut other, &entities[1])]
                        .map(|(finger, entity)| step(finger, entity, &hip));
                    touched += u32::from(walks.entity.is_some());
                    let difference = (rolls.force_on_user_W - walks.force_on_user_W).norm() / K;
                    // Ten of its radii: it rounds edges, and where it is dragged over them it sticks and slips elsewhere.
                    let told = || {
                        format!("{name} {scale} {friction:?} {way_m}, {tick}: {rolls:?} {walks:?} {hip:?}")
                    };
                    assert!(difference < 1e-4 * scale, "{}", told());
                }
                assert!(touched > 200, "{name} {scale} {friction:?} {way_m}: {touched}");
            }
        }
    }
}

/// Each mesh is a floor and a wall of its own; the walls are behind one another.
#[test]
fn a_finger_comes_to_the_walls_of_as_many_meshes_as_it_has_room_for() {
    const MESHES: usize = 30;
    let wall = |x: f64| [[x, -0.01, -0.03], [x, -0.01, 0.03], [x, 0.03, 0.03], [x, 0.03, -0.03]];
    let mesh = |number: usize| built(quads(&[FLOOR, wall(2e-4 * number as f64)]));
    let entities: Vec<Entity> = (0..MESHES).map(|number| touchable(&mesh(number), Friction::None)).collect();
    let finger = Finger::new(0.0, MESHES).unwrap().with_ramp_in(0.0).unwrap();
    let mut finger = finger.with_room_for(&entities);
    let mut force_W = Vector3::zeros();
    for tick in 0..400 {
        let x = -0.02 + 1e-4 * f64::from(tick);
        let hip = Vector3::new(x, if tick == 0 { 1e-3 } else { -1e-3 }, 1e-3);
        force_W = finger.step(&entities, &hip, 1e-3).force_on_user_W;
    }
    let pushed_m: f64 = (0..MESHES).map(|number| 0.0199 - 2e-4 * number as f64).sum();
    assert!((force_W.x + K * pushed_m).abs() < 1e-6 * K, "{force_W:?}");
}
