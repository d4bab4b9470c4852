//! The triangles of every shape that can be felt.

use crate::solids;
use crate::triangles::{Ring, Triangles};
use haptics::Shape;
use haptics::mesh::CornerUv;
use nalgebra::{Point3, UnitQuaternion, Vector3};
use std::f64::consts::{PI, TAU};
use world::ShapeSpec;

/// How far a plane is drawn to each side (m).
pub const PLANE_REACH_M: f64 = 0.5;
/// Corners around an axis, and from pole to pole.
const AROUND: u32 = 48;
const ACROSS: u32 = 24;
/// Steps along each side of a patch.
const PATCH_STEPS: u32 = 24;
/// Two faces of a mesh that meet at a smaller angle look smooth (rad).
const CREASE_RAD: f64 = 0.7;

/// What a shape looks like, in its own frame. `model`: the shape that can be felt, which has what lies in files.
///
/// `None`: it is in a file, and there is no model.
pub fn triangles(spec: &ShapeSpec, model: Option<&Shape>) -> Option<Triangles> {
    Some(match spec {
        ShapeSpec::Plane { normal, offset_m } => plane(normal, *offset_m),
        ShapeSpec::Box { size_m } => cuboid((*size_m).into()),
        ShapeSpec::Sphere { radius_m } => capsule(*radius_m, 0.0),
        ShapeSpec::Ellipsoid { radii_m } => capsule(1.0, 0.0).scaled(&(*radii_m).into()),
        ShapeSpec::Capsule { radius_m, length_m } => capsule(*radius_m, *length_m),
        ShapeSpec::Cylinder { radius_m, length_m } => frustum([*radius_m; 2], *length_m),
        ShapeSpec::Cone { radius_bottom_m, radius_top_m, length_m } => {
            frustum([*radius_bottom_m, *radius_top_m], *length_m)
        }
        ShapeSpec::Torus { ring_radius_m, tube_radius_m } => torus(*ring_radius_m, *tube_radius_m),
        // A model has its scale.
        ShapeSpec::Scaled { shape, scale } if spec.is_closed_form() => {
            triangles(shape, None)?.scaled(&(*scale).into())
        }
        _ => modelled(model?)?,
    })
}

fn modelled(shape: &Shape) -> Option<Triangles> {
    match shape {
        Shape::Mesh(mesh) => {
            let faces: Vec<[u32; 3]> = mesh.faces().iter().map(|face| face.vertices).collect();
            Some(smooth(mesh.vertices(), &faces, &[]))
        }
        Shape::Nurbs(nurbs) => Some(patches(nurbs)),
        Shape::Csg(csg) => Some(solids::triangles(csg)),
        _ => None,
    }
}

fn plane(normal: &Vector3<f64>, offset_m: f64) -> Triangles {
    let turned = UnitQuaternion::rotation_between(&Vector3::y(), normal)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), PI));
    let corner = |x, z| Point3::from(turned * (PLANE_REACH_M * Vector3::new(x, 0.0, z)) + offset_m * normal);
    let mut made = Triangles::default();
    made.add_flat(&[corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)], *normal);
    made
}

fn cuboid(size: Vector3<f64>) -> Triangles {
    let mut made = Triangles::default();
    for axis in 0..3 {
        for side in [-0.5, 0.5] {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let corner = |at_u: f64, at_v: f64| {
                let mut place = Vector3::zeros();
                (place[axis], place[u], place[v]) = (side, at_u * side, at_v);
                Point3::from(place.component_mul(&size))
            };
            let normal = Vector3::ith(axis, 2.0 * side);
            made.add_flat(
                &[corner(-1.0, -0.5), corner(1.0, -0.5), corner(1.0, 0.5), corner(-1.0, 0.5)],
                normal,
            );
        }
    }
    made
}

fn capsule(radius_m: f64, length_m: f64) -> Triangles {
    let half = 0.5 * length_m;
    let ring = |step: u32, up: f64| {
        let (sin, cos) = (PI * (f64::from(step) / f64::from(ACROSS) - 0.5)).sin_cos();
        Ring { place: [radius_m * cos, radius_m * sin + up], normal: [cos, sin] }
    };
    let lower = (0..=ACROSS / 2).map(|step| ring(step, -half));
    let upper = (ACROSS / 2..=ACROSS).map(|step| ring(step, half));
    Triangles::revolved(&lower.chain(upper).collect::<Vec<_>>(), AROUND)
}

fn frustum(radii_m: [f64; 2], length_m: f64) -> Triangles {
    let [bottom, top] = radii_m;
    let half = 0.5 * length_m;
    let slant = Vector3::new(length_m, bottom - top, 0.0).normalize();
    let side = [slant.x, slant.y];
    let rings = [
        Ring { place: [0.0, -half], normal: [0.0, -1.0] },
        Ring { place: [bottom, -half], normal: [0.0, -1.0] },
        Ring { place: [bottom, -half], normal: side },
        Ring { place: [top, half], normal: side },
        Ring { place: [top, half], normal: [0.0, 1.0] },
        Ring { place: [0.0, half], normal: [0.0, 1.0] },
    ];
    Triangles::revolved(&rings, AROUND)
}

fn torus(ring_m: f64, tube_m: f64) -> Triangles {
    let ring = |step: u32| {
        let (sin, cos) = (TAU * f64::from(step) / f64::from(AROUND)).sin_cos();
        Ring { place: [ring_m + tube_m * cos, tube_m * sin], normal: [cos, sin] }
    };
    Triangles::revolved(&(0..=AROUND).map(ring).collect::<Vec<_>>(), AROUND)
}

/// Smooth where faces meet at a small angle; sharp edges stay sharp.
///
/// `uv`: where the corners of each face are on a texture, or nothing.
pub(crate) fn smooth(vertices: &[Vector3<f64>], faces: &[[u32; 3]], uv: &[CornerUv]) -> Triangles {
    let normal_of = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|vertex| vertices[vertex as usize]);
        (b - a).cross(&(c - a))
    };
    let mut around: Vec<Vec<Vector3<f64>>> = vec![Vec::new(); vertices.len()];
    for face in faces {
        let weighted = normal_of(face);
        face.iter().for_each(|vertex| around[*vertex as usize].push(weighted));
    }
    let (mut made, least_cos) = (Triangles::default(), CREASE_RAD.cos());
    for (index, face) in faces.iter().enumerate() {
        // What has no area is not seen.
        let Some(own) = normal_of(face).try_normalize(0.0) else { continue };
        let first = made.places.len() as u32;
        for vertex in face {
            let alike = |other: &&Vector3<f64>| other.dot(&own) >= least_cos * other.norm();
            let sum: Vector3<f64> = around[*vertex as usize].iter().filter(alike).sum();
            made.places.push(vertices[*vertex as usize].into());
            made.normals.push(sum.try_normalize(0.0).unwrap_or(own));
        }
        made.corners.push([first, first + 1, first + 2]);
        made.uv.extend(uv.get(index).into_iter().flatten());
    }
    made
}

fn patches(nurbs: &haptics::Nurbs) -> Triangles {
    let mut made = Triangles::default();
    let step = |k: u32| f64::from(k) / f64::from(PATCH_STEPS);
    for part in 0..nurbs.parts() {
        let mut patch = Triangles::default();
        for i in 0..=PATCH_STEPS {
            for j in 0..=PATCH_STEPS {
                let (place, normal) = nurbs.at(part, step(i), step(j));
                patch.places.push(place.into());
                patch.normals.push(normal);
            }
        }
        patch.grid(PATCH_STEPS + 1, PATCH_STEPS + 1);
        let first = made.places.len() as u32;
        patch.corners.iter_mut().flatten().for_each(|corner| *corner += first);
        made.places.append(&mut patch.places);
        made.normals.append(&mut patch.normals);
        made.corners.append(&mut patch.corners);
    }
    made.corners.iter_mut().for_each(|corners| {
        // Parameters may run either way around the normal.
        let [a, b, c] = corners.map(|corner| made.places[corner as usize].coords);
        let outward: Vector3<f64> = corners.iter().map(|corner| made.normals[*corner as usize]).sum();
        if (b - a).cross(&(c - a)).dot(&outward) < 0.0 {
            corners.swap(1, 2);
        }
    });
    made
}
