//! Takes a tree apart into patches and a postfix program.
//!
//! Problem: two boxes side by side share a plane, whichever poses and sizes its numbers came from. Taken as two planes
//! a rounding apart, the seam between the boxes would be a slit, and their common top would have a step.
//!
//! Model: patches whose levels agree at a few points all over the solid are one; planes also if they face each other.

use nalgebra::{Isometry3, Matrix3, Vector3};

use super::curved::{Curved, RIGID};
use super::kind::Kind;
use super::patch::Patch;
use super::tree::{CsgError, CsgPart, CsgTree, MAX_DEPTH, MAX_LEAVES, PartShape};
use super::{Item, Step};
use crate::capsule::Capsule;
use crate::cuboid::Cuboid;
use crate::cylinder::Cylinder;
use crate::ellipsoid::Ellipsoid;
use crate::error::above_zero;
use crate::shape::Form;

/// What a tree becomes.
pub(super) struct Flat {
    pub(super) patches: Box<[Patch]>,
    pub(super) items: Box<[Item]>,
    pub(super) steps: Box<[Step]>,
    pub(super) extent_m: f64,
}

/// `p_B = map * p_L + shift`.
#[derive(Clone, Copy)]
struct Map {
    map: Matrix3<f64>,
    shift_B: Vector3<f64>,
}

/// Its parts; the extent is at least so much (m).
pub(super) fn flatten(tree: &CsgTree, least_m: f64) -> Result<Flat, CsgError> {
    let mut flattening = Flattening { extent_m: least_m, ..Flattening::default() };
    let everything = Map { map: Matrix3::identity(), shift_B: Vector3::zeros() };
    flattening.tree(tree, &everything, 1)?;
    let extent_m = if flattening.extent_m > 0.0 { flattening.extent_m } else { 1.0 };
    let (patches, items) = without_doubles(&flattening.patches, extent_m);
    Ok(Flat { patches, items, steps: flattening.steps.into(), extent_m })
}

#[derive(Default)]
struct Flattening {
    /// One for each item.
    patches: Vec<Patch>,
    steps: Vec<Step>,
    leaves: usize,
    extent_m: f64,
}

impl Flattening {
    fn tree(&mut self, tree: &CsgTree, map: &Map, depth: usize) -> Result<(), CsgError> {
        if depth > MAX_DEPTH {
            return Err(CsgError::TooDeep);
        }
        if tree.parts.is_empty() {
            return Err(CsgError::NoParts);
        }
        for (index, part) in tree.parts.iter().enumerate() {
            let map = map.of_part(part)?;
            match &part.shape {
                PartShape::Form(form) => self.leaf(form, &map)?,
                PartShape::Tree(tree) => self.tree(tree, &map, depth + 1)?,
            }
            if index > 0 {
                self.steps.push(Step::Join(tree.op));
            }
        }
        Ok(())
    }

    fn leaf(&mut self, form: &Form, map: &Map) -> Result<(), CsgError> {
        self.leaves += 1;
        if self.leaves > MAX_LEAVES {
            return Err(CsgError::TooManyLeaves);
        }
        let first = self.patches.len() as u32;
        let radius_m = self.take_apart(form, map)?;
        let radius_m = radius_m * stretch(&map.map);
        if radius_m < f64::INFINITY {
            self.extent_m = self.extent_m.max(map.shift_B.amax() + radius_m);
        }
        let count = self.patches.len() as u32 - first;
        self.steps.push(Step::Leaf { centre_B: map.shift_B, radius_m, first, count });
        Ok(())
    }

    /// Adds a form's patches, and answers with the radius of the ball around its origin that holds it.
    fn take_apart(&mut self, form: &Form, map: &Map) -> Result<f64, CsgError> {
        match form {
            Form::Plane(plane) => {
                self.plane(plane.normal_B(), plane.offset_m(), map);
                if let Some(Patch::Plane { offset_m, .. }) = self.patches.last() {
                    self.extent_m = self.extent_m.max(offset_m.abs());
                }
                Ok(f64::INFINITY)
            }
            Form::Sphere(ball) => {
                self.curved(Kind::Ball { radius_m: ball.radius_m() }, map);
                Ok(ball.radius_m())
            }
            Form::Cuboid(cuboid) => {
                let half_m = Vector3::from(cuboid.size_m()) * 0.5;
                if Cuboid::new(cuboid.size_m()) != Ok(*cuboid) {
                    return Err(CsgError::Rounded);
                }
                for axis in 0..3 {
                    for side in [1.0, -1.0] {
                        self.plane(Vector3::ith(axis, side), half_m[axis], map);
                    }
                }
                Ok(half_m.norm())
            }
            Form::Cylinder(cylinder) => {
                let (radius_m, half_m) = (cylinder.radius_m(), 0.5 * cylinder.length_m());
                if Cylinder::new(radius_m, cylinder.length_m()) != Ok(*cylinder) {
                    return Err(CsgError::Rounded);
                }
                self.curved(Kind::Tube { radius_m }, map);
                self.caps(half_m, map);
                Ok(radius_m.hypot(half_m))
            }
            Form::Cone(cone) => {
                let (bottom_m, top_m) = (cone.radius_bottom_m(), cone.radius_top_m());
                let length_m = cone.length_m();
                if crate::cone::Cone::new(bottom_m, top_m, length_m) != Ok(*cone) {
                    return Err(CsgError::Rounded);
                }
                let slope = (top_m - bottom_m) / length_m;
                let slant = slope.hypot(1.0);
                let (normal_rho, normal_y) = (1.0 / slant, -slope / slant);
                let offset_m = normal_rho * 0.5 * (bottom_m + top_m);
                self.curved(Kind::Nappe { normal_rho, normal_y, offset_m }, map);
                // A tip is the side's own; the cap there would only touch it.
                for (side, radius_m) in [(1.0, top_m), (-1.0, bottom_m)] {
                    if radius_m > 0.0 {
                        self.plane(Vector3::y() * side, 0.5 * length_m, map);
                    }
                }
                Ok(bottom_m.max(top_m).hypot(0.5 * length_m))
            }
            Form::Capsule(capsule) => {
                let (radius_m, length_m) = (capsule.radius_m(), capsule.length_m());
                if Capsule::new(radius_m, length_m) != Ok(*capsule) {
                    return Err(CsgError::Rounded);
                }
                self.curved(Kind::Pill { radius_m, half_length_m: 0.5 * length_m }, map);
                Ok(radius_m + 0.5 * length_m)
            }
            Form::Torus(torus) => {
                let (ring_radius_m, tube_radius_m) = (torus.ring_radius_m(), torus.tube_radius_m());
                self.curved(Kind::Ring { ring_radius_m, tube_radius_m }, map);
                Ok(ring_radius_m + tube_radius_m)
            }
            Form::Ellipsoid(ellipsoid) => {
                let radii_m = ellipsoid.radii_m();
                if Ellipsoid::new(radii_m) != Ok(*ellipsoid) {
                    return Err(CsgError::Rounded);
                }
                self.curved(Kind::Ball { radius_m: 1.0 }, &map.scaled(radii_m)?);
                Ok(Vector3::from(radii_m).max())
            }
            Form::Scaled(scaled) => {
                let factors = scaled.factors();
                let radius_m = self.take_apart(&scaled.unscaled(), &map.scaled(factors)?)?;
                Ok(radius_m * Vector3::from(factors).max())
            }
        }
    }

    fn caps(&mut self, half_m: f64, map: &Map) {
        self.plane(Vector3::y(), half_m, map);
        self.plane(-Vector3::y(), half_m, map);
    }

    fn plane(&mut self, normal_L: Vector3<f64>, offset_m: f64, map: &Map) {
        let inverse = map.inverse();
        let normal_B = inverse.tr_mul(&normal_L);
        let length = normal_B.norm();
        let normal_B = normal_B / length;
        let offset_m = offset_m / length + normal_B.dot(&map.shift_B);
        self.patches.push(Patch::Plane { normal_B, offset_m });
    }

    fn curved(&mut self, kind: Kind, map: &Map) {
        let mut turn_LB = map.inverse();
        let stretch = stretch(&turn_LB);
        let is_ball = matches!(kind, Kind::Ball { .. });
        if is_ball && (turn_LB.tr_mul(&turn_LB) - Matrix3::identity()).amax() < RIGID {
            // Which way a ball is turned cannot be felt.
            turn_LB = Matrix3::identity();
        }
        let shift_L = -turn_LB * map.shift_B;
        self.patches.push(Patch::Curved(Curved::new(kind, turn_LB, shift_L, stretch)));
    }
}

impl Map {
    fn of_part(&self, part: &CsgPart) -> Result<Self, CsgError> {
        let Isometry3 { rotation, translation } = part.pose;
        let is_finite = translation.vector.iter().chain(rotation.coords.iter()).all(|x| x.is_finite());
        if !is_finite {
            return Err(CsgError::NoPose);
        }
        let turn = rotation.to_rotation_matrix().into_inner();
        let placed = Self { map: self.map * turn, shift_B: self.map * translation.vector + self.shift_B };
        placed.scaled(part.scale)
    }

    fn scaled(&self, factors: [f64; 3]) -> Result<Self, CsgError> {
        for factor in factors {
            above_zero("scale", factor)?;
        }
        Ok(Self { map: self.map * Matrix3::from_diagonal(&factors.into()), ..*self })
    }

    fn inverse(&self) -> Matrix3<f64> {
        let stretches = self.map.tr_mul(&self.map);
        if (stretches - Matrix3::identity()).amax() < RIGID {
            // Exact, also where the inverse would round.
            return self.map.transpose();
        }
        self.map.try_inverse().unwrap_or_else(Matrix3::identity)
    }
}

/// The largest length that a map gives a vector of length one.
fn stretch(map: &Matrix3<f64>) -> f64 {
    let largest = map.singular_values().max();
    if (largest - 1.0).abs() < RIGID { 1.0 } else { largest }
}

/// Each patch once, and which of them an item means.
fn without_doubles(patches: &[Patch], extent_m: f64) -> (Box<[Patch]>, Box<[Item]>) {
    let points = sample(extent_m);
    let levels = |patch: &Patch| points.map(|point| patch.level(&point));
    let mut distinct: Vec<(Patch, [f64; SAMPLES])> = Vec::new();
    let mut items = Vec::with_capacity(patches.len());
    for patch in patches {
        let here = levels(patch);
        let agrees = |there: &[f64; SAMPLES], sign: f64| {
            here.iter().zip(there).all(|(a, b)| (a - sign * b).abs() <= SAME * extent_m)
        };
        let is_same = distinct.iter().position(|(_, there)| agrees(there, 1.0));
        let is_turned = || distinct.iter().position(|(other, there)| other.is_plane() && agrees(there, -1.0));
        let item =
            match is_same.map(|index| (index, false)).or_else(|| is_turned().map(|index| (index, true))) {
                Some((index, is_flipped)) => Item { patch: index as u16, is_flipped },
                None => {
                    distinct.push((*patch, here));
                    Item { patch: distinct.len() as u16 - 1, is_flipped: false }
                }
            };
        items.push(item);
    }
    (distinct.into_iter().map(|(patch, _)| patch).collect(), items.into())
}

/// Points all over the solid that lie on no surface that anybody would think of.
fn sample(extent_m: f64) -> [Vector3<f64>; SAMPLES] {
    // Irrational rotations spread evenly.
    std::array::from_fn(|i| {
        let spread = |step: f64| 2.0 * ((i as f64 + 1.0) * step).fract() - 1.0;
        Vector3::new(spread(0.819_172_513), spread(0.671_043_607), spread(0.549_700_478)) * extent_m
    })
}

const SAMPLES: usize = 16;
/// Surfaces nearer to each other than this share of the extent are one: more than what a scene's decimals leave, and the
/// size of an atom on a solid of 0.1 m.
const SAME: f64 = 1e-9;

const _: () = assert!(6 * MAX_LEAVES <= u16::MAX as usize);
