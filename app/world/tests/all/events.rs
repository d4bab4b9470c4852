//! The bus and the watch against closed cases.

#![allow(non_snake_case)] // Frames are capital letters.

use nalgebra::Vector3;
use std::sync::{Arc, Mutex};
use world::events::{
    Change, Class, Event, EventReceiver, EventSender, Filter, Hub, Kind, Life, MOST_TOLD, PairForce,
    PairStanding, SlowPairs, Touching, Watch, event_queue, pair_link,
};

const PERIOD_S: f64 = 0.001;

fn touching(entity: u32, force_n: f64, slips: bool) -> Touching {
    let force_on_user_W = Vector3::new(0.0, force_n, 0.0);
    Touching { entity, force_on_user_W, slips, is_body: entity > 0 }
}

fn all(events: &mut EventReceiver) -> Vec<Event> {
    std::iter::from_fn(|| events.receive(u64::MAX)).collect()
}

fn words(events: &[Event]) -> Vec<String> {
    events.iter().map(|event| format!("{} {}", event.run_tick, event.kind.facts().word)).collect()
}

/// One finger, looked at as if it touched these in consecutive ticks.
fn felt(ticks: &[&[Touching]]) -> Vec<Event> {
    let (mut out, mut events) = event_queue(1024);
    let mut watch = Watch::new(1, 4, 0, PERIOD_S);
    for (run_tick, touching) in (0..).zip(ticks) {
        watch.begin(run_tick);
        watch.finger(0, touching, 0, None, &mut out);
        watch.grasps(&mut out);
    }
    all(&mut events)
}

#[test]
fn contacts_and_slips_begin_and_end_in_order() {
    let (on, slips, other) = ([touching(0, 2.0, false)], [touching(0, 2.0, true)], [touching(1, 2.0, true)]);
    let told = felt(&[&[], &on, &slips, &on, &slips, &other, &[]]);
    assert_eq!(
        words(&told),
        [
            "1 contact-begin",
            "2 slip-begin",
            "3 slip-end",
            "4 slip-begin",
            "5 slip-end",
            "5 contact-end",
            "5 contact-begin",
            "5 slip-begin",
            "6 slip-end",
            "6 contact-end",
        ]
    );
}

#[test]
fn a_contact_s_impulse_is_the_sum_of_its_forces_times_the_tick() {
    let forces_n = [0.5, 1.25, 3.0, 0.125];
    let ticks: Vec<[Touching; 1]> = forces_n.iter().map(|force_n| [touching(0, *force_n, false)]).collect();
    let ticks: Vec<&[Touching]> = ticks.iter().map(|tick| &tick[..]).chain([&[][..]]).collect();
    let told = felt(&ticks);
    let life = told[1].kind.facts().life.expect("a contact's life");
    // Four sums and products of numbers near 1e-3: each rounds by less than 1e-18.
    assert!((life.impulse_W.y - 4.875e-3).abs() < 1e-17, "{life:?}");
    assert_eq!((life.peak_n, life.force_n, life.lasted_s), (3.0, 0.125, 4.0 * PERIOD_S));
}

#[test]
fn all_of_a_crowd_is_told_and_what_finds_no_room_is_counted() {
    let crowd: Vec<Touching> = (0..100).map(|entity| touching(3 * entity, 1.0, false)).collect();
    for (most_touched, lost) in [(100, 0), (90, 10)] {
        let (mut out, mut events) = event_queue(1024);
        let mut watch = Watch::new(1, most_touched, 0, PERIOD_S);
        for (run_tick, touching) in [(0, &crowd[..]), (1, &crowd[..1]), (2, &[])] {
            watch.begin(run_tick);
            watch.finger(0, touching, 0, None, &mut out);
        }
        let told = all(&mut events);
        let in_tick = |tick, word| {
            told.iter().filter(|event| event.run_tick == tick && event.kind.facts().word == word).count()
        };
        let begun = most_touched;
        assert_eq!(in_tick(0, "contact-begin"), begun);
        assert_eq!((in_tick(1, "contact-end"), in_tick(2, "contact-end")), (begun - 1, 1));
        assert_eq!(events.lost(), lost);
    }
}

/// What is told of a pair that presses with these forces (N) in consecutive ticks; asleep where there is none at all.
fn pressed(forces_n: &[Option<f64>]) -> Vec<Event> {
    pressed_or(PairStanding::Asleep, forces_n)
}

fn pressed_or(otherwise: PairStanding, forces_n: &[Option<f64>]) -> Vec<Event> {
    let (mut out, mut events) = event_queue(1024);
    let mut watch = Watch::new(0, 0, 4, PERIOD_S);
    for (run_tick, force_n) in (0..).zip(forces_n) {
        let pair = force_n.map(|force_n| PairForce { entities: [2, 0], force_W: Vector3::y() * force_n });
        watch.begin(run_tick);
        let standing = |_| if force_n.is_none() { otherwise } else { PairStanding::Stepped };
        watch.pairs(pair.into_iter(), PERIOD_S, standing, &mut out);
    }
    all(&mut events)
}

fn life(event: &Event) -> Life {
    event.kind.facts().life.expect("a contact's life")
}

#[test]
fn a_pair_that_is_apart_for_less_than_five_milliseconds_still_touches() {
    let chatter: Vec<_> = (0..40).map(|tick| Some(if tick % 5 == 0 { 2.0 } else { 0.0 })).collect();
    assert_eq!(words(&pressed(&chatter)), ["0 pair-begin"]);
    let apart = [Some(2.0), Some(2.0), Some(0.0), Some(0.0), Some(0.0), Some(0.0), Some(0.0), Some(2.0)];
    let told = pressed(&apart);
    assert_eq!(words(&told), ["0 pair-begin", "6 pair-end", "7 pair-begin"]);
    let life = told[1].kind.facts().life.expect("a contact's life");
    assert_eq!((life.impulse_W.y, life.lasted_s), (2.0 * PERIOD_S + 2.0 * PERIOD_S, 2.0 * PERIOD_S));
}

#[test]
fn a_pair_that_sleeps_still_touches() {
    let asleep: Vec<_> = [Some(2.0)].into_iter().chain([None; 50]).chain([Some(2.0)]).collect();
    assert_eq!(words(&pressed(&asleep)), ["0 pair-begin"]);
}

#[test]
fn a_pair_that_sleeps_goes_on_with_the_force_of_its_rest() {
    let apart = [Some(0.0); 5];
    let asleep: Vec<_> = [Some(3.0), Some(2.0)].into_iter().chain([None; 50]).chain(apart).collect();
    let told = pressed(&asleep);
    assert_eq!(words(&told), ["0 pair-begin", "56 pair-end"]);
    // 52 sums of numbers up to 0.1.
    assert!(
        (life(&told[1]).impulse_W.y - (3.0 + 51.0 * 2.0) * PERIOD_S).abs() < 1e-15,
        "{:?}",
        life(&told[1])
    );
    assert!((life(&told[1]).lasted_s - 52.0 * PERIOD_S).abs() < 1e-15);
    assert_eq!((life(&told[1]).force_n, life(&told[1]).peak_n), (2.0, 3.0));
}

/// It fell asleep just apart, or waits for its turn as it was thrown.
#[test]
fn a_pair_whose_last_force_was_not_that_of_rest_gets_no_more_of_it() {
    let asleep: Vec<_> =
        [Some(30.0), Some(0.0)].into_iter().chain([None; 50]).chain([Some(0.0); 5]).collect();
    let waits: Vec<_> = [Some(30.0)].into_iter().chain([None; 50]).chain([Some(0.0); 5]).collect();
    for (standing, forces) in [(PairStanding::Asleep, asleep), (PairStanding::Waiting, waits)] {
        let told = pressed_or(standing, &forces);
        assert_eq!(words(&told)[0], "0 pair-begin");
        assert_eq!((told.len(), life(&told[1]).impulse_W.y), (2, 30.0 * PERIOD_S), "{standing:?}");
    }
}

fn pair(entity: u32, force_n: f64) -> PairForce {
    PairForce { entities: [entity, 0], force_W: Vector3::y() * force_n }
}

/// So many ticks of the slow list, in which these press by a newton.
fn slow_ticks(slow: &SlowPairs, ticks: u32, entities: std::ops::Range<u32>) {
    for _ in 0..ticks {
        let pairs = entities.clone().map(|entity| pair(entity, 1.0));
        slow.look(pairs, (1, PERIOD_S), |_| PairStanding::Stepped);
    }
}

#[test]
fn when_a_world_ends_all_that_touched_in_either_list_has_ended_before() {
    const SLOW: u32 = 3000;
    let (link, slow) = pair_link();
    let (mut out, mut events) = event_queue(8192);
    let mut watch = Watch::new(2, 4, 2048, PERIOD_S).with_slow(Some(link));
    let slides = [touching(3, 1.0, true)];
    for run_tick in 0..40 {
        if run_tick % 10 == 0 {
            slow.begin_turn();
            slow_ticks(&slow, 10, 10_000..10_000 + SLOW);
        }
        watch.begin(run_tick);
        watch.finger(0, &slides, 1, Some(4), &mut out);
        watch.finger(1, &slides, 0, None, &mut out);
        watch.grasps(&mut out);
        watch.take_from_slow(&mut out);
        let pairs = (100..1100).map(|entity| pair(entity, 1.0));
        watch.pairs(pairs, PERIOD_S, |_| PairStanding::Stepped, &mut out);
    }
    let lost = events.lost();
    let mut next = Watch::new(2, 4, 2048, PERIOD_S);
    watch.hand_on(&mut next);
    Box::new(watch).end(40, &mut out).expect("room");
    // It may go on until it hears of that.
    slow.begin_turn();
    slow_ticks(&slow, 10, 1..2);
    out.send(Event { run_tick: 40, kind: Kind::Reset });
    assert_eq!(events.lost(), lost, "an end takes one place");
    let told = all(&mut events);
    assert_eq!(words(&told).last().map(String::as_str), Some("40 reset"));
    let mut open = std::collections::HashMap::new();
    for event in &told {
        let facts = event.kind.facts();
        let is_of_contact = facts.word.starts_with("contact") || facts.word.starts_with("slip");
        let what = if is_of_contact { facts.word.split('-').next().unwrap_or_default() } else { "" };
        let count: &mut i32 =
            open.entry((event.kind.class() as u32, what, facts.finger, facts.entity)).or_default();
        match event.kind {
            Kind::Reset | Kind::Lost { .. } | Kind::Button { .. } => {}
            kind if kind.is_end() => *count -= 1,
            _ => *count += 1,
        }
    }
    // The beginnings of pairs of the fast list that had no room in their tick are counted as lost; their ends are told.
    let wrong: Vec<_> = open.iter().filter(|(_, count)| **count > 0).collect();
    assert!(wrong.is_empty(), "they did not end: {wrong:?}");
    let ends = told.iter().filter(|event| event.run_tick == 40 && event.kind.class() == Class::Pair);
    let of_slow = ends.filter(|event| event.kind.is_end() && event.kind.facts().entity >= Some(10_000));
    let lives: Vec<Life> = of_slow.map(life).collect();
    assert_eq!(lives.len(), SLOW as usize);
    for life in lives {
        // 40 sums of numbers up to 0.04.
        assert!((life.impulse_W.y - 0.04).abs() < 1e-15 && (life.lasted_s - 0.04).abs() < 1e-15, "{life:?}");
    }
    // The button is still down.
    next.begin(41);
    next.finger(0, &[], 1, None, &mut out);
    assert_eq!(words(&all(&mut events)), [""; 0]);
}

/// Its life arrives a turn late, when it has ended already.
#[test]
fn a_pair_that_ends_in_the_turn_in_which_it_went_over_ends_once() {
    let (link, slow) = pair_link();
    let (mut out, mut events) = event_queue(64);
    let mut watch = Watch::new(0, 0, 4, PERIOD_S).with_slow(Some(link));
    let look = |watch: &mut Watch, run_tick, force_n: Option<f64>, out: &mut EventSender| {
        watch.begin(run_tick);
        watch.take_from_slow(out);
        if run_tick == 9 {
            watch.go_to_slow((PERIOD_S, 0.0), |_| true);
        }
        let pairs = force_n.map(|force_n| pair(7, force_n));
        watch.pairs(pairs.into_iter(), PERIOD_S, |_| PairStanding::Stepped, out);
    };
    (0..9).for_each(|tick| look(&mut watch, tick, Some(1.0), &mut out));
    // Who steps both begins a turn before the watch of the fast side has told who went.
    slow.begin_turn();
    slow_ticks(&slow, 3, 7..8);
    slow_ticks(&slow, 7, 7..7);
    look(&mut watch, 9, None, &mut out);
    for turn in 1..4 {
        slow.begin_turn();
        slow_ticks(&slow, 10, 7..7);
        look(&mut watch, 9 + 10 * turn, None, &mut out);
    }
    let told = all(&mut events);
    assert_eq!(words(&told), ["0 pair-begin", "19 pair-end"]);
    // Ten ticks on the fast side, three on the slow one.
    assert!((life(&told[1]).impulse_W.y - 0.013).abs() < 1e-15, "{:?}", life(&told[1]));
}

/// Findings of the slow side are told a turn later.
#[test]
fn a_pair_that_goes_to_the_fast_list_at_once_begins_before_it_ends() {
    let (link, slow) = pair_link();
    let (mut out, mut events) = event_queue(64);
    let mut watch = Watch::new(0, 0, 4, PERIOD_S).with_slow(Some(link));
    slow.begin_turn();
    slow_ticks(&slow, 10, 7..8);
    slow.go(|_| true, |_| false, 0.0);
    for run_tick in 9..40 {
        if run_tick % 10 == 9 {
            slow.begin_turn();
        }
        watch.begin(run_tick);
        watch.take_from_slow(&mut out);
        // A large island takes a while.
        let standing = |_| if run_tick < 20 { PairStanding::Away } else { PairStanding::Stepped };
        watch.pairs(std::iter::empty(), PERIOD_S, standing, &mut out);
    }
    let told = all(&mut events);
    assert_eq!(words(&told), ["9 pair-begin", "24 pair-end"]);
    assert!((life(&told[1]).impulse_W.y - 0.01).abs() < 1e-15, "{:?}", life(&told[1]));
}

#[test]
fn two_fingers_grasp_one_does_not_and_a_tie_does() {
    let (mut out, mut events) = event_queue(1024);
    let mut watch = Watch::new(2, 4, 0, PERIOD_S);
    let (none, some) = ([].as_slice(), [touching(3, 1.0, false)]);
    for run_tick in 0..40 {
        watch.begin(run_tick);
        watch.finger(0, if (2..30).contains(&run_tick) { &some } else { none }, 0, None, &mut out);
        let tied = (20..25).contains(&run_tick).then_some(3);
        watch.finger(1, if (5..10).contains(&run_tick) { &some } else { none }, 0, tied, &mut out);
        watch.grasps(&mut out);
    }
    let grasps: Vec<_> =
        all(&mut events).into_iter().filter(|event| event.kind.class() == Class::Grasp).collect();
    assert_eq!(words(&grasps), ["5 grasp", "14 release", "20 grasp", "29 release"]);
    assert_eq!(grasps[0].kind, Kind::Grasp { entity: 3, fingers: 0b11 });
    assert_eq!(grasps[1].kind, Kind::Release { entity: 3, lasted_s: 5.0 * PERIOD_S });
}

#[test]
fn a_full_queue_counts_and_tells_what_it_lost() {
    let (mut out, mut events) = event_queue(4);
    let key = |run_tick| Event { run_tick, kind: Kind::Key { code: 1, is_pressed: true } };
    let sent: Vec<bool> = (0..10).map(|tick| out.send(key(tick))).collect();
    assert_eq!(sent.iter().filter(|sent| **sent).count(), 4);
    assert_eq!((events.lost(), words(&all(&mut events)).len()), (6, 4));
    assert!(out.send(key(10)));
    let told = all(&mut events);
    assert_eq!(told, [Event { run_tick: 10, kind: Kind::Lost { count: 6 } }, key(10)]);
}

#[test]
fn a_tick_sends_no_more_than_it_may_and_the_rest_is_counted() {
    let (mut out, mut events) = event_queue(4 * MOST_TOLD);
    let mut watch = Watch::new(0, 0, 0, PERIOD_S);
    watch.begin(7);
    for number in 0..MOST_TOLD as u32 + 3 {
        watch.tell(Kind::Trial { change: Change::Begins, number }, &mut out);
    }
    assert_eq!((all(&mut events).len(), events.lost()), (MOST_TOLD, 3));
}

fn send_some(out: &mut EventSender) {
    let life = Default::default();
    let touch = |finger, entity, change| Kind::FingerTouch { finger, entity, change, life };
    let kinds = [
        touch(0, 1, Change::Begins),
        touch(1, 1, Change::Slips),
        Kind::PairTouch { entities: [1, 2], change: Change::Begins, life },
        Kind::Grasp { entity: 1, fingers: 0b10 },
        Kind::Reset,
    ];
    for (run_tick, kind) in (0..).zip(kinds) {
        out.send(Event { run_tick, kind });
    }
}

#[test]
fn a_subscriber_gets_what_its_filter_lets_through() {
    let names: Vec<String> = ["table", "cube", "ball"].map(Into::into).into();
    let named = |name| Filter::ALL.entity_named(name, &names);
    assert_eq!(named("cone"), None);
    let cases = [
        (Filter::ALL, vec![0, 1, 2, 3, 4]),
        (Filter::of(&[Class::Slip, Class::Reset]), vec![1, 4]),
        (Filter::ALL.finger(1), vec![1, 3]),
        (named("ball").expect("an entity"), vec![2]),
        (Filter::of(&[Class::Contact]).entity(1), vec![0]),
    ];
    for (filter, expected) in cases {
        let (mut out, events) = event_queue(64);
        let mut hub = Hub::new(vec![events]);
        let seen = Arc::new(Mutex::new(Vec::new()));
        let sink = seen.clone();
        hub.subscribe(filter, Box::new(move |event: &Event| sink.lock().unwrap().push(event.run_tick)));
        let mut own = hub.subscribe_queue(filter, 64);
        send_some(&mut out);
        hub.deliver(u64::MAX);
        assert_eq!(*seen.lock().unwrap(), expected, "{filter:?}");
        let queued: Vec<u64> = all(&mut own).iter().map(|event| event.run_tick).collect();
        assert_eq!(queued, expected, "{filter:?}");
    }
}

#[test]
fn events_of_later_ticks_wait() {
    let (mut out, events) = event_queue(64);
    let mut hub = Hub::new(vec![events]);
    let mut own = hub.subscribe_queue(Filter::ALL, 64);
    send_some(&mut out);
    hub.deliver(2);
    assert_eq!(all(&mut own).len(), 3);
    hub.deliver(3);
    assert_eq!(all(&mut own).len(), 1);
}
