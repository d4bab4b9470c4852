//! Turns raw encoder counters into joint angles, and back.
//!
//! Problem: a counter has few bits and wraps, counts motor turns instead of joint angles, may
//! count the wrong way round, and knows nothing of where the joint was when power came on.
//! Model: [`EncoderExtender`] adds the signed difference of successive raw readings modulo
//! `2^bits`, exact as long as no joint moves half of that between two readings: with 16 bits
//! eight motor turns, almost a second at a hand's peak speed of 1 m/s. [`JointMap`] is linear:
//! `joint = home_joint + sign (count - home_count) 2 pi / (counts_per_rev reduction)`.
//! Signs: +1 where the counter rises with the joint angle.
//! Invariants: an extended count is congruent to the last raw one modulo `2^bits`, so a missed
//! reading leaves no drift behind.
//! Cost: a few operations per joint.
//! Resolution at the tip is the angle of a count times the lever: on a Premium 1.5
//! `2 pi / 4096 / 11.3 * 0.215 m = 0.0292 mm`; the data sheet says 0.03 mm.

use std::f64::consts::TAU;

/// How a device counts; what each number is for stands in its description file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EncoderSpec {
    /// Which of the device's counters belongs to each joint.
    pub channel: [u8; 3],
    /// Counts per turn of the motor, all edges counted.
    pub counts_per_rev: u32,
    /// Width of the raw counter, 1 to 63.
    pub count_bits: u32,
    /// +1 or -1: whether the counter rises or falls with the joint angle.
    pub sign: [i8; 3],
    /// Turns of the motor per turn of the joint.
    pub reduction: [f64; 3],
    /// Joint angles of the pose in which the device is zeroed.
    pub home_joint_angles_rad: [f64; 3],
}

/// Counts of `N` counters beyond the width at which they wrap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EncoderExtender<const N: usize = 3> {
    bits: u32,
    counts: [i64; N],
}

/// Linear map between extended counts and joint angles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointMap {
    rad_per_count: [f64; 3],
    home_joints_rad: [f64; 3],
    home_counts: [i64; 3],
}

impl<const N: usize> EncoderExtender<N> {
    /// For counters of `bits` bits, 1 to 63 (others are taken as the nearest of these).
    ///
    /// The first readings are taken as signed numbers, since nobody knows how often the counters
    /// wrapped before.
    pub fn new(bits: u32) -> Self {
        Self { bits: bits.clamp(1, 63), counts: [0; N] }
    }

    /// Takes the raw readings of a tick; bits above the width are ignored.
    pub fn extend(&mut self, raw: [i64; N]) -> [i64; N] {
        let unused = 64 - self.bits;
        for (count, raw) in self.counts.iter_mut().zip(raw) {
            // Shifting up and back down keeps `bits` bits and spreads the sign.
            let difference = (raw.wrapping_sub(*count) << unused) >> unused;
            *count = count.wrapping_add(difference);
        }
        self.counts
    }

    /// The extended counts after the last readings.
    pub fn counts(&self) -> [i64; N] {
        self.counts
    }
}

impl JointMap {
    /// The map of a device whose counters read zero in its home pose, until
    /// [`JointMap::zero_at`] says otherwise.
    pub fn new(spec: &EncoderSpec) -> Self {
        let per_motor_turn = TAU / f64::from(spec.counts_per_rev);
        let rad_per_count =
            std::array::from_fn(|j| f64::from(spec.sign[j]) * per_motor_turn / spec.reduction[j]);
        Self { rad_per_count, home_joints_rad: spec.home_joint_angles_rad, home_counts: [0; 3] }
    }

    /// Declares that the device is in its home pose now.
    pub fn zero_at(&mut self, counts: [i64; 3]) {
        self.home_counts = counts;
    }

    /// Joint angles of extended counts.
    pub fn counts_to_angles(&self, counts: [i64; 3]) -> [f64; 3] {
        std::array::from_fn(|j| {
            let from_home = counts[j].wrapping_sub(self.home_counts[j]);
            self.home_joints_rad[j] + self.rad_per_count[j] * from_home as f64
        })
    }

    /// The extended counts nearest to joint angles: what an ideal encoder would show.
    ///
    /// Saturates far outside of any device; an angle that is not a number counts as home.
    pub fn angles_to_counts(&self, joints_rad: [f64; 3]) -> [i64; 3] {
        std::array::from_fn(|j| {
            let from_home = (joints_rad[j] - self.home_joints_rad[j]) / self.rad_per_count[j];
            // `as` saturates, and makes zero of NaN.
            self.home_counts[j].saturating_add(from_home.round() as i64)
        })
    }

    /// The angles of the zeroing pose.
    pub fn home_angles_rad(&self) -> [f64; 3] {
        self.home_joints_rad
    }

    /// Angle of one count of each joint, with the sign of the counter.
    pub fn rad_per_count(&self) -> [f64; 3] {
        self.rad_per_count
    }
}

/// What a counter of `bits` bits, 1 to 63, shows for an extended count: 0 to `2^bits - 1`.
pub fn wrapped(count: i64, bits: u32) -> i64 {
    count & (i64::MAX >> (63 - bits.clamp(1, 63)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinematics::{JointLimits, Mechanism, Premium};
    use proptest::prelude::*;

    const PREMIUM: EncoderSpec = EncoderSpec {
        channel: [0, 1, 2],
        counts_per_rev: 4096,
        count_bits: 16,
        sign: [1, -1, 1],
        reduction: [175.0 / 13.0, 11.3, 11.3],
        home_joint_angles_rad: [0.0, 0.25, -0.5],
    };

    #[test]
    fn a_motor_turn_is_a_joint_turn_divided_by_the_reduction_and_signed() {
        let angles = JointMap::new(&PREMIUM).counts_to_angles([4096; 3]);
        let expected = [TAU * 13.0 / 175.0, 0.25 - TAU / 11.3, -0.5 + TAU / 11.3];
        for j in 0..3 {
            // Four roundings of numbers below one.
            assert!((angles[j] - expected[j]).abs() < 4.0 * f64::EPSILON, "{angles:?}");
        }
    }

    #[test]
    fn zeroing_gives_the_home_pose_to_the_counts_of_that_moment() {
        let mut map = JointMap::new(&PREMIUM);
        map.zero_at([100, -200, 1 << 40]);
        assert_eq!(map.counts_to_angles([100, -200, 1 << 40]), PREMIUM.home_joint_angles_rad);
        assert_eq!(map.angles_to_counts(PREMIUM.home_joint_angles_rad), [100, -200, 1 << 40]);
    }

    #[test]
    fn a_count_moves_the_tip_by_what_the_data_sheet_says() {
        let rad_per_count = JointMap::new(&PREMIUM).rad_per_count();
        let jacobian = Premium::new([0.215, 0.170], JointLimits::UNBOUNDED).jacobian([0.0; 3]);
        let steps_mm = [0, 1, 2].map(|j| 1e3 * rad_per_count[j].abs() * jacobian.column(j).norm());
        // 2 pi / 4096 / 11.3 rad times 215 mm; turret and forearm are finer. "Nominal 0.03 mm",
        // "more than 860 dpi" (25.4 mm / 860 = 0.0295 mm).
        assert!((steps_mm[1] - 0.02919).abs() < 5e-6, "{steps_mm:?}");
        assert!(steps_mm.iter().all(|&mm| mm < 25.4 / 860.0), "{steps_mm:?}");
    }

    #[test]
    fn counting_over_the_edge_goes_on() {
        let mut extender = EncoderExtender::new(16);
        assert_eq!(extender.extend([65_530, 3, 0x7fff]), [-6, 3, 32_767]);
        assert_eq!(extender.extend([5, 65_533, 0x8000]), [5, -3, 32_768]);
        assert_eq!(extender.extend([5, 65_533, 0xfffe]), [5, -3, 65_534]);
        assert_eq!(extender.extend([5, 65_533, 1]), [5, -3, 65_537]);
    }

    #[test]
    fn garbage_above_the_counters_width_is_ignored() {
        let mut extender = EncoderExtender::new(16);
        assert_eq!(extender.extend([0x7abc_0005, -1, i64::MIN]), [5, -1, 0]);
    }

    #[test]
    fn an_angle_that_is_not_a_number_counts_as_home() {
        let map = JointMap::new(&PREMIUM);
        assert_eq!(map.angles_to_counts([f64::NAN; 3]), [0; 3]);
        assert_eq!(map.angles_to_counts([f64::INFINITY, 0.25, -0.5]), [i64::MAX, 0, 0]);
    }

    proptest! {
        #[test]
        fn wrapping_and_extending_is_the_identity(
            bits in 2u32..=32, start in -100i64..100,
            steps in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 1..200),
        ) {
            let half = 1i64 << (bits - 1);
            let mut extender = EncoderExtender::new(bits);
            // The first reading decides the turn, so it has to lie within half a range.
            let mut counts = [start.clamp(-half, half - 1); 3];
            for step in steps {
                prop_assert_eq!(extender.extend(counts.map(|c| wrapped(c, bits))), counts);
                // Up to half of the range in a tick; the half itself is taken as negative.
                counts = std::array::from_fn(|j| counts[j] + (step[j] * half as f64).floor() as i64);
            }
        }

        #[test]
        fn counts_survive_the_way_to_angles_and_back(
            counts in prop::array::uniform3(-1i64 << 31..1 << 31),
            home in prop::array::uniform3(-1i64 << 31..1 << 31),
        ) {
            let mut map = JointMap::new(&PREMIUM);
            map.zero_at(home);
            prop_assert_eq!(map.angles_to_counts(map.counts_to_angles(counts)), counts);
        }

        #[test]
        fn no_readings_and_no_angles_panic(bits: u32, raw: [i64; 3], more: [i64; 3], angles: [f64; 3]) {
            let mut extender = EncoderExtender::new(bits);
            extender.extend(raw);
            let mut map = JointMap::new(&PREMIUM);
            map.zero_at(extender.extend(more));
            let _ = map.counts_to_angles(raw);
            let _ = map.angles_to_counts(angles);
            let _ = wrapped(raw[0], bits);
        }
    }
}
