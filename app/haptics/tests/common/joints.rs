//! Random trees of shapes joined as people join them, and worse: tangent, coincident, nearly either, huge, tiny.
//!
//! What is inside is told by the leaves' equations in [`contains`], which shares nothing with the trees' own code.
#![allow(dead_code, non_snake_case)]

use haptics::{
    Capsule, Cone, CsgOp, CsgPart, CsgTree, Cuboid, Cylinder, Ellipsoid, Form, PartShape, Plane, Sphere,
    Torus,
};
use nalgebra::{Isometry3, Unit, UnitQuaternion, Vector3};

use crate::common::Noise;

/// Size of a common leaf (m).
pub(crate) const SIZE_M: f64 = 0.03;

/// Whether a point is inside of a tree.
pub(crate) fn contains(tree: &CsgTree, p: &Vector3<f64>) -> bool {
    let mut parts = tree.parts.iter().map(|part| part_contains(part, p));
    match tree.op {
        CsgOp::Union => parts.any(|is_in| is_in),
        CsgOp::Intersection => parts.all(|is_in| is_in),
        CsgOp::Difference => parts.next().unwrap() && !parts.any(|is_in| is_in),
    }
}

fn part_contains(part: &CsgPart, p: &Vector3<f64>) -> bool {
    let local = part.pose.inverse_transform_point(&(*p).into()).coords;
    let local = local.component_div(&Vector3::from(part.scale));
    match &part.shape {
        PartShape::Form(form) => form_contains(form, &local),
        PartShape::Tree(tree) => contains(tree, &local),
    }
}

fn form_contains(form: &Form, p: &Vector3<f64>) -> bool {
    let rho = p.x.hypot(p.z);
    match form {
        Form::Plane(plane) => plane.normal_B().dot(p) <= plane.offset_m(),
        Form::Sphere(ball) => p.norm() <= ball.radius_m(),
        Form::Cuboid(cuboid) => (0..3).all(|i| 2.0 * p[i].abs() <= cuboid.size_m()[i]),
        Form::Cylinder(tube) => rho <= tube.radius_m() && 2.0 * p.y.abs() <= tube.length_m(),
        Form::Cone(cone) => {
            let share = p.y / cone.length_m() + 0.5;
            (0.0..=1.0).contains(&share)
                && rho <= cone.radius_bottom_m() + (cone.radius_top_m() - cone.radius_bottom_m()) * share
        }
        Form::Capsule(pill) => {
            let half = 0.5 * pill.length_m();
            rho.hypot(p.y - p.y.clamp(-half, half)) <= pill.radius_m()
        }
        Form::Torus(ring) => (rho - ring.ring_radius_m()).hypot(p.y) <= ring.tube_radius_m(),
        Form::Ellipsoid(form) => p.component_div(&Vector3::from(form.radii_m())).norm() <= 1.0,
        other => panic!("no equation for {other:?}"),
    }
}

/// A leaf as a tree of its own, in the frame of the whole.
pub(crate) struct Leaf {
    pub(crate) tree: CsgTree,
    /// Taken away from something, and not that from something else.
    pub(crate) is_taken_away: bool,
}

pub(crate) fn leaves(tree: &CsgTree) -> Vec<Leaf> {
    let mut found = Vec::new();
    for (i, part) in tree.parts.iter().enumerate() {
        let is_taken_away = tree.op == CsgOp::Difference && i > 0;
        match &part.shape {
            PartShape::Form(_) => found.push(Leaf { tree: CsgTree::union([part.clone()]), is_taken_away }),
            PartShape::Tree(inner) => found.extend(leaves(inner).into_iter().map(|leaf| {
                let tree = CsgPart { shape: PartShape::Tree(leaf.tree), ..part.clone() };
                Leaf { tree: CsgTree::union([tree]), is_taken_away: is_taken_away != leaf.is_taken_away }
            })),
        }
    }
    found
}

/// A tree of 2 to 20 leaves.
pub(crate) fn joined(seed: u64) -> CsgTree {
    let mut maker = Maker { noise: Noise(seed.wrapping_mul(0x2545_F491_4F6C_DD1D)), leaves: Vec::new() };
    let count = 2 + (maker.noise.uniform() * 6.0) as usize * if seed.is_multiple_of(4) { 3 } else { 1 };
    let first = maker.leaf(1.0);
    maker.leaves.push((first, Isometry3::identity()));
    let mut tree = CsgTree::union([CsgPart::from(first)]);
    for _ in 1..count {
        let (form, pose) = maker.next_leaf();
        maker.leaves.push((form, pose));
        let part = CsgPart::new(form, pose);
        let chance = maker.noise.uniform();
        tree = match chance {
            _ if chance < 0.7 => CsgTree::union([CsgPart::from(tree), part]),
            _ if chance < 0.85 => CsgTree::difference([CsgPart::from(tree), part]),
            _ if chance < 0.93 => {
                // Something cut by half of something else.
                let half = Plane::new(maker.direction(), 0.0).unwrap();
                let cut = CsgTree::intersection([part, CsgPart::at(half, pose.translation.vector)]);
                CsgTree::union([CsgPart::from(tree), cut.into()])
            }
            _ => {
                let bound = Sphere::new(SIZE_M * maker.noise.between(0.5, 1.2)).unwrap();
                CsgTree::intersection([CsgTree::union([CsgPart::from(tree), part]), CsgTree::union([bound])])
            }
        };
        if depth(&tree) > 14 {
            break;
        }
    }
    tree
}

fn depth(tree: &CsgTree) -> usize {
    let of_part = |part: &CsgPart| if let PartShape::Tree(tree) = &part.shape { depth(tree) } else { 0 };
    1 + tree.parts.iter().map(of_part).max().unwrap_or(0)
}

struct Maker {
    noise: Noise,
    leaves: Vec<(Form, Isometry3<f64>)>,
}

impl Maker {
    fn direction(&mut self) -> Vector3<f64> {
        self.noise.vector(1.0).normalize()
    }

    fn pose(&mut self, spread_m: f64) -> Isometry3<f64> {
        let at = self.noise.vector(spread_m);
        // Often along the axes, as people do.
        let turn = match (self.noise.uniform() * 3.0) as u32 {
            0 => UnitQuaternion::identity(),
            1 => {
                let axis = Unit::new_normalize(Vector3::ith((self.noise.uniform() * 3.0) as usize, 1.0));
                UnitQuaternion::from_axis_angle(&axis, std::f64::consts::FRAC_PI_2)
            }
            _ => UnitQuaternion::new(self.noise.vector(1.0)),
        };
        Isometry3::from_parts(at.into(), turn)
    }

    /// Zero, or a share from 1e-15 to 1e-3 of either sign.
    fn nearly(&mut self) -> f64 {
        if self.noise.uniform() < 0.3 {
            return 0.0;
        }
        let share = 10f64.powf(self.noise.between(-15.0, -3.0));
        if self.noise.uniform() < 0.5 { share } else { -share }
    }

    fn leaf(&mut self, scale: f64) -> Form {
        let mut size = || SIZE_M * scale * self.noise.between(0.3, 1.0);
        let (a, b, c) = (size(), size(), size());
        match (self.noise.uniform() * 8.0) as u32 {
            0 | 1 => Sphere::new(a).unwrap().into(),
            2 => Cuboid::new([2.0 * a, 2.0 * b, 2.0 * c]).unwrap().into(),
            3 | 4 => Cylinder::new(a, 2.0 * b).unwrap().into(),
            5 => {
                Cone::new(a, if self.noise.uniform() < 0.5 { 0.0 } else { 0.5 * a }, 2.0 * b).unwrap().into()
            }
            6 => Capsule::new(0.7 * a, b).unwrap().into(),
            _ => {
                let tube = a.min(b);
                match self.noise.uniform() < 0.7 {
                    true => Torus::new(a.max(b) + 0.2 * tube, 0.5 * tube).unwrap().into(),
                    false => Ellipsoid::new([a, b, c]).unwrap().into(),
                }
            }
        }
    }

    fn next_leaf(&mut self) -> (Form, Isometry3<f64>) {
        let [chance, which] = [self.noise.uniform(), self.noise.uniform()];
        let (form, pose) = self.leaves[(which * self.leaves.len() as f64) as usize];
        match (chance * 8.0) as u32 {
            0 | 1 => {
                let scale = [1.0, 1.0, 1.0, 0.03, 1e-3][(self.noise.uniform() * 5.0) as usize];
                (self.leaf(scale), self.pose(0.5 * SIZE_M))
            }
            2 => self.nearly_the_same(form, pose),
            3 if self.noise.uniform() < 0.15 => self.huge(),
            3 => (self.leaf(1.0), pose),
            _ => self.tangent(form, pose).unwrap_or_else(|| self.nearly_the_same(form, pose)),
        }
    }

    /// The same again, a little off.
    fn nearly_the_same(&mut self, form: Form, pose: Isometry3<f64>) -> (Form, Isometry3<f64>) {
        let (off, turned) = (self.nearly(), self.nearly());
        let shift = self.direction() * off * SIZE_M;
        let turn = UnitQuaternion::new(self.direction() * turned);
        (form, Isometry3::from_parts((pose.translation.vector + shift).into(), turn * pose.rotation))
    }

    /// A ball or a box, much larger than all others, whose boundary passes by near the middle.
    fn huge(&mut self) -> (Form, Isometry3<f64>) {
        let size_m = SIZE_M * 10f64.powf(self.noise.between(1.0, 2.5));
        let away = self.direction();
        if self.noise.uniform() < 0.5 {
            let at = away * (size_m + self.noise.between(-0.5, 0.5) * SIZE_M);
            (Sphere::new(size_m).unwrap().into(), Isometry3::translation(at.x, at.y, at.z))
        } else {
            let at = Vector3::y() * -size_m;
            (Cuboid::new([2.0 * size_m; 3]).unwrap().into(), Isometry3::translation(at.x, at.y, at.z))
        }
    }

    /// What touches a leaf as fillets, caps, rests and sleeves do, or nearly so.
    fn tangent(&mut self, form: Form, pose: Isometry3<f64>) -> Option<(Form, Isometry3<f64>)> {
        let (nearly, side) = (self.nearly(), if self.noise.uniform() < 0.5 { 1.0 } else { -1.0 });
        let chance = self.noise.uniform();
        let at = |p: Vector3<f64>| pose * Isometry3::translation(p.x, p.y, p.z);
        let along = |p: Vector3<f64>, axis: Vector3<f64>| {
            let turn = UnitQuaternion::rotation_between(&Vector3::y(), &axis).unwrap_or_default();
            pose * Isometry3::from_parts(p.into(), turn)
        };
        let (form, pose) = match form {
            Form::Cylinder(tube) => {
                let (r, half) = (tube.radius_m(), 0.5 * tube.length_m());
                match chance {
                    // A cap.
                    _ if chance < 0.4 => (ball(r * (1.0 + nearly)), at(Vector3::y() * side * half)),
                    // A plate that lies against it.
                    _ if chance < 0.6 => {
                        let plate = Cuboid::new([0.6 * r, 2.0 * half, 2.0 * r]).unwrap();
                        (plate.into(), at(Vector3::x() * side * (1.3 * r + nearly * r)))
                    }
                    // A plate within it, up to its wall.
                    _ if chance < 0.7 => {
                        let plate = Cuboid::new([0.6 * r, 3.0 * half, 2.0 * r]).unwrap();
                        (plate.into(), at(Vector3::x() * side * (0.7 * r + nearly * r)))
                    }
                    // A rod of the same radius across, a ring around.
                    _ if chance < 0.85 => {
                        let rod = Cylinder::new(r * (1.0 + nearly), 3.0 * r).unwrap();
                        (rod.into(), along(Vector3::zeros(), Vector3::x()))
                    }
                    _ => {
                        let ring = Torus::new(r * 1.25, r * (0.25 + nearly)).unwrap();
                        (ring.into(), at(Vector3::y() * side * half * 0.5))
                    }
                }
            }
            Form::Sphere(other) => {
                let (r, share) = (other.radius_m(), self.noise.between(0.3, 1.5));
                let away = self.direction();
                match chance {
                    _ if chance < 0.3 => (ball(share * r), at(away * r * (1.0 + share + nearly))),
                    _ if chance < 0.6 => (ball(share * r), at(away * r * (1.0 - share + nearly))),
                    _ if chance < 0.8 => {
                        let rod = Cylinder::new(r * (1.0 + nearly), 2.0 * r * share).unwrap();
                        (rod.into(), along(away * r * share, away))
                    }
                    _ => {
                        let plate = Cuboid::new([2.0 * r, 0.4 * r, 1.5 * r]).unwrap();
                        (plate.into(), along(away * r * (1.0 + nearly - 0.2 * side), away))
                    }
                }
            }
            Form::Cuboid(cuboid) => {
                let half = Vector3::from(cuboid.size_m()) * 0.5;
                let r = half.min() * self.noise.between(0.3, 0.9);
                match chance {
                    // A box side by side.
                    _ if chance < 0.4 => {
                        let beside = Vector3::x() * side * (2.0 + nearly) * half.x;
                        (Cuboid::new(cuboid.size_m()).unwrap().into(), at(beside))
                    }
                    // A rounded edge, a ball in a corner.
                    _ if chance < 0.7 => {
                        let inset = Vector3::new(half.x - r, 0.0, half.z - r + nearly * r);
                        (Cylinder::new(r, 2.0 * half.y).unwrap().into(), at(inset * side))
                    }
                    _ if chance < 0.85 => (ball(r), at((half - Vector3::repeat(r * (1.0 + nearly))) * side)),
                    _ => (ball(r), at(Vector3::y() * (half.y + r * (1.0 + nearly)))),
                }
            }
            Form::Capsule(pill) => {
                let (r, half) = (pill.radius_m(), 0.5 * pill.length_m());
                match chance < 0.5 {
                    true => (ball(r * (1.0 + nearly)), at(Vector3::y() * half * side)),
                    false => (Cylinder::new(r * (1.0 + nearly), half).unwrap().into(), at(Vector3::zeros())),
                }
            }
            Form::Cone(cone) => {
                // A ball that touches the wall from within all around, as the end of a drill.
                let (bottom, top, length) = (cone.radius_bottom_m(), cone.radius_top_m(), cone.length_m());
                let slant = (bottom - top) / length;
                let radius = 0.5 * (bottom + top) / slant.hypot(1.0);
                (ball(radius * (1.0 + nearly)), at(Vector3::zeros()))
            }
            Form::Torus(ring) => {
                let (big, small) = (ring.ring_radius_m(), ring.tube_radius_m());
                match chance {
                    _ if chance < 0.5 => (ball(small * (1.0 + nearly)), at(Vector3::x() * big)),
                    _ => {
                        let plate = Cylinder::new(big, 2.0 * small * (1.0 + nearly)).unwrap();
                        (plate.into(), at(Vector3::zeros()))
                    }
                }
            }
            _ => return None,
        };
        Some((form, pose))
    }
}

fn ball(radius_m: f64) -> Form {
    Sphere::new(radius_m).unwrap().into()
}
