//! Random numbers that can be had again: a test prints its seed, and takes another from the environment.
//!
//! Reference: G. Steele, D. Lea, C. Flood, *Fast splittable pseudorandom number generators*, OOPSLA 2014.

use std::time::Duration;

/// Names the seed of a test that failed, for running it again.
const SEED_VARIABLE: &str = "PHANTOM3_TEST_SEED";

/// SplitMix64: the whole state is one word.
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// Begins at the environment's seed, or else at this one; says which, for the report of a failure.
    pub fn seeded(usual: u64) -> Self {
        let given = std::env::var(SEED_VARIABLE).ok();
        let seed = given.map_or(usual, |text| text.parse().expect("a seed is a whole number"));
        eprintln!("seed {seed}; {SEED_VARIABLE} sets another");
        Self(seed)
    }

    /// Begins at this seed, whatever the environment says.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Any word.
    pub fn word(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    /// A number below `bound`, which is small, so that the bias of the remainder does not matter.
    pub fn below(&mut self, bound: u64) -> u64 {
        self.word() % bound
    }

    /// True once in `n` times.
    pub fn once_in(&mut self, n: u64) -> bool {
        self.below(n) == 0
    }

    /// Evenly from -1 to 1.
    pub fn unit(&mut self) -> f64 {
        // 53 bits fit an f64 exactly.
        (self.word() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// Less than `longest`.
    pub fn duration(&mut self, longest: Duration) -> Duration {
        Duration::from_nanos(self.below(u64::try_from(longest.as_nanos()).expect("a short time")))
    }
}
