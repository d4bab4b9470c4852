//! The laws' differential equations, integrated slowly: the oracle.
//!
//! Between two ticks the HIP moves evenly. Its way is cut into [`SUBSTEPS`] pieces, and over each a law either moves the
//! god-object at a speed (classical Runge-Kutta method of fourth order) or to the rim of a circle (bisection). Nothing here
//! knows of the implicit steps, secants and tangent planes of the library.

use super::ground::Ground;

/// Pieces of a tick.
const SUBSTEPS: usize = 16;

/// HIP and god-object along the way, and what a law remembers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slider {
    ground: Ground,
    s: f64,
    pub(crate) g: f64,
    /// Speed of the HIP along the tangent plane that the tick begins with (m/s), signed.
    pub(crate) hip_speed_m_s: f64,
    /// Whether static friction holds it; which laws without stuck state ignore.
    pub(crate) is_stuck: bool,
    /// The last speed of the god-object that was not zero since it was stuck (m/s).
    pub(crate) slide_speed_m_s: f64,
    /// Highest speed of HIP and god-object so far (m/s): bounds the error of a tick.
    pub(crate) highest_speed_m_s: f64,
}

/// A friction law as its authors wrote it.
pub(crate) trait Equation {
    /// Goes on by `dt_s`, in which the HIP has got to where `slider` says.
    fn step(&self, slider: &mut Slider, dt_s: f64);

    /// What is felt beside the spring (m), positive while it draws the finger back.
    fn beside_m(&self, slider: &Slider) -> f64 {
        let _ = slider;
        0.0
    }
}

impl Slider {
    pub(crate) fn new(ground: Ground) -> Self {
        Self {
            ground,
            s: 0.0,
            g: 0.0,
            hip_speed_m_s: 0.0,
            is_stuck: true,
            slide_speed_m_s: 0.0,
            highest_speed_m_s: 0.0,
        }
    }

    /// One tick of the library's.
    pub(crate) fn tick(&mut self, law: &dyn Equation, to: f64, dt_s: f64) {
        let (from, piece_s) = (self.s, dt_s / SUBSTEPS as f64);
        self.hip_speed_m_s = (self.ground.gap_m(to, self.g) - self.ground.gap_m(from, self.g)) / dt_s;
        for piece in 1..=SUBSTEPS {
            let g_before = self.g;
            self.s = from + (to - from) * piece as f64 / SUBSTEPS as f64;
            law.step(self, piece_s);
            let slid_m_s = (self.g - g_before).abs() / piece_s;
            // A jump to the rim takes no time, and is exact in one tick, too.
            let fastest_m_s = self.hip_speed_m_s.abs().max(if slid_m_s < 2.0 { slid_m_s } else { 0.0 });
            self.highest_speed_m_s = self.highest_speed_m_s.max(fastest_m_s);
        }
    }

    /// How far S is ahead of the god-object.
    pub(crate) fn gap_m(&self) -> f64 {
        self.ground.gap_m(self.s, self.g)
    }

    pub(crate) fn load_m(&self) -> f64 {
        self.ground.load_m(self.s, self.g)
    }

    /// What the law draws the finger back with (m).
    pub(crate) fn spring_m(&self, law: &dyn Equation) -> f64 {
        self.gap_m() + law.beside_m(self)
    }

    /// Moves the god-object at `speed(gap, load)` (m/s, towards S) for `dt_s`.
    pub(crate) fn slide_at(&mut self, dt_s: f64, speed: impl Fn(f64, f64) -> f64) {
        let (ground, s, g, v) = (self.ground, self.s, self.g, self.hip_speed_m_s);
        let slope =
            |back_s: f64, g: f64| speed(ground.gap_m(s - v * back_s, g), ground.load_m(s - v * back_s, g));
        let k1 = slope(dt_s, g);
        let k2 = slope(0.5 * dt_s, g + 0.5 * dt_s * k1);
        let k3 = slope(0.5 * dt_s, g + 0.5 * dt_s * k2);
        let k4 = slope(0.0, g + dt_s * k3);
        self.g += dt_s / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    }

    /// Moves the god-object towards S until the gap is no more than `circle(load)`; says whether it had to.
    pub(crate) fn draw_within(&mut self, circle: impl Fn(f64) -> f64) -> bool {
        let (ground, s) = (self.ground, self.s);
        let excess = |g: f64| ground.gap_m(s, g).abs() - circle(ground.load_m(s, g));
        if excess(self.g) <= 0.0 {
            return false;
        }
        let (mut out, mut within) = (self.g, ground.foot(s));
        for _ in 0..60 {
            let middle = 0.5 * (out + within);
            if excess(middle) > 0.0 { out = middle } else { within = middle }
        }
        self.g = within;
        true
    }
}
