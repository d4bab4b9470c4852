//! Residuals and points as a figure.

use calibration::{Calibration, Fit, Pair};
use nalgebra::Vector3;
use plot::{Axis, Chart, Figure, Look, Series};
use std::path::Path;

/// What a figure's file is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Svg,
    Png,
}

/// By the ending of its name.
pub(super) fn kind_of(file: &Path) -> Option<Kind> {
    match file.extension()?.to_str()?.to_ascii_lowercase().as_str() {
        "svg" => Some(Kind::Svg),
        "png" => Some(Kind::Png),
        _ => None,
    }
}

/// The residual of each pair under the fit that is used, and both devices' points in the fiducial's base from above
/// and from the side.
pub(super) fn figure(pairs: &[Pair], found: &Calibration, used: &Fit) -> Figure {
    let panels =
        vec![residuals(pairs, found, used), projection(pairs, used, [0, 2]), projection(pairs, used, [0, 1])];
    let kind = found.model.name();
    Figure::new("Calibration of two devices", panels).note(format!(
        "{kind} fit to {} of {} pairs, residual RMS {:.3} mm",
        used.count,
        pairs.len(),
        used.residuals.rms_m * 1e3
    ))
}

fn residuals(pairs: &[Pair], found: &Calibration, used: &Fit) -> Chart {
    let is_outlier = |pair: &Pair| found.outliers.listed.iter().any(|outlier| outlier.line == pair.line);
    let point = |pair: &Pair| {
        let gap = pair.fiducial - used.transform.apply(&pair.other);
        (pair.line as f64, gap.norm() * 1e3)
    };
    let of = |wanted: bool| pairs.iter().filter(|pair| is_outlier(pair) == wanted).map(point).collect();
    let chart = Chart::new("Residual of each pair", Axis::linear("line", ""), Axis::linear("distance", "mm"))
        .with(Series::new("pairs", Look::Dots, of(false)));
    if found.outliers.listed.is_empty() {
        return chart;
    }
    let ends = [pairs.first(), pairs.last()].into_iter().flatten();
    let limit = ends.map(|pair| (pair.line as f64, found.outliers.threshold_m * 1e3)).collect();
    chart.with(Series::new("outliers", Look::Dots, of(true))).with(Series::new(
        "five times the noise",
        Look::Dashed,
        limit,
    ))
}

fn projection(pairs: &[Pair], used: &Fit, axes: [usize; 2]) -> Chart {
    let names = ["x", "y", "z"];
    let [a, b] = axes;
    let flat = |p: Vector3<f64>| (p[a] * 1e3, p[b] * 1e3);
    let fiducial = pairs.iter().map(|pair| flat(pair.fiducial)).collect();
    let other = pairs.iter().map(|pair| flat(used.transform.apply(&pair.other))).collect();
    let title = format!("Points in the fiducial's base, {} over {}", names[b], names[a]);
    Chart::new(&title, Axis::linear(names[a], "mm"), Axis::linear(names[b], "mm"))
        .with(Series::new("fiducial", Look::Dots, fiducial))
        .with(Series::new("other device, transformed", Look::Dots, other))
}
