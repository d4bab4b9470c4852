//! The devices: two rows each, where it is and what it pushes.

use crate::monitor::bar;
use crate::monitor::look::Look;
use crate::monitor::number::signed;
use crate::monitor::state::Monitor;
use crate::status::DeviceStatus;
use ratatui_core::style::Stylize;
use ratatui_core::text::{Line, Span};
use rt_core::plain_text::Plain;

/// Rows of a device.
const ROWS: usize = 2;
/// Longer names are cut.
const LONGEST_NAME: usize = 12;
/// Names stand out to the left.
const INDENT: &str = "  ";
/// The longest bar is twice that and a cell.
const LONGEST_HALF: usize = 16;

/// Two rows for each device.
pub(super) fn lines(monitor: &Monitor, look: &Look, width: usize) -> Vec<Line<'static>> {
    let devices = &look.status.devices;
    let longest = devices.iter().map(|device| device.name.chars().count()).max().unwrap_or(0);
    let name_width = longest.min(LONGEST_NAME);
    let largest = monitor.largest_force_n.iter().copied().chain(std::iter::repeat(0.0));
    let rows = devices
        .iter()
        .zip(largest)
        .map(|(device, largest)| [place(device, name_width), force(device, largest, width)]);
    rows.flatten().collect()
}

/// Leaves as many whole devices as fit, and returns how many it took away. Where not all fit, a row is left for saying
/// so.
pub(super) fn cut_to(lines: &mut Vec<Line<'static>>, height: usize) -> usize {
    let all = lines.len() / ROWS;
    if lines.len() > height {
        lines.truncate(height.saturating_sub(1) / ROWS * ROWS);
    }
    all - lines.len() / ROWS
}

/// Name, what is wrong with the position, position, buttons, limits, warmth, kind: what matters most is cut last.
fn place(device: &DeviceStatus, name_width: usize) -> Line<'static> {
    let name: String = Plain(&device.name).to_string().chars().take(name_width).collect();
    let mut line = Line::from(Span::raw(format!("{name:<name_width$} ")).bold());
    if device.zero_needed {
        line.push_span(Span::raw("not zeroed ").red());
    } else if !device.position_valid {
        line.push_span(Span::raw("not valid ").red());
    }
    let [x, y, z] = device.position_m.map(|m| signed(m, 8, 4));
    line.push_span(format!("{x} {y} {z} m"));
    line.push_span(format!("{INDENT}buttons {}", buttons(device.buttons)));
    if !device.limits.is_empty() {
        line.push_span(Span::raw(format!("{INDENT}limit: {}", device.limits.join(", "))).yellow());
    }
    if device.motor_heat != 0.0 {
        line.push_span(format!("{INDENT}warm {:.0} %", 100.0 * device.motor_heat));
    }
    line.push_span(Span::raw(format!("{INDENT}{}", device.kind)).dark_gray());
    line
}

/// The numbers of those that are pressed.
fn buttons(pressed: u64) -> String {
    let numbers: Vec<String> =
        (0..u64::BITS).filter(|bit| pressed >> bit & 1 != 0).map(|bit| bit.to_string()).collect();
    if numbers.is_empty() { "-".into() } else { numbers.join(",") }
}

/// A bar and a number for each axis.
fn force(device: &DeviceStatus, largest_seen_n: f64, width: usize) -> Line<'static> {
    let (full, scale) = match device.peak_force_n {
        Some(peak) => (peak, format!(" N of {peak}")),
        None => (largest_seen_n, format!(" N of {largest_seen_n:.1} seen")),
    };
    // Without any force so far, the bars are empty.
    let full = if full > 0.0 { full } else { f64::MIN_POSITIVE };
    // "x", the bar's middle, the number and a gap; what is left is shared by six halves.
    const FIXED: usize = 1 + 1 + 6 + 1;
    let is_wide = width >= 60;
    let beside = if is_wide { INDENT.len() + scale.len() } else { 0 };
    let half = (width.saturating_sub(beside + 3 * FIXED) / 6).min(LONGEST_HALF);
    let mut line = Line::raw(if is_wide { INDENT } else { "" });
    for (axis, newtons) in ["x", "y", "z"].into_iter().zip(device.force_on_user_n_applied) {
        line.push_span(axis);
        line.extend(bar::signed(newtons, full, half));
        line.push_span(signed(newtons, 6, 2));
        if axis != "z" {
            line.push_span(" ");
        }
    }
    line.push_span(if is_wide { Span::raw(scale) } else { Span::raw(" N") });
    line
}
