//! Why there is no calibration.

use thiserror::Error;

use crate::pairs::{MAX_EXTENT_M, MIN_EXTENT_M};
use crate::unit::{Unit, ask_unit};

/// Why a text holds no pairs.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum PairsError {
    /// A row is longer or shorter than six.
    #[error(
        "line {line}: found {found} cells; allowed: 6, x y z of the fiducial, then x y z of the other device, in metres{}",
        if *has_decimal_commas { "; a decimal number has a point, as in 0.1" } else { "" }
    )]
    RowLength {
        /// Whether it would be six numbers with a point for each comma.
        has_decimal_commas: bool,
        /// The line, from 1.
        line: usize,
        /// Cells in it.
        found: usize,
    },
    /// A cell is no finite number.
    #[error("line {line}, {column}: found `{found}`; allowed: a finite number of metres")]
    BadCell {
        /// The line, from 1.
        line: usize,
        /// The column's meaning.
        column: &'static str,
        /// The cell.
        found: String,
    },
    /// The file is something else.
    #[error(
        "line {line}: more than {limit} pairs; take every tenth line or so, neighbours tell little that is new"
    )]
    TooMany {
        /// The first line too many.
        line: usize,
        /// How many there may be.
        limit: usize,
    },
}

/// Why pairs do not give a transform.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CalibrationError {
    /// Not enough of them.
    #[error(
        "found {found} {}; a {model} transform needs at least {needed}, and 200 or more to average out the noise",
        if *found == 1 { "pair" } else { "pairs" }
    )]
    TooFew {
        /// How many there are.
        found: usize,
        /// How many are needed.
        needed: usize,
        /// The transform asked for.
        model: &'static str,
    },
    /// A coordinate is NaN or infinite.
    #[error("line {line}: a coordinate is not a finite number")]
    NotFinite {
        /// The pair's line.
        line: usize,
    },
    /// Probably millimetres or centimetres.
    #[error("the points of the {whose} reach over {found:.1}; allowed: at most {MAX_EXTENT_M} m. {}", ask_unit(*unit))]
    TooWide {
        /// Whose.
        whose: &'static str,
        /// Diagonal of their box or their largest coordinate, in the unit of the file.
        found: f64,
        /// The unit that they probably have.
        unit: Option<Unit>,
    },
    /// One half of the pairs is in another unit.
    #[error(
        "the points of the {whose} lie {ratio:.1} times as far apart as those of the other; allowed: the same, as far as \
         lengths are measured. {}", ask_unit(*unit)
    )]
    OtherUnit {
        /// Name of that one whose distances are larger.
        whose: &'static str,
        /// By how much.
        ratio: f64,
        /// The unit that they probably have.
        unit: Option<Unit>,
    },
    /// A device that stood still.
    #[error(
        "the points of the {whose} lie within {:.3} mm; needed: at least {} mm. Move the end points through the whole workspace",
        .extent_m * 1e3, MIN_EXTENT_M * 1e3
    )]
    HardlyMoved {
        /// Whose.
        whose: &'static str,
        /// Diagonal of their box (m).
        extent_m: f64,
    },
    /// A rigid transform needs points off a line.
    #[error(
        "the points lie on a line: RMS {:.3} mm along it, {:.3} mm across, of which {:.3} mm may be noise. The rotation about that line is not determined; move the end points in all three directions",
        .along_m * 1e3, .across_m * 1e3, .noise_m * 1e3
    )]
    Collinear {
        /// RMS extent along the line (m).
        along_m: f64,
        /// The next largest (m).
        across_m: f64,
        /// Noise of a pair per coordinate (m).
        noise_m: f64,
    },
    /// An affine transform needs points off a plane.
    #[error(
        "the points lie in a plane: RMS {:.3} mm in it, {:.3} mm across, of which {:.3} mm may be noise. Scale and shear across it are not determined; move the end points in all three directions, or fit a rigid transform, for which a plane suffices",
        .along_m * 1e3, .across_m * 1e3, .noise_m * 1e3
    )]
    Coplanar {
        /// Larger RMS extent in the plane (m).
        along_m: f64,
        /// RMS extent across (m).
        across_m: f64,
        /// Noise of a pair per coordinate (m).
        noise_m: f64,
    },
    /// No transform brings the halves of the pairs together.
    #[error(
        "the two devices' points do not belong together: the best transform leaves {:.1} mm per coordinate of points that reach over {:.1} mm RMS. Were the end points held together? Are the right columns, devices and units taken?",
        .noise_m * 1e3, .along_m * 1e3
    )]
    Unrelated {
        /// Largest RMS extent (m).
        along_m: f64,
        /// Noise of a pair per coordinate (m).
        noise_m: f64,
    },
    /// One half of the pairs is the mirror image of the other.
    #[error(
        "the points are mirror images: a reflection would leave {:.3} mm RMS, a rotation leaves {:.3} mm. One device's axes are left-handed: check the signs of its encoders and columns",
        .mirrored_rms_m * 1e3, .rms_m * 1e3
    )]
    Mirrored {
        /// RMS residual of the best rotation (m).
        rms_m: f64,
        /// RMS residual of the best reflection (m).
        mirrored_rms_m: f64,
    },
}
