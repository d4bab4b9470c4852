//! Why a picture of heights cannot be felt on a shape.

use std::fmt;

/// What is wrong with a height map.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum HeightMapError {
    /// No texels, or more along a side than there may be.
    Side {
        /// Texels across and down.
        found: [usize; 2],
        /// The most along either; the least is 1.
        allowed: usize,
    },
    /// Not as many values as texels.
    Count {
        /// How many values there are.
        found: usize,
        /// How many texels.
        texels: usize,
    },
    /// A value that is no share of white.
    Value {
        /// Which texel, row by row from the top, from 0.
        texel: usize,
        /// Its value.
        found: f32,
    },
    /// A number out of its range.
    OutOfRange {
        /// Name of the parameter, with its unit.
        parameter: &'static str,
        /// What was found.
        found: f64,
        /// What is allowed, in words.
        allowed: &'static str,
    },
    /// The shape has no coordinates along its surface.
    NoCoordinates,
    /// The shape has no ends between which a picture could be repeated.
    Endless,
    /// A picture repeated a broken number of times around would have a step at the seam.
    Seam {
        /// How often it is to be repeated.
        found: f64,
    },
    /// Texture coordinates are no metres.
    NoMetres,
}

impl fmt::Display for HeightMapError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Side { found: [width, height], allowed } => {
                write!(
                    f,
                    "a picture of {width} x {height} texels; allowed are 1 to {allowed} along each side"
                )
            }
            Self::Count { found, texels } => {
                write!(f, "{found} heights for {texels} texels; allowed is one for each")
            }
            Self::Value { texel, found } => {
                write!(f, "texel {texel} is {found}; allowed are numbers from 0 (black) to 1 (white)")
            }
            Self::OutOfRange { parameter, found, allowed } => {
                write!(f, "{parameter} is {found}; allowed is {allowed}")
            }
            Self::NoCoordinates => write!(
                f,
                "this shape has no coordinates on its surface for a picture to lie on; allowed are closed forms but \
                 trees of shapes, and meshes with texture coordinates"
            ),
            Self::Endless => write!(
                f,
                "a plane has no ends between which a picture could be repeated; allowed is size_m, the size of one picture"
            ),
            Self::Seam { found } => write!(
                f,
                "a picture repeated {found} times around leaves a step where its ends meet; allowed are whole numbers"
            ),
            Self::NoMetres => write!(
                f,
                "texture coordinates count pictures, not metres; allowed on meshes is repeat, not size_m"
            ),
        }
    }
}

impl std::error::Error for HeightMapError {}
