//! A grid of heights, smooth between its texels.
//!
//! Model: a biquadratic B-spline over the 3 x 3 texels around a place. A bilinear value is continuous but its slope jumps
//! wherever a texel's middle is passed, and with it any force along the slope; the spline's slope is continuous, too (C1),
//! and piecewise linear. Its value is a weighted mean of the nine: it never exceeds the highest texel, which the height of
//! a raised surface may rely on. What it costs is sharpness: a wave P texels long keeps the share sinc^3(1/P) of its
//! height, 99 % for P = 13, 62 % for P = 2.
//!
//! Places: `[u, v]` in pictures, (0, 0) the lower left corner, (1, 1) the upper right; texels are kept as pictures have
//! them, from the top left. Beyond its borders a picture is repeated, or its border texels go on (their slope is 0).
//!
//! Memory: 4 bytes a texel; single precision tells all of 16 bits. Cost: nine texels.

use super::HeightMapError;
use std::fmt;

/// The most texels along a side: 64 MB of them.
pub const MAX_GRID_SIDE: usize = 4096;

/// What lies beyond the borders of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Border {
    /// The picture again.
    #[default]
    Repeat,
    /// Its border texels, without end.
    Clamp,
}

/// A picture whose values are shares of white.
#[derive(Clone, PartialEq)]
pub struct HeightGrid {
    width: usize,
    height: usize,
    values: Box<[f32]>,
    range: [f64; 2],
}

/// A value and how it changes per picture to the right and up.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Sample {
    pub(super) value: f64,
    pub(super) slopes: [f64; 2],
}

impl HeightGrid {
    /// `values` row by row from the top, from 0 (black) to 1 (white).
    ///
    /// # Errors
    /// No texel or too many, not as many values as texels, a value that is not from 0 to 1.
    pub fn new(width: usize, height: usize, values: Vec<f32>) -> Result<Self, HeightMapError> {
        let sides = 1..=MAX_GRID_SIDE;
        if !sides.contains(&width) || !sides.contains(&height) {
            return Err(HeightMapError::Side { found: [width, height], allowed: MAX_GRID_SIDE });
        }
        if values.len() != width * height {
            return Err(HeightMapError::Count { found: values.len(), texels: width * height });
        }
        if let Some(texel) = values.iter().position(|value| !(0.0..=1.0).contains(value)) {
            return Err(HeightMapError::Value { texel, found: values[texel] });
        }
        let darkest = values.iter().copied().fold(1.0, f32::min);
        let brightest = values.iter().copied().fold(0.0, f32::max);
        Ok(Self { width, height, values: values.into(), range: [darkest, brightest].map(f64::from) })
    }

    /// Texels across and down.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// Row by row from the top.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Its darkest and its brightest value.
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    pub(super) fn at(&self, [u, v]: [f64; 2], border: Border) -> Sample {
        let across = Taps::new(u, self.width, border);
        let down = Taps::new(1.0 - v, self.height, border);
        let mut sample = Sample::default();
        for j in 0..3 {
            let row = &self.values[down.texels[j] * self.width..][..self.width];
            let texels = across.texels.map(|i| f64::from(row[i]));
            let value = dot(&texels, &across.weights);
            sample.value += down.weights[j] * value;
            sample.slopes[0] += down.weights[j] * dot(&texels, &across.slopes);
            sample.slopes[1] -= down.slopes[j] * value;
        }
        sample
    }
}

/// The three texels around a place along one side.
struct Taps {
    texels: [usize; 3],
    weights: [f64; 3],
    /// Of the weights, per picture.
    slopes: [f64; 3],
}

impl Taps {
    fn new(place: f64, texels: usize, border: Border) -> Self {
        let side = texels as f64;
        let place = match border {
            // What is too large for its fraction to be known, or no number, is the beginning.
            Border::Repeat => {
                Some(place - place.floor()).filter(|place| (0.0..1.0).contains(place)).unwrap_or(0.0)
            }
            // Two texels outside are as good as any more.
            Border::Clamp => place.clamp(-2.0 / side, 1.0 + 2.0 / side),
        };
        let at = place * side - 0.5;
        let nearest = (at + 0.5).floor();
        let t = at - nearest;
        let nearest = nearest as isize;
        let weights = [0.5 * (0.5 - t) * (0.5 - t), 0.75 - t * t, 0.5 * (0.5 + t) * (0.5 + t)];
        let slopes = [t - 0.5, -2.0 * t, t + 0.5].map(|slope| slope * side);
        let texels = [-1, 0, 1].map(|offset| within(nearest + offset, texels, border));
        Self { texels, weights, slopes }
    }
}

/// Places are at most three texels outside.
fn within(texel: isize, texels: usize, border: Border) -> usize {
    let texels = texels as isize;
    if (0..texels).contains(&texel) {
        return texel as usize;
    }
    match border {
        Border::Clamp => texel.clamp(0, texels - 1) as usize,
        Border::Repeat => texel.rem_euclid(texels) as usize,
    }
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Its size alone.
impl fmt::Debug for HeightGrid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "HeightGrid {{ {} x {} texels }}", self.width, self.height)
    }
}
