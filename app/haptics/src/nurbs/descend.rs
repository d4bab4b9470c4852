//! Goes down to a point of the surface that is locally the nearest to a target, over patch borders.
//!
//! Model: Newton's method on `|S(u, v) - target|^2`. Where its matrix is not positive the curvature is left out
//! (Gauss and Newton), so that every step leads down; steps that do not are halved. At a border the descent goes on in
//! the patch beyond if that leads farther down; at a point that an edge has shrunk to, in the direction that does most.
//! The derivatives at hand are a picture of the surroundings, right to the second order: a step is mended on it before
//! the surface is looked at again, and the last one, which is too short to tell the picture from the surface, is made
//! on it alone.
//! That is where a frictionless god-object goes, and where Melder eq. 4.12-4.14 bring one back to.
//!
//! Invariants: the distance never grows but by rounding; the answer is on the surface. What the bound ends goes on in
//! the next tick from where it is.
//! Cost: begun near the answer, one step, which is one look at the surface; at most [`MAX_STEPS`].

use nalgebra::Vector3;

use super::Nurbs;
use super::foot::Foot;
use super::local::Local;
use super::seams::Border;

/// What kept a foot where its descent ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Rest {
    /// Nothing: no direction leads down.
    Smooth,
    /// The surface ends.
    Rim,
    /// A sharp edge: this one of the foot's patch.
    Crease(u8),
    /// A sharp point.
    Tip(u32),
}

/// Which edges a descent crosses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Crossing {
    /// All that lead on.
    All,
    /// None that can be felt: it ends there.
    Smooth,
    /// None that can be felt: it goes along them.
    Along,
}

/// Bound on the looks at the surface of one descent.
pub(super) const MAX_STEPS: u32 = 64;

impl Nurbs {
    /// Takes `foot` down; what keeps it there.
    pub(super) fn descend(&self, target_B: &Vector3<f64>, foot: &mut Foot, crossing: Crossing) -> Rest {
        let mut steps = 0;
        while steps < MAX_STEPS {
            let offset_B = target_B - foot.local.point_B;
            let mut rest = Rest::Smooth;
            let mut is_free = [true; 2];
            if is_at_border(&foot.at) {
                match self.at_borders(foot, &offset_B, crossing, &mut is_free, &mut rest) {
                    Some(Step::Over(beyond)) => {
                        steps += 1;
                        *foot = beyond;
                        continue;
                    }
                    Some(Step::End) => return rest,
                    None => {}
                }
            }
            if self.step(foot, &offset_B, is_free, &mut steps) == Moved::Arrived {
                return self.settled(foot, rest);
            }
        }
        Rest::Smooth
    }

    /// A last step may have left the border that held it.
    fn settled(&self, foot: &Foot, rest: Rest) -> Rest {
        if is_at_border(&foot.at) { rest } else { Rest::Smooth }
    }

    /// What borders do to a descent that stands at one and wants to leave the patch.
    #[inline(never)]
    fn at_borders(
        &self,
        foot: &Foot,
        offset_B: &Vector3<f64>,
        crossing: Crossing,
        is_free: &mut [bool; 2],
        rest: &mut Rest,
    ) -> Option<Step> {
        let pole_at_corner = self.pole_at_corner(foot);
        if let Some(pole) = pole_at_corner
            && crossing == Crossing::All
        {
            return Some(self.at_pole(foot, pole, offset_B, rest));
        }
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
                Border::Patch { foot: beyond, is_smooth, leads_down, .. } => {
                    if is_smooth {
                        if leads_down {
                            return Some(Step::Over(beyond));
                        }
                    } else if crossing == Crossing::All && leads_down {
                        return Some(Step::Over(beyond));
                    } else {
                        *rest = Rest::Crease(edge as u8);
                        if crossing == Crossing::Smooth {
                            return Some(Step::End);
                        }
                    }
                }
                Border::Pole(pole) => return Some(self.at_pole(foot, pole, offset_B, rest)),
            }
        }
        let pole = pole_at_corner.filter(|_| *is_free == [false; 2])?;
        self.over_pole(foot, pole, offset_B).map(Step::Over)
    }

    /// From a pole on; or it ends there.
    fn at_pole(&self, foot: &Foot, pole: u32, offset_B: &Vector3<f64>, rest: &mut Rest) -> Step {
        match self.over_pole(foot, pole, offset_B) {
            Some(beyond) => Step::Over(beyond),
            None => {
                if self.poles[pole as usize].is_sharp {
                    *rest = Rest::Tip(pole);
                }
                Step::End
            }
        }
    }

    /// One safeguarded step within the patch.
    #[inline(always)]
    fn step(&self, foot: &mut Foot, offset_B: &Vector3<f64>, is_free: [bool; 2], steps: &mut u32) -> Moved {
        let here = foot.local;
        let slope = [offset_B.dot(&here.du), offset_B.dot(&here.dv)];
        let room: Room = [0, 1].map(|d| if is_free[d] { [-foot.at[d], 1.0 - foot.at[d]] } else { [0.0; 2] });
        let (full, is_newton) = newton(&here, offset_B, slope, is_free, &room);
        let full_m = (here.du * full[0] + here.dv * full[1]).norm();
        let square = offset_B.norm_squared();
        if full_m.is_nan() || full_m <= ARRIVED * self.extent_m {
            return if is_newton { Moved::Arrived } else { self.off_the_ridge(foot, offset_B, steps) };
        }
        let longest = &self.patches[foot.patch as usize].longest_step;
        let span = (full[0].abs() / longest[0]).max(full[1].abs() / longest[1]);
        let mut share = if span > 1.0 { 1.0 / span } else { 1.0 };
        let is_mendable = is_newton && share == 1.0 && is_free == [true; 2];
        let full = if is_mendable { mended(&here, offset_B, full, &room) } else { full };
        // What Newton's steps leave falls with the share of an element they cover, not with their length: by a pole the
        // shortest may lead far round.
        let left_m = full_m * if is_mendable { span * span } else { span };
        let is_last = is_newton && left_m <= ARRIVED * self.extent_m;
        if is_last && self.nudge(foot, full) {
            return Moved::Arrived;
        }
        let target_B = here.point_B + offset_B;
        for _ in 0..MAX_HALVINGS {
            *steps += 1;
            let next = self.foot(foot.patch, moved(foot.at, full, share), foot.side);
            // So short a step of Newton's is right although its gain drowns in rounding.
            let is_short = full_m * share <= SHORT * self.extent_m && span <= SMALL;
            if (target_B - next.local.point_B).norm_squared() < square || (is_newton && is_short) {
                // A border that it has just come to has yet to say what lies beyond.
                let is_come =
                    (0..2).any(|d| next.at[d] != foot.at[d] && (next.at[d] == 0.0 || next.at[d] == 1.0));
                *foot = next;
                return if is_last && share == 1.0 && !is_come { Moved::Arrived } else { Moved::On };
            }
            if is_short {
                break;
            }
            share *= 0.5;
        }
        Moved::Arrived
    }

    /// Makes a step so short that the derivatives at hand tell all there is to know about where it ends; whether it was.
    #[inline]
    fn nudge(&self, foot: &mut Foot, step: [f64; 2]) -> bool {
        let longest = &self.patches[foot.patch as usize].longest_step;
        let share = (step[0].abs() / longest[0]).max(step[1].abs() / longest[1]);
        let at = moved(foot.at, step, 1.0);
        // Beyond a knot other polynomials hold, and what lies at a border must be there to the last digit.
        let is_told = foot.blur + share <= NUDGE
            && !is_at_border(&at)
            && self.is_in_one_element(foot.patch, &foot.at, &at);
        if is_told {
            let local = foot.local.moved([at[0] - foot.at[0], at[1] - foot.at[1]]);
            let blur = foot.blur + share;
            *foot = Foot { blur, ..self.foot_of_local(foot.patch, at, foot.side, local) };
        }
        is_told
    }

    /// Straight above the target nothing leads down at first, yet every way does: a god-object that was pushed through
    /// the middle of a ball must not stay on its far side.
    #[cold]
    fn off_the_ridge(&self, foot: &mut Foot, offset_B: &Vector3<f64>, steps: &mut u32) -> Moved {
        let here = &foot.local;
        let target_B = here.point_B + offset_B;
        let falls = |dd: &Vector3<f64>, d: &Vector3<f64>| divided(offset_B.dot(dd), d.norm_squared());
        let d = usize::from(falls(&here.dvv, &here.dv) > falls(&here.duu, &here.du));
        let longest = self.patches[foot.patch as usize].longest_step[d];
        for step in [longest, -longest] {
            *steps += 1;
            let mut at = foot.at;
            at[d] = (at[d] + 0.25 * step).clamp(0.0, 1.0);
            let next = self.foot(foot.patch, at, foot.side);
            let square = (target_B - next.local.point_B).norm_squared();
            if square < offset_B.norm_squared() * (1.0 - 1e-12) {
                *foot = next;
                return Moved::On;
            }
        }
        Moved::Arrived
    }
}

#[expect(
    clippy::large_enum_variant,
    reason = "lives on the stack for a moment; a box would allocate in a tick"
)]
enum Step {
    Over(Foot),
    End,
}

#[derive(PartialEq)]
enum Moved {
    On,
    Arrived,
}

/// How far each parameter may go back and forth.
type Room = [[f64; 2]; 2];

/// The step along the free parameters, and whether it is Newton's own.
///
/// Where it would leave the patch it ends at the border, and the other parameter does what is best there: cut short as a
/// whole it would end at once when it runs along a border that is bent.
#[inline]
fn newton(
    here: &Local,
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
            // Shares of the metric in two directions: their product and their sum, each times `plain`. The smaller one is
            // above their quotient.
            let sum = a * vv - 2.0 * b * uv + c * uu;
            if a > LEAST_PIVOT * uu && det > LEAST_PIVOT * sum && det > least {
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

/// Newton's step once more on the picture that the derivatives give of where `step` leads.
#[inline]
fn mended(here: &Local, offset_B: &Vector3<f64>, step: [f64; 2], room: &Room) -> [f64; 2] {
    let there = here.moved(step);
    let off_B = offset_B - (there.point_B - here.point_B);
    let slope = [off_B.dot(&there.du), off_B.dot(&there.dv)];
    let (more, is_newton) =
        newton(&there, &off_B, slope, [true; 2], &[[f64::NEG_INFINITY, f64::INFINITY]; 2]);
    let sum = [step[0] + more[0], step[1] + more[1]];
    let is_small = (0..2).all(|d| more[d].abs() <= 0.25 * step[d].abs().max(step[1 - d].abs()));
    let fits = (0..2).all(|d| room[d][0] < sum[d] && sum[d] < room[d][1]);
    if is_newton && is_small && fits { sum } else { step }
}

fn is_at_border(at: &[f64; 2]) -> bool {
    at.iter().any(|&x| x == 0.0 || x == 1.0)
}

fn divided(slope: f64, square: f64) -> f64 {
    if square > 0.0 { slope / square } else { 0.0 }
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

/// Shares of the extent: a step that is rounding, and one too short to judge by the distance.
const ARRIVED: f64 = 1e-16;
const SHORT: f64 = 1e-7;
/// Share of an element over which derivatives hardly change.
const SMALL: f64 = 1e-3;
const AT_BORDER: f64 = 1e-15;
/// Share of an element so short that what third derivatives add to the first ones is 1e-10 of them, and to the point
/// nothing.
const NUDGE: f64 = 1e-5;
const MAX_HALVINGS: u32 = 12;
/// Below this share of the surface's own metric the curvature is not to be trusted.
const LEAST_PIVOT: f64 = 1e-3;
