//! Goes down to a point of the surface that is locally the nearest to a target, over patch borders.
//!
//! Model: Newton's method on `|S(u, v) - target|^2`. Where its matrix is not positive the curvature is left out
//! (Gauss and Newton), so that every step leads down; steps that do not are halved. At a border the descent goes on in
//! the patch beyond if that leads farther down; at a point that an edge has shrunk to, in the direction that does most.
//! That is where a frictionless god-object goes, and where Melder eq. 4.12-4.14 bring one back to.
//!
//! Invariants: the distance never grows but by rounding; the answer is on the surface. What the bound ends goes on in
//! the next tick from where it is.
//! Cost: begun near the answer, one step, which is one look at the surface; at most [`MAX_STEPS`].

use nalgebra::Vector3;

use super::Nurbs;
use super::foot::Foot;
use super::seams::Border;

/// Where a descent ended.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arrival {
    pub(super) foot: Foot,
    pub(super) rest: Rest,
}

/// What kept it.
#[derive(Debug, Clone, Copy)]
#[expect(
    clippy::large_enum_variant,
    reason = "lives on the stack for a moment; a box would allocate in a tick"
)]
pub(super) enum Rest {
    /// Nothing: no direction leads down.
    Smooth,
    /// The surface ends.
    Rim,
    /// An edge.
    Crease(Crease),
    /// A sharp point.
    Tip(u32),
}

/// A sharp edge that a foot stands on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crease {
    /// Which edge of the foot's patch it is.
    pub(super) edge: u8,
    /// The same place seen from the patch beyond, and which edge of that it is.
    pub(super) beyond: Foot,
    pub(super) edge_beyond: u8,
}

/// Which edges a descent crosses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Crossing {
    /// All that lead on.
    All,
    /// None that can be felt: it ends there.
    Smooth,
}

/// Bound on the looks at the surface of one descent.
pub(super) const MAX_STEPS: u32 = 64;

impl Nurbs {
    pub(super) fn descend(&self, target_B: &Vector3<f64>, from: &Foot, crossing: Crossing) -> Arrival {
        let mut foot = *from;
        let mut steps = 0;
        while steps < MAX_STEPS {
            let offset_B = target_B - foot.local.point_B;
            let slope = [offset_B.dot(&foot.local.du), offset_B.dot(&foot.local.dv)];
            let mut rest = Rest::Smooth;
            let mut is_free = [true; 2];
            if let Some(step) = self.at_borders(&foot, &offset_B, crossing, &mut is_free, &mut rest) {
                match step {
                    Step::Over(beyond) => {
                        steps += 1;
                        foot = beyond;
                        continue;
                    }
                    Step::End => return Arrival { foot, rest },
                }
            }
            match self.step(&foot, &offset_B, target_B, slope, is_free, &mut steps) {
                Moved::To(next) => foot = next,
                Moved::Arrived(foot) => return Arrival { foot, rest: self.settled(&foot, rest) },
            }
        }
        Arrival { foot, rest: Rest::Smooth }
    }

    /// A last step may have left the border that held it.
    fn settled(&self, foot: &Foot, rest: Rest) -> Rest {
        let is_at_border = foot.at.iter().any(|&x| x == 0.0 || x == 1.0);
        if is_at_border { rest } else { Rest::Smooth }
    }

    /// What borders do to a descent that stands at one and wants to leave the patch.
    #[inline]
    fn at_borders(
        &self,
        foot: &Foot,
        offset_B: &Vector3<f64>,
        crossing: Crossing,
        is_free: &mut [bool; 2],
        rest: &mut Rest,
    ) -> Option<Step> {
        for (d, is_free) in is_free.iter_mut().enumerate() {
            let edge = match foot.at[d] {
                0.0 => 2 * d,
                1.0 => 2 * d + 1,
                _ => continue,
            };
            // Square to the edge, as the patch beyond will see it: where parameters run askew, rounding would send a
            // descent to and fro.
            if self.inward(foot, edge as u8).dot(offset_B) >= 0.0 {
                continue;
            }
            *is_free = false;
            match self.beyond(foot, edge, offset_B) {
                Border::Rim => *rest = Rest::Rim,
                Border::Patch { foot: beyond, edge: edge_beyond, is_smooth, leads_down } => {
                    let crease = Crease { edge: edge as u8, beyond, edge_beyond };
                    if is_smooth {
                        if leads_down {
                            return Some(Step::Over(beyond));
                        }
                    } else if crossing == Crossing::Smooth {
                        *rest = Rest::Crease(crease);
                        return Some(Step::End);
                    } else if leads_down {
                        return Some(Step::Over(beyond));
                    } else {
                        *rest = Rest::Crease(crease);
                    }
                }
                Border::Pole(pole) => match self.over_pole(foot, pole, offset_B) {
                    Some(beyond) => return Some(Step::Over(beyond)),
                    None => {
                        if self.poles[pole as usize].is_sharp {
                            *rest = Rest::Tip(pole);
                        }
                        return Some(Step::End);
                    }
                },
            }
        }
        None
    }

    /// One safeguarded step within the patch.
    #[inline]
    fn step(
        &self,
        foot: &Foot,
        offset_B: &Vector3<f64>,
        target_B: &Vector3<f64>,
        slope: [f64; 2],
        is_free: [bool; 2],
        steps: &mut u32,
    ) -> Moved {
        let here = &foot.local;
        let room: Room = [0, 1].map(|d| if is_free[d] { [-foot.at[d], 1.0 - foot.at[d]] } else { [0.0; 2] });
        let (full, is_newton) = newton(here, offset_B, slope, is_free, &room);
        let full_m = (here.du * full[0] + here.dv * full[1]).norm();
        let square = offset_B.norm_squared();
        if full_m.is_nan() || full_m <= ARRIVED * self.extent_m {
            let off = if is_newton { None } else { self.off_the_ridge(foot, offset_B, target_B, steps) };
            return off.map_or(Moved::Arrived(*foot), Moved::To);
        }
        let mut share = within(full, &self.patches[foot.patch as usize].longest_step);
        for _ in 0..MAX_HALVINGS {
            *steps += 1;
            let next = self.foot(foot.patch, moved(foot.at, full, share), foot.side);
            // So short a step of Newton's is right although its gain drowns in rounding.
            let is_short = full_m * share <= SHORT * self.extent_m;
            if (target_B - next.local.point_B).norm_squared() < square || (is_newton && is_short) {
                let is_last = is_newton && full_m <= LAST * self.extent_m && share == 1.0;
                return if is_last { Moved::Arrived(next) } else { Moved::To(next) };
            }
            if is_short {
                break;
            }
            share *= 0.5;
        }
        Moved::Arrived(*foot)
    }

    /// Straight above the target nothing leads down at first, yet every way does: a god-object that was pushed through
    /// the middle of a ball must not stay on its far side.
    #[cold]
    fn off_the_ridge(
        &self,
        foot: &Foot,
        offset_B: &Vector3<f64>,
        target_B: &Vector3<f64>,
        steps: &mut u32,
    ) -> Option<Foot> {
        let here = &foot.local;
        let falls = |dd: &Vector3<f64>, d: &Vector3<f64>| divided(offset_B.dot(dd), d.norm_squared());
        let d = usize::from(falls(&here.dvv, &here.dv) > falls(&here.duu, &here.du));
        let longest = self.patches[foot.patch as usize].longest_step[d];
        [longest, -longest].into_iter().find_map(|step| {
            *steps += 1;
            let mut at = foot.at;
            at[d] = (at[d] + 0.25 * step).clamp(0.0, 1.0);
            let next = self.foot(foot.patch, at, foot.side);
            let square = (target_B - next.local.point_B).norm_squared();
            (square < offset_B.norm_squared() * (1.0 - 1e-12)).then_some(next)
        })
    }
}

enum Step {
    Over(Foot),
    End,
}

enum Moved {
    To(Foot),
    Arrived(Foot),
}

/// How far each parameter may go back and forth.
type Room = [[f64; 2]; 2];

/// The step along the free parameters, and whether it is Newton's own.
///
/// Where it would leave the patch it ends at the border, and the other parameter does what is best there: cut short as a
/// whole it would end at once when it runs along a border that is bent.
#[inline]
fn newton(
    here: &super::local::Local,
    offset_B: &Vector3<f64>,
    slope: [f64; 2],
    is_free: [bool; 2],
    room: &Room,
) -> ([f64; 2], bool) {
    let (uu, uv, vv) = (here.du.norm_squared(), here.du.dot(&here.dv), here.dv.norm_squared());
    let (a, b, c) =
        (uu - offset_B.dot(&here.duu), uv - offset_B.dot(&here.duv), vv - offset_B.dot(&here.dvv));
    // One parameter, while the other one goes `other`.
    let alone = |slope: f64, newton: f64, mixed: f64, plain: f64, plain_mixed: f64, other: f64| {
        if newton > LEAST_PIVOT * plain {
            (divided(slope - mixed * other, newton), true)
        } else {
            (divided(slope - plain_mixed * other, plain), false)
        }
    };
    let u_beside = |other: f64| alone(slope[0], a, b, uu, uv, other);
    let v_beside = |other: f64| alone(slope[1], c, b, vv, uv, other);
    let (step, is_newton) = match is_free {
        [true, true] => {
            let (det, plain) = (a * c - b * b, uu * vv - uv * uv);
            let least = LEAST_PIVOT * LEAST_PIVOT * uu * vv;
            if a > LEAST_PIVOT * uu && det > LEAST_PIVOT * plain && det > least {
                ([(slope[0] * c - slope[1] * b) / det, (slope[1] * a - slope[0] * b) / det], true)
            } else if plain > least {
                ([(slope[0] * vv - slope[1] * uv) / plain, (slope[1] * uu - slope[0] * uv) / plain], false)
            } else {
                // Both derivatives point the same way.
                ([0.5 * divided(slope[0], uu), 0.5 * divided(slope[1], vv)], false)
            }
        }
        [true, false] => {
            let (step, is_newton) = u_beside(0.0);
            ([step, 0.0], is_newton)
        }
        [false, true] => {
            let (step, is_newton) = v_beside(0.0);
            ([0.0, step], is_newton)
        }
        [false, false] => ([0.0; 2], true),
    };
    let fits = |d: usize, step: f64| room[d][0] <= step && step <= room[d][1];
    if fits(0, step[0]) && fits(1, step[1]) {
        return (step, is_newton);
    }
    let cut = |d: usize, step: f64| step.clamp(room[d][0], room[d][1]);
    if !fits(0, step[0]) {
        let u = cut(0, step[0]);
        let (v, is_newton) = if is_free[1] { v_beside(u) } else { (0.0, true) };
        ([u, cut(1, v)], is_newton && fits(1, v))
    } else {
        let v = cut(1, step[1]);
        let (u, is_newton) = if is_free[0] { u_beside(v) } else { (0.0, true) };
        ([cut(0, u), v], is_newton && fits(0, u))
    }
}

fn divided(slope: f64, square: f64) -> f64 {
    if square > 0.0 { slope / square } else { 0.0 }
}

/// The share of a step that is long enough.
#[inline]
fn within(step: [f64; 2], longest: &[f64; 2]) -> f64 {
    let share = |d: usize| if step[d].abs() > longest[d] { longest[d] / step[d].abs() } else { 1.0 };
    share(0).min(share(1))
}

#[inline]
fn moved(at: [f64; 2], step: [f64; 2], share: f64) -> [f64; 2] {
    std::array::from_fn(|d| {
        let x = at[d] + step[d] * share;
        // What is within rounding of a border is at it: it would never be reached else.
        if x < AT_BORDER {
            0.0
        } else if x > 1.0 - AT_BORDER {
            1.0
        } else {
            x
        }
    })
}

/// Shares of the extent: a step that is rounding, one behind which the next is rounding, and one too short to judge by
/// the distance.
const ARRIVED: f64 = 1e-16;
const LAST: f64 = 3e-8;
const SHORT: f64 = 1e-7;
const AT_BORDER: f64 = 1e-15;
const MAX_HALVINGS: u32 = 12;
/// Below this share of the surface's own metric the curvature is not to be trusted.
const LEAST_PIVOT: f64 = 1e-3;
