//! Stiffness and damping of contacts between entities.
//!
//! Problem: what fingers feel is soft, for a hand stands a few newtons per millimetre at best. On a shelf of that stiffness a
//! ball of steel sinks out of sight.
//! Model: contacts between entities are as felt (Melder ch. 6.2.2.2), one surface behind the other, with both dampers, where
//! both say how stiff they are; or they have a stiffness of their own, by mass `k = m (1000 / s)^2` of each point, with m the
//! mass of the heaviest body: on a single point that rests 10 um deep, whatever the rate, and what carries forty of its like
//! 0.4 mm. Then they have a damper of their own, a share of the critical one of what gives way at the point: nothing swings,
//! whatever it weighs. An entity may say another stiffness; two that do are one spring behind the other.
//! Since forces are those of the end of the tick, no stiffness is too large for a light body. Of integrators that take
//! those of its beginning this is not so: there contacts are as felt.
//! Limits: of a pile of mixed shapes that is stirred the solver takes several times as many rounds where contacts are by mass, and
//! does not find the forces of some ticks. What sways on soft springs sways for longer.

use haptics::Entity;

use crate::pair::Response;

/// Stiffness of contacts between entities that do not say it themselves.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum ContactStiffness {
    /// As fingers feel both surfaces, with both entities' dampers.
    #[default]
    AsFelt,
    /// By the mass of the heaviest body.
    ByMass {
        /// Of the damper to the critical one.
        damping_ratio: f64,
    },
    /// As felt between two entities of which both [say their stiffness](Entity::is_stiffness_said), by mass otherwise.
    AsSaid {
        /// Of the damper to the critical one, where it is by mass.
        damping_ratio: f64,
    },
    /// The same for all.
    Given {
        /// Of each contact point \[N/m\], > 0.
        stiffness_n_per_m: f64,
        /// Of the damper to the critical one.
        damping_ratio: f64,
    },
}

impl ContactStiffness {
    /// Of each contact point by mass, among bodies of which the heaviest has this mass (kg) \[N/m\].
    pub fn by_mass_n_per_m(heaviest_kg: f64) -> f64 {
        heaviest_kg * SWINGS_RAD_S * SWINGS_RAD_S
    }
}

/// Response and stiffness of contacts between entities.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Contacts {
    /// Their response.
    pub response: Response,
    /// True where nothing is reflected that a spring presses: of an integrator that knows its forces when the tick begins.
    pub springs_only: bool,
    /// Of points between entities that do not say it themselves: stiffness \[N/m\] and damping ratio. `None`: as felt.
    own: Option<(f64, f64)>,
    /// Between two that say how stiff fingers feel them: as felt all the same.
    follows_said: bool,
}

/// Damping of a contact point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ContactDamping {
    /// \[N s/m\]
    Constant(f64),
    /// A share of the critical damping of what gives way at the point.
    Ratio(f64),
}

impl Default for ContactDamping {
    fn default() -> Self {
        Self::Constant(0.0)
    }
}

impl Contacts {
    /// Among bodies of which the heaviest has this mass (kg).
    pub fn among(response: Response, stiffness: ContactStiffness, heaviest_kg: f64) -> Self {
        let own = match stiffness {
            ContactStiffness::AsFelt => None,
            ContactStiffness::ByMass { damping_ratio } | ContactStiffness::AsSaid { damping_ratio } => {
                Some((ContactStiffness::by_mass_n_per_m(heaviest_kg), damping_ratio))
            }
            ContactStiffness::Given { stiffness_n_per_m, damping_ratio } => {
                Some((stiffness_n_per_m, damping_ratio))
            }
        };
        let own = own.filter(|(stiffness, _)| *stiffness > 0.0);
        let follows_said = matches!(stiffness, ContactStiffness::AsSaid { .. });
        Self { response, springs_only: false, own, follows_said }
    }

    /// Stiffness and damping ratio between two entities, unless that is as felt.
    fn own(&self, a: &Entity, b: &Entity) -> Option<(f64, f64)> {
        let says_another = [a, b].iter().any(|entity| entity.contact_stiffness_n_per_m.is_some());
        let is_as_felt = self.follows_said && a.is_stiffness_said && b.is_stiffness_said && !says_another;
        self.own.filter(|_| !is_as_felt)
    }

    /// Response of a contact between two entities. Of a stiffness that is no finger's what meets stops, if nobody says otherwise.
    pub fn response(&self, a: &Entity, b: &Entity) -> Response {
        match self.response.between(a, b) {
            Response::Bounce { .. } if self.springs_only => Response::Force,
            // No damper would do that: a spring that may not pull gives back an eighth of what it stops.
            Response::Force if self.own(a, b).is_some() => Response::Bounce { restitution: 0.0 },
            response => response,
        }
    }

    /// Stiffness of a contact point between two entities \[N/m\], and its damping.
    pub fn between(&self, a: &Entity, b: &Entity) -> (f64, ContactDamping) {
        let own = [a, b].map(|entity| entity.contact_stiffness_n_per_m);
        match (self.own(a, b), own) {
            (None, [None, None]) => {
                let damping_n_s_per_m = a.damping_n_s_per_m + b.damping_n_s_per_m;
                let stiffness_n_per_m = in_series(a.stiffness_n_per_m, b.stiffness_n_per_m);
                (stiffness_n_per_m, ContactDamping::Constant(damping_n_s_per_m))
            }
            (None, [of_a, of_b]) => {
                let [of_a, of_b] = [of_a.unwrap_or(a.stiffness_n_per_m), of_b.unwrap_or(b.stiffness_n_per_m)];
                (in_series(of_a, of_b), ContactDamping::Ratio(1.0))
            }
            (Some((stiffness_n_per_m, damping_ratio)), own) => {
                let stiffness_n_per_m = match own {
                    [Some(of_a), Some(of_b)] => in_series(of_a, of_b),
                    [one, other] => one.or(other).unwrap_or(stiffness_n_per_m),
                };
                (stiffness_n_per_m, ContactDamping::Ratio(damping_ratio))
            }
        }
    }
}

impl ContactDamping {
    pub(crate) fn is_ratio(self) -> bool {
        matches!(self, Self::Ratio(_))
    }

    /// Coefficient at a point of this stiffness (N/m) where the two give way with a velocity per impulse of so much
    /// (1/kg) \[N s/m\].
    #[inline]
    pub fn n_s_per_m(self, stiffness_n_per_m: f64, gives_per_kg: f64) -> f64 {
        match self {
            Self::Constant(damping_n_s_per_m) => damping_n_s_per_m,
            Self::Ratio(ratio) if gives_per_kg > 0.0 => {
                2.0 * ratio * (stiffness_n_per_m / gives_per_kg).sqrt()
            }
            // Nothing moves there.
            Self::Ratio(_) => 0.0,
        }
    }
}

fn in_series(a: f64, b: f64) -> f64 {
    a / (1.0 + a / b)
}

/// The heaviest body swings as fast on a single undamped point.
const SWINGS_RAD_S: f64 = 1000.0;

#[cfg(test)]
mod tests {
    use super::*;
    use haptics::Sphere;
    use nalgebra::Isometry3;

    fn entity(stiffness_n_per_m: f64) -> Entity {
        Entity::new(Sphere::new(0.02).unwrap(), Isometry3::identity(), stiffness_n_per_m).unwrap()
    }

    #[test]
    fn entities_that_say_their_stiffness_have_it_and_all_others_what_the_scene_or_the_heaviest_says() {
        let (soft, hard) = (entity(500.0), entity(1500.0));
        let says = |entity: &Entity, k| entity.clone().with_contact_stiffness(k).unwrap();
        let felt = Contacts::among(Response::Force, ContactStiffness::AsFelt, 2.0);
        let by_mass = Contacts::among(Response::Force, ContactStiffness::ByMass { damping_ratio: 0.5 }, 2.0);
        let given = ContactStiffness::Given { stiffness_n_per_m: 1e5, damping_ratio: 1.0 };
        let given = Contacts::among(Response::Force, given, 2.0);
        let (constant, ratio) = (ContactDamping::Constant, ContactDamping::Ratio);
        // Roundings of sums of reciprocals.
        let near = |(k, damping): (f64, ContactDamping), expected: f64, damped| {
            assert!((k / expected - 1.0).abs() < 1e-15 && damping == damped, "{k} {expected} {damping:?}");
        };
        near(felt.between(&soft, &hard), 375.0, constant(0.0));
        near(by_mass.between(&soft, &hard), 2e6, ratio(0.5));
        near(given.between(&soft, &hard), 1e5, ratio(1.0));
        near(by_mass.between(&says(&soft, 4e3), &hard), 4e3, ratio(0.5));
        near(by_mass.between(&says(&soft, 4e3), &says(&hard, 12e3)), 3e3, ratio(0.5));
        near(felt.between(&soft, &says(&hard, 500.0)), 250.0, ratio(1.0));
        // As felt where both say how stiff that is, and by mass where one does not, or says another one for contacts.
        let as_said = Contacts::among(Response::Force, ContactStiffness::AsSaid { damping_ratio: 0.5 }, 2.0);
        let both = [&soft, &hard].map(|entity| entity.clone().with_said_stiffness(true));
        near(as_said.between(&both[0], &both[1]), 375.0, constant(0.0));
        near(as_said.between(&both[0], &hard), 2e6, ratio(0.5));
        near(as_said.between(&soft, &both[1]), 2e6, ratio(0.5));
        near(as_said.between(&both[0], &says(&both[1], 4e3)), 4e3, ratio(0.5));
        assert_eq!(as_said.response(&both[0], &both[1]), Response::Force);
        assert_eq!(as_said.response(&both[0], &hard), Response::Bounce { restitution: 0.0 });
        // Nothing that moves: nothing that could be pressed either.
        let none = Contacts::among(Response::Force, ContactStiffness::ByMass { damping_ratio: 1.0 }, 0.0);
        near(none.between(&soft, &hard), 375.0, constant(0.0));
    }

    #[test]
    fn a_ratio_of_one_is_the_critical_damper() {
        // b = 2 sqrt(k m), 2 kg on 800 N/m.
        assert_eq!(ContactDamping::Ratio(1.0).n_s_per_m(800.0, 0.5), 80.0);
        assert_eq!(ContactDamping::Ratio(1.0).n_s_per_m(800.0, 0.0), 0.0);
        assert_eq!(ContactDamping::Constant(3.0).n_s_per_m(800.0, 0.5), 3.0);
    }
}
