//! What is known of the entity that people have chosen, and what they can change.

use super::tuning::{MOST_TIMES, Tuning};
use crate::stage::Known;
use eframe::egui::{self, RichText, Slider};
use nalgebra::Vector3;
use world::MassSpec;

/// Beside a slider: its number and its words.
const BESIDE: f32 = 150.0;

/// Shows it, with sliders.
pub(super) fn show(ui: &mut egui::Ui, known: &Known, place: Option<Vector3<f64>>, tuning: &mut Tuning) {
    ui.horizontal(|ui| {
        ui.label(RichText::new(&known.name).strong());
        ui.label(facts(known));
    });
    let at = place.map_or_else(String::new, |at| {
        let [x, y, z] = [at.x, at.y, at.z].map(|metres| 1e3 * metres);
        format!("x {x:8.1}  y {y:8.1}  z {z:8.1} mm")
    });
    ui.label(RichText::new(at).monospace());
    ui.spacing_mut().slider_width = (ui.available_width() - BESIDE).max(60.0);
    let values = [(known.stiffness_n_per_m, "N/m  stiffness"), (known.damping_n_s_per_m, "N s/m  damping")];
    for (which, (said, words)) in values.into_iter().enumerate() {
        let mut value = said * tuning.times()[which];
        let range = said / MOST_TIMES..=said * MOST_TIMES;
        let slider = Slider::new(&mut value, range).logarithmic(true).text(words).max_decimals(3);
        if ui.add_enabled(said > 0.0, slider).changed() {
            tuning.want_times(which, value / said);
        }
    }
    let Some(friction) = tuning.friction() else {
        ui.label("friction: a curve");
        return;
    };
    let (model, keys) = (friction.model(), friction.keys().to_vec());
    for (number, key) in keys.into_iter().enumerate() {
        let Some(most) = key.most else { continue };
        let mut value = key.value;
        let words = format!("{}  {model}", name(key.name));
        let slider = Slider::new(&mut value, 0.0..=most.max(key.value)).text(words).max_decimals(3);
        if ui.add(slider).changed() {
            // What orders say is what is read here.
            tuning.want_friction(number, (1e3 * value).round() / 1e3);
        }
    }
}

/// What it is and how heavy.
fn facts(known: &Known) -> String {
    let kind = known.kind;
    match known.mass {
        None => format!("{kind}, fixed"),
        Some(MassSpec::Mass(kg)) if kg < 1.0 => format!("{kind}, {} g", 1e3 * kg),
        Some(MassSpec::Mass(kg)) => format!("{kind}, {kg} kg"),
        Some(MassSpec::Density(kg_m3)) => format!("{kind}, {kg_m3} kg/m³"),
    }
}

/// Without its unit.
fn name(key: &str) -> &str {
    match key {
        "mu_v_s_per_m" => "mu_v s/m",
        "friction_n" => "N slides",
        "static_n" => "N holds",
        key => key,
    }
}
