//! Places where a finger feels several things at once: whether the loop stands their sum.
//!
//! Model: a finger is put to places in and about each thing that another one reaches into, and to places that several
//! fields and guides have in common. There stiffness and damping add up as matrices, contacts along their normals,
//! `K = sum k n n'`, effects as their [`Gains`]; masses of inertial fields as numbers. The largest eigenvalue is what the
//! loop feels along its axis. Contacts are judged by what the loop stands, as single ones are; effects, and the damping of
//! everything, by the [`Limits`] that single ones are refused above: each counts by its share of its own limit. Forces of
//! constant fields, guides and magnets add up as vectors, and vibrations with their amplitudes along the normals, to and fro;
//! their sum is judged by what one field may pull.
//! Cost: some hundred places for each thing that others reach into, and none for things that lie apart; of heaps, one in so many
//! of these that all things are touched [`MOST_LOOKS`] times or less, which is told; of effects, as many groups as there are
//! effects, or pairs of a few, and of constant fields one more for each, along its force.

#![allow(non_snake_case)] // Frames are capital letters.

use super::common_places::{
    Effect, climbed, common_places, directions, forceful_places, places_in, spread_places, strained_places,
};
use super::warnings::Stands;
use super::whereabouts::Whereabouts;
use crate::rig::{Rig, in_words};
use haptics::{
    Entity, Field, FieldKind, Finger, Gains, Guide, Hip, Limits, MOST_FORCE_N, Shape, Surface, WORLD,
};
use nalgebra::{Matrix3, Vector3};
use physics::collide::bounding_ball;
use std::collections::BTreeMap;

/// Warnings of them, of the largest sums first.
pub(super) fn too_much(rig: &Rig, entities: &[Entity], stands: &mut Stands) -> Vec<String> {
    let Some(world) = World::of(rig, entities) else { return Vec::new() };
    let mut found = Found::default();
    let (near_all, radii) = (neighbours(entities), radii(rig));
    let every = every(&near_all, radii.len());
    let every_alone = every_alone(&near_all, radii.len(), world.fields.len() + world.guides.len());
    let common = world.places_of_effects();
    let looks = common.len() * radii.len() * (world.fields.len() + world.guides.len() + FEW_THINGS);
    let every_common = looks.div_ceil(MOST_COMMON_LOOKS).max(1);
    for radius_m in radii {
        for (index, near) in near_all.iter().enumerate().filter(|(_, near)| !near.is_empty()) {
            let above = drawn_at(&entities[index], radius_m);
            let all = places(&entities[index]).into_iter().chain(above);
            let every = if near.len() > 1 { every } else { every_alone };
            for place_W in all.skip(index % every).step_by(every) {
                world.judge((near, entities[index].space), radius_m, &place_W, stands, &mut found);
            }
        }
        for place_W in common.iter().step_by(every_common) {
            let near = world.near(place_W, radius_m);
            world.judge((&near, WORLD), radius_m, place_W, stands, &mut found);
        }
    }
    let mut told = found.told(|thing| world.name(thing));
    if every > 1 {
        told.push(format!(
            "so much reaches into other things here that one place in {every} was looked at for what is too strong together"
        ));
    }
    let every_of_effects = every_common.max(every_alone);
    if every_of_effects > 1 {
        told.push(format!(
            "so many fields and guides meet so many things here that one place in {every_of_effects} was looked at for what is too \
             strong together"
        ));
    }
    told
}

/// One in so many places is looked at, where so many things reach into each one, for so many sizes of fingers.
fn every(near: &[Vec<u32>], radii: usize) -> usize {
    let crowded = near.iter().map(Vec::len).filter(|things| *things > 1);
    let looks = crowded.sum::<usize>() * PLACES * radii;
    looks.div_ceil(MOST_LOOKS).max(1)
}

/// The same of things that nothing else reaches into, but perhaps so many effects.
fn every_alone(near: &[Vec<u32>], radii: usize, effects: usize) -> usize {
    let alone = near.iter().filter(|things| things.len() == 1).count();
    let looks = alone * PLACES * radii * (effects + FEW_THINGS);
    if effects == 0 { 1 } else { looks.div_ceil(MOST_LOOKS_ALONE).max(1) }
}

/// All that fingers feel.
struct World<'a> {
    rig: &'a Rig,
    entities: &'a [Entity],
    fields: Vec<Field>,
    guides: Vec<Guide>,
    /// Of entities' magnets and damping, of each field and of each guide.
    limits: (Limits, Vec<Limits>, Vec<Limits>),
    /// Of entities of the world itself that fingers feel, with what their magnets reach.
    whereabouts: Whereabouts,
}

/// A kind of sum, with what it does where it is too large and its unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Contacts,
    Stiffness,
    Damping,
    Mass,
    Force,
}

/// A sum at a place, along its largest axis.
#[derive(Debug, Clone, Copy)]
struct Sum {
    /// In the kind's unit.
    value: f64,
    limit: f64,
    place_W: Vector3<f64>,
}

/// Things that a finger touches at a place, and those that act on it without.
#[derive(Debug, Default)]
struct Touched {
    contacts: Vec<(usize, Gains)>,
    /// Of entities that draw it.
    magnets: Vec<(usize, Gains)>,
    /// Their pulls (N).
    drawn: Vec<(usize, Vector3<f64>)>,
    /// Amplitudes along the normals of what is touched (N).
    vibrations: Vec<(usize, Vector3<f64>)>,
}

/// The largest of each kind and group of things.
#[derive(Debug, Default)]
struct Found(BTreeMap<(Kind, Vec<usize>), Sum>);

impl<'a> World<'a> {
    /// `None`: there are effects that cannot be made, which is told elsewhere.
    fn of(rig: &'a Rig, entities: &'a [Entity]) -> Option<Self> {
        let (fields, guides) = rig.effects().ok()?;
        let of_mass = |mass_kg: f64| rig.limits(mass_kg).ok();
        let of_fields =
            rig.scene.fields.iter().map(|spec| of_mass(spec.device_mass_kg)).collect::<Option<_>>()?;
        let of_guides =
            rig.scene.guides.iter().map(|spec| of_mass(spec.device_mass_kg)).collect::<Option<_>>()?;
        let limits = (of_mass(Limits::DEFAULT_DEVICE_MASS_KG)?, of_fields, of_guides);
        let felt =
            entities.iter().enumerate().filter(|(_, entity)| entity.is_haptic && entity.space == WORLD);
        let ball = |entity: &Entity| {
            let (centre_B, radius_m) = bounding_ball(&entity.shape)?;
            let reach_m = entity.magnetism.map_or(0.0, |magnetism| magnetism.distance_m());
            Some((entity.X_WB.transform_point(&centre_B.into()).coords, radius_m + reach_m))
        };
        let whereabouts = Whereabouts::of(felt.map(|(at, entity)| (at as u32, ball(entity))));
        Some(Self { rig, entities, fields, guides, limits, whereabouts })
    }

    /// Things are counted through: entities, fields, guides.
    fn name(&self, thing: usize) -> String {
        let (entities, fields) = (self.entities.len(), self.fields.len());
        match thing {
            entity if entity < entities => self.rig.scene.entities[entity].name.clone(),
            field if field < entities + fields => format!("field[{}]", field - entities),
            guide => format!("guide[{}]", guide - entities - fields),
        }
    }

    fn judge(
        &self,
        (near, space): (&[u32], u32),
        radius_m: f64,
        place_W: &Vector3<f64>,
        stands: &mut Stands,
        found: &mut Found,
    ) {
        let effects = self.effects_at(place_W);
        let pulls = self.pulls_at(place_W);
        let magnets = near.iter().filter(|&&at| self.entities[at as usize].magnetism.is_some()).count();
        if near.len() + effects.len() + pulls.len() + magnets < 2 {
            return;
        }
        let Touched { contacts, magnets, drawn, vibrations } = self.touched((near, space), radius_m, place_W);
        let (_, of_fields, of_guides) = &self.limits;
        let mut add = |kind, sum: Option<(Vec<usize>, f64, f64)>| {
            if let Some((things, value, limit)) = sum {
                found.add(kind, things, Sum { value, limit, place_W: *place_W });
            }
        };
        add(Kind::Contacts, of_contacts(&contacts, stands));
        let limit_of = |thing: usize| match thing.checked_sub(self.entities.len()) {
            None => &self.limits.0,
            Some(field) => of_fields.get(field).unwrap_or_else(|| &of_guides[field - of_fields.len()]),
        };
        let pulling: Vec<_> = effects.iter().chain(&magnets).copied().collect();
        let stiffness = |(thing, gains): &(usize, Gains)| {
            (*thing, gains.stiffness_n_per_m, limit_of(*thing).stiffness_n_per_m())
        };
        add(Kind::Stiffness, beyond(&pulling.iter().map(stiffness).collect::<Vec<_>>()));
        let damping = |(thing, gains): &(usize, Gains)| {
            (*thing, gains.damping_n_s_per_m, limit_of(*thing).damping_n_s_per_m())
        };
        add(Kind::Damping, beyond(&effects.iter().chain(&contacts).map(damping).collect::<Vec<_>>()));
        let mass = |(thing, gains): &(usize, Gains)| {
            let FieldKind::Inertial { cutoff_hz, .. } =
                self.fields.get(thing.checked_sub(self.entities.len())?)?.kind()
            else {
                return None;
            };
            let mass = Matrix3::from_diagonal(&Vector3::new(gains.mass_kg, 0.0, 0.0));
            Some((*thing, mass, limit_of(*thing).mass_kg(*cutoff_hz)))
        };
        add(Kind::Mass, beyond(&effects.iter().filter_map(mass).collect::<Vec<_>>()));
        let pulls: Vec<_> = pulls.into_iter().chain(drawn).collect();
        add(Kind::Force, of_forces(&pulls, &vibrations));
    }

    /// Fields and guides that are felt at a place.
    fn effects_at(&self, place_W: &Vector3<f64>) -> Vec<(usize, Gains)> {
        // Those of a constant one are none.
        let is_constant = |field: &Field| matches!(field.kind(), FieldKind::Constant { .. });
        let fields = self.fields.iter().enumerate().filter(|(_, field)| !is_constant(field));
        let fields = fields.map(|(at, field)| (at, field.gains_at(place_W)));
        let guides = (self.fields.len()..).zip(self.guides.iter().map(|guide| guide.gains_at(place_W)));
        let all = fields.chain(guides).map(|(at, gains)| (self.entities.len() + at, gains));
        all.filter(|(_, gains)| *gains != Gains::default()).collect()
    }

    /// Forces of constant fields and of guides on a finger that rests at a place (N).
    fn pulls_at(&self, place_W: &Vector3<f64>) -> Vec<(usize, Vector3<f64>)> {
        let fields = self.fields.iter().map(|field| match field.kind() {
            FieldKind::Constant { force_W } => force_W * field.region().weight(place_W),
            _ => Vector3::zeros(),
        });
        let guides = self.guides.iter().map(|guide| guide.force_at(place_W));
        let pulls = fields.chain(guides).enumerate().map(|(at, pull_W)| (self.entities.len() + at, pull_W));
        pulls.filter(|(_, pull_W)| *pull_W != Vector3::zeros()).collect()
    }

    fn touched(&self, (near, space): (&[u32], u32), radius_m: f64, place_W: &Vector3<f64>) -> Touched {
        let within =
            near.iter().copied().filter(|&at| may_touch(&self.entities[at as usize], radius_m, place_W));
        let within: Vec<u32> = within.collect();
        let Ok(probe) = Finger::new(radius_m, within.len()) else { return Touched::default() };
        let mut probe = probe.within(space);
        probe.step_near(self.entities, &within, Hip { position_W: *place_W, velocity_W: None }, 1e-3);
        let contacts = probe.contacts().map(|contact| {
            let along: Matrix3<f64> = contact.normal_W * contact.normal_W.transpose();
            let material = self.entities[contact.entity].felt_material(contact.label);
            let gains = Gains {
                stiffness_n_per_m: along * contact.stiffness_n_per_m,
                damping_n_s_per_m: along * material.damping_n_s_per_m,
                mass_kg: 0.0,
            };
            (contact.entity, gains)
        });
        let vibrations = probe.contacts().filter_map(|contact| {
            let vibration = self.entities[contact.entity].vibration?;
            Some((contact.entity, contact.normal_W * vibration.amplitude_n()))
        });
        let magnets = near.iter().map(|&at| at as usize).filter(|&at| probe.contact(at).is_none());
        let magnets: Vec<usize> = magnets.filter(|&at| self.entities[at].magnetism.is_some()).collect();
        let drawn = magnets.iter().map(|&at| (at, self.entities[at].magnet_force_at(place_W, radius_m)));
        let drawn = drawn.filter(|(_, pull_W)| *pull_W != Vector3::zeros()).collect();
        let magnets = magnets.iter().map(|&at| (at, self.entities[at].magnet_gains_at(place_W, radius_m)));
        Touched {
            drawn,
            contacts: contacts.collect(),
            magnets: magnets.filter(|(_, gains)| *gains != Gains::default()).collect(),
            vibrations: vibrations.collect(),
        }
    }

    /// Places that several effects have in common with each other and with entities, and those near them where forces are
    /// largest.
    fn places_of_effects(&self) -> Vec<Vector3<f64>> {
        let fields = self.fields.iter().map(Effect::Field);
        let effects: Vec<Effect<'_>> = fields.chain(self.guides.iter().map(Effect::Guide)).collect();
        let mut places = common_places(&effects);
        places.extend(self.forceful_places());
        let mut strained = strained_places(&self.guides);
        let force_n = |place_W: &Vector3<f64>| -> f64 {
            self.pulls_at(place_W).iter().map(|(_, pull_W)| pull_W).sum::<Vector3<f64>>().norm()
        };
        // In nanonewtons.
        strained.sort_by_cached_key(|place_W| std::cmp::Reverse((1e9 * force_n(place_W)) as u64));
        strained.truncate(MOST_CLIMBED);
        places.extend(strained);
        places = once(places);
        let every = places.len().div_ceil(MOST_CLIMBED).max(1);
        let spread = self.spread_places(force_n);
        let begins = places.iter().step_by(every).chain(&spread);
        let climbed: Vec<_> = begins.map(|place_W| climbed(force_n, place_W)).collect();
        places.extend(climbed);
        places.extend(places_in(&effects, self.entities));
        once(places)
    }

    /// Places where constant forces add up that others take away from elsewhere.
    fn forceful_places(&self) -> Vec<Vector3<f64>> {
        let pulls = self.fields.iter().filter_map(|field| match field.kind() {
            FieldKind::Constant { force_W } => Some((field, *force_W)),
            _ => None,
        });
        forceful_places(&pulls.collect::<Vec<_>>())
    }

    /// Places all over constant fields where forces are largest: where some add up that are no group, as they meet others.
    fn spread_places(&self, force_n: impl Fn(&Vector3<f64>) -> f64) -> Vec<Vector3<f64>> {
        let is_constant = |field: &&Field| matches!(field.kind(), FieldKind::Constant { .. });
        let constant: Vec<&Field> = self.fields.iter().filter(is_constant).collect();
        // One alone is judged by itself.
        if self.fields.len() + self.guides.len() > 1 { spread_places(&constant, force_n) } else { Vec::new() }
    }

    /// Entities of the world itself that a finger may touch there.
    fn near(&self, place_W: &Vector3<f64>, radius_m: f64) -> Vec<u32> {
        self.whereabouts.near(place_W, radius_m)
    }
}

/// Each place once.
fn once(mut places: Vec<Vector3<f64>>) -> Vec<Vector3<f64>> {
    places.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z)));
    places.dedup_by(|a, b| (*a - *b).amax() < SAME_M);
    places
}

/// False where a finger of this radius is farther from a closed form than it reaches (m).
fn may_touch(entity: &Entity, radius_m: f64, place_W: &Vector3<f64>) -> bool {
    if !matches!(entity.shape, Shape::Form(_)) {
        return true;
    }
    let raised_m = entity.height_map.as_ref().map_or(0.0, |heights| heights.range_m()[1].abs());
    bounding_ball(&entity.shape).is_none_or(|(c, r)| {
        let reach_m = r + radius_m + raised_m + BELOW_M;
        (entity.X_WB.transform_point(&c.into()).coords - place_W).norm_squared() <= reach_m * reach_m
    })
}

/// Gains of contacts along the stiffest axis, and the loop's limits there.
fn of_contacts(contacts: &[(usize, Gains)], stands: &mut Stands) -> Option<(Vec<usize>, f64, f64)> {
    let total: Matrix3<f64> = contacts.iter().map(|(_, gains)| gains.stiffness_n_per_m).sum();
    let (k, axis_W) = largest(&total)?;
    let along = |of: &Matrix3<f64>| axis_W.dot(&(of * axis_W));
    let b = contacts.iter().map(|(_, gains)| along(&gains.damping_n_s_per_m)).sum();
    let part = |(thing, gains): &(usize, Gains)| (*thing, along(&gains.stiffness_n_per_m) / k);
    let things = taking_part(contacts.iter().map(part))?;
    let limit = stands.limit(b)?;
    (k > limit).then_some((things, k, limit))
}

/// Of things with their gains and limits, those that take part in a sum of shares above 1, with the sum of gains along its
/// axis and what would be stood of them.
fn beyond(all: &[(usize, Matrix3<f64>, f64)]) -> Option<(Vec<usize>, f64, f64)> {
    let total: Matrix3<f64> = all.iter().map(|(_, gain, limit)| gain / *limit).sum();
    let (share, axis_W) = largest(&total)?;
    let along = |of: &Matrix3<f64>| axis_W.dot(&(of * axis_W));
    let part = |(thing, gain, limit): &(usize, Matrix3<f64>, f64)| (*thing, along(gain) / limit / share);
    let things = taking_part(all.iter().map(part))?;
    let value: f64 = all.iter().map(|(_, gain, _)| along(gain)).sum();
    (share > 1.0 + ROUNDING).then_some((things, value, value / share))
}

/// The largest sum of pulls and of vibrations, each of which may push or pull at a time, with what one field may pull.
fn of_forces(
    pulls: &[(usize, Vector3<f64>)],
    vibrations: &[(usize, Vector3<f64>)],
) -> Option<(Vec<usize>, f64, f64)> {
    let steady_W: Vector3<f64> = pulls.iter().map(|(_, pull_W)| pull_W).sum();
    // A sum of what goes along the sum before it is no smaller.
    let larger = |sum_W: Vector3<f64>| {
        let swings = vibrations.iter().map(|(_, swing_W)| swing_W * swing_W.dot(&sum_W).signum());
        steady_W + swings.sum::<Vector3<f64>>()
    };
    let begins = vibrations.iter().flat_map(|(_, swing_W)| [*swing_W, -swing_W]).chain([steady_W]);
    let sums = begins.map(|begin_W| (0..ROUNDS).fold(begin_W, |sum_W, _| larger(sum_W)));
    let sum_W = sums.max_by(|a, b| a.norm().total_cmp(&b.norm()))?;
    let (value, along_W) = (sum_W.norm(), sum_W.try_normalize(0.0)?);
    let steady = pulls.iter().map(|(thing, pull_W)| (*thing, pull_W.dot(&along_W)));
    let swinging = vibrations.iter().map(|(thing, swing_W)| (*thing, swing_W.dot(&along_W).abs()));
    let things = taking_part(steady.chain(swinging))?;
    (value > MOST_FORCE_N * (1.0 + ROUNDING)).then_some((things, value, MOST_FORCE_N))
}

/// Largest eigenvalue, with its axis; `None` where there is none above 0.
fn largest(total: &Matrix3<f64>) -> Option<(f64, Vector3<f64>)> {
    if !total.iter().all(|value| value.is_finite()) {
        return None;
    }
    let eigen = total.symmetric_eigen();
    let at = eigen.eigenvalues.imax();
    let value = eigen.eigenvalues[at];
    (value > 0.0).then(|| (value, eigen.eigenvectors.column(at).into_owned()))
}

/// `None`: less than two.
fn taking_part(parts: impl Iterator<Item = (usize, f64)>) -> Option<Vec<usize>> {
    let parts: Vec<(usize, f64)> = parts.collect();
    let most = parts.iter().map(|(_, part)| *part).fold(0.0, f64::max);
    let taking = parts.into_iter().filter(|(_, part)| *part > TAKES_PART * most);
    let mut things: Vec<usize> = taking.map(|(thing, _)| thing).collect();
    things.sort_unstable();
    (things.len() > 1).then_some(things)
}

impl Sum {
    /// Of what is allowed.
    fn share(&self) -> f64 {
        self.value / self.limit
    }
}

impl Found {
    fn add(&mut self, kind: Kind, things: Vec<usize>, sum: Sum) {
        let kept = self.0.entry((kind, things)).or_insert(sum);
        if sum.value > kept.value {
            *kept = sum;
        }
    }

    /// Of groups within others of the same kind only the others, unless they are stronger by more than those tell: where some of a
    /// group take away, the rest is stronger beside them.
    fn told(self, name: impl Fn(usize) -> String) -> Vec<String> {
        let is_part = |(kind, things): &(Kind, Vec<usize>), sum: &Sum| {
            let holds = |((of, all), whole): (&(Kind, Vec<usize>), &Sum)| {
                of == kind
                    && all.len() > things.len()
                    && things.iter().all(|thing| all.binary_search(thing).is_ok())
                    && sum.share() <= whole.share() * (1.0 + STRONGER)
            };
            *kind != Kind::Contacts && self.0.iter().any(holds)
        };
        let mut beyond: Vec<_> = self.0.iter().filter(|(group, sum)| !is_part(group, sum)).collect();
        beyond.sort_by(|((a, _), s), ((b, _), t)| a.cmp(b).then(t.share().total_cmp(&s.share())));
        let more = beyond.len().saturating_sub(MOST_TOLD);
        let told = |((kind, things), sum): &(&(Kind, Vec<usize>), &Sum)| {
            let names: Vec<String> = things.iter().map(|&thing| name(thing)).collect();
            kind.told(&in_words(&names), sum)
        };
        let mut told: Vec<String> = beyond.iter().take(MOST_TOLD).map(told).collect();
        if more > 0 {
            told.push(format!("and {more} more groups of things are too strong together"));
        }
        told
    }
}

impl Kind {
    fn told(self, names: &str, sum: &Sum) -> String {
        let (value, limit, at) = (sum.value, sum.limit, sum.place_W);
        let [x, y, z] = [at.x, at.y, at.z].map(in_micrometres);
        let there = format!("a finger at ({x}, {y}, {z}) feels");
        match self {
            Self::Contacts => format!(
                "{names} together may buzz: {there} {value:.0} N/m of them, and a lightly held Premium stands {limit:.0}"
            ),
            Self::Stiffness => {
                format!(
                    "{names} together may swing: {there} {value:.0} N/m of them, and {limit:.0} are stable"
                )
            }
            Self::Damping => {
                format!(
                    "{names} together may swing: {there} {value:.1} N s/m of them, and {limit:.1} are stable"
                )
            }
            Self::Mass => {
                format!(
                    "{names} together may swing: {there} {value:.2} kg of them, and {limit:.2} are stable"
                )
            }
            Self::Force => {
                format!(
                    "{names} together may pull too hard: {there} {value:.1} N of them, and one field may have {limit:.1}"
                )
            }
        }
    }
}

/// Fields go from nothing to all within a millimetre or less: in millimetres a place would not have what is told of it.
fn in_micrometres(length_m: f64) -> f64 {
    // No negative zero.
    (length_m * 1e6).round() / 1e6 + 0.0
}

/// Of each entity that fingers feel, itself and those in its space that may reach into it; ascending.
fn neighbours(entities: &[Entity]) -> Vec<Vec<u32>> {
    let ball = |entity: &Entity| {
        let reach_m = entity.magnetism.map_or(0.0, |magnetism| magnetism.distance_m());
        bounding_ball(&entity.shape)
            .map(|(c, r)| (entity.X_WB.transform_point(&c.into()).coords, r + reach_m))
    };
    let balls: Vec<_> = entities.iter().map(ball).collect();
    // Swept along x: what has no end is near to everything.
    let begin = |index: usize| balls[index].map_or(f64::NEG_INFINITY, |(centre, radius)| centre.x - radius);
    let end = |index: usize| balls[index].map_or(f64::INFINITY, |(centre, radius)| centre.x + radius);
    let mut order: Vec<usize> = (0..entities.len()).filter(|&index| entities[index].is_haptic).collect();
    order.sort_by(|&a, &b| begin(a).total_cmp(&begin(b)));
    let mut near = vec![Vec::new(); entities.len()];
    let mut open: Vec<usize> = Vec::new();
    for next in order {
        open.retain(|&other| end(other) >= begin(next));
        open.push(next);
        for &other in &open {
            let apart = balls[other].zip(balls[next]).is_some_and(|((p, r), (q, s))| (p - q).norm() > r + s);
            if !apart && entities[other].space == entities[next].space {
                near[next].push(other as u32);
                if other != next {
                    near[other].push(next as u32);
                }
            }
        }
    }
    near.iter_mut().for_each(|near| near.sort_unstable());
    near
}

/// In it and about it; of what has no end, below the place nearest to its origin.
fn places(entity: &Entity) -> Vec<Vector3<f64>> {
    let place = |p_B: Vector3<f64>| entity.X_WB.transform_point(&p_B.into()).coords;
    let Some((centre_B, radius_m)) = bounding_ball(&entity.shape) else {
        let Shape::Form(form) = &entity.shape else { return Vec::new() };
        let at = form.nearest(&Vector3::zeros());
        return vec![place(at.point_B - at.normal_B * BELOW_M)];
    };
    let along = |d: Vector3<f64>| SHARES.map(|share| centre_B + d * (share * radius_m));
    directions().flat_map(along).chain([centre_B]).map(place).collect()
}

/// Place of its magnet's strongest pull: just above its surface.
fn drawn_at(entity: &Entity, finger_radius_m: f64) -> Vec<Vector3<f64>> {
    let Some(magnetism) = entity.magnetism else { return Vec::new() };
    let (centre_B, radius_m) = bounding_ball(&entity.shape).unwrap_or((Vector3::zeros(), BELOW_M));
    let above_m = finger_radius_m + ABOVE * magnetism.distance_m();
    let above = |direction: Vector3<f64>| {
        let from_B = centre_B + direction * (2.0 * radius_m + above_m);
        let at_B = match &entity.shape {
            Shape::Form(form) => form.nearest(&from_B).point_B,
            Shape::Mesh(mesh) => mesh.nearest(&from_B).point_B,
            _ => return None,
        };
        let up_B = (from_B - at_B).try_normalize(0.0)?;
        Some(entity.X_WB.transform_point(&(at_B + up_B * above_m).into()).coords)
    };
    directions().filter_map(above).collect()
}

/// Of the scene's fingers, each once.
fn radii(rig: &Rig) -> Vec<f64> {
    let mut radii: Vec<f64> = rig.scene.fingers.iter().map(|finger| finger.radius_m).collect();
    radii.sort_by(f64::total_cmp);
    radii.dedup();
    radii
}

/// Of the way from a thing's centre to the ball around it.
const SHARES: [f64; 4] = [0.25, 0.5, 0.75, 0.95];
/// As deep as a finger presses.
const BELOW_M: f64 = 1e-3;
/// Of a magnet's reach: its pull is steepest at the surface.
const ABOVE: f64 = 0.01;
/// Of what adds most along an axis: what adds less is not named.
const TAKES_PART: f64 = 0.05;
/// Of a sum: more is another one.
const STRONGER: f64 = 0.01;
/// Of making a sum of forces larger.
const ROUNDS: usize = 8;
/// Of shares that are 1 together by what a scene says.
const ROUNDING: f64 = 1e-9;
const MOST_TOLD: usize = 10;
/// Of a thing: a centre, and so many shares of the ways to the corners, edges and faces of a cube.
const PLACES: usize = 1 + 26 * SHARES.len();
/// Things that are touched, for all places and fingers together.
const MOST_LOOKS: usize = 60_000;
/// Effects that are asked at places of effects, for all places and fingers together.
const MOST_COMMON_LOOKS: usize = 1_500_000;
/// The same at places of things that nothing else reaches into.
const MOST_LOOKS_ALONE: usize = 20_000_000;
/// To touch what is at a place takes as long as to ask so many effects.
const FEW_THINGS: usize = 32;
/// Places from which a larger force is looked for.
const MOST_CLIMBED: usize = 64;
/// Nearer places are one (m).
const SAME_M: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vibrations_count_along_their_normals_in_whichever_way_makes_the_sum_larger() {
        let along = |thing: usize, x: f64, y: f64| (thing, Vector3::new(x, y, 0.0));
        let value = |pulls: &[_], vibrations: &[_]| of_forces(pulls, vibrations).map(|(_, value, _)| value);
        assert_eq!(value(&[along(0, 9.0, 0.0), along(1, -9.0, 0.0)], &[]), None);
        assert_eq!(value(&[along(0, 6.0, 0.0), along(1, 0.0, 8.0)], &[]), None, "10 N are allowed");
        assert_eq!(value(&[], &[along(0, 9.0, 0.0), along(1, -9.0, 0.0)]), Some(18.0));
        assert_eq!(value(&[along(0, -9.0, 0.0)], &[along(1, 0.0, 12.0)]), Some(15.0));
        // Every choice of signs beside it.
        let swings: Vec<_> = (0..9)
            .map(|at| along(at, (at as f64 * 1.7).sin() * 4.0, (at as f64 * 2.3).cos() * 4.0))
            .collect();
        let signed = |signs: u32| -> Vector3<f64> {
            swings.iter().map(|(at, swing)| if signs >> at & 1 == 0 { *swing } else { -swing }).sum()
        };
        let most = (0..1 << 9).map(|signs| signed(signs).norm()).fold(0.0, f64::max);
        let found = value(&[], &swings).unwrap_or(0.0);
        assert!((found - most).abs() < 1e-12 * most, "{found} {most}");
        // What does not take part is not named, and one by itself is not told here.
        let told = of_forces(&[along(7, 9.0, 0.0), along(8, 9.0, 0.0), along(9, -1.0, 0.0)], &[]);
        assert_eq!(told.map(|(things, ..)| things), Some(vec![7, 8]));
        assert_eq!(value(&[], &[along(0, 50.0, 0.0)]), None);
    }

    #[test]
    fn places_are_told_to_a_micrometre() {
        let sum = Sum { value: 12.0, limit: 10.0, place_W: Vector3::new(0.0123456, -1e-9, 2.0) };
        let told = Kind::Force.told("a, b", &sum);
        assert!(told.contains(" at (0.012346, 0, 2) feels 12.0 N"), "{told}");
    }

    #[test]
    fn of_things_in_many_fields_so_many_places_are_looked_at_that_the_looks_are_bounded() {
        let alone = |things: usize| vec![vec![0]; things];
        assert_eq!([every_alone(&alone(3000), 8, 0), every_alone(&alone(1000), 1, 64)], [1; 2]);
        for (things, radii, effects) in [(3000, 8, 64), (10_000, 1, 256), (50_000, 16, 1)] {
            let every = every_alone(&alone(things), radii, effects);
            let looks = things * radii * (effects + FEW_THINGS) * PLACES / every;
            assert!(every > 1 && looks <= MOST_LOOKS_ALONE, "{things} {radii} {effects}: {every} {looks}");
        }
    }

    #[test]
    fn of_heaps_so_many_places_are_looked_at_that_the_looks_are_bounded() {
        let in_heap = |things: usize, each: u32| vec![(0..each).collect::<Vec<u32>>(); things];
        assert_eq!([every(&in_heap(100, 1), 5), every(&in_heap(30, 3), 5), every(&[], 0)], [1; 3]);
        for (things, each) in [(1000, 4), (600, 600), (10_000, 30)] {
            let every = every(&in_heap(things, each), 5);
            let looks = things * each as usize * (PLACES / every + 1) * 5;
            assert!(
                every > 1 && looks <= MOST_LOOKS + things * each as usize * 5,
                "{things} {each}: {every} {looks}"
            );
        }
    }
}
