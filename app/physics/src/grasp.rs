//! How good a grasp is, as data (Melder ch. 3.3.1, 5.1.1).
//!
//! Problem: which forces and torques can fingers at these points give an object, and do those which they give it now hold
//! it?
//! Model: the grasp matrix `G` (Salisbury): a column for each force or torque that a contact can give, a wrench about the
//! centre of mass. A contact without friction has one column (normal), a point with friction three (and two tangents), a
//! soft finger four (and the torque about its normal): 6 x n, 3n or 4n.
//! - Its *rank* says in how many directions wrenches can be given at all, whatever the signs.
//! - *Equilibrium*: what is left of all wrenches, relative to their sizes.
//! - *Force closure*: whether any wrench at all can be resisted with contacts that only push and friction that stays in its
//!   cone. Two fingers: by Nguyen's theorem, exactly: both are soft and the line that joins them lies inside both cones.
//!   Three and more: the cones are cut to pyramids of eight edges inside of them, torsion to what is left when nothing is
//!   asked of the tangents; closure if the wrenches of these edges surround the origin. Who is told yes has closure; within
//!   8 % of the friction that is needed (the cosine of 22.5 degrees), a no can be wrong.
//! - *Margin*: the largest wrench of whatever direction that is resisted while the contacts' forces sum up to 1 N
//!   (Ferrari and Canny's epsilon), see [`Margin`].
//!
//! Torques are compared with forces over the largest distance of a contact from the centre of mass.
//! Frames and signs: W; normals point to the body; wrenches on the body about its centre of mass.
//! Invariants: no allocation, bounded, whatever is put in; contacts that are no numbers are refused.
//! Cost: the rank 1 to 3 microseconds, closure of three fingers 6, of eight 15: on request, not in each tick of many bodies.
//! The margin takes milliseconds: for analysis.

mod closure;
mod margin;
mod matrix;
mod simplex;

use nalgebra::{Vector3, Vector6};

use crate::row::Row;
use crate::wrench::Wrench;

pub use margin::Margin;
pub use matrix::GraspMatrix;

/// The most contacts of a grasp.
pub const MAX_CONTACTS: usize = 8;

/// A point at which a finger presses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GraspContact {
    /// \[m\]
    pub point_W: Vector3<f64>,
    /// Unit, to the body.
    pub normal_W: Vector3<f64>,
    /// Ratio of tangential to normal force that holds; 0: without friction.
    pub mu: f64,
    /// Ratio of the torque about the normal to the normal force that holds \[m\]; 0: a point.
    pub torsion_m: f64,
}

/// Contacts on a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grasp {
    contacts: [GraspContact; MAX_CONTACTS],
    count: usize,
    centre_W: Vector3<f64>,
}

/// What can be said of a grasp in a tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct GraspQuality {
    /// How many contacts of fingers press.
    pub contacts: usize,
    /// Rank of the grasp matrix, 0 to 6.
    pub rank: usize,
    /// What is left of all forces and torques on the body, gravity and surroundings among them, relative to the sum of
    /// their sizes: 0 in equilibrium, 1 where nothing acts against anything.
    pub residual: f64,
    /// Whether the fingers alone can resist whatever comes.
    pub has_force_closure: bool,
}

impl Grasp {
    /// Of a body whose centre of mass is there, without contacts.
    pub fn about(centre_W: Vector3<f64>) -> Self {
        let nothing =
            GraspContact { point_W: Vector3::zeros(), normal_W: Vector3::y(), mu: 0.0, torsion_m: 0.0 };
        Self { contacts: [nothing; MAX_CONTACTS], count: 0, centre_W }
    }

    /// Adds a contact; says whether it was taken: it is not if there is no room, or if it cannot be.
    pub fn add(&mut self, contact: GraspContact) -> bool {
        let is_possible = contact.point_W.iter().all(|x| x.is_finite())
            && (contact.normal_W.norm() - 1.0).abs() < 1e-6
            && contact.mu.is_finite()
            && contact.mu >= 0.0
            && contact.torsion_m.is_finite()
            && contact.torsion_m >= 0.0;
        let Some(place) = self.contacts.get_mut(self.count).filter(|_| is_possible) else { return false };
        *place = contact;
        self.count += 1;
        true
    }

    /// The contacts, in the order in which they were added.
    pub fn contacts(&self) -> &[GraspContact] {
        &self.contacts[..self.count]
    }

    /// G.
    pub fn matrix(&self) -> GraspMatrix {
        GraspMatrix::of(self)
    }

    /// Its rank.
    pub fn rank(&self) -> usize {
        self.matrix().rank()
    }

    /// Whether whatever wrench comes can be resisted.
    pub fn has_force_closure(&self) -> bool {
        closure::has_force_closure(self)
    }

    /// By how much.
    pub fn margin(&self) -> Margin {
        margin::margin(self)
    }

    /// How long an arm counts as one \[m\].
    fn length_m(&self) -> f64 {
        let most = |most: f64, contact: &GraspContact| most.max((contact.point_W - self.centre_W).norm());
        let length_m = self.contacts().iter().fold(0.0, most);
        if length_m > 0.0 { length_m } else { 1.0 }
    }

    /// Of a force at a contact, and a torque about its normal: force, and torque about the centre over the length.
    fn wrench(&self, contact: &GraspContact, force_W: &Vector3<f64>, torsion_nm: f64) -> Vector6<f64> {
        let arm_W = contact.point_W - self.centre_W;
        let torque_W = (arm_W.cross(force_W) + contact.normal_W * torsion_nm) / self.length_m();
        Vector6::new(force_W.x, force_W.y, force_W.z, torque_W.x, torque_W.y, torque_W.z)
    }
}

/// Two unit vectors that are perpendicular to a third and to each other.
fn tangents(normal_W: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let axis = normal_W.iamin();
    let mut least = Vector3::zeros();
    least[axis] = 1.0;
    let one = normal_W.cross(&least).normalize();
    [one, normal_W.cross(&one)]
}

/// Of a body whose finger contacts are among the first so many rows, and its other contacts the rest.
pub(crate) fn quality(
    rows: &[Row],
    touches: usize,
    body: usize,
    (centre_W, weight_W): (&Vector3<f64>, &Vector3<f64>),
) -> GraspQuality {
    let mut grasp = Grasp::about(*centre_W);
    for row in rows.iter().take(touches).filter(|row| row.body == body && row.tie_n.is_none()) {
        let normal_n = row.normal_W.dot(&row.force_W);
        if normal_n > 0.0 {
            grasp.add(GraspContact {
                point_W: centre_W + row.arms_W[0],
                normal_W: row.normal_W,
                mu: row.mu(),
                torsion_m: row.torsion.most_nm.max(0.0) / normal_n,
            });
        }
    }
    GraspQuality {
        contacts: grasp.contacts().len(),
        rank: grasp.rank(),
        residual: residual(rows, body, weight_W, grasp.length_m()),
        has_force_closure: grasp.has_force_closure(),
    }
}

/// What is left of all that acts on a body, relative.
fn residual(rows: &[Row], body: usize, weight_W: &Vector3<f64>, length_m: f64) -> f64 {
    let mut total = Wrench { force_W: *weight_W, torque_W: Vector3::zeros() };
    let mut sizes = weight_W.norm();
    for row in rows {
        let sides = [(Some(row.body), 1.0), (row.other, -1.0)];
        for ((_, sign), arm_W) in sides.iter().zip(&row.arms_W).filter(|((side, _), _)| *side == Some(body)) {
            let (force_W, torsion_W) = (row.force_W * *sign, row.torque_W() * *sign);
            total.add(&force_W, arm_W);
            total.torque_W += torsion_W;
            sizes += force_W.norm() + torsion_W.norm() / length_m;
        }
    }
    let left = total.force_W.norm() + total.torque_W.norm() / length_m;
    if sizes > 0.0 { left / sizes } else { 0.0 }
}
