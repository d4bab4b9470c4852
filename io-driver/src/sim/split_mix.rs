//! Random numbers of the simulation: the same for the same seed, on every machine, for ever.
//!
//! Problem: a recording made with a seed has to come out again in years; the generators of the usual crates may
//! change with their versions, and their distributions do.
//! Model: SplitMix64 (Steele, Lea, Flood 2014), a counter through a mixing function: ten lines, 64 bits of state,
//! passes the usual batteries, more than enough for tremor and sensor noise. Never for secrets.
//! Cost: some 1 ns; no allocation.

/// The generator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SplitMix64 {
    state: u64,
}

impl SplitMix64 {
    /// Any seed is good, neighbours too.
    pub fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// The next 64 bits.
    pub fn next_u64(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.state ^ (self.state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// From 0 up to, not including, 1.
    pub fn unit(&mut self) -> f64 {
        // 53 bits are what an f64 holds exactly.
        (self.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// From -1 up to, not including, 1.
    pub fn signed_unit(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    /// Mean 0, standard deviation 1, never beyond 6: a sum of twelve, which needs no library's logarithm.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_are_those_of_the_reference_implementation() {
        let mut random = SplitMix64::new(1_234_567);
        let first: [u64; 5] = std::array::from_fn(|_| random.next_u64());
        assert_eq!(
            first,
            [
                6_457_827_717_110_365_317,
                3_203_168_211_198_807_973,
                9_817_491_932_198_370_423,
                4_593_380_528_125_082_431,
                16_408_922_859_458_223_821,
            ]
        );
    }

    #[test]
    fn units_are_spread_evenly() {
        let mut random = SplitMix64::new(7);
        let count = 100_000;
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..count {
            let unit = random.unit();
            assert!((0.0..1.0).contains(&unit));
            sum += unit;
            squares += unit * unit;
        }
        let (mean, square) = (sum / f64::from(count), squares / f64::from(count));
        // Standard deviation of the mean is 0.289 / sqrt(count) = 9e-4, of the squares' 0.298 / sqrt(count); five of them.
        assert!((mean - 0.5).abs() < 5e-3 && (square - 1.0 / 3.0).abs() < 5e-3, "{mean} {square}");
    }

    #[test]
    fn normal_numbers_have_the_moments_of_their_distribution() {
        let mut random = SplitMix64::new(3);
        let n = 100_000;
        let normal: Vec<f64> = (0..n).map(|_| random.normal()).collect();
        let mean = normal.iter().sum::<f64>() / f64::from(n);
        let variance = normal.iter().map(|x| x * x).sum::<f64>() / f64::from(n);
        // Five standard errors: 5 / sqrt(n), and that of a variance, sqrt(2 / n).
        assert!(mean.abs() < 0.016 && (variance - 1.0).abs() < 0.023, "{mean} {variance}");
    }
}
