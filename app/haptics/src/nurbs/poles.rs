//! Points that edges have shrunk to, and the ways on from there.
//!
//! Model: an edge all of whose points agree is a pole; all poles at one place are one, and corners of patches that lie there
//! belong to it. A descent goes on from a pole in the direction that does most, of five for each edge and three for each
//! corner.
//! Cost: of a way on, one look at the surface for each of these directions.

use std::collections::HashMap;

use nalgebra::Vector3;

use super::Nurbs;
use super::foot::Foot;
use super::seams::{EQUAL, SMOOTH_RAD, box_of, on_edge, running};

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

impl Nurbs {
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

/// Direction of a parameter from a border of a patch into it.
fn inward_of(x: f64) -> f64 {
    if x < 0.5 { 1.0 } else { -1.0 }
}

/// A way that leads from a pole into a patch.
struct Way {
    /// Approach to the target for each metre of it.
    gain: f64,
    patch: u32,
    from: [f64; 2],
    along: [f64; 2],
    /// Length of it, in parameters: to the place nearest to the target, were the patch flat.
    step: f64,
}

impl Way {
    fn new(from: &Foot, along: [f64; 2], per_step_B: &Vector3<f64>, offset_B: &Vector3<f64>) -> Self {
        let length = per_step_B.norm();
        let gain = offset_B.dot(per_step_B) / length;
        Self { gain, patch: from.patch, from: from.at, along, step: (gain / length).min(0.25) }
    }
}

/// Finds the poles, and which edges and corners of patches are there.
pub(super) fn find(nurbs: &mut Nurbs) {
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

/// Says of each pole whether it is sharp, by the normals around it; once patches are turned for good.
pub(super) fn shape(nurbs: &mut Nurbs) {
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
