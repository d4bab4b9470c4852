//! Which patches meet where: edges in common, points that edges have shrunk to, and where the surface ends.
//!
//! Problem: files give patches one by one. What lies beyond an edge, the geometry has to tell.
//!
//! Model: two edges meet if one runs along the other (or along a part of it) within [`EQUAL`] of the whole set's extent.
//! An edge all of whose points agree is a pole; all poles at one place are one. Where normals agree within
//! [`SMOOTH_RAD`] along an edge, it is a seam that nobody feels, else a crease.
//! Edges of a patch: 0 is u = 0, 1 is u = 1, 2 is v = 0, 3 is v = 1; the other parameter runs along it.

use std::collections::HashMap;

use nalgebra::Vector3;

use super::Nurbs;
use super::edge_boxes::{Box3, EdgeBoxes};
use super::error::NurbsError;
use super::foot::Foot;

/// What a patch has along an edge.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Edge {
    pub(super) pole: Option<u32>,
    /// In no order; they do not overlap.
    pub(super) links: Vec<Link>,
}

/// A stretch of an edge and what it meets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Link {
    /// From where to where along this edge, rising.
    pub(super) along: [f64; 2],
    pub(super) patch: u32,
    pub(super) edge: u8,
    /// The parameters there that belong to the ends of `along`.
    pub(super) to: [f64; 2],
    pub(super) is_smooth: bool,
    /// Crossed, the other side is felt: sets that have no inside, such as a Klein bottle.
    pub(super) is_twisted: bool,
}

/// A point that edges have shrunk to.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Pole {
    /// Patches and their edges.
    pub(super) edges: Vec<(u32, u8)>,
    /// Patches that come to it with a corner alone, and its parameters there.
    pub(super) corners: Vec<(u32, [f64; 2])>,
    pub(super) point_B: Vector3<f64>,
    /// The tip of a cone, not the pole of a ball.
    pub(super) is_sharp: bool,
    /// Mean of the normals around it.
    pub(super) normal_B: Vector3<f64>,
}

/// What a descent finds at an edge.
#[expect(
    clippy::large_enum_variant,
    reason = "lives on the stack for a moment; a box would allocate in a tick"
)]
pub(super) enum Border {
    Rim,
    Patch { foot: Foot, edge: u8, is_smooth: bool, leads_down: bool },
    Pole(u32),
}

/// As a share of the extent: points closer than this are the same.
pub(super) const EQUAL: f64 = 1e-6;
/// What was written down twice and read back agrees so well.
const EXACT: f64 = 1e-11;
/// Normals that differ by less are not told apart by a finger.
pub const SMOOTH_RAD: f64 = 0.01;

/// Parameters at `x` along `edge`.
pub(super) fn on_edge(edge: u8, x: f64) -> [f64; 2] {
    match edge {
        0 => [0.0, x],
        1 => [1.0, x],
        2 => [x, 0.0],
        _ => [x, 1.0],
    }
}

/// Which parameter runs along an edge.
pub(super) fn running(edge: u8) -> usize {
    usize::from(edge < 2)
}

impl Nurbs {
    /// What lies beyond an edge on which `foot` stands, and whether going there leads down towards `offset_B`.
    pub(super) fn beyond(&self, foot: &Foot, edge: usize, offset_B: &Vector3<f64>) -> Border {
        let edge_here = &self.patches[foot.patch as usize].edges[edge];
        if let Some(pole) = edge_here.pole {
            return Border::Pole(pole);
        }
        let x = foot.at[running(edge as u8)];
        let Some(link) = edge_here.links.iter().find(|link| link.along[0] <= x && x <= link.along[1]) else {
            return Border::Rim;
        };
        let there = self.across(foot, link, x);
        let inward = self.inward(&there, link.edge);
        let leads_down = offset_B.dot(&inward) > 0.0;
        Border::Patch { foot: there, edge: link.edge, is_smooth: link.is_smooth, leads_down }
    }

    pub(super) fn across(&self, foot: &Foot, link: &Link, x: f64) -> Foot {
        let share = (x - link.along[0]) / (link.along[1] - link.along[0]);
        let mut y = (link.to[0] + share * (link.to[1] - link.to[0])).clamp(0.0, 1.0);
        let side = if link.is_twisted { -foot.side } else { foot.side };
        let mut there = self.foot(link.patch, on_edge(link.edge, y), side);
        // Edges that run along each other need not do so at the same pace.
        let d = running(link.edge);
        for _ in 0..3 {
            let along = if d == 0 { there.local.du } else { there.local.dv };
            let off_B = foot.point_B() - there.point_B();
            let step = off_B.dot(&along) / along.norm_squared();
            if step.is_nan() || off_B.norm() <= 1e-14 * self.extent_m || step.abs() < 1e-15 {
                break;
            }
            y = (y + step).clamp(0.0, 1.0);
            there = self.foot(link.patch, on_edge(link.edge, y), side);
        }
        there
    }

    /// Along the surface into the patch, across the edge.
    pub(super) fn inward(&self, foot: &Foot, edge: u8) -> Vector3<f64> {
        let (across, along) = match running(edge) {
            1 => (foot.local.du, foot.local.dv),
            _ => (foot.local.dv, foot.local.du),
        };
        let across = if edge.is_multiple_of(2) { across } else { -across };
        let square = along.norm_squared();
        if square > 0.0 { across - along * (across.dot(&along) / square) } else { across }
    }

    /// The pole that a foot stands at with a corner of its patch.
    pub(super) fn pole_at_corner(&self, foot: &Foot) -> Option<u32> {
        let corner = CORNERS.iter().position(|corner| *corner == foot.at)?;
        self.patches[foot.patch as usize].corner_poles[corner]
    }

    /// Away from a pole in the direction that leads nearest to the target; `None` if all lead away from it.
    #[cold]
    pub(super) fn over_pole(&self, foot: &Foot, pole: u32, offset_B: &Vector3<f64>) -> Option<Foot> {
        let mut best: Option<Way> = None;
        let mut consider = |way: Way| {
            if way.gain > best.as_ref().map_or(0.0, |best| best.gain) {
                best = Some(way);
            }
        };
        let Pole { edges, corners, .. } = &self.poles[pole as usize];
        for &(patch, edge) in edges {
            for k in 0..=4 {
                let there = self.foot(patch, on_edge(edge, f64::from(k) / 4.0), foot.side);
                let into = inward_of([0.0, 1.0][usize::from(edge % 2)]);
                let along = if running(edge) == 0 { [0.0, into] } else { [into, 0.0] };
                consider(Way::new(&there, along, &self.inward(&there, edge), offset_B));
            }
        }
        for &(patch, at) in corners {
            let there = self.foot(patch, at, foot.side);
            let into = at.map(inward_of);
            let [u, v] = [there.local.du * into[0], there.local.dv * into[1]];
            let share = u.norm() / v.norm();
            for (a, b) in [(1.0, 0.0), (0.0, 1.0), (1.0, share)] {
                consider(Way::new(&there, [into[0] * a, into[1] * b], &(u * a + v * b), offset_B));
            }
        }
        let Way { gain, patch, from, along, mut step } = best?;
        if gain <= 1e-15 * self.extent_m {
            return None;
        }
        let square = offset_B.norm_squared();
        for _ in 0..30 {
            let at = [0, 1].map(|d| (from[d] + along[d] * step).clamp(0.0, 1.0));
            let next = self.foot(patch, at, foot.side);
            if (foot.point_B() + offset_B - next.point_B()).norm_squared() < square {
                return Some(next);
            }
            step *= 0.5;
        }
        None
    }
}

/// Parameters at the corners of a patch.
pub(super) const CORNERS: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];

/// Which way leads from a border of a patch into it.
fn inward_of(x: f64) -> f64 {
    if x < 0.5 { 1.0 } else { -1.0 }
}

/// A way that leads from a pole into a patch.
struct Way {
    /// How much nearer it leads to the target, for each metre of it.
    gain: f64,
    patch: u32,
    from: [f64; 2],
    along: [f64; 2],
    /// How far along, in parameters: to the place nearest to the target, were the patch flat.
    step: f64,
}

impl Way {
    fn new(from: &Foot, along: [f64; 2], per_step_B: &Vector3<f64>, offset_B: &Vector3<f64>) -> Self {
        let length = per_step_B.norm();
        let gain = offset_B.dot(per_step_B) / length;
        Self { gain, patch: from.patch, from: from.at, along, step: (gain / length).min(0.25) }
    }
}

/// Finds poles and links, and turns patches so that neighbours agree about the outside.
pub(super) fn join(nurbs: &mut Nurbs) -> Result<Joined, NurbsError> {
    find_poles(nurbs);
    let edges: Vec<(u32, u8)> = (0..nurbs.patches.len() as u32)
        .flat_map(|patch| (0..4).map(move |edge| (patch, edge)))
        .filter(|&edge| edge_of(nurbs, edge).pole.is_none())
        .collect();
    let boxes: Vec<_> = edges.iter().map(|&edge| box_of(nurbs, edge)).collect();
    // Edges that agree to rounding first: in a thin plate others may be nearly as near.
    let boxes = EdgeBoxes::new(&boxes);
    for slack in [EXACT, EQUAL].map(|share| share * nurbs.extent_m) {
        for i in 0..edges.len() {
            for j in boxes.later_near(i, slack) {
                let is_new = |k: usize| slack < EQUAL * nurbs.extent_m || !is_covered(nurbs, edges[k]);
                if is_new(i) && is_new(j) {
                    link(nurbs, edges[i], edges[j], slack)?;
                }
            }
        }
    }
    Ok(orient(nurbs))
}

fn edge_of(nurbs: &Nurbs, (patch, edge): (u32, u8)) -> &Edge {
    &nurbs.patches[patch as usize].edges[usize::from(edge)]
}

fn is_covered(nurbs: &Nurbs, edge: (u32, u8)) -> bool {
    edge_of(nurbs, edge).links.iter().map(|link| link.along[1] - link.along[0]).sum::<f64>() > 1.0 - 1e-4
}

/// Links two edges if one runs along the other.
fn link(nurbs: &mut Nurbs, a: (u32, u8), b: (u32, u8), slack: f64) -> Result<(), NurbsError> {
    let met = runs_along(nurbs, a, b, slack)
        .map(|to| (a, b, to))
        .or_else(|| runs_along(nurbs, b, a, slack).map(|to| (b, a, to)));
    let Some((part, whole, to)) = met else { return Ok(()) };
    let back = if to[0] <= to[1] { [0.0, 1.0] } else { [1.0, 0.0] };
    add(nurbs, part, [0.0, 1.0], whole, to)?;
    add(nurbs, whole, [to[0].min(to[1]), to[0].max(to[1])], part, back)
}

/// What joining found.
pub(super) struct Joined {
    /// Of each patch, which connected component it belongs to.
    pub(super) component: Vec<usize>,
    pub(super) is_closed: bool,
    pub(super) is_orientable: bool,
}

fn add(
    nurbs: &mut Nurbs,
    (patch, edge): (u32, u8),
    along: [f64; 2],
    (other, other_edge): (u32, u8),
    to: [f64; 2],
) -> Result<(), NurbsError> {
    let here = &nurbs.patches[patch as usize].edges[usize::from(edge)];
    let overlap = |link: &&Link| link.along[1].min(along[1]) - link.along[0].max(along[0]) > 1e-3;
    if let Some(taken) = here.links.iter().find(overlap) {
        let middle = nurbs.local(patch, on_edge(edge, (along[0] + along[1]) / 2.0)).point_B;
        let source = |patch: u32| nurbs.patches[patch as usize].source;
        return Err(NurbsError::TooManyAtEdge {
            patches: [source(patch), source(taken.patch), source(other)],
            point_B: middle.into(),
        });
    }
    let link = Link { along, patch: other, edge: other_edge, to, is_smooth: true, is_twisted: false };
    nurbs.patches[patch as usize].edges[usize::from(edge)].links.push(link);
    Ok(())
}

fn samples(nurbs: &Nurbs, (patch, edge): (u32, u8)) -> impl Iterator<Item = Vector3<f64>> + '_ {
    (0..=16).map(move |k| nurbs.local(patch, on_edge(edge, f64::from(k) / 16.0)).point_B)
}

fn box_of(nurbs: &Nurbs, edge: (u32, u8)) -> Box3 {
    let first = nurbs.local(edge.0, on_edge(edge.1, 0.0)).point_B;
    samples(nurbs, edge).fold([first; 2], |[low, high], p| [low.inf(&p), high.sup(&p)])
}

fn find_poles(nurbs: &mut Nurbs) {
    let slack = EQUAL * 1e-3 * nurbs.extent_m;
    let reach = EQUAL * nurbs.extent_m;
    // Of cells as wide as poles may be apart, so that not each is compared with each.
    let mut by_cell: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
    let cell = |point_B: &Vector3<f64>| <[i64; 3]>::from(point_B.map(|x| (x / reach).floor() as i64));
    let near = |by_cell: &HashMap<[i64; 3], Vec<usize>>, point_B: &Vector3<f64>| {
        let at = cell(point_B);
        let beside = |i: i64| [i / 9, i / 3 % 3, i % 3].map(|of_three| of_three - 1);
        let cells = (0..27).map(|i| std::array::from_fn(|k| at[k].saturating_add(beside(i)[k])));
        cells.filter_map(|cell| by_cell.get(&cell)).flatten().copied().collect::<Vec<_>>().into_iter()
    };
    for patch in 0..nurbs.patches.len() as u32 {
        for edge in 0..4u8 {
            let [low, high] = box_of(nurbs, (patch, edge));
            if (high - low).amax() > slack {
                continue;
            }
            let is_here = |pole: &usize| (nurbs.poles[*pole].point_B - low).amax() <= reach;
            let known = near(&by_cell, &low).filter(is_here).min();
            let pole = known.unwrap_or(nurbs.poles.len());
            if known.is_none() {
                let (edges, corners, normal_B) = (Vec::new(), Vec::new(), Vector3::y());
                nurbs.poles.push(Pole { edges, corners, point_B: low, is_sharp: false, normal_B });
                by_cell.entry(cell(&low)).or_default().push(pole);
            }
            nurbs.poles[pole].edges.push((patch, edge));
            nurbs.patches[patch as usize].edges[usize::from(edge)].pole = Some(pole as u32);
        }
    }
    for patch in 0..nurbs.patches.len() as u32 {
        for (number, corner) in CORNERS.into_iter().enumerate() {
            let edges = &nurbs.patches[patch as usize].edges;
            let at_corner = [0, 1].map(|d| 2 * d + usize::from(corner[d] == 1.0));
            if at_corner.iter().any(|&edge| edges[edge].pole.is_some()) {
                continue;
            }
            let point_B = nurbs.local(patch, corner).point_B;
            let is_here = |pole: &usize| (nurbs.poles[*pole].point_B - point_B).amax() <= reach;
            if let Some(pole) = near(&by_cell, &point_B).filter(is_here).min() {
                nurbs.poles[pole].corners.push((patch, corner));
                nurbs.patches[patch as usize].corner_poles[number] = Some(pole as u32);
            }
        }
    }
}

/// If `part` runs along `whole` from end to end: the parameters of its ends there.
fn runs_along(nurbs: &Nurbs, part: (u32, u8), whole: (u32, u8), slack: f64) -> Option<[f64; 2]> {
    let end = |edge: (u32, u8), x: f64| nurbs.local(edge.0, on_edge(edge.1, x)).point_B;
    let is_same = |a: Vector3<f64>, b: Vector3<f64>| (a - b).norm() <= slack;
    let ends = [end(part, 0.0), end(part, 1.0)];
    let follows = |to: [f64; 2]| {
        let (low, high) = (to[0].min(to[1]) - 1e-6, to[0].max(to[1]) + 1e-6);
        let inner: Vec<_> = samples(nurbs, part).skip(1).take(15).collect();
        inner.iter().enumerate().all(|(k, point)| {
            let guess = to[0] + (to[1] - to[0]) * (k as f64 + 1.0) / 16.0;
            let x = nearest_on_edge(nurbs, whole, point, guess);
            low <= x && x <= high && is_same(end(whole, x), *point)
        })
    };
    // Whole edges first: of closed ones both ends are the same point.
    for to in [[0.0, 1.0], [1.0, 0.0]] {
        let meet = is_same(ends[0], end(whole, to[0])) && is_same(ends[1], end(whole, to[1]));
        if meet && follows(to) {
            return Some(to);
        }
    }
    let to = ends.map(|point| {
        let nearest = |x: &f64| (end(whole, *x) - point).norm();
        let guess = (0..=32).map(|k| f64::from(k) / 32.0).min_by(|a, b| nearest(a).total_cmp(&nearest(b)));
        let x = nearest_on_edge(nurbs, whole, &point, guess.unwrap_or(0.0));
        is_same(end(whole, x), point).then_some(x)
    });
    let to = [to[0]?, to[1]?];
    ((to[0] - to[1]).abs() > 1e-4 && follows(to)).then_some(to)
}

fn nearest_on_edge(nurbs: &Nurbs, edge: (u32, u8), point: &Vector3<f64>, guess: f64) -> f64 {
    let mut x = guess;
    for _ in 0..20 {
        let here = nurbs.local(edge.0, on_edge(edge.1, x));
        let along = if running(edge.1) == 0 { here.du } else { here.dv };
        let step = (point - here.point_B).dot(&along) / along.norm_squared();
        if step.is_nan() {
            break;
        }
        let next = (x + step.clamp(-0.1, 0.1)).clamp(0.0, 1.0);
        if (next - x).abs() < 1e-15 {
            break;
        }
        x = next;
    }
    x
}

/// Counter-clockwise around the patch, its edge's parameter rises (1) or falls (-1).
fn sense(edge: u8) -> f64 {
    if edge == 1 || edge == 2 { 1.0 } else { -1.0 }
}

/// Turns patches so that neighbours agree, marks what cannot agree, and tells seams from creases.
fn orient(nurbs: &mut Nurbs) -> Joined {
    let count = nurbs.patches.len();
    let mut component = vec![usize::MAX; count];
    let (mut is_orientable, mut is_closed, mut components) = (true, true, 0);
    for first in 0..count {
        if component[first] != usize::MAX {
            continue;
        }
        component[first] = components;
        let mut waiting = vec![first];
        while let Some(patch) = waiting.pop() {
            let is_turned = nurbs.patches[patch].is_turned;
            for edge in 0..4u8 {
                for link in nurbs.patches[patch].edges[usize::from(edge)].links.clone() {
                    let agrees = sense(edge) * sense(link.edge) * (link.to[1] - link.to[0]) < 0.0;
                    let other = link.patch as usize;
                    if component[other] == usize::MAX {
                        component[other] = components;
                        nurbs.patches[other].is_turned = is_turned == agrees;
                        waiting.push(other);
                    }
                }
            }
        }
        components += 1;
    }
    for patch in 0..count {
        for edge in 0..4u8 {
            let here = &nurbs.patches[patch].edges[usize::from(edge)];
            is_closed &= here.pole.is_some() || is_covered(nurbs, (patch as u32, edge));
            for l in 0..here.links.len() {
                let link = nurbs.patches[patch].edges[usize::from(edge)].links[l];
                let agrees = sense(edge) * sense(link.edge) * (link.to[1] - link.to[0]) < 0.0;
                let same = nurbs.patches[patch].is_turned == nurbs.patches[link.patch as usize].is_turned;
                let is_twisted = agrees != same;
                is_orientable &= !is_twisted;
                let link = Link { is_twisted, ..link };
                let is_smooth = is_smooth(nurbs, patch as u32, edge, &link);
                nurbs.patches[patch].edges[usize::from(edge)].links[l] = Link { is_smooth, ..link };
            }
        }
    }
    Joined { component, is_closed, is_orientable }
}

fn is_smooth(nurbs: &Nurbs, patch: u32, edge: u8, link: &Link) -> bool {
    [0.05, 0.25, 0.5, 0.75, 0.95].iter().all(|share| {
        let x = link.along[0] + share * (link.along[1] - link.along[0]);
        let here = nurbs.foot(patch, on_edge(edge, x), 1.0);
        let there = nurbs.across(&here, link, x);
        here.normal_B.dot(&there.normal_B) > SMOOTH_RAD.cos()
    })
}

/// What normals do around each pole; once patches are turned for good.
pub(super) fn shape_poles(nurbs: &mut Nurbs) {
    for pole in 0..nurbs.poles.len() {
        let normals: Vec<Vector3<f64>> = nurbs.poles[pole]
            .edges
            .iter()
            .flat_map(|&(patch, edge)| [0.0, 0.25, 0.5, 0.75, 1.0].map(|x| (patch, on_edge(edge, x))))
            .chain(nurbs.poles[pole].corners.iter().copied())
            .map(|(patch, at)| nurbs.foot(patch, at, 1.0).normal_B)
            .collect();
        let mean = crate::surface::direction_or_up(&normals.iter().sum());
        nurbs.poles[pole].is_sharp = normals.iter().any(|normal| normal.dot(&mean) < SMOOTH_RAD.cos());
        nurbs.poles[pole].normal_B = mean;
    }
}
