//! Friction as orders have it: a model and its numbers.

use world::FrictionSpec;

/// A friction model with its numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Numbers {
    model: &'static str,
    keys: Vec<Key>,
}

/// One of the numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Key {
    /// As scenes and orders call it.
    pub name: &'static str,
    /// What it is.
    pub value: f64,
    /// What a slider goes up to; `None`: it has none.
    pub most: Option<f64>,
}

/// Steel on rubber has less.
const MOST_MU: f64 = 2.0;
/// With it a finger that moves 10 cm in a second feels as much as with a `mu` of 2.
const MOST_MU_V_S_PER_M: f64 = 20.0;
const MOST_N: f64 = 5.0;

impl Numbers {
    /// `None`: it is drawn by hand, and has no numbers.
    pub fn of(friction: &FrictionSpec) -> Option<Self> {
        use FrictionSpec as F;
        let mu = |name, value: &f64| Key { name, value: *value, most: Some(MOST_MU) };
        let viscous =
            |value: &f64| Key { name: "mu_v_s_per_m", value: *value, most: Some(MOST_MU_V_S_PER_M) };
        let newtons = |name, value: &f64| Key { name, value: *value, most: Some(MOST_N) };
        // What decides how a model behaves, rather than how strong it is.
        let fixed = |name, value: &f64| Key { name, value: *value, most: None };
        let (model, keys) = match friction {
            // Nothing yet, of what people think of first.
            F::None => ("coulomb", vec![mu("mu", &0.0)]),
            F::Coulomb { mu: all } => ("coulomb", vec![mu("mu", all)]),
            F::Stiction { mu_s, mu_d } => ("stiction", vec![mu("mu_s", mu_s), mu("mu_d", mu_d)]),
            F::Viscous { mu_v_s_per_m } => ("viscous", vec![viscous(mu_v_s_per_m)]),
            F::CoulombViscous { mu: all, mu_v_s_per_m } => {
                ("coulomb-viscous", vec![mu("mu", all), viscous(mu_v_s_per_m)])
            }
            F::Stribeck { mu_s, mu_d, v_s_m_s, mu_v_s_per_m } => (
                "stribeck",
                vec![mu("mu_s", mu_s), mu("mu_d", mu_d), fixed("v_s_m_s", v_s_m_s), viscous(mu_v_s_per_m)],
            ),
            F::Karnopp { mu_s, mu_d, v_min_m_s, mu_v_s_per_m } => (
                "karnopp",
                vec![
                    mu("mu_s", mu_s),
                    mu("mu_d", mu_d),
                    fixed("v_min_m_s", v_min_m_s),
                    viscous(mu_v_s_per_m),
                ],
            ),
            F::Dahl { mu: all } => ("dahl", vec![mu("mu", all)]),
            F::LuGre { mu_s, mu_d, v_s_m_s, mu_v_s_per_m, damping_n_s_per_m } => (
                "lugre",
                vec![
                    mu("mu_s", mu_s),
                    mu("mu_d", mu_d),
                    fixed("v_s_m_s", v_s_m_s),
                    viscous(mu_v_s_per_m),
                    fixed("damping_n_s_per_m", damping_n_s_per_m),
                ],
            ),
            // Greater seeds would lose their last digits.
            F::Bristle { mu: all, bonds, seed } if *seed < 1 << 53 => (
                "bristle",
                vec![mu("mu", all), fixed("bonds", &(*bonds as f64)), fixed("seed", &(*seed as f64))],
            ),
            F::ResetIntegrator { mu_s, mu_d, damping_n_s_per_m } => (
                "reset-integrator",
                vec![mu("mu_s", mu_s), mu("mu_d", mu_d), fixed("damping_n_s_per_m", damping_n_s_per_m)],
            ),
            F::Hayward { mu: all, stick_fraction } => {
                ("hayward", vec![mu("mu", all), fixed("stick_fraction", stick_fraction)])
            }
            F::FixedCone { friction_n, static_n } => {
                ("fixed-cone", vec![newtons("friction_n", friction_n), newtons("static_n", static_n)])
            }
            _ => return None,
        };
        Some(Self { model, keys })
    }

    /// The model's name.
    pub fn model(&self) -> &'static str {
        self.model
    }

    /// Its numbers.
    pub fn keys(&self) -> &[Key] {
        &self.keys
    }

    /// Changes one of them. What holds at rest is never less than what slides: the other one goes along.
    pub fn set(&mut self, key: usize, value: f64) {
        let Some(changed) = self.keys.get_mut(key) else { return };
        changed.value = value;
        let partner = |name: &str| match name {
            "mu_s" => Some(("mu_d", false)),
            "mu_d" => Some(("mu_s", true)),
            "static_n" => Some(("friction_n", false)),
            "friction_n" => Some(("static_n", true)),
            _ => None,
        };
        let Some((name, is_upper)) = partner(changed.name) else { return };
        if let Some(other) = self.keys.iter_mut().find(|key| key.name == name) {
            other.value = if is_upper { other.value.max(value) } else { other.value.min(value) };
        }
    }

    /// The order that makes it so.
    pub fn order(&self, entity: &str) -> String {
        let keys: String = self.keys.iter().map(|key| format!(" {}={}", key.name, key.value)).collect();
        format!("friction {entity} {}{keys}", self.model)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As the application reads what stands behind the entity's name.
    fn read(order: &str) -> FrictionSpec {
        let words: Vec<&str> = order.split(' ').collect();
        let keys: String = words[3..].iter().map(|key| format!(", {key}")).collect();
        FrictionSpec::parse(&format!("{{ model = \"{}\"{keys} }}", words[2])).expect(order)
    }

    #[test]
    fn orders_say_what_scenes_say_whatever_the_model() {
        let models = [
            FrictionSpec::Coulomb { mu: 1.0 },
            FrictionSpec::Stiction { mu_s: 0.7, mu_d: 0.3 },
            FrictionSpec::Viscous { mu_v_s_per_m: 2.5 },
            FrictionSpec::CoulombViscous { mu: 0.1, mu_v_s_per_m: 3.0 },
            FrictionSpec::Stribeck { mu_s: 0.6, mu_d: 0.4, v_s_m_s: 0.02, mu_v_s_per_m: 0.0 },
            FrictionSpec::Karnopp { mu_s: 0.6, mu_d: 0.4, v_min_m_s: 0.003, mu_v_s_per_m: 1.0 },
            FrictionSpec::Dahl { mu: 0.35 },
            FrictionSpec::LuGre {
                mu_s: 0.6,
                mu_d: 0.4,
                v_s_m_s: 0.02,
                mu_v_s_per_m: 0.5,
                damping_n_s_per_m: 1.5,
            },
            FrictionSpec::Bristle { mu: 0.5, bonds: 16, seed: 3 },
            FrictionSpec::ResetIntegrator { mu_s: 0.6, mu_d: 0.4, damping_n_s_per_m: 2.0 },
            FrictionSpec::Hayward { mu: 0.5, stick_fraction: 0.25 },
            FrictionSpec::FixedCone { friction_n: 0.5, static_n: 0.8 },
        ];
        for model in models {
            let numbers = Numbers::of(&model).expect("numbers");
            assert_eq!(read(&numbers.order("table")), model);
        }
        assert_eq!(
            Numbers::of(&FrictionSpec::None).map(|none| none.order("a")).as_deref(),
            Some("friction a coulomb mu=0")
        );
        let drawn = FrictionSpec::Curve { speed_m_s: vec![0.0], mu: vec![0.5], mu_s: 0.6 };
        assert_eq!(Numbers::of(&drawn), None);
    }

    #[test]
    fn what_holds_at_rest_is_never_less_than_what_slides() {
        let mut numbers = Numbers::of(&FrictionSpec::Stiction { mu_s: 0.7, mu_d: 0.3 }).expect("numbers");
        numbers.set(0, 0.2);
        assert_eq!(numbers.order("a"), "friction a stiction mu_s=0.2 mu_d=0.2");
        numbers.set(1, 0.5);
        assert_eq!(numbers.order("a"), "friction a stiction mu_s=0.5 mu_d=0.5");
        numbers.set(1, 0.4);
        assert_eq!(numbers.order("a"), "friction a stiction mu_s=0.5 mu_d=0.4");
    }
}
