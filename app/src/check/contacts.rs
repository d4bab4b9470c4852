//! Contacts between entities: what begins in something else, and what sinks into it.
//!
//! Model: a thing is pressed into what it touches below it by its own weight and by what stands on it, in equal shares; what touches
//! nothing will come down on what is near. The stiffness is that of a run ([`Contacts`]), on one point.

#![allow(non_snake_case)] // Frames are capital letters.

use crate::rig::Rig;
use haptics::mesh::Sides;
use haptics::{Entity, Shape};
use nalgebra::Vector3;
use physics::collide::{ContactPoints, PairMemory, Solid, bounding_ball, contact_points, is_collidable};
use physics::{Aabb, Contacts};

/// Warnings of them.
pub(super) fn all(rig: &Rig, entities: &[Entity]) -> Vec<String> {
    let mut weights_n = vec![0.0; entities.len()];
    let gravity_m_s2 = rig.scene.gravity_m_s2.norm();
    rig.masses(entities).for_each(|(index, mass_kg)| weights_n[index] = mass_kg * gravity_m_s2);
    let mut pairs = Vec::new();
    near_pairs(rig, entities, |a, b| {
        let (gap_m, normal_W) = nearest(&entities[a], &entities[b]);
        pairs.push(Pair { one: a, other: b, gap_m, normal_W });
    });
    let looks = Looks { rig, entities, contacts: rig.contacts(entities), weights_n };
    let mut found = told(pairs.iter().filter_map(|pair| looks.overlap(pair)), "begin in each other");
    let stands = looks.stands(&pairs);
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

/// Two that are near each other; the first one moves.
struct Pair {
    one: usize,
    other: usize,
    /// Negative where they overlap; infinite where they are farther apart than [`TOUCH_M`].
    gap_m: f64,
    /// There, to the first one.
    normal_W: Vector3<f64>,
}

/// What stands or will fall on something else.
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

    /// Who stands on whom, from above to below, each with what presses there.
    fn stands(&self, pairs: &[Pair]) -> Vec<Stand> {
        let up_W = -self.rig.scene.gravity_m_s2.try_normalize(0.0).unwrap_or_default();
        let height = |index: usize| {
            let around = Aabb::of_entity(&self.entities[index]);
            around.map_or(f64::NEG_INFINITY, |around| around.middle_W().dot(&up_W))
        };
        let is_body = |index: usize| self.weights_n[index] > 0.0;
        let mut touches = vec![false; self.entities.len()];
        for pair in pairs.iter().filter(|pair| pair.gap_m <= TOUCH_M) {
            [pair.one, pair.other].into_iter().for_each(|index| touches[index] = true);
        }
        let mut below = vec![Vec::new(); self.entities.len()];
        for &Pair { one, other, gap_m, ref normal_W } in pairs {
            let is_above = if gap_m <= TOUCH_M { normal_W.dot(&up_W) } else { height(one) - height(other) };
            let (upper, lower) = if is_above >= 0.0 { (one, other) } else { (other, one) };
            let stands = gap_m <= TOUCH_M && is_above.abs() > BESIDE;
            if is_body(upper) && (stands || !touches[upper]) {
                below[upper].push(lower);
            }
        }
        let mut order: Vec<usize> = (0..self.entities.len()).filter(|&index| is_body(index)).collect();
        order.sort_by(|&a, &b| height(b).total_cmp(&height(a)));
        let (mut loads_n, mut stands) = (self.weights_n.clone(), Vec::new());
        for upper in order {
            // What is in the air comes down on one of them.
            let share = if touches[upper] { below[upper].len() as f64 } else { 1.0 };
            let load_n = loads_n[upper] / share;
            for &lower in &below[upper] {
                if is_body(lower) && touches[upper] {
                    loads_n[lower] += load_n;
                }
                stands.push(Stand { upper, lower, load_n });
            }
        }
        stands
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
        let is_by_mass = sinks_m < DEPTH_BY_MASS_M;
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

    /// Least side of the box around it; `None`: it has no end, or is a sheet, through which nothing sinks.
    fn thickness_m(&self, index: usize) -> Option<f64> {
        let is_sheet =
            matches!(&self.entities[index].shape, Shape::Mesh(mesh) if mesh.sides() == Sides::Sheet);
        if is_sheet {
            return None;
        }
        Aabb::of_entity(&self.entities[index]).map(|around| (around.high_W - around.low_W).min())
    }

    fn names(&self, indices: [usize; 2]) -> [&str; 2] {
        indices.map(|index| self.rig.scene.entities[index].name.as_str())
    }
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

/// Where they are nearest to each other: how far apart they are there (m), and the normal to the first one.
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

/// What is nearer stands on each other \[m\].
const TOUCH_M: f64 = 1e-3;
/// Cosine between a normal and what is up where nothing is carried.
const BESIDE: f64 = 0.2;
/// A tenth of a millimetre is what rounding in a file leaves.
const LEAST_DEPTH_M: f64 = 1e-4;
const SHARE_OF_THICKNESS: f64 = 0.25;
/// By mass nothing rests deeper: `g / (1000 / s)^2`, and roundings.
const DEPTH_BY_MASS_M: f64 = 1e-5;
const MOST_TOLD: usize = 10;
