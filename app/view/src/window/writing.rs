//! Text over the scene: on dark patches, so that it is read on everything.

use crate::input::{Bindings, HelpLine, help as help_lines};
use crate::text::{Shown, lines};
use eframe::egui::{Align2, Color32, FontId, Painter, Rect, Vec2, pos2, vec2};

const LINE: f32 = 12.0;
const NOTE: f32 = 18.0;
/// Of a monospaced character, in heights of its font.
const ASPECT: f32 = 0.6;
/// From row to row, in heights of the font.
const ROW: f32 = 1.4;
/// Around text.
const MARGIN: Vec2 = vec2(8.0, 4.0);
/// Lines of a message.
const MOST_LINES: usize = 3;
/// Characters of the help: keys, and what they do.
const KEYS: usize = 20;
const SAYS: usize = 37;
/// So opaque is what lies behind text.
const PATCH: f64 = 0.75;

fn font(size: f32) -> FontId {
    FontId::monospace(size)
}

fn patch(painter: &Painter, place: Rect, opacity: f64) {
    painter.rect_filled(place, 3.0, Color32::from_black_alpha((255.0 * PATCH * opacity) as u8));
}

fn white(opacity: f64) -> Color32 {
    Color32::from_white_alpha((255.0 * opacity) as u8)
}

/// So many characters of this height fit.
fn columns(width: f32, size: f32) -> usize {
    ((width - 2.0 * MARGIN.x) / (ASPECT * size)).max(1.0) as usize
}

/// Along the lower edge.
pub(super) fn line(painter: &Painter, scene: Rect, text: &str) {
    let height = LINE + 2.0 * MARGIN.y;
    patch(painter, Rect::from_min_max(pos2(scene.min.x, scene.max.y - height), scene.max), 1.0);
    let at = pos2(scene.min.x + MARGIN.x, scene.max.y - 0.5 * height);
    let text = lines_of_one(text, columns(scene.width(), LINE));
    painter.text(at, Align2::LEFT_CENTER, text, font(LINE), Color32::WHITE);
}

/// Spaces are kept: numbers stay where they are.
fn lines_of_one(text: &str, columns: usize) -> String {
    if text.chars().count() <= columns {
        return text.into();
    }
    text.chars().take(columns - 1).chain(['\u{2026}']).collect()
}

/// Messages, where they are to be.
pub(super) fn notes(painter: &Painter, scene: Rect, notes: &[Shown<'_>]) {
    let mut below = Vec::<([f64; 2], f32)>::new();
    for note in notes {
        let text = lines(note.text, columns(0.9 * scene.width(), NOTE), MOST_LINES);
        let widest = text.iter().map(|line| line.chars().count()).max().unwrap_or(0);
        let size = vec2(ASPECT * NOTE * widest as f32, ROW * NOTE * text.len() as f32) + 2.0 * MARGIN;
        // Those of the same place that stand above it.
        let at = below.iter().position(|(place, _)| *place == note.at).unwrap_or_else(|| {
            below.push((note.at, 0.0));
            below.len() - 1
        });
        let middle = scene.min + scene.size() * vec2(note.at[0] as f32, note.at[1] as f32);
        let upper = middle + vec2(-0.5 * size.x, below[at].1 - 0.5 * ROW * NOTE);
        below[at].1 += size.y + MARGIN.y;
        // Within the scene, as far as it fits.
        let most = (scene.max - size).max(scene.min);
        let place = Rect::from_min_size(upper.clamp(scene.min, most), size);
        patch(painter, place, note.opacity);
        for (row, line) in text.iter().enumerate() {
            let at = pos2(place.center().x, place.min.y + MARGIN.y + ROW * NOTE * (row as f32 + 0.5));
            painter.text(at, Align2::CENTER_CENTER, line, font(NOTE), white(note.opacity));
        }
    }
}

/// What keys and mouse do, in two columns in the middle.
pub(super) fn help(painter: &Painter, scene: Rect, bindings: &Bindings) {
    let both = help_lines(bindings);
    let rows = both.iter().map(Vec::len).max().unwrap_or(0) as f32;
    let characters = (2 * (KEYS + SAYS)) as f32;
    let room = scene.size() - 6.0 * MARGIN - vec2(0.0, LINE + 2.0 * MARGIN.y);
    let size = LINE.min(room.x / (ASPECT * characters)).min(room.y / (ROW * rows)).max(1.0);
    let column = vec2(ASPECT * size * (KEYS + SAYS) as f32, ROW * size * rows);
    let place = Rect::from_center_size(scene.center(), vec2(2.0 * column.x, column.y) + 4.0 * MARGIN);
    // What it lies on is not to be read.
    patch(painter, place, 0.93 / PATCH);
    for (at, column_lines) in both.iter().enumerate() {
        let corner = place.min + 2.0 * MARGIN + vec2(at as f32 * column.x, 0.0);
        for (row, line) in column_lines.iter().enumerate() {
            let at = corner + vec2(0.0, ROW * size * row as f32);
            match line {
                HelpLine::Title(title) => {
                    painter.text(at, Align2::LEFT_TOP, title, font(size), Color32::from_rgb(255, 210, 90));
                }
                HelpLine::Does { keys, says } => {
                    let keys = lines_of_one(keys, KEYS - 1);
                    painter.text(at, Align2::LEFT_TOP, keys, font(size), Color32::from_rgb(150, 220, 255));
                    let at = at + vec2(ASPECT * size * KEYS as f32, 0.0);
                    painter.text(at, Align2::LEFT_TOP, says, font(size), Color32::WHITE);
                }
            }
        }
    }
}
