//! Meshes as scans, artists and converters leave them: folds, slivers, narrow slots, parts that overlap, rims.
#![allow(dead_code, non_snake_case)]

use haptics::mesh::{TriangleSoup, make};
use nalgebra::{Rotation3, Vector3};

use crate::common::Noise;
use crate::common::meshes::{icosphere, unit_vector};

/// One of each kind, all of about the size of a hand; another seed makes others.
pub(crate) fn all(seed: u64) -> Vec<(&'static str, TriangleSoup)> {
    let mut noise = Noise(seed);
    vec![
        ("crumpled ball", crumpled(&mut noise, 2, 8e-3)),
        ("noisy scan", crumpled(&mut noise, 4, 5e-4)),
        ("scan with holes", with_holes(&mut noise, 40)),
        ("heap of boxes", heap(&mut noise, 25)),
        ("slotted block", slotted(&mut noise)),
        ("slivers", slivers(&mut noise)),
        ("folded fans", folded(&mut noise)),
        ("crossed boxes", crossed(&mut noise)),
    ]
}

/// A ball whose vertices went astray by about this much: where that is more than an edge, it folds and passes through itself.
pub(crate) fn crumpled(noise: &mut Noise, subdivisions: u32, by_m: f64) -> TriangleSoup {
    let mut soup = icosphere(subdivisions, 0.05);
    soup.vertices.iter_mut().for_each(|v| *v += noise.vector(by_m));
    soup
}

fn with_holes(noise: &mut Noise, holes: usize) -> TriangleSoup {
    let mut soup = crumpled(noise, 3, 1e-3);
    for _ in 0..holes {
        let at = (noise.uniform() * soup.faces.len() as f64) as usize;
        soup.faces.swap_remove(at.min(soup.faces.len() - 1));
    }
    soup
}

/// Boxes from slabs to cubes, each a closed part, thrown together.
fn heap(noise: &mut Noise, boxes: usize) -> TriangleSoup {
    together(noise, boxes, |noise| {
        let part = make::cuboid([0.0; 3].map(|_| 10f64.powf(noise.between(-3.0, -1.3))));
        let turn = Rotation3::new(noise.vector(2.0));
        (part, turn, unit_vector(noise) * noise.between(0.0, 0.04))
    })
}

/// Closed parts that overlap, as artists put them together: boxes, tubes, balls as scanners see them.
pub(crate) fn overlapping(noise: &mut Noise, parts: usize) -> TriangleSoup {
    together(noise, parts, |noise| {
        let part = match (noise.uniform() * 4.0) as u32 {
            0 => tube(noise.between(0.005, 0.03), noise.between(0.01, 0.08)),
            1 => {
                let by_m = 10f64.powf(noise.between(-4.0, -2.3));
                crumpled(noise, 2, by_m)
            }
            _ => make::cuboid([0.0; 3].map(|_| noise.between(0.01, 0.06))),
        };
        (part, Rotation3::new(noise.vector(1.0)), noise.vector(0.02))
    })
}

fn tube(radius_m: f64, length_m: f64) -> TriangleSoup {
    make::star(12, radius_m, radius_m, length_m)
}

/// A few blocks that go deep through each other, as machine parts that nobody joined.
fn crossed(noise: &mut Noise) -> TriangleSoup {
    together(noise, 6, |noise| {
        let part = make::cuboid([0.0; 3].map(|_| noise.between(0.01, 0.06)));
        (part, Rotation3::new(noise.vector(1.0)), noise.vector(0.02))
    })
}

fn together(
    noise: &mut Noise,
    parts: usize,
    mut part: impl FnMut(&mut Noise) -> (TriangleSoup, Rotation3<f64>, Vector3<f64>),
) -> TriangleSoup {
    let mut soup = TriangleSoup { vertices: Vec::new(), faces: Vec::new() };
    for _ in 0..parts {
        let (part, turn, middle) = part(noise);
        let first = soup.vertices.len() as u32;
        soup.vertices.extend(part.vertices.iter().map(|v| turn * v + middle));
        soup.faces.extend(part.faces.iter().map(|face| face.map(|v| v + first)));
    }
    soup
}

/// A block with slots from 0.1 to 3 mm wide between teeth, as machined parts have; one outline, extruded.
fn slotted(noise: &mut Noise) -> TriangleSoup {
    let mut soup = TriangleSoup { vertices: Vec::new(), faces: Vec::new() };
    let mut x = -0.05;
    let half_z = 0.02;
    // Columns of quads, each with its own heights at both sides: a height that differs makes a wall.
    let mut columns: Vec<(f64, f64, f64)> = Vec::new();
    while x < 0.05 {
        let (tooth, slot) = (noise.between(5e-4, 6e-3), 10f64.powf(noise.between(-4.0, -2.5)));
        columns.push((x, x + tooth, 0.03));
        columns.push((x + tooth, x + tooth + slot, noise.between(0.0, 0.02)));
        x += tooth + slot;
    }
    let last = columns.last().map_or(x, |column| column.1);
    columns.push((last, last + 2e-3, 0.03));
    let mut outline: Vec<[f64; 2]> = Vec::new();
    for (from, to, height) in &columns {
        outline.extend([[*from, *height], [*to, *height]]);
    }
    let floor = -0.01;
    outline.insert(0, [-0.05, floor]);
    outline.push([last + 2e-3, floor]);
    // Each column is a quad down to the floor, on both ends; their sides meet only in part, as T-junctions do.
    let mut point = |x: f64, y: f64, z: f64| {
        soup.vertices.push(Vector3::new(x, y, z));
        soup.vertices.len() as u32 - 1
    };
    let mut faces: Vec<[u32; 3]> = Vec::new();
    let mut quad = |a: u32, b: u32, c: u32, d: u32| faces.extend([[a, b, c], [a, c, d]]);
    for pair in outline.windows(2) {
        let ([x0, y0], [x1, y1]) = (pair[0], pair[1]);
        // The top or the wall.
        let (a, b) = (point(x0, y0, half_z), point(x1, y1, half_z));
        let (c, d) = (point(x1, y1, -half_z), point(x0, y0, -half_z));
        quad(a, b, c, d);
        if x1 > x0 {
            for (z, is_front) in [(half_z, true), (-half_z, false)] {
                let corners = [point(x0, floor, z), point(x1, floor, z), point(x1, y1, z), point(x0, y0, z)];
                let [a, b, c, d] = corners;
                if is_front { quad(a, b, c, d) } else { quad(a, d, c, b) }
            }
            let (a, b) = (point(x0, floor, -half_z), point(x1, floor, -half_z));
            let (c, d) = (point(x1, floor, half_z), point(x0, floor, half_z));
            quad(a, b, c, d);
        }
    }
    soup.faces = faces;
    soup
}

/// A barrel of needles: neighbouring faces are between nearly parallel and nearly opposite.
fn slivers(noise: &mut Noise) -> TriangleSoup {
    let mut soup = make::uv_sphere(300, 5, 0.05);
    soup.vertices.iter_mut().for_each(|v| *v += noise.vector(1e-6));
    soup
}

/// Octahedra of which one corner was pushed through the opposite side: fans of four faces that are folded.
fn folded(noise: &mut Noise) -> TriangleSoup {
    let mut soup = TriangleSoup { vertices: Vec::new(), faces: Vec::new() };
    for _ in 0..12 {
        let middle = unit_vector(noise) * noise.between(0.0, 0.05);
        let turn = Rotation3::new(noise.vector(2.0));
        let first = soup.vertices.len() as u32;
        let side = |i: usize, s: f64| turn * (Vector3::ith(i, s) * 0.012) + middle;
        let mut corners =
            [side(0, 1.0), side(1, 1.0), side(0, -1.0), side(1, -1.0), side(2, 1.0), side(2, -1.0)];
        corners[4] =
            turn * Vector3::new(noise.between(-0.03, 0.03), noise.between(-0.03, 0.03), -0.02) + middle;
        soup.vertices.extend(corners);
        for i in 0..4_u32 {
            let j = (i + 1) % 4;
            soup.faces.extend([[i, j, 4], [j, i, 5]].map(|face| face.map(|v| v + first)));
        }
    }
    soup
}
