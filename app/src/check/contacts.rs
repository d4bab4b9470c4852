//! Contacts between entities: what begins in something else, and what sinks into it.
//!
//! Model: a thing is pressed into what it rests on by its own weight at least, and by that of all that moves at most. The stiffness
//! is that of a run ([`Contacts`]), on one point.

use crate::rig::Rig;
use haptics::mesh::Sides;
use haptics::{Entity, Shape};
use physics::collide::{ContactPoints, PairMemory, Solid, bounding_ball, contact_points, is_collidable};
use physics::{Aabb, Contacts};

/// Warnings of them.
pub(super) fn all(rig: &Rig, entities: &[Entity]) -> Vec<String> {
    let mut weights_n = vec![0.0; entities.len()];
    let gravity_m_s2 = rig.scene.gravity_m_s2.norm();
    rig.masses(entities).for_each(|(index, mass_kg)| weights_n[index] = mass_kg * gravity_m_s2);
    let looks = Looks { rig, entities, contacts: rig.contacts(entities), weights_n };
    let mut found = Vec::new();
    looks.told(|a, b| looks.overlap(a, b), "begin in each other", &mut found);
    looks.told(|a, b| looks.sinks(a, b), "sink into each other", &mut found);
    found
}

/// Things that are looked at.
struct Looks<'a> {
    rig: &'a Rig,
    entities: &'a [Entity],
    contacts: Contacts,
    weights_n: Vec<f64>,
}

impl Looks<'_> {
    /// A few of the pairs that begin near each other, and how many more there are.
    fn told(&self, says: impl Fn(usize, usize) -> Option<String>, what: &str, found: &mut Vec<String>) {
        let (mut pairs, begun) = (0_usize, found.len());
        near_pairs(self.rig, self.entities, |a, b| {
            if let Some(line) = says(a, b) {
                pairs += 1;
                if pairs <= MOST_TOLD {
                    found.push(line);
                }
            }
        });
        let told = found.len() - begun;
        if pairs > told {
            found.push(format!("and {} more pairs {what}", pairs - told));
        }
    }

    /// It begins deeper than all weights together bring it.
    fn overlap(&self, a: usize, b: usize) -> Option<String> {
        let depth_m = depth(&self.entities[a], &self.entities[b]);
        let all_n: f64 = self.weights_n.iter().sum();
        let [name, other] = self.names([a, b]);
        (depth_m > (all_n / self.stiffness_n_per_m(a, b)).max(LEAST_DEPTH_M))
            .then(|| format!("{name} begins {:.2} mm deep in {other}, and will be pushed out", depth_m * 1e3))
    }

    /// On one point its own weight brings it deeper than a quarter of how thick the thinner one is: a little more, and it falls through.
    fn sinks(&self, a: usize, b: usize) -> Option<String> {
        let stiffness_n_per_m = self.stiffness_n_per_m(a, b);
        let sinks_m = self.weights_n[a] / stiffness_n_per_m;
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
                 ({stiffness_n_per_m:.0} N/m a point); say `contact_stiffness = {{ kind = \"by-mass\" }}` at the top of \
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

fn depth(a: &Entity, b: &Entity) -> f64 {
    let (a, b) = if is_collidable(&a.shape, &b.shape) { (a, b) } else { (b, a) };
    if !is_collidable(&a.shape, &b.shape) {
        return 0.0;
    }
    let (mut memory, mut points) = (PairMemory::default(), ContactPoints::default());
    let solid = |entity| -> Solid<'_> {
        let entity: &Entity = entity;
        Solid { shape: &entity.shape, X_W: &entity.X_WB }
    };
    contact_points(solid(a), solid(b), 0.0, &mut memory, &mut points);
    points.as_slice().iter().map(|point| -point.gap_m).fold(0.0, f64::max)
}

/// A tenth of a millimetre is what rounding in a file leaves.
const LEAST_DEPTH_M: f64 = 1e-4;
const SHARE_OF_THICKNESS: f64 = 0.25;
/// By mass nothing rests deeper: `g / (1000 / s)^2`, and roundings.
const DEPTH_BY_MASS_M: f64 = 1e-5;
const MOST_TOLD: usize = 10;
