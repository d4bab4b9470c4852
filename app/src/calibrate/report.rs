//! What was found, for people and for programs.

use super::CalibrateArgs;
use calibration::{Accuracy, Calibration, Fit, Transform};
use nalgebra::{Isometry3, Vector3};
use rt_core::plain_text::{Plain, PlainJson};
use serde_json::{Value, json};
use std::fmt;
use std::path::Path;
use world::Placement;

/// Everything there is to say.
pub(super) struct Report<'a> {
    /// Where the pairs come from.
    pub(super) origin: &'a str,
    pub(super) args: &'a CalibrateArgs,
    pub(super) found: &'a Calibration,
    /// The fit that goes into the layout.
    pub(super) used: &'a Fit,
    pub(super) X_WN: &'a Placement,
    /// As the layout writes it.
    pub(super) entry: &'a Placement,
}

/// More are counted, not listed.
const LISTED: usize = 20;
/// Two arms of one type differ by about this share in their geometry; more is worth a word.
const ODD_SCALE: f64 = 0.01;
/// Points anywhere in a cube of 1.4 m (m).
const WIDE_M: f64 = 0.4;

impl fmt::Display for Report<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (found, used) = (self.found, self.used);
        let (device, fiducial) = (self.args.device, self.args.fiducial);
        writeln!(
            out,
            "fit          {}, device {device} against device {fiducial}, {} pairs of {}",
            found.model.name(),
            used.count,
            Plain(self.origin)
        )?;
        let r = &used.residuals;
        writeln!(
            out,
            "residual     RMS {:.3} mm, largest {:.3} mm (line {}); along x, y, z {} mm",
            r.rms_m * 1e3,
            r.max_m * 1e3,
            r.max_line,
            three(r.axis_rms_m, 1e3, 3)
        )?;
        let spread = &used.spread_other;
        writeln!(
            out,
            "points       RMS extent {} mm along their main directions, {}",
            three(spread.rms_m, 1e3, 1),
            condition(spread.condition())
        )?;
        self.write_accuracy(out)?;
        if let Some(warning) = self.warning() {
            writeln!(out, "WARNING      {warning}")?;
        }
        self.write_shape(out)?;
        self.write_outliers(out)?;
        write!(
            out,
            "in the world at {} m, turned by {} (w, x, y, z)",
            three(self.X_WN.position_m().into(), 1.0, 5),
            four(&self.X_WN.nearest_pose())
        )
    }
}

impl Report<'_> {
    fn write_accuracy(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.used.accuracy {
            None => writeln!(out, "accuracy     unknown: the fit needed every pair; gather more"),
            Some(accuracy) => {
                let Accuracy { noise_m, middle_m, position_m, rotation_rad, stretch, freedom } = accuracy;
                let factor = accuracy.factor_95();
                writeln!(
                    out,
                    "accuracy     along and about each axis, in 95 of 100 calibrations: within {:.4} mm where the points are, {} mm at the base, {} degrees; noise {:.3} mm, {freedom} degrees of freedom",
                    factor * middle_m * 1e3,
                    three(position_m, factor * 1e3, 3),
                    three(rotation_rad.map(f64::to_degrees), factor, 4),
                    noise_m * 1e3
                )?;
                stretch.map_or(Ok(()), |stretch| {
                    writeln!(
                        out,
                        "             and {} % of the scale along the main directions",
                        three(stretch, factor * 100.0, 4)
                    )
                })
            }
        }
    }

    /// Of a fit to few pairs, and of points that are hardly those of a desktop device.
    fn warning(&self) -> Option<String> {
        let warnings: Vec<String> = [self.few_pairs(), self.wide()].into_iter().flatten().collect();
        (!warnings.is_empty()).then(|| warnings.join(". "))
    }

    fn wide(&self) -> Option<String> {
        let extent_m = self.used.spread_other.rms_m[0];
        (extent_m > WIDE_M).then(|| {
            format!(
                "the points reach over {extent_m:.2} m RMS, further than desktop devices do; the columns are metres: if \
                 these are centimetres, divide them by 100"
            )
        })
    }

    fn few_pairs(&self) -> Option<String> {
        let (count, enough) = (self.used.count, self.found.model.enough_pairs());
        let noise = match self.used.accuracy {
            Some(accuracy) => {
                format!("the noise is known to {:.0} % only", 100.0 * accuracy.noise_uncertainty())
            }
            None => "nothing is left to tell the noise from".to_owned(),
        };
        (count < enough).then(|| {
            format!(
                "{count} pairs are few: {noise}, and one that does not belong cannot be found; gather {enough} or more"
            )
        })
    }

    fn write_shape(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.args.affine {
            let shape = self.used.transform.shape();
            return writeln!(
                out,
                "contains     scale {} along the device's x, y, z; shear {} degrees in xy, yz, zx; volume {:.4}",
                three(shape.scale, 1.0, 4),
                three(shape.shear_rad.map(f64::to_degrees), 1.0, 3),
                shape.volume
            );
        }
        let scale = self.used.scale;
        let odd = (scale - 1.0).abs() > ODD_SCALE;
        let word = if odd {
            "; one device's link lengths are wrong, or its counters: --affine would absorb it"
        } else {
            ""
        };
        writeln!(out, "scale        {scale:.4} between the devices, left out of a rigid fit{word}")
    }

    fn write_outliers(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let listed = &self.found.outliers.listed;
        let Some(without) = &self.found.without_outliers else {
            let few = self.found.outliers.threshold_m.is_infinite();
            let word =
                if few { "not looked for: too few pairs, or too many that do not belong" } else { "none" };
            return writeln!(out, "outliers     {word}");
        };
        let lines: Vec<String> = listed
            .iter()
            .take(LISTED)
            .map(|outlier| format!("{} ({:.2} mm)", outlier.line, outlier.distance_m * 1e3))
            .collect();
        let more = if listed.len() > LISTED {
            format!(" and {} more", listed.len() - LISTED)
        } else {
            String::new()
        };
        writeln!(
            out,
            "outliers     {} further than {:.3} mm, five times the noise, on lines {}{more}",
            listed.len(),
            self.found.outliers.threshold_m * 1e3,
            lines.join(", ")
        )?;
        let (turn_rad, shift_m) =
            difference(&self.found.all.transform, &without.transform, &without.spread_other.centre);
        let what =
            if self.args.reject_outliers { "left out" } else { "kept; --reject-outliers leaves them out" };
        writeln!(
            out,
            "             {what}: the fit differs by {:.3} mm where the points are and {:.3} degrees, RMS {:.3} instead of {:.3} mm",
            shift_m * 1e3,
            turn_rad.to_degrees(),
            without.residuals.rms_m * 1e3,
            self.found.all.residuals.rms_m * 1e3
        )
    }

    /// The same with stable keys.
    pub(super) fn json(&self, written: Option<&Path>) -> String {
        let (found, used) = (self.found, self.used);
        let shape = used.transform.shape();
        let value = json!({
            "model": found.model.name(),
            "device": self.args.device,
            "fiducial": self.args.fiducial,
            "pairs": used.count,
            "device_to_fiducial": placement(&used.transform),
            "device_to_world": { "position_m": numbers(&self.X_WN.position_m()), "matrix": rows(&self.X_WN.matrix()) },
            "layout_entry": { "position_m": numbers(&self.entry.position_m()), "matrix": rows(&self.entry.matrix()),
                "is_rigid": self.entry.rigid().is_some() },
            "residual_rms_m": used.residuals.rms_m,
            "residual_max_m": used.residuals.max_m,
            "residual_max_line": used.residuals.max_line,
            "residual_axis_rms_m": used.residuals.axis_rms_m,
            "singular_values_m": used.spread_other.singular_values_m,
            "extent_rms_m": used.spread_other.rms_m,
            // Infinite for points in a plane, which JSON has no word for.
            "condition": Some(used.spread_other.condition()).filter(|condition| condition.is_finite()),
            "accuracy": used.accuracy.map(|accuracy| json!({
                "noise_m": accuracy.noise_m,
                "degrees_of_freedom": accuracy.freedom,
                // So many of the standard errors below are exceeded in 5 of 100 calibrations.
                "factor_95": accuracy.factor_95(),
                "middle_m": accuracy.middle_m,
                "position_m": accuracy.position_m,
                "rotation_rad": accuracy.rotation_rad,
                "stretch": accuracy.stretch,
            })),
            "warning": self.warning(),
            "scale_between_devices": used.scale,
            "scale": shape.scale,
            "shear_rad": shape.shear_rad,
            "outliers": found.outliers.listed.iter()
                .map(|outlier| json!({ "line": outlier.line, "distance_m": outlier.distance_m })).collect::<Vec<_>>(),
            "outliers_rejected": self.args.reject_outliers && found.without_outliers.is_some(),
            "without_outliers": found.without_outliers.as_ref().map(|fit| json!({
                "device_to_fiducial": placement(&fit.transform),
                "residual_rms_m": fit.residuals.rms_m,
            })),
            "written_to": written.map(|file| file.display().to_string()),
        });
        PlainJson(format_args!("{value:#}")).to_string()
    }
}

fn placement(transform: &Transform) -> Value {
    json!({ "position_m": numbers(&transform.position), "matrix": rows(&transform.matrix) })
}

fn rows(matrix: &nalgebra::Matrix3<f64>) -> Vec<Vec<f64>> {
    matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
}

fn numbers(vector: &Vector3<f64>) -> [f64; 3] {
    (*vector).into()
}

/// By how much two fits turn and move the middle of the points differently.
fn difference(a: &Transform, b: &Transform, middle: &Vector3<f64>) -> (f64, f64) {
    let turn = a.rigid().rotation.angle_to(&b.rigid().rotation);
    (turn, (a.apply(middle) - b.apply(middle)).norm())
}

/// Beyond a million the points lie in a plane, and the digits are those of rounding.
fn condition(condition: f64) -> String {
    if condition < 1e6 { format!("condition {condition:.1}") } else { "in a plane".into() }
}

fn three(numbers: [f64; 3], factor: f64, digits: usize) -> String {
    numbers.map(|number| format!("{:.digits$}", number * factor)).join(", ")
}

fn four(pose: &Isometry3<f64>) -> String {
    let q = pose.rotation;
    [q.w, q.i, q.j, q.k].map(|number| format!("{number:.5}")).join(", ")
}
