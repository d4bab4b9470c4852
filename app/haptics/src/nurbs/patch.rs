//! A rational tensor-product patch as files give it: degrees, knots, weighted points.
//!
//! Model: `S(u, v) = sum N_i(u) N_j(v) w_ij P_ij / sum N_i(u) N_j(v) w_ij` with B-spline bases over any knots that do
//! not fall, clamped at the ends or not. The patch covers the parameters for which its bases sum to one.
//! Invariant: what [`NurbsPatch::check`] passed has a finite, continuous surface.

use super::error::NurbsError;

/// One patch, as given.
#[derive(Debug, Clone, PartialEq)]
pub struct NurbsPatch {
    /// Of the polynomials along u and v: 1 to [`MAX_DEGREE`].
    pub degree: [usize; 2],
    /// Along u and v: as many as there are points, plus degree, plus one; none below the one before.
    pub knots: [Vec<f64>; 2],
    /// x, y, z (m) and the weight, > 0; those of the first v come first, u running.
    pub points: Vec<[f64; 4]>,
}

/// The highest degree: a turn of a helix or a car's bonnet has 5, none that we met has more than 7.
pub const MAX_DEGREE: usize = 7;
/// Weights may differ by this factor: beyond it most of a patch is where nobody looks.
const LARGEST_WEIGHT_RATIO: f64 = 1e6;

impl NurbsPatch {
    /// How many points it has along u and v.
    pub fn counts(&self) -> [usize; 2] {
        [0, 1].map(|d| self.knots[d].len().saturating_sub(self.degree[d] + 1))
    }

    /// Errors: the first thing that makes it no surface; `patch` is its number, for the message.
    pub fn check(&self, patch: usize) -> Result<(), NurbsError> {
        let refused = |part: String, found: String, allowed: String| {
            Err(NurbsError::Patch { patch, part, found, allowed })
        };
        for (d, name) in ["u", "v"].iter().enumerate() {
            if !(1..=MAX_DEGREE).contains(&self.degree[d]) {
                let allowed = format!("1 to {MAX_DEGREE}");
                return refused(format!("degree {name}"), self.degree[d].to_string(), allowed);
            }
            if let Err((found, allowed)) = check_knots(&self.knots[d], self.degree[d]) {
                return refused(format!("knots {name}"), found, allowed);
            }
        }
        let [nu, nv] = self.counts();
        if self.points.len() != nu * nv {
            let allowed = format!("{nu} x {nv} = {}, since that many go with the knots and degrees", nu * nv);
            return refused("points".into(), format!("{} points", self.points.len()), allowed);
        }
        for (index, point) in self.points.iter().enumerate() {
            if !point.iter().all(|x| x.is_finite() && x.abs() < 1e100) || point[3] <= 0.0 {
                let allowed = "finite numbers, of which the fourth, the weight, is above 0";
                return refused(format!("points[{index}]"), format!("{point:?}"), allowed.into());
            }
        }
        let weights = self.points.iter().map(|point| point[3]);
        let (least, most) = weights.fold((f64::MAX, 0.0f64), |(l, m), w| (l.min(w), m.max(w)));
        if most > LARGEST_WEIGHT_RATIO * least {
            let allowed = format!("weights that differ by a factor of {LARGEST_WEIGHT_RATIO:e} at most");
            return refused("points".into(), format!("weights from {least:e} to {most:e}"), allowed);
        }
        Ok(())
    }
}

/// What was found and what is allowed, if they are no knots.
fn check_knots(knots: &[f64], degree: usize) -> Result<(), (String, String)> {
    let least = 2 * (degree + 1);
    if knots.len() < least {
        return Err((format!("{} knots", knots.len()), format!("{least} or more at degree {degree}")));
    }
    if let Some(bad) = knots.iter().find(|knot| !knot.is_finite()) {
        return Err((bad.to_string(), "finite numbers".into()));
    }
    if let Some(i) = (1..knots.len()).find(|&i| knots[i] < knots[i - 1]) {
        let found = format!("{} after {}", knots[i], knots[i - 1]);
        return Err((found, "numbers none of which is below the one before".into()));
    }
    let (first, last) = (knots[degree], knots[knots.len() - degree - 1]);
    if first >= last {
        return Err((format!("all of them {first}"), "knots that leave a stretch in the middle".into()));
    }
    let inner = knots.iter().filter(|&&knot| knot > first && knot < last);
    let mut run = (f64::NAN, 0);
    for &knot in inner {
        run = if knot == run.0 { (knot, run.1 + 1) } else { (knot, 1) };
        if run.1 > degree {
            let found = format!("{knot} more than {degree} times");
            return Err((found, format!("at most {degree} times, or the surface is torn there")));
        }
    }
    Ok(())
}
