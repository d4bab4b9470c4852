//! Contacts between entities: what begins in something else, and what sinks into it.
//!
//! Model: a thing is pressed into what it touches below it by its own weight and by what stands on it, in equal shares; what
//! touches nothing will come down on what is the first below it. The stiffness is that of a run ([`Contacts`]), on one
//! point.

#![allow(non_snake_case)] // Frames are capital letters.

use crate::rig::{Rig, in_words};
use haptics::mesh::Sides;
use haptics::{Entity, Form, Plane, Shape};
use nalgebra::{Isometry3, Vector3};
use physics::collide::{ContactPoints, PairMemory, Solid, bounding_ball, contact_points, is_collidable};
use physics::{Aabb, Contacts};

/// Warnings of them.
pub(super) fn all(rig: &Rig, entities: &[Entity], pairs: &[Pair]) -> Vec<String> {
    let mut weights_n = vec![0.0; entities.len()];
    let gravity_m_s2 = rig.scene.gravity_m_s2.norm();
    rig.masses(entities).for_each(|(index, mass_kg)| weights_n[index] = mass_kg * gravity_m_s2);
    let heaviest_kg = rig.masses(entities).map(|(_, mass_kg)| mass_kg).fold(0.0, f64::max);
    let looks = Looks { rig, entities, contacts: rig.contacts(entities), weights_n, heaviest_kg };
    let mut found = told(pairs.iter().filter_map(|pair| looks.overlap(pair)), "begin in each other");
    let (stands, falls) = looks.stands(pairs);
    if !falls.is_empty() {
        let names: Vec<String> = falls.iter().map(|&index| rig.scene.entities[index].name.clone()).collect();
        found.push(format!(
            "nothing is below {}: it falls, unless a finger or a field holds it",
            in_words(&names)
        ));
    }
    found.extend(told(stands.iter().filter_map(|stand| looks.sinks(stand)), "sink into each other"));
    found
}

/// A few of them, and how many more there are.
fn told(lines: impl Iterator<Item = String>, what: &str) -> Vec<String> {
    let mut told: Vec<String> = lines.collect();
    let more = told.len().saturating_sub(MOST_TOLD);
    if more > 0 {
        told.truncate(MOST_TOLD);
        told.push(format!("and {more} more pairs {what}"));
    }
    told
}

/// All that are near each other.
pub(super) fn pairs(rig: &Rig, entities: &[Entity]) -> Vec<Pair> {
    let mut pairs = Vec::new();
    near_pairs(rig, entities, |a, b| {
        let (gap_m, normal_W) = nearest(&entities[a], &entities[b]);
        pairs.push(Pair { one: a, other: b, gap_m, normal_W });
    });
    pairs
}

/// Two that are near each other; the first one moves.
pub(super) struct Pair {
    pub(super) one: usize,
    pub(super) other: usize,
    /// Negative where they overlap; infinite where they are farther apart than [`TOUCH_M`].
    gap_m: f64,
    /// There, to the first one.
    normal_W: Vector3<f64>,
}

impl Pair {
    pub(super) fn touches(&self) -> bool {
        self.gap_m <= TOUCH_M
    }
}

/// A thing that stands or will fall on something else.
struct Stand {
    upper: usize,
    lower: usize,
    load_n: f64,
}

/// Things that are looked at.
struct Looks<'a> {
    rig: &'a Rig,
    entities: &'a [Entity],
    contacts: Contacts,
    weights_n: Vec<f64>,
    heaviest_kg: f64,
}

impl Looks<'_> {
    /// It begins deeper than all weights together bring it.
    fn overlap(&self, pair: &Pair) -> Option<String> {
        let (a, b, depth_m) = (pair.one, pair.other, -pair.gap_m);
        let all_n: f64 = self.weights_n.iter().sum();
        let [name, other] = self.names([a, b]);
        (depth_m > (all_n / self.stiffness_n_per_m(a, b)).max(LEAST_DEPTH_M))
            .then(|| format!("{name} begins {:.2} mm deep in {other}, and will be pushed out", depth_m * 1e3))
    }

    /// All that stands on something, from above to below, with the load there; and things that fall for ever.
    fn stands(&self, pairs: &[Pair]) -> (Vec<Stand>, Vec<usize>) {
        let up_W = -self.rig.scene.gravity_m_s2.try_normalize(0.0).unwrap_or_default();
        let height = |index: usize| {
            let around = Aabb::of_entity(&self.entities[index]);
            around.map_or(f64::NEG_INFINITY, |around| around.middle_W().dot(&up_W))
        };
        let is_body = |index: usize| self.weights_n[index] > 0.0;
        let mut below: Vec<Vec<(f64, usize)>> = vec![Vec::new(); self.entities.len()];
        for pair in pairs.iter().filter(|pair| pair.touches()) {
            let is_above = pair.normal_W.dot(&up_W);
            let (upper, lower) =
                if is_above >= 0.0 { (pair.one, pair.other) } else { (pair.other, pair.one) };
            if is_body(upper) && is_above.abs() > BESIDE {
                below[upper].push((pair.gap_m, lower));
            }
        }
        let mut order: Vec<usize> = (0..self.entities.len()).filter(|&index| is_body(index)).collect();
        order.sort_by(|&a, &b| height(b).total_cmp(&height(a)));
        let (mut loads_n, mut stands, mut falls) = (self.weights_n.clone(), Vec::new(), Vec::new());
        for upper in order {
            // Of what is not quite touched, what is reached first carries it.
            let least_m = below[upper].iter().map(|(gap_m, _)| *gap_m).fold(f64::INFINITY, f64::min);
            let mut carries: Vec<usize> = below[upper]
                .iter()
                .filter(|(gap_m, _)| *gap_m < least_m + AT_ONCE_M)
                .map(|one| one.1)
                .collect();
            if carries.is_empty() {
                match self.first_below(upper, &up_W) {
                    Some(lower) => carries.push(lower),
                    None => falls.push(upper),
                }
            }
            let load_n = loads_n[upper] / carries.len() as f64;
            for lower in carries {
                loads_n[lower] += load_n;
                stands.push(Stand { upper, lower, load_n });
            }
        }
        (stands, falls)
    }

    /// The entity that it would come down on from its place.
    fn first_below(&self, upper: usize, up_W: &Vector3<f64>) -> Option<usize> {
        let (entity, around) = (&self.entities[upper], Aabb::of_entity(&self.entities[upper])?);
        let falls_m = |other: usize| {
            let b = &self.entities[other];
            let meets = other != upper && b.is_collidable && b.space == entity.space;
            if !meets || !(is_collidable(&entity.shape, &b.shape) || is_collidable(&b.shape, &entity.shape)) {
                return None;
            }
            match &b.shape {
                Shape::Form(Form::Plane(plane)) => falls_on_plane(&around, b, plane, up_W),
                _ => falls_on_box(&around, &Aabb::of_entity(b)?, up_W),
            }
        };
        let all = (0..self.entities.len()).filter_map(|other| Some((falls_m(other)?, other)));
        all.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, other)| other)
    }

    /// On one point it is brought deeper than a quarter of how thick the thinner one is: a little more, and it falls through.
    fn sinks(&self, stand: &Stand) -> Option<String> {
        let &Stand { upper: a, lower: b, load_n } = stand;
        let stiffness_n_per_m = self.stiffness_n_per_m(a, b);
        let sinks_m = load_n / stiffness_n_per_m;
        let thickness_m =
            [a, b].into_iter().filter_map(|index| self.thickness_m(index)).fold(f64::INFINITY, f64::min);
        let [name, other] = self.names([a, b]);
        let sinks_m = Some(sinks_m).filter(|sinks_m| *sinks_m > SHARE_OF_THICKNESS * thickness_m)?;
        // As stiff as by mass, or stiffer, it sinks in for being thin.
        let is_by_mass = stiffness_n_per_m >= 0.999 * BY_MASS_N_PER_M_KG * self.heaviest_kg;
        Some(if is_by_mass {
            format!(
                "{name} and {other}: the thinner one is {:.3} mm thick, and contacts are {:.3} mm deep at rest; make it thicker",
                thickness_m * 1e3,
                sinks_m * 1e3
            )
        } else {
            format!(
                "{name} sinks {:.2} mm into {other} where it stands on one point, {:.2} mm on four, as soft as it is \
                 ({stiffness_n_per_m:.0} N/m a point, {load_n:.2} N); say `contact_stiffness = {{ kind = \"by-mass\" }}` at the top of \
                 the scene, or give {name} a larger `contact_stiffness_n_per_m`",
                sinks_m * 1e3,
                0.25 * sinks_m * 1e3
            )
        })
    }

    fn stiffness_n_per_m(&self, a: usize, b: usize) -> f64 {
        self.contacts.between(&self.entities[a], &self.entities[b]).0
    }

    /// Least side of its own box; `None`: it has no end, or is a sheet, through which nothing sinks.
    fn thickness_m(&self, index: usize) -> Option<f64> {
        let is_sheet =
            matches!(&self.entities[index].shape, Shape::Mesh(mesh) if mesh.sides() == Sides::Sheet);
        if is_sheet {
            return None;
        }
        let around = Aabb::of_shape(&self.entities[index].shape, &Isometry3::identity())?;
        Some((around.high_W - around.low_W).min())
    }

    fn names(&self, indices: [usize; 2]) -> [&str; 2] {
        indices.map(|index| self.rig.scene.entities[index].name.as_str())
    }
}

/// Way of a box until it is on a half-space (m); `None`: it never is.
fn falls_on_plane(around: &Aabb, entity: &Entity, plane: &Plane, up_W: &Vector3<f64>) -> Option<f64> {
    let normal_W = entity.X_WB.rotation * plane.normal_B();
    let half_m = (around.high_W - around.low_W).abs() * 0.5;
    let from_W = around.middle_W() - entity.X_WB.translation.vector;
    let above_m = normal_W.dot(&from_W) - plane.offset_m() - normal_W.abs().dot(&half_m);
    let down = normal_W.dot(up_W);
    (down > BESIDE).then_some((above_m / down).max(0.0))
}

/// Way of a box until it is on another one (m); `None`: it never is.
fn falls_on_box(around: &Aabb, other: &Aabb, up_W: &Vector3<f64>) -> Option<f64> {
    let (mut first_m, mut last_m) = (0.0_f64, f64::INFINITY);
    for axis in 0..3 {
        let [near_m, far_m] =
            [other.low_W[axis] - around.high_W[axis], other.high_W[axis] - around.low_W[axis]];
        let down = -up_W[axis];
        if down.abs() < 1e-9 {
            if near_m > 0.0 || far_m < 0.0 {
                return None;
            }
            continue;
        }
        let ends_m = [near_m / down, far_m / down];
        first_m = first_m.max(ends_m[0].min(ends_m[1]));
        last_m = last_m.min(ends_m[0].max(ends_m[1]));
    }
    // What it is in already it does not fall on.
    (first_m <= last_m && last_m > 0.0).then_some(first_m)
}

/// Each pair of which one moves, whose bounding balls meet, once; the one that moves first.
fn near_pairs(rig: &Rig, entities: &[Entity], mut meet: impl FnMut(usize, usize)) {
    let is_body = |index: usize| rig.scene.entities[index].motion.is_some();
    let balls: Vec<_> = entities
        .iter()
        .map(|entity| {
            bounding_ball(&entity.shape).map(|(c, r)| (entity.X_WB.transform_point(&c.into()).coords, r))
        })
        .collect();
    // Swept along x: what has no end is near to everything.
    let mut order: Vec<usize> = (0..entities.len()).filter(|&index| entities[index].is_collidable).collect();
    let begin = |index: usize| balls[index].map_or(f64::NEG_INFINITY, |(centre, radius)| centre.x - radius);
    let end = |index: usize| balls[index].map_or(f64::INFINITY, |(centre, radius)| centre.x + radius);
    order.sort_by(|&a, &b| begin(a).total_cmp(&begin(b)).then(a.cmp(&b)));
    let mut open: Vec<usize> = Vec::new();
    for &next in &order {
        open.retain(|&other| end(other) >= begin(next));
        for &other in &open {
            let apart = balls[other].zip(balls[next]).is_some_and(|((p, r), (q, s))| (p - q).norm() > r + s);
            match (is_body(next), is_body(other)) {
                _ if apart || entities[other].space != entities[next].space => {}
                (true, _) => meet(next, other),
                (false, true) => meet(other, next),
                _ => {}
            }
        }
        open.push(next);
    }
}

/// Distance of the two where they are nearest to each other (m), and the normal to the first one there.
fn nearest(a: &Entity, b: &Entity) -> (f64, Vector3<f64>) {
    let far = (f64::INFINITY, Vector3::zeros());
    let is_turned = !is_collidable(&a.shape, &b.shape);
    let (a, b) = if is_turned { (b, a) } else { (a, b) };
    if !is_collidable(&a.shape, &b.shape) {
        return far;
    }
    let (mut memory, mut points) = (PairMemory::default(), ContactPoints::default());
    let solid = |entity| -> Solid<'_> {
        let entity: &Entity = entity;
        Solid { shape: &entity.shape, X_W: &entity.X_WB }
    };
    contact_points(solid(a), solid(b), TOUCH_M, &mut memory, &mut points);
    let nearest = points.as_slice().iter().min_by(|a, b| a.gap_m.total_cmp(&b.gap_m));
    nearest.map_or(far, |point| (point.gap_m, if is_turned { -point.normal_W } else { point.normal_W }))
}

/// Things that are nearer stand on each other \[m\].
const TOUCH_M: f64 = 1e-3;
/// Things that are farther by less are reached at once \[m\].
const AT_ONCE_M: f64 = 1e-5;
/// Cosine between a normal and what is up where nothing is carried.
const BESIDE: f64 = 0.2;
/// A tenth of a millimetre is what rounding in a file leaves.
const LEAST_DEPTH_M: f64 = 1e-4;
const SHARE_OF_THICKNESS: f64 = 0.25;
/// Stiffness of a contact by mass, of each kilogramme \[N/(m kg)\].
const BY_MASS_N_PER_M_KG: f64 = 1e6;
const MOST_TOLD: usize = 10;
