//! Points that edges have shrunk to, and the ways on from there.
//!
//! Model: an edge all of whose points agree is a pole; all poles at one place are one, and corners of patches that lie there
//! belong to it. A descent goes on from a pole in the direction that does most, of five for each edge and three for each
//! corner.
//! Cost: of a way on, a scalar product for each of these directions.

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
    ways: Vec<Way>,
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
        let ways = &self.poles[pole as usize].ways;
        let gains = ways.iter().map(|way| (offset_B.dot(&way.per_step_B) / way.length_m, way));
        let (gain, way) = gains.reduce(|best, next| if next.0 > best.0 { next } else { best })?;
        if gain <= 1e-15 * self.extent_m {
            return None;
        }
        let square = offset_B.norm_squared();
        // To the place nearest to the target, were the patch flat.
        let mut step = (gain / way.length_m).min(0.25);
        for _ in 0..30 {
            let at = [0, 1].map(|d| (way.from[d] + way.along[d] * step).clamp(0.0, 1.0));
            let next = self.foot(way.patch, at, foot.side);
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
#[derive(Debug, Clone, PartialEq)]
struct Way {
    patch: u32,
    from: [f64; 2],
    along: [f64; 2],
    /// By which a step of 1 along it leads on, and its length.
    per_step_B: Vector3<f64>,
    length_m: f64,
}

/// The ways from a pole into its patches.
fn ways(nurbs: &Nurbs, pole: &Pole) -> Vec<Way> {
    let way = |there: &Foot, along, per_step_B: Vector3<f64>| Way {
        patch: there.patch,
        from: there.at,
        along,
        per_step_B,
        length_m: per_step_B.norm(),
    };
    let mut ways = Vec::with_capacity(5 * pole.edges.len() + 3 * pole.corners.len());
    for &(patch, edge) in &pole.edges {
        for k in 0..=4 {
            let there = nurbs.foot(patch, on_edge(edge, f64::from(k) / 4.0), 1.0);
            let into = inward_of([0.0, 1.0][usize::from(edge % 2)]);
            let along = if running(edge) == 0 { [0.0, into] } else { [into, 0.0] };
            ways.push(way(&there, along, nurbs.inward(&there, edge)));
        }
    }
    for &(patch, at) in &pole.corners {
        let there = nurbs.foot(patch, at, 1.0);
        let into = at.map(inward_of);
        let [u, v] = [there.local.du * into[0], there.local.dv * into[1]];
        let share = u.norm() / v.norm();
        for (a, b) in [(1.0, 0.0), (0.0, 1.0), (1.0, share)] {
            ways.push(way(&there, [into[0] * a, into[1] * b], u * a + v * b));
        }
    }
    // What does not lead on, or nowhere.
    ways.retain(|way| way.length_m > 0.0 && way.length_m.is_finite());
    ways
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
                let ways = Vec::new();
                nurbs.poles.push(Pole { edges, corners, point_B: low, is_sharp: false, normal_B, ways });
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

/// Says of each pole whether it is sharp, by the normals around it, and where it leads on; once patches are turned for
/// good.
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
        nurbs.poles[pole].ways = ways(nurbs, &nurbs.poles[pole]);
    }
}
