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

#[cfg(test)]
mod tests {
    use super::*;

    const CALM: TremorSpec = TremorSpec { rms_m: Vector3::new(5e-5, 3e-5, 2e-5), band_hz: [8.0, 12.0] };

    /// Positions at 1 kHz after it has swollen.
    fn samples(seed: u64, count: usize) -> Vec<Vector3<f64>> {
        let mut tremor = Tremor::new(&CALM, seed);
        (0..count + 1000).map(|_| tremor.step(1e-3)).skip(1000).collect()
    }

    #[test]
    fn the_same_seed_gives_the_same_bytes_on_every_platform_and_another_seed_others() {
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        for byte in samples(42, 10_000).iter().flatten().flat_map(|n| n.to_bits().to_le_bytes()) {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
        // FNV-1a of what this code gave when it was written; only sums, products, quotients and roots are in it.
        assert_eq!(hash, 13_144_528_826_769_656_779);
        assert_ne!(samples(42, 1), samples(43, 1));
    }

    #[test]
    fn its_power_lies_in_the_band_and_its_amplitude_is_the_wanted_one() {
        // 40 s at 1 kHz: bins of 1/40 Hz, coarse enough for a slow transform of the few that matter.
        let samples = samples(1, 40_000);
        for axis in 0..3 {
            let square = samples.iter().map(|p| p[axis] * p[axis]).sum::<f64>() / samples.len() as f64;
            // Sinusoids 0.57 Hz apart on average beat; over 40 s the mean square is off by some percent.
            assert!((square.sqrt() / CALM.rms_m[axis] - 1.0).abs() < 0.05, "{axis}: {}", square.sqrt());
            let in_band: f64 = (316..=484).map(|bin| power(&samples, axis, bin)).sum();
            // 7.9 to 12.1 Hz; what a rectangular window of 40 s leaks beyond it is below 2 %.
            assert!(in_band / square > 0.98, "{axis}: {}", in_band / square);
            let lowest: f64 = (316..=400).map(|bin| power(&samples, axis, bin)).sum();
            // Three of seven sinusoids lie below 10 Hz for certain, four with luck.
            assert!((0.35..0.65).contains(&(lowest / square)), "{axis}: {}", lowest / square);
        }
    }

    /// Mean square of one frequency, bins of 1/40 Hz.
    fn power(samples: &[Vector3<f64>], axis: usize, bin: usize) -> f64 {
        let turn = std::f64::consts::TAU * bin as f64 / samples.len() as f64;
        let (mut c, mut s) = (0.0, 0.0);
        for (index, p) in samples.iter().enumerate() {
            let (sine, cosine) = (turn * index as f64).sin_cos();
            (c, s) = (c + p[axis] * cosine, s + p[axis] * sine);
        }
        2.0 * (c * c + s * s) / (samples.len() as f64).powi(2)
    }

    #[test]
    fn axes_tremble_independently() {
        let samples = samples(3, 40_000);
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let product = samples.iter().map(|p| p[a] * p[b]).sum::<f64>() / samples.len() as f64;
            // Pairs of sinusoids of 0.1 Hz apart or so are what is left after 40 s, some of 49.
            assert!((product / (CALM.rms_m[a] * CALM.rms_m[b])).abs() < 0.15, "{a} {b}");
        }
    }

    #[test]
    fn it_swells_from_rest_and_neither_grows_nor_fades_in_hours() {
        let mut tremor = Tremor::new(&CALM, 5);
        // First tick: 1/500 of what it can be at most.
        assert!(tremor.step(1e-3).norm() < 1e-3 * CALM.rms_m.norm() * (2.0 * WAVES as f64).sqrt() * 2.01);
        for _ in 0..10_000_000 {
            tremor.step(1e-3);
        }
        for wave in tremor.waves.iter().flatten() {
            let [c, s] = wave.pointer;
            assert!((c.hypot(s) - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn a_changed_tick_goes_on_where_it_was_at_the_same_frequency() {
        let (mut fast, mut slow) = (Tremor::new(&CALM, 9), Tremor::new(&CALM, 9));
        for _ in 0..2000 {
            fast.step(0.5e-3);
            let halved = fast.step(0.5e-3);
            let difference = (halved - slow.step(1e-3)).norm();
            // 4000 products of one rounding each, of amplitudes of 50 um.
            assert!(difference < 1e-16, "{difference}");
        }
    }
}
