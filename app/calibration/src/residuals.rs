//! What a transform leaves between the pairs.

use nalgebra::Vector3;

use crate::pairs::Pair;
use crate::transform::Transform;

/// Distances between where both devices say the point is.
#[derive(Debug, Clone, PartialEq)]
pub struct Residuals {
    /// Root of the mean square distance (m).
    pub rms_m: f64,
    /// The largest distance (m).
    pub max_m: f64,
    /// Line of the pair with the largest distance.
    pub max_line: usize,
    /// Root of the mean square along F's x, y, z (m).
    pub axis_rms_m: [f64; 3],
    /// Distance of each pair (m), in their order.
    pub each_m: Vec<f64>,
}

impl Residuals {
    /// Of these pairs under this transform.
    pub(crate) fn of(pairs: &[Pair], transform: &Transform) -> Self {
        let count = pairs.len().max(1) as f64;
        let gaps: Vec<Vector3<f64>> = pairs.iter().map(|pair| gap(pair, transform)).collect();
        let squares: Vector3<f64> = gaps.iter().map(|gap| gap.component_mul(gap)).sum();
        let each_m: Vec<f64> = gaps.iter().map(Vector3::norm).collect();
        let farthest = each_m.iter().zip(pairs).max_by(|a, b| a.0.total_cmp(b.0));
        let (max_m, max_line) = farthest.map_or((0.0, 0), |(distance, pair)| (*distance, pair.line));
        Self {
            rms_m: (squares.sum() / count).sqrt(),
            max_m,
            max_line,
            axis_rms_m: squares.map(|square| (square / count).sqrt()).into(),
            each_m,
        }
    }
}

/// From where the other device says the point is to where the fiducial does, in F (m).
pub(crate) fn gap(pair: &Pair, transform: &Transform) -> Vector3<f64> {
    pair.fiducial - transform.apply(&pair.other)
}
