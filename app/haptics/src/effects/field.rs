//! A force that depends on where a finger is and how it moves: viscous, inertial, constant.
//!
//! Model: `F = -w B v` (B diagonal in the region's axes), `F = -w m a`, `F = w F0`; `w` fades over the region's rim.
//! A viscous field takes energy at every point. An inertial one takes what it gives back, but for its rim: who brings
//! speed in from outside and stops inside is given `m v^2 / 2` that he never spent. A constant field in a region is
//! wind: who drifts along inside and returns outside gains.
//! Frames: world; B the region's. Signs: forces on the user.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::acceleration::AccelerationFilter;
use super::limits::not_above;
use super::{Limits, MOST_FORCE_N, Motion, Pull, Region, bounded};
use crate::error::{ParameterError, above_zero, finite};

/// A force field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field {
    kind: FieldKind,
    region: Region,
}

/// What a field does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FieldKind {
    /// Against the velocity.
    Viscous {
        /// b along the region's axes \[N s/m\].
        damping_n_s_per_m: Vector3<f64>,
    },
    /// Against the acceleration.
    Inertial {
        /// m \[kg\].
        mass_kg: f64,
        /// Corner of the filter of the acceleration \[Hz\].
        cutoff_hz: f64,
    },
    /// Always the same.
    Constant {
        /// On the user, in the world \[N\].
        force_W: Vector3<f64>,
    },
}

impl Field {
    /// Corner of an inertial field's filter if nothing is said \[Hz\]: the band of voluntary movement.
    pub const DEFAULT_CUTOFF_HZ: f64 = 10.0;

    /// A field against the velocity, with a damping along each of the region's axes \[N s/m\].
    ///
    /// Errors: a damping not finite, negative or above the limit.
    pub fn viscous(
        damping_n_s_per_m: impl Into<Vector3<f64>>,
        region: Region,
        limits: &Limits,
    ) -> Result<Self, ParameterError> {
        let damping_n_s_per_m: Vector3<f64> = damping_n_s_per_m.into();
        for value in damping_n_s_per_m.iter() {
            limits.check_damping(*value)?;
        }
        Ok(Self { kind: FieldKind::Viscous { damping_n_s_per_m }, region })
    }

    /// A field that makes the finger heavier by `mass_kg` for movements below `cutoff_hz`.
    ///
    /// Errors: a mass not finite, negative or above the limit; a frequency not finite or not positive.
    pub fn inertial(
        mass_kg: f64,
        cutoff_hz: f64,
        region: Region,
        limits: &Limits,
    ) -> Result<Self, ParameterError> {
        let cutoff_hz = above_zero("cutoff_hz", cutoff_hz)?;
        limits.check_mass(mass_kg, cutoff_hz)?;
        Ok(Self { kind: FieldKind::Inertial { mass_kg, cutoff_hz }, region })
    }

    /// A field of this force on the user \[N\]: wind, weight.
    ///
    /// Errors: a force that is not finite or above [`MOST_FORCE_N`].
    pub fn constant(force_W: impl Into<Vector3<f64>>, region: Region) -> Result<Self, ParameterError> {
        let force_W: Vector3<f64> = force_W.into();
        for value in force_W.iter() {
            finite("force_n", *value)?;
        }
        not_above("force_n", force_W.norm(), MOST_FORCE_N, "the most that any field pulls")?;
        Ok(Self { kind: FieldKind::Constant { force_W }, region })
    }

    /// What it does.
    pub fn kind(&self) -> &FieldKind {
        &self.kind
    }

    /// Where.
    pub fn region(&self) -> &Region {
        &self.region
    }

    pub(super) fn pull(&self, motion: &Motion, filter: &mut AccelerationFilter) -> Pull {
        let weight = self.region.weight(&motion.position_W);
        let (whole, explained_n) = match &self.kind {
            FieldKind::Viscous { damping_n_s_per_m } => {
                let whole = -self.region.multiplied(&motion.velocity_W, damping_n_s_per_m);
                (whole, damping_n_s_per_m.amax() * motion.speeds_m_s)
            }
            // The filter runs outside, too: who comes in brings no jump along.
            FieldKind::Inertial { mass_kg, cutoff_hz } => {
                let (at, v) = (&motion.position_W, &motion.velocity_W);
                let acceleration = filter.step(at, v, TAU * cutoff_hz, motion.dt_s);
                (acceleration * -mass_kg, mass_kg * filter.most_change())
            }
            FieldKind::Constant { force_W } => (*force_W, 0.0),
        };
        let whole = bounded(whole, MOST_FORCE_N);
        Pull {
            force_on_user_W: whole * weight,
            stored_j: 0.0,
            explained_n: explained_n + whole.norm() * self.region.most_change(motion.way_m),
        }
    }
}
