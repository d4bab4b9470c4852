//! Contacts between entities: what begins in something else, and what sinks into it.
//!
//! Model: a thing sinks in by its [load](super::stands) on one point, whose stiffness is that of a run ([`Contacts`]).

#![allow(non_snake_case)] // Frames are capital letters.

use super::near::Pair;
use super::stands::{self, Stand};
use crate::rig::{Rig, in_words};
use haptics::mesh::Sides;
use haptics::{Entity, Shape};
use nalgebra::Isometry3;
use physics::{Aabb, BroadPhase, ContactStiffness, Contacts};

/// Warnings of them.
pub(super) fn all(rig: &Rig, entities: &[Entity], pairs: &[Pair], boxes: &BroadPhase) -> Vec<String> {
    let mut weights_n = vec![0.0; entities.len()];
    let gravity_m_s2 = rig.scene.gravity_m_s2.norm();
    rig.masses(entities).for_each(|(index, mass_kg)| weights_n[index] = mass_kg * gravity_m_s2);
    let heaviest_kg = rig.masses(entities).map(|(_, mass_kg)| mass_kg).fold(0.0, f64::max);
    let all_n = weights_n.iter().sum();
    let looks = Looks { rig, entities, contacts: rig.contacts(entities), weights_n, all_n, heaviest_kg };
    let mut found = told(pairs.iter().filter_map(|pair| looks.overlap(pair)), "begin in each other");
    let up_W = -rig.scene.gravity_m_s2.try_normalize(0.0).unwrap_or_default();
    let (stands, falls) = stands::all((entities, boxes), pairs, &looks.weights_n, &up_W);
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

/// Things that are looked at.
struct Looks<'a> {
    rig: &'a Rig,
    entities: &'a [Entity],
    contacts: Contacts,
    weights_n: Vec<f64>,
    /// Sum of them.
    all_n: f64,
    heaviest_kg: f64,
}

impl Looks<'_> {
    /// It begins deeper than all weights together bring it.
    fn overlap(&self, pair: &Pair) -> Option<String> {
        let (a, b, depth_m) = (pair.one, pair.other, -pair.gap_m);
        let [name, other] = self.names([a, b]);
        (depth_m > (self.all_n / self.stiffness_n_per_m(a, b)).max(LEAST_DEPTH_M))
            .then(|| format!("{name} begins {:.2} mm deep in {other}, and will be pushed out", depth_m * 1e3))
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
        let is_by_mass = stiffness_n_per_m >= 0.999 * ContactStiffness::by_mass_n_per_m(self.heaviest_kg);
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

/// A tenth of a millimetre is what rounding in a file leaves.
const LEAST_DEPTH_M: f64 = 1e-4;
const SHARE_OF_THICKNESS: f64 = 0.25;
const MOST_TOLD: usize = 10;
