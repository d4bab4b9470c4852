//! All vertices of a mesh that lie low over a plane, as no more contact points than a pair may have.
//!
//! Problem: a soft contact holds energy in its springs. Where a few vertices stand for many, what they hold changes whenever
//! others take their places, and what is round is rocked and rolled by that for ever. A spring for each would be no better: how deep a
//! thing rests, how it leans and rolls, would depend on how somebody has cut it.
//! Model: each vertex that touches bears its part of four springs, in proportion to its [bend](haptics::mesh::Mesh::bend): a corner of a box that of a box,
//! one of a rim of `n` sides `4 / n`, and none more than one. What is barely pressed barely counts: with bends `b` and depths `d` of
//! all that press in its direction, of a vertex there is the part `min(1, 4 b_i / B)` of a spring, `B = (sum b d)^2 / sum b d^2`. So
//! parts change as continuously as depths do; what springs hold more by that than was worked is not theirs (`pair/ledger.rs`).
//! Up to [`MAX_POINTS`] of them within reach each is a contact
//! point. More are grouped, each with the nearest of so many that were chosen far from each other: a group presses at the
//! middle of its load, as deep and as hard as has the force and the energy of all of it. So both, and the torque, are those
//! of all vertices, whoever was chosen.
//! Of more than [`MOST_VERTICES`] within reach only some count, each with the bends of those that it stands for
//! ([`stands`](haptics::mesh::Mesh::stands)).
//! Identity: a chosen one stays chosen while it is within reach; which list counts changes only where they are too many or few.
//! Cost: a query or a look at each of a list, and a distance for each vertex and chosen one: up to some tens of microseconds; where
//! normals differ, some steps for each two vertices.

use haptics::mesh::Stand;
use nalgebra::Vector3;

use super::MAX_POINTS;
use super::mesh::Contact;
use super::mesh_corner::Corner;
use super::mesh_found::{named, place_and_name};
use super::mesh_patch::MAX_PATCHES;
use super::mesh_span::Standing;

/// Memory from tick to tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Spread {
    /// Names of the contacts of vertices that were chosen; 0: none.
    chosen: [u32; MAX_POINTS],
    /// 0: all vertices count; else those of a list in which some stand for others, the finest of which is 1.
    list: u32,
    /// A few stand for all, for there are too many.
    is_crowded: bool,
    /// Ticks until they are counted again, or a finer list is tried.
    waits: u32,
}

impl Spread {
    /// True if a few vertices stand for many that press softly.
    pub(crate) fn is_crowded(&self) -> bool {
        self.is_crowded
    }

    /// Takes note that others than vertices touch, too, or that a few vertices stand for all.
    pub(super) fn set_crowded(&mut self, is_crowded: bool) {
        self.is_crowded = is_crowded;
    }
}

/// A vertex within reach, as what it touches sees it.
#[derive(Debug, Clone, Copy, Default)]
struct Low {
    contact: Contact,
    /// Nearest of those that were chosen, and the distance to it, squared \[m^2\].
    group: usize,
    apart_m2: f64,
}

/// Vertices within reach, and which of them were chosen.
pub(super) struct Lows {
    all: [Low; MOST_VERTICES],
    count: usize,
    chosen: [u32; MAX_POINTS],
    groups: usize,
    /// Of which list they are.
    list: u32,
    /// The most that there may be.
    most: usize,
    /// Place whose vertices are being found.
    place: usize,
}

/// Bounds on what is told.
pub(super) struct How {
    /// Contact points.
    pub(super) room: usize,
    /// Vertices of which all count, at most [`MOST_VERTICES`].
    pub(super) most: usize,
    /// So far may what touches come down in the tick \[m\].
    pub(super) ahead_m: f64,
}

/// Tells no more contact points than there is room for, for all vertices that `find` finds; `false`: they are too many, and none
/// is told.
pub(super) fn tell(
    memory: &mut Spread,
    &How { room, most, ahead_m }: &How,
    find: impl Fn(&mut Lows) -> bool,
    mut tell: impl FnMut(&Contact),
) -> bool {
    memory.waits = memory.waits.saturating_sub(1);
    if memory.is_crowded && memory.list > MOST_LISTS && memory.waits > 0 {
        return false;
    }
    let mut lows = Lows {
        all: [Low::default(); MOST_VERTICES],
        count: 0,
        chosen: [0; MAX_POINTS],
        groups: 0,
        list: memory.list.min(MOST_LISTS),
        most,
        place: 0,
    };
    while !find(&mut lows) {
        (memory.list, memory.waits) = (lows.list + 1, WAITS);
        if lows.list == MOST_LISTS {
            memory.is_crowded = true;
            return false;
        }
        (lows.count, lows.list) = (0, lows.list + 1);
    }
    // Where there are few, more count some time later.
    let are_few = lows.count < most * FEW / MOST_VERTICES && memory.waits == 0;
    memory.list = lows.list.saturating_sub(u32::from(are_few));
    memory.is_crowded = false;
    lows.weigh(ahead_m);
    if lows.count <= room {
        lows.all[..lows.count].iter().for_each(|low| tell(&low.contact));
        memory.chosen = lows.chosen;
        return true;
    }
    lows.choose(&memory.chosen, room);
    memory.chosen = lows.chosen;
    (0..lows.groups).for_each(|group| tell(&lows.contact(group)));
    true
}

/// Bends of what touches, or may come down by so much (m) in this tick, each with the part of it that counts: those that bear
/// next to nothing count next to nothing.
fn bends<'c>(parts: impl Iterator<Item = (&'c Contact, f64)>, ahead_m: f64) -> f64 {
    let (mut deep_m, mut deep_m2) = (0.0, 0.0);
    for (contact, part) in parts {
        let depth_m = (ahead_m - contact.gap_m).max(0.0);
        deep_m += part * contact.springs * depth_m;
        deep_m2 += part * contact.springs * depth_m * depth_m;
    }
    if deep_m2 > 0.0 { deep_m * deep_m / deep_m2 } else { 0.0 }
}

/// How many springs stand at a vertex that has this one's bend, of all that [touch](bends).
fn springs(contact: &Contact, bends: f64) -> f64 {
    let springs = if bends > 0.0 { FEET * contact.springs / bends } else { 1.0 };
    // Of a box on a face it is one, to rounding.
    if springs > 1.0 - ROUNDING { 1.0 } else { springs }
}

/// Vertices that were seen, plus one, each at the first free place from that of its number on.
struct Seen {
    names: [u32; SEEN],
}

/// A number whose low bits are those of no neighbour.
fn scattered(number: u32) -> u32 {
    let product = number.wrapping_mul(SCATTER);
    product ^ product >> 16
}

impl Seen {
    /// Takes note of a vertex; `false`: it was seen before.
    fn is_new(&mut self, number: u32) -> bool {
        let first = scattered(number) as usize;
        for step in 0..SEEN {
            let name = &mut self.names[(first + step) % SEEN];
            if *name == 0 {
                *name = number + 1;
                return true;
            }
            if *name == number + 1 {
                return false;
            }
        }
        false
    }
}

impl Lows {
    /// Adds all of a mesh within reach of which a corner counts, as `see` sees them; `false`: there is no room for them.
    pub(super) fn find(
        &mut self,
        standing: &Standing<'_>,
        counts: impl Fn(Corner) -> bool,
        mut see: impl FnMut(Corner) -> Option<Contact>,
    ) -> bool {
        let mesh = standing.mesh;
        if let Some(stands) = self.list.checked_sub(1).and_then(|list| mesh.stands(list as usize)) {
            let is_low = |stand: &&Stand| standing.is_low(&stand.point_B);
            let mut all = stands.iter().filter(is_low).filter_map(|stand| {
                see(Corner::new(stand.corner)).map(|contact| Contact { springs: stand.bend, ..contact })
            });
            return all.all(|contact| self.add(contact));
        }
        let (mut seen, mut looks) = (Seen { names: [0; SEEN] }, 0);
        let add = |corner: Corner| {
            let number = corner.vertex(mesh);
            if !counts(corner) || !seen.is_new(number) {
                return true;
            }
            looks += 1;
            let Some(contact) = see(corner) else { return looks < MOST_LOOKS };
            self.add(Contact { springs: mesh.bend(number), ..contact })
        };
        standing.for_each_low(add, MOST_VISITS)
    }

    /// Those of this place follow.
    pub(super) fn begin(&mut self, place: usize) {
        self.place = place;
    }

    /// Adds one that no earlier place has told, pressed in about this direction; `false`: there is no room.
    fn add(&mut self, mut contact: Contact) -> bool {
        let own = &self.all[..self.count];
        let is_told = |low: &Low| {
            place_and_name(low.contact.id).1 == contact.id
                && low.contact.normal_M.dot(&contact.normal_M) > AGREES
        };
        if self.place > 0 && own.iter().any(is_told) {
            return true;
        }
        if self.count == self.most.min(MOST_VERTICES) {
            return false;
        }
        contact.id = named(self.place, contact.id);
        self.all[self.count] = Low { contact, group: 0, apart_m2: f64::INFINITY };
        self.count += 1;
        true
    }

    /// Makes of their bends how many springs stand at each: what presses in another direction bears nothing of its load.
    fn weigh(&mut self, ahead_m: f64) {
        let own = &mut self.all[..self.count];
        let Some(first_M) = own.first().map(|low| low.contact.normal_M) else { return };
        if own.iter().all(|low| low.contact.normal_M.dot(&first_M) > SAME) {
            let bends = bends(own.iter().map(|low| (&low.contact, 1.0)), ahead_m);
            own.iter_mut().for_each(|low| low.contact.springs = springs(&low.contact, bends));
            return;
        }
        let mut all = [0.0; MOST_VERTICES];
        for (low, bends_here) in own.iter().zip(&mut all) {
            let part = |one: &Low| low.contact.normal_M.dot(&one.contact.normal_M).max(0.0);
            *bends_here = bends(own.iter().map(|one| (&one.contact, part(one))), ahead_m);
        }
        own.iter_mut().zip(all).for_each(|(low, bends)| low.contact.springs = springs(&low.contact, bends));
    }

    /// Chooses those of the last tick that are there, and then the one that is farthest from all that are chosen, again and again.
    fn choose(&mut self, last: &[u32; MAX_POINTS], room: usize) {
        // Of each direction one has room.
        let normal_M = self.all[0].contact.normal_M;
        let are_one = self.all[..self.count].iter().all(|low| low.contact.normal_M.dot(&normal_M) > SAME);
        let spare = if are_one { 0 } else { MAX_PATCHES.min(room - 1) };
        for &name in last.iter().filter(|&&name| name != 0) {
            let place = self.all[..self.count].iter().position(|low| low.contact.id == name);
            if let Some(at) = place.filter(|_| self.groups + spare < room) {
                self.take(at);
            }
        }
        if self.groups == 0 {
            self.take(0);
        }
        while self.groups < room {
            let apart = |at: &usize| self.all[*at].apart_m2;
            let farthest = (0..self.count).max_by(|a, b| apart(a).total_cmp(&apart(b)));
            let Some(farthest) = farthest.filter(|at| apart(at) > 0.0) else { break };
            self.take(farthest);
        }
    }

    fn take(&mut self, at: usize) {
        let group = self.groups;
        let Contact { id, on_mesh_M, normal_M, .. } = self.all[at].contact;
        self.chosen[group] = id;
        self.groups += 1;
        for low in &mut self.all[..self.count] {
            let apart_m2 = (low.contact.on_mesh_M - on_mesh_M).norm_squared();
            if apart_m2 < low.apart_m2 && low.contact.normal_M.dot(&normal_M) > AGREES {
                (low.group, low.apart_m2) = (group, apart_m2);
            }
        }
    }

    /// The contact point of a group: where nothing of it touches, the lowest.
    fn contact(&self, group: usize) -> Contact {
        let own = || self.all[..self.count].iter().filter(|low| low.group == group).map(|low| &low.contact);
        let (mut springs, mut deep_m, mut deep_m2) = (0.0, 0.0, 0.0);
        let (mut at_M, mut normal_M) = (Vector3::zeros(), Vector3::zeros());
        for low in own().filter(|low| low.gap_m < 0.0) {
            let load_m = -low.gap_m * low.springs;
            springs += low.springs;
            deep_m += load_m;
            deep_m2 -= load_m * low.gap_m;
            at_M += low.on_mesh_M * load_m;
            normal_M += low.normal_M * load_m;
        }
        let force_m = normal_M.norm();
        let id = self.chosen[group];
        if deep_m2 == 0.0 || force_m < LEAST_FORCE * deep_m {
            let lowest = own().min_by(|a, b| a.gap_m.total_cmp(&b.gap_m)).copied().unwrap_or_default();
            // A chosen one is its group's.
            return Contact { id, springs: own().map(|low| low.springs).sum(), ..lowest };
        }
        // So the springs' force is the sum of all, and so is what they hold.
        let (on_mesh_M, normal_M) = (at_M / deep_m, normal_M / force_m);
        let on_other_M = on_mesh_M - normal_M * (deep_m2 / force_m);
        let (share, gap_m) = (force_m * force_m / (deep_m2 * springs), -force_m / springs);
        Contact { id, on_mesh_M, on_other_M, normal_M, gap_m, share, springs, carried: false }
    }
}

/// The most within reach of which all count.
pub(super) const MOST_VERTICES: usize = 256;
/// Ticks for which there are too many, once there were, and for which no finer list is tried.
const WAITS: u32 = 31;
/// Number, of most, below which a finer list counts, if there is one: it may have four times as many.
const FEW: usize = 56;
/// More than a mesh has.
const MOST_LISTS: u32 = 12;
/// Cosine between directions that are about the same, and that are one.
const AGREES: f64 = 0.7;
const SAME: f64 = 1.0 - 1e-4;
/// Springs of a foot, however many vertices it has.
const FEET: f64 = 4.0;
/// Of some hundreds of sums.
const ROUNDING: f64 = 1e-6;
/// Room for so many, three quarters of it empty.
const SEEN: usize = 4 * MOST_VERTICES;
/// Odd, and nearest to the golden section of all numbers.
const SCATTER: u32 = 2_654_435_769;
/// Sum of what a group presses, of its parts': less is none, for these press against each other.
const LEAST_FORCE: f64 = 0.1;
/// Vertices that are looked at, whether they are within reach or not.
const MOST_LOOKS: usize = 2 * MOST_VERTICES;
/// Bound on the nodes of the hierarchy and the runs of faces that are looked at. With four times as many, cans of thousands of sides
/// stand, and balls of a hundred thousand triangles sway on their facets for longer than half a minute.
const MOST_VISITS: usize = 2048;
