//! Colours that people with any colour vision tell apart (after Okabe and Ito 2008), without the
//! yellow, which is hard to see on white.

/// Red, green, blue.
pub type Rgb = (u8, u8, u8);

/// Blue, vermilion, green, purple, sky, orange, black, olive.
pub const COLOURS: [Rgb; 8] = [
    (0, 114, 178),
    (213, 94, 0),
    (0, 158, 115),
    (170, 68, 153),
    (86, 180, 233),
    (230, 159, 0),
    (40, 40, 40),
    (140, 130, 30),
];

/// Text and axes.
pub(crate) const INK: Rgb = (40, 40, 40);
/// Secondary text.
pub(crate) const PENCIL: Rgb = (100, 100, 100);
/// Lines at the marks.
pub(crate) const GRID: Rgb = (205, 205, 205);
/// Lines between the marks.
pub(crate) const FINE_GRID: Rgb = (236, 236, 236);

/// The colour of series `index`; beyond the palette they begin again.
#[must_use]
pub fn colour(index: usize) -> Rgb {
    COLOURS[index % COLOURS.len()]
}
