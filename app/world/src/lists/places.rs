//! Places of what is in the slow list, as the fast side has them: what is near fingers is told first, and does not leap.
//!
//! Problem: a tick takes in a bounded number of places, and a river of things has more of them than that. What a finger is
//! near has to stand where it is all the same, and must not leap while somebody looks.
//!
//! Model: the slow side knows where fingers were lately ([`Hips`]). What is near a finger has a queue of its own ([`Stands`]), of
//! which the fast side takes in most of what a tick may: no place of it waits behind others, nor others for ever. In each turn
//! the slow side tells as many places as there is room for ([`Untold`]), first those with the longest way since they were told.
//! On the fast side what is near a finger goes to its new place within a few ticks ([`Glides`]), no faster in a tick than
//! [`MOST_LEAP_M`] or twice its own speed.
//! Invariants: the fast side's part allocates nothing and is bounded in each tick.

use haptics::Entity;
use nalgebra::Vector3;
use physics::{Body, Manipulation, Standing};
use rtrb::{Consumer, Producer, RingBuffer};

/// Distance from a finger within which things are told first, and do not leap \[m\].
const NEAR_M: f64 = 0.1;
/// In a tick a thing near a finger goes no farther than this towards where it is, or than twice its own way \[m\].
const MOST_LEAP_M: f64 = 1.5e-3;
/// Of the way that is left, so much in a tick.
const SHARE: f64 = 0.5;
/// Of a tick: what is less is none.
const ROUNDING: f64 = 1e-6;
/// Nearer than this a thing is where it is to be \[m\].
const THERE_M: f64 = 1e-6;
/// A turn that leaves a place untold counts as so much of a way \[m\].
const TURN_M: f64 = 1e-4;
/// So many things go their way at once; others leap.
const MOST_GLIDES: usize = 128;
/// So many places are on their way, near fingers and elsewhere: what some ticks take in.
const MOST_STANDS: [usize; 2] = [64, 256];
/// So many are taken in in a tick, and of what is near no more than these while others wait.
const STANDS_A_TICK: usize = 32;
const NEAR_A_TICK: usize = 24;
/// So many words of where fingers are wait: one of each tick.
pub(super) const MOST_HIPS: usize = 64;
/// So many fingers are told of.
pub(super) const MOST_FINGERS: usize = crate::MAX_DEVICES;

/// Place of a body that is in the slow list, and its motion.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stand {
    pub(super) body: u32,
    /// Number of times that it had come to the slow list by then: an old one must not place a body that was away meanwhile.
    pub(super) stay: u32,
    /// The tick of the run that begins with it there.
    pub(super) as_of: u64,
    /// It does not move until the slow side says otherwise.
    pub(super) rests: bool,
    pub(super) state: Body,
}

/// The queues of places: of what is near fingers, and of all else.
pub(super) type Stands<End> = [End; 2];

pub(super) fn stands(bodies: usize) -> (Stands<Producer<Stand>>, Stands<Consumer<Stand>>) {
    let [near, far] = MOST_STANDS.map(|most| RingBuffer::new(bodies.clamp(1, most)));
    ([near.0, far.0], [near.1, far.1])
}

/// Those that a tick takes in.
pub(super) fn take([near, far]: &mut Stands<Consumer<Stand>>) -> impl Iterator<Item = Stand> {
    let mut taken = 0;
    let next = move || {
        let (first, second) =
            if taken < NEAR_A_TICK { (&mut *near, &mut *far) } else { (&mut *far, &mut *near) };
        taken += 1;
        first.pop().or_else(|_| second.pop()).ok()
    };
    std::iter::from_fn(next).take(STANDS_A_TICK)
}

/// Places of the fingers in a tick of the run.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hips {
    pub(super) run_tick: u64,
    hips_W: [Vector3<f64>; MOST_FINGERS],
    count: usize,
}

impl Hips {
    pub(super) fn none() -> Self {
        Self { run_tick: 0, hips_W: [Vector3::zeros(); MOST_FINGERS], count: 0 }
    }

    pub(super) fn clear(&mut self, run_tick: u64) {
        (self.run_tick, self.count) = (run_tick, 0);
    }

    pub(super) fn push(&mut self, hip_W: Vector3<f64>) {
        if let Some(place) = self.hips_W.get_mut(self.count) {
            *place = hip_W;
            self.count += 1;
        }
    }

    pub(super) fn places_W(&self) -> impl Iterator<Item = Vector3<f64>> {
        self.hips_W.into_iter().take(self.count)
    }

    fn are_near(&self, place_W: &Vector3<f64>) -> bool {
        self.places_W().any(|hip_W| (hip_W - place_W).norm_squared() < NEAR_M * NEAR_M)
    }
}

/// The slow side's bodies whose place has not been told since it changed.
pub(super) struct Untold {
    /// Each once.
    bodies: Vec<usize>,
    is_in: Box<[bool]>,
    /// Of each body, where it was told to be, and in which turn.
    told: Box<[(Vector3<f64>, u64)]>,
    turn: u64,
    /// By the way since each was told, while they are put in order: those near fingers, and the others.
    wanted: [Vec<(f64, usize)>; 2],
}

impl Untold {
    pub(super) fn new(bodies: &[Body]) -> Self {
        let count = bodies.len();
        Self {
            bodies: Vec::with_capacity(count),
            is_in: vec![false; count].into(),
            told: bodies.iter().map(|body| (body.centre_W, 0)).collect(),
            turn: 0,
            wanted: [(); 2].map(|()| Vec::with_capacity(count)),
        }
    }

    pub(super) fn add(&mut self, body: usize) {
        if !std::mem::replace(&mut self.is_in[body], true) {
            self.bodies.push(body);
        }
    }

    /// A turn: tells as many places as there is room for; `place` gives those of bodies that are here.
    pub(super) fn tell(
        &mut self,
        hips: &Hips,
        into: &mut Stands<Producer<Stand>>,
        place: impl Fn(usize) -> Option<Stand>,
    ) {
        let Self { bodies, is_in, told, turn, wanted } = self;
        *turn += 1;
        for body in bodies.drain(..) {
            let Some(stand) = place(body) else {
                is_in[body] = false;
                continue;
            };
            let (was_W, when) = told[body];
            let way_m = (stand.state.centre_W - was_W).norm() + TURN_M * (*turn - when) as f64;
            let is_near = hips.are_near(&stand.state.centre_W) || hips.are_near(&was_W);
            wanted[usize::from(!is_near)].push((way_m, body));
        }
        for (wanted, into) in wanted.iter_mut().zip(into) {
            let most = into.slots().min(wanted.len());
            let first = |left: &(f64, usize), right: &(f64, usize)| right.0.total_cmp(&left.0);
            if 0 < most && most < wanted.len() {
                wanted.select_nth_unstable_by(most - 1, first);
            }
            for (_, body) in wanted.drain(..) {
                match place(body).map(|stand| (into.push(stand), stand)) {
                    Some((Ok(()), stand)) => {
                        (told[body], is_in[body]) = ((stand.state.centre_W, *turn), false);
                    }
                    _ => bodies.push(body),
                }
            }
        }
    }
}

/// The fast side's bodies that go to where the slow side has them.
pub(super) struct Glides {
    all: Vec<Glide>,
}

/// A body on its way.
struct Glide {
    to: Stand,
    /// The tick as of which it stands where it is on its way.
    as_of: f64,
}

impl Glides {
    pub(super) fn new(bodies: usize) -> Self {
        Self { all: Vec::with_capacity(bodies.min(MOST_GLIDES)) }
    }

    /// Takes note of a place; gives it back if its body is to be there at once. So far that stands where it was in the tick
    /// `as_of`.
    pub(super) fn take(&mut self, to: Stand, (now, as_of): (&Body, u64), hips: &Hips) -> Option<Stand> {
        if let Some(glide) = self.all.iter_mut().find(|glide| glide.to.body == to.body) {
            // An older word may have waited among those of what is far.
            if to.as_of >= glide.to.as_of {
                glide.to = to;
            }
            return None;
        }
        if self.all.len() < self.all.capacity() && is_seen(&to, now, hips) {
            self.all.push(Glide { to, as_of: as_of as f64 });
            return None;
        }
        Some(to)
    }

    /// A tick of this length (s): everybody goes on, who is still to, and is told of with the tick as of which it is there.
    pub(super) fn step(
        &mut self,
        (manipulation, entities): (&mut Manipulation, &mut [Entity]),
        (dt_s, ahead_s): (f64, f64),
        hips: &Hips,
        goes_on: impl Fn(&Stand, Standing) -> bool,
        mut is_there: impl FnMut(&Stand, u64),
    ) {
        self.all.retain_mut(|Glide { to, as_of }| {
            let body = to.body as usize;
            if !goes_on(to, manipulation.standing(body)) {
                return false;
            }
            let now = &manipulation.bodies()[body];
            // What nobody looks at any more makes room.
            let share = if is_seen(to, now, hips) { share(now, &to.state, dt_s) } else { 1.0 };
            let between = between(now, &to.state, share);
            manipulation.stands_elsewhere(body, &between, entities, ahead_s);
            *as_of += share * (to.as_of as f64 - *as_of);
            is_there(to, if share < 1.0 { (*as_of + ROUNDING) as u64 } else { to.as_of });
            share < 1.0
        });
    }
}

fn is_seen(to: &Stand, now: &Body, hips: &Hips) -> bool {
    hips.are_near(&to.state.centre_W) || hips.are_near(&now.centre_W)
}

/// Share of its way to another place that a body goes in a tick; 1: it is there then.
fn share(now: &Body, to: &Body, dt_s: f64) -> f64 {
    let way_m = (to.centre_W - now.centre_W).norm();
    let most_m = MOST_LEAP_M.max(2.0 * to.velocity_W.norm() * dt_s);
    let share = SHARE.min(most_m / way_m);
    if way_m * (1.0 - share) < THERE_M { 1.0 } else { share }
}

/// A body so far on its way to another place, and as fast as there.
fn between(now: &Body, to: &Body, share: f64) -> Body {
    if share >= 1.0 {
        return *to;
    }
    let centre_W = now.centre_W + (to.centre_W - now.centre_W) * share;
    let orientation = now.orientation.try_slerp(&to.orientation, share, 1e-9).unwrap_or(to.orientation);
    Body { centre_W, orientation, ..*to }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Isometry3;
    use physics::MassProperties;

    fn at(x: f64) -> Body {
        let mass = MassProperties::of_shape(&haptics::Sphere::new(0.01).unwrap().into(), 0.1).unwrap();
        Body::at_rest(mass, &Isometry3::translation(x, 0.0, 0.0))
    }

    fn finger_at(x: f64) -> Hips {
        let mut hips = Hips::none();
        hips.push(Vector3::new(x, 0.0, 0.0));
        hips
    }

    /// 1000 things in a row of 10 m, all of which go on by some millimetres in each turn of two ticks, and a finger at 5 m.
    #[test]
    fn what_is_near_a_finger_is_told_in_each_turn_and_nobody_waits_for_long() {
        let mut bodies: Vec<Body> = (0..1000).map(|number| at(0.01 * f64::from(number))).collect();
        let mut untold = Untold::new(&bodies);
        let (mut into, mut out) = stands(bodies.len());
        let hips = finger_at(5.0);
        let mut told = vec![0; bodies.len()];
        for turn in 1..=400 {
            for (number, body) in bodies.iter_mut().enumerate() {
                // The second half ten times as fast.
                body.centre_W.y += if number < 500 { 1e-4 } else { 1e-3 };
                untold.add(number);
            }
            untold.tell(&hips, &mut into, |body| {
                Some(Stand { body: body as u32, stay: 0, as_of: turn, rests: false, state: bodies[body] })
            });
            for _ in 0..2 {
                take(&mut out).for_each(|stand| told[stand.body as usize] = stand.as_of);
            }
            // The finger is 0.1 m from 19 of them, before they have gone to the side.
            if turn < 20 {
                assert!((492..=508).all(|near| told[near] == turn), "{turn}: {:?}", &told[490..510]);
            }
            let oldest = told.iter().map(|told| turn - told).max().unwrap();
            // The way w at which the next one is told: 500 (0.2 mm) / w + 481 (1.1 mm) / w are the 45 places that are left, so
            // w is 14 mm, which the slow ones have behind them after 70 turns. 256 places wait for 6 more; and all begin at once,
            // so that the last of 1000 waits for 22.
            assert!(oldest <= 98, "{turn}: one has waited for {oldest} turns");
        }
        let waited = |all: &[u64]| all.iter().map(|told| 400 - told).sum::<u64>() as f64 / all.len() as f64;
        assert!(waited(&told[..500]) > 1.5 * waited(&told[500..]), "by the way that they went");
    }

    /// As many as a turn has places for, and a finger among them.
    #[test]
    fn what_is_far_is_told_though_more_is_near_than_there_are_places() {
        let bodies: Vec<Body> = (0..300).map(|number| at(if number < 200 { 5.0 } else { 9.0 })).collect();
        let mut untold = Untold::new(&bodies);
        let (mut into, mut out) = stands(bodies.len());
        let mut told = vec![0; bodies.len()];
        for turn in 1..=100 {
            (0..bodies.len()).for_each(|body| untold.add(body));
            untold.tell(&finger_at(5.0), &mut into, |body| {
                Some(Stand { body: body as u32, stay: 0, as_of: turn, rests: false, state: bodies[body] })
            });
            for _ in 0..2 {
                take(&mut out).for_each(|stand| told[stand.body as usize] = stand.as_of);
            }
        }
        // 16 of 100 in a turn, and a queue of 256; 48 of 200, and a queue of 64.
        assert!(told[200..].iter().all(|told| 100 - told <= 24), "{:?}", &told[200..]);
        assert!(told[..200].iter().all(|told| 100 - told <= 6), "{:?}", &told[..200]);
    }

    #[test]
    fn what_is_asleep_is_told_once_and_what_is_gone_not_at_all() {
        let bodies = [at(0.0), at(1.0)];
        let mut untold = Untold::new(&bodies);
        let (mut into, mut out) = stands(bodies.len());
        (0..2).for_each(|body| untold.add(body));
        for told in [vec![0], vec![]] {
            untold.tell(&Hips::none(), &mut into, |body| {
                (body == 0).then(|| Stand { body: 0, stay: 0, as_of: 0, rests: true, state: bodies[0] })
            });
            let came: Vec<u32> = take(&mut out).map(|stand| stand.body).collect();
            assert_eq!(came, told);
        }
    }

    #[test]
    fn a_glide_goes_no_farther_in_a_tick_than_it_may_and_ends_where_it_is_to() {
        for (way_m, speed_m_s, most_ticks) in
            [(1e-3, 0.0, 12), (0.01, 0.5, 20), (0.05, 1.0, 45), (0.05, 5.0, 20)]
        {
            let to = Body { velocity_W: Vector3::new(speed_m_s, 0.0, 0.0), ..at(way_m) };
            let (mut now, mut ticks) = (at(0.0), 0);
            loop {
                let share = share(&now, &to, 1e-3);
                let next = between(&now, &to, share);
                let step_m = (next.centre_W - now.centre_W).norm();
                assert!(step_m <= MOST_LEAP_M.max(2e-3 * speed_m_s) + 1e-12, "{way_m}: {step_m}");
                (now, ticks) = (next, ticks + 1);
                if share >= 1.0 {
                    break;
                }
            }
            assert!(now == to && ticks <= most_ticks, "{way_m}: {ticks}");
        }
    }
}
