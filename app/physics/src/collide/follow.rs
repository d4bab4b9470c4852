//! The direction in which two forms touched a tick ago, followed to where it is now.
//!
//! Model: a direction n is one in which the gap is locally largest if the difference w of the farthest points along it lies
//! along n. Where one of them looks there with a flat face, over which the other's farthest point is, the face's normal is
//! that direction. Elsewhere Newton's method finds it: in both tangential components of w where both forms are round, in
//! one where a straight edge, side or axis leaves n only the turn about itself, and where two such lines cross there is
//! nothing left to find.
//! Returns `None` wherever that is not so (a corner that has gone over an edge): then it must be searched for.
//! Cost: at most [`ROUNDS`] times three farthest points of each.

use nalgebra::Vector3;

use super::axis::unit;
use super::convex::Convex;
use super::facet::{Facet, Line};

/// Bound on Newton's method.
const ROUNDS: usize = 6;
/// A face whose normal is turned by less may be the one \[1 - cosine\].
const NEAR_FACE: f64 = 1e-4;
/// A line that is across n to this sine may be one that touches.
const NEAR_LINE: f64 = 1e-2;
/// Lines that are not parallel to this sine cross.
const CROSSING: f64 = 0.05;
/// Step of the difference quotients \[rad\].
const STEP: f64 = 1e-5;
/// w lies along n to this share of the forms' size.
const FOUND: f64 = 1e-11;

/// From the direction of the last tick to that of this one, and where on A's core they touch.
pub(super) fn follow(
    a: &Convex<'_>,
    b: &Convex<'_>,
    last: &Vector3<f64>,
) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let facets = [Facet::of(a, &-last), Facet::of(b, last)];
    let mut is_at_face = false;
    for (facet, other, sign) in [(facets[1], a, 1.0), (facets[0], b, -1.0)] {
        let Facet::Plate(plate) = facet else { continue };
        if plate.normal.dot(last) * sign < 1.0 - NEAR_FACE {
            continue;
        }
        is_at_face = true;
        let normal = plate.normal;
        let over = other.support(&-normal);
        if let Some(view) = plate.seen_along(&normal).filter(|view| view.covers(&over)) {
            return Some((normal * sign, if sign > 0.0 { over } else { view.onto(&over) }));
        }
    }
    if is_at_face {
        return None;
    }
    let line = |form: &Convex<'_>, toward: &Vector3<f64>| match Facet::edge_of(form, toward) {
        Facet::Line(line) => Some(line).filter(|line| along(line).dot(toward).abs() < NEAR_LINE),
        _ => None,
    };
    match (line(a, &-last), line(b, last)) {
        (None, None) => on_round(a, b, *last).map(|n| (n, a.support(&-n))),
        (Some(line), None) => {
            let n = about_line(a, b, *last, &along(&line))?;
            Some((n, place_on(&line, &b.support(&n))?))
        }
        (None, Some(line)) => {
            let n = about_line(a, b, *last, &along(&line))?;
            let on_a = a.support(&-n);
            place_on(&line, &on_a).map(|_| (n, on_a))
        }
        (Some(line), Some(other)) => {
            let across = along(&line).cross(&along(&other));
            if across.norm() < CROSSING {
                return None;
            }
            Some((unit(&(across * across.dot(last)))?, crossing(&line, &other)?))
        }
    }
}

/// The foot of a point on a line, if it is between the ends.
fn place_on(line: &Line, point: &Vector3<f64>) -> Option<Vector3<f64>> {
    let [start, end] = line.ends;
    let along = end - start;
    let place = (point - start).dot(&along) / along.norm_squared();
    (0.0..=1.0).contains(&place).then(|| start + along * place)
}

fn along(line: &Line) -> Vector3<f64> {
    unit(&(line.ends[1] - line.ends[0])).unwrap_or_else(Vector3::x)
}

/// Where on A's line it is nearest to B's, if that is between the ends of both.
fn crossing(a: &Line, b: &Line) -> Option<Vector3<f64>> {
    let (along_a, along_b) = (a.ends[1] - a.ends[0], b.ends[1] - b.ends[0]);
    let across = along_a.cross(&along_b);
    let from = b.ends[0] - a.ends[0];
    let squared = across.norm_squared();
    let places = [along_b, along_a].map(|along| from.cross(&along).dot(&across) / squared);
    let is_between = places.iter().all(|place| (0.0..=1.0).contains(place));
    is_between.then(|| a.ends[0] + along_a * places[0])
}

/// Difference of the farthest points.
fn difference(a: &Convex<'_>, b: &Convex<'_>, n: &Vector3<f64>) -> Vector3<f64> {
    a.support(&-n) - b.support(n)
}

/// Turned about a line that both keep touching along.
fn about_line(
    a: &Convex<'_>,
    b: &Convex<'_>,
    last: Vector3<f64>,
    line: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let mut n = unit(&(last - line * line.dot(&last)))?;
    let mut before = f64::INFINITY;
    for _ in 0..ROUNDS {
        let t = line.cross(&n);
        let w = difference(a, b, &n);
        let off = w.dot(&t);
        if off.abs() < FOUND {
            return Some(n);
        }
        if off.abs() > 0.5 * before {
            return None;
        }
        before = off.abs();
        let slope = (difference(a, b, &(n + t * STEP)) - w).dot(&t) / STEP - w.dot(&n);
        if slope.is_nan() || slope >= 0.0 {
            return None;
        }
        n = unit(&(n + t * (-off / slope).clamp(-0.2, 0.2)))?;
    }
    None
}

/// In both directions.
fn on_round(a: &Convex<'_>, b: &Convex<'_>, last: Vector3<f64>) -> Option<Vector3<f64>> {
    let mut n = last;
    let mut before = f64::INFINITY;
    for _ in 0..ROUNDS {
        let s = unit(&n.cross(&Vector3::ith(n.iamin(), 1.0)))?;
        let t = n.cross(&s);
        let w = difference(a, b, &n);
        let (off_s, off_t) = (w.dot(&s), w.dot(&t));
        let off = off_s.hypot(off_t);
        if off < FOUND {
            return Some(n);
        }
        if off > 0.5 * before {
            return None;
        }
        before = off;
        let along = w.dot(&n);
        let by_s = (difference(a, b, &(n + s * STEP)) - w) / STEP;
        let by_t = (difference(a, b, &(n + t * STEP)) - w) / STEP;
        let [ss, ts, st, tt] = [by_s.dot(&s) - along, by_s.dot(&t), by_t.dot(&s), by_t.dot(&t) - along];
        let determinant = ss * tt - st * ts;
        // A largest gap, not a saddle.
        if determinant.is_nan() || determinant <= 0.0 || ss >= 0.0 {
            return None;
        }
        let turn_s = (st * off_t - tt * off_s) / determinant;
        let turn_t = (ts * off_s - ss * off_t) / determinant;
        if turn_s.hypot(turn_t) > 0.2 {
            return None;
        }
        n = unit(&(n + s * turn_s + t * turn_t))?;
    }
    None
}
