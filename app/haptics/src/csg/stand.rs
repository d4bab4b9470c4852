//! What holds the HIP back where a god-object stands.
//!
//! Model: of the patches that it is on, those that hold the HIP back hold it from here on (regenerate transitions, see
//! [`super::corner`]). A HIP in front of all lifts the god-object off; it flies straight to the HIP, and touches again
//! where that way meets the solid. In its clearing only the patches that held it before are looked at.
//!
//! Frames: object frame B; normals point to the free side.
//! Invariants: no god-object is farther from the HIP than before, and none whose HIP is inside is lost.
//! Cost: in a clearing a look at one patch, or two on an edge; else a level for each patch nearby. Flights are bounded.

use nalgebra::Vector3;

use super::Csg;
use super::corner::{Corner, edge_holds};
use super::god::{God, worst_m};
use super::hit::first_hit;
use super::patch::{Look, Patch};
use super::settle::looks_at;
use super::way_out::way_out;
use crate::friction_cone::ConeInput;
use crate::surface::direction_or_up;
use crate::tangent_view::TangentView;

/// What a god-object sees from where it stands.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stood {
    pub(super) view: TangentView,
    /// What the two patches of an edge show there, if that is known.
    pub(super) looks: Option<[Look; 2]>,
}

impl From<TangentView> for Stood {
    fn from(view: TangentView) -> Self {
        Self { view, looks: None }
    }
}

/// What holds the HIP back where the god-object stands; `None` if it is free and gone.
#[inline(always)]
pub(super) fn stand(csg: &Csg, god: &mut God, input: &ConeInput) -> Option<Stood> {
    if god.clearing.holds(&god.point_B) {
        let stood = match (god.only_patch(csg), god.both_patches(csg)) {
            (Some(patch), _) => {
                let look = patch.look(&god.point_B, &input.hip_B);
                on_patch(csg, god, patch, &god.point_B, &look, input).map(Stood::from)
            }
            (_, Some(patches)) => {
                let looks = looks_at(&patches, &god.point_B, &input.hip_B);
                let view = on_edge(csg, god, &god.point_B, &looks, input);
                view.map(|view| Stood { view, looks: Some(looks) })
            }
            _ => None,
        };
        if stood.is_some() {
            return stood;
        }
    }
    stand_anywhere(csg, god, input).map(Stood::from)
}

/// What a god-object on one patch sees from a place in its clearing; `None` if it is held there by something else.
#[inline(always)]
pub(super) fn on_patch(
    csg: &Csg,
    god: &God,
    patch: &Patch,
    point_B: &Vector3<f64>,
    look: &Look,
    input: &ConeInput,
) -> Option<TangentView> {
    let is_turned = god.sides & god.active != 0;
    let view = view_of_patch(csg, patch, is_turned, point_B, &look.normal_B, input);
    let is_held = look.height_m.abs() <= csg.tolerance_m() && view.depth_m >= -RELEASE * csg.extent_m;
    is_held.then_some(view)
}

/// What a god-object on an edge sees from a place in its clearing; `None` if not both of its patches hold it there.
#[inline(always)]
pub(super) fn on_edge(
    csg: &Csg,
    god: &God,
    point_B: &Vector3<f64>,
    looks: &[Look; 2],
    input: &ConeInput,
) -> Option<TangentView> {
    let mut held_by = god.held_by();
    let indices = [held_by.next()?, held_by.next()?];
    let is_turned = |index: usize| god.sides >> index & 1 == 1;
    let outward = |i: usize| if is_turned(indices[i]) { -looks[i].normal_B } else { looks[i].normal_B };
    let to_hip_B = input.hip_B - point_B;
    let way_B = edge_holds(&god.near, god.sides, indices, &[outward(0), outward(1)], &to_hip_B)?;
    if worst_m(looks) > csg.tolerance_m() {
        return None;
    }
    let out_B = way_B - to_hip_B;
    let depth_m = out_B.norm();
    if depth_m == 0.0 {
        return None;
    }
    let normal_B = direction_or_up(&out_B);
    Some(TangentView::new(point_B, normal_B, normal_B.dot(&input.hip_B) + depth_m, input))
}

#[inline(never)]
fn stand_anywhere(csg: &Csg, god: &mut God, input: &ConeInput) -> Option<TangentView> {
    for _ in 0..MAX_FLIGHTS {
        if !god.near.holds(&god.point_B, 0.0) {
            god.look_around(csg, 0.0);
        }
        let (corner, nearest_m) = corner(csg, god, &input.hip_B);
        match held(csg, god, &corner, input) {
            Held::By(view) => {
                god.clear(corner.count, nearest_m);
                return Some(view);
            }
            Held::Nothing => match first_hit(csg, &god.near, god.sides, &god.point_B, &input.hip_B) {
                Some(hit) => *god = God::hit(&hit),
                None if csg.is_inside(&input.hip_B) => return Some(all_around(&god.point_B, input)),
                None => return None,
            },
            Held::Lost => {
                let out = way_out(csg, &god.point_B)?;
                let distance_m = |god: &God| (god.point_B - input.hip_B).norm();
                let is_on_it = csg.signed_distance(&god.point_B).abs() <= csg.tight_m();
                if is_on_it && distance_m(&out) > distance_m(god) + csg.tight_m() {
                    return Some(all_around(&god.point_B, input));
                }
                *god = out;
            }
        }
    }
    // Flown as often as a tick has time for: it goes on from here in the next one.
    csg.is_inside(&input.hip_B).then(|| all_around(&god.point_B, input))
}

/// What a god-object sees that cannot come nearer to the HIP, whatever is around it: all of its spring.
pub(super) fn all_around(point_B: &Vector3<f64>, input: &ConeInput) -> TangentView {
    let spring_B = point_B - input.hip_B;
    let normal_B = direction_or_up(&spring_B);
    TangentView::new(point_B, normal_B, normal_B.dot(&input.hip_B) + spring_B.norm(), input)
}

/// What of the boundary is where the god-object is: the patches it is on, and how far away the nearest other is (m).
fn corner(csg: &Csg, god: &mut God, hip_B: &Vector3<f64>) -> (Corner, f64) {
    let mut corner = Corner::new();
    let mut nearest_m = f64::INFINITY;
    for index in 0..god.near.count() {
        let patch = god.near.patch(csg, index);
        let level = patch.level(&god.point_B);
        if level.abs() <= csg.tolerance_m() {
            corner.add(index, &patch.look(&god.point_B, hip_B));
        } else {
            let is_inside = usize::from(level <= 0.0);
            god.sides = god.sides & !(1 << index) | is_inside << index;
            nearest_m = nearest_m.min(level.abs());
        }
    }
    // So that it is not on them anywhere in between.
    (corner, nearest_m - 2.0 * csg.tolerance_m())
}

enum Held {
    By(TangentView),
    /// The HIP is in front of all that is here.
    Nothing,
    /// The god-object is in the material.
    Lost,
}

#[inline]
fn held(csg: &Csg, god: &mut God, corner: &Corner, input: &ConeInput) -> Held {
    let to_hip_B = input.hip_B - god.point_B;
    let release_m = RELEASE * csg.extent_m;
    let by_patch = |god: &God, index: usize, place: usize| {
        let is_turned = god.sides >> index & 1 == 1;
        let patch = god.near.patch(csg, index);
        view_of_patch(csg, patch, is_turned, &god.point_B, &corner.normals_B[place], input)
    };
    if corner.count <= 1 {
        let index = corner.indices[0];
        let flipped = god.sides ^ 1 << index;
        let is_solid = [god.sides, flipped].map(|sides| god.near.is_solid(sides));
        if corner.count == 0 || is_solid[0] == is_solid[1] {
            return if is_solid[0] { Held::Lost } else { Held::Nothing };
        }
        if is_solid[0] {
            god.sides = flipped;
        }
        god.active = 1 << index;
        let view = by_patch(god, index, 0);
        return if view.depth_m < -release_m { Held::Nothing } else { Held::By(view) };
    }
    let Some(facing) = corner.facing(&god.near, god.sides, &to_hip_B, release_m) else {
        let Some(index) = deepest_wall(god, corner, &to_hip_B) else { return Held::Lost };
        god.active = 1 << index;
        return Held::By(by_patch(god, index, corner.place(index)));
    };
    (god.sides, god.active) = (facing.sides, facing.active);
    match facing.active.count_ones() {
        0 => Held::Nothing,
        1 => {
            let index = facing.active.trailing_zeros() as usize;
            Held::By(by_patch(god, index, corner.place(index)))
        }
        _ => Held::By(view_of_edge(corner, god, &god.point_B, &(facing.way_B - to_hip_B), input)),
    }
}

/// In a gap between patches that touch, for which tangent planes leave no room: the wall that the HIP is deepest behind.
#[inline(never)]
fn deepest_wall(god: &God, corner: &Corner, to_hip_B: &Vector3<f64>) -> Option<usize> {
    if god.near.is_solid(god.sides) {
        return None;
    }
    let walls = (0..corner.count).filter(|&i| god.near.is_solid(god.sides ^ 1 << corner.indices[i]));
    let height_m = |i: usize| corner.outward(i, god.sides >> corner.indices[i]).dot(to_hip_B);
    walls.min_by(|&i, &j| height_m(i).total_cmp(&height_m(j))).map(|i| corner.indices[i])
}

#[inline(always)]
fn view_of_patch(
    csg: &Csg,
    patch: &Patch,
    is_turned: bool,
    point_B: &Vector3<f64>,
    normal_B: &Vector3<f64>,
    input: &ConeInput,
) -> TangentView {
    if is_turned && patch.holds_in_tip(point_B, &input.hip_B, IN_TIP * csg.extent_m) {
        return all_around(point_B, input);
    }
    let normal_B = if is_turned { -normal_B } else { *normal_B };
    let offset_m = match patch {
        Patch::Plane { offset_m, .. } if is_turned => -offset_m,
        Patch::Plane { offset_m, .. } => *offset_m,
        Patch::Curved(_) => normal_B.dot(point_B),
    };
    TangentView::new(point_B, normal_B, offset_m, input)
}

/// From an edge or a corner; `out_B` leads from the HIP to the nearest place where it would be free.
#[inline(always)]
fn view_of_edge(
    corner: &Corner,
    god: &God,
    point_B: &Vector3<f64>,
    out_B: &Vector3<f64>,
    input: &ConeInput,
) -> TangentView {
    let depth_m = out_B.norm();
    let outward = |sum, index: usize| {
        let normal_B = corner.normals_B[corner.place(index)];
        sum + if god.sides >> index & 1 == 1 { -normal_B } else { normal_B }
    };
    let between_B = || direction_or_up(&god.held_by().fold(Vector3::zeros(), outward));
    let normal_B = if depth_m > 0.0 { direction_or_up(out_B) } else { between_B() };
    let offset_m = normal_B.dot(&input.hip_B) + depth_m;
    TangentView::new(point_B, normal_B, offset_m, input)
}

/// Nearer to the axis of a cone than this it is in its tip, in terms of the extent: a hundredth of what is told apart.
const IN_TIP: f64 = 1e-9;
/// Bound on the flights of a god-object within one tick.
const MAX_FLIGHTS: u32 = 8;
/// A HIP this far in front of a patch is free, in terms of the extent: more than a path that ends there is met before it.
pub(super) const RELEASE: f64 = 4e-12;

#[cfg(test)]
mod tests {
    use super::super::settle::settle;
    use super::super::{CsgPart, CsgTree};
    use super::*;
    use crate::cuboid::Cuboid;
    use crate::cylinder::Cylinder;
    use crate::sphere::Sphere;

    /// A plate with a bore, a knob and a dimple.
    fn plate() -> Csg {
        let at = |x: f64, z: f64| Vector3::new(x, 0.005, z);
        let solid = CsgTree::union([
            CsgPart::from(Cuboid::new([0.06, 0.01, 0.06]).unwrap()),
            CsgPart::at(Sphere::new(0.004).unwrap(), at(0.01, 0.01)),
        ]);
        Csg::build(&CsgTree::difference([
            CsgPart::from(solid),
            CsgPart::at(Cylinder::new(0.005, 0.1).unwrap(), at(-0.01, 0.0)),
            CsgPart::at(Sphere::new(0.004).unwrap(), at(0.012, -0.01)),
        ]))
        .unwrap()
    }

    fn input(hip_B: Vector3<f64>) -> ConeInput {
        ConeInput {
            hip_B,
            hip_velocity_B: Vector3::zeros(),
            stiffness_n_per_m: 500.0,
            damping_n_s_per_m: 0.0,
            dt_s: 1e-3,
        }
    }

    fn point(i: u32) -> Vector3<f64> {
        let along = |step: f64| 2.0 * (f64::from(i) * step).fract() - 1.0;
        Vector3::new(along(0.618_034), along(0.414_214), along(0.732_051))
    }

    fn keeps_sides(csg: &Csg, god: &God, i: u32) {
        let before = csg.patches.iter().map(|patch| patch.level(&god.point_B) <= 0.0);
        let held: Vec<_> = god.held_by().map(|index| usize::from(god.near.number(index))).collect();
        let radius_m = god.clearing.radius_m();
        if radius_m == 0.0 {
            return;
        }
        for j in 0..20 {
            let p = god.point_B + point(9 * i + j).normalize() * radius_m * 0.999_999;
            assert!(god.clearing.holds(&p) && god.near.holds(&p, 0.0));
            for (number, was_inside) in before.clone().enumerate().filter(|(n, _)| !held.contains(n)) {
                let level_m = csg.patches[number].level(&p);
                let is_relevant = god.near.position(number as u16).is_some();
                assert!(!is_relevant || (level_m <= 0.0) == was_inside, "{number} {level_m} {god:?}");
                assert!(!is_relevant || level_m.abs() > csg.tolerance_m());
            }
        }
    }

    #[test]
    fn in_a_clearing_all_patches_keep_their_side_but_those_that_hold() {
        let csg = plate();
        let (mut clear, mut ahead) = ([0; 3], 0);
        for i in 0..4000 {
            let hip_B = point(i).component_mul(&Vector3::new(0.03, 0.005, 0.03));
            let Some(mut god) = csg.is_inside(&hip_B).then(|| way_out(&csg, &hip_B)).flatten() else {
                continue;
            };
            if stand(&csg, &mut god, &input(hip_B)).is_none() || god.clearing.radius_m() == 0.0 {
                continue;
            }
            clear[god.active.count_ones() as usize] += 1;
            keeps_sides(&csg, &god, i);
            // The same of what it knows from somewhere else in its clearing.
            let aside_B = god.point_B + point(i + 1) * (0.5 * god.clearing.radius_m());
            god.point_B = settle(&csg, &god, god.active, &aside_B, &hip_B);
            god.look_ahead(&csg);
            keeps_sides(&csg, &god, i);
            ahead += usize::from(god.clearing.radius_m() > 0.0);
        }
        assert!(ahead > 1000, "{ahead}");
        assert!(clear[1] > 1000, "{clear:?}");
    }
}
