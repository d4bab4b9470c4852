//! Contact points while they are being found.
//!
//! Model: where a contact's outline is cut off, its corners change in number; two that come out of one must not press twice
//! as hard at once. A point that lies nearer than a millimetre to one that was found before it leaves to that one what both
//! are deep, the more the nearer it is.

use nalgebra::{Isometry3, Point3, Vector3};

use super::{ContactPoint, ContactPoints, PATCH_POINTS};

/// A contact point in the frame of the second form.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Spot {
    pub(super) id: u32,
    /// On the surface of the first form \[m\].
    pub(super) on_a: Vector3<f64>,
    /// Unit, from the second to the first.
    pub(super) normal: Vector3<f64>,
    pub(super) gap_m: f64,
}

/// All contact points of two forms.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Spots {
    all: [Spot; MAX_SPOTS],
    /// With what depth each counts \[m\].
    depths_m: [f64; MAX_SPOTS],
    /// Part of its depth with which each would count alone.
    shares: [f64; MAX_SPOTS],
    count: usize,
    /// No farther than this.
    reach_m: f64,
    /// Points nearer to each other than this share their depth \[m\].
    pub(super) fade_m: f64,
}

/// Room while they are found: of a ring its places, and those that take over.
const MAX_SPOTS: usize = 32;
/// Points nearer to each other than this share their depth \[m\]; of small forms, than a share of their size.
const FADE_M: f64 = 1e-3;
const FADE: f64 = 0.1;
/// A share or a distance of less is nothing.
const NOTHING: f64 = 1e-4;

impl Spots {
    /// For forms of which the smaller one has this inner radius (m).
    pub(super) fn within(reach_m: f64, inner_m: f64) -> Self {
        Self { reach_m, fade_m: FADE_M.min(FADE * inner_m), ..Self::default() }
    }

    /// Adds one that is near enough, after all to which it must give way.
    pub(super) fn push(&mut self, spot: Spot) {
        self.push_share(spot, 1.0);
    }

    /// Adds one that counts with a share of its depth.
    pub(super) fn push_share(&mut self, spot: Spot, share: f64) {
        let is_finite = |v: &Vector3<f64>| v.iter().all(|x| x.is_finite());
        if !(is_finite(&spot.on_a) && is_finite(&spot.normal) && spot.gap_m <= self.reach_m)
            || self.count == MAX_SPOTS
        {
            return;
        }
        let depth_m = (-spot.gap_m).max(0.0);
        let (mut taken_m, mut nearest) = (0.0_f64, f64::INFINITY);
        for other in self.as_slice() {
            let apart_m2 = (other.on_a - spot.on_a).norm_squared();
            if apart_m2 > self.fade_m * self.fade_m {
                continue;
            }
            let apart = apart_m2.sqrt() / self.fade_m;
            let both_m = depth_m.min(-other.gap_m).max(0.0);
            taken_m = taken_m.max((1.0 - apart).max(0.0) * both_m);
            nearest = nearest.min(apart);
        }
        let counts_m = (depth_m * share - taken_m).max(0.0);
        if nearest < NOTHING || depth_m > 0.0 && counts_m <= NOTHING * depth_m {
            return;
        }
        self.all[self.count] = spot;
        self.depths_m[self.count] = counts_m;
        self.shares[self.count] = share;
        self.count += 1;
    }

    /// Adds one that counts with this part of its depth, whatever is next to it.
    pub(super) fn push_part(&mut self, spot: Spot, part: f64) {
        let counts_m = -spot.gap_m * part;
        if self.count < MAX_SPOTS && counts_m > 0.0 && counts_m.is_finite() {
            self.all[self.count] = spot;
            self.depths_m[self.count] = counts_m;
            self.shares[self.count] = part;
            self.count += 1;
        }
    }

    /// All of those so far count with this part of what they do.
    pub(super) fn fade(&mut self, part: f64) {
        self.depths_m[..self.count].iter_mut().for_each(|depth_m| *depth_m *= part);
    }

    pub(super) fn as_slice(&self) -> &[Spot] {
        &self.all[..self.count]
    }

    pub(super) fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// If there are too many, those of these ids are the first to go.
    pub(super) fn thin_out(&mut self, ids: std::ops::Range<u32>) {
        let mut at = 0;
        while self.count > PATCH_POINTS && at < self.count {
            if ids.contains(&self.all[at].id) {
                self.all.copy_within(at + 1..self.count, at);
                self.depths_m.copy_within(at + 1..self.count, at);
                self.shares.copy_within(at + 1..self.count, at);
                self.count -= 1;
            } else {
                at += 1;
            }
        }
    }

    /// Reports them in W; `is_swapped`: the second form is A.
    pub(super) fn report(&self, X_W: &Isometry3<f64>, is_swapped: bool, found: &mut ContactPoints) {
        for ((spot, depth_m), share) in self.as_slice().iter().zip(self.depths_m).zip(self.shares) {
            let (mut on_a, mut normal) = (spot.on_a, spot.normal);
            if is_swapped {
                (on_a, normal) = (on_a - normal * spot.gap_m, -normal);
            }
            found.push(ContactPoint {
                id: spot.id,
                point_W: (X_W * Point3::from(on_a)).coords,
                normal_W: X_W.rotation * normal,
                gap_m: if spot.gap_m < 0.0 { -depth_m } else { spot.gap_m },
                share: if spot.gap_m < 0.0 { depth_m / -spot.gap_m } else { share },
                rolls: 0.0,
            });
        }
    }
}
