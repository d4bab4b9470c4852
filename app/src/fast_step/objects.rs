//! The entities that move, in the fast step: what the fingers' touches do to them, and what that does to the fingers.
//!
//! Model: fingers render against the entities as they are when the tick begins. Each touch on one that moves, and what else
//! acts between a finger and one (magnetism, vibration), is handed to [`physics::Manipulation`], which gives back the force that the body got; the finger's force is changed by the
//! difference. So what is commanded is, times -1, what moved the object.
//!
//! Invariants: nothing moves before a run's t = 0 (the scene is what it says until then), and no stall of the driver is
//! made up for at once: objects are late by what was missed.

use haptics::{Contact, Entity, FingerEffects};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use physics::{
    Attachment, BroadPhase, FingerSettings, FingerTick, MAX_DRIVEN, MAX_PULLS, Made, Manipulation, Pull,
    Touch,
};
use std::time::{Duration, Instant};
use world::events::{FastPairs, pair_link};
use world::lists::{FastList, Handed, Reach, SlowList};

use super::DeviceFinger;
use super::ordered::Moved;
use crate::displaced::Placed;
use crate::lists_end::ListsEnd;
use crate::row::{BodyRow, FingerRow};
use crate::slow_thread::{EVERY_NS, SlowRemains};

/// A finger touches no more bodies at once.
const MOST_TOUCHED: usize = 16;
/// The most that is felt of what has not been handed over \[N\], and of what leans on bodies that wait.
const MOST_UNTIL_IT_COMES_N: f64 = 3.0;
const MOST_LEANING_N: f64 = 10.0;
/// From where on such a contact is given up \[N\]: some centimetres deep.
const GIVEN_UP_N: f64 = 20.0;
/// Ticks for which a finger leans on after bodies that wait have held more than that.
const LEANS_ON: u32 = 256;
const MOST_GIVEN_UP: usize = 64;
/// Ticks that a single step of the objects makes up for at most.
const MOST_TICKS: f64 = 4.0;

/// What a finger is to objects beside a point.
#[derive(Debug, Clone, Copy, Default)]
pub struct HandFinger {
    /// Its pad, and how it ties.
    pub settings: FingerSettings,
    /// The button of its device that ties.
    pub button: Option<u32>,
}

/// Moving entities and what is known of them.
pub struct Objects {
    pub(super) manipulation: Manipulation,
    /// Who is in the slow list, where there is one.
    pub(super) lists: Option<SlowOnes>,
    pub(super) touches: Vec<Touch>,
    pub(super) pulls: Vec<Pull>,
    /// The first so many of them are felt; the others make up for the tick before.
    felt_pulls: usize,
    /// What bodies are to get in the next tick, because their finger was made to feel something else than they got.
    owed: Vec<Pull>,
    pub(super) ticks: Vec<FingerTick>,
    /// The button with which each finger ties.
    buttons: Vec<Option<u32>>,
    /// How that ties.
    ties: Vec<Option<Attachment>>,
    wants_quality: bool,
    /// As the tick began.
    rows: Vec<BodyRow>,
    /// Those of them that are not as they were a tick before.
    changed: Vec<u32>,
    /// What else is being moved.
    placed: Vec<Placed>,
    period_s: f64,
    /// Whether nothing moves by itself while forces fade.
    pub(super) stands_still: bool,
    /// Whether nothing moves by itself.
    pub(super) is_paused: bool,
    /// What was moved, as the slow list has to know it.
    pub(super) moved: Moved,
    /// Of each touch, the force of all that its god-object is behind the finger (N).
    behind_n: Vec<f64>,
    /// Contacts with what has not been handed over that are given up: fingers and entities.
    given_up: Vec<(usize, usize)>,
    /// Those that go on with a shorter spring, of this force (N).
    shortened: Vec<(usize, usize, f64)>,
    /// Contacts with bodies and their forces (N) when time stopped, as long as it stands still.
    stood: Vec<(usize, usize, f64)>,
    has_stood: bool,
    /// Of each finger, for how many ticks it is still taken for one that presses bodies into others that wait.
    leaning: Vec<u32>,
    /// Force with which each of those pushes things away (N); zero for others.
    pushes_n: Vec<f64>,
    /// Of each finger, whether it felt less in the last tick, since what it presses had not been handed over, or waited.
    pub(super) gives_way: Vec<bool>,
    /// The most bodies that a tick steps.
    pub(super) most_stepped: usize,
    /// What the last tick took.
    pub made: Made,
    /// Time that the slow list's turn took in it.
    pub(super) slow_turn: Duration,
    /// By how much it moved them (s).
    pub(super) stepped_s: f64,
}

/// What the slow list has, as the fast side sees it.
pub(super) struct SlowOnes {
    pub(super) hand_over: FastList,
    /// The slow side itself, while no other thread has it.
    pub(super) slow: Option<SlowList>,
    /// Ticks that it has not been told of yet, and those since it was told last, in which time may have stood still.
    ticks: u32,
    passed: u32,
}

impl Objects {
    /// Held by these fingers. `wants_quality`: each tick is to tell how they are grasped.
    pub fn new(
        manipulation: Manipulation,
        fingers: &[HandFinger],
        wants_quality: bool,
        period_s: f64,
    ) -> Self {
        let settings: Vec<_> = fingers.iter().map(|finger| finger.settings).collect();
        let manipulation = manipulation.with_fingers(&settings);
        let bodies = manipulation.bodies().len();
        let room = fingers.len() * bodies.min(MOST_TOUCHED) * haptics::MAX_TOUCH_POINTS;
        let mut objects = Self {
            rows: vec![BodyRow::default(); bodies],
            changed: (0..bodies as u32).collect(),
            placed: Vec::with_capacity(MAX_DRIVEN),
            touches: Vec::with_capacity(room),
            pulls: Vec::with_capacity(MAX_PULLS),
            felt_pulls: 0,
            owed: Vec::with_capacity(MAX_PULLS),
            ticks: vec![FingerTick::at(Vector3::zeros()); fingers.len()],
            buttons: fingers.iter().map(|finger| finger.button).collect(),
            ties: fingers.iter().map(|finger| finger.settings.attachment).collect(),
            wants_quality,
            manipulation,
            lists: None,
            period_s,
            stands_still: false,
            is_paused: false,
            moved: Moved::default(),
            behind_n: Vec::with_capacity(room),
            given_up: Vec::with_capacity(room.min(MOST_GIVEN_UP)),
            shortened: Vec::with_capacity(room),
            stood: Vec::with_capacity(room),
            has_stood: false,
            leaning: vec![0; fingers.len()],
            pushes_n: vec![0.0; fingers.len()],
            gives_way: vec![false; fingers.len()],
            most_stepped: usize::MAX,
            made: Made::default(),
            slow_turn: Duration::ZERO,
            stepped_s: 0.0,
        };
        objects.note_all();
        objects
    }

    /// With a slow list for those that are too many for the fast one. Until another thread [takes](Self::take_slow) it, it
    /// has its turns here.
    #[must_use]
    pub fn with_lists(mut self, hand_over: FastList, slow: SlowList) -> Self {
        self.lists = Some(SlowOnes { hand_over, slow: Some(slow), ticks: 0, passed: 0 });
        self.note_all();
        self
    }

    /// The slow list, to be stepped by another thread; `None` where there is none, or another one has it.
    pub fn take_slow(&mut self) -> Option<SlowList> {
        self.lists.as_mut()?.slow.take()
    }

    /// Begins to watch which entities press each other in the slow list, if that is still here, and nobody watches it yet.
    pub(super) fn watch_slow(&mut self) -> Option<FastPairs> {
        let slow = self.lists.as_mut()?.slow.as_mut()?;
        let (fast_end, slow_end) = pair_link();
        slow.watch(slow_end);
        Some(fast_end)
    }

    /// When no thread steps any more: what is on its way is taken in, so that each body is in one list. `slow` is what
    /// another thread left, if one had it.
    pub fn end_lists(&mut self, entities: &mut [Entity], slow: Option<SlowRemains>) -> Option<ListsEnd> {
        let lists = self.lists.as_mut()?;
        let late_ticks = slow.as_ref().map_or(0, |slow| slow.late_ticks);
        lists.slow = lists.slow.take().or(slow.map(|slow| slow.slow));
        lists.hand_over.end(&mut self.manipulation, entities, lists.slow.as_mut());
        Some(ListsEnd {
            fast: lists.hand_over.here(),
            slow: lists.slow.as_ref().map(SlowList::here),
            handed: lists.hand_over.handed(),
            late_ticks,
            left_out: lists.slow.as_ref().map_or(0, |slow| slow.manipulation().left_out()),
        })
    }

    /// Number of times that contacts of the fast list had no room.
    pub fn left_out(&self) -> u64 {
        self.manipulation.left_out()
    }

    /// How many bodies are in the fast list, and what has been handed over.
    pub fn handed(&self) -> Option<(usize, Handed)> {
        let lists = self.lists.as_ref()?;
        Some((lists.hand_over.here(), lists.hand_over.handed()))
    }

    /// Before fingers are stepped: who could be reached soon comes into the fast list. `reaches` are the fingers'.
    /// The tick is the run's of this number.
    pub fn reach(&mut self, entities: &mut [Entity], reaches: impl Iterator<Item = Reach>, run_tick: u64) {
        if let Some(lists) = &mut self.lists {
            lists.hand_over.begin_tick(&mut self.manipulation, entities, reaches, (run_tick, self.period_s));
        }
    }

    /// After all: who is out of reach may go; and the slow list has its turn, if it is here.
    pub fn let_go(&mut self, entities: &[Entity], is_running: bool) {
        let Some(lists) = &mut self.lists else { return };
        lists.hand_over.end_tick(&mut self.manipulation, entities);
        self.moved.tell(&mut lists.hand_over, entities);
        lists.ticks += u32::from(is_running && !self.is_paused);
        lists.passed += 1;
        self.slow_turn = Duration::ZERO;
        // Where no thread of its own has it, it comes round as often.
        let is_due = f64::from(lists.passed) * self.period_s * 1e9 > EVERY_NS as f64 - 1.0;
        if let Some(slow) = lists.slow.as_mut().filter(|_| is_due) {
            let begin = Instant::now();
            slow.turn(lists.ticks, self.period_s);
            (lists.ticks, lists.passed) = (0, 0);
            self.slow_turn = begin.elapsed();
        }
    }

    /// The bodies as the tick began.
    pub fn rows(&self) -> &[BodyRow] {
        &self.rows
    }

    /// Those that were parked in the last tick.
    pub fn parked_now(&self) -> &[physics::Parked] {
        let parked = self.manipulation.parked();
        &parked[parked.len().saturating_sub(self.made.parked)..]
    }

    /// The bodies whose rows are not what they were a tick before.
    pub fn changed(&self) -> &[u32] {
        &self.changed
    }

    /// The bodies, and what they remember of where they touch.
    pub fn manipulation(&self) -> &Manipulation {
        &self.manipulation
    }

    /// By how much the last tick moved them (s).
    pub fn stepped_s(&self) -> f64 {
        self.stepped_s
    }

    /// Time since the slow list has had its last turn, where it has them here (s).
    pub(super) fn slow_behind_s(&self) -> f64 {
        let here = self.lists.as_ref().filter(|lists| lists.slow.is_some());
        here.map_or(0.0, |lists| f64::from(lists.ticks) * self.period_s)
    }

    /// The force on the user of a finger's touches on a body, as they moved it in the last tick (N); `None`: there were none.
    pub fn touch_force_W(&self, finger: usize, entity: usize) -> Option<Vector3<f64>> {
        let own = self.touches.iter().filter(|touch| (touch.finger, touch.entity) == (finger, entity));
        own.map(|touch| touch.force_on_user_W).reduce(|sum, force_W| sum + force_W)
    }

    /// Where all entities are, roughly.
    pub fn broad_phase(&self) -> &BroadPhase {
        self.manipulation.broad_phase()
    }

    /// What is no body and is being moved, as the tick began.
    pub fn placed(&self) -> &[Placed] {
        &self.placed
    }

    /// Takes note of how the bodies are, and of where others stand that are moved.
    pub fn note(&mut self, entities: &[Entity]) {
        self.placed.clear();
        let manipulation = &self.manipulation;
        let others = manipulation.driven().filter(|entity| !manipulation.is_body(*entity));
        self.placed.extend(others.map(|entity| (entity as u32, entities[entity].X_WB)));
        self.changed.clear();
        self.changed.extend_from_slice(self.manipulation.changed());
        self.manipulation.forget_changes();
        self.note_changed();
        for entity in self.manipulation.driven() {
            let (Some(body), is) = (self.manipulation.body_of(entity), &entities[entity]) else { continue };
            let turn_W = is.X_WB.rotation * is.previous_X_WB.rotation.inverse();
            let row = &mut self.rows[body];
            row.velocity = (is.X_WB.translation.vector - is.previous_X_WB.translation.vector) / self.period_s;
            row.angular_velocity = turn_W.scaled_axis() / self.period_s;
        }
    }

    /// The world begins in this tick of the run.
    pub(super) fn begin_at(&mut self, run_tick: u64) {
        if let Some(lists) = &mut self.lists {
            lists.hand_over.begin_at(run_tick);
            self.rows.iter_mut().for_each(|row| row.as_of = row.as_of.map(|_| run_tick));
        }
    }

    fn note_all(&mut self) {
        self.manipulation.forget_changes();
        self.note_changed();
    }

    fn note_changed(&mut self) {
        for &number in &self.changed {
            let is_slow = self.is_slow(number as usize);
            let as_of = self.as_of(number as usize);
            let (row, body) = (&mut self.rows[number as usize], &self.manipulation.bodies()[number as usize]);
            let (pose, spin_W) = (body.pose(), body.angular_velocity_W());
            let from_centre_W = pose.translation.vector - body.centre_W;
            *row = BodyRow {
                position: pose.translation.vector,
                orientation: pose.rotation.into_inner(),
                velocity: body.velocity_W + spin_W.cross(&from_centre_W),
                angular_velocity: spin_W,
                is_slow,
                as_of,
                ..*row
            };
        }
    }

    /// The tick of the run as of which a body of the slow list stands where it does, unless it rests.
    fn as_of(&self, number: usize) -> Option<u64> {
        self.lists.as_ref().filter(|_| self.is_slow(number))?.hand_over.as_of(number)
    }

    /// Nothing moves before a run begins: what fingers feel of bodies is what was rendered.
    pub(super) fn has_not_stepped(&mut self) {
        self.touches.clear();
        self.felt_pulls = 0;
    }

    /// Moves them by a tick of this length (s), and changes the fingers' forces to those which moved them.
    pub fn step(
        &mut self,
        entities: &mut [Entity],
        fingers: &[DeviceFinger],
        felt: &[FingerEffects],
        rows: &mut [FingerRow],
        dt_s: f64,
    ) {
        if self.is_paused || self.stands_still {
            self.bound_while_standing(fingers);
            return self.stand(entities);
        }
        self.has_stood = false;
        self.pull(felt, rows);
        self.touches.clear();
        self.behind_n.clear();
        for (index, finger) in fingers.iter().enumerate() {
            for contact in finger.finger.contacts() {
                if self.manipulation.is_body(contact.entity) {
                    let behind_m =
                        finger.finger.last_hip_W().map_or(0.0, |hip_W| (contact.god_object_W - hip_W).norm());
                    for point in finger.finger.touch_points(entities, contact.entity).as_slice() {
                        if self.touches.len() < self.touches.capacity() {
                            self.touches.push(Touch::at(point, contact, index));
                            self.behind_n.push(behind_m * contact.stiffness_n_per_m);
                        }
                    }
                }
            }
        }
        self.pay();
        let rendered = self.touches.iter().map(|touch| -touch.force_on_user_W);
        add_to_rows(rendered, &self.touches, fingers, rows);
        for ((tick, button), (row, finger)) in
            self.ticks.iter_mut().zip(&self.buttons).zip(rows.iter().zip(fingers))
        {
            // What is tied to a finger does not follow it through a door.
            let is_left = tick.attached.is_some_and(|tied| entities[tied].space != finger.finger.space());
            *tick = FingerTick {
                gimbal: row.has_orientation.then(|| orientation(row.orientation_wxyz)),
                is_button_held: !is_left && button.is_some_and(|button| row.buttons >> button & 1 == 1),
                // One that is lost holds nothing.
                ..FingerTick::at(finger.finger.last_hip_W().unwrap_or_else(|| Vector3::repeat(f64::NAN)))
            };
        }
        let dt_s = dt_s.min(MOST_TICKS * self.period_s);
        self.stepped_s = dt_s;
        self.manipulation.step_at_most(self.most_stepped, self.ticks.iter().map(|tick| tick.hip_W));
        self.made = self.manipulation.step_pulled(
            entities,
            &mut self.touches,
            &mut self.pulls,
            &mut self.ticks,
            dt_s,
        );
        self.give_way();
        for (row, tick) in rows.iter_mut().zip(&self.ticks) {
            row.force_on_user += tick.force_on_user_W;
            row.torque_on_user += tick.torque_on_user_W;
            row.attached = tick.attached.map(|entity| entity as u32);
        }
        if self.wants_quality {
            for &body in self.manipulation.awake() {
                self.rows[body].grasp = self.manipulation.grasp_quality(body).unwrap_or_default();
            }
        }
        let got = self.touches.iter().map(|touch| touch.force_on_user_W);
        add_to_rows(got, &self.touches, fingers, rows);
        for pull in &self.pulls[..self.felt_pulls] {
            rows[pull.finger].force_on_user += pull.force_on_user_W;
        }
    }

    /// Bodies that stand still only until they are stepped are no walls: a finger that presses them, or others into them, feels so
    /// much, and goes through. They have not been handed over yet, or wait for their turn.
    fn give_way(&mut self) {
        for finger in 0..self.leaning.len() {
            let own = self.touches.iter().filter(|touch| touch.finger == finger);
            let held_n = own.map(|touch| touch.held_by_waiting_n).fold(0.0, f64::max);
            let left = self.leaning[finger];
            let pushes_n = if held_n > 0.0 || left > 0 { self.pushes_n(finger) } else { 0.0 };
            // Bodies that were squeezed come back for a while, with nobody behind them.
            let is_held = held_n.min(pushes_n) > MOST_LEANING_N;
            self.leaning[finger] = if is_held { LEANS_ON } else { left.saturating_sub(1) };
            self.pushes_n[finger] = if self.leaning[finger] > 0 { pushes_n } else { 0.0 };
        }
        for finger in 0..self.leaning.len() {
            self.gives_way[finger] = self.give_way_to(finger);
        }
    }

    /// Says whether anything did.
    fn give_way_to(&mut self, finger: usize) -> bool {
        let mut gave_way = false;
        let pushes_n = self.pushes_n[finger];
        let coming =
            self.touches.iter().filter(|touch| touch.finger == finger && self.is_on_its_way(touch.entity));
        let coming_n: f64 = coming.map(|touch| touch.force_on_user_W.norm()).sum();
        for at in 0..self.touches.len() {
            let touch = self.touches[at];
            if touch.finger != finger {
                continue;
            }
            let is_on_its_way = self.is_on_its_way(touch.entity);
            let (pressed_n, most_n) =
                if is_on_its_way { (coming_n, MOST_UNTIL_IT_COMES_N) } else { (pushes_n, MOST_LEANING_N) };
            let felt_n = pressed_n.min(most_n);
            if felt_n >= pressed_n {
                continue;
            }
            gave_way = true;
            let force_on_user_W = touch.force_on_user_W * (felt_n / pressed_n);
            if !is_on_its_way && self.owed.len() < self.owed.capacity() {
                let Touch { entity, finger, point_W, .. } = touch;
                let changed_W = force_on_user_W - touch.force_on_user_W;
                let back =
                    Pull { entity, finger, point_W, force_on_user_W: changed_W, stiffness_n_per_m: 0.0 };
                self.owed.push(back);
            }
            self.touches[at].force_on_user_W = force_on_user_W;
            // What comes later must not find a spring of any length.
            let behind_n = if is_on_its_way { self.behind_n[at] } else { pressed_n };
            if behind_n > GIVEN_UP_N && self.given_up.len() < self.given_up.capacity() {
                self.given_up.push((touch.finger, touch.entity));
            }
            let was_shortened =
                self.shortened.iter().any(|(own, entity, _)| (*own, *entity) == (finger, touch.entity));
            if is_on_its_way && !was_shortened && self.shortened.len() < self.shortened.capacity() {
                let own = self.touches[at..]
                    .iter()
                    .filter(|own| (own.finger, own.entity) == (finger, touch.entity));
                // Those behind this one have all of their force yet.
                let rest_W: Vector3<f64> =
                    own.skip(1).map(|own| own.force_on_user_W * (felt_n / pressed_n)).sum();
                self.shortened.push((finger, touch.entity, (force_on_user_W + rest_W).norm()));
            }
        }
        gave_way
    }

    /// While time stands still bodies are no walls: what a finger feels of one grows no further than it was, or than what has not
    /// been handed over may have. In a pause those that are here stand like all that is fixed.
    fn bound_while_standing(&mut self, fingers: &[DeviceFinger]) {
        if !std::mem::replace(&mut self.has_stood, true) {
            self.stood.clear();
            for touch in &self.touches {
                let of = (touch.finger, touch.entity);
                let touch_n = touch.force_on_user_W.norm();
                match self.stood.iter_mut().find(|(finger, entity, _)| (*finger, *entity) == of) {
                    Some((.., felt_n)) => *felt_n += touch_n,
                    None => self.stood.push((of.0, of.1, touch_n)),
                }
            }
        }
        for (index, finger) in fingers.iter().enumerate() {
            let coming = finger.finger.contacts().filter(|contact| self.is_on_its_way(contact.entity));
            let coming_n: f64 = coming.map(|contact| contact.force_on_user_W.norm()).sum();
            for contact in
                finger.finger.contacts().filter(|contact| self.manipulation.is_body(contact.entity))
            {
                let felt_n = contact.force_on_user_W.norm();
                let most_n = if self.is_on_its_way(contact.entity) {
                    felt_n * (MOST_UNTIL_IT_COMES_N / coming_n)
                } else if self.stands_still {
                    let of = |stood: &&(usize, usize, f64)| (stood.0, stood.1) == (index, contact.entity);
                    self.stood.iter().find(of).map_or(0.0, |stood| stood.2).max(MOST_UNTIL_IT_COMES_N)
                } else {
                    f64::INFINITY
                };
                if felt_n > most_n && self.shortened.len() < self.shortened.capacity() {
                    self.shortened.push((index, contact.entity, most_n));
                }
            }
        }
    }

    /// Force with which a finger pushes things away (N): of what other fingers press against it holds them.
    fn pushes_n(&self, finger: usize) -> f64 {
        let force_W = |entity: usize, is_own: bool| -> Vector3<f64> {
            let all = self.touches.iter().filter(|touch| touch.entity == entity);
            let counted = all.filter(|touch| !is_own || touch.finger == finger);
            counted.map(|touch| touch.force_on_user_W).sum()
        };
        let is_first = |at: usize, touch: &Touch| {
            let before = &self.touches[..at];
            before.iter().all(|other| (other.finger, other.entity) != (finger, touch.entity))
        };
        let own = self.touches.iter().enumerate().filter(|(at, touch)| {
            touch.finger == finger && is_first(*at, touch) && !self.is_on_its_way(touch.entity)
        });
        own.map(|(_, touch)| [true, false].map(|is_own| force_W(touch.entity, is_own).norm()))
            .map(|[own_n, net_n]| own_n.min(net_n))
            .sum()
    }

    /// True of a body that has not been handed over yet, and is not an order's.
    fn is_on_its_way(&self, entity: usize) -> bool {
        let (Some(lists), Some(body)) = (&self.lists, self.manipulation.body_of(entity)) else {
            return false;
        };
        self.manipulation.standing(body).is_away() && !lists.hand_over.holds(body)
    }

    /// The contacts, by finger and entity, that go on with a spring of this force (N).
    pub(super) fn shortened(&mut self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        self.shortened.drain(..)
    }

    /// The contacts, by finger and entity, that end with this tick.
    pub(super) fn given_up(&mut self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.given_up.drain(..)
    }

    /// After all, the force on the user of a finger was changed by so much (N). The bodies that it touches have got the other
    /// one: each gets its share of the difference in the next tick, as far as its finger then still presses or pulls by as
    /// much, so that over two ticks action is reaction.
    pub fn owe(&mut self, finger: usize, changed_W: Vector3<f64>, of: &DeviceFinger, felt: &FingerEffects) {
        if changed_W == Vector3::zeros() {
            return;
        }
        let own = |touch: &&Touch| touch.finger == finger;
        let moved =
            self.touches.iter().filter(own).map(|touch| (touch.entity, touch.point_W, touch.force_on_user_W));
        let pulled = self.pulls[..self.felt_pulls].iter().filter(|pull| pull.finger == finger);
        let pulled = pulled.map(|pull| (pull.entity, pull.point_W, pull.force_on_user_W));
        let fixed_n: f64 = of
            .finger
            .contacts()
            .filter(|contact| !self.manipulation.is_body(contact.entity))
            .map(|contact| contact.force_on_user_W.norm())
            .chain(
                felt.reactions()
                    .iter()
                    .filter(|reaction| !self.manipulation.is_body(reaction.entity))
                    .map(|reaction| reaction.force_on_user_W.norm()),
            )
            .sum();
        let all_n =
            fixed_n + moved.clone().chain(pulled.clone()).map(|(.., force_W)| force_W.norm()).sum::<f64>();
        for (entity, point_W, force_W) in moved.chain(pulled) {
            let share = force_W.norm() / all_n;
            if share > 0.0 && self.owed.len() < self.owed.capacity() {
                let force_on_user_W = changed_W * share;
                self.owed.push(Pull { entity, finger, point_W, force_on_user_W, stiffness_n_per_m: 0.0 });
            }
        }
    }

    /// Pays what bodies are owed, as less of what their finger presses or pulls with now. What is more than that is not paid:
    /// what bore a body against the finger bears it no more once that has left, and a grain on a floor would be flung.
    fn pay(&mut self) {
        let room = MAX_PULLS - self.felt_pulls;
        for at in 0..self.owed.len().min(room) {
            let mut pull = self.owed[at];
            let is_its = |finger, entity| (finger, entity) == (pull.finger, pull.entity);
            let touches = self.touches.iter().filter(|own| is_its(own.finger, own.entity));
            let pulls = self.pulls[..self.felt_pulls].iter().filter(|own| is_its(own.finger, own.entity));
            let now_n: f64 = touches
                .map(|own| own.force_on_user_W.norm())
                .chain(pulls.map(|own| own.force_on_user_W.norm()))
                .sum();
            let owed = self.owed.iter().filter(|own| is_its(own.finger, own.entity));
            let owed_n: f64 = owed.map(|own| own.force_on_user_W.norm()).sum();
            if owed_n > now_n {
                pull.force_on_user_W *= now_n / owed_n;
            }
            self.pulls.push(pull);
        }
        self.owed.clear();
    }

    /// The force on the user of a contact as it moved its body, or as it was rendered, and how much of it the body's own
    /// motion within the tick can explain (N).
    pub(super) fn touched(
        &self,
        finger: usize,
        contact: &Contact,
        entities: &[Entity],
    ) -> (Vector3<f64>, f64) {
        let moved = self.touches.iter().filter(|own| (own.finger, own.entity) == (finger, contact.entity));
        let (mut force_W, mut given_n) = (None, 0.0_f64);
        for touch in moved {
            force_W = Some(force_W.unwrap_or_else(Vector3::zeros) + touch.force_on_user_W);
            let damping_n_s_per_m = entities[contact.entity].felt_material(contact.label).damping_n_s_per_m;
            let per_speed = contact.stiffness_n_per_m * self.stepped_s + damping_n_s_per_m;
            let [before_W, after_W] = self.velocities_W(contact.entity, &touch.point_W);
            given_n = given_n.max(per_speed * (after_W - before_W).norm());
        }
        (force_W.unwrap_or(contact.force_on_user_W), given_n)
    }

    /// By how much a finger's tie can pull otherwise for what its body and the finger, which went so far (m), do in a tick (N).
    pub(super) fn tie_n(&self, finger: usize, way_m: f64) -> f64 {
        let tied = self.ticks.get(finger).and_then(|tick| Some((tick.attached?, tick.hip_W)));
        let (Some((entity, hip_W)), Some(Some(tie))) = (tied, self.ties.get(finger)) else { return 0.0 };
        let [before_W, after_W] = self.velocities_W(entity, &hip_W);
        let speed_m_s = way_m / self.stepped_s.max(self.period_s) + before_W.norm() + after_W.norm();
        (2.0 * tie.stiffness_n_per_m * self.stepped_s + tie.damping_n_s_per_m) * speed_m_s
    }

    /// By how much a finger's magnets and vibrations can pull otherwise because bodies gave way to them within the tick (N).
    pub(super) fn pulled_n(&self, finger: usize) -> f64 {
        let own = self.pulls[..self.felt_pulls].iter().filter(|pull| pull.finger == finger);
        own.map(|pull| {
            let [before_W, after_W] = self.velocities_W(pull.entity, &pull.point_W);
            pull.stiffness_n_per_m * self.stepped_s * (after_W - before_W).norm()
        })
        .sum()
    }

    /// How fast a body's point moved when the tick began, and moves now (m/s).
    fn velocities_W(&self, entity: usize, point_W: &Vector3<f64>) -> [Vector3<f64>; 2] {
        let Some(number) = self.manipulation.body_of(entity) else { return [Vector3::zeros(); 2] };
        let (row, body) = (&self.rows[number], &self.manipulation.bodies()[number]);
        let before_W = row.velocity + row.angular_velocity.cross(&(point_W - row.position));
        let after_W = body.velocity_W + body.angular_velocity_W().cross(&(point_W - body.centre_W));
        [before_W, after_W]
    }

    /// As [`Self::owe`], of what was changed of a finger's contact with one entity.
    pub(super) fn owe_to(&mut self, finger: usize, entity: usize, changed_W: Vector3<f64>) {
        let own = |touch: &&Touch| (touch.finger, touch.entity) == (finger, entity);
        let all_n: f64 = self.touches.iter().filter(own).map(|touch| touch.force_on_user_W.norm()).sum();
        for touch in self.touches.iter().filter(own) {
            let share = touch.force_on_user_W.norm() / all_n;
            if share > 0.0 && self.owed.len() < self.owed.capacity() {
                let (point_W, force_on_user_W) = (touch.point_W, changed_W * share);
                self.owed.push(Pull { entity, finger, point_W, force_on_user_W, stiffness_n_per_m: 0.0 });
            }
        }
    }

    /// Nothing acts between fingers and bodies, and nothing is owed.
    pub(super) fn clear_pulls(&mut self) {
        self.pulls.clear();
        self.owed.clear();
        self.felt_pulls = 0;
    }

    /// Takes from the fingers' forces what acts between them and bodies beside touches, until it is known what moved those.
    fn pull(&mut self, felt: &[FingerEffects], rows: &mut [FingerRow]) {
        self.pulls.clear();
        for (finger, felt) in felt.iter().enumerate() {
            for reaction in
                felt.reactions().iter().filter(|reaction| self.manipulation.is_body(reaction.entity))
            {
                rows[finger].force_on_user -= reaction.force_on_user_W;
                if self.pulls.len() < MAX_PULLS {
                    self.pulls.push(Pull {
                        entity: reaction.entity,
                        finger,
                        point_W: reaction.point_W,
                        force_on_user_W: reaction.force_on_user_W,
                        stiffness_n_per_m: reaction.stiffness_n_per_m,
                    });
                }
            }
        }
        self.felt_pulls = self.pulls.len();
    }
}

fn orientation([w, x, y, z]: [f64; 4]) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
}

/// Adds forces on users, one of each touch, to their fingers' rows; and their torques, where the finger has a radius.
fn add_to_rows(
    forces_W: impl Iterator<Item = Vector3<f64>>,
    touches: &[Touch],
    fingers: &[DeviceFinger],
    rows: &mut [FingerRow],
) {
    for (force_W, touch) in forces_W.zip(touches) {
        let row = &mut rows[touch.finger];
        row.force_on_user += force_W;
        if fingers[touch.finger].finger.radius_m() > 0.0
            && let Some(contact) = fingers[touch.finger].finger.contact(touch.entity)
        {
            row.torque_on_user += (touch.point_W - contact.god_object_W).cross(&force_W);
        }
    }
}
