//! Pairs that do not belong: the end points had come apart.
//!
//! Model: least trimmed squares by concentration. A fit to all pairs is refitted to the three quarters that it
//! leaves nearest, until these stay the same; from the median of all distances a robust noise follows
//! (a Gaussian gap in three dimensions has the median 1.538 sigma), and what lies further out than five of it is an
//! outlier. Once in 65,000 good pairs is that too. Then the fit is made from all others, until these stay the same.
//! Limits: more than a quarter of bad pairs may hide each other.

use crate::fit::{Model, raw_fit};
use crate::pairs::Pair;
use crate::residuals::gap;
use crate::transform::Transform;

/// A pair that does not belong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outlier {
    /// Its line.
    pub line: usize,
    /// Its distance from the fit to the others (m).
    pub distance_m: f64,
}

/// The pairs that do not belong, and what made them so.
#[derive(Debug, Clone, PartialEq)]
pub struct Outliers {
    /// Noise of a pair per coordinate (m), hardly moved by outliers.
    pub robust_noise_m: f64,
    /// Distance from the fit to the others beyond which a pair counts (m).
    pub threshold_m: f64,
    /// They, in the order of their lines.
    pub listed: Vec<Outlier>,
}

/// What the search found.
pub(crate) struct Sorted {
    pub(crate) outliers: Outliers,
    /// All other pairs.
    pub(crate) kept: Vec<Pair>,
}

/// Sorts the pairs; with too few to tell, all are kept.
pub(crate) fn sort(pairs: &[Pair], model: Model) -> Sorted {
    let Some(mut transform) = concentrate(pairs, model) else { return all_kept(pairs) };
    let mut sorted = by_threshold(pairs, &transform, model);
    for _ in 0..MAX_ROUNDS {
        let Some(refined) = raw_fit(&sorted.kept, model) else { break };
        transform = refined;
        let next = by_threshold(pairs, &transform, model);
        let is_settled = next.kept.len() == sorted.kept.len()
            && next.kept.iter().zip(&sorted.kept).all(|(a, b)| a.line == b.line);
        sorted = next;
        if is_settled {
            break;
        }
    }
    if sorted.kept.len() < pairs.len() / 2 { all_kept(pairs) } else { sorted }
}

/// The fit to the three quarters that it leaves nearest; `None` if there are too few to leave one out.
fn concentrate(pairs: &[Pair], model: Model) -> Option<Transform> {
    if pairs.len() < fewest_to_search(model) {
        return None;
    }
    let held = held_of(pairs.len());
    let mut transform = raw_fit(pairs, model)?;
    let mut former: Vec<usize> = Vec::new();
    for _ in 0..MAX_ROUNDS {
        let mut order: Vec<usize> = (0..pairs.len()).collect();
        let distance = |index: &usize| gap(&pairs[*index], &transform).norm_squared();
        order.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        order.truncate(held);
        order.sort_unstable();
        if order == former {
            break;
        }
        let nearest: Vec<Pair> = order.iter().map(|index| pairs[*index]).collect();
        transform = raw_fit(&nearest, model)?;
        former = order;
    }
    Some(transform)
}

/// The pairs that are held, of so many.
fn held_of(count: usize) -> usize {
    count * 3 / 4
}

/// Fewer pairs than this hold too few when a quarter is left out: twice as many as determine a fit are wanted.
pub(crate) fn fewest_to_search(model: Model) -> usize {
    let wanted = 2 * model.least_pairs();
    // `held_of` rounds down: the least count with `3 count / 4 >= wanted`.
    (4 * wanted).div_ceil(3)
}

fn by_threshold(pairs: &[Pair], transform: &Transform, model: Model) -> Sorted {
    let distances: Vec<f64> = pairs.iter().map(|pair| gap(pair, transform).norm()).collect();
    let robust_noise_m = median(&distances) / MEDIAN_OF_SIGMA * small_sample(pairs.len(), model);
    let threshold_m = (OUTLIER_SIGMAS * robust_noise_m).max(ROUNDING * reach(pairs));
    let both = pairs.iter().zip(&distances);
    let listed = both.clone().filter(|(_, distance)| **distance > threshold_m);
    let listed = listed.map(|(pair, distance)| Outlier { line: pair.line, distance_m: *distance }).collect();
    let kept = both.filter(|(_, distance)| **distance <= threshold_m).map(|(pair, _)| *pair).collect();
    Sorted { outliers: Outliers { robust_noise_m, threshold_m, listed }, kept }
}

fn all_kept(pairs: &[Pair]) -> Sorted {
    let outliers = Outliers { robust_noise_m: 0.0, threshold_m: f64::INFINITY, listed: Vec::new() };
    Sorted { outliers, kept: pairs.to_vec() }
}

/// A fit to few pairs lies nearer to them than the truth does.
fn small_sample(count: usize, model: Model) -> f64 {
    let measured = (3 * count) as f64;
    (measured / (measured - model.parameters() as f64).max(1.0)).sqrt()
}

/// Largest coordinate of the pairs (m).
fn reach(pairs: &[Pair]) -> f64 {
    pairs.iter().map(|pair| pair.fiducial.amax().max(pair.other.amax())).fold(0.0, f64::max)
}

fn median(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    let middle = values.len() / 2;
    if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

/// Median of the length of a vector of three independent Gaussian numbers: the chi distribution's.
const MEDIAN_OF_SIGMA: f64 = 1.538_172;
const OUTLIER_SIGMAS: f64 = 5.0;
/// Pairs without any noise differ by rounding, of which nobody is guilty: some ten units in the last place of the
/// largest coordinate, with room for files of nine digits.
const ROUNDING: f64 = 1e-9;
/// Each round fits better or is the last; few take more than five.
const MAX_ROUNDS: usize = 50;
