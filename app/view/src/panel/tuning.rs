//! How things feel, as people set it with sliders, and the orders that make it so.
//!
//! Model: what is wanted changes with every picture; orders go out some times a second, and what they have made of the scene's
//! own values is kept here, because orders of stiffness and damping say how many times what is. Orders of others are not
//! known here.

use super::friction::Numbers;
use crate::stage::Known;

/// No slider gives more orders a second than one in this time (s).
pub const BETWEEN_S: f64 = 0.1;
/// Stiffness and damping go from this many times what the scene says to its reciprocal; an order changes no more either.
pub const MOST_TIMES: f64 = 10.0;

/// How an entity feels.
#[derive(Debug, Clone)]
pub struct Tuning {
    name: String,
    /// How many times the scene's stiffness and damping.
    times: [Times; 2],
    /// `None`: it has no numbers.
    friction: Option<Friction>,
}

#[derive(Debug, Clone)]
struct Times {
    order: &'static str,
    sent: f64,
    wanted: f64,
    pace: Pace,
}

#[derive(Debug, Clone)]
struct Friction {
    sent: Numbers,
    wanted: Numbers,
    pace: Pace,
}

/// When the last order went out (s).
#[derive(Debug, Clone, Copy, Default)]
struct Pace(Option<f64>);

impl Pace {
    fn goes(&mut self, now_s: f64) -> bool {
        let goes = self.0.is_none_or(|last_s| now_s - last_s >= BETWEEN_S);
        if goes {
            self.0 = Some(now_s);
        }
        goes
    }
}

impl Tuning {
    /// As the scene says.
    pub fn new(known: &Known) -> Self {
        let times = |order| Times { order, sent: 1.0, wanted: 1.0, pace: Pace::default() };
        let friction = Numbers::of(&known.friction);
        Self {
            name: known.name.clone(),
            times: [times("stiffness"), times("damping")],
            friction: friction.map(|is| Friction { sent: is.clone(), wanted: is, pace: Pace::default() }),
        }
    }

    /// How many times the scene's stiffness and damping are wanted.
    pub fn times(&self) -> [f64; 2] {
        [self.times[0].wanted, self.times[1].wanted]
    }

    /// Stiffness (0) or damping (1) is to be so many times what the scene says.
    pub fn want_times(&mut self, which: usize, times: f64) {
        if let Some(of) = self.times.get_mut(which) {
            of.wanted = times.clamp(MOST_TIMES.recip(), MOST_TIMES);
        }
    }

    /// What friction is wanted; `None`: it has no numbers.
    pub fn friction(&self) -> Option<&Numbers> {
        Some(&self.friction.as_ref()?.wanted)
    }

    /// A number of the friction is to be this.
    pub fn want_friction(&mut self, key: usize, value: f64) {
        if let Some(friction) = &mut self.friction {
            friction.wanted.set(key, value);
        }
    }

    /// The orders that are due now (s): of each slider one at most.
    pub fn orders(&mut self, now_s: f64) -> Vec<String> {
        let name = &self.name;
        let mut orders: Vec<String> =
            self.times.iter_mut().filter_map(|times| times.order(name, now_s)).collect();
        if let Some(friction) = &mut self.friction
            && friction.sent != friction.wanted
            && friction.pace.goes(now_s)
        {
            friction.sent.clone_from(&friction.wanted);
            orders.push(friction.wanted.order(name));
        }
        orders
    }
}

impl Times {
    fn order(&mut self, name: &str, now_s: f64) -> Option<String> {
        let by = (self.wanted / self.sent).clamp(MOST_TIMES.recip(), MOST_TIMES);
        // What is left is rounding.
        if (by - 1.0).abs() < 1e-9 || !self.pace.goes(now_s) {
            return None;
        }
        self.sent *= by;
        Some(format!("{} {by} of {name}", self.order))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use world::FrictionSpec;

    fn tuning(friction: FrictionSpec) -> Tuning {
        Tuning::new(&Known {
            name: "cube".into(),
            kind: "box",
            mass: None,
            stiffness_n_per_m: 800.0,
            damping_n_s_per_m: 1.0,
            friction,
            is_felt: true,
        })
    }

    #[test]
    fn a_slider_s_orders_say_how_many_times_what_is() {
        let mut tuning = tuning(FrictionSpec::None);
        assert!(tuning.orders(0.0).is_empty(), "nothing is wanted");
        tuning.want_times(0, 2.0);
        assert_eq!(tuning.orders(0.0), ["stiffness 2 of cube"]);
        assert!(tuning.orders(1.0).is_empty(), "it is so");
        tuning.want_times(0, 3.0);
        tuning.want_times(1, 0.5);
        assert_eq!(tuning.orders(1.0), ["stiffness 1.5 of cube", "damping 0.5 of cube"]);
    }

    #[test]
    fn what_one_order_may_not_change_at_once_takes_two() {
        let mut tuning = tuning(FrictionSpec::None);
        tuning.want_times(1, 0.001);
        assert_eq!(tuning.orders(0.0), ["damping 0.1 of cube"], "no less than a tenth");
        tuning.want_times(1, 10.0);
        assert_eq!(tuning.orders(1.0), ["damping 10 of cube"]);
        assert_eq!(tuning.orders(2.0), ["damping 10 of cube"]);
        assert!(tuning.orders(3.0).is_empty());
    }

    #[test]
    fn however_a_slider_goes_its_orders_together_are_what_it_says_and_in_range() {
        let mut tuning = tuning(FrictionSpec::None);
        let (mut made, mut state) = (1.0_f64, 7_u32);
        for picture in 0..10_000 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let share = f64::from(state >> 8) / f64::from(1 << 24);
            tuning.want_times(0, 10.0_f64.powf(2.0 * share - 1.0));
            for order in tuning.orders(f64::from(picture) / 60.0) {
                let by: f64 = order.split(' ').nth(1).and_then(|word| word.parse().ok()).expect(&order);
                assert!((0.1..=10.0).contains(&by), "{order}");
                // As whoever takes orders reckons, and what he takes.
                made *= by;
                assert!((0.1 * (1.0 - 1e-9)..=10.0 * (1.0 + 1e-9)).contains(&made), "{made}");
            }
        }
        tuning.want_times(0, 10.0);
        for second in 200..210 {
            for order in tuning.orders(f64::from(second)) {
                made *= order.split(' ').nth(1).and_then(|word| word.parse::<f64>().ok()).expect(&order);
            }
        }
        assert!((made - 10.0).abs() < 1e-8, "{made}");
    }

    #[test]
    fn a_slider_that_is_drawn_about_gives_ten_orders_a_second_and_the_last_one_is_what_it_says() {
        let mut tuning = tuning(FrictionSpec::Coulomb { mu: 0.5 });
        let mut sent = Vec::new();
        for picture in 0..61 {
            let now_s = f64::from(picture) / 60.0;
            tuning.want_friction(0, f64::from(picture) * 0.01);
            tuning.want_times(0, 1.0 + f64::from(picture) * 0.01);
            sent.extend(tuning.orders(now_s));
        }
        let frictions = |sent: &[String]| sent.iter().filter(|order| order.starts_with("friction")).count();
        assert!((10..=11).contains(&frictions(&sent)), "{sent:?}");
        assert!((10..=11).contains(&(sent.len() - frictions(&sent))), "{sent:?}");
        sent.extend(tuning.orders(2.0));
        assert!(sent.contains(&"friction cube coulomb mu=0.6".to_owned()), "{sent:?}");
    }
}
