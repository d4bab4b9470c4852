//! Open parts whose rims lie on other faces, and those that only look so.
#![allow(non_snake_case)]

use crate::common::meshes::*;
use crate::common::*;
use haptics::mesh::{CloseHoles, Mesh, MeshReport, TriangleSoup};
use haptics::{Entity, Finger, Friction};
use nalgebra::{Isometry3, Vector3};
use std::sync::Arc;

type Quad = [[f64; 3]; 4];

fn soup(quads: &[Quad]) -> TriangleSoup {
    let mut soup = TriangleSoup::default();
    for quad in quads {
        let first = soup.vertices.len() as u32;
        soup.vertices.extend(quad.map(Vector3::from));
        soup.faces.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    soup
}

/// HIP and god-object, or the HIP again where nothing is touched, of a finger that goes half a millimetre in a tick.
fn stroke<'f>(
    finger: &'f mut Finger,
    entity: &'f Entity,
    from: Vector3<f64>,
    to: Vector3<f64>,
) -> impl Iterator<Item = [Vector3<f64>; 2]> + 'f {
    let ticks = ((to - from).norm() / 5e-4).ceil() as u32 + 1;
    (1..=ticks).map(move |tick| {
        let hip = from + (to - from) * (f64::from(tick) / f64::from(ticks));
        let output = step(finger, entity, &hip);
        [hip, if output.entity.is_some() { output.god_object_W } else { hip }]
    })
}

fn report(quads: &[Quad]) -> MeshReport {
    Mesh::build_closing(soup(quads), CloseHoles::UpTo(0.0)).unwrap().1
}

/// Across an axis at a place, from corner to corner of the other two axes.
fn wall(axis: usize, at: f64, low: [f64; 2], high: [f64; 2]) -> Quad {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]].map(|[p, q]| {
        let mut place = [0.0; 3];
        (place[axis], place[u], place[v]) = (at, p, q);
        place
    })
}

/// Outward.
fn cuboid(size: [f64; 3]) -> Vec<Quad> {
    (0..3)
        .flat_map(|axis| {
            let high = [size[(axis + 1) % 3], size[(axis + 2) % 3]];
            let mut below = wall(axis, 0.0, [0.0; 2], high);
            below.reverse();
            [below, wall(axis, size[axis], [0.0; 2], high)]
        })
        .collect()
}

fn with(mut quads: Vec<Quad>, more: &[Quad]) -> Vec<Quad> {
    quads.extend(more);
    quads
}

fn told(quads: &[Quad]) -> [usize; 4] {
    let report = report(quads);
    assert_eq!(
        report.sheets.count,
        report.open_parts.count + report.sealed_parts.count + report.rimless_parts.count
    );
    [report.open_parts.count, report.sealed_parts.count, report.boundary_edges.count, report.sealed_edges]
}

#[test]
fn walls_between_skins_are_sealed() {
    let room = || cuboid([0.2, 0.1, 0.1]);
    assert_eq!(told(&room()), [0; 4]);
    assert_eq!(told(&with(room(), &[wall(0, 0.1, [0.0; 2], [0.1; 2])])), [0, 1, 4, 4]);
    let said = report(&with(room(), &[wall(0, 0.1, [0.0; 2], [0.1; 2])])).to_string();
    assert!(said.contains("1 part not closed, all its rims on other faces: felt from both sides"), "{said}");
    assert!(said.ends_with("; all rims lie on other faces") && !said.contains("free within"), "{said}");
    // On a skin's face beside its corner, and obliquely across.
    let oblique = [[0.05, 0.0, 0.0], [0.13, 0.1, 0.0], [0.13, 0.1, 0.1], [0.05, 0.0, 0.1]];
    assert_eq!(told(&with(room(), &[oblique])), [0, 1, 4, 4]);
    // Two walls of one height, of which one ends on the other.
    let first = wall(0, 0.1, [0.0; 2], [0.1; 2]);
    let second = [[0.1, 0.0, 0.03], [0.2, 0.0, 0.03], [0.2, 0.1, 0.03], [0.1, 0.1, 0.03]];
    let [open, .., rims, sealed] = told(&with(room(), &[first, second]));
    assert_eq!((open, rims), (0, sealed));
}

#[test]
fn rims_that_a_finger_gets_past_are_open() {
    let room = || cuboid([0.2, 0.1, 0.1]);
    // Short on one side, by more than numbers of files are rounded by; and beyond the skin.
    for short_m in [1e-7, 1e-6, 0.02] {
        let [open, sealed, ..] = told(&with(room(), &[wall(0, 0.1, [0.0; 2], [0.1 - short_m, 0.1])]));
        assert_eq!([open, sealed], [1, 0], "{short_m}");
        let [open, sealed, ..] = told(&with(room(), &[wall(0, 0.1, [0.0; 2], [0.1 + short_m, 0.1])]));
        assert_eq!([open, sealed], [1, 0], "{short_m}");
    }
    assert_eq!(told(&[wall(0, 0.1, [0.0; 2], [0.1; 2])]), [1, 0, 4, 0]);
    // A wall in a skin with a hole where it ends.
    let mut holed = cuboid([0.2, 0.1, 0.1]);
    holed.remove(3);
    holed.extend([wall(1, 0.1, [0.0, 0.0], [0.1, 0.08]), wall(1, 0.1, [0.0, 0.12], [0.1, 0.2])]);
    let [open, ..] = told(&with(holed, &[wall(0, 0.1, [0.0; 2], [0.1; 2])]));
    assert!(open > 0);
    // Sheets upon each other are open together; a sheet's own rim covers nothing.
    let sheet = wall(0, 0.1, [0.0; 2], [0.1; 2]);
    let upon = [[0.1, 0.0, 0.0], [0.1, 0.1, 0.0], [0.1, 0.05, 0.1], [0.1, 0.0, 0.1]];
    let [open, sealed, _, rims] = told(&[sheet, upon]);
    assert!(open > 0 && sealed == 0, "{open} {sealed} {rims}");
    // Boxes side by side without their tops.
    let mut tops = cuboid([0.1; 3]);
    tops.remove(3);
    let [open, sealed, ..] = told(&tops);
    assert_eq!([open, sealed], [1, 0]);
}

/// Rooms of which each face is wound at random.
#[test]
fn rooms_that_share_walls_have_no_open_rims_however_they_are_wound() {
    let mut noise = Noise(3);
    for rooms in [[2, 1, 1], [2, 2, 1], [2, 2, 2], [3, 1, 1], [3, 3, 3]] {
        for _ in 0..10 {
            let mut quads = Vec::new();
            for axis in 0..3 {
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                for (at, p, q) in (0..=rooms[axis])
                    .flat_map(|at| (0..rooms[u]).flat_map(move |p| (0..rooms[v]).map(move |q| (at, p, q))))
                {
                    let [at, p, q] = [at, p, q].map(f64::from);
                    let mut quad =
                        wall(axis, 0.1 * at, [0.1 * p, 0.1 * q], [0.1 * (p + 1.0), 0.1 * (q + 1.0)]);
                    if noise.between(0.0, 1.0) < 0.5 {
                        quad.reverse();
                    }
                    quads.push(quad);
                }
            }
            let [open, _, rims, sealed] = told(&quads);
            assert_eq!((open, sealed), (0, rims), "{rooms:?}");
            // Without a face in a corner of the skin there are rims of its neighbours, and that is told.
            quads.remove(0);
            assert!(told(&quads)[0] > 0, "{rooms:?}");
        }
    }
}

/// Rooms of which each wall is wound at random and some are divided on an edge, turned and moved; and which walls there are.
struct Rooms {
    counts: [i32; 3],
    pose: Isometry3<f64>,
    mesh: Arc<Mesh>,
    report: MeshReport,
}

const ROOM_M: f64 = 0.05;

impl Rooms {
    fn new(counts: [i32; 3], noise: &mut Noise) -> Self {
        let mut turn = || noise.between(-1.0, 1.0);
        let pose = if turn() < 0.0 {
            Isometry3::identity()
        } else {
            let axis = Vector3::new(turn(), turn(), turn()) * 3.0;
            Isometry3::new(Vector3::new(turn(), turn(), turn()) * 0.1, axis)
        };
        let mut soup = TriangleSoup::default();
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for (at, p, q) in (0..=counts[axis])
                .flat_map(|at| (0..counts[u]).flat_map(move |p| (0..counts[v]).map(move |q| (at, p, q))))
            {
                let corner = |du: f64, dv: f64| {
                    let mut place = Vector3::zeros();
                    (place[axis], place[u], place[v]) = (f64::from(at), f64::from(p) + du, f64::from(q) + dv);
                    (pose * nalgebra::Point3::from(place * ROOM_M)).coords
                };
                let mut outline =
                    vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
                if noise.between(0.0, 1.0) < 0.5 {
                    let after = (noise.between(0.0, 4.0) as usize).min(3);
                    outline.insert(after + 1, 0.5 * (outline[after] + outline[(after + 1) % 4]));
                }
                if noise.between(0.0, 1.0) < 0.5 {
                    outline.reverse();
                }
                let first = soup.vertices.len() as u32;
                let corners = outline.len() as u32;
                // From a corner that lies on no straight line with its neighbours.
                let fan = (0..corners).find(|&tip| {
                    let at = |step: u32| outline[((tip + step) % corners) as usize];
                    (1..corners - 1)
                        .all(|step| (at(step) - at(0)).cross(&(at(step + 1) - at(0))).norm() > 1e-6)
                });
                let tip = fan.unwrap();
                soup.faces
                    .extend((1..corners - 1).map(|step| {
                        [tip, tip + step, tip + step + 1].map(|corner| first + corner % corners)
                    }));
                soup.vertices.extend(outline);
            }
        }
        let (mesh, report) = Mesh::build_closing(soup, CloseHoles::UpTo(0.0)).unwrap();
        Self { counts, pose, mesh: Arc::new(mesh), report }
    }

    /// The room in which a place is, in parts of a room; `None` in or near a wall.
    fn room(&self, at_W: &Vector3<f64>) -> Option<[i32; 3]> {
        let at = self.pose.inverse_transform_point(&nalgebra::Point3::from(*at_W)).coords / ROOM_M;
        let is_apart = at.iter().all(|x| (x - x.round()).abs() > 1e-3);
        is_apart.then(|| [0, 1, 2].map(|axis| at[axis].floor() as i32))
    }

    fn place(&self, at: Vector3<f64>) -> Vector3<f64> {
        (self.pose * nalgebra::Point3::from(at * ROOM_M)).coords
    }

    /// Leads a finger through walls, edges and corners; the first room in which its god-object is that is not the first one's.
    fn stray(
        &self,
        from: Vector3<f64>,
        radius_m: f64,
        friction: Friction,
        noise: &mut Noise,
    ) -> Option<String> {
        let entity = touchable(&self.mesh, friction);
        let mut finger = finger(radius_m);
        let mut hip = self.place(from);
        let home = self.room(&hip).unwrap();
        let is_in = |room: [i32; 3]| (0..3).all(|axis| (0..self.counts[axis]).contains(&room[axis]));
        for _ in 0..25 {
            let mut aim = from.map(|_| 0.0);
            for axis in 0..3 {
                let most = f64::from(self.counts[axis]);
                aim[axis] = noise.between(0.0, most);
                if noise.between(0.0, 1.0) < 0.5 {
                    aim[axis] = noise.between(0.0, most).round() + noise.between(-0.1, 0.1);
                }
            }
            let aim = self.place(aim);
            for [at, god] in stroke(&mut finger, &entity, std::mem::replace(&mut hip, aim), aim) {
                let strays = |room: [i32; 3]| room != home && (is_in(home) || is_in(room));
                if let Some(room) = self.room(&god).filter(|room| strays(*room)) {
                    return Some(format!("{home:?} -> {room:?}, {god:?} of {at:?}"));
                }
            }
        }
        None
    }
}

/// A finger in a room of those, or outside of them all, that is pressed into walls, edges and corners.
#[test]
fn out_of_rooms_that_share_walls_no_finger_gets_however_they_are_wound() {
    let rounds = if cfg!(debug_assertions) { 30 } else { 300 };
    let mut noise = Noise(21);
    let (mut strayed, mut tried) = (Vec::new(), 0);
    for round in 0..rounds {
        let counts = [[2, 1, 1], [2, 2, 1], [2, 2, 2], [3, 1, 1]][round % 4];
        let rooms = Rooms::new(counts, &mut noise);
        assert_eq!(rooms.report.open_parts.count, 0, "{}", rooms.report);
        // What is found inside of a solid is let out.
        let inside = (!rooms.mesh.has_inside()).then(|| Vector3::new(0.4, 0.5, 0.6));
        for from in inside.into_iter().chain([Vector3::new(-0.6, 0.3, 0.4)]) {
            for friction in [Friction::None, Friction::coulomb(0.4).unwrap()] {
                tried += 1;
                let stray = rooms.stray(from, 0.0, friction, &mut noise);
                strayed.extend(stray.map(|stray| format!("{round} {counts:?}: {stray}\n{}", rooms.report)));
            }
        }
    }
    assert!(strayed.is_empty(), "{} of {tried} strayed: {}", strayed.len(), strayed[0]);
}

/// Two rooms that touch along an edge, felt from within: neighbours there are faces of both.
#[test]
fn out_of_hollow_rooms_that_touch_along_an_edge_no_finger_gets() {
    let pose = Isometry3::new(Vector3::new(0.01, 0.02, -0.03), Vector3::new(0.3, -0.5, 0.7));
    let at = |at: [f64; 3]| (pose * nalgebra::Point3::from(at)).coords;
    let beside = |quad: Quad| quad.map(|[x, y, z]| [x + 0.1, y + 0.1, z]);
    let mut soup =
        soup(&with(cuboid([0.1; 3]), &cuboid([0.1; 3]).into_iter().map(beside).collect::<Vec<_>>()));
    soup.vertices.iter_mut().for_each(|vertex| *vertex = at((*vertex).into()));
    let (mesh, report) = Mesh::build(soup).unwrap();
    assert_eq!((report.touching_edges.count, mesh.has_inside()), (1, true));
    let entity = touchable(&Arc::new(mesh.into_sheet()), Friction::None);
    let mut noise = Noise(5);
    for round in 0..200 {
        let mut finger = finger(0.0);
        let mut hip = at([0.05; 3]);
        step(&mut finger, &entity, &hip);
        for _ in 0..10 {
            let aim = at([0.1, 0.1, 0.05].map(|at| at + noise.between(-0.02, 0.02)));
            for [_, god] in stroke(&mut finger, &entity, std::mem::replace(&mut hip, aim), aim) {
                let in_room = pose.inverse_transform_point(&nalgebra::Point3::from(god));
                assert!(in_room.iter().all(|x| (-1e-9..0.1 + 1e-9).contains(x)), "{round}: {in_room}");
            }
        }
    }
}

/// A wall that ends a little above the floor, by what files round its corners by, is sealed, and nothing gets below it.
#[test]
fn below_a_wall_that_is_short_by_a_rounding_no_finger_gets() {
    let mut noise = Noise(4);
    for round in 0..60 {
        let gap_m = [0.0, 1e-13, 1e-11, 1e-9, 1e-8][round % 5];
        let mut turn = || noise.between(-1.0, 1.0);
        let pose = Isometry3::new(
            Vector3::new(turn(), turn(), turn()) * 0.02,
            Vector3::new(turn(), turn(), turn()) * 3.0,
        );
        let at = |at: [f64; 3]| (pose * nalgebra::Point3::from(at)).coords;
        // A floor, and a bell of five walls upon it.
        let mut bell: Vec<Quad> = cuboid([0.1, 0.08, 0.08])
            .into_iter()
            .enumerate()
            .filter(|(side, _)| *side != 2)
            .map(|(_, quad)| quad)
            .collect();
        for corner in bell.as_flattened_mut() {
            *corner = [corner[0] - 0.05, corner[1] + gap_m, corner[2] - 0.04];
        }
        let floor = [[-0.15, 0.0, -0.15], [-0.15, 0.0, 0.15], [0.15, 0.0, 0.15], [0.15, 0.0, -0.15]];
        let mut all = soup(&with(bell, &[floor]));
        all.vertices.iter_mut().for_each(|vertex| *vertex = at((*vertex).into()));
        let (mesh, report) = Mesh::build_closing(all, CloseHoles::UpTo(0.0)).unwrap();
        assert_eq!((report.sealed_parts.count, report.open_parts.count), (1, 1), "{gap_m}: {report}");
        let entity = touchable(&Arc::new(mesh), Friction::None);
        // Within the bell or beside it; pressed into floor and wall.
        let side = if round % 2 == 0 { 1.0 } else { -1.0 };
        let mut finger = finger(0.0);
        let mut hip = at([0.05 + 0.02 * side, 0.02, 0.0]);
        step(&mut finger, &entity, &hip);
        for _ in 0..20 {
            let aim = at([
                0.05 + side * noise.between(-0.02, 0.004),
                noise.between(-0.02, 0.004),
                noise.between(-0.03, 0.03),
            ]);
            for [at, god] in stroke(&mut finger, &entity, std::mem::replace(&mut hip, aim), aim) {
                let place = pose.inverse_transform_point(&nalgebra::Point3::from(god));
                let is_beside = side * (place.x - 0.05) > -1e-6 && place.y > -1e-6;
                assert!(is_beside, "{round}, {gap_m}: {place} of {at}");
            }
        }
    }
}

/// Whoever made a wall that is short by more than a rounding learns by how much, and where.
#[test]
fn a_wall_that_ends_before_a_floor_is_told_with_its_gap() {
    let mut noise = Noise(9);
    for round in 0..40 {
        let gap_m = [1e-6, 2e-5, 1e-4, 9e-4][round % 4];
        let mut turn = || noise.between(-1.0, 1.0);
        let pose = Isometry3::new(
            Vector3::new(turn(), turn(), turn()) * 0.02,
            Vector3::new(turn(), turn(), turn()) * 3.0,
        );
        let mut bell: Vec<Quad> = cuboid([0.1, 0.08, 0.08])
            .into_iter()
            .enumerate()
            .filter(|(side, _)| *side != 2)
            .map(|(_, quad)| quad)
            .collect();
        for corner in bell.as_flattened_mut() {
            *corner = [corner[0] - 0.05, corner[1] + gap_m, corner[2] - 0.04];
        }
        let floor = [[-0.15, 0.0, -0.15], [-0.15, 0.0, 0.15], [0.15, 0.0, 0.15], [0.15, 0.0, -0.15]];
        let mut all = soup(&with(bell, &[floor]));
        let at = |at: Vector3<f64>| (pose * nalgebra::Point3::from(at)).coords;
        all.vertices.iter_mut().for_each(|vertex| *vertex = at(*vertex));
        let (_, report) = Mesh::build_closing(all, CloseHoles::UpTo(0.0)).unwrap();
        let told = report.short_rims;
        assert_eq!(told.edges, 4, "{gap_m}: {report}");
        assert!((told.widest_m - gap_m).abs() < 1e-6 * gap_m + 1e-15, "{gap_m}: {report}");
        let there = pose.inverse_transform_point(&nalgebra::Point3::from(told.widest_B));
        assert!(
            (there.y - gap_m).abs() < 1e-12 && there.x.abs() < 0.0501 && there.z.abs() < 0.0401,
            "{there}"
        );
        let words = report.to_string();
        assert!(words.contains("4 edges of open rims end before another part, up to "), "{words}");
    }
    // What is far from everything, and what lies upon it, is no gap.
    for gap_m in [0.0, 0.02] {
        let mut bell: Vec<Quad> = cuboid([0.1, 0.08, 0.08])[..].to_vec();
        bell.remove(2);
        bell.iter_mut().flatten().for_each(|corner| corner[1] += gap_m);
        let floor = [[-0.15, 0.0, -0.15], [-0.15, 0.0, 0.15], [0.15, 0.0, 0.15], [0.15, 0.0, -0.15]];
        let (_, report) = Mesh::build_closing(soup(&with(bell, &[floor])), CloseHoles::UpTo(0.0)).unwrap();
        assert_eq!(report.short_rims.edges, 0, "{gap_m}: {report}");
    }
}
