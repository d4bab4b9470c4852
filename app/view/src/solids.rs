//! The triangles of a solid that is joined from others (CSG), with its sharp edges.
//!
//! Method: dual contouring. Every cell of a grid through which the boundary goes has one corner of the picture: where the
//! tangent planes at the crossings of its edges meet, and nearest to their middle where they do not say. A face of
//! four such corners goes around every edge of the grid that is crossed.

use crate::triangles::Triangles;
use haptics::Csg;
use nalgebra::{Matrix3, Point3, SymmetricEigen, Vector3};

/// Cells along each side.
const CELLS: usize = 64;
/// Of the extent: a grid that is not aligned with what is round numbers meets no face edge-on.
const REACH: f64 = 1.0173;
/// Halvings of a grid's edge to find where the boundary crosses it: to a billionth of its length.
const HALVINGS: usize = 30;
/// Normals that differ less look smooth (rad).
const CREASE_RAD: f64 = 0.5;
/// Directions in which the planes say less than this share of the most are not said.
const LEAST_SAID: f64 = 0.05;

/// Where the boundary crosses an edge of the grid.
#[derive(Clone, Copy)]
struct Crossing {
    place: Vector3<f64>,
    normal: Vector3<f64>,
}

/// What the solid looks like; what of it reaches beyond its bounded parts is cut off there.
pub(crate) fn triangles(csg: &Csg) -> Triangles {
    Grid::over(csg).contour()
}

/// Thickness below which it may not be drawn (m).
pub(crate) fn least_drawn_m(csg: &Csg) -> f64 {
    2.0 * REACH * csg.extent_m() / CELLS as f64
}

struct Grid<'c> {
    csg: &'c Csg,
    least_m: f64,
    step_m: f64,
    /// Of each grid point.
    is_inside: Vec<bool>,
}

impl<'c> Grid<'c> {
    fn over(csg: &'c Csg) -> Self {
        let least_m = -REACH * csg.extent_m();
        let mut grid = Self { csg, least_m, step_m: least_drawn_m(csg), is_inside: Vec::new() };
        let points = |k: usize| [k % (CELLS + 1), k / (CELLS + 1) % (CELLS + 1), k / (CELLS + 1).pow(2)];
        grid.is_inside = (0..(CELLS + 1).pow(3))
            .map(|k| {
                let at = points(k);
                // Closed at the rim.
                at.iter().all(|i| (1..CELLS).contains(i)) && csg.is_inside(&grid.place(at))
            })
            .collect();
        grid
    }

    fn place(&self, at: [usize; 3]) -> Vector3<f64> {
        Vector3::from(at.map(|i| self.least_m + self.step_m * i as f64))
    }

    fn is_inside(&self, at: [usize; 3]) -> bool {
        self.is_inside[at[0] + (CELLS + 1) * (at[1] + (CELLS + 1) * at[2])]
    }

    fn crossing(&self, from: [usize; 3], axis: usize) -> Option<Crossing> {
        let mut to = from;
        to[axis] += 1;
        if self.is_inside(from) == self.is_inside(to) {
            return None;
        }
        let (mut inside, mut outside) = (self.place(from), self.place(to));
        if !self.is_inside(from) {
            std::mem::swap(&mut inside, &mut outside);
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (inside + outside);
            *(if self.csg.is_inside(&middle) { &mut inside } else { &mut outside }) = middle;
        }
        let place = 0.5 * (inside + outside);
        let outward = (outside - inside).normalize();
        Some(Crossing { place, normal: self.gradient(&place).try_normalize(0.0).unwrap_or(outward) })
    }

    /// Of the distance, which has no other kinks near a boundary than the boundary's own.
    fn gradient(&self, place: &Vector3<f64>) -> Vector3<f64> {
        let reach_m = 1e-5 * self.step_m;
        Vector3::from_fn(|axis, _| {
            let to = Vector3::ith(axis, reach_m);
            self.csg.signed_distance(&(place + to)) - self.csg.signed_distance(&(place - to))
        })
    }

    fn contour(&self) -> Triangles {
        let mut corners = std::collections::HashMap::<[usize; 3], (Vector3<f64>, Vec<Crossing>)>::new();
        let mut made = Triangles::default();
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for from in points() {
                let Some(crossing) = self.crossing(from, axis) else { continue };
                // The four cells around the edge, counter-clockwise seen from its end.
                let around = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[back_u, back_v]| {
                    let mut cell = from;
                    (cell[u], cell[v]) = (from[u] - 1 + back_u, from[v] - 1 + back_v);
                    cell
                });
                let mut quad = around.map(|cell| {
                    let (place, crossings) = corners.entry(cell).or_insert_with(|| self.corner(cell));
                    (*place, smooth(crossings, &crossing.normal))
                });
                if !self.is_inside(from) {
                    quad.reverse();
                }
                add(&mut made, &quad);
            }
        }
        made
    }

    fn corner(&self, cell: [usize; 3]) -> (Vector3<f64>, Vec<Crossing>) {
        let crossings: Vec<Crossing> = (0..3)
            .flat_map(|axis| [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[i, j]| (axis, i, j)))
            .filter_map(|(axis, i, j)| {
                let mut from = cell;
                from[(axis + 1) % 3] += i;
                from[(axis + 2) % 3] += j;
                self.crossing(from, axis)
            })
            .collect();
        let middle =
            crossings.iter().map(|crossing| crossing.place).sum::<Vector3<f64>>() / crossings.len() as f64;
        let least = self.place(cell);
        let place = middle + meeting(&crossings, &middle);
        let place = place.zip_map(&least, |at, least| at.clamp(least, least + self.step_m));
        (place, crossings)
    }
}

/// All grid points whose edges have four cells around them.
fn points() -> impl Iterator<Item = [usize; 3]> {
    (1..CELLS).flat_map(|z| (1..CELLS).flat_map(move |y| (1..CELLS).map(move |x| [x, y, z])))
}

/// How far from the middle the tangent planes meet.
fn meeting(crossings: &[Crossing], middle: &Vector3<f64>) -> Vector3<f64> {
    let (mut squares, mut pulled) = (Matrix3::zeros(), Vector3::zeros());
    for Crossing { place, normal } in crossings {
        squares += normal * normal.transpose();
        pulled += normal * normal.dot(&(place - middle));
    }
    let said = SymmetricEigen::new(squares);
    let most = said.eigenvalues.max();
    (0..3)
        .filter(|k| said.eigenvalues[*k] > LEAST_SAID * most)
        .map(|k| {
            said.eigenvectors.column(k) * (said.eigenvectors.column(k).dot(&pulled) / said.eigenvalues[k])
        })
        .sum()
}

/// The mean of those normals that are much like this one.
fn smooth(crossings: &[Crossing], normal: &Vector3<f64>) -> Vector3<f64> {
    let alike = crossings.iter().filter(|other| other.normal.dot(normal) > CREASE_RAD.cos());
    alike.map(|other| other.normal).sum::<Vector3<f64>>().try_normalize(0.0).unwrap_or(*normal)
}

fn add(made: &mut Triangles, quad: &[(Vector3<f64>, Vector3<f64>); 4]) {
    let first = made.places.len() as u32;
    for (place, normal) in quad {
        made.places.push(Point3::from(*place));
        made.normals.push(*normal);
    }
    made.corners.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
}
