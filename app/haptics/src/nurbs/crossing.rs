//! Where a path first crosses the surface.
//!
//! Problem: a path crosses a curved patch not at all, once or often, may graze it, or run into a point where the patch
//! has shrunk; yet a finger that misses the first crossing is through the wall.
//!
//! Model: seen along the path, a cell is a flat net around the path's point. As long as that point lies within the
//! hull of the net the path may cross: then the cell is halved, until it is so even that Newton's method finds the
//! one crossing there is, or so small that it is the crossing (Nishita's Bezier clipping, with halves). Hulls are
//! taken a little too large, so that neighbouring cells leave no gap between them.
//!
//! Invariant: a path that crosses is found to cross, whatever the surface; the earliest crossing wins.
//! Cost: only cells whose boxes the path meets are looked at, with at most [`MAX_HALVINGS`] halvings; no allocation.

use nalgebra::Vector3;

use super::Nurbs;
use super::bezier::{Control, MAX_NET, Window, restrict};
use super::foot::Foot;
use super::tree::{Cell, Of, Waiting, halves, net_size};
use crate::mesh::Sides;

/// Where a path crosses.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crossed {
    /// With the side it is met from.
    pub(super) foot: Foot,
    /// How far along the path (m); a little below 0 where it begins on the surface.
    pub(super) along_m: f64,
}

/// A path and the frame it is seen in.
struct Path {
    from_B: Vector3<f64>,
    ahead: Vector3<f64>,
    length_m: f64,
    /// Along the surface as seen, and across it.
    aside: [Vector3<f64>; 2],
    slack_m: f64,
}

/// Bound on the halvings of all cells that one path is tried against.
pub(super) const MAX_HALVINGS: u32 = 2048;
/// More than halvings of a window can leave waiting: 2 x 52 halvings, one sibling each.
const WINDOWS: usize = 112;
/// A net whose points are this close to even, as a share of its size, has one crossing at most.
const EVEN: f64 = 0.2;

impl Nurbs {
    /// The first crossing of the segment that `counts`.
    pub(super) fn first_crossing(
        &self,
        from_B: &Vector3<f64>,
        to_B: &Vector3<f64>,
        counts: impl Fn(&Crossed) -> bool,
    ) -> Option<Crossed> {
        let path_B = to_B - from_B;
        let length_m = path_B.norm();
        if length_m == 0.0 || !length_m.is_finite() {
            return None;
        }
        let slack_m = self.slack_m;
        let ahead = path_B / length_m;
        let mut best: Option<Crossed> = None;
        let mut halvings = MAX_HALVINGS;
        let mut waiting = Waiting::new();
        waiting.push(0.0, 0);
        while let Some((_, index)) = waiting.pop() {
            let node = &self.nodes[index as usize];
            let end_B = best.as_ref().map_or(path_B, |best| ahead * (best.along_m.max(0.0) + slack_m));
            if !node.bounds.is_met(from_B, &end_B, slack_m) {
                continue;
            }
            match node.of {
                Of::Cell(cell) => {
                    let cell = &self.cells[cell as usize];
                    let aside = frame(&ahead, &cell.axis_B);
                    let path = Path { from_B: *from_B, ahead, length_m, aside, slack_m };
                    self.cross_cell(cell, &path, &mut best, &mut halvings, &counts);
                }
                Of::Nodes(second) => {
                    let key = |k: u32| self.nodes[k as usize].bounds.distance_squared(from_B);
                    let (first, second) =
                        if key(index + 1) <= key(second) { (index + 1, second) } else { (second, index + 1) };
                    waiting.push(0.0, second);
                    waiting.push(0.0, first);
                }
            }
        }
        best
    }

    fn cross_cell(
        &self,
        cell: &Cell,
        path: &Path,
        best: &mut Option<Crossed>,
        halvings: &mut u32,
        counts: &impl Fn(&Crossed) -> bool,
    ) {
        let patch = &self.patches[cell.patch as usize];
        let (degree, size) = (patch.degree, net_size(patch));
        let mut seen = [[0.0; 4]; MAX_NET];
        for (seen, control) in seen.iter_mut().zip(&self.controls[cell.net..cell.net + size]) {
            *seen = path.see(control, &cell.origin_B);
        }
        let mut waiting: [Window; WINDOWS] = [[[0.0, 1.0]; 2]; WINDOWS];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let window = waiting[count];
            let mut net = seen;
            let net = &mut net[..size];
            restrict(net, degree, &window);
            let end_m = best.as_ref().map_or(path.length_m, |best| best.along_m);
            if !path.may_meet(net, end_m) {
                continue;
            }
            match path.look(net, degree) {
                Look::Even(at) => match self.newton(cell, path, &window, at) {
                    Found::At(foot) => {
                        self.take(foot, path, best, counts);
                        continue;
                    }
                    Found::Beside => continue,
                    Found::Nothing => {}
                },
                Look::Point => {
                    let middle = window.map(|[a, b]| (a + b) / 2.0);
                    let foot = self.foot(cell.patch, cell.at(middle), 1.0);
                    self.take(foot, path, best, counts);
                    continue;
                }
                Look::Uneven if path.is_beside(net, degree) => continue,
                Look::Uneven => {}
            }
            if count + 2 > WINDOWS || *halvings == 0 {
                continue;
            }
            *halvings -= 1;
            let along = longer(net, degree);
            let [a, b] = halves(&window, along);
            let flip = starts_nearer(net, degree, along);
            (waiting[count], waiting[count + 1]) = if flip { (b, a) } else { (a, b) };
            count += 2;
        }
    }

    fn take(&self, foot: Foot, path: &Path, best: &mut Option<Crossed>, counts: &impl Fn(&Crossed) -> bool) {
        let along_m = path.ahead.dot(&(foot.point_B() - path.from_B));
        let is_on_it = along_m >= -path.slack_m && along_m <= path.length_m + path.slack_m;
        if !is_on_it || best.as_ref().is_some_and(|best| best.along_m <= along_m) {
            return;
        }
        // Grazing a solid counts as entering it: the contact that begins will find itself free.
        let is_front =
            path.ahead.dot(&foot.normal_B) <= if self.sides == Sides::Solid { GRAZING } else { 0.0 };
        let foot = if is_front { foot } else { Foot { side: -1.0, normal_B: -foot.normal_B, ..foot } };
        let crossed = Crossed { foot, along_m };
        if counts(&crossed) {
            *best = Some(crossed);
        }
    }

    /// The crossing in an even window, begun where an even net would have it.
    fn newton(&self, cell: &Cell, path: &Path, window: &Window, start: [f64; 2]) -> Found {
        let of = |d: usize, x: f64| window[d][0] * (1.0 - x) + window[d][1] * x;
        let wide: [f64; 2] =
            [0, 1].map(|d| (cell.window[d][1] - cell.window[d][0]) * (window[d][1] - window[d][0]));
        let low = cell.at([window[0][0], window[1][0]]);
        let mut at = cell.at([of(0, start[0].clamp(0.0, 1.0)), of(1, start[1].clamp(0.0, 1.0))]);
        let mut last_m = f64::INFINITY;
        for _ in 0..12 {
            let here = self.local(cell.patch, at);
            let off_B = here.point_B - path.from_B;
            let [x, y] = path.aside.map(|axis| axis.dot(&off_B));
            let size_m = x.abs().max(y.abs());
            if size_m <= 1e-16 * self.extent_m || (size_m <= 1e-14 * self.extent_m && size_m >= last_m) {
                let is_inside = (0..2).all(|d| {
                    let share = (at[d] - low[d]) / wide[d];
                    (-BESIDE..=1.0 + BESIDE).contains(&share)
                });
                let at = at.map(|x| x.clamp(0.0, 1.0));
                return if is_inside { Found::At(self.foot(cell.patch, at, 1.0)) } else { Found::Beside };
            }
            last_m = size_m;
            let ([xu, yu], [xv, yv]) =
                (path.aside.map(|axis| axis.dot(&here.du)), path.aside.map(|axis| axis.dot(&here.dv)));
            let det = xu * yv - xv * yu;
            let step = [(xv * y - yv * x) / det, (yu * x - xu * y) / det];
            if !(step[0].is_finite() && step[1].is_finite()) {
                return Found::Nothing;
            }
            // Off the window by more than its size there is nothing to be found.
            at = [0, 1]
                .map(|d| (at[d] + step[d]).clamp(low[d] - wide[d], low[d] + 2.0 * wide[d]).clamp(-0.1, 1.1));
        }
        Found::Nothing
    }
}

#[expect(
    clippy::large_enum_variant,
    reason = "lives on the stack for a moment; a box would allocate in a tick"
)]
enum Found {
    At(Foot),
    /// There is one, but in another window.
    Beside,
    Nothing,
}

enum Look {
    /// As even as a map; where in it the path's point is.
    Even([f64; 2]),
    /// So small that it is a point.
    Point,
    Uneven,
}

impl Cell {
    /// Patch parameters at a place of the cell, 0 to 1.
    fn at(&self, [s, t]: [f64; 2]) -> [f64; 2] {
        let of = |[a, b]: [f64; 2], x: f64| a * (1.0 - x) + b * x;
        [of(self.window[0], s), of(self.window[1], t)]
    }
}

impl Path {
    #[inline(always)]
    fn see(&self, control: &Control, origin_B: &Vector3<f64>) -> Control {
        let [x, y, z, w] = *control;
        let p = Vector3::new(x, y, z) + (origin_B - self.from_B) * w;
        [self.aside[0].dot(&p), self.aside[1].dot(&p), self.ahead.dot(&p), w]
    }

    /// Whether the box of the net, a little wider, holds a point of the path.
    fn may_meet(&self, net: &[Control], end_m: f64) -> bool {
        let mut reach = [false; 6];
        for &[x, y, z, w] in net {
            let slack = self.slack_m * w;
            reach[0] |= x <= slack;
            reach[1] |= x >= -slack;
            reach[2] |= y <= slack;
            reach[3] |= y >= -slack;
            reach[4] |= z <= end_m * w + slack;
            reach[5] |= z >= -slack;
        }
        reach == [true; 6]
    }

    /// Whether a line along one of its edges as seen separates the net from the path: a box around a sliver is wide.
    fn is_beside(&self, net: &[Control], [p, q]: [usize; 2]) -> bool {
        let point = |c: &Control| [c[0] / c[3], c[1] / c[3]];
        let [a, b, c, d] = [0, p, q * (p + 1), net.len() - 1].map(|k| point(&net[k]));
        [[a, b], [c, d], [a, c], [b, d]].iter().any(|[from, to]| {
            let across = [from[1] - to[1], to[0] - from[0]];
            let slack = 2.0 * self.slack_m * across[0].hypot(across[1]);
            let off = |[x, y]: [f64; 2]| across[0] * x + across[1] * y;
            let sides = net.iter().map(|control| off(point(control)));
            let (low, high) =
                sides.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
            low > slack || high < -slack
        })
    }

    fn look(&self, net: &[Control], [p, q]: [usize; 2]) -> Look {
        let point = |k: usize| [net[k][0] / net[k][3], net[k][1] / net[k][3]];
        let (a, b, c, d) = (point(0), point(p), point(q * (p + 1)), point(net.len() - 1));
        let along = |b: [f64; 2], a: [f64; 2], d: [f64; 2], c: [f64; 2]| {
            [(b[0] - a[0] + d[0] - c[0]) / 2.0, (b[1] - a[1] + d[1] - c[1]) / 2.0]
        };
        let (u, v) = (along(b, a, d, c), along(c, a, d, b));
        let middle = [(a[0] + b[0] + c[0] + d[0]) / 4.0, (a[1] + b[1] + c[1] + d[1]) / 4.0];
        let det = u[0] * v[1] - u[1] * v[0];
        let place = |p: [f64; 2]| {
            let o = [p[0] - middle[0], p[1] - middle[1]];
            [(o[0] * v[1] - o[1] * v[0]) / det + 0.5, (u[0] * o[1] - u[1] * o[0]) / det + 0.5]
        };
        let mut is_even = true;
        let mut is_point = true;
        for j in 0..=q {
            for i in 0..=p {
                let here = point(i + j * (p + 1));
                is_point &= (here[0] - a[0]).abs() <= self.slack_m && (here[1] - a[1]).abs() <= self.slack_m;
                let at = place(here);
                let off = [at[0] - i as f64 / p as f64, at[1] - j as f64 / q as f64];
                is_even &= off[0].abs() <= EVEN && off[1].abs() <= EVEN;
            }
        }
        if is_point {
            Look::Point
        } else if is_even {
            Look::Even(place([0.0, 0.0]))
        } else {
            Look::Uneven
        }
    }
}

/// Two directions across the path, the first across the surface as it is seen.
fn frame(ahead: &Vector3<f64>, axis_B: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let across = axis_B - ahead * axis_B.dot(ahead);
    let length = across.norm();
    let first = if length > 1e-3 {
        across / length
    } else {
        let other = Vector3::ith(ahead.iamin(), 1.0);
        (other - ahead * other.dot(ahead)).normalize()
    };
    [first, ahead.cross(&first)]
}

/// The direction along which the net is larger as seen; halving the other gains nothing.
fn longer(net: &[Control], [p, q]: [usize; 2]) -> usize {
    let point = |k: usize| Vector3::new(net[k][0], net[k][1], net[k][2]) / net[k][3];
    let length = |first: usize, stride: usize, degree: usize| {
        (0..degree).map(|k| (point(first + stride * (k + 1)) - point(first + stride * k)).norm()).sum::<f64>()
    };
    let along_u = (0..=q).map(|j| length(j * (p + 1), 1, p)).fold(0.0, f64::max);
    let along_v = (0..=p).map(|i| length(i, p + 1, q)).fold(0.0, f64::max);
    usize::from(along_v > along_u)
}

/// Whether the half where the parameter begins is nearer to where the path begins.
fn starts_nearer(net: &[Control], [p, q]: [usize; 2], along: usize) -> bool {
    let depth = |k: usize| net[k][2] / net[k][3];
    let corners = [0, p, q * (p + 1), net.len() - 1].map(depth);
    let (begin, end) = match along {
        0 => (corners[0] + corners[2], corners[1] + corners[3]),
        _ => (corners[0] + corners[1], corners[2] + corners[3]),
    };
    begin <= end
}

/// Share of a window by which a crossing may lie beside it and still count: rounding leaves it to neither else.
const BESIDE: f64 = 1e-6;
/// Sine of an angle to the surface that is rounding.
const GRAZING: f64 = 1e-9;
