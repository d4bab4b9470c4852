//! The panel beside the scene: what is felt over time, and what can be changed.

use crate::news::{Ask, Glimpse, Status};
use crate::stage::Stage;
use eframe::egui;
use std::sync::mpsc::Sender;

/// What the panel remembers.
#[derive(Debug, Default)]
pub struct Panel {
    status: Status,
}

impl Panel {
    /// What the run told.
    pub fn take(&mut self, glimpse: &Glimpse) {
        self.status = glimpse.status.clone();
    }

    /// Another scene goes on.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Shows it, on the right of what is left; asks for what people want of the selected entity.
    pub fn show(
        &mut self,
        ui: &mut egui::Ui,
        stage: &Stage,
        selected: &mut Option<usize>,
        ask: &Sender<Ask>,
    ) {
        let _ = (ui, stage, selected, ask);
    }
}
