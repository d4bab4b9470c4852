//! Which patches meet where: edges in common, points that edges have shrunk to, and where the surface ends.
//!
//! Problem: files give patches one by one. What lies beyond an edge, the geometry has to tell.
//!
//! Model: two edges meet if one runs along the other (or along a part of it) within [`EQUAL`] of the whole set's extent.
//! One that has shrunk to a point is a pole ([`poles`]). Where normals agree within [`SMOOTH_RAD`] along an edge, it is a seam
//! that nobody feels, else a crease.
//! Edges of a patch: 0 is u = 0, 1 is u = 1, 2 is v = 0, 3 is v = 1; the other parameter runs along it.

use nalgebra::Vector3;

use super::Nurbs;
use super::chord::Chord;
use super::edge_boxes::{Box3, EdgeBoxes};
use super::error::NurbsError;
use super::foot::Foot;
use super::poles;

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
}

/// Finds poles and links, and turns patches so that neighbours agree about the outside.
pub(super) fn join(nurbs: &mut Nurbs) -> Result<Joined, NurbsError> {
    poles::find(nurbs);
    let edges: Vec<(u32, u8)> = (0..nurbs.patches.len() as u32)
        .flat_map(|patch| (0..4).map(move |edge| (patch, edge)))
        .filter(|&edge| edge_of(nurbs, edge).pole.is_none())
        .collect();
    let boxes: Vec<_> = edges.iter().map(|&edge| box_of(nurbs, edge)).collect();
    // Edges that agree to rounding first: in a thin plate others may be nearly as near.
    let boxes = EdgeBoxes::new(&boxes);
    let chords: Vec<_> = edges.iter().map(|&edge| Chord::of(nurbs, edge)).collect();
    for slack in [EXACT, EQUAL].map(|share| share * nurbs.extent_m) {
        for i in 0..edges.len() {
            for j in boxes.later_near(i, slack) {
                let is_new = |k: usize| slack < EQUAL * nurbs.extent_m || !is_covered(nurbs, edges[k]);
                let may_meet = chords[i].may_hold(&chords[j], slack) || chords[j].may_hold(&chords[i], slack);
                if may_meet && is_new(i) && is_new(j) {
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

pub(super) fn box_of(nurbs: &Nurbs, edge: (u32, u8)) -> Box3 {
    let first = nurbs.local(edge.0, on_edge(edge.1, 0.0)).point_B;
    samples(nurbs, edge).fold([first; 2], |[low, high], p| [low.inf(&p), high.sup(&p)])
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
