//! Trees of shapes, each beside its boolean expression written apart from the equations of its leaves.
#![allow(dead_code, non_snake_case)]

use std::sync::Arc;

use haptics::{
    Capsule, Cone, Csg, CsgOp, CsgPart, CsgTree, Cuboid, Cylinder, Ellipsoid, Entity, Friction, Plane, Shape,
    Sphere, Torus,
};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::common::{Noise, entity};

pub(crate) type Contains = fn(&Vector3<f64>) -> bool;
pub(crate) type Inside<'c> = dyn Fn(&Vector3<f64>) -> bool + 'c;
/// A bound of the distance to the boundary, negative inside: of two points it differs by no more than they are apart.
pub(crate) type Level<'c> = dyn Fn(&Vector3<f64>) -> f64 + 'c;

/// A tree, and what is inside of it.
pub(crate) struct Tree {
    pub(crate) name: &'static str,
    pub(crate) tree: CsgTree,
    pub(crate) contains: Contains,
    /// Half the width of the cube that holds what is bounded of it (m).
    pub(crate) size_m: f64,
}

pub(crate) fn built(tree: &CsgTree) -> Arc<Csg> {
    Arc::new(Csg::build(tree).unwrap())
}

pub(crate) fn touchable(tree: &CsgTree, friction: Friction) -> Entity {
    entity(Shape::from(built(tree)), friction)
}

pub(crate) fn v(x: f64, y: f64, z: f64) -> Vector3<f64> {
    Vector3::new(x, y, z)
}

pub(crate) fn cuboid(size_m: [f64; 3]) -> Cuboid {
    Cuboid::new(size_m).unwrap()
}

pub(crate) fn ball(radius_m: f64) -> Sphere {
    Sphere::new(radius_m).unwrap()
}

/// With its axis along this direction.
pub(crate) fn along(axis: Vector3<f64>, place: Vector3<f64>) -> Isometry3<f64> {
    let turn = UnitQuaternion::rotation_between(&Vector3::y(), &axis).unwrap();
    Isometry3::from_parts(place.into(), turn)
}

fn in_box(p: &Vector3<f64>, size: [f64; 3]) -> bool {
    (0..3).all(|axis| 2.0 * p[axis].abs() <= size[axis])
}

fn in_tube(p: &Vector3<f64>, radius: f64, half_length: f64) -> bool {
    p.x * p.x + p.z * p.z <= radius * radius && p.y.abs() <= half_length
}

/// A box with a bore along y.
pub(crate) fn bored_box() -> Tree {
    Tree {
        name: "box minus cylinder",
        tree: CsgTree::difference([
            CsgPart::from(cuboid([0.1, 0.04, 0.08])),
            Cylinder::new(0.02, 0.2).unwrap().into(),
        ]),
        contains: |p| in_box(p, [0.1, 0.04, 0.08]) && !in_tube(p, 0.02, 0.1),
        size_m: 0.05,
    }
}

pub(crate) fn lens() -> Tree {
    Tree {
        name: "lens",
        tree: CsgTree::intersection([
            CsgPart::at(ball(0.05), v(0.0, -0.03, 0.0)),
            CsgPart::at(ball(0.05), v(0.0, 0.03, 0.0)),
        ]),
        contains: |p| (p + v(0.0, 0.03, 0.0)).norm() <= 0.05 && (p - v(0.0, 0.03, 0.0)).norm() <= 0.05,
        size_m: 0.04,
    }
}

pub(crate) fn two_balls() -> Tree {
    Tree {
        name: "two balls",
        tree: CsgTree::union([
            CsgPart::at(ball(0.05), v(-0.03, 0.0, 0.0)),
            CsgPart::at(ball(0.04), v(0.03, 0.0, 0.0)),
        ]),
        contains: |p| (p + v(0.03, 0.0, 0.0)).norm() <= 0.05 || (p - v(0.03, 0.0, 0.0)).norm() <= 0.04,
        size_m: 0.08,
    }
}

pub(crate) fn half_ball() -> Tree {
    Tree {
        name: "half ball",
        tree: CsgTree::difference([
            CsgPart::from(ball(0.05)),
            Plane::new(-Vector3::y(), 0.0).unwrap().into(),
        ]),
        contains: |p| p.norm() <= 0.05 && p.y <= 0.0,
        size_m: 0.05,
    }
}

const PIPS: [[f64; 3]; 6] = [
    [0.0, 0.025, 0.0],
    [0.025, 0.01, 0.01],
    [0.025, -0.01, -0.01],
    [0.01, 0.01, 0.025],
    [-0.01, -0.01, 0.025],
    [0.0, 0.0, 0.025],
];

/// A die with some pips, and its corners rounded off by a ball.
pub(crate) fn die() -> Tree {
    let round = CsgTree::intersection([CsgPart::from(cuboid([0.05; 3])), ball(0.035).into()]);
    let pips = PIPS.map(|[x, y, z]| CsgPart::at(ball(0.004), v(x, y, z)));
    Tree {
        name: "die",
        tree: CsgTree::difference(std::iter::once(CsgPart::from(round)).chain(pips)),
        contains: |p| {
            in_box(p, [0.05; 3])
                && p.norm() <= 0.035
                && PIPS.iter().all(|&[x, y, z]| (p - v(x, y, z)).norm() > 0.004)
        },
        size_m: 0.026,
    }
}

/// Two boxes that make one, side by side.
pub(crate) fn halves() -> CsgTree {
    CsgTree::union([
        CsgPart::at(cuboid([0.06, 0.05, 0.08]), v(-0.02, 0.0, 0.0)),
        CsgPart::at(cuboid([0.04, 0.05, 0.08]), v(0.03, 0.0, 0.0)),
    ])
}

/// Three rods through each other, a bracket, a ring and a pebble: all kinds of leaves, turned.
pub(crate) fn everything() -> Tree {
    let rods = CsgTree::union([
        CsgPart::from(Cylinder::new(0.012, 0.1).unwrap()),
        CsgPart::new(Cylinder::new(0.01, 0.1).unwrap(), along(Vector3::x(), Vector3::zeros())),
        CsgPart::new(Capsule::new(0.011, 0.06).unwrap(), along(Vector3::z(), Vector3::zeros())),
    ]);
    Tree {
        name: "everything",
        tree: CsgTree::difference([
            CsgPart::from(CsgTree::union([
                CsgPart::from(rods),
                CsgPart::from(Torus::new(0.04, 0.008).unwrap()),
                CsgPart::at(Cone::new(0.02, 0.0, 0.03).unwrap(), v(0.04, 0.01, 0.0)),
            ])),
            CsgPart::at(Ellipsoid::new([0.01, 0.02, 0.006]).unwrap(), v(-0.04, 0.0, 0.0)),
            CsgPart::at(cuboid([0.03, 0.02, 0.03]), v(0.0, 0.05, 0.0)).scaled([1.0, 1.0, 0.5]),
        ]),
        contains: |p| {
            let rods = in_tube(p, 0.012, 0.05)
                || in_tube(&v(p.y, p.x, p.z), 0.01, 0.05)
                || (p - v(0.0, 0.0, p.z.clamp(-0.03, 0.03))).norm() <= 0.011;
            let ring = (p.x.hypot(p.z) - 0.04).hypot(p.y) <= 0.008;
            let q = p - v(0.04, 0.01, 0.0);
            let cone = q.y.abs() <= 0.015 && q.x.hypot(q.z) <= 0.02 * (0.015 - q.y) / 0.03;
            let pebble = (p - v(-0.04, 0.0, 0.0)).component_div(&v(0.01, 0.02, 0.006)).norm() <= 1.0;
            let slot = in_box(&(p - v(0.0, 0.05, 0.0)), [0.03, 0.02, 0.015]);
            (rods || ring || cone) && !pebble && !slot
        },
        size_m: 0.062,
    }
}

/// A plate 1 mm thick with slots, a rod through it and a groove.
pub(crate) fn thin_plate() -> Tree {
    Tree {
        name: "thin plate",
        tree: CsgTree::union([
            CsgPart::from(CsgTree::difference([
                CsgPart::from(cuboid([0.1, 1e-3, 0.1])),
                CsgPart::at(cuboid([0.01, 0.01, 0.06]), v(0.02, 0.0, 0.0)),
                CsgPart::at(Cylinder::new(0.01, 0.1).unwrap(), v(-0.02, 0.0, 0.02)),
            ])),
            CsgPart::new(Cylinder::new(2e-3, 0.06).unwrap(), along(v(1.0, 2.0, 0.3), v(-0.02, 0.0, -0.02))),
        ]),
        contains: |p| {
            let plate = in_box(p, [0.1, 1e-3, 0.1])
                && !in_box(&(p - v(0.02, 0.0, 0.0)), [0.01, 0.01, 0.06])
                && !in_tube(&(p - v(-0.02, 0.0, 0.02)), 0.01, 0.05);
            let axis = v(1.0, 2.0, 0.3).normalize();
            let q = p - v(-0.02, 0.0, -0.02);
            let along = q.dot(&axis);
            plate || ((q - axis * along).norm() <= 2e-3 && along.abs() <= 0.03)
        },
        size_m: 0.05,
    }
}

pub(crate) fn all() -> Vec<Tree> {
    vec![bored_box(), lens(), two_balls(), half_ball(), die(), everything(), thin_plate()]
}

/// A random tree of a few leaves, and its expression.
pub(crate) fn random_tree(seed: u64) -> (CsgTree, Box<Inside<'static>>) {
    let (tree, level) = random_solid(seed);
    (tree, Box::new(move |p| level(p) <= 0.0))
}

/// A random tree of a few leaves, and its level.
pub(crate) fn random_solid(seed: u64) -> (CsgTree, Box<Level<'static>>) {
    let mut noise = Noise(seed);
    let mut tree: Option<CsgTree> = None;
    let mut level: Box<Level<'static>> = Box::new(|_| f64::INFINITY);
    for i in 0..6 {
        let at = Vector3::from_fn(|_, _| noise.between(-0.02, 0.02));
        let axis = Vector3::from_fn(|_, _| noise.between(-1.0, 1.0));
        let pose = Isometry3::from_parts(at.into(), UnitQuaternion::new(axis));
        let size = if i == 0 { 2.0 } else { noise.between(0.5, 1.2) };
        let (part, leaf): (CsgPart, Box<Level<'static>>) = match (noise.uniform() * 3.0) as u32 {
            0 => {
                let r = 0.014 * size;
                (CsgPart::new(Sphere::new(r).unwrap(), pose), Box::new(move |p| p.norm() - r))
            }
            1 => {
                let (r, l) = (0.01 * size, 0.05 * size);
                let level = move |p: &Vector3<f64>| (p.x.hypot(p.z) - r).max(p.y.abs() - 0.5 * l);
                (CsgPart::new(Cylinder::new(r, l).unwrap(), pose), Box::new(level))
            }
            _ => {
                let sides = [0.03 * size, 0.02 * size, 0.024 * size];
                let level = move |p: &Vector3<f64>| (p.abs() - 0.5 * Vector3::from(sides)).max();
                (CsgPart::new(Cuboid::new(sides).unwrap(), pose), Box::new(level))
            }
        };
        let leaf = move |p: &Vector3<f64>| leaf(&pose.inverse_transform_point(&(*p).into()).coords);
        let Some(before) = tree else {
            (tree, level) = (Some(CsgTree::union([part])), Box::new(leaf));
            continue;
        };
        let op = [CsgOp::Union, CsgOp::Difference, CsgOp::Difference, CsgOp::Intersection]
            [if i > 3 { (noise.uniform() * 2.0) as usize } else { (noise.uniform() * 3.0) as usize }];
        let parts = [CsgPart::from(before), part];
        level = match op {
            CsgOp::Union => Box::new(move |p| level(p).min(leaf(p))),
            CsgOp::Difference => Box::new(move |p| level(p).max(-leaf(p))),
            CsgOp::Intersection => Box::new(move |p| level(p).max(leaf(p))),
        };
        tree = Some(CsgTree { op, parts: parts.into() });
    }
    (tree.unwrap(), level)
}
