//! The bristle model: bonds that stretch, snap and form anew at random places.
//!
//! Model (D. A. Haessig and B. Friedland 1991): N bonds are formed where the surfaces touch. Each
//! stretches as the surfaces move; stretched beyond `delta_s` it snaps and a new one forms at a random
//! distance, here uniform, between the old place and where the surface has got to. The friction force
//! is the sum of the bonds' forces. Here each bond has the stiffness `k / N`, so that the force is the
//! contact's spring stretched by their mean, and the god-object lies where that mean says.
//!
//! In steady sliding a bond's stretch y rises from a random y_0 < delta_s to delta_s. It is found below
//! y as often as it began below y, so its density is `2 y / delta_s^2`: mean `2/3 delta_s`, variance
//! `delta_s^2 / 18`. Hence `delta_s = 3/2 mu * load` gives the mean friction force `mu N`, with a
//! standard deviation of `mu N / sqrt(8 N_bonds)`: one bond is a rasp, twenty are a fine file. Bonds
//! formed together snap together: the first breakaway takes up to `3/2 mu N`.
//!
//! Bonds are numbers along the line from god-object to surface point. When that line turns, the bonds'
//! deviations from their mean turn with it: mirrored at a reversal, projected in between.
//!
//! The random numbers depend on the seed, on how many were drawn, and on how far the bonds were stretched when
//! the first of this contact snapped: two fingers do not rasp in step, and every run is the same. That stretch is
//! taken against the load and to 24 bits, so that size, place and direction make no difference.
//!
//! Invariants: `|F_t| <= 3/2 mu N`; while no bond snaps it holds. Cost: linear in the bonds.

use super::sliding::within;
use crate::error::{ParameterError, at_least_zero};
use crate::friction_law::{FrictionLaw, FrictionMemory, FrictionQuery, MEMORY_WORDS};

/// The bristle model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bristles {
    mu: f64,
    bonds: usize,
    seed: u64,
}

/// The most bonds of a contact.
pub const MAX_BRISTLES: usize = 20;

/// Words of the memory: first the bonds' stretches (m), then these.
const MEAN: usize = MAX_BRISTLES;
const DRAWN: usize = MAX_BRISTLES + 1;
/// A number of the contact's own, from the first draw on.
const OWN: usize = MAX_BRISTLES + 2;
const _: () = assert!(MEAN < DRAWN && DRAWN < OWN && OWN < MEMORY_WORDS);

/// `delta_s` over the mean stretch of steady sliding.
const SNAP_OVER_MEAN: f64 = 1.5;

impl Bristles {
    /// Mean friction coefficient, number of bonds, seed of the random numbers.
    ///
    /// Errors: `mu` not finite or negative, `bonds` not in 1 to 20.
    pub fn new(mu: f64, bonds: usize, seed: u64) -> Result<Self, ParameterError> {
        at_least_zero("mu", mu)?;
        if !(1..=MAX_BRISTLES).contains(&bonds) {
            let (parameter, allowed) = ("bonds", "a whole number from 1 to 20");
            return Err(ParameterError::OutOfRange { parameter, value: bonds as f64, allowed });
        }
        Ok(Self { mu, bonds, seed })
    }

    /// Uniform in 0 to 1, 1 excluded.
    fn draw(&self, own: f64, drawn: &mut f64) -> f64 {
        *drawn += 1.0;
        let mixed = mix(self.seed ^ mix(own as u64 ^ mix(*drawn as u64)));
        (mixed >> 11) as f64 / (1u64 << 53) as f64
    }
}

impl FrictionLaw for Bristles {
    fn holds(&self, query: &FrictionQuery, memory: &mut FrictionMemory) -> bool {
        let snap_m = self.held_limit_m(query, memory);
        if snap_m.is_nan() || snap_m <= 0.0 {
            *memory = FrictionMemory::default();
            return false;
        }
        let turn = cosine_of_turn(memory.words[MEAN], query);
        let mean_before_m = memory.words[MEAN];
        let (mut own, mut drawn) = (memory.words[OWN], memory.words[DRAWN]);
        let (mut sum_m, mut holds) = (0.0, true);
        for stretch_m in &mut memory.words[..self.bonds] {
            *stretch_m = query.gap_m + (*stretch_m - mean_before_m) * turn;
            if stretch_m.abs() > snap_m || stretch_m.is_nan() {
                if own == 0.0 {
                    own = own_number(query);
                }
                *stretch_m = (self.draw(own, &mut drawn) * snap_m).copysign(*stretch_m);
                holds = false;
            }
            sum_m += *stretch_m;
        }
        // Bonds that were bent forwards can leave more force than there was; it comes to rest then.
        let mean_m = (sum_m / self.bonds as f64).min(query.gap_m);
        let excess_m = sum_m / self.bonds as f64 - mean_m;
        memory.words[..self.bonds].iter_mut().for_each(|stretch_m| *stretch_m -= excess_m);
        memory.words[MEAN] = mean_m;
        (memory.words[OWN], memory.words[DRAWN]) = (own, drawn);
        holds
    }

    fn slide(&self, query: &FrictionQuery, memory: &FrictionMemory) -> f64 {
        within(self.held_limit_m(query, memory), query.gap_m - memory.words[MEAN], query)
    }

    fn held_limit_m(&self, query: &FrictionQuery, _memory: &FrictionMemory) -> f64 {
        SNAP_OVER_MEAN * self.mu * query.load_m
    }
}

/// Between the lag before and the lag now, from the triangle of both and the path of the HIP.
fn cosine_of_turn(before_m: f64, query: &FrictionQuery) -> f64 {
    let (now_m, path_m) = (query.gap_m, query.hip_travel_m);
    let twice = 2.0 * before_m * now_m;
    let cosine = (before_m * before_m + now_m * now_m - path_m * path_m) / twice;
    // Without a direction before or now there is no turn.
    if cosine.is_nan() || twice <= 0.0 { 1.0 } else { cosine.clamp(-1.0, 1.0) }
}

/// What tells a contact from others: a whole number from 1 on that a word of the memory holds exactly.
///
/// Of what the contact sees, as ratios, in single precision: the same from wherever one looks at it.
fn own_number(query: &FrictionQuery) -> f64 {
    let bits = |length_m: f64| u64::from(((length_m / query.load_m) as f32).to_bits());
    let mixed = mix(bits(query.gap_m) << 32 | bits(query.hip_travel_m));
    (mixed >> 12 | 1) as f64
}

/// SplitMix64 (G. Steele, D. Lea, C. Flood 2014) of a counter.
fn mix(x: u64) -> u64 {
    let z = x.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    const LOAD_M: f64 = 4e-3;
    /// A bond of `mu` 0.5 snaps beyond it.
    const SNAP_M: f64 = 3e-3;

    fn query(gap_m: f64, hip_travel_m: f64) -> FrictionQuery {
        FrictionQuery { gap_m, hip_travel_m, load_m: LOAD_M, stiffness_n_per_m: 500.0, ..Default::default() }
    }

    /// Of two bonds.
    fn memory(stretches_m: [f64; 2]) -> FrictionMemory {
        let mut memory = FrictionMemory::default();
        memory.words[..2].copy_from_slice(&stretches_m);
        memory.words[MEAN] = 0.5 * (stretches_m[0] + stretches_m[1]);
        memory
    }

    #[test]
    fn a_lag_turns_by_the_triangle_of_both_lags_and_the_path() {
        let turn = |before_m, gap_m, hip_travel_m| {
            cosine_of_turn(before_m, &FrictionQuery { gap_m, hip_travel_m, ..Default::default() })
        };
        // Equilateral; straight on, and back.
        assert!((turn(1.0, 1.0, 1.0) - 0.5).abs() < 1e-15);
        assert_eq!(turn(3.0, 4.0, 1.0), 1.0);
        assert_eq!(turn(1.0, 2.0, 3.0), -1.0);
        // Rounding makes sides that no triangle has.
        assert_eq!(turn(1.0, 2.0, 3.1), -1.0);
        // What is bent backwards, or not at all, has no direction of its own.
        assert_eq!([turn(-1.0, 1.0, 1.0), turn(0.0, 1.0, 1.0), turn(1.0, 0.0, 1.0)], [1.0; 3]);
        assert_eq!(turn(1e200, 1e200, 1e200), 1.0, "no numbers");
    }

    #[test]
    fn a_contacts_own_number_is_the_same_at_any_scale() {
        let number = |scale: f64| {
            let [gap_m, load_m, hip_travel_m] = [1e-4, 3e-3, 2e-5].map(|length_m| length_m * scale);
            own_number(&FrictionQuery { gap_m, load_m, hip_travel_m, ..Default::default() })
        };
        // Powers of two change no bit of a quotient.
        assert_eq!([number(2.0), number(0.125)], [number(1.0); 2]);
        assert!(number(1.0) >= 1.0 && number(1.0).fract() == 0.0);
    }

    #[test]
    fn a_contacts_own_number_is_odd_exact_and_another_one_for_each_gap_load_and_path() {
        let asked = FrictionQuery { gap_m: 1e-4, load_m: 3e-3, hip_travel_m: 2e-5, ..Default::default() };
        let numbers: BTreeSet<u64> = (0..100)
            .flat_map(|i| {
                // A single-precision number tells a millionth from the next one.
                let more = 1.0 + 1e-6 * f64::from(i);
                let by = |length_m: f64| length_m * more;
                [
                    FrictionQuery { gap_m: by(asked.gap_m), ..asked },
                    FrictionQuery { load_m: by(asked.load_m), ..asked },
                    FrictionQuery { hip_travel_m: by(asked.hip_travel_m), ..asked },
                ]
            })
            .map(|query| {
                let number = own_number(&query);
                assert!(number < (1u64 << 52) as f64 && number as u64 % 2 == 1, "{number}");
                number as u64
            })
            .collect();
        // Three times one hundred, which begin with the same; that two of 2^51 are equal has a chance of 2e-11.
        assert_eq!(numbers.len(), 298);
    }

    #[test]
    fn counters_are_mixed_as_splitmix64_publishes_it() {
        const STEP: u64 = 0x9E37_79B9_7F4A_7C15;
        let first = [0, 1, 2].map(|i: u64| mix(STEP.wrapping_mul(i)));
        // The first numbers of the seed 0, as the reference implementation in C prints them.
        assert_eq!(first, [0xE220_A839_7B1D_CDAF, 0x6E78_9E6A_A1B9_65F4, 0x06C4_5D18_8009_454F]);
    }

    #[test]
    fn deviations_from_the_mean_turn_with_the_line_to_the_surface_point() {
        let bonds = Bristles::new(0.5, 2, 1).expect("in range");
        // From a lag of 1.5 mm to one of 1.6 mm, turned: by the law of cosines on paths from straight on to straight back.
        for (degrees, way_m) in [(0.0, 1e-4), (60.0, 2.41e-6_f64.sqrt()), (180.0, 3.1e-3)] {
            let mut memory = memory([2e-3, 1e-3]);
            assert!(bonds.holds(&query(1.6e-3, way_m), &mut memory), "{degrees} degrees");
            let turn = f64::to_radians(degrees).cos();
            let expected = [1.6e-3 + 0.5e-3 * turn, 1.6e-3 - 0.5e-3 * turn, 0.0];
            for (found, expected) in memory.words.iter().zip(expected) {
                // Some roundings of 2 mm.
                assert!((found - expected).abs() < 2e-18, "{degrees} degrees: {found}, {expected}");
            }
            assert!((memory.words[MEAN] - 1.6e-3).abs() < 1e-18);
        }
    }

    #[test]
    fn a_bond_holds_up_to_its_limit_and_snaps_to_somewhere_between_beyond_it() {
        let bonds = Bristles::new(0.5, 1, 1).expect("in range");
        let mut memory = FrictionMemory::default();
        let limit_m = bonds.held_limit_m(&query(0.0, 0.0), &memory);
        assert!((limit_m - SNAP_M).abs() < 1e-18);
        assert!(bonds.holds(&query(limit_m, 1e-3), &mut memory));
        assert!(!bonds.holds(&query(limit_m + 1e-9, 1e-9), &mut memory));
        assert!((0.0..limit_m).contains(&memory.words[MEAN]), "{}", memory.words[MEAN]);
    }

    #[test]
    fn without_load_or_friction_bonds_are_forgotten_and_nothing_holds() {
        for (mu, load_m) in [(0.5, 0.0), (0.5, -1e-3), (0.5, f64::NAN), (0.0, LOAD_M)] {
            let bonds = Bristles::new(mu, 2, 1).expect("in range");
            let mut memory = memory([2e-3, 1e-3]);
            assert!(
                !bonds.holds(&FrictionQuery { load_m, ..query(0.0, 0.0) }, &mut memory),
                "{mu}, {load_m}"
            );
            assert_eq!(memory, FrictionMemory::default());
        }
    }

    #[test]
    fn numbers_are_uniform_whatever_the_seed_and_the_contact_are() {
        for seed in [0, 1, 0x5555_5555_5555_5555, u64::MAX] {
            for own in [1.0, 1.0 + (1u64 << 51) as f64] {
                let bonds = Bristles::new(0.5, 1, seed).expect("in range");
                let mut drawn = 0.0;
                let numbers: Vec<f64> = (0..10_000).map(|_| bonds.draw(own, &mut drawn)).collect();
                let mean = numbers.iter().sum::<f64>() / 1e4;
                let square = numbers.iter().map(|number| number * number).sum::<f64>() / 1e4;
                // Standard deviations of the means of 10,000: 0.0029 and 0.0030; five of each.
                assert!(
                    (mean - 0.5).abs() < 0.015 && (square - 1.0 / 3.0).abs() < 0.015,
                    "{seed}: {mean}, {square}"
                );
                assert!(numbers.iter().all(|number| (0.0..1.0).contains(number)) && drawn == 1e4);
            }
        }
    }
}
