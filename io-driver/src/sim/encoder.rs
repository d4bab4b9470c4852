//! What the counters of a simulated arm show.
//!
//! Model: the motor's angle in counts, with the sensor's own noise, rounded to the nearest, as a counter of few
//! bits shows it: it wraps. The counters read zero in the home pose.
//! Cost: a few operations per joint; a random number each, if there is noise.

use super::split_mix::SplitMix64;
use crate::encoders::{EncoderSpec, JointMap, wrapped};

/// The encoders of an arm.
#[derive(Debug, Clone)]
pub struct EncoderPlant {
    map: JointMap,
    home_rad: [f64; 3],
    bits: u32,
    noise_counts: f64,
}

impl EncoderPlant {
    /// Encoders of this kind, with noise of this standard deviation.
    pub fn new(spec: &EncoderSpec, noise_counts: f64) -> Self {
        Self {
            map: JointMap::new(spec),
            home_rad: spec.home_joint_angles_rad,
            bits: spec.count_bits,
            noise_counts,
        }
    }

    /// Raw counters at these joint angles of the motors (rad).
    pub fn raw(&self, joints_rad: [f64; 3], noise: &mut SplitMix64) -> [i64; 3] {
        let rad_per_count = self.map.rad_per_count();
        std::array::from_fn(|j| {
            let counts = (joints_rad[j] - self.home_rad[j]) / rad_per_count[j];
            let noisy =
                if self.noise_counts > 0.0 { counts + self.noise_counts * noise.normal() } else { counts };
            wrapped(noisy.round() as i64, self.bits)
        })
    }

    /// Angle of a count of each joint (rad), with its sign.
    pub fn rad_per_count(&self) -> [f64; 3] {
        self.map.rad_per_count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::encoders::EncoderExtender;

    const SPEC: EncoderSpec = EncoderSpec {
        channel: [0, 1, 2],
        counts_per_rev: 4096,
        count_bits: 12,
        sign: [1, -1, 1],
        reduction: [10.0; 3],
        home_joint_angles_rad: [0.1, 0.2, 0.3],
    };

    #[test]
    fn without_noise_an_angle_comes_back_within_half_a_count_however_often_the_counter_wrapped() {
        let encoders = EncoderPlant::new(&SPEC, 0.0);
        let (mut extender, map) = (EncoderExtender::new(12), JointMap::new(&SPEC));
        let mut noise = SplitMix64::new(1);
        for step in 0..4000 {
            // A count is 1.5e-4 rad, so this wraps 12 bits three times and moves six counts a step.
            let joints = [0.1, 0.2, 0.3].map(|home| home + f64::from(step) * 1e-3 * 0.5);
            let found = map.counts_to_angles(extender.extend(encoders.raw(joints, &mut noise)));
            for (found, true_angle) in found.into_iter().zip(joints) {
                let count = std::f64::consts::TAU / 40_960.0;
                assert!((found - true_angle).abs() <= count * (0.5 + 1e-9), "{step}");
            }
        }
    }

    #[test]
    fn noise_has_the_spread_that_was_asked_for() {
        let encoders = EncoderPlant::new(&SPEC, 3.0);
        let mut noise = SplitMix64::new(7);
        let signed = |raw: i64| if raw >= 2048 { raw - 4096 } else { raw };
        let squares: f64 = (0..20_000)
            .map(|_| signed(encoders.raw(SPEC.home_joint_angles_rad, &mut noise)[0]) as f64)
            .map(|counts| counts * counts)
            .sum();
        // Rounding adds a twelfth; a variance from 20,000 samples is good to 1 % (one sigma).
        let variance = squares / 20_000.0;
        assert!((variance - (9.0 + 1.0 / 12.0)).abs() < 0.4, "{variance}");
    }
}
