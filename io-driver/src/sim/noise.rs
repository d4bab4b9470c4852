//! Seeded noise that is the same on every machine.
//!
//! Model: uniform numbers of the crate `fastrand`; normal ones as sums of twelve of them, which needs no logarithm
//! of a mathematical library and is bounded by six standard deviations.
//! Cost: twelve multiplications for a normal number; no allocation.

/// A stream of random numbers.
#[derive(Debug, Clone)]
pub struct Noise(fastrand::Rng);

impl Noise {
    /// The stream of a seed.
    pub fn new(seed: u64) -> Self {
        Self(fastrand::Rng::with_seed(seed))
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.0.f64()
    }

    /// Mean 0, standard deviation 1, never beyond 6.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_moments_of_their_distribution() {
        let mut noise = Noise::new(3);
        let n = 100_000;
        let normal: Vec<f64> = (0..n).map(|_| noise.normal()).collect();
        let mean = normal.iter().sum::<f64>() / f64::from(n);
        let variance = normal.iter().map(|x| x * x).sum::<f64>() / f64::from(n);
        // Five standard errors: 5 / sqrt(n), and that of a variance, sqrt(2 / n).
        assert!(mean.abs() < 0.016 && (variance - 1.0).abs() < 0.023, "{mean} {variance}");
    }

    #[test]
    fn a_seed_gives_its_own_stream_every_time() {
        let stream = |seed| {
            let mut noise = Noise::new(seed);
            std::array::from_fn::<f64, 8, _>(|_| noise.uniform())
        };
        assert_eq!(stream(1), stream(1));
        assert_ne!(stream(1), stream(2));
        assert!(stream(0).iter().all(|u| (0.0..1.0).contains(u)));
    }
}
