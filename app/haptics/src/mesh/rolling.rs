//! A ball in contact with a mesh, or near it (Melder ch. 6.3.1 and 9.2).
//!
//! Problem: a finger with volume rolls over edges instead of falling off them, touches several features of a concave
//! surface at once, and slips through no crack; at a thousand ticks a second on a million triangles.
//!
//! Model: the ball's centre C is a god-object on the mesh grown by the radius r ([`ball`]). The spring from the HIP to C
//! is shared among the touched features: its normal part is the sum of loads `l_i >= 0` along their normals
//! ([`press`]), its tangential part is bounded by friction, whose circle is that of all loads together. So two walls of
//! a groove hold a ball better than a plane does (the wedge effect), while the two faces of a nearly flat fold share one
//! load: nothing is counted twice.
//!
//! The ball is free when nothing that it touches is pressed and it can fly straight to the HIP. Friction must not hold a
//! finger that is round the corner: where the HIP lies with room for the ball around it, a frictionless ball seeks it
//! from the god-object on, and if it gets there, so does the finger.
//!
//! Frames: the mesh's own, B. Both sides of every face are felt, but a solid's ball is always outside: unlike a point it
//! sees all parts of a mesh, also those that pass through each other.
//! Invariants: nothing is nearer to C than r; C never changes sides. A bound that is reached leaves the ball where it
//! is, touching; it goes on in the next tick.
//! Cost: a few walks of the feet and one query of the hierarchy that is pruned at r; bounded.

mod ball;
mod foot;
mod press;
mod vicinity;

use nalgebra::Vector3;
use std::cell::Cell;

use self::ball::{Ball, Flight, Look, Work};
use self::foot::Foot;
use self::vicinity::Vicinity;
use super::draw::{Against, Draw, Drawn, Frictionless};
use super::{Beginning, Mesh};
use crate::algorithm::{Touch, TouchInput};
use crate::friction::Friction;
use crate::friction_cone::ConeInput;
use crate::friction_law::FrictionState;
use crate::grip::Grip;
use crate::surface::{Feature, SurfacePoint, direction_or_up};

/// State of one spherical finger towards one mesh.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct RollingCone {
    /// Which mesh, and which radius, the rest is about.
    about: Option<(u64, f64)>,
    touching: Option<Touching>,
    last_hip_B: Option<Vector3<f64>>,
    /// No face comes as near as this.
    clear: Room,
    vicinity: Vicinity,
}

/// One of the features that a ball touches, and what it does to the user.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Share {
    /// On the mesh, not where the ball's centre is.
    pub(crate) at: SurfacePoint,
    pub(crate) force_on_user_B: Vector3<f64>,
    /// Of all loads, 0 to 1.
    pub(crate) part: f64,
}

/// A contact.
#[derive(Debug, Clone, Copy)]
struct Touching {
    ball: Ball,
    grip: Grip,
    /// The frictionless ball on its way to a HIP that is outside.
    scout: Option<Ball>,
    /// Here the HIP is where no ball can be.
    tight: Room,
    /// There, it is deeper inside than the radius.
    is_inside: bool,
    /// What was answered last: tangential spring \[m\], sum of the loads \[m\] and stiffness \[N/m\].
    answered: (Vector3<f64>, f64, f64),
}

/// A ball of which something is known.
#[derive(Debug, Clone, Copy, Default)]
struct Room {
    centre_B: Vector3<f64>,
    radius_m: f64,
}

impl Room {
    fn has(&self, point_B: &Vector3<f64>, at_least_m: f64) -> bool {
        let reach_m = self.radius_m - at_least_m;
        reach_m > 0.0 && (point_B - self.centre_B).norm_squared() < reach_m * reach_m
    }
}

/// Where a ball came to rest.
struct Rested {
    ball: Ball,
    look: Look,
    /// Tangential force over stiffness, on the user \[m\].
    tangential_B: Vector3<f64>,
}

/// How a search for rest ended.
#[expect(clippy::large_enum_variant, reason = "it is looked at at once, and a tick must not allocate")]
enum Sought {
    Rested(Rested),
    /// At the HIP.
    Free,
    /// It has to be done again, with more care.
    Unsure,
}

impl RollingCone {
    /// One tick; `None` while the finger is free.
    #[inline(never)]
    pub(crate) fn update(&mut self, mesh: &Mesh, input: &TouchInput<'_>) -> Option<(Touch, Beginning)> {
        let radius_m = input.finger_radius_m;
        let about = Some((mesh.identity, radius_m));
        if self.about != about {
            *self = Self { about, ..Self::default() };
        }
        let last_hip_B = self.last_hip_B.replace(input.cone.hip_B);
        let mut beginning = Beginning::Came;
        if self.touching.is_none() {
            let (ball, how) = self.meet(mesh, input, last_hip_B)?;
            beginning = how;
            self.touching = Some(Touching::new(ball));
        }
        let touching = self.touching.as_mut()?;
        let felt = touching.update(mesh, input.friction, &mut self.vicinity, &input.cone);
        if felt.is_none() {
            self.touching = None;
        }
        felt.map(|touch| (touch, beginning))
    }

    /// Whether a contact lives.
    pub(crate) fn is_touching(&self) -> bool {
        self.touching.is_some()
    }

    /// The features that it presses on, in this tick; friction is shared out as the loads are.
    pub(crate) fn shares(&self) -> impl Iterator<Item = Share> {
        let touching = self.touching.as_ref();
        let (tangential_B, load_m, k) = touching.map_or_else(Default::default, |touching| touching.answered);
        let rests = touching.map_or(&[][..], |touching| touching.ball.rests());
        rests.iter().filter(|rest| rest.load_m > 0.0).map(move |rest| {
            let part = rest.load_m / load_m;
            let spring_B = rest.normal_B * rest.load_m + tangential_B * part;
            let Foot { point_B, feature, face, .. } = rest.foot;
            let at = SurfacePoint { point_B, normal_B: rest.normal_B, feature, piece: face };
            Share { at, force_on_user_B: spring_B * k, part }
        })
    }

    /// Ends the contact.
    pub(crate) fn let_go(&mut self) {
        if self.touching.is_some() {
            *self = Self::default();
        }
    }

    #[inline(never)]
    fn meet(
        &mut self,
        mesh: &Mesh,
        input: &TouchInput<'_>,
        last_hip_B: Option<Vector3<f64>>,
    ) -> Option<(Ball, Beginning)> {
        let (hip_B, radius_m) = (input.cone.hip_B, input.finger_radius_m);
        // A mesh that was placed elsewhere was not met on the way there.
        let is_elsewhere = |from_B: &Vector3<f64>| {
            last_hip_B.is_none_or(|last_B| (from_B - last_B).amax() > SAME_PLACE * mesh.extent_m())
        };
        if let Some(from_B) = input.previous_hip_B.filter(|from_B| !is_elsewhere(from_B)) {
            if self.clear.has(&from_B, radius_m) && self.clear.has(&hip_B, radius_m) {
                return None;
            }
            if let Some(ball) =
                Ball::in_free_space(from_B, radius_m).flown_to(mesh, &hip_B, Flight::TO_THE_END)
            {
                if ball.rests().is_empty() && ball.centre_B == hip_B {
                    self.clear = Room {
                        centre_B: hip_B,
                        radius_m: mesh.clearance(&hip_B, mesh.extent_m() + radius_m),
                    };
                    return None;
                }
                return Some((ball, Beginning::Came));
            }
        }
        self.clear = Room::default();
        found_inside(mesh, &hip_B, radius_m).map(|ball| (ball, Beginning::WasInside))
    }
}

/// Where a ball that is found too near to the mesh, or inside, is pushed out; `None` if it is free, or has no room.
#[cold]
fn found_inside(mesh: &Mesh, hip_B: &Vector3<f64>, radius_m: f64) -> Option<Ball> {
    let (face, point_B, out_B) = match mesh.way_out(hip_B) {
        Some(way) => (way.face, way.point_B, way.point_B - hip_B),
        None => {
            let near = mesh.nearest_within(hip_B, radius_m).ok()??;
            (near.face, near.point_B, hip_B - near.point_B)
        }
    };
    let out_m = out_B.norm();
    let has_direction = out_m > ON_THE_MESH * (radius_m + mesh.extent_m());
    let normal_B = if has_direction { out_B / out_m } else { mesh.faces.get(face as usize)?.normal_B };
    FARTHER_OUT.iter().find_map(|share| {
        let mut ball = Ball::in_free_space(point_B + normal_B * (radius_m * share), radius_m);
        for _ in 0..MOST_CORRECTIONS {
            let Some(obstacle) = ball.obstacle(mesh).ok()? else {
                return (!mesh.is_inside(&ball.centre_B)).then_some(ball);
            };
            ball.add(mesh, obstacle.face);
            ball.give_way(&{ ball.centre_B });
        }
        None
    })
}

impl Touching {
    fn new(ball: Ball) -> Self {
        Self {
            ball,
            grip: Grip::default(),
            scout: None,
            tight: Room::default(),
            is_inside: false,
            answered: Default::default(),
        }
    }

    fn update(
        &mut self,
        mesh: &Mesh,
        friction: &Friction,
        vicinity: &mut Vicinity,
        input: &ConeInput,
    ) -> Option<Touch> {
        if matches!(friction, Friction::None) {
            self.grip.state = FrictionState::Slip;
            let rested = seek(mesh, &self.ball, || Frictionless, true, vicinity, input)?;
            return Some(self.answer(&rested, input));
        }
        if self.is_out(mesh, vicinity, input) {
            return None;
        }
        let look = self.ball.look(mesh, input);
        if look.is_free {
            let rested = seek(mesh, &self.ball, || Frictionless, true, vicinity, input)?;
            return Some(self.answer(&rested, input));
        }
        let pull = self.grip.begin_tick(&look.view, input);
        if let Some(tangential_B) = self.grip.hold(friction, &look.view, &pull, input) {
            return Some(self.answer(&Rested { ball: self.ball, look, tangential_B }, input));
        }
        let memory = &self.grip.memory;
        let against = || Against { friction, memory, pull: &pull, input, slides_with: Cell::new(None) };
        let mut rested = seek(mesh, &self.ball, against, false, vicinity, input)?;
        rested.tangential_B +=
            self.grip.drag(friction, &rested.tangential_B, &rested.look.view, &pull, input);
        Some(self.answer(&rested, input))
    }

    /// Whether the finger is round the corner, whatever friction says.
    fn is_out(&mut self, mesh: &Mesh, vicinity: &mut Vicinity, input: &ConeInput) -> bool {
        let (hip_B, radius_m) = (input.hip_B, self.ball.radius_m);
        if self.tight.has(&hip_B, 0.0) {
            return false;
        }
        let Ok(near) = mesh.nearest_within(&hip_B, radius_m) else {
            // As far as can be told.
            return false;
        };
        let tight_m = match near {
            Some(near) => radius_m - near.distance_m,
            None => self.depth_inside(mesh, &hip_B),
        };
        self.is_inside = tight_m > radius_m;
        if tight_m > 0.0 {
            self.tight = Room { centre_B: hip_B, radius_m: tight_m };
            self.scout = None;
            return false;
        }
        let scout = self.scout.unwrap_or(self.ball);
        match seek(mesh, &scout, || Frictionless, true, vicinity, input) {
            Some(rested) => {
                self.scout = Some(rested.ball);
                false
            }
            None => true,
        }
    }

    /// A lower bound of how far a HIP, which has room around it, would have to go to be outside; 0 if it is.
    fn depth_inside(&self, mesh: &Mesh, hip_B: &Vector3<f64>) -> f64 {
        let radius_m = self.ball.radius_m;
        // All that the hierarchy can say cheaply, and what is known.
        let clear_m = mesh.clearance(hip_B, mesh.extent_m()).max(radius_m * (1.0 + f64::EPSILON));
        // Two balls without a face in them that overlap are on the same side.
        let was_inside =
            self.is_inside && (hip_B - self.tight.centre_B).norm() < clear_m + self.tight.radius_m;
        if was_inside || mesh.is_inside(hip_B) { clear_m } else { 0.0 }
    }

    fn answer(&mut self, rested: &Rested, input: &ConeInput) -> Touch {
        let Rested { ball, look, tangential_B } = rested;
        self.ball = *ball;
        let (feature, piece) =
            ball.primary().map_or((Feature::Face, 0), |rest| (rest.foot.feature, rest.foot.face));
        let k = input.stiffness_n_per_m;
        let is_pressed = look.view.load_m > 0.0;
        let tangential_B = ball.free_part(tangential_B);
        let spring_B = look.normal_spring_B + tangential_B;
        self.answered = (tangential_B, look.view.load_m, k);
        // In flight it has no surface.
        let is_in_flight = ball.rests().is_empty();
        let normal_B =
            if is_in_flight { direction_or_up(&(ball.centre_B - input.hip_B)) } else { look.view.normal_B };
        Touch {
            god_object: SurfacePoint { point_B: ball.centre_B, normal_B, feature, piece },
            force_on_user_B: if is_pressed { spring_B * k } else { Vector3::zeros() },
            normal_force_n: if is_pressed { k * look.normal_spring_B.norm() } else { 0.0 },
            friction: self.grip.state,
        }
    }
}

/// Where a ball comes to rest under what draws it; `None` if it is free.
///
/// At first without looking at what else may be in the way: on most ticks one look at the end is enough.
#[inline(always)]
fn seek<D: Draw>(
    mesh: &Mesh,
    start: &Ball,
    draw: impl Fn() -> D,
    is_frictionless: bool,
    vicinity: &mut Vicinity,
    input: &ConeInput,
) -> Option<Rested> {
    match seek_with(mesh, start, &draw(), is_frictionless, false, Some(vicinity), input) {
        Sought::Rested(rested) => Some(rested),
        Sought::Free => None,
        Sought::Unsure => match seek_carefully(mesh, start, &draw(), is_frictionless, input) {
            Sought::Rested(rested) => Some(rested),
            _ => None,
        },
    }
}

#[inline(never)]
fn seek_carefully(
    mesh: &Mesh,
    start: &Ball,
    draw: &impl Draw,
    is_frictionless: bool,
    input: &ConeInput,
) -> Sought {
    seek_with(mesh, start, draw, is_frictionless, true, None, input)
}

#[inline(always)]
fn seek_with(
    mesh: &Mesh,
    start: &Ball,
    draw: &impl Draw,
    is_frictionless: bool,
    is_careful: bool,
    mut vicinity: Option<&mut Vicinity>,
    input: &ConeInput,
) -> Sought {
    let mut ball = *start;
    let mut pushes_left = MOST_PUSHES;
    let mut met_something = false;
    let work = Work::default();
    let rounds = if is_careful { MOST_CAREFUL_ROUNDS } else { MOST_ROUNDS };
    let mut sees = None;
    for _ in 0..rounds {
        let look = ball.look(mesh, input);
        if look.is_free {
            if !is_careful {
                return Sought::Unsure;
            }
            let Some(flown) = ball.flown_to(mesh, &input.hip_B, Flight::OF_A_BALL_THAT_TOUCHES) else {
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
        if is_at_rest {
            let Some(vicinity) = vicinity.as_deref_mut().filter(|_| ball.centre_B != start.centre_B) else {
                break;
            };
            if met_something && !ball.is_on_all_that_holds_it(mesh) {
                return Sought::Unsure;
            }
            match ball.obstacle_near(mesh, vicinity, &start.centre_B) {
                Ok(None) => return Sought::Rested(Rested { ball, look, tangential_B }),
                Ok(Some(obstacle)) if pushes_left > 0 => {
                    pushes_left -= 1;
                    met_something = true;
                    ball = ball.pushed_out_of(mesh, obstacle.face);
                    sees = None;
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
            ball = ball.rolled_until(mesh, &target_B, &work);
            if before == (ball.centre_B, ball.rests().len()) {
                break;
            }
            sees = None;
            if work.is_enough() {
                break;
            }
            continue;
        }
        if let Some(seat) = is_frictionless.then(|| ball.seat(mesh, &input.hip_B)).flatten() {
            ball = seat;
            sees = None;
        } else {
            let rolled = ball.rolled_to(mesh, &target_B);
            met_something |= rolled.is_blocked;
            ball = if rolled.is_blocked { ball.in_the_fold(mesh, &target_B) } else { rolled };
            sees = None;
        }
        if ball.strayed(start) {
            return Sought::Unsure;
        }
    }
    if let Some(vicinity) = vicinity.filter(|_| ball.centre_B != start.centre_B)
        && (met_something || ball.obstacle_near(mesh, vicinity, &start.centre_B) != Ok(None))
    {
        return Sought::Unsure;
    }
    let (look, tangential_B) = match sees {
        Some(sees) => sees,
        None => {
            let look = ball.look(mesh, input);
            let drawn = draw.drawn(&look.view, &(start.centre_B - ball.centre_B));
            (look, drawn.tangential_B)
        }
    };
    Sought::Rested(Rested { ball, look, tangential_B })
}

/// Positions that differ by less than this share of the mesh are the same, seen through two equal poses.
const SAME_PLACE: f64 = 1e-9;
/// Nearer to the mesh than this share of it, the way out has no direction.
const ON_THE_MESH: f64 = 1e-9;
/// Where to look for room, in radii from the mesh.
const FARTHER_OUT: [f64; 5] = [1.0, 1.5, 2.5, 5.0, 10.0];
const MOST_CORRECTIONS: usize = 16;
const MOST_ROUNDS: u32 = 8;
/// How often a ball that came to rest too near to something new is pushed out of that before it is done with care.
const MOST_PUSHES: u32 = 3;
const MOST_CAREFUL_ROUNDS: u32 = 48;
