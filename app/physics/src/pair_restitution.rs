//! How much of an approaching velocity two surfaces give back.
//!
//! Model: a coefficient belongs to a pair, and scenes give one to each entity: what it has against its like, or against what
//! does not give way. In an impact two springs in series (as contacts have them, or, where they say none, as felt) hold the energy, each a share that is the other's stiffness over the
//! sum of both, and each gives back `e^2` of its own: `e^2 = (e_a^2 k_b + e_b^2 k_a) / (k_a + k_b)`. So equals keep their
//! coefficient, and of unequals the one that gives way decides: a rubber ball bounces as rubber on steel, and as foam on foam.
//! Neither the larger one (what games like, where anything bounces off anything) nor the mean or the product does both. Who has none
//! leaves it to the other.
//! Reference: L. Coaplen, W. Stronge, B. Ravani, *Work equivalent composite coefficient of restitution*, International Journal
//! of Impact Engineering 30 (2004), for the idea of weighing by the work of each side.

use haptics::Entity;

use crate::pair::Response;

impl Response {
    /// Response between two entities: `self`'s restitution is that of pairs of which neither says one. What is pressed by a
    /// spring alone bounces if either says so.
    #[must_use]
    pub fn between(self, a: &Entity, b: &Entity) -> Self {
        let own = match (a.restitution, b.restitution) {
            (Some(e_a), Some(e_b)) => Some(composite([e_a, e_b], [a, b].map(stiffness_n_per_m))),
            (one, other) => one.or(other),
        };
        match (self, own) {
            (Self::Force | Self::Bounce { .. }, Some(restitution)) => Self::Bounce { restitution },
            (Self::Impulse { .. }, Some(restitution)) => Self::Impulse { restitution },
            (_, None) => self,
        }
    }
}

/// Stiffness that an entity says of its contacts with others, or else that a finger feels.
fn stiffness_n_per_m(of: &Entity) -> f64 {
    of.contact_stiffness_n_per_m.unwrap_or(of.stiffness_n_per_m)
}

fn composite([e_a, e_b]: [f64; 2], [k_a, k_b]: [f64; 2]) -> f64 {
    // Shares of the whole, so that no sum of stiffnesses overflows.
    let of_a = 1.0 / (1.0 + k_a / k_b);
    (e_a * e_a * of_a + e_b * e_b * (1.0 - of_a)).sqrt().clamp(e_a.min(e_b), e_a.max(e_b))
}

#[cfg(test)]
mod tests {
    use haptics::Sphere;
    use nalgebra::Isometry3;

    use super::*;

    #[test]
    fn what_an_entity_says_of_its_contacts_weighs_and_else_what_is_felt() {
        let says = |e: f64, felt: f64| {
            let ball = Sphere::new(0.02).unwrap();
            Entity::new(ball, Isometry3::identity(), felt).unwrap().with_restitution(e).unwrap()
        };
        let squared = |a: &Entity, b: &Entity| Response::Force.between(a, b).restitution().unwrap().powi(2);
        let (soft, hard) = (says(0.6, 1000.0), says(0.9, 4000.0));
        // Rounding of a square and a root.
        assert!((squared(&soft, &hard) - (0.36 * 0.8 + 0.81 * 0.2)).abs() < 1e-15);
        let [soft, hard] = [(says(0.6, 1000.0), 1000.0), (says(0.9, 1000.0), 3000.0)]
            .map(|(entity, k)| entity.with_contact_stiffness(k).unwrap());
        assert!((squared(&soft, &hard) - (0.36 * 0.75 + 0.81 * 0.25)).abs() < 1e-15);
    }

    #[test]
    fn equals_keep_theirs_and_of_unequals_the_softer_decides() {
        // Rounding of a square and a root.
        assert!((composite([0.7, 0.7], [400.0, 90.0]) - 0.7).abs() < 1e-15);
        assert!(
            (composite([0.8, 0.2], [1.0, 1e9]) - 0.8).abs() < 1e-8,
            "all of the energy is in the soft one"
        );
        assert!((composite([0.8, 0.2], [1e9, 1.0]) - 0.2).abs() < 1e-8);
        let even = composite([0.8, 0.2], [500.0, 500.0]);
        assert!((even * even - 0.34).abs() < 1e-15, "half of 0.64 and half of 0.04: {even}");
        for [k_a, k_b] in [[f64::MAX, f64::MAX], [f64::MIN_POSITIVE, f64::MAX], [f64::MAX, f64::MIN_POSITIVE]]
        {
            assert!((0.2..=0.8).contains(&composite([0.8, 0.2], [k_a, k_b])), "{k_a} {k_b}");
        }
    }
}
