//! Point, first and second derivatives of an element at a pair of parameters.
//!
//! Model: Bernstein's bases and their derivatives along both directions give those of the homogeneous net; the quotient
//! rule takes the weight out. Cost: two small products per control point, no allocation, no branch on values.

use nalgebra::Vector3;

use super::bezier::{Control, MAX_ORDER};

/// A surface around one of its points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Local {
    pub(super) point_B: Vector3<f64>,
    pub(super) du: Vector3<f64>,
    pub(super) dv: Vector3<f64>,
    pub(super) duu: Vector3<f64>,
    pub(super) duv: Vector3<f64>,
    pub(super) dvv: Vector3<f64>,
}

impl Local {
    /// What second derivatives tell of the surface `by` this much farther on.
    #[inline(always)]
    pub(super) fn moved(&self, [u, v]: [f64; 2]) -> Self {
        let (by_u, by_v) = (self.duu * u + self.duv * v, self.duv * u + self.dvv * v);
        let point_B = self.point_B + (self.du + by_u * 0.5) * u + (self.dv + by_v * 0.5) * v;
        Self { point_B, du: self.du + by_u, dv: self.dv + by_v, ..*self }
    }
}

/// A basis, its first and its second derivative.
struct Basis<const N: usize>([[f64; 3]; N]);

/// Of an element with `net`, at `s` and `t` from 0 to 1; derivatives by patch parameters, of which the element covers
/// `width`.
#[inline]
pub(super) fn local(
    net: &[Control],
    degree: [usize; 2],
    origin_B: &Vector3<f64>,
    [s, t]: [f64; 2],
    width: [f64; 2],
) -> Local {
    // Compiled for the degrees that are common: loops of known length need no tests.
    match degree {
        [1, 1] => of_order::<2, 2>(net, degree, origin_B, [s, t], width),
        [2, 1] => of_order::<3, 2>(net, degree, origin_B, [s, t], width),
        [2, 2] => of_order::<3, 3>(net, degree, origin_B, [s, t], width),
        [3, 2] => of_order::<4, 3>(net, degree, origin_B, [s, t], width),
        [2, 3] => of_order::<3, 4>(net, degree, origin_B, [s, t], width),
        [3, 3] => of_order::<4, 4>(net, degree, origin_B, [s, t], width),
        [5, 5] => of_order::<6, 6>(net, degree, origin_B, [s, t], width),
        _ => of_order::<MAX_ORDER, MAX_ORDER>(net, degree, origin_B, [s, t], width),
    }
}

#[inline(never)]
fn of_order<const N: usize, const M: usize>(
    net: &[Control],
    [p, q]: [usize; 2],
    origin_B: &Vector3<f64>,
    [s, t]: [f64; 2],
    width: [f64; 2],
) -> Local {
    let (bu, bv) = (Basis::<N>::new(p, s, width[0]), Basis::<M>::new(q, t, width[1]));
    // Known to the compiler where the order is.
    let columns = if N == MAX_ORDER { p + 1 } else { N };
    let mut sums = [[0.0; 4]; 6];
    for (row, [b, db, ddb]) in net.chunks_exact(columns).zip(&bv.0) {
        let mut line = [[0.0; 4]; 3];
        for (control, weights) in row.iter().zip(&bu.0) {
            for d in 0..3 {
                for c in 0..4 {
                    line[d][c] += control[c] * weights[d];
                }
            }
        }
        for c in 0..4 {
            sums[0][c] += line[0][c] * b;
            sums[1][c] += line[1][c] * b;
            sums[2][c] += line[0][c] * db;
            sums[3][c] += line[2][c] * b;
            sums[4][c] += line[1][c] * db;
            sums[5][c] += line[0][c] * ddb;
        }
    }
    without_weight(&sums, origin_B)
}

/// The quotient rule, from `A`, `A_u`, `A_v`, `A_uu`, `A_uv`, `A_vv`.
#[inline(always)]
fn without_weight(sums: &[Control; 6], origin_B: &Vector3<f64>) -> Local {
    let a = |i: usize| Vector3::new(sums[i][0], sums[i][1], sums[i][2]);
    let w = |i: usize| sums[i][3];
    let share = 1.0 / w(0);
    let s = a(0) * share;
    let du = (a(1) - s * w(1)) * share;
    let dv = (a(2) - s * w(2)) * share;
    Local {
        point_B: origin_B + s,
        du,
        dv,
        duu: (a(3) - du * (2.0 * w(1)) - s * w(3)) * share,
        duv: (a(4) - du * w(2) - dv * w(1) - s * w(4)) * share,
        dvv: (a(5) - dv * (2.0 * w(2)) - s * w(5)) * share,
    }
}

impl<const N: usize> Basis<N> {
    /// By the triangle of lower degrees: two levels below the top it gives the second derivative, one below the first.
    #[inline(always)]
    fn new(degree: usize, s: f64, width: f64) -> Self {
        let p = if N == MAX_ORDER { degree } else { N - 1 };
        let (r, first) = (1.0 - s, p as f64 / width);
        let second = first * (p as f64 - 1.0) / width;
        let mut b = [0.0; N];
        b[0] = 1.0;
        let mut of = [[0.0; 3]; N];
        for level in 1..=p {
            // Here `b` holds degree `level - 1`.
            if level + 1 == p {
                for (k, of) in of.iter_mut().enumerate().take(p + 1) {
                    let at = |k: usize| if k < p - 1 { b[k] } else { 0.0 };
                    let before = |back: usize| k.checked_sub(back).map_or(0.0, at);
                    of[2] = second * (before(2) - 2.0 * before(1) + before(0));
                }
            }
            if level == p {
                for (k, of) in of.iter_mut().enumerate().take(p + 1) {
                    let before = if k > 0 { b[k - 1] } else { 0.0 };
                    let here = if k < p { b[k] } else { 0.0 };
                    of[1] = first * (before - here);
                }
            }
            for k in (1..=level).rev() {
                b[k] = b[k] * r + b[k - 1] * s;
            }
            b[0] *= r;
        }
        for (of, b) in of.iter_mut().zip(&b[..=p]) {
            of[0] = *b;
        }
        Self(of)
    }
}
