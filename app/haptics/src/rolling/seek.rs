//! Where a ball comes to rest under what draws it.
//!
//! Model: drawn along what it touches until it is at rest; then a look at whether anything else is in the way. Where
//! there is, it is pushed out of that and drawn on; where that leads nowhere, or far, the whole way is gone again with
//! care, every part of it up to what it first touches.
//!
//! Invariant: nothing is nearer to where it ends than its radius.
//! Cost: bounded by [`MOST_ROUNDS`] and [`MOST_CAREFUL_ROUNDS`]; where these end it goes on in the next tick.

use nalgebra::Vector3;

use super::ball::{Ball, Look};
use super::flight::{Flight, Work};
use super::ground::Ground;
use super::pace::Pace;
use super::roll::Leg;
use crate::friction_cone::ConeInput;
use crate::mesh::draw::{Draw, Drawn};

/// Where a ball came to rest.
pub(super) struct Rested<F> {
    pub(super) ball: Ball<F>,
    pub(super) look: Look,
    /// Tangential force over stiffness, on the user \[m\].
    pub(super) tangential_B: Vector3<f64>,
}

/// How a search for rest ended.
#[expect(clippy::large_enum_variant, reason = "it is looked at at once, and a tick must not allocate")]
enum Sought<F> {
    Rested(Rested<F>),
    /// At the HIP.
    Free,
    /// It has to be done again, with more care.
    Unsure,
}

/// Where a ball comes to rest under what draws it; `None` if it is free.
///
/// At first without looking at what else may be in the way: on most ticks one look at the end is enough.
#[inline(always)]
pub(super) fn seek<G: Ground, D: Draw>(
    ground: &G,
    start: &Ball<G::Foot>,
    draw: impl Fn() -> D,
    is_frictionless: bool,
    vicinity: &mut G::Vicinity,
    input: &ConeInput,
) -> Option<Rested<G::Foot>> {
    match seek_with(ground, start, &draw(), is_frictionless, false, Some(vicinity), input) {
        Sought::Rested(rested) => Some(rested),
        Sought::Free => None,
        Sought::Unsure => match seek_carefully(ground, start, &draw(), is_frictionless, input) {
            Sought::Rested(rested) => Some(rested),
            _ => None,
        },
    }
}

#[inline(never)]
fn seek_carefully<G: Ground>(
    ground: &G,
    start: &Ball<G::Foot>,
    draw: &impl Draw,
    is_frictionless: bool,
    input: &ConeInput,
) -> Sought<G::Foot> {
    seek_with(ground, start, draw, is_frictionless, true, None, input)
}

#[inline(always)]
fn seek_with<G: Ground>(
    ground: &G,
    start: &Ball<G::Foot>,
    draw: &impl Draw,
    is_frictionless: bool,
    is_careful: bool,
    mut vicinity: Option<&mut G::Vicinity>,
    input: &ConeInput,
) -> Sought<G::Foot> {
    let mut ball = *start;
    let mut pushes_left = MOST_PUSHES;
    let mut met_something = false;
    let work = Work::default();
    let mut pace = Pace::default();
    let rounds = if is_careful { MOST_CAREFUL_ROUNDS } else { MOST_ROUNDS };
    let mut sees = None;
    // Where it was last before it moved.
    let mut from_B = start.centre_B;
    // Where it last touched all that carried a load.
    let mut settled = None;
    for _ in 0..rounds {
        let look = ball.look(ground, input);
        if G::IS_BENT && is_careful && ball.touches_all_that_holds_it() {
            settled = Some(ball);
        }
        if look.is_free {
            if !is_careful {
                return Sought::Unsure;
            }
            let Some(flown) = ball.flown_to(ground, &input.hip_B, Flight::OF_A_BALL_THAT_TOUCHES) else {
                break;
            };
            if flown.rests().is_empty() && flown.centre_B == input.hip_B {
                return Sought::Free;
            }
            (ball, sees) = (flown, None);
            if ball.rests().is_empty() {
                // Still in flight; it goes on in the next tick.
                break;
            }
            continue;
        }
        let Drawn { target_B, is_at_rest, tangential_B } =
            draw.drawn(&look.view, &(start.centre_B - ball.centre_B));
        sees = Some((look, tangential_B));
        let centre_B = ball.centre_B;
        let target_B =
            if G::IS_BENT { centre_B + pace.step(&centre_B, &(target_B - centre_B)) } else { target_B };
        if is_at_rest {
            let Some(vicinity) = vicinity.as_deref_mut().filter(|_| ball.centre_B != start.centre_B) else {
                break;
            };
            if met_something && !ball.is_on_all_that_holds_it(ground) {
                return Sought::Unsure;
            }
            match ball.obstacle_near(ground, vicinity, &start.centre_B) {
                Ok(None) if G::IS_BENT && !ball.touches_all_that_holds_it() => return Sought::Unsure,
                Ok(None) => return Sought::Rested(Rested { ball, look, tangential_B }),
                Ok(Some(obstacle)) if pushes_left > 0 => {
                    pushes_left -= 1;
                    met_something = true;
                    let way = Leg { from_B, is_frictionless };
                    ball = ball.pushed_out_of(ground, &obstacle, &way);
                    // What the last step took away was of another slide.
                    (sees, pace) = (None, Pace::default());
                    if ball.strayed(start) {
                        return Sought::Unsure;
                    }
                    continue;
                }
                _ => return Sought::Unsure,
            }
        }
        if is_careful {
            let before = (ball.centre_B, ball.rests().len());
            let seat = (G::IS_BENT && is_frictionless).then(|| ball.seat(ground, &input.hip_B)).flatten();
            let target_B = seat.map_or(target_B, |seat| ball.towards(&seat));
            ball = ball.rolled_until(ground, &target_B, &work);
            if before == (ball.centre_B, ball.rests().len()) {
                break;
            }
            sees = None;
            if work.is_enough() {
                break;
            }
            continue;
        }
        let seat = is_frictionless.then(|| ball.seat(ground, &input.hip_B)).flatten();
        if G::IS_BENT && seat.is_some_and(|seat| !seat.is_within_half_a_radius_of(&ball)) {
            return Sought::Unsure;
        }
        if let Some(seat) = seat.filter(|seat| seat.is_within_half_a_radius_of(&ball)) {
            ball = seat;
            sees = None;
        } else {
            from_B = centre_B;
            let rolled = ball.rolled_to(ground, &target_B);
            met_something |= rolled.is_blocked;
            let way = Leg { from_B, is_frictionless };
            ball = if rolled.is_blocked { ball.in_the_fold(ground, &target_B, &way) } else { rolled };
            sees = None;
        }
        if ball.strayed(start) {
            return Sought::Unsure;
        }
    }
    if let Some(vicinity) = vicinity.filter(|_| ball.centre_B != start.centre_B)
        && (met_something || !matches!(ball.obstacle_near(ground, vicinity, &start.centre_B), Ok(None)))
    {
        return Sought::Unsure;
    }
    if G::IS_BENT && !sees_all_that_holds(&mut ball, &sees, ground, input) {
        if !is_careful {
            return Sought::Unsure;
        }
        (ball, sees) = (ball.on_what_holds_it(ground), None);
        // In a hollow of about its own radius all is about as near: there it may not settle in any number of steps.
        if !sees_all_that_holds(&mut ball, &sees, ground, input) {
            ball = settled.unwrap_or(ball);
        }
    }
    let (look, tangential_B) = match sees {
        Some(sees) => sees,
        None => {
            let look = ball.look(ground, input);
            let drawn = draw.drawn(&look.view, &(start.centre_B - ball.centre_B));
            (look, drawn.tangential_B)
        }
    };
    Sought::Rested(Rested { ball, look, tangential_B })
}

/// Whether it touches all that would carry a load if the tick ended here.
fn sees_all_that_holds<G: Ground>(
    ball: &mut Ball<G::Foot>,
    sees: &Option<(Look, Vector3<f64>)>,
    ground: &G,
    input: &ConeInput,
) -> bool {
    if sees.is_none() {
        ball.look(ground, input);
    }
    ball.touches_all_that_holds_it()
}

const MOST_ROUNDS: u32 = 8;
/// How often a ball that came to rest too near to something new is pushed out of that before it is done with care.
const MOST_PUSHES: u32 = 3;
const MOST_CAREFUL_ROUNDS: u32 = 48;
