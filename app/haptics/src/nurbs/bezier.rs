//! Cuts patches into Bezier elements, one for each pair of knot spans, and works on their nets.
//!
//! Model: the control points of an element are values of the spline's polar form at repeated knots (blossoms), so any
//! knot vector will do, clamped or not. Nets are homogeneous, `(w x, w y, w z, w)`, with points taken from an origin of
//! the element's own: where an edge has shrunk to a point, the origin is that point, and derivatives that vanish there
//! keep all their digits on the way.
//! Invariant: neighbouring elements have the very same control points along their common edge.

use super::patch::{MAX_DEGREE, NurbsPatch};

/// A control point, `(w x, w y, w z, w)`.
pub(super) type Control = [f64; 4];
/// The most control points along one direction.
pub(super) const MAX_ORDER: usize = MAX_DEGREE + 1;
/// The most control points of an element.
pub(super) const MAX_NET: usize = MAX_ORDER * MAX_ORDER;

/// The elements of one patch: `nets[eu + ev * counts[0]]`, each with u running.
pub(super) struct Elements {
    pub(super) counts: [usize; 2],
    /// Where elements begin and end along u and v, and how smooth the spline is there: knots less multiplicity.
    pub(super) breaks: [Vec<Break>; 2],
    pub(super) nets: Vec<Vec<Control>>,
}

/// Where two elements meet.
#[derive(Debug, Clone, Copy)]
pub(super) struct Break {
    pub(super) at: f64,
    /// Whether the parametrisation may have a corner: the knot is as often there as the degree allows.
    pub(super) may_be_sharp: bool,
}

/// The elements of a patch that was checked.
pub(super) fn elements_of(patch: &NurbsPatch) -> Elements {
    let [p, q] = patch.degree;
    let [nu, nv] = patch.counts();
    let heaviest = patch.points.iter().map(|point| point[3]).fold(0.0, f64::max);
    let controls: Vec<Control> = patch
        .points
        .iter()
        .map(|&[x, y, z, w]| {
            let w = w / heaviest;
            [x * w, y * w, z * w, w]
        })
        .collect();
    let spans = [spans_of(&patch.knots[0], p), spans_of(&patch.knots[1], q)];
    let counts = [spans[0].len(), spans[1].len()];
    // Along u first: every row becomes a row of Bezier points, elements behind one another.
    let rows: Vec<Vec<Control>> =
        (0..nv).map(|j| cut(&controls[j * nu..(j + 1) * nu], &patch.knots[0], p, &spans[0])).collect();
    let width = counts[0] * p + 1;
    let columns: Vec<Vec<Control>> = (0..width)
        .map(|i| {
            let column: Vec<Control> = rows.iter().map(|row| row[i]).collect();
            cut(&column, &patch.knots[1], q, &spans[1])
        })
        .collect();
    let net = |eu: usize, ev: usize| {
        (0..=q)
            .flat_map(|j| (0..=p).map(move |i| (i, j)))
            .map(|(i, j)| columns[eu * p + i][ev * q + j])
            .collect()
    };
    Elements {
        counts,
        breaks: [breaks_of(&patch.knots[0], p, &spans[0]), breaks_of(&patch.knots[1], q, &spans[1])],
        nets: (0..counts[1])
            .flat_map(|ev| (0..counts[0]).map(move |eu| (eu, ev)))
            .map(|(eu, ev)| net(eu, ev))
            .collect(),
    }
}

/// Indices of the knots at which stretches of some length begin.
fn spans_of(knots: &[f64], degree: usize) -> Vec<usize> {
    (degree..knots.len() - degree - 1).filter(|&i| knots[i] < knots[i + 1]).collect()
}

fn breaks_of(knots: &[f64], degree: usize, spans: &[usize]) -> Vec<Break> {
    let end = knots[spans[spans.len() - 1] + 1];
    let ats = spans.iter().map(|&i| knots[i]).chain([end]);
    ats.map(|at| Break { at, may_be_sharp: knots.iter().filter(|&&knot| knot == at).count() >= degree })
        .collect()
}

/// Bezier points of a curve: `degree` per span and one at the end, neighbours sharing theirs.
fn cut(controls: &[Control], knots: &[f64], degree: usize, spans: &[usize]) -> Vec<Control> {
    let mut points = Vec::with_capacity(spans.len() * degree + 1);
    for &span in spans {
        let (from, to) = (knots[span], knots[span + 1]);
        for k in 0..degree {
            points.push(blossom(controls, knots, degree, span, from, to, k));
        }
    }
    let last = spans[spans.len() - 1];
    points.push(blossom(controls, knots, degree, last, knots[last], knots[last + 1], degree));
    points
}

/// The polar form of a span at `to` taken `k` times and `from` the rest: de Boor's scheme with an argument per level.
fn blossom(
    controls: &[Control],
    knots: &[f64],
    degree: usize,
    span: usize,
    from: f64,
    to: f64,
    k: usize,
) -> Control {
    let mut d = [[0.0; 4]; MAX_ORDER];
    d[..=degree].copy_from_slice(&controls[span - degree..=span]);
    for r in 1..=degree {
        let t = if r <= k { to } else { from };
        for j in (r..=degree).rev() {
            let (low, high) = (knots[j + span - degree], knots[j + 1 + span - r]);
            d[j] = lerp(&d[j - 1], &d[j], (t - low) / (high - low));
        }
    }
    d[degree]
}

#[inline(always)]
pub(super) fn lerp(a: &Control, b: &Control, t: f64) -> Control {
    // Exact at both ends.
    std::array::from_fn(|i| a[i] * (1.0 - t) + b[i] * t)
}

/// A stretch of each parameter, within 0 to 1: `[[u0, u1], [v0, v1]]`.
pub(super) type Window = [[f64; 2]; 2];

/// The net of the part of an element within `window`, in place.
pub(super) fn restrict(net: &mut [Control], [p, q]: [usize; 2], window: &Window) {
    for j in 0..=q {
        restrict_line(net, j * (p + 1), 1, p, window[0]);
    }
    for i in 0..=p {
        restrict_line(net, i, p + 1, q, window[1]);
    }
}

/// One row or column: what is beyond `to` is cut off, then what is before `from`.
#[inline]
fn restrict_line(net: &mut [Control], first: usize, stride: usize, degree: usize, [from, to]: [f64; 2]) {
    let at = |k: usize| first + k * stride;
    if to < 1.0 {
        for r in 1..=degree {
            for k in (r..=degree).rev() {
                net[at(k)] = lerp(&net[at(k - 1)], &net[at(k)], to);
            }
        }
    }
    if from > 0.0 {
        let share = from / to;
        for r in 1..=degree {
            for k in 0..=degree - r {
                net[at(k)] = lerp(&net[at(k)], &net[at(k + 1)], share);
            }
        }
    }
}
