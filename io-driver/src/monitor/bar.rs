//! Bars made of characters, an eighth of a cell fine.

use ratatui_core::style::{Color, Style, Stylize};
use ratatui_core::text::Span;
use rt_core::histogram::{BUCKETS, Histogram, bucket_lower, bucket_upper};

/// Left parts of a cell, in eighths.
const LEFT: [&str; 9] = [" ", "▏", "▎", "▍", "▌", "▋", "▊", "▉", "█"];
/// Lower parts of a cell, in eighths.
const LOWER: [char; 9] = [' ', '▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
/// Where a bar might be.
const EMPTY: &str = "·";

/// A value between `-full` and `full`, from the middle to the left or to the right; `2 half + 1` cells.
pub(super) fn signed(value: f64, full: f64, half: usize) -> Vec<Span<'static>> {
    let dim = Style::new().dark_gray();
    let share = value.abs() / full;
    if share.is_nan() {
        let marks = "?".repeat(half);
        return vec![Span::raw(format!("{marks}│{marks}")).red()];
    }
    // A saturating cast: no share is too large.
    let eighths = ((share * (8 * half) as f64).round() as usize).min(8 * half);
    let (whole, part) = (eighths / 8, eighths % 8);
    let rest = half - whole - usize::from(part > 0);
    let style = Style::new().fg(color_of(share));
    let (empty, blocks) = (Span::styled(EMPTY.repeat(rest), dim), Span::styled("█".repeat(whole), style));
    let other = Span::styled(EMPTY.repeat(half), dim);
    let middle = Span::raw("│");
    let is_part = part > 0;
    if value < 0.0 {
        // There are no right parts of a cell; the left rest of one with its colours exchanged is one.
        let part = is_part.then(|| Span::styled(LEFT[8 - part], style.reversed()));
        [Some(empty), part, Some(blocks), Some(middle), Some(other)].into_iter().flatten().collect()
    } else {
        let part = is_part.then(|| Span::styled(LEFT[part], style));
        [Some(other), Some(middle), Some(blocks), part, Some(empty)].into_iter().flatten().collect()
    }
}

/// A share between 0 and 1, from the left.
pub(super) fn share(value: f64, cells: usize) -> Vec<Span<'static>> {
    let eighths = ((value * (8 * cells) as f64).round() as usize).min(8 * cells);
    let (whole, part) = (eighths / 8, eighths % 8);
    let is_part = part > 0;
    let filled = "█".repeat(whole) + if is_part { LEFT[part] } else { "" };
    let empty = EMPTY.repeat(cells - whole - usize::from(is_part));
    vec![Span::raw(filled).cyan(), Span::raw(empty).dark_gray()]
}

/// The peak is what the driver cuts to.
fn color_of(share: f64) -> Color {
    match share {
        _ if share >= 0.99 => Color::Red,
        _ if share >= 0.8 => Color::Yellow,
        _ => Color::Cyan,
    }
}

/// Where [`histogram`] begins (ns).
const FROM_NS: f64 = 100.0;
/// The powers of ten it covers, up to 10 ms.
const DECADES: usize = 5;

/// How often which latency came, a cell each on a logarithmic axis from 0.1 us to 10 ms; what lies beyond is in the
/// outermost cells. Heights are logarithms of counts: one late tick in a million is one that somebody feels.
pub(super) fn histogram(histogram: &Histogram, cells: usize) -> String {
    let mut counts = vec![0_u64; cells];
    if cells > 0 {
        for (bucket, count) in histogram.counts().iter().enumerate() {
            let cell = &mut counts[cell_of(bucket, cells)];
            *cell = cell.saturating_add(*count);
        }
    }
    let most = counts.iter().copied().max().unwrap_or(0);
    let height = |count: u64| {
        let share = (1.0 + count as f64).ln() / (1.0 + most as f64).ln();
        if count == 0 { 0 } else { ((8.0 * share).ceil() as usize).clamp(1, 8) }
    };
    counts.into_iter().map(|count| LOWER[height(count)]).collect()
}

fn cell_of(bucket: usize, cells: usize) -> usize {
    let middle = match bucket {
        _ if bucket == BUCKETS - 1 => bucket_lower(bucket) as f64,
        _ => 0.5 * (bucket_lower(bucket) as f64 + bucket_upper(bucket) as f64),
    };
    let decades = (middle.max(FROM_NS) / FROM_NS).log10();
    ((decades / DECADES as f64 * cells as f64) as usize).min(cells - 1)
}

/// What stands above [`histogram`]: the powers of ten (us) where they are.
pub(super) fn axis(cells: usize) -> String {
    let mut text = vec![' '; cells];
    for (decade, label) in ["0.1", "1", "10", "100", "1000"].into_iter().enumerate() {
        for (offset, letter) in label.chars().enumerate() {
            if let Some(cell) = text.get_mut(decade * cells / DECADES + offset) {
                *cell = letter;
            }
        }
    }
    text.into_iter().collect()
}
