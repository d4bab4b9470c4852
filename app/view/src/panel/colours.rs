//! Colours of the panel's lines and words, on its dark ground.

use eframe::egui::Color32;

/// Of fingers, in their order: those of Okabe and Ito that stand out from what is dark, which people who confuse red and
/// green tell apart, too.
const FINGERS: [Color32; 6] = [
    Color32::from_rgb(0xE6, 0x9F, 0x00),
    Color32::from_rgb(0x56, 0xB4, 0xE9),
    Color32::from_rgb(0x00, 0xC0, 0x8B),
    Color32::from_rgb(0xF0, 0xE4, 0x42),
    Color32::from_rgb(0xCC, 0x79, 0xA7),
    Color32::from_rgb(0xD5, 0x5E, 0x00),
];

/// Of the loop's latency: median, 99 of 100, worst.
pub(super) const LATENCY: [Color32; 3] = [
    Color32::from_rgb(0x56, 0xB4, 0xE9),
    Color32::from_rgb(0xBB, 0xBB, 0xBB),
    Color32::from_rgb(0xE6, 0x9F, 0x00),
];

/// While it is being recorded.
pub(super) const RECORDING: Color32 = Color32::from_rgb(0xC6, 0x28, 0x28);

/// Of a finger's lines and its name.
pub(super) fn finger(number: usize) -> Color32 {
    FINGERS[number % FINGERS.len()]
}
