//! Open parts whose rims lie on other faces, and those that only look so.

use crate::common::*;
use haptics::mesh::{CloseHoles, Mesh, MeshReport, TriangleSoup};
use nalgebra::Vector3;

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
    assert_eq!(report.sheets.count, report.open_parts.count + report.sealed_parts.count);
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
    // Short on one side, by a nanometre and more; and beyond the skin.
    for short_m in [1e-9, 1e-6, 0.02] {
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
