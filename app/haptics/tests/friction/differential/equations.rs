//! The laws as their authors wrote them, with the deviations that the modules of `src/friction` name.
//!
//! `z` is the gap S - G, `N / k` the load, v the speed of the HIP along the surface, u that of the god-object.

use super::slider::{Equation, Slider};
use crate::common::K;
use haptics::{Friction, RESTICK_MARGIN};

/// A law of the library beside its own equation.
pub(crate) struct Pair {
    pub(crate) name: &'static str,
    pub(crate) friction: Friction,
    pub(crate) equation: Box<dyn Equation>,
    /// Whether a tick is exact: the answer depends on the way alone, not on how fast it is gone.
    pub(crate) is_exact: bool,
    /// Force per gap that the law adds to the spring, over k: an error of the gap comes back so much larger.
    pub(crate) gain: f64,
}

/// Every law whose force is not random.
pub(crate) fn all() -> Vec<Pair> {
    let exact = |name, friction: Result<Friction, _>, equation: Box<dyn Equation>| Pair {
        name,
        friction: friction.unwrap(),
        equation,
        is_exact: true,
        gain: 0.0,
    };
    let rate = |name, friction, equation| Pair { is_exact: false, ..exact(name, friction, equation) };
    // It may jump from branch to branch a tick later than the equation, and then slides for that tick.
    let jumps = |name, friction, equation| Pair { gain: 1.0, ..rate(name, friction, equation) };
    let curve = [(0.0, 0.35), (0.006, 0.45), (0.01, 0.3), (0.5, 0.65)];
    vec![
        exact("none", Ok(Friction::None), Circles::smooth(0.0)),
        exact("coulomb", Friction::coulomb(0.5), Circles::smooth(0.5)),
        exact("stiction", Friction::stiction(0.5, 0.3), Circles::sticking(0.5, 0.3, RESTICK_MARGIN)),
        rate("viscous", Friction::viscous(2.0), Box::new(Viscous { mu: 0.0, mu_v: 2.0 })),
        rate(
            "coulomb-viscous",
            Friction::coulomb_viscous(0.3, 1.0),
            Box::new(Viscous { mu: 0.3, mu_v: 1.0 }),
        ),
        jumps(
            "stribeck",
            Friction::stribeck(0.5, 0.4, 0.004, 1.0),
            Curve::boxed(0.5, 0.4, |u| stribeck(u) + u),
        ),
        jumps("curve", Friction::curve(0.45, &curve), Curve::linear(0.45, &curve, 0.3)),
        exact("karnopp", Friction::karnopp(0.5, 0.3, 0.03, 0.0), Karnopp::boxed(0.5, 0.3, 0.03, 0.0)),
        rate("karnopp, viscous", Friction::karnopp(0.5, 0.3, 0.03, 1.0), Karnopp::boxed(0.5, 0.3, 0.03, 1.0)),
        rate("dahl", Friction::dahl(0.5), Box::new(Dahl { mu: 0.5 })),
        rate(
            "hayward-armstrong",
            Friction::hayward_armstrong(0.5, 0.6),
            Box::new(HaywardArmstrong { mu: 0.5, stick: 0.6 }),
        ),
        rate(
            "lugre",
            Friction::lugre(0.5, 0.4, 0.004, 0.5, 0.0),
            Box::new(LuGre { damping: 0.0, mu_v: 0.5 }),
        ),
        // What the damping makes of a gap: sigma_1 |v| / (k g), with |v| <= 0.3 m/s and g >= 0.4 * 5 mm.
        Pair {
            gain: 3.0 * 0.3 / (K * 2e-3),
            ..rate(
                "lugre, damped",
                Friction::lugre(0.5, 0.4, 0.004, 0.5, 3.0),
                Box::new(LuGre { damping: 3.0, mu_v: 0.5 }),
            )
        },
        exact("reset integrator", Friction::reset_integrator(0.5, 0.3, 2.0), Box::new(ResetIntegrator)),
        exact("fixed cone", Friction::fixed_cone(0.8, None), Circles::of_force(0.8, 0.8, None)),
        exact(
            "fixed cone, sticking",
            Friction::fixed_cone(0.8, Some(1.3)),
            Circles::of_force(1.3, 0.8, Some(RESTICK_MARGIN)),
        ),
    ]
}

/// Coulomb friction with a static circle: held within one circle, drawn to the rim of another.
struct Circles {
    held_m: Box<dyn Fn(f64) -> f64>,
    slid_m: Box<dyn Fn(f64) -> f64>,
    /// Part of the sliding circle that it must come within to stick again; `None`: all of it.
    margin: Option<f64>,
}

impl Circles {
    fn smooth(mu: f64) -> Box<dyn Equation> {
        let circle = move |load_m: f64| mu * load_m;
        Box::new(Self { held_m: Box::new(circle), slid_m: Box::new(circle), margin: None })
    }

    fn sticking(mu_s: f64, mu_d: f64, margin: f64) -> Box<dyn Equation> {
        let (held_m, slid_m) = (move |load_m: f64| mu_s * load_m, move |load_m: f64| mu_d * load_m);
        Box::new(Self { held_m: Box::new(held_m), slid_m: Box::new(slid_m), margin: Some(margin) })
    }

    fn of_force(held_n: f64, slid_n: f64, margin: Option<f64>) -> Box<dyn Equation> {
        Box::new(Self {
            held_m: Box::new(move |_| held_n / K),
            slid_m: Box::new(move |_| slid_n / K),
            margin,
        })
    }
}

impl Equation for Circles {
    fn step(&self, slider: &mut Slider, _: f64) {
        let (gap_m, load_m) = (slider.gap_m().abs(), slider.load_m());
        let within_m = (1.0 - self.margin.unwrap_or(0.0)) * (self.slid_m)(load_m);
        let is_held = slider.is_stuck && gap_m <= (self.held_m)(load_m);
        slider.is_stuck = is_held || gap_m < within_m;
        if !slider.is_stuck {
            slider.draw_within(&self.slid_m);
        }
    }
}

/// `u = (|z| - mu N / k) / (mu_v N / k)` beyond the circle of Coulomb friction.
struct Viscous {
    mu: f64,
    mu_v: f64,
}

impl Equation for Viscous {
    fn step(&self, slider: &mut Slider, dt_s: f64) {
        slider.slide_at(dt_s, |gap_m, load_m| {
            ((gap_m.abs() - self.mu * load_m).max(0.0) / (self.mu_v * load_m)).copysign(gap_m)
        });
    }
}

/// Friction against speed, any curve: a slider without mass runs faster while the spring pulls more than friction holds, slower
/// while it pulls less, until both are equal; see `src/friction/sliding.rs`.
pub(crate) struct Curve<F> {
    mu_s: f64,
    ratio: F,
    /// What counts as less than the curve asks for, over the load.
    margin: f64,
}

impl<F: Fn(f64) -> f64 + 'static> Curve<F> {
    /// The margin is on the curve's dynamic coefficient.
    fn boxed(mu_s: f64, mu_d: f64, ratio: F) -> Box<dyn Equation> {
        Box::new(Self { mu_s, ratio, margin: RESTICK_MARGIN * mu_d })
    }

    /// The speed at which a slider comes into balance that had this one; `None`: it comes to rest.
    fn balance(&self, pull: f64, from_m_s: f64) -> Option<f64> {
        // Finer than what is steepest on a curve.
        const STEP_M_S: f64 = 2e-5;
        let is_pulled = |u: f64| pull >= (self.ratio)(u);
        let (mut inner, mut outer) = (from_m_s, from_m_s);
        if is_pulled(from_m_s) {
            while is_pulled(outer) {
                (inner, outer) = (outer, outer + STEP_M_S);
            }
        } else {
            while !is_pulled(inner) {
                if inner == 0.0 {
                    return None;
                }
                (inner, outer) = ((inner - STEP_M_S).max(0.0), inner);
            }
        }
        // To less than a rounding of speeds of a metre per second.
        for _ in 0..36 {
            let middle = 0.5 * (inner + outer);
            if is_pulled(middle) { inner = middle } else { outer = middle }
        }
        Some(inner)
    }
}

impl<F: Fn(f64) -> f64 + 'static> Equation for Curve<F> {
    fn step(&self, slider: &mut Slider, dt_s: f64) {
        let pull = slider.gap_m().abs() / slider.load_m();
        if slider.is_stuck {
            slider.slide_speed_m_s = 0.0;
            slider.is_stuck = pull <= self.mu_s;
        } else {
            slider.is_stuck = self.balance(pull + self.margin, slider.slide_speed_m_s).is_none();
        }
        if let (false, Some(speed_m_s)) = (slider.is_stuck, self.balance(pull, slider.slide_speed_m_s)) {
            slider.slide_speed_m_s = speed_m_s;
            slider.slide_at(dt_s, |gap_m, _| speed_m_s.copysign(gap_m));
        }
    }
}

impl Curve<()> {
    /// Straight lines between points.
    pub(crate) fn linear(mu_s: f64, points: &[(f64, f64)], lowest: f64) -> Box<dyn Equation> {
        let points = points.to_vec();
        Curve::boxed(mu_s, lowest, move |u| linear(&points, u))
    }
}

fn stribeck(speed_m_s: f64) -> f64 {
    0.4 + (0.5 - 0.4) * (-(speed_m_s / 0.004).powi(2)).exp()
}

fn linear(points: &[(f64, f64)], speed_m_s: f64) -> f64 {
    let pair = points.windows(2).find(|pair| speed_m_s < pair[1].0);
    let Some([(v0, mu0), (v1, mu1)]) = pair.and_then(|pair| <[_; 2]>::try_from(pair).ok()) else {
        return points[points.len() - 1].1;
    };
    mu0 + (mu1 - mu0) * (speed_m_s - v0) / (v1 - v0)
}

/// Stuck below a speed of the HIP, and until `mu_s` is passed.
struct Karnopp {
    mu_s: f64,
    mu_d: f64,
    v_min_m_s: f64,
    mu_v: f64,
}

impl Karnopp {
    fn boxed(mu_s: f64, mu_d: f64, v_min_m_s: f64, mu_v: f64) -> Box<dyn Equation> {
        Box::new(Self { mu_s, mu_d, v_min_m_s, mu_v })
    }
}

impl Equation for Karnopp {
    fn step(&self, slider: &mut Slider, dt_s: f64) {
        let may_stick = slider.is_stuck || slider.hip_speed_m_s.abs() <= self.v_min_m_s;
        slider.is_stuck = may_stick && slider.gap_m().abs() <= self.mu_s * slider.load_m();
        if slider.is_stuck {
            return;
        }
        if self.mu_v == 0.0 {
            slider.draw_within(|load_m| self.mu_d * load_m);
        } else {
            Viscous { mu: self.mu_d, mu_v: self.mu_v }.step(slider, dt_s);
        }
    }
}

/// `z' = v - |v| z / z_max`, and never more than `z_max`, which a ball would make of it: there the god-object goes farther than
/// the HIP below it.
struct Dahl {
    mu: f64,
}

impl Equation for Dahl {
    fn step(&self, slider: &mut Slider, dt_s: f64) {
        let v = slider.hip_speed_m_s.abs();
        slider.slide_at(dt_s, |gap_m, load_m| v * gap_m / (self.mu * load_m));
        slider.draw_within(|load_m| self.mu * load_m);
    }
}

/// `z' = v - |v| alpha(z) z`, with no yield up to a part of `z_max`.
struct HaywardArmstrong {
    mu: f64,
    stick: f64,
}

impl Equation for HaywardArmstrong {
    fn step(&self, slider: &mut Slider, dt_s: f64) {
        let v = slider.hip_speed_m_s.abs();
        slider.slide_at(dt_s, |gap_m, load_m| {
            let z_max_m = self.mu * load_m;
            let alpha_per_m = (gap_m.abs() / z_max_m - self.stick).max(0.0) / (1.0 - self.stick) / z_max_m;
            v * alpha_per_m * gap_m
        });
        slider.draw_within(|load_m| self.mu * load_m);
    }
}

/// `z' = v - |v| z / g(v)` and `F = k z + sigma_1 z' + mu_v v N`, on the curve of [`stribeck`].
struct LuGre {
    damping: f64,
    mu_v: f64,
}

impl Equation for LuGre {
    fn step(&self, slider: &mut Slider, dt_s: f64) {
        let v = slider.hip_speed_m_s.abs();
        slider.slide_at(dt_s, |gap_m, load_m| v * gap_m / (stribeck(v) * load_m));
        slider.draw_within(|load_m| 0.5 * load_m);
    }

    /// The damping is cut: it neither drives nor lifts the dry part above `mu_s N`.
    fn beside_m(&self, slider: &Slider) -> f64 {
        let (v, z, load_m) = (slider.hip_speed_m_s, slider.gap_m(), slider.load_m());
        if v == 0.0 {
            return 0.0;
        }
        let along_m = z * v.signum();
        let rate_m_s = v.abs() * (1.0 - along_m / (stribeck(v.abs()) * load_m));
        let room_m = 0.5 * load_m - along_m;
        let damped_m = (self.damping / K * rate_m_s).min(room_m).max(0.0);
        (damped_m + self.mu_v * v.abs() * load_m).copysign(v)
    }
}

/// A bond up to `mu_s N`, damped along the motion of the HIP; broken, `mu_d N` until the strain falls below that.
struct ResetIntegrator;

impl Equation for ResetIntegrator {
    fn step(&self, slider: &mut Slider, dt_s: f64) {
        Circles::sticking(0.5, 0.3, 0.0).step(slider, dt_s);
    }

    fn beside_m(&self, slider: &Slider) -> f64 {
        let v = slider.hip_speed_m_s;
        if !slider.is_stuck || v == 0.0 {
            return 0.0;
        }
        let room_m = 0.5 * slider.load_m() - slider.gap_m() * v.signum();
        (2.0 / K * v.abs()).min(room_m).max(0.0).copysign(v)
    }
}
