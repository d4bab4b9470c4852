//! Walks a god-object over patches, along edges and into corners, towards where friction lets it rest.
//!
//! Problem: the god-object is drawn to the rim of the friction circle, and the way there may lead over edges. Melder
//! (ch. 9.3.2) finds it stuck on each edge for a tick, and repeats the transitions until nothing changes any more.
//!
//! Model: each round looks at what holds the HIP back here ([`super::stand`]) and goes straight along that patch's
//! tangent plane, or along the edge's tangent, and back onto all patches that hold it ([`super::advance`]). On curved patches
//! the rim is sought by secants, as on single shapes (`slide.rs`). Where it gets nowhere, or comes upon a patch all but parallel
//! to one that holds, it tries out steps ([`super::detour`]); where none is possible all of the spring is felt.
//!
//! Frames and signs: object frame B; forces are springs on the user (m). Normals point to the free side.
//! Invariants: the god-object is on the boundary. Cost: one to four rounds in common ticks; bounded by
//! [`MAX_ROUNDS`], at which the god-object waits where it is and goes on in the next tick.

use nalgebra::Vector3;

use super::Csg;
use super::advance::{Glided, Moved, Target, advance, glide};
use super::detour::{Detour, detour, is_tight};
use super::foresight::foresee;
use super::god::God;
use super::settle::settle;
use super::stand::{Stood, all_around, stand};
use crate::friction_law::FrictionLaw;
use crate::slide::{Secant, Slid, Slider};

/// Goes on from where the god-object stands until nothing draws it any further; `None` if it is free and gone.
#[inline(always)]
pub(super) fn walk<L: FrictionLaw + ?Sized>(
    csg: &Csg,
    god: &mut God,
    stood: Stood,
    slider: &Slider<'_, L>,
) -> Option<Slid> {
    let input = slider.input;
    let Stood { view, mut looks } = stood;
    let mut round = slider.look(view, &Vector3::zeros(), &god.point_B);
    let (mut secant, mut shortened) = (Secant::default(), 1.0);
    let mut bars = Bars::default();
    let mut longest = f64::NAN;
    // Force ratio with which it already slides: a curve that falls with speed may hold what rests, but not what slides.
    let mut slides_with = None;
    for rounds in 0..MAX_ROUNDS {
        if round.asked_m > 0.0 && round.view.load_m > 0.0 {
            slides_with = Some((round.gap_m - round.asked_m) / round.view.load_m);
        }
        // Of a secant search even an overshoot is asked back.
        let is_first = longest.is_nan();
        if is_first && round.is_inside_the_circle() {
            return Some(slider.rested(&round, rounds));
        }
        let has_arrived = round.asked_m.is_nan() || round.asked_m.abs() <= round.view.rest_m;
        if has_arrived && !bars.may_hide_a_way(csg, god, &input.hip_B) {
            return Some(round.arrived(rounds));
        }
        if !has_arrived && bars.leave_no_way() {
            return Some(held_here(god, slider, rounds));
        }
        if has_arrived || bars.are_met() {
            let at_most_m = if has_arrived { csg.ledge_m() } else { round.asked_m };
            match detour(csg, god, &input.hip_B, at_most_m) {
                Detour::Along(other) => *god = other,
                Detour::Free if !csg.is_inside(&input.hip_B) => return None,
                Detour::None | Detour::Free if has_arrived => return Some(round.arrived(rounds)),
                Detour::None | Detour::Free if bars.have_stopped_it() => {
                    return Some(held_here(god, slider, rounds));
                }
                Detour::None | Detour::Free => {
                    bars.is_grazing = false;
                    continue;
                }
            }
            bars.passed();
            let stood = stand(csg, god, input)?;
            looks = stood.looks;
            round = slider.look(stood.view, &Vector3::zeros(), &god.point_B);
            (secant, longest) = (Secant::default(), f64::NAN);
            continue;
        }
        if is_first {
            longest = slider.longest(&round, &god.point_B);
        }
        let step_m = shortened * secant.step(round.asked_m, round.view.depth_m);
        // From within a bore, the HIP far behind its wall, tangents overshoot; the wall's nearest place is known.
        let foot =
            || Target { point_B: settle(csg, god, god.active, &input.hip_B, &input.hip_B), looks: None };
        let is_in_hollow = is_first && round.asked_m == round.gap_m && god.is_in_hollow(csg);
        let seen = match is_first {
            true if is_in_hollow => Some(foot()),
            true => foresee(csg, god, &round, looks.take(), &input.hip_B),
            false => None,
        };
        let is_seen = seen.is_some();
        let target = seen.unwrap_or_else(|| Target { point_B: round.target_B(step_m), looks: None });
        let (before_B, held_before) = (god.point_B, god.held_patches());
        let (moved, view) = match glide(csg, god, &target, longest, input) {
            Glided::There(view) => (Moved::There, Some(view)),
            Glided::TooFar => (Moved::TooFar, None),
            Glided::Not => (advance(csg, god, &target.point_B, longest, &input.hip_B), None),
        };
        if moved == Moved::TooFar {
            if round.asked_m < 0.0 && round.gap_m > 0.0 {
                return Some(slider.went_too_far(&round, rounds));
            }
            shortened *= 0.5;
            continue;
        }
        shortened = 1.0;
        if !is_seen {
            secant.made(round.asked_m, step_m);
        }
        let has_glided = view.is_some();
        let view = match view {
            Some(view) => view,
            None => {
                let stood = stand(csg, god, input)?;
                looks = stood.looks;
                stood.view
            }
        };
        let is_same = has_glided || moved == Moved::There && god.held_patches() == held_before;
        if is_same {
            round = slider.look(view, &round.direction_B, &god.point_B);
            continue;
        }
        let is_stalled = (god.point_B - before_B).amax() <= csg.tolerance_m();
        round = slider.look(view, &Vector3::zeros(), &god.point_B);
        bars.meet(is_stalled, moved == Moved::Grazing || !god.is_before_walls());
        if let (Some(ratio), true) = (slides_with, round.asked_m <= 0.0) {
            round.asked_m = round.gap_m - ratio * round.view.load_m;
        }
        (secant, longest) = (Secant::default(), f64::NAN);
    }
    Some(if round.asked_m == round.gap_m {
        // Without friction, even beyond where it was to go.
        held_here(god, slider, MAX_ROUNDS)
    } else if round.asked_m < 0.0 {
        slider.went_too_far(&round, MAX_ROUNDS)
    } else {
        round.arrived(MAX_ROUNDS)
    })
}

/// What a walk came upon that tangent planes do not explain.
#[derive(Default)]
struct Bars {
    /// Stops one after the other without getting anywhere.
    stalls: u32,
    is_grazing: bool,
    detours: u32,
}

impl Bars {
    #[inline]
    fn meet(&mut self, is_stalled: bool, is_grazing: bool) {
        self.stalls = if is_stalled { self.stalls + 1 } else { 0 };
        self.is_grazing = is_grazing;
    }

    fn passed(&mut self) {
        *self = Self { detours: self.detours + 1, ..Self::default() };
    }

    fn are_met(&self) -> bool {
        self.detours < MAX_DETOURS && (self.is_grazing || self.have_stopped_it())
    }

    fn leave_no_way(&self) -> bool {
        self.detours >= MAX_DETOURS && self.have_stopped_it()
    }

    fn have_stopped_it(&self) -> bool {
        self.stalls >= MAX_STALLS
    }

    /// Whether it may have come to rest before a ledge that is too low to be one.
    #[inline(always)]
    fn may_hide_a_way(&self, csg: &Csg, god: &God, hip_B: &Vector3<f64>) -> bool {
        god.active.count_ones() > 1
            && god.clearing.room_m(&god.point_B) < csg.tight_m()
            && self.detours < MAX_DETOURS
            && is_tight(csg, god, hip_B)
    }
}

/// Of a god-object that cannot come nearer to the HIP, whatever friction says: all of its spring.
fn held_here<L: FrictionLaw + ?Sized>(god: &God, slider: &Slider<'_, L>, rounds: u32) -> Slid {
    let view = all_around(&god.point_B, slider.input);
    slider.look(view, &Vector3::zeros(), &god.point_B).arrived(rounds)
}

/// Bound on the rounds of one walk.
const MAX_ROUNDS: u32 = 64;
/// Stops one after the other without getting anywhere, after which something bars the walk.
const MAX_STALLS: u32 = 3;
/// Bound on the detours of one walk.
const MAX_DETOURS: u32 = 12;
