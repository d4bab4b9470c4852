//! Strip charts: what was so in the last seconds.

use super::colours;
use super::history::{History, KEPT_S};
use crate::news::Status;
use crate::stage::Stage;
use eframe::egui::{self, Color32, RichText};
use egui_plot::{Line, Plot, PlotPoints};

/// Of one chart (points).
const HEIGHT: f32 = 78.0;
/// What numbers beside a chart take.
const NUMBERS: f32 = 34.0;

/// What the charts show.
#[derive(Debug, Default)]
pub(super) struct Charts {
    /// Of each finger, N.
    force: History,
    /// Of each finger, mm.
    depth: History,
    /// Median, 99 of 100, worst; us.
    latency: History,
    /// Of each finger, N.
    newest: Vec<f64>,
}

impl Charts {
    /// A tick: of each finger, force (N) and depth (m).
    pub(super) fn tick(&mut self, t_s: f64, fingers: &[[f64; 2]]) {
        self.force.push(t_s, fingers.iter().map(|[force, _]| *force));
        self.depth.push(t_s, fingers.iter().map(|[_, depth_m]| 1e3 * depth_m));
        self.newest.clear();
        self.newest.extend(fingers.iter().map(|[force, _]| *force));
    }

    /// How the run goes now.
    pub(super) fn status(&mut self, t_s: f64, status: &Status) {
        if let Some(latency_ns) = status.latency_ns {
            self.latency.push(t_s, latency_ns.into_iter().map(|ns| 1e-3 * ns as f64));
        }
    }

    /// Draws them one below the other.
    pub(super) fn show(&self, ui: &mut egui::Ui, stage: &Stage, status: &Status) {
        let fingers: Vec<Color32> = (0..self.newest.len()).map(colours::finger).collect();
        ui.horizontal_wrapped(|ui| {
            for (finger, force) in self.newest.iter().enumerate() {
                let name = stage.fingers.get(finger).map_or("finger", String::as_str);
                ui.label(RichText::new(format!("{name} {force:.2}")).monospace().color(fingers[finger]));
            }
        });
        let has_latency = !self.latency.is_empty();
        chart(ui, "force (N)", &self.force, &fingers, 1.0, false);
        chart(ui, "depth (mm)", &self.depth, &fingers, 1.0, !has_latency);
        if has_latency {
            let [median, most, worst] = status.latency_ns.unwrap_or_default().map(|ns| ns as f64 * 1e-3);
            ui.horizontal_wrapped(|ui| {
                let words =
                    [format!("median {median:.0}"), format!("99 % {most:.0}"), format!("worst {worst:.0}")];
                ui.label("us of the last second:");
                for (words, colour) in words.into_iter().zip(colours::LATENCY) {
                    ui.label(RichText::new(words).color(colour));
                }
            });
            chart(ui, "loop latency (us)", &self.latency, &colours::LATENCY, 50.0, true);
        }
    }
}

fn chart(
    ui: &mut egui::Ui,
    title: &str,
    history: &History,
    colours: &[Color32],
    least_top: f64,
    with_times: bool,
) {
    ui.label(title);
    let lines: Vec<Vec<[f64; 2]>> = (0..colours.len()).map(|line| history.line(line)).collect();
    let greatest = lines.iter().flatten().map(|[_, value]| *value).fold(least_top, f64::max);
    let top = round_up(greatest);
    let height = if with_times { HEIGHT + 16.0 } else { HEIGHT };
    let plot = Plot::new(title)
        .height(height)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_double_click_reset(false)
        .allow_axis_zoom_drag(false)
        .show_axes([with_times, true])
        .y_axis_min_width(NUMBERS)
        .x_grid_spacer(|_| marks(&[-10.0, -7.5, -5.0, -2.5, 0.0], 5.0))
        .y_grid_spacer(move |_| marks(&[0.0, 0.5 * top, top], 0.5 * top))
        .x_axis_formatter(
            |mark, _| if mark.value == 0.0 { "now".into() } else { format!("{} s", mark.value) },
        )
        .y_axis_formatter(|mark, _| format!("{}", mark.value))
        .show_x(false)
        .show_y(false);
    plot.show(ui, |plot| {
        // With room for the last word below.
        plot.set_plot_bounds_x(-KEPT_S..=0.06 * KEPT_S);
        // A line at the top, or at zero, is seen as a whole.
        plot.set_plot_bounds_y(-0.06 * top..=1.1 * top);
        // The first are thicker: fingers that feel the same are seen all the same.
        for ((line, colour), behind) in lines.into_iter().zip(colours).zip((0..colours.len()).rev()) {
            let width = 1.2 + 1.6 * behind.min(3) as f32;
            plot.line(Line::new("", PlotPoints::from(line)).color(*colour).width(width).allow_hover(false));
        }
    });
}

fn marks(values: &[f64], step_size: f64) -> Vec<egui_plot::GridMark> {
    values.iter().map(|value| egui_plot::GridMark { value: *value, step_size }).collect()
}

/// To 1, 2 or 5 of a power of ten.
fn round_up(value: f64) -> f64 {
    let power = 10.0_f64.powf(value.log10().floor());
    let digits = [1.0, 2.0, 5.0].into_iter().find(|digits| value <= digits * power * (1.0 + 1e-9));
    digits.unwrap_or(10.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn charts_end_at_round_numbers_that_nothing_is_above() {
        for (value, top) in
            [(1.0, 1.0), (1.01, 2.0), (2.0, 2.0), (4.2, 5.0), (5.1, 10.0), (73.0, 100.0), (0.3, 0.5)]
        {
            assert!((round_up(value) - top).abs() < 1e-9, "{value}: {}", round_up(value));
        }
    }
}
