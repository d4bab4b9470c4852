//! A convex mesh and another convex solid: along which direction they touch, and how deep.
//!
//! Problem: of sharp ones that are deep in each other each point and each edge sees a way out of its own, and these disagree:
//! roofs and tetrahedra lodged in each other, or went through.
//! Model: as of two closed forms, there is one direction in which the gap is locally largest, followed from tick to tick
//! ([`axis`](super::axis)). Of what is found, that counts which presses along it; where nothing is about as deep, the place at
//! which they touch does. (With others counted, what slid along one face grew deep by another one, and nobody worked for that.)
//! Frames: the mesh's frame M; normals from the mesh to the other one.
//! Memory: words 0 to 2 the direction, 3 whether there is one.

use haptics::mesh::Mesh;
use nalgebra::{Isometry3, Vector3};

use super::axis;
use super::convex::Convex;
use super::mesh::{About, Contact};
use super::mesh_other::{Other, Solidity};
use super::mesh_patch::Patches;

/// The place at which two convex ones touch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Touch {
    normal_M: Vector3<f64>,
    /// On the mesh \[m\].
    at_M: Vector3<f64>,
    /// Negative where they overlap \[m\].
    pub(super) gap_m: f64,
}

impl Touch {
    /// `None` if either is not convex.
    pub(super) fn of(mesh: &Mesh, other: &Other<'_>, words: &mut [f64; 8]) -> Option<Self> {
        let of_mesh = Convex::of_mesh(mesh, &Isometry3::identity())?;
        let of_other = match other.solid {
            Solidity::Form(form) => Convex::of(form, &other.X_MO)?,
            Solidity::Mesh(second) => Convex::of_mesh(second, &other.X_MO)?,
        };
        let [x, y, z, is_known, ..] = *words;
        let last = (is_known == 1.0).then(|| Vector3::new(x, y, z));
        let found = axis::find(&of_other, &of_mesh, last);
        let (normal_M, gap_m) = (found.normal, found.gap_m - of_other.radius_m);
        words[..4].copy_from_slice(&[normal_M.x, normal_M.y, normal_M.z, 1.0]);
        Some(Self { normal_M, at_M: found.on_a - normal_M * found.gap_m, gap_m })
    }

    /// The only place of the two.
    pub(super) fn settle(&self, patches: &mut Patches) {
        patches.searched = None;
        patches.all[1..].iter_mut().for_each(|patch| patch.is_known = false);
        let first = &mut patches.all[0];
        (first.normal_M, first.at_M, first.depth_m) = (self.normal_M, self.at_M, (-self.gap_m).max(0.0));
        first.is_known = true;
    }

    /// True of a contact point that presses along it.
    pub(super) fn counts(&self, contact: &Contact) -> bool {
        self.normal_M.dot(&contact.normal_M) > AGREES
    }

    /// The place itself, unless one of these is about as deep.
    pub(super) fn unless_found(&self, contacts: &[Contact]) -> Option<Contact> {
        let enough_m = self.gap_m + SAME * self.gap_m.abs() + SAME_M;
        let is_found = contacts.iter().any(|contact| contact.gap_m <= enough_m);
        (!is_found).then(|| Contact::new(About::Both, self.at_M, self.normal_M, self.gap_m))
    }
}

/// Cosine between directions that are about the same.
const AGREES: f64 = 0.99;
/// Share of a depth, and a depth \[m\], that makes no difference.
const SAME: f64 = 0.1;
const SAME_M: f64 = 1e-7;
