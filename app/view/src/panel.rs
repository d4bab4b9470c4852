//! The panel beside the scene: what is felt over time, and what can be changed.
//!
//! Model: what is drawn stands apart from what is known: lines of the last seconds ([`history`]), which entities are shown and
//! what touches them ([`entities`]), and how sliders become orders ([`tuning`], [`friction`]).

mod charts;
mod chosen;
mod colours;
pub mod entities;
pub mod friction;
pub mod history;
mod rows;
pub mod tuning;

use crate::news::{Ask, Glimpse, Status};
use crate::stage::Stage;
use charts::Charts;
use eframe::egui::{self, Button, RichText};
use entities::{Contacts, Filtered};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::sync::mpsc::Sender;
use tuning::Tuning;

/// How wide it is at first, and may be (points).
const WIDTH: f32 = 330.0;
const WIDTHS: [f32; 2] = [300.0, 360.0];

/// What the panel remembers.
#[derive(Debug)]
pub struct Panel {
    /// Whether it is shown.
    pub is_open: bool,
    status: Status,
    charts: Charts,
    contacts: Contacts,
    filter: String,
    filtered: Filtered,
    /// Of the entities that were chosen, how they are to feel.
    tunings: BTreeMap<usize, Tuning>,
    /// Who is chosen, and where it is (m).
    chosen: Option<usize>,
    place: Option<Vector3<f64>>,
    newest_s: f64,
    /// When the recording began (s).
    recording_since_s: Option<f64>,
}

impl Default for Panel {
    fn default() -> Self {
        Self {
            is_open: true,
            status: Status::default(),
            charts: Charts::default(),
            contacts: Contacts::default(),
            filter: String::new(),
            filtered: Filtered::default(),
            tunings: BTreeMap::new(),
            chosen: None,
            place: None,
            newest_s: 0.0,
            recording_since_s: None,
        }
    }
}

impl Panel {
    /// What the run told.
    pub fn take(&mut self, glimpse: &Glimpse) {
        let Glimpse { moment, samples, status } = glimpse;
        samples.iter().for_each(|sample| self.charts.tick(sample.t_s, &sample.fingers));
        self.charts.status(moment.t_s, status);
        self.contacts = Contacts::new(status);
        self.status.clone_from(status);
        self.newest_s = moment.t_s;
        self.place =
            self.chosen.and_then(|entity| moment.poses.get(entity)).map(|pose| pose.translation.vector);
        let since = self.recording_since_s;
        self.recording_since_s = status.recording.as_ref().map(|_| since.unwrap_or(moment.t_s));
    }

    /// Another scene goes on.
    pub fn clear(&mut self) {
        *self = Self { is_open: self.is_open, ..Self::default() };
    }

    /// Shows it, on the right of what is left; asks for what people want of the selected entity.
    pub fn show(
        &mut self,
        ui: &mut egui::Ui,
        stage: &Stage,
        selected: &mut Option<usize>,
        ask: &Sender<Ask>,
    ) {
        if self.is_open {
            let dark = egui::Visuals::dark();
            let frame = egui::Frame::new().fill(dark.panel_fill).inner_margin(8.0);
            let panel = egui::Panel::right("panel")
                .resizable(true)
                .default_size(WIDTH)
                .size_range(WIDTHS[0]..=WIDTHS[1]);
            panel.frame(frame).show_inside(ui, |ui| {
                *ui.visuals_mut() = dark;
                self.show_inside(ui, stage, selected, ask);
            });
        } else if hidden(ui).clicked() {
            self.is_open = true;
        }
        self.chosen = *selected;
        let now_s = ui.input(|input| input.time);
        for order in self.tunings.values_mut().flat_map(|tuning| tuning.orders(now_s)) {
            // Who listened is gone: the run is over.
            let _ = ask.send(Ask::Order(order));
        }
    }

    fn show_inside(
        &mut self,
        ui: &mut egui::Ui,
        stage: &Stage,
        selected: &mut Option<usize>,
        ask: &Sender<Ask>,
    ) {
        self.show_buttons(ui, ask);
        egui::ScrollArea::vertical().id_salt("panel").show(ui, |ui| {
            self.charts.show(ui, stage, &self.status);
            ui.separator();
            match selected.and_then(|entity| Some((entity, stage.known.get(entity)?))) {
                Some((entity, known)) => {
                    let tuning = self.tunings.entry(entity).or_insert_with(|| Tuning::new(known));
                    chosen::show(ui, known, self.place, tuning);
                }
                None => {
                    ui.label("nothing is selected");
                }
            }
            ui.separator();
            let filter = (&mut self.filter, &mut self.filtered);
            rows::show(ui, stage, &self.status, &self.contacts, filter, selected);
        });
    }

    fn show_buttons(&mut self, ui: &mut egui::Ui, ask: &Sender<Ask>) {
        let mut wants = Vec::new();
        ui.horizontal(|ui| {
            let (words, order) =
                if self.status.is_paused { ("Resume", "resume") } else { ("Pause", "pause") };
            if ui.button(words).clicked() {
                wants.push(Ask::Order(order.into()));
            }
            if ui.button("Reset").clicked() {
                wants.push(Ask::Order("reset".into()));
            }
            let record = match self.recording_since_s {
                None => Button::new("Record"),
                Some(since_s) => {
                    let words = format!("Recording {}", clock(self.newest_s - since_s));
                    Button::new(RichText::new(words).color(egui::Color32::WHITE)).fill(colours::RECORDING)
                }
            };
            let record = ui.add(record);
            let record = match &self.status.recording {
                Some(path) => record.on_hover_text(format!("{path}; ends with another click")),
                None => record,
            };
            if record.clicked() {
                wants.push(Ask::Record(self.recording_since_s.is_none()));
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                self.is_open &= !ui.button("Hide").clicked();
            });
        });
        for want in wants {
            // Who listened is gone: the run is over.
            let _ = ask.send(want);
        }
    }
}

/// What is left of it while it is hidden.
fn hidden(ui: &egui::Ui) -> egui::Response {
    let area = egui::Area::new("panel is hidden".into()).anchor(egui::Align2::RIGHT_TOP, [-8.0, 8.0]);
    area.show(ui.ctx(), |ui| ui.button("Panel")).inner
}

/// Minutes and seconds.
fn clock(seconds: f64) -> String {
    let whole = seconds.max(0.0) as u64;
    format!("{}:{:02}", whole / 60, whole % 60)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::moment::Moment;

    fn glimpse(t_s: f64, recording: Option<&str>) -> Glimpse {
        let status = Status { recording: recording.map(String::from), ..Status::default() };
        Glimpse { moment: Moment { t_s, ..Moment::default() }, status, ..Glimpse::default() }
    }

    #[test]
    fn a_recording_s_time_is_counted_from_its_beginning() {
        let mut panel = Panel::default();
        panel.take(&glimpse(1.0, None));
        assert_eq!(panel.recording_since_s, None);
        panel.take(&glimpse(2.0, Some("a.mcap")));
        panel.take(&glimpse(77.5, Some("a.mcap")));
        assert_eq!(
            panel.recording_since_s.map(|since_s| clock(panel.newest_s - since_s)).as_deref(),
            Some("1:15")
        );
        panel.take(&glimpse(80.0, None));
        panel.take(&glimpse(81.0, Some("b.mcap")));
        assert_eq!(panel.recording_since_s, Some(81.0));
    }

    #[test]
    fn another_scene_forgets_all_but_whether_the_panel_is_open() {
        let mut panel = Panel { is_open: false, filter: "cube".into(), ..Panel::default() };
        panel.clear();
        assert!(!panel.is_open && panel.filter.is_empty());
    }
}
