//! Soft fingers: what a finger's pad does against turning (Melder ch. 5.3.3).
//!
//! Problem: a god-object is a point, so two fingers hold an object as a nail holds a picture: it swings about the line that
//! joins them. A pad has an area, and with it torsional friction.
//! Model: the area `A = pi r^2` of a touch's friction circle stands for the pressed area of the pad. Three ways to make use
//! of it, see [`TorsionModel`]. Where a touch has no friction circle (another algorithm than the friction cone), a share of
//! the normal force stands in: `r = share N / k`.
//! Turning and sliding share what the pad of the `coulomb` model can bear ([`LimitSurface`]); to the other models a touch that
//! slides resists turning as one that holds.
//! Frames and signs: about the touch's normal (`coulomb`), or about the grasp axis (see [`crate::GraspAxis`]).
//! Invariant: parameters are checked when they are set; torques never exceed what is said here.

use std::f64::consts::PI;

use haptics::{Algorithm, Entity, ParameterError};

use crate::limit_surface::LimitSurface;
use crate::mass::positive;
use crate::touch::{Touch, friction_circle_m};

/// How a finger resists the turning of what it touches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TorsionModel {
    /// A point: not at all.
    None,
    /// True torsional friction of each touch about its normal, against all torques: it holds up to the torque of a pad that
    /// is pressed evenly, `T = 2/3 pad_radius k r`, where `k r` is the most that the friction circle holds tangentially;
    /// beyond that it turns, and resists with the same torque.
    Coulomb {
        /// Radius of the pressed pad \[m\].
        pad_radius_m: f64,
        /// Part that it bears of that while it is pulled along, and along while it is turned.
        limit_surface: LimitSurface,
    },
    /// The torque of gravity about the grasp axis counts less by the share `A / critical` (Melder eq. 5.16), and turning is
    /// damped; from the critical area on nothing turns.
    Viscous {
        /// A_crit \[m^2\].
        critical_area_m2: f64,
        /// Of turning about the grasp axis \[N m s/rad\].
        damping_nm_s_per_rad: f64,
    },
    /// As `Viscous`, with one critical area for what does not turn and a lower one for what does: above the higher it
    /// holds, below the lower it drops, and in between it goes down in jerks.
    StickSlip {
        /// A_crit of what does not turn \[m^2\].
        critical_area_at_rest_m2: f64,
        /// A_crit of what turns \[m^2\], not above the other.
        critical_area_turning_m2: f64,
        /// Of turning about the grasp axis \[N m s/rad\].
        damping_nm_s_per_rad: f64,
    },
}

impl TorsionModel {
    /// The names of the models in a scene.
    pub const NAMES: [&'static str; 4] = ["none", "coulomb", "viscous", "stick-slip"];

    /// The model of this name with its defaults; `None` where there is none.
    pub fn of_name(name: &str) -> Option<Self> {
        Some(match name {
            "none" => Self::None,
            "coulomb" => Self::Coulomb { pad_radius_m: PAD_RADIUS_M, limit_surface: LimitSurface::Ellipse },
            "viscous" => {
                Self::Viscous { critical_area_m2: AREA_M2, damping_nm_s_per_rad: VISCOUS_NM_S_PER_RAD }
            }
            "stick-slip" => Self::StickSlip {
                critical_area_at_rest_m2: AREA_M2,
                critical_area_turning_m2: 0.7 * AREA_M2,
                damping_nm_s_per_rad: VISCOUS_NM_S_PER_RAD,
            },
            _ => return None,
        })
    }
}

/// What makes a finger soft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoftFinger {
    /// How it resists turning.
    pub model: TorsionModel,
    /// Of whatever holds: what the pad gives before it turns \[N m/rad\].
    pub stiffness_nm_per_rad: f64,
    /// Of whatever holds \[N m s/rad\].
    pub damping_nm_s_per_rad: f64,
    /// Ratio to the normal force that stands in for friction where there is no friction circle.
    pub normal_share: f64,
    /// A gimbal turns what its finger holds while the friction circle's area is larger than this \[m^2\].
    pub gimbal_area_m2: f64,
}

impl Default for SoftFinger {
    /// Coulomb, with a pad of 6 mm.
    fn default() -> Self {
        Self {
            model: TorsionModel::Coulomb { pad_radius_m: PAD_RADIUS_M, limit_surface: LimitSurface::Ellipse },
            stiffness_nm_per_rad: 0.5,
            damping_nm_s_per_rad: 2e-3,
            normal_share: 0.5,
            gimbal_area_m2: 0.0,
        }
    }
}

impl SoftFinger {
    /// A point, which resists no turning.
    pub const POINT: Self = Self {
        model: TorsionModel::None,
        stiffness_nm_per_rad: 0.5,
        damping_nm_s_per_rad: 2e-3,
        normal_share: 0.5,
        gimbal_area_m2: 0.0,
    };

    /// The same with another model.
    #[must_use]
    pub fn with_model(self, model: TorsionModel) -> Self {
        Self { model, ..self }
    }

    /// The same, checked.
    ///
    /// # Errors
    /// A radius, a critical area or a stiffness that is not finite or not positive; a damping, a share or a gimbal's area
    /// that is not finite or negative; a critical area of what turns above that of what rests.
    pub fn validated(self) -> Result<Self, ParameterError> {
        match self.model {
            TorsionModel::None => {}
            TorsionModel::Coulomb { pad_radius_m, .. } => {
                positive("pad_radius_m", pad_radius_m)?;
            }
            TorsionModel::Viscous { critical_area_m2, damping_nm_s_per_rad } => {
                positive("critical_area_m2", critical_area_m2)?;
                not_negative("viscous_damping_n_m_s_per_rad", damping_nm_s_per_rad)?;
            }
            TorsionModel::StickSlip {
                critical_area_at_rest_m2,
                critical_area_turning_m2,
                damping_nm_s_per_rad,
            } => {
                positive("critical_area_at_rest_m2", critical_area_at_rest_m2)?;
                positive("critical_area_turning_m2", critical_area_turning_m2)?;
                not_negative("viscous_damping_n_m_s_per_rad", damping_nm_s_per_rad)?;
                if critical_area_turning_m2 > critical_area_at_rest_m2 {
                    return Err(ParameterError::AboveLimit {
                        parameter: "critical_area_turning_m2",
                        value: critical_area_turning_m2,
                        limit: critical_area_at_rest_m2,
                        limit_is: "which is critical_area_at_rest_m2",
                    });
                }
            }
        }
        positive("stiffness_n_m_per_rad", self.stiffness_nm_per_rad)?;
        not_negative("damping_n_m_s_per_rad", self.damping_nm_s_per_rad)?;
        not_negative("normal_share", self.normal_share)?;
        not_negative("gimbal_area_m2", self.gimbal_area_m2)?;
        Ok(self)
    }

    /// The friction circle of a touch that presses with this force.
    pub(crate) fn circle(&self, touch: &Touch, entity: &Entity, normal_n: f64) -> Circle {
        let material = touch.material(entity);
        let stiffness_n_per_m = material.stiffness_n_per_m;
        let load_m = normal_n.max(0.0) / stiffness_n_per_m;
        let radius_m = match entity.algorithm {
            Algorithm::FrictionCone => friction_circle_m(&material, load_m),
            _ => self.normal_share * load_m,
        };
        let is_number = radius_m.is_finite() && load_m > 0.0;
        Circle { radius_m: if is_number { radius_m } else { 0.0 }, stiffness_n_per_m }
    }

    /// The most that a touch with this circle holds about its own normal \[N m\].
    pub(crate) fn most_nm(&self, circle: &Circle) -> f64 {
        match self.model {
            TorsionModel::Coulomb { pad_radius_m, .. } => EVENLY * pad_radius_m * circle.most_n(),
            _ => 0.0,
        }
    }

    /// True if friction and torsion of a touch share what it can bear.
    pub(crate) fn shares(&self) -> bool {
        matches!(self.model, TorsionModel::Coulomb { limit_surface: LimitSurface::Ellipse, .. })
    }

    /// Whether what is held follows a gimbal.
    pub(crate) fn follows(&self, circle: &Circle) -> bool {
        circle.area_m2() > self.gimbal_area_m2
    }
}

/// A touch's friction circle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Circle {
    pub(crate) radius_m: f64,
    /// Of the touched entity \[N/m\].
    stiffness_n_per_m: f64,
}

impl Circle {
    /// The most that friction bears there \[N\].
    pub(crate) fn most_n(&self) -> f64 {
        self.stiffness_n_per_m * self.radius_m
    }

    /// A \[m^2\].
    pub(crate) fn area_m2(&self) -> f64 {
        PI * self.radius_m * self.radius_m
    }
}

fn not_negative(parameter: &'static str, value: f64) -> Result<f64, ParameterError> {
    if value.is_finite() && value >= 0.0 {
        return Ok(value);
    }
    Err(ParameterError::OutOfRange { parameter, value, allowed: "a finite number >= 0" })
}

/// The mean arm of a disc that is pressed evenly, per radius.
const EVENLY: f64 = 2.0 / 3.0;
/// A finger's pad, pressed as one presses to hold a cup \[m\].
const PAD_RADIUS_M: f64 = 6e-3;
/// The circle of a touch that presses an object of 500 N/m and a ratio of 0.5 with 1.2 N \[m^2\]: a quarter more than what
/// lifts 0.1 kg between two fingers.
const AREA_M2: f64 = 4.5e-6;
/// So that an object of 0.1 kg and 50 mm comes down without swinging back \[N m s/rad\].
const VISCOUS_NM_S_PER_RAD: f64 = 4e-3;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_that_no_finger_has_are_refused_by_name() {
        let coulomb = |pad_radius_m| {
            let limit_surface = LimitSurface::default();
            SoftFinger::default().with_model(TorsionModel::Coulomb { pad_radius_m, limit_surface })
        };
        assert_eq!(
            coulomb(0.0).validated().unwrap_err().to_string(),
            "pad_radius_m is 0; allowed is a finite number > 0"
        );
        assert!(coulomb(f64::NAN).validated().is_err());
        let two = TorsionModel::StickSlip {
            critical_area_at_rest_m2: 1e-6,
            critical_area_turning_m2: 2e-6,
            damping_nm_s_per_rad: 0.0,
        };
        let message = SoftFinger::default().with_model(two).validated().unwrap_err().to_string();
        assert!(message.contains("critical_area_turning_m2") && message.contains("critical_area_at_rest_m2"));
        for bad in [
            SoftFinger { stiffness_nm_per_rad: 0.0, ..SoftFinger::default() },
            SoftFinger { damping_nm_s_per_rad: -1.0, ..SoftFinger::default() },
            SoftFinger { normal_share: f64::INFINITY, ..SoftFinger::default() },
            SoftFinger { gimbal_area_m2: -1.0, ..SoftFinger::default() },
        ] {
            assert!(bad.validated().is_err(), "{bad:?}");
        }
        for name in TorsionModel::NAMES {
            let model = TorsionModel::of_name(name).unwrap();
            SoftFinger::default().with_model(model).validated().unwrap();
        }
        assert_eq!(TorsionModel::of_name("sticky"), None);
    }
}
