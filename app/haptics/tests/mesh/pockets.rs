//! Pockets of surfaces that are turned inside out, and fans that go through themselves: no point is caught in them.
#![allow(non_snake_case)]

use crate::common::meshes::*;
use crate::common::{ugly, *};
use crate::mesh_oracle::{corners, distance};
use haptics::mesh::{Mesh, TriangleSoup};
use haptics::{Entity, Friction};
use nalgebra::Vector3;
use std::sync::Arc;

/// A fine ball of which single vertices are drawn along it, past their neighbours.
fn few_folds(noise: &mut Noise) -> TriangleSoup {
    let mut soup = icosphere(4, 0.05);
    for _ in 0..200 {
        let at = (noise.uniform() * soup.vertices.len() as f64) as usize;
        let vertex = &mut soup.vertices[at];
        let (out, way) = (vertex.normalize(), noise.vector(8e-3));
        *vertex += way - out * (0.9 * out.dot(&way));
    }
    soup
}

/// From afar onto a face, into it, twice along, and away.
fn stroke(mesh: &Mesh, noise: &mut Noise) -> Vec<Vector3<f64>> {
    let face = (noise.uniform() * mesh.faces().len() as f64) as usize;
    let normal = mesh.faces()[face].normal_B;
    let middle = corners(mesh, face).iter().sum::<Vector3<f64>>() / 3.0;
    let side = unit_vector(noise);
    let along = (side - normal * normal.dot(&side)).normalize();
    let mut places = vec![
        middle.normalize() * 0.15 + noise.vector(0.01),
        middle + normal * 1e-3,
        middle - normal * noise.between(5e-4, 3e-3),
    ];
    for _ in 0..2 {
        let last = places[places.len() - 1];
        places.push(last + along * noise.between(0.0, 0.03) + noise.vector(3e-3));
    }
    places.push(unit_vector(noise) * 0.2);
    places.windows(2).flat_map(|ends| steps(ends[0], ends[1])).collect()
}

fn steps(from: Vector3<f64>, to: Vector3<f64>) -> impl Iterator<Item = Vector3<f64>> {
    let ticks = ((to - from).norm() / 2e-4).ceil().max(1.0) as u32;
    (1..=ticks).map(move |tick| from + (to - from) * (f64::from(tick) / f64::from(ticks)))
}

/// A finger is held at the end, far away; and the largest depth inside at which it was not felt.
fn felt(mesh: &Mesh, entity: &Entity, radius_m: f64, hips: &[Vector3<f64>]) -> (bool, f64) {
    let (mut finger, mut is_held, mut unfelt_m) = (finger(radius_m), false, 0.0_f64);
    for hip in hips {
        is_held = step(&mut finger, entity, hip).entity.is_some();
        // What is let go within is found in the next tick.
        if !is_held && mesh.is_inside(hip) {
            unfelt_m = unfelt_m.max(distance(mesh, hip));
        }
    }
    (is_held, unfelt_m)
}

/// A fold that holds a point at the end of a stroke holds a ball, too, that fits into it.
fn stroke_over(name: &str, soup: TriangleSoup, strokes: usize, noise: &mut Noise) {
    let mesh = Arc::new(Mesh::build(soup).unwrap().0);
    let entity = touchable(&mesh, Friction::None);
    for number in 0..strokes {
        let hips = stroke(&mesh, noise);
        let (is_held, unfelt_m) = felt(&mesh, &entity, 0.0, &hips);
        assert!(unfelt_m < 1e-5, "{name}, stroke {number}: {unfelt_m} m inside and not felt");
        let is_caught = is_held && !felt(&mesh, &entity, 1e-5, &hips).0;
        assert!(!is_caught, "{name}, stroke {number}: held where a ball of 10 um is free");
    }
}

#[test]
fn a_point_is_held_at_the_end_of_a_stroke_over_folds_only_where_a_ball_is() {
    let (seeds, strokes) = if cfg!(debug_assertions) { (3, 30) } else { (25, 200) };
    for seed in 1..=seeds {
        let mut noise = Noise(seed);
        let names = ["crumpled ball", "folded fans", "scan with holes"];
        for (name, soup) in ugly::all(seed).into_iter().filter(|(name, _)| names.contains(name)) {
            stroke_over(name, soup, strokes, &mut noise);
        }
        for (name, by_m, subdivisions) in [("coarse folds", 8e-3, 3), ("fine folds", 3e-3, 4)] {
            let mut soup = icosphere(subdivisions, 0.05);
            soup.vertices.iter_mut().for_each(|vertex| *vertex += noise.vector(by_m));
            stroke_over(name, soup, strokes, &mut noise);
        }
        stroke_over("few folds", few_folds(&mut noise), strokes, &mut noise);
    }
}

/// A prism over an eight, of which one loop is turned inside out.
#[test]
fn into_the_inverted_loop_of_an_eight_no_point_gets() {
    let outline = [[0.0, 0.0], [0.1, 0.06], [0.1, 0.0], [0.0, 0.1]];
    let mut soup = TriangleSoup::default();
    soup.vertices.extend(outline.iter().flat_map(|[x, y]| [0.0, 0.1].map(|z| Vector3::new(*x, *y, z))));
    soup.faces.extend((0..4_u32).flat_map(|at| {
        let [a, b] = [2 * at, 2 * ((at + 1) % 4)];
        [[a, b, b + 1], [a, b + 1, a + 1]]
    }));
    soup.faces.extend([[0, 4, 2], [0, 6, 4], [1, 3, 5], [1, 5, 7]]);
    let (mesh, _) = Mesh::build(soup).unwrap();
    assert!(mesh.has_inside() && mesh.point_radius_m() > 0.0);
    let entity = touchable(&Arc::new(mesh), Friction::None);
    // Into each of its loops, by the two walls and from above.
    for (from, to) in [
        ([0.13, 0.025, 0.05], [0.085, 0.025, 0.05]),
        ([0.08, -0.03, 0.05], [0.085, 0.03, 0.05]),
        ([0.085, 0.03, 0.13], [0.085, 0.03, 0.09]),
        ([-0.03, 0.06, 0.05], [0.01, 0.06, 0.05]),
        ([0.02, 0.06, 0.13], [0.01, 0.05, 0.09]),
    ] {
        let [from, to] = [from, to].map(Vector3::from);
        let mut finger = finger(0.0);
        step(&mut finger, &entity, &from);
        let out = steps(from, to).map(|hip| step(&mut finger, &entity, &hip)).last().unwrap();
        assert!(out.force_on_user_W.norm() > K * 5e-3, "{from:?} {to:?}: {out:?}");
        let out = steps(to, from).map(|hip| step(&mut finger, &entity, &hip)).last().unwrap();
        assert_eq!(out.entity, None, "{from:?} {to:?}: {out:?}");
    }
}

/// Limbs that only go into each other are walked over.
#[test]
fn what_overlaps_without_a_pocket_is_walked_over() {
    let soups =
        ugly::all(1).into_iter().filter(|(name, _)| ["heap of boxes", "crossed boxes"].contains(name));
    for (name, soup) in soups {
        let (mesh, report) = Mesh::build(soup).unwrap();
        assert!(report.crossed > 0 && mesh.point_radius_m() == 0.0, "{name}");
    }
    // One surface, as an artist joins a limb: a bent prism whose end is in its own middle.
    let outline = [
        [[0.0, 0.0], [0.02, 0.0]],
        [[0.0, 0.1], [0.02, 0.08]],
        [[0.1, 0.1], [0.08, 0.08]],
        [[0.1, 0.0], [0.08, 0.02]],
        [[-0.03, 0.0], [-0.03, 0.02]],
    ];
    let mut soup = TriangleSoup::default();
    let places =
        |[x, y]: [f64; 2], taper: f64| [0.0, 0.02].map(|z| Vector3::new(x, y, 0.01 + (z - 0.01) * taper));
    for (number, ends) in outline.into_iter().enumerate() {
        let taper = 1.0 - 0.15 * number as f64;
        soup.vertices.extend(ends.into_iter().flat_map(|end| places(end, taper)));
    }
    // Outer low, outer high, inner low, inner high.
    for at in 0..4_u32 {
        let [a, b] = [4 * at, 4 * (at + 1)];
        let sides = [
            [a, a + 1, b + 1, b],
            [b + 2, b + 3, a + 3, a + 2],
            [a + 1, a + 3, b + 3, b + 1],
            [a, b, b + 2, a + 2],
        ];
        soup.faces.extend(sides.into_iter().flat_map(|[p, q, r, s]| [[p, q, r], [p, r, s]]));
    }
    soup.faces.extend([[0, 2, 3], [0, 3, 1], [16, 19, 18], [16, 17, 19]]);
    let (mesh, report) = Mesh::build(soup).unwrap();
    assert!(mesh.has_inside() && report.crossed > 0, "{report}");
    assert_eq!((report.components, mesh.point_radius_m()), (1, 0.0), "{report}");
}

/// Ways of this length from a place of the surface that stay outside and come nearer to the hand, of 20,000.
fn ways_on(mesh: &Mesh, from: &Vector3<f64>, hip: &Vector3<f64>, length_m: f64, noise: &mut Noise) -> usize {
    let is_outside = |place: Vector3<f64>| !mesh.is_inside(&place) && distance(mesh, &place) > 1e-12;
    let leads_on = |way: &Vector3<f64>| {
        (from + way - hip).norm() < (from - hip).norm() - 1e-3 * length_m
            && [1.0, 0.9, 0.7, 0.5, 0.3, 0.1].into_iter().all(|share| is_outside(from + way * share))
    };
    (0..20_000).map(|_| unit_vector(noise) * length_m).filter(leads_on).count()
}

/// Boxes, tubes and rugged balls through each other. A point that is held where a ball of 10 um is free is so because its way was
/// another one; at a corner of three faces it had been held although a fold led on.
#[test]
fn over_parts_that_overlap_a_point_is_held_only_where_nothing_leads_on() {
    let seeds = if cfg!(debug_assertions) { 91..92 } else { 85..125 };
    for seed in seeds {
        let mut noise = Noise(seed * 10 + 2);
        let mesh = Arc::new(Mesh::build(ugly::overlapping(&mut noise, 10)).unwrap().0);
        let entity = touchable(&mesh, Friction::None);
        for number in 0..if cfg!(debug_assertions) { 2 } else { 60 } {
            let hips = stroke(&mesh, &mut noise);
            if !felt(&mesh, &entity, 0.0, &hips).0 || felt(&mesh, &entity, 1e-5, &hips).0 {
                continue;
            }
            let mut finger = finger(0.0);
            hips.iter().for_each(|hip| {
                step(&mut finger, &entity, hip);
            });
            let (at, end) = (finger.contact(0).unwrap().god_object_W, hips[hips.len() - 1]);
            let mut others = Noise(seed);
            let ways = [1e-7, 1e-6, 1e-5].map(|length_m| ways_on(&mesh, &at, &end, length_m, &mut others));
            assert!(ways.contains(&0), "seed {seed}, stroke {number}: {ways:?} ways on from {at}");
        }
    }
}
