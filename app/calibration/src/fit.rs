//! From pairs to a transform and everything one has to know before trusting it.

use crate::accuracy::Accuracy;
use crate::error::CalibrationError;
use crate::outliers::{self, Outliers};
use crate::pairs::{self, Pair};
use crate::residuals::Residuals;
use crate::spread::Spread;
use crate::transform::Transform;
use crate::{affine, rigid};

/// Which transforms are allowed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Model {
    /// A rotation and a translation.
    Rigid,
    /// Any linear map and a translation, as in the thesis.
    Affine,
}

impl Model {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rigid => "rigid",
            Self::Affine => "affine",
        }
    }

    /// The fewest pairs that determine one.
    pub fn least_pairs(self) -> usize {
        match self {
            Self::Rigid => 3,
            Self::Affine => 4,
        }
    }

    /// From so many pairs on, one that does not belong can be found and the noise is known to a fifth; a fit to fewer
    /// is worth a warning.
    pub fn enough_pairs(self) -> usize {
        outliers::fewest_to_search(self)
    }

    /// Numbers that the fit chooses.
    pub(crate) fn parameters(self) -> usize {
        match self {
            Self::Rigid => 6,
            Self::Affine => 12,
        }
    }
}

/// A transform, how well it fits and how well it is known.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// How many pairs it was made from.
    pub count: usize,
    /// The transform, from the other device's base N to the fiducial's F.
    pub transform: Transform,
    /// What it leaves.
    pub residuals: Residuals,
    /// Extent of the points in the other device's base N.
    pub spread_other: Spread,
    /// Standard errors; `None` if every pair was needed for the fit.
    pub accuracy: Option<Accuracy>,
    /// By how much the fiducial's points lie further apart than the other's (1): far from 1, one of the two has
    /// wrong link lengths or units.
    pub scale: f64,
}

/// All that pairs say.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// What was asked for.
    pub model: Model,
    /// The fit to all pairs.
    pub all: Fit,
    /// Why the fit to all pairs is worth nothing, if outliers spoil it so much.
    pub all_refused: Option<CalibrationError>,
    /// Pairs that do not belong.
    pub outliers: Outliers,
    /// The fit to the others, if there are outliers.
    pub without_outliers: Option<Fit>,
}

/// Fits the pairs.
///
/// # Errors
/// Too few, not finite, probably not in metres, hardly moved, on a line, in a plane, mirrored. What only outliers make
/// so is told by [`Calibration::all_refused`].
pub fn calibrate(pairs: &[Pair], model: Model) -> Result<Calibration, CalibrationError> {
    let needed = model.least_pairs();
    if pairs.len() < needed {
        return Err(CalibrationError::TooFew { found: pairs.len(), needed, model: model.name() });
    }
    pairs::check(pairs)?;
    let sorted = outliers::sort(pairs, model);
    // Outliers may neither hide that the others lie on a line nor make good points look so.
    refuse_mirrored(&sorted.kept, model)?;
    let honest = Fit::of(&sorted.kept, model)?;
    honest.check(model)?;
    let has_outliers = sorted.kept.len() < pairs.len();
    let all = if has_outliers { Fit::of(pairs, model)? } else { honest.clone() };
    Ok(Calibration {
        model,
        all_refused: all.check(model).err(),
        all,
        outliers: sorted.outliers,
        without_outliers: has_outliers.then_some(honest),
    })
}

impl Fit {
    fn of(pairs: &[Pair], model: Model) -> Result<Self, CalibrationError> {
        let others: Vec<_> = pairs.iter().map(|pair| pair.other).collect();
        let spread_other = Spread::of(&others);
        refuse_degenerate(model, &spread_other, 0.0)?;
        let rigid = rigid::fit(pairs);
        // Only a plane to the last digit has no affine fit, and that has just been refused.
        let transform = raw_fit(pairs, model).unwrap_or(rigid);
        let residuals = Residuals::of(pairs, &transform);
        let square_sum = residuals.rms_m * residuals.rms_m * pairs.len() as f64;
        let accuracy = Accuracy::of(model, &transform, &spread_other, square_sum, pairs.len());
        let scale = rigid::scale(pairs, &rigid.matrix);
        Ok(Self { count: pairs.len(), transform, residuals, spread_other, accuracy, scale })
    }

    /// Refuses points that reach no further than their noise.
    fn check(&self, model: Model) -> Result<(), CalibrationError> {
        let noise_m = self.accuracy.map_or(0.0, |accuracy| accuracy.noise_m);
        refuse_degenerate(model, &self.spread_other, noise_m)
    }
}

/// The best transform, whatever it is worth; `None` if there is none.
pub(crate) fn raw_fit(pairs: &[Pair], model: Model) -> Option<Transform> {
    match model {
        Model::Rigid => Some(rigid::fit(pairs)),
        Model::Affine => affine::fit(pairs),
    }
}

/// An extent that the noise or the digits of the file could have made is none.
fn refuse_degenerate(model: Model, spread: &Spread, noise_m: f64) -> Result<(), CalibrationError> {
    let [along_m, second_m, third_m] = spread.rms_m;
    if along_m < NOISES_APART * noise_m {
        return Err(CalibrationError::Unrelated { along_m, noise_m });
    }
    let least_m = (SMALLEST_RATIO * along_m).max(NOISES_APART * noise_m);
    match model {
        _ if second_m < least_m => Err(CalibrationError::Collinear { along_m, across_m: second_m, noise_m }),
        Model::Affine if third_m < least_m => {
            Err(CalibrationError::Coplanar { along_m, across_m: third_m, noise_m })
        }
        _ => Ok(()),
    }
}

/// A left-handed device is fitted several times better by a reflection; points in a plane are fitted equally well by
/// both. Wrong scales, which an affine fit allows, spoil both alike.
fn refuse_mirrored(pairs: &[Pair], model: Model) -> Result<(), CalibrationError> {
    let is_turned_over = |transform: Transform| transform.matrix.determinant() < 0.0;
    if model == Model::Affine && !raw_fit(pairs, model).is_some_and(is_turned_over) {
        return Ok(());
    }
    let rms_m = Residuals::of(pairs, &rigid::fit(pairs)).rms_m;
    let mirrored_rms_m = Residuals::of(pairs, &rigid::fit_mirrored(pairs)).rms_m;
    let others: Vec<_> = pairs.iter().map(|pair| pair.other).collect();
    // Below that both are rounding.
    let is_visible = rms_m > SMALLEST_RATIO * Spread::of(&others).rms_m[0];
    if is_visible && mirrored_rms_m < rms_m / 3.0 {
        return Err(CalibrationError::Mirrored { rms_m, mirrored_rms_m });
    }
    Ok(())
}

/// 0.1 mm in 100 mm is the accuracy of the thesis' tool for holding end points together.
const SMALLEST_RATIO: f64 = 1e-3;
/// Noise adds in quadrature: five times as much is off by 2 %.
const NOISES_APART: f64 = 5.0;
