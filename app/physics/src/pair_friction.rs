//! Friction between two entities.
//!
//! Model: the ratio is the geometric mean of the ratios of both, each where it breaks away and where it slides. Between
//! entities friction does not depend on speed: of a model that does, that at a standstill counts.

use haptics::{Friction, FrictionLaw, FrictionMemory, FrictionQuery, FrictionState};

/// Ratios of tangential to normal force between two entities.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PairFriction {
    /// Up to which it sticks.
    pub mu_hold: f64,
    /// With which it slides; not above the other.
    pub mu_slide: f64,
}

impl PairFriction {
    /// Of two surfaces.
    pub fn between(one: &Friction, other: &Friction) -> Self {
        let (one, other) = (Self::of(one), Self::of(other));
        let mu_hold = (one.mu_hold * other.mu_hold).sqrt();
        Self { mu_hold, mu_slide: (one.mu_slide * other.mu_slide).sqrt().min(mu_hold) }
    }

    /// Of a surface against one like it.
    pub fn of(friction: &Friction) -> Self {
        let load_m = 1e-3;
        let held = FrictionQuery {
            load_m,
            dt_s: A_STANDSTILL_S,
            stiffness_n_per_m: 1.0 / load_m,
            ..Default::default()
        };
        let memory = FrictionMemory::default();
        let mu_hold = ratio(friction.held_limit_m(&held, &memory) / load_m);
        let gap_m = (2.0 * mu_hold + 1.0) * load_m;
        let sliding = FrictionQuery { state: FrictionState::Slip, gap_m, ..held };
        let left_m = gap_m - friction.slide(&sliding, &memory);
        Self { mu_hold, mu_slide: ratio(left_m / load_m).min(mu_hold) }
    }
}

/// A tick so long that whatever slides in it stands still.
const A_STANDSTILL_S: f64 = 1e9;

fn ratio(mu: f64) -> f64 {
    if mu.is_finite() { mu.clamp(0.0, MOST) } else { 0.0 }
}

/// Larger ratios hold everything; squares of them are still numbers.
const MOST: f64 = 1e6;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_are_those_of_the_models_and_their_geometric_mean() {
        let of = |friction| PairFriction::of(&friction);
        let near = |got: PairFriction, mu_hold: f64, mu_slide: f64| {
            // A few roundings of numbers of 1e-3, over 1e-3.
            assert!(
                (got.mu_hold - mu_hold).abs() < 1e-12 && (got.mu_slide - mu_slide).abs() < 1e-9,
                "{got:?}"
            );
        };
        near(of(Friction::None), 0.0, 0.0);
        near(of(Friction::coulomb(0.5).unwrap()), 0.5, 0.5);
        near(of(Friction::stiction(0.7, 0.3).unwrap()), 0.7, 0.3);
        let both = (Friction::stiction(0.8, 0.2).unwrap(), Friction::coulomb(0.45).unwrap());
        near(PairFriction::between(&both.0, &both.1), 0.6, 0.3);
        near(PairFriction::between(&both.0, &Friction::None), 0.0, 0.0);
    }
}
