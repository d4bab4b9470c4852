//! Force and torque, impulse and angular impulse: six numbers of a body; and what joins those of two, in rows.

use nalgebra::{SVector, Vector3};

pub(super) type Vector6 = SVector<f64, 6>;
/// A matrix of 6 x 6, row by row: what is done to it is done to whole rows.
pub(super) type Block = [[f64; 6]; 6];

pub(super) const NOTHING: Block = [[0.0; 6]; 6];

pub(super) fn joined(along: &Vector3<f64>, about: &Vector3<f64>) -> Vector6 {
    Vector6::new(along.x, along.y, along.z, about.x, about.y, about.z)
}

pub(super) fn halves(p: &Vector6) -> (Vector3<f64>, Vector3<f64>) {
    (Vector3::new(p[0], p[1], p[2]), Vector3::new(p[3], p[4], p[5]))
}

/// Adds a multiple of a row to another.
#[inline(always)]
pub(super) fn add(to: &mut [f64; 6], row: &[f64; 6], times: f64) {
    for (to, of) in to.iter_mut().zip(row) {
        *to += of * times;
    }
}

/// Takes a product of two from a third one.
#[inline]
pub(super) fn take_product(from: &mut Block, left: &Block, right: &Block) {
    for (from, left) in from.iter_mut().zip(left) {
        for (times, row) in left.iter().zip(right) {
            add(from, row, -times);
        }
    }
}

/// Takes a product of a matrix and a vector from another one.
#[inline]
pub(super) fn take_image(from: &mut Vector6, matrix: &Block, of: &Vector6) {
    for (from, row) in from.iter_mut().zip(matrix) {
        *from -= row.iter().zip(of.iter()).map(|(a, b)| a * b).sum::<f64>();
    }
}

/// Both triangles of a matrix, with their rows in the order of pivots.
pub(super) struct Triangles {
    /// Below the diagonal how often rows were taken from each other, above it what is left, on it the inverse of that.
    rows: Block,
    swaps: [usize; 6],
}

impl Triangles {
    /// `None`: it has no inverse.
    #[inline]
    pub(super) fn of(matrix: &Block) -> Option<Self> {
        let (mut rows, mut swaps) = (*matrix, [0; 6]);
        for pivot in 0..6 {
            let largest = (pivot + 1..6).fold(pivot, |best, row| {
                if rows[row][pivot].abs() > rows[best][pivot].abs() { row } else { best }
            });
            rows.swap(pivot, largest);
            swaps[pivot] = largest;
            let inverse = rows[pivot][pivot].recip();
            if !inverse.is_finite() {
                return None;
            }
            let (above, below) = rows.split_at_mut(pivot + 1);
            let own = &mut above[pivot];
            own[pivot] = inverse;
            for row in below {
                let times = row[pivot] * inverse;
                (pivot + 1..6).for_each(|column| row[column] -= own[column] * times);
                row[pivot] = times;
            }
        }
        Some(Self { rows, swaps })
    }

    /// Changes a right-hand side of one column to the answer.
    #[inline]
    pub(super) fn solve(&self, side: &mut Vector6) {
        self.swaps.iter().enumerate().for_each(|(pivot, &row)| side.swap_rows(pivot, row));
        for pivot in 0..6 {
            for row in pivot + 1..6 {
                side[row] -= self.rows[row][pivot] * side[pivot];
            }
        }
        for pivot in (0..6).rev() {
            side[pivot] *= self.rows[pivot][pivot];
            for row in 0..pivot {
                side[row] -= self.rows[row][pivot] * side[pivot];
            }
        }
    }

    /// Changes a right-hand side of six columns to the answer.
    #[inline]
    pub(super) fn solve_block(&self, side: &mut Block) {
        self.swaps.iter().enumerate().for_each(|(pivot, &row)| side.swap(pivot, row));
        for pivot in 0..6 {
            let (known, left) = side.split_at_mut(pivot + 1);
            for (row, triangle) in left.iter_mut().zip(&self.rows[pivot + 1..]) {
                add(row, &known[pivot], -triangle[pivot]);
            }
        }
        for pivot in (0..6).rev() {
            let (left, known) = side.split_at_mut(pivot);
            let own = &mut known[0];
            own.iter_mut().for_each(|x| *x *= self.rows[pivot][pivot]);
            for (row, triangle) in left.iter_mut().zip(&self.rows) {
                add(row, own, -triangle[pivot]);
            }
        }
    }
}
