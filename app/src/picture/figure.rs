//! Forces as figures.

use super::Together;
use super::recorded::{Recorded, RecordedBody, RecordedFinger};
use super::visit::Visit;
use nalgebra::Vector3;
use plot::{Axis, Chart, Figure, Look, Series};

/// So many steps across a picture are as fine as it shows: of each, the least and the most are drawn.
const STEPS: usize = 400;

/// What each finger felt, along the time.
pub(super) fn of_run(
    recorded: &Recorded,
    fingers: &[RecordedFinger],
    against: Option<(&Recorded, &[RecordedFinger])>,
) -> Figure {
    let panel = |finger: &RecordedFinger| {
        let chart =
            Chart::new(&finger.name, Axis::linear("time", "s"), Axis::linear("force on the user", "N"));
        let chart = with_components(chart, &recorded.times_s, &finger.forces, Look::Line, "");
        let Some((other, others)) = against else { return chart };
        match others.iter().find(|other| other.name == finger.name) {
            Some(finger) => {
                let label = format!(", {}", other.label());
                with_components(chart, &other.times_s, &finger.forces, Look::Dashed, &label)
            }
            None => chart,
        }
    };
    Figure::new("What the fingers felt", fingers.iter().map(panel).collect())
}

/// How far each entity that moves went and turned since the first row, along the time.
pub(super) fn of_objects(
    recorded: &Recorded,
    bodies: &[RecordedBody],
    against: Option<(&Recorded, &[RecordedBody])>,
) -> Figure {
    let panels = |body: &RecordedBody| {
        let chart =
            |quantity, unit| Chart::new(&body.name, Axis::linear("time", "s"), Axis::linear(quantity, unit));
        let mut panels = [chart("moved", "mm"), chart("turned", "deg")];
        panels = with_motion(panels, &recorded.times_s, body, Look::Line, "");
        let Some((other, others)) = against else { return panels };
        match others.iter().find(|other| other.name == body.name) {
            Some(body) => {
                let label = format!(", {}", other.label());
                with_motion(panels, &other.times_s, body, Look::Dashed, &label)
            }
            None => panels,
        }
    };
    Figure::new("How objects moved", bodies.iter().flat_map(panels).collect())
}

/// The same of all in one panel: along the axis of the world on which they moved most, or how far they turned.
pub(super) fn of_objects_together(recorded: &Recorded, bodies: &[RecordedBody], what: Together) -> Figure {
    let (quantity, unit, values) = match what {
        Together::Moved => {
            let ways_mm: Vec<_> = bodies.iter().map(way_mm).collect();
            let farthest =
                |axis: usize| ways_mm.iter().flatten().map(|way| way[axis].abs()).fold(0.0, f64::max);
            let axis = (0..3).max_by(|a, b| farthest(*a).total_cmp(&farthest(*b))).unwrap_or(0);
            let along = |way: &Vec<Vector3<f64>>| way.iter().map(|way_mm| way_mm[axis]).collect();
            let moved: Vec<Vec<f64>> = ways_mm.iter().map(along).collect();
            (format!("moved along {}", ["x", "y", "z"][axis]), "mm", moved)
        }
        Together::Turned => ("turned".into(), "deg", bodies.iter().map(angles_deg).collect()),
    };
    let chart = Chart::new("", Axis::linear("time", "s"), Axis::linear(&quantity, unit));
    let series = bodies.iter().zip(values).enumerate().map(|(index, (body, values))| {
        let points: Vec<_> = recorded.times_s.iter().copied().zip(values).collect();
        Series::new(&body.name, Look::Line, thinned(&points)).coloured(index)
    });
    Figure::new("How objects moved", vec![series.fold(chart, Chart::with)])
}

/// Ways since the first row.
fn way_mm(body: &RecordedBody) -> Vec<Vector3<f64>> {
    let first = body.positions.first().copied().unwrap_or_default();
    body.positions.iter().map(|at| (at - first) * 1e3).collect()
}

/// Angles to the first row's orientation.
fn angles_deg(body: &RecordedBody) -> Vec<f64> {
    let from = body.orientations.first().copied().unwrap_or_default();
    body.orientations.iter().map(|at| from.angle_to(at).to_degrees()).collect()
}

fn with_motion(
    [moved, turned]: [Chart; 2],
    times_s: &[f64],
    body: &RecordedBody,
    look: Look,
    suffix: &str,
) -> [Chart; 2] {
    let angles_deg: Vec<_> = times_s.iter().copied().zip(angles_deg(body)).collect();
    let label = if suffix.is_empty() { "" } else { &suffix[2..] };
    [
        with_components(moved, times_s, &way_mm(body), look, suffix),
        turned.with(Series::new(label, look, thinned(&angles_deg))),
    ]
}

/// What a finger felt on its way over an entity, and on the same way in another recording.
pub(super) fn of_entity(visit: &Visit, against: Option<(&str, &Visit)>) -> Figure {
    let chart =
        Chart::new("", Axis::linear("way of the finger", "mm"), Axis::linear("force on the user", "N"));
    let millimetres = |visit: &Visit| visit.way_m.iter().map(|way_m| way_m * 1e3).collect::<Vec<_>>();
    let chart = match against {
        Some((label, other)) => {
            with_components(chart, &millimetres(other), &other.forces, Look::Dashed, &format!(", {label}"))
        }
        None => chart,
    };
    let figure = |chart| Figure::new(&visit.entity, vec![chart]);
    figure(with_components(chart, &millimetres(visit), &visit.forces, Look::Line, ""))
}

/// Components that never differ from zero are left out.
fn with_components(chart: Chart, xs: &[f64], vectors: &[Vector3<f64>], look: Look, suffix: &str) -> Chart {
    ["x", "y", "z"].into_iter().enumerate().fold(chart, |chart, (axis, name)| {
        let felt: Vec<_> = xs.iter().zip(vectors).map(|(x, force)| (*x, force[axis])).collect();
        if felt.iter().all(|(_, force)| *force == 0.0) {
            return chart;
        }
        chart.with(Series::new(&format!("{name}{suffix}"), look, thinned(&felt)).coloured(axis))
    })
}

/// As few points as look the same.
fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return Vec::new() };
    if points.len() <= 2 * STEPS {
        return points.to_vec();
    }
    let width = (last.0 - first.0) / STEPS as f64;
    let step_of = |x: f64| ((x - first.0) / width) as usize;
    let mut thin = Vec::new();
    for step in points.chunk_by(|a, b| step_of(a.0) == step_of(b.0)) {
        let by_height = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let (least, most) = (step.iter().min_by(by_height), step.iter().max_by(by_height));
        let mut ends: Vec<_> = [least, most].into_iter().flatten().copied().collect();
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        ends.dedup();
        thin.extend(ends);
    }
    thin
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinned_points_keep_every_peak() {
        let peak = |i: usize| if i == 77_777 { 5.0 } else { (i as f64 * 1e-3).sin() };
        let points: Vec<_> = (0..100_000).map(|i| (i as f64, peak(i))).collect();
        let thin = thinned(&points);
        assert!(thin.len() <= 2 * (STEPS + 1), "{}", thin.len());
        assert!(thin.contains(&(77_777.0, 5.0)));
        assert!(thin.is_sorted_by(|a, b| a.0 <= b.0));
        assert_eq!(thinned(&points[..10]), points[..10]);
    }

    #[test]
    fn a_finger_that_does_not_move_is_drawn_too() {
        let points: Vec<_> = (0..10_000).map(|i| (0.0, f64::from(i))).collect();
        assert_eq!(thinned(&points), [(0.0, 0.0), (0.0, 9999.0)]);
    }
}
