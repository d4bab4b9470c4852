//! The list of entities.

use super::colours;
use super::entities::{Contacts, Filtered, list};
use crate::news::Status;
use crate::stage::Stage;
use eframe::egui::{self, Align2, Color32, FontId, Rect, ScrollArea, Sense, TextStyle, pos2, vec2};

/// Of the width, where the list's name and what touches it begin.
const COLUMNS: [f32; 2] = [0.38, 0.6];
/// Fewer rows are not shown.
const LEAST_HEIGHT: f32 = 110.0;

/// Shows those that a filter leaves; a click chooses.
pub(super) fn show(
    ui: &mut egui::Ui,
    stage: &Stage,
    status: &Status,
    contacts: &Contacts,
    (filter, filtered): (&mut String, &mut Filtered),
    selected: &mut Option<usize>,
) {
    let found = filtered.of(&stage.known, filter);
    let count = format!("{} of {} entities", found.len(), stage.known.len());
    ui.horizontal(|ui| {
        ui.add(egui::TextEdit::singleline(filter).hint_text("filter").desired_width(120.0));
        ui.label(count);
    });
    let height = ui.text_style_height(&TextStyle::Body) + 2.0;
    ui.spacing_mut().item_spacing.y = 0.0;
    let area = ScrollArea::vertical()
        .id_salt("entities")
        .auto_shrink([false, false])
        .max_height(ui.available_height().max(LEAST_HEIGHT));
    area.show_rows(ui, height, found.len(), |ui, shown| {
        for &entity in found.get(shown).unwrap_or_default() {
            if row(
                ui,
                height,
                stage,
                (entity, &list(&stage.known[entity], entity, status)),
                contacts,
                *selected,
            ) {
                *selected = if *selected == Some(entity) { None } else { Some(entity) };
            }
        }
    });
}

/// Whether it was clicked.
fn row(
    ui: &mut egui::Ui,
    height: f32,
    stage: &Stage,
    (entity, list): (usize, &str),
    contacts: &Contacts,
    selected: Option<usize>,
) -> bool {
    let (place, response) = ui.allocate_exact_size(vec2(ui.available_width(), height), Sense::click());
    let visuals = ui.visuals().clone();
    let is_selected = selected == Some(entity);
    let (strong, weak) = if is_selected { (255, 220) } else { (200, 160) };
    let [strong, weak] = [strong, weak].map(Color32::from_gray);
    if is_selected {
        ui.painter().rect_filled(place, 2.0, visuals.selection.bg_fill);
    } else if response.hovered() {
        ui.painter().rect_filled(place, 2.0, visuals.widgets.hovered.weak_bg_fill);
    }
    let [list_at, contacts_at] = COLUMNS.map(|share| place.left() + share * place.width());
    let font = TextStyle::Body.resolve(ui.style());
    let cell = |from: f32, to: f32| Rect::from_x_y_ranges(from..=to, place.y_range());
    let words = |cell: Rect, words: &str, colour: Color32| write(ui, cell, words, colour, &font);
    let name = &stage.known[entity].name;
    words(cell(place.left() + 2.0, list_at - 4.0), name, strong);
    words(cell(list_at, contacts_at - 4.0), list, weak);
    let mut at = contacts_at;
    for finger in contacts.fingers(entity) {
        let name = stage.fingers.get(*finger).map_or("finger", String::as_str);
        at = words(cell(at, place.right()), name, colours::finger(*finger)) + 5.0;
    }
    for other in contacts.others(entity, stage) {
        if at >= place.right() {
            break;
        }
        at = words(cell(at, place.right()), other, weak) + 5.0;
    }
    response.clicked()
}

/// Where the words end.
fn write(ui: &egui::Ui, cell: Rect, words: &str, colour: Color32, font: &FontId) -> f32 {
    let clip = cell.intersect(ui.clip_rect());
    let at = pos2(cell.left(), cell.center().y);
    ui.painter().with_clip_rect(clip).text(at, Align2::LEFT_CENTER, words, font.clone(), colour).right()
}
