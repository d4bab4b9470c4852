//! What of a fast step others are told: [`world::events`].
//!
//! Frames and signs: a finger's contact tells its own force on the user, as rendered or, on a body, as that moved it; what
//! fields and guides add and passivity takes is not part of it.

use super::{Cut, FastStep};
use crate::row::Row;
use haptics::ContactState;
use world::events::{Change, Event, EventSender, Kind, List, PairForce, Touching, Watch};
use world::lists::Handed;

/// Pairs of entities that are watched at once.
const MOST_PAIRS: usize = 2048;

/// More bodies than an island has that is given away in a tick.
const MOST_GONE: usize = 64;

/// A crowd that is left for less goes on (s), and so does an overload, and what gives way.
const GOES_ON_S: f64 = 0.1;

/// Tells, after each step of a world, what is new.
pub struct EventTeller {
    watch: Box<Watch>,
    /// One of nothing, for when the watch is sent away, as its world ends.
    of_nothing: Option<Box<Watch>>,
    /// Of each finger, how long it is still said to be in a crowd (s).
    crowded_s: Vec<f64>,
    /// Likewise, that what it presses gives way (s).
    gives_way_s: Vec<f64>,
    /// For how long an overload goes on, and the most bodies that waited in it; `None`: there is none.
    overload: Option<(f64, u32)>,
    touching: Vec<Touching>,
    /// Of each body, whether another thread has it.
    elsewhere: Vec<bool>,
    /// Those that have gone there in this tick.
    gone: Vec<u32>,
    handed: Handed,
    /// In which space each finger was.
    spaces: Vec<u32>,
}

impl EventTeller {
    /// Of this step.
    pub fn new(step: &mut FastStep) -> Self {
        let slow = step.objects.watch_slow();
        let bodies = step.bodies().len();
        let most_touched = step.fingers.iter().map(|finger| finger.finger.capacity()).max().unwrap_or(0);
        let pairs = bodies.saturating_mul(step.entities().len()).min(MOST_PAIRS);
        let watch = Watch::new(step.fingers.len(), most_touched, pairs, step.period_s).with_slow(slow);
        Self {
            watch: Box::new(watch),
            of_nothing: Some(Box::default()),
            crowded_s: vec![0.0; step.fingers.len()],
            gives_way_s: vec![0.0; step.fingers.len()],
            overload: None,
            touching: Vec::with_capacity(most_touched),
            elsewhere: (0..bodies).map(|body| step.objects.is_slow(body)).collect(),
            gone: Vec::with_capacity(MOST_GONE.min(bodies)),
            handed: Handed::default(),
            spaces: step.fingers.iter().map(|finger| finger.finger.space()).collect(),
        }
    }

    /// Tells what the last step, which was that of this row, brought.
    pub fn tell(&mut self, step: &FastStep, row: &Row, out: &mut EventSender) {
        self.watch.begin(row.run_tick);
        for (finger, row) in (0..step.fingers.len()).zip(&row.fingers) {
            self.find_touching(step, finger);
            self.watch.finger(finger, &self.touching, row.buttons, row.attached, out);
        }
        for Cut { finger, entity, force_n } in step.cuts() {
            self.watch.tell(Kind::Cut { finger: finger as u32, entity, force_n }, out);
        }
        self.tell_crowds(step, out);
        self.tell_overload(step, out);
        self.watch.grasps(out);
        self.tell_doors(step, out);
        self.tell_lists(step, out);
        self.tell_pairs(step, out);
        for parked in step.parked_now() {
            let why = parked.why.into();
            self.watch.tell(Kind::Parked { entity: parked.entity as u32, why }, out);
        }
    }

    /// The world ends in this tick of the run, and `next` tells of the one that takes over.
    pub fn end(&mut self, next: &mut Self, run_tick: u64, why: Kind, out: &mut EventSender) {
        self.watch.hand_on(&mut next.watch);
        self.end_all(run_tick, out);
        out.send(Event { run_tick, kind: why });
    }

    /// The run is over: all that began ends in the last tick that was looked at, or in a later one of which something was told.
    pub fn end_run(&mut self, told: Option<u64>, out: &mut EventSender) {
        if let Some(run_tick) = self.watch.last_tick() {
            self.end_all(told.map_or(run_tick, |told| told.max(run_tick)), out);
        }
    }

    fn end_all(&mut self, run_tick: u64, out: &mut EventSender) {
        let Some(of_nothing) = self.of_nothing.take() else { return };
        self.watch.begin(run_tick);
        self.end_overload(out);
        let ended = std::mem::replace(&mut self.watch, of_nothing);
        if let Err(ended) = ended.end(run_tick, out) {
            // It is not freed here.
            self.watch = ended;
        }
    }

    fn find_touching(&mut self, step: &FastStep, finger: usize) {
        self.touching.clear();
        for contact in step.fingers[finger].finger.contacts() {
            let is_body = step.objects.manipulation().is_body(contact.entity);
            let moved_W = is_body.then(|| step.objects.touch_force_W(finger, contact.entity)).flatten();
            self.touching.push(Touching {
                entity: contact.entity as u32,
                // While forces fade, it feels less of what is fixed.
                force_on_user_W: moved_W.unwrap_or(contact.force_on_user_W * step.strength),
                slips: ContactState::from(contact.friction) == ContactState::Slip,
                is_body,
            });
        }
    }

    fn tell_crowds(&mut self, step: &FastStep, out: &mut EventSender) {
        for ((finger, near), left_s) in (0..).zip(&step.near).zip(&mut self.crowded_s) {
            if begins(near.is_crowded(), left_s, step.period_s) {
                self.watch.tell(Kind::Crowded { finger }, out);
            }
        }
        for ((finger, gives_way), left_s) in (0..).zip(step.gives_way()).zip(&mut self.gives_way_s) {
            if begins(*gives_way, left_s, step.period_s) {
                self.watch.tell(Kind::GaveWay { finger }, out);
            }
        }
    }

    fn tell_overload(&mut self, step: &FastStep, out: &mut EventSender) {
        let waiting = u32::try_from(step.made().held).unwrap_or(u32::MAX);
        match &mut self.overload {
            None if waiting > 0 => {
                self.overload = Some((GOES_ON_S, waiting));
                self.watch.tell(Kind::Overload { change: Change::Begins, waiting }, out);
            }
            None => {}
            Some((left_s, most)) => {
                *left_s = if waiting > 0 { GOES_ON_S } else { *left_s - step.period_s };
                *most = waiting.max(*most);
                if *left_s <= 0.0 {
                    self.end_overload(out);
                }
            }
        }
    }

    fn end_overload(&mut self, out: &mut EventSender) {
        if let Some((_, waiting)) = self.overload.take() {
            self.watch.tell(Kind::Overload { change: Change::Ends, waiting }, out);
        }
    }

    fn tell_doors(&mut self, step: &FastStep, out: &mut EventSender) {
        for ((finger, own), was) in (0..).zip(&step.fingers).zip(&mut self.spaces) {
            let to = own.finger.space();
            let from = std::mem::replace(was, to);
            if from != to {
                self.watch.tell(Kind::Door { finger, from, to }, out);
            }
        }
    }

    fn tell_pairs(&mut self, step: &FastStep, out: &mut EventSender) {
        let manipulation = step.objects.manipulation();
        let stepped_s = step.objects.stepped_s();
        self.watch.take_from_slow(out);
        // Not all that are there: the life of a pair may come before the pair itself.
        let has_gone =
            |entity: u32| Some(self.gone.contains(&(manipulation.body_of(entity as usize)? as u32)));
        if !self.gone.is_empty() {
            let goes = |entities: [u32; 2]| entities.into_iter().filter_map(has_gone).all(|gone| gone);
            self.watch.go_to_slow((stepped_s, step.objects.slow_behind_s()), goes);
        }
        let pairs = manipulation
            .pair_forces()
            .map(|(entities, force_W)| PairForce { entities: entities.map(|entity| entity as u32), force_W });
        let standing =
            |entities: [u32; 2]| manipulation.pair_standing(entities.map(|entity| entity as usize));
        self.watch.pairs(pairs, stepped_s, standing, out);
    }

    /// Looks for who has been handed over only if anybody was.
    fn tell_lists(&mut self, step: &FastStep, out: &mut EventSender) {
        self.gone.clear();
        let Some((_, handed)) = step.handed() else { return };
        if (handed.came, handed.went) == (self.handed.came, self.handed.went) {
            return;
        }
        self.handed = handed;
        let manipulation = step.objects.manipulation();
        for (body, was) in self.elsewhere.iter_mut().enumerate() {
            let is = step.objects.is_slow(body);
            if std::mem::replace(was, is) != is {
                let (entity, to) =
                    (manipulation.entity_of(body) as u32, if is { List::Slow } else { List::Fast });
                self.watch.tell(Kind::ListChange { entity, to }, out);
                if is && self.gone.len() < self.gone.capacity() {
                    self.gone.push(body as u32);
                }
            }
        }
    }
}

/// True if something begins that `is` so in this tick and goes on for a while (s) when it is not any more.
fn begins(is: bool, left_s: &mut f64, period_s: f64) -> bool {
    let begins = is && *left_s <= 0.0;
    *left_s = if is { GOES_ON_S } else { *left_s - period_s };
    begins
}
