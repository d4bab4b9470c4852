//! A figure of two panels: `cargo run -p plot --example panels -- STEM` writes `STEM.svg` and `STEM.png`.

use plot::{Axis, Chart, Figure, Look, Series};
use std::path::Path;

fn main() -> Result<(), plot::PlotError> {
    let stem = std::env::args().nth(1).unwrap_or_else(|| "panels".into());
    let wave = |period: f64| (0..200).map(|i| f64::from(i) / 20.0).map(|t| (t, (t / period).sin())).collect();
    let over_time =
        Chart::new("Position over time", Axis::linear("time", "s"), Axis::linear("position", "m"))
            .with(Series::new("measured", Look::Line, wave(1.0)))
            .with(Series::new("desired", Look::Dashed, wave(1.2)));
    let bell = |middle: f64, width: f64| {
        let share = move |x: f64| (x, (-((x / middle).ln() / width).powi(2)).exp());
        (0..80).map(|i| 0.01 * 1.2_f64.powi(i)).map(share).collect()
    };
    let histogram =
        Chart::new("How late", Axis::log("latency", "us"), Axis::log("share", "").within(1e-6, 1.0))
            .with(Series::new("hybrid wait", Look::Steps, bell(0.05, 0.7)))
            .with(Series::new("plain sleep", Look::Steps, bell(30.0, 0.6)));
    Figure::new("Two panels", vec![over_time, histogram])
        .note("One description, two formats.")
        .write(Path::new(&stem))
}
