//! The cells of a set of patches in a tree of boxes: what is near, and how near.
//!
//! Model: elements are halved until each is nearly flat. The box of a cell's control points holds its surface, since
//! weights are above zero; so boxes bound distances from below, whatever the degree.
//! Invariant: a ball or a path that touches no box touches no surface.
//! Cost: queries visit boxes nearest first, on a stack of constant size; no allocation.

use nalgebra::Vector3;

use super::bezier::{Control, Window, restrict};
use super::budget::Budget;
use super::descend::{Crossing, Rest};
use super::error::NurbsError;
use super::foot::Foot;
use super::{Nurbs, Patch};

/// A part of an element.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Cell {
    pub(super) patch: u32,
    /// Where it lies in the patch's parameters.
    pub(super) window: Window,
    /// Its own control points, homogeneous, from `origin_B`.
    pub(super) net: usize,
    pub(super) origin_B: Vector3<f64>,
    pub(super) bounds: Bounds,
    /// The normal in its middle.
    pub(super) axis_B: Vector3<f64>,
}

/// Opposite corners of a box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds {
    pub(super) low: Vector3<f64>,
    pub(super) high: Vector3<f64>,
}

/// A box and what is in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Node {
    pub(super) bounds: Bounds,
    pub(super) of: Of,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Of {
    /// Two nodes, the second of which is told.
    Nodes(u32),
    Cell(u32),
}

/// Deeper than the tree of as many cells as may be.
pub(super) const STACK: usize = 64;
/// A cell is flat enough whose control points keep this close to its corners' plane, as a share of its size.
const FLAT: f64 = 0.1;
const MAX_HALVINGS: usize = 5;

impl Bounds {
    fn of_net(net: &[Control], origin_B: &Vector3<f64>) -> Self {
        let point = |c: &Control| origin_B + Vector3::new(c[0], c[1], c[2]) / c[3];
        let first = point(&net[0]);
        let all = Self { low: first, high: first };
        let all = net.iter().map(point).fold(all, |b, p| Self { low: b.low.inf(&p), high: b.high.sup(&p) });
        // The last digit of a point in it may be another's.
        let slack = Vector3::repeat(4.0 * f64::EPSILON * all.low.amax().max(all.high.amax()));
        Self { low: all.low - slack, high: all.high + slack }
    }

    fn and(&self, other: &Self) -> Self {
        Self { low: self.low.inf(&other.low), high: self.high.sup(&other.high) }
    }

    /// Square of the distance, 0 inside.
    #[inline(always)]
    pub(super) fn distance_squared(&self, p: &Vector3<f64>) -> f64 {
        let beyond = (self.low - p).sup(&(p - self.high));
        (0..3).map(|c| beyond[c].max(0.0)).map(|x| x * x).sum()
    }

    /// Whether the segment comes within `slack` of it.
    #[inline]
    pub(super) fn is_met(&self, from: &Vector3<f64>, path: &Vector3<f64>, slack: f64) -> bool {
        let (mut first, mut last) = (0.0f64, 1.0f64);
        for c in 0..3 {
            let (low, high) = (self.low[c] - slack - from[c], self.high[c] + slack - from[c]);
            if path[c] == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return false;
                }
                continue;
            }
            let (a, b) = (low / path[c], high / path[c]);
            first = first.max(a.min(b));
            last = last.min(a.max(b));
        }
        // Quotients are rounded.
        first <= last + 1e-12
    }
}

/// All cells of the patches, and their tree. They are counted first: what would fill the memory is refused before.
pub(super) fn grow(nurbs: &mut Nurbs) -> Result<(), NurbsError> {
    let (mut count, mut controls, mut budget) = (0, 0, Budget::default());
    for (index, element) in elements(nurbs) {
        let size = net_size(&nurbs.patches[index]);
        each_cell(nurbs, index, element, |_, _| {
            (count, controls) = (count + 1, controls + size);
            budget.spend(size_of::<Cell>() + 2 * size_of::<Node>() + size_of::<u32>())?;
            budget.spend(size * size_of::<Control>())
        })?;
    }
    let mut cells = Vec::with_capacity(count);
    nurbs.controls.reserve_exact(controls);
    for (index, element) in elements(nurbs) {
        cut(nurbs, index, element, &mut cells)?;
    }
    let mut order: Vec<u32> = (0..cells.len() as u32).collect();
    let mut nodes = Vec::with_capacity(2 * cells.len());
    build(&mut nodes, &cells, &mut order);
    nurbs.cells = cells;
    nurbs.nodes = nodes;
    Ok(())
}

/// Patch and place of every element.
fn elements(nurbs: &Nurbs) -> Vec<(usize, [usize; 2])> {
    let spans = |patch: &Patch| [0, 1].map(|d| patch.breaks[d].len() - 1);
    let places = |[u, v]: [usize; 2]| (0..v).flat_map(move |j| (0..u).map(move |i| [i, j]));
    let patches = nurbs.patches.iter().enumerate();
    patches.flat_map(|(index, patch)| places(spans(patch)).map(move |place| (index, place))).collect()
}

/// Halves one element until its parts are flat, and hands out each with its control points.
fn each_cell(
    nurbs: &Nurbs,
    index: usize,
    [i, j]: [usize; 2],
    mut take: impl FnMut(Window, Vec<Control>) -> Result<(), NurbsError>,
) -> Result<(), NurbsError> {
    let patch = &nurbs.patches[index];
    let element = nurbs.elements[patch.first_element + i + j * (patch.breaks[0].len() - 1)];
    let whole = &nurbs.controls[element.net..element.net + net_size(patch)];
    let mut waiting = vec![([[0.0, 1.0], [0.0, 1.0]], 0)];
    while let Some((window, halvings)) = waiting.pop() {
        let mut net = whole.to_vec();
        restrict(&mut net, patch.degree, &window);
        let (bend, along) = bend(&net, patch.degree);
        if bend > FLAT && halvings < 2 * MAX_HALVINGS {
            waiting.extend(halves(&window, along).map(|half| (half, halvings + 1)));
        } else {
            take(window, net)?;
        }
    }
    Ok(())
}

/// The cells of one element.
fn cut(
    nurbs: &mut Nurbs,
    index: usize,
    place @ [i, j]: [usize; 2],
    cells: &mut Vec<Cell>,
) -> Result<(), NurbsError> {
    let mut flat = Vec::new();
    each_cell(nurbs, index, place, |window, net| {
        flat.push((window, net));
        Ok(())
    })?;
    let patch = &nurbs.patches[index];
    let element = nurbs.elements[patch.first_element + i + j * (patch.breaks[0].len() - 1)];
    let span = [[patch.breaks[0][i], patch.breaks[0][i + 1]], [patch.breaks[1][j], patch.breaks[1][j + 1]]];
    for (window, net) in flat {
        let of = |d: usize, x: f64| span[d][0] * (1.0 - x) + span[d][1] * x;
        let window = [0, 1].map(|d| window[d].map(|x| of(d, x)));
        let middle = window.map(|[a, b]| (a + b) / 2.0);
        let bounds = Bounds::of_net(&net, &element.origin_B);
        let axis_B = nurbs.foot(index as u32, middle, 1.0).normal_B;
        let first = nurbs.controls.len();
        nurbs.controls.extend(net);
        cells.push(Cell {
            patch: index as u32,
            window,
            net: first,
            origin_B: element.origin_B,
            bounds,
            axis_B,
        });
    }
    Ok(())
}

pub(super) fn net_size(patch: &Patch) -> usize {
    (patch.degree[0] + 1) * (patch.degree[1] + 1)
}

pub(super) fn halves(window: &Window, along: usize) -> [Window; 2] {
    let [low, high] = window[along];
    let middle = (low + high) / 2.0;
    let mut halves = [*window; 2];
    halves[0][along] = [low, middle];
    halves[1][along] = [middle, high];
    halves
}

/// How far rows and columns are from straight, as a share of the cell's size, and which bend more.
fn bend(net: &[Control], [p, q]: [usize; 2]) -> (f64, usize) {
    let point = |k: usize| Vector3::new(net[k][0], net[k][1], net[k][2]) / net[k][3];
    let size = (0..net.len()).map(|k| (point(k) - point(0)).norm()).fold(0.0, f64::max);
    let line = |first: usize, stride: usize, degree: usize| {
        let (a, b) = (point(first), point(first + stride * degree));
        let off = |k: usize| (point(first + stride * k) - a.lerp(&b, k as f64 / degree as f64)).norm();
        (1..degree).map(off).fold(0.0, f64::max)
    };
    let along_u = (0..=q).map(|j| line(j * (p + 1), 1, p)).fold(0.0, f64::max);
    let along_v = (0..=p).map(|i| line(i, p + 1, q)).fold(0.0, f64::max);
    // Two straight edges may be askew, which neither row nor column shows.
    let corners = [0, p, q * (p + 1), net.len() - 1].map(point);
    let twist = (corners[0] + corners[3] - corners[1] - corners[2]).norm() / 2.0;
    let most = along_u.max(along_v).max(twist);
    if size > 0.0 { (most / size, usize::from(along_v > along_u)) } else { (0.0, 0) }
}

fn build(nodes: &mut Vec<Node>, cells: &[Cell], order: &mut [u32]) -> u32 {
    let bounds_of = |k: &u32| cells[*k as usize].bounds;
    let bounds = order.iter().skip(1).fold(bounds_of(&order[0]), |all, k| all.and(&bounds_of(k)));
    let here = nodes.len() as u32;
    nodes.push(Node { bounds, of: Of::Cell(order[0]) });
    if order.len() > 1 {
        let axis = (bounds.high - bounds.low).imax();
        let middle = |k: &u32| bounds_of(k).low[axis] + bounds_of(k).high[axis];
        let half = order.len() / 2;
        order.select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)));
        let (left, right) = order.split_at_mut(half);
        build(nodes, cells, left);
        let second = build(nodes, cells, right);
        nodes[here as usize].of = Of::Nodes(second);
    }
    here
}

/// Nodes that wait, nearest last; the tree is balanced, so that they always fit.
pub(super) struct Waiting {
    nodes: [(f64, u32); STACK],
    count: usize,
}

impl Waiting {
    #[inline(always)]
    pub(super) fn new() -> Self {
        Self { nodes: [(0.0, 0); STACK], count: 0 }
    }

    #[inline(always)]
    pub(super) fn push(&mut self, key: f64, node: u32) {
        if self.count < STACK {
            self.nodes[self.count] = (key, node);
            self.count += 1;
        }
    }

    #[inline(always)]
    pub(super) fn pop(&mut self) -> Option<(f64, u32)> {
        self.count = self.count.checked_sub(1)?;
        Some(self.nodes[self.count])
    }
}

impl Nurbs {
    /// Visits cells, nearest boxes first; `visit` answers the square of the distance beyond which nothing matters.
    #[inline]
    fn visit_near(&self, p_B: &Vector3<f64>, at_most: f64, mut visit: impl FnMut(&Cell, f64, f64) -> f64) {
        let mut limit = at_most;
        let mut waiting = Waiting::new();
        waiting.push(self.nodes[0].bounds.distance_squared(p_B), 0);
        while let Some((square, index)) = waiting.pop() {
            if square >= limit {
                continue;
            }
            match self.nodes[index as usize].of {
                Of::Cell(cell) => limit = visit(&self.cells[cell as usize], square, limit),
                Of::Nodes(second) => {
                    let of = |index: u32| (self.nodes[index as usize].bounds.distance_squared(p_B), index);
                    let (a, b) = (of(index + 1), of(second));
                    let (near, far) = if a.0 <= b.0 { (a, b) } else { (b, a) };
                    waiting.push(far.0, far.1);
                    waiting.push(near.0, near.1);
                }
            }
        }
    }

    /// A lower bound of the distance to the surface (m); 0 where nothing better is known.
    pub(super) fn clearance(&self, p_B: &Vector3<f64>) -> f64 {
        let mut least = f64::INFINITY;
        self.visit_near(p_B, f64::INFINITY, |_, square, _| {
            least = least.min(square);
            least
        });
        if least.is_finite() { least.sqrt() * (1.0 - 1e-12) } else { 0.0 }
    }

    /// The nearest point of all, found by a descent in every cell that may hold it; `None` beyond `at_most_m`.
    pub(super) fn nearest_within(&self, p_B: &Vector3<f64>, at_most_m: f64) -> Option<(Foot, Rest)> {
        let mut best = None;
        let mut left = MAX_DESCENTS;
        self.visit_near(p_B, at_most_m * at_most_m, |cell, _, limit| {
            left -= 1;
            if left == 0 {
                return 0.0;
            }
            let middle = cell.window.map(|[a, b]| (a + b) / 2.0);
            let mut foot = self.foot(cell.patch, middle, 1.0);
            let rest = self.descend(p_B, &mut foot, Crossing::All);
            let square = (foot.point_B() - p_B).norm_squared();
            if square < limit {
                best = Some((foot, rest));
                return square;
            }
            limit
        });
        best
    }
}

/// Bound on the descents of one search: deep inside a ball all cells are equally near.
const MAX_DESCENTS: u32 = 4096;
