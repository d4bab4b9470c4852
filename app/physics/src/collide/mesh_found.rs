//! Contact points of a mesh with another solid while they are being found, place by place.
//!
//! Model: a place keeps those of its points that [carry](super::mesh_carry), and of them the [`PATCH_POINTS`] deepest, a
//! pair [`MAX_POINTS`]; where there are more, the place with the most loses its least deep one. Who carried in the last tick
//! counts as deeper by [`STAYS`]: two as deep as each other do not take turns.
//! Points nearer to each other than twice their depth are one, unless they are of two places and press in different
//! directions: a corner in the corner of a room touches floor and walls.

use nalgebra::Vector3;

use super::mesh::Contact;
use super::mesh_carry::{self, MOST_POINTS};
use super::mesh_patch::MAX_PATCHES;
use super::{MAX_POINTS, PATCH_POINTS};

pub(super) struct Found {
    contacts: [Contact; ROOM],
    count: usize,
    /// Where each place's begin.
    begins: [usize; MAX_PATCHES + 1],
    patch: usize,
    /// Names of its points of the last tick.
    carried: Carried,
}

/// Points that carried in a tick, by what they are about; unused ones are those of no contact.
pub(super) type Carried = [u32; PATCH_POINTS];

impl Found {
    pub(super) fn new() -> Self {
        Self {
            contacts: [Contact::default(); ROOM],
            count: 0,
            begins: [0; MAX_PATCHES + 1],
            patch: 0,
            carried: Carried::default(),
        }
    }

    /// Those of a place follow, of which these carried in the last tick.
    pub(super) fn begin(&mut self, patch: usize, carried: &Carried) {
        (self.patch, self.carried) = (patch, *carried);
        self.begins[patch..].fill(self.count);
    }

    /// Those of all places.
    pub(super) fn so_far(&self) -> &[Contact] {
        &self.contacts[..self.count]
    }

    /// Those of the place whose turn it is.
    pub(super) fn own(&self) -> &[Contact] {
        &self.contacts[self.begins[self.patch]..self.count]
    }

    /// Those of a place whose turn is over, seen along its normal; if there are several, they share their depths.
    pub(super) fn end(&mut self, normal_M: &Vector3<f64>, are_several: bool) -> &[Contact] {
        let begin = self.begins[self.patch];
        self.count = begin + mesh_carry::sort_out(&mut self.contacts[begin..self.count], normal_M);
        if are_several {
            (begin..self.count).for_each(|at| self.share(at));
        }
        while self.count - begin > PATCH_POINTS {
            self.drop_the_least(begin, self.count);
        }
        self.begins[self.patch + 1..].fill(self.count);
        &self.contacts[begin..self.count]
    }

    /// Of several places' points those that press in one direction near each other share their depth: what is as near as
    /// that counts once, and what is farther away ever more.
    fn share(&mut self, at: usize) {
        let (before, rest) = self.contacts.split_at_mut(at);
        let contact = &mut rest[0];
        let depth_m = -contact.gap_m;
        let mut taken_m = 0.0_f64;
        for one in before.iter().filter(|_| depth_m > 0.0) {
            let apart = (one.on_mesh_M - contact.on_mesh_M).norm() / FADE_M;
            if apart < 1.0 && one.normal_M.dot(&contact.normal_M) > AGREES {
                taken_m = taken_m.max((1.0 - apart) * depth_m.min(-one.gap_m).max(0.0));
            }
        }
        contact.gap_m += taken_m;
    }

    pub(super) fn push(&mut self, mut contact: Contact) {
        if !contact.gap_m.is_finite() {
            return;
        }
        // Of a crossing both edges tell, each on its side of the depth.
        let together_m = TOGETHER_M + 2.0 * contact.gap_m.min(0.0).abs();
        let begin = self.begins[self.patch];
        let is_there = |(at, one): (usize, &Contact)| {
            (at >= begin || one.normal_M.dot(&contact.normal_M) > AGREES)
                && (one.on_mesh_M - contact.on_mesh_M).norm_squared() < together_m * together_m
        };
        let there = self.contacts[..self.count].iter().enumerate().position(is_there);
        contact.carried = self.carried.contains(&contact.id);
        contact.id |= (self.patch as u32) << PATCH_SHIFT;
        if let Some(there) = there {
            // Of two right above each other the lower one presses: of both rims of a coin. Of two edges of one crossing the one
            // that did in the last tick: by turns they would push in two directions.
            let one = &self.contacts[there];
            let deeper_m = one.gap_m - contact.gap_m;
            let is_aside = one.normal_M.dot(&contact.normal_M) < AGREES;
            let stays = contact.carried && !one.carried && is_aside && deeper_m > -together_m;
            if there >= begin && (deeper_m > together_m || stays) {
                self.contacts[there] = contact;
            }
        } else {
            self.add(contact);
        }
    }

    /// Whatever is near it.
    pub(super) fn push_apart(&mut self, mut contact: Contact) {
        contact.carried = self.carried.contains(&contact.id);
        contact.id |= (self.patch as u32) << PATCH_SHIFT;
        self.add(contact);
    }

    fn add(&mut self, contact: Contact) {
        if let Some(place) = self.contacts.get_mut(self.count) {
            *place = contact;
            self.count += 1;
        }
    }

    /// All places' points, as many as a pair may have.
    pub(super) fn all(&mut self) -> &[Contact] {
        self.thin_out();
        &self.contacts[..self.count]
    }

    /// The names of a place's.
    pub(super) fn carried(&self, patch: usize) -> Carried {
        let mut names = Carried::default();
        let own = &self.contacts[self.begins[patch]..self.begins[patch + 1]];
        names.iter_mut().zip(own).for_each(|(name, contact)| *name = contact.id & NAMES);
        names
    }

    fn thin_out(&mut self) {
        while self.count > MAX_POINTS {
            let is_pressed = self.contacts[..self.count].iter().all(|contact| contact.gap_m < 0.0);
            let (from, to) = if is_pressed { self.largest() } else { (0, self.count) };
            self.drop_the_least(from, to);
        }
    }

    /// The place with the most points.
    fn largest(&self) -> (usize, usize) {
        let size = |at: &usize| self.begins[at + 1] - self.begins[*at];
        let most = (0..MAX_PATCHES).max_by_key(size).unwrap_or(0);
        (self.begins[most], self.begins[most + 1])
    }

    fn drop_the_least(&mut self, begin: usize, end: usize) {
        let gap_m = |at: usize| {
            let Contact { gap_m, carried, .. } = self.contacts[at];
            if carried { STAYS * gap_m.min(0.0) + gap_m.max(0.0) } else { gap_m }
        };
        let least = (begin..end).max_by(|&a, &b| gap_m(a).total_cmp(&gap_m(b)));
        if let Some(least) = least {
            self.contacts.copy_within(least + 1..self.count, least);
            self.count -= 1;
            self.begins.iter_mut().filter(|begin| **begin > least).for_each(|begin| *begin -= 1);
        }
    }
}

/// The place that a contact is of, and what it is called there.
pub(super) fn place_and_name(id: u32) -> (usize, u32) {
    ((id >> PATCH_SHIFT) as usize, id & NAMES)
}

/// Room for vertices, points of the other one and crossings of one place, beside what the others have kept.
const ROOM: usize = (2 + MAX_PATCHES) * PATCH_POINTS;
/// Points of several places that are nearer share their depth \[m\].
const FADE_M: f64 = 1e-3;
/// Nearer to each other they are one \[m\].
const TOGETHER_M: f64 = 1e-6;
/// Cosine between directions that are about the same.
const AGREES: f64 = 0.7;
/// Names leave three bits for the place.
const PATCH_SHIFT: u32 = 29;
const NAMES: u32 = (1 << PATCH_SHIFT) - 1;
/// So many times as deep counts who carried in the last tick.
const STAYS: f64 = 1.5;
const _: () = assert!(ROOM <= MOST_POINTS);
const _: () = assert!(MAX_PATCHES <= 1 << (u32::BITS - PATCH_SHIFT));
