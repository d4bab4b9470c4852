//! How far one can go along a line before leaving a hull of points: a linear program in seven rows.
//!
//! Problem: the largest `r` for which `sum l_i w_i + r c = 0`, `sum l_i + r c_7 = 1`, all `l_i, r >= 0`.
//! Model: the simplex method in a full tableau on the stack, first for any solution (artificial variables), then for the
//! best; the smallest index that improves enters (Bland), so that it does not go round in circles.
//! Invariant: bounded; who does not come to an end in time has found nothing.

use nalgebra::{SVector, Vector6};

/// The most points.
pub(super) const MAX_POINTS: usize = 80;

const ROWS: usize = 7;
const ARTIFICIAL: usize = MAX_POINTS + 1;
const RIGHT: usize = ARTIFICIAL + ROWS;
const COLUMNS: usize = RIGHT + 1;

/// What the program found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Farthest {
    /// r.
    pub(super) reach: f64,
    /// Of the face where it leaves: `normal . x <= reach` for all points, `normal . direction = 1`.
    pub(super) normal: Vector6<f64>,
}

struct Tableau {
    rows: [[f64; COLUMNS]; ROWS],
    objective: [f64; COLUMNS],
    /// Which variable each row stands for.
    basis: [usize; ROWS],
    /// Points in use; the line's own column is the one behind them all.
    points: usize,
}

/// The solution, if there is one; `line` is the column of r.
pub(super) fn farthest(points: &[Vector6<f64>], line: &SVector<f64, 7>) -> Option<Farthest> {
    let points = points.get(..points.len().min(MAX_POINTS))?;
    let mut tableau = Tableau::new(points, line);
    tableau.optimise(false)?;
    let infeasible: f64 = (0..ROWS).map(|row| tableau.artificial_part(row)).sum();
    if infeasible > FEASIBLE {
        return None;
    }
    tableau.objective = [0.0; COLUMNS];
    tableau.objective[MAX_POINTS] = -1.0;
    for row in 0..ROWS {
        if tableau.basis[row] == MAX_POINTS {
            let pivot_row = tableau.rows[row];
            tableau.objective.iter_mut().zip(pivot_row).for_each(|(z, x)| *z += x);
        }
    }
    tableau.optimise(true)?;
    let dual = |row: usize| tableau.objective[ARTIFICIAL + row];
    Some(Farthest { reach: tableau.objective[RIGHT], normal: -Vector6::from_fn(|row, _| dual(row)) })
}

impl Tableau {
    fn new(points: &[Vector6<f64>], line: &SVector<f64, 7>) -> Self {
        let mut rows = [[0.0; COLUMNS]; ROWS];
        let mut objective = [0.0; COLUMNS];
        for (number, row) in rows.iter_mut().enumerate() {
            for (at, point) in points.iter().enumerate() {
                row[at] = if number < 6 { point[number] } else { 1.0 };
            }
            row[MAX_POINTS] = line[number];
            row[ARTIFICIAL + number] = 1.0;
            row[RIGHT] = if number < 6 { 0.0 } else { 1.0 };
            // The sum of the artificial variables, to be made zero.
            for column in (0..=MAX_POINTS).chain([RIGHT]) {
                objective[column] -= row[column];
            }
        }
        let basis = std::array::from_fn(|row| ARTIFICIAL + row);
        Self { rows, objective, basis, points: points.len() }
    }

    /// How much of what must be zero a row still stands for.
    fn artificial_part(&self, row: usize) -> f64 {
        if self.basis[row] >= ARTIFICIAL { self.rows[row][RIGHT].abs() } else { 0.0 }
    }

    fn optimise(&mut self, is_second: bool) -> Option<()> {
        for _ in 0..MAX_PIVOTS {
            let candidates = (0..self.points).chain([MAX_POINTS]);
            let Some(enters) = candidates.into_iter().find(|&column| self.objective[column] < -IMPROVES)
            else {
                return Some(());
            };
            let leaves = self.leaving(enters, is_second)?;
            self.pivot(leaves, enters);
        }
        None
    }

    /// Which row gives way first; `None`: none does.
    fn leaving(&self, enters: usize, is_second: bool) -> Option<usize> {
        let mut best: Option<(f64, usize)> = None;
        for row in 0..ROWS {
            let slope = self.rows[row][enters];
            // An artificial variable that is zero must stay so, whichever way it would go.
            let is_pinned = is_second && self.basis[row] >= ARTIFICIAL;
            let ratio = match () {
                () if is_pinned && slope.abs() > SLOPE => 0.0,
                () if slope > SLOPE => self.rows[row][RIGHT].max(0.0) / slope,
                () => continue,
            };
            let is_better = best.is_none_or(|(least, other)| {
                ratio < least || (ratio == least && self.basis[row] < self.basis[other])
            });
            if is_better {
                best = Some((ratio, row));
            }
        }
        best.map(|(_, row)| row)
    }

    fn pivot(&mut self, leaves: usize, enters: usize) {
        let inverse = self.rows[leaves][enters].recip();
        self.rows[leaves].iter_mut().for_each(|x| *x *= inverse);
        let pivot_row = self.rows[leaves];
        let eliminate = |row: &mut [f64; COLUMNS]| {
            let factor = row[enters];
            if factor != 0.0 {
                row.iter_mut().zip(pivot_row).for_each(|(x, p)| *x -= factor * p);
            }
        };
        for (number, row) in self.rows.iter_mut().enumerate() {
            if number != leaves {
                eliminate(row);
            }
        }
        eliminate(&mut self.objective);
        self.basis[leaves] = enters;
    }
}

/// Points are some units long: what is smaller is rounding.
const IMPROVES: f64 = 1e-11;
const SLOPE: f64 = 1e-10;
const FEASIBLE: f64 = 1e-9;
/// Some ten times what seven rows and 80 columns have been seen to take.
const MAX_PIVOTS: usize = 400;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_leaves_a_cross_and_a_box_where_it_must() {
        let mut cross = Vec::new();
        for axis in 0..6 {
            for sign in [1.0, -1.0] {
                let mut point = Vector6::zeros();
                point[axis] = sign * (1.0 + axis as f64);
                cross.push(point);
            }
        }
        let ray = |direction: Vector6<f64>| {
            let mut line = SVector::<f64, 7>::zeros();
            line.fixed_rows_mut::<6>(0).copy_from(&-direction);
            farthest(&cross, &line).unwrap()
        };
        let direction = Vector6::new(1.0, -2.0, 0.5, 0.0, 1.0, -1.0);
        // sum |x_i| / a_i = 1 is its surface.
        let over =
            |d: &Vector6<f64>| d.iter().enumerate().map(|(i, x)| x.abs() / (1.0 + i as f64)).sum::<f64>();
        let found = ray(direction);
        assert!((found.reach - 1.0 / over(&direction)).abs() < 1e-12);
        assert!((found.normal.dot(&direction) - 1.0).abs() < 1e-12);
        assert!(cross.iter().all(|point| found.normal.dot(point) <= found.reach + 1e-12));
    }
}
