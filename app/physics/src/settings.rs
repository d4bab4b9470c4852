//! What holds for all bodies.

use nalgebra::Vector3;

use crate::contacts::{ContactStiffness, Contacts};
use crate::integrator::Integrator;
use crate::pair::Response;
use crate::sleep::Sleep;

/// What holds for all bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// \[m/s^2\], in W.
    pub gravity_W: Vector3<f64>,
    /// How forces become motion.
    pub integrator: Integrator,
    /// How contacts between entities answer.
    pub response: Response,
    /// Their stiffness, if the integrator is implicit; else they are as felt.
    pub contact_stiffness: ContactStiffness,
    /// Nothing moves faster \[m/s\].
    pub most_speed_m_s: f64,
    /// Nothing turns faster \[rad/s\].
    pub most_spin_rad_s: f64,
    /// A body farther than this from the origin has left the world and is parked \[m\].
    pub world_radius_m: f64,
    /// When bodies that rest are not stepped any more; `None`: all always are.
    pub sleep: Option<Sleep>,
}

impl Default for Settings {
    /// Nothing sleeps.
    fn default() -> Self {
        Self {
            gravity_W: Vector3::new(0.0, -9.81, 0.0),
            integrator: Integrator::default(),
            response: Response::default(),
            contact_stiffness: ContactStiffness::default(),
            most_speed_m_s: 50.0,
            most_spin_rad_s: 2000.0,
            world_radius_m: 100.0,
            sleep: None,
        }
    }
}

impl Settings {
    /// Contacts among bodies of which the heaviest has this mass (kg).
    pub fn contacts(&self, heaviest_kg: f64) -> Contacts {
        let stiffness =
            if self.integrator.is_implicit() { self.contact_stiffness } else { ContactStiffness::AsFelt };
        let mut contacts = Contacts::among(self.response, stiffness, heaviest_kg);
        contacts.springs_only = !self.integrator.is_implicit();
        contacts
    }
}
