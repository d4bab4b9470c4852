//! Pictures of heights by formula, and how they are written down.
//!
//! All are periodic: repeated, their right border meets their left one and their top their bottom without a step.

use std::f64::consts::TAU;

/// A share of white at a place of the picture, `[x, y]` from 0 to 1 from its lower left corner.
type Draw = fn([f64; 2]) -> f64;

/// Name and picture.
pub(crate) const KINDS: [(&str, Draw); 5] =
    [("bumps", bumps), ("dimples", dimples), ("ridges", ridges), ("weave", weave), ("pebbles", pebbles)];

/// An egg crate of one hill and one dale.
fn bumps([x, y]: [f64; 2]) -> f64 {
    0.5 + 0.5 * (TAU * x).sin() * (TAU * y).sin()
}

/// White with one round dent, as on a golf ball.
fn dimples([x, y]: [f64; 2]) -> f64 {
    const RADIUS: f64 = 0.4;
    let share = ((x - 0.5).hypot(y - 0.5) / RADIUS).min(1.0);
    0.5 - 0.5 * (0.5 * TAU * share).cos()
}

/// One wave across.
fn ridges([x, _]: [f64; 2]) -> f64 {
    0.5 + 0.5 * (TAU * x).sin()
}

/// Two threads over and two under.
fn weave([x, y]: [f64; 2]) -> f64 {
    let thread = |across: f64, along: f64| {
        let round = (0.5 * TAU * across * 2.0).sin().abs();
        let over = if (2.0 * across).floor() % 2.0 == 0.0 { 1.0 } else { -1.0 };
        round * (0.5 + 0.5 * over * (TAU * along).sin())
    };
    thread(x, y).max(thread(y, x + 0.5))
}

/// Waves of several lengths and directions.
fn pebbles([x, y]: [f64; 2]) -> f64 {
    const WAVES: [[f64; 4]; 6] = [
        [1.0, 2.0, 0.1, 1.0],
        [2.0, -1.0, 0.7, 1.0],
        [3.0, 1.0, 0.3, 0.7],
        [-1.0, 4.0, 0.9, 0.6],
        [4.0, 3.0, 0.2, 0.4],
        [5.0, -2.0, 0.6, 0.3],
    ];
    let sum: f64 = WAVES.iter().map(|[a, b, phase, size]| size * (TAU * (a * x + b * y + phase)).sin()).sum();
    0.5 + 0.5 * sum / WAVES.iter().map(|wave| wave[3]).sum::<f64>()
}

/// Bits of a texel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Depth {
    /// 256 heights.
    Eight,
    /// 65,536 heights.
    Sixteen,
}

/// Row by row from the top, a picture's values at the middles of its texels.
pub(crate) fn values(draw: Draw, side: usize) -> Vec<f64> {
    let middle = |i: usize| (i as f64 + 0.5) / side as f64;
    let row = |j: usize| (0..side).map(move |i| draw([middle(i), 1.0 - middle(j)]));
    (0..side).flat_map(row).collect()
}

/// The bytes of a greyscale PNG file.
pub(crate) fn png(draw: Draw, side: usize, depth: Depth) -> Vec<u8> {
    let values = values(draw, side);
    let (bits, pixels) = match depth {
        Depth::Eight => (png::BitDepth::Eight, values.iter().map(|w| (w * 255.0).round() as u8).collect()),
        Depth::Sixteen => {
            let texel = |w: &f64| ((w * 65535.0).round() as u16).to_be_bytes();
            (png::BitDepth::Sixteen, values.iter().flat_map(texel).collect::<Vec<u8>>())
        }
    };
    encoded([side, side], png::ColorType::Grayscale, bits, &pixels)
}

/// Pixels as a PNG file.
pub(crate) fn encoded(
    [width, height]: [usize; 2],
    colour: png::ColorType,
    depth: png::BitDepth,
    pixels: &[u8],
) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    encoder.set_compression(png::Compression::High);
    if colour == png::ColorType::Indexed {
        encoder.set_palette(vec![0, 0, 0, 255, 255, 255]);
    }
    let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(pixels));
    written.expect("memory takes everything");
    bytes
}
