//! The tremor of a hand: small involuntary motion of the fingertip, 8 to 12 Hz.
//!
//! Problem: contact algorithms that look quiet under a resting finger chatter under a living one.
//! Model: per axis a sum of sinusoids, one at a random place in each of as many equal parts of the band, with random
//! phases and equal amplitudes; three axes independent. It moves the fingertip against the hand's mass, in front of
//! the grasp's spring, so that the amplitude is that of a free finger. It swells from nothing over the first half
//! second: a run starts at rest.
//! The sinusoids turn by complex products, and phases are drawn without trigonometry: the same seed gives the same
//! bytes on every platform, also after hours, since each product corrects the length.
//! Invariant: bounded by sqrt(2 x sinusoids) times the RMS per axis.
//! Cost: some 50 ns a tick; a short series per sinusoid when the tick's length changes; no allocation.

use nalgebra::Vector3;

use crate::sim::split_mix::SplitMix64;

/// How a hand trembles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TremorSpec {
    /// RMS amplitude of a free fingertip, per axis (m).
    pub rms_m: Vector3<f64>,
    /// Lowest and highest frequency (Hz).
    pub band_hz: [f64; 2],
}

/// The tremor.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tremor {
    waves: [[Wave; WAVES]; 3],
    amplitude_m: Vector3<f64>,
    /// How far it has swollen, 0 to 1.
    swell: f64,
    /// What the waves' turns are for (s).
    step_s: f64,
}

/// One sinusoid as a turning pointer.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Wave {
    rad_per_s: f64,
    /// Cosine and sine of the phase.
    pointer: [f64; 2],
    /// Cosine and sine of what a tick adds.
    turn: [f64; 2],
}

/// Sinusoids per axis: with seven the shortest time after which an axis could repeat is minutes.
const WAVES: usize = 7;
/// How long it takes to swell (s).
const SWELL_S: f64 = 0.5;

impl Tremor {
    pub(super) fn new(spec: &TremorSpec, seed: u64) -> Self {
        let mut random = SplitMix64::new(seed);
        let [low, high] = spec.band_hz;
        let width = (high - low) / WAVES as f64;
        let waves = std::array::from_fn(|_| {
            std::array::from_fn(|part| {
                let hz = low + width * (part as f64 + random.unit());
                Wave::new(std::f64::consts::TAU * hz, pointer(&mut random))
            })
        });
        // A sinusoid's mean square is half its amplitude's.
        let amplitude_m = spec.rms_m * (2.0 / WAVES as f64).sqrt();
        Self { waves, amplitude_m, swell: 0.0, step_s: 0.0 }
    }

    /// Where the fingertip is against the hand at the end of a tick of `dt_s` > 0 (m).
    pub(super) fn step(&mut self, dt_s: f64) -> Vector3<f64> {
        if dt_s != self.step_s {
            self.waves.iter_mut().flatten().for_each(|wave| wave.set_step(dt_s));
            self.step_s = dt_s;
        }
        self.swell = (self.swell + dt_s / SWELL_S).min(1.0);
        let sums = self.waves.each_mut().map(|axis| axis.iter_mut().map(Wave::step).sum::<f64>());
        Vector3::from(sums).component_mul(&self.amplitude_m) * self.swell
    }
}

impl Wave {
    fn new(rad_per_s: f64, pointer: [f64; 2]) -> Self {
        Self { rad_per_s, pointer, turn: [1.0, 0.0] }
    }

    fn set_step(&mut self, dt_s: f64) {
        self.turn = cosine_and_sine(self.rad_per_s * dt_s);
    }

    fn step(&mut self) -> f64 {
        let ([c, s], [dc, ds]) = (self.pointer, self.turn);
        let (c, s) = (c * dc - s * ds, s * dc + c * ds);
        // One step of Newton's towards length one: rounding would add up otherwise.
        let correction = 1.5 - 0.5 * (c * c + s * s);
        self.pointer = [c * correction, s * correction];
        self.pointer[1]
    }
}

/// A direction with every angle alike: a point of the unit disc, stretched to its rim.
fn pointer(random: &mut SplitMix64) -> [f64; 2] {
    // Each draw succeeds with more than 3/4.
    for _ in 0..64 {
        let (x, y) = (random.signed_unit(), random.signed_unit());
        let square = x * x + y * y;
        if (0.01..=1.0).contains(&square) {
            let length = square.sqrt();
            return [x / length, y / length];
        }
    }
    [1.0, 0.0]
}

/// By their series, which are the same on every platform; exact to rounding for angles up to two, that is 30 Hz at 100 Hz.
fn cosine_and_sine(angle: f64) -> [f64; 2] {
    let square = angle * angle;
    let (mut cosine, mut sine) = (1.0, 1.0);
    for term in (1..=14).rev() {
        let even = f64::from(2 * term);
        cosine = 1.0 - square / (even * (even - 1.0)) * cosine;
        sine = 1.0 - square / (even * (even + 1.0)) * sine;
    }
    [cosine, angle * sine]
}
