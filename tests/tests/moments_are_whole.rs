//! What a window is told of while the fast thread runs: each moment is of one tick, however little of the time anybody looks.
//!
//! A finger goes along a straight line, and a heavy block rises into it: where the god-object is depends on where the block is
//! in that very tick. Two more blocks drift, one twice as fast as the other. So a moment that mixed two ticks would be off by
//! what something moves in a tick, 2 um at least.

use nalgebra::Vector3;
use patience::prelude::*;
use phantom3::book::Book;
use phantom3::fast_loop::{FastLoop, Tally, WhenFull};
use phantom3::fast_thread::{self, FastEnd, FastShared};
use phantom3::rig::{HandMode, Rig};
use phantom3::row_queue::row_queue_of;
use phantom3::shown::Shown;
use phantom3::slow::SlowSide;
use phantom3::spectator::{Onlooker, Spectator};
use shm_abi::segment::ClockMode;
use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;
use system_tests::driver::Driver;
use view::{Ask, Glimpse, Moment, News};
use world::Scene;
use world::events::Hub;

const SCENE: &str = r#"
gravity_m_s2 = [0.0, 0.0, 0.0]
hand = "hand.csv"
[[finger]]
start_m = [-0.03, 0.0, 0.0]
[[entity]]
name = "rises"
shape = { kind = "box", size_m = [0.2, 0.2, 0.2] }
position_m = [0.0, -0.101, 0.0]
velocity_m_s = [0.0, 0.003, 0.0]
mass_kg = 1e5
stiffness_n_per_m = 100.0
[[entity]]
name = "drifts"
shape = { kind = "box", size_m = [0.02, 0.02, 0.02] }
position_m = [0.5, 0.0, 0.0]
velocity_m_s = [0.0, 0.0, 0.01]
mass_kg = 0.1
[[entity]]
name = "drifts-twice"
shape = { kind = "box", size_m = [0.02, 0.02, 0.02] }
position_m = [-0.5, 0.0, 0.0]
velocity_m_s = [0.0, 0.0, 0.02]
mass_kg = 0.1
"#;
const HAND: &str = "t,f0_x,f0_y,f0_z\n0,-0.03,0,0\n10,0.07,0,0\n";

const PERIOD_NS: u64 = 1_000_000;
const TICKS: u64 = 6000;
/// Sums of some thousand steps, and the god-object's way through the block's frame; a tick's way is 2e-6 m at least.
const ROUNDING_M: f64 = 1e-9;

/// Notes what it is told.
#[derive(Clone, Default)]
struct Notes(Rc<RefCell<Vec<Glimpse>>>);

impl Onlooker for Notes {
    fn tell(&mut self, news: News) -> Option<News> {
        if let News::Glimpse(glimpse) = news {
            self.0.borrow_mut().push(*glimpse);
        }
        None
    }

    fn asked(&mut self) -> Vec<Ask> {
        Vec::new()
    }

    fn is_open(&self) -> bool {
        true
    }
}

/// A run in real time through a queue for so many rows, whose slow side has a turn after each pause.
fn watch(places: usize, pause: Duration) -> (Vec<Glimpse>, Tally) {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("scene.toml");
    std::fs::write(directory.path().join("hand.csv"), HAND).expect("a hand");
    let scene = Scene::parse(SCENE, &file).expect("a scene");
    let hand = scene.hand.clone();
    let rig = Rig::new(&file, scene, None, hand.as_deref(), HandMode::Kinematic, PERIOD_NS).expect("a rig");
    let driver = Driver::start(&rig.driver_config(ClockMode::Real).to_toml());
    let attachment = driver.command();
    let step = rig.fast_step().expect("a step");
    let (sender, receiver) = row_queue_of(places, usize::MAX, step.bodies().len());
    let notes = Notes::default();
    let Shown { moments, .. } = Shown::new(&rig, step.entities());
    let mut hub = Hub::new(Vec::new());
    let spectator = Spectator::new(notes.clone(), moments, &mut hub, Book::default()).every(Duration::ZERO);
    let mut slow = SlowSide::new(receiver, hub, Vec::new()).with_spectator(Some(spectator));
    let fast = FastLoop::new(step, sender, WhenFull::Drop, TICKS, PERIOD_NS);
    let commander = attachment.commander.expect("the lease");
    let (_, thread) =
        fast_thread::start(fast, attachment.driver, commander, FastShared::default()).expect("a thread");
    patience::until("the fast thread has done its ticks", || {
        slow.step();
        std::thread::sleep(pause);
        thread.is_finished()
    });
    let remains = thread.bounded_join().expect("no panic");
    assert_eq!(remains.end, FastEnd::Finished);
    slow.finish();
    (notes.0.take(), remains.fast.tally)
}

fn is_of_one_tick(moment: &Moment, first: &Moment) -> Result<(), String> {
    let far = |a: f64, b: f64| (a - b).abs() > ROUNDING_M;
    let [finger] = &moment.fingers[..] else { return Err("one finger".into()) };
    let hip = Vector3::new(-0.03 + 0.01 * moment.t_s, 0.0, 0.0);
    if (finger.hip - hip).norm() > ROUNDING_M {
        return Err(format!("the finger is {} beside its way", (finger.hip - hip).norm()));
    }
    let at = |entity: usize| moment.poses[entity].translation.vector - first.poses[entity].translation.vector;
    if far(2.0 * at(1).z, at(2).z) {
        return Err(format!("one has drifted {}, the other {}", at(1).z, at(2).z));
    }
    // In the block's frame: the finger, which presses beside its middle, turns it by some 1e-7 rad.
    let height = moment.poses[0].inverse_transform_point(&finger.god_object.into()).y;
    if finger.entity == Some(0) && far(height, 0.1) {
        return Err(format!("the god-object is at {height} in the block, whose surface is at 0.1"));
    }
    if finger.entity == Some(0) && finger.contact.is_none_or(|contact| far(contact.normal.y, 1.0)) {
        return Err(format!("the normal is not up: {:?}", finger.contact));
    }
    Ok(())
}

fn check(glimpses: &[Glimpse]) {
    let first = &glimpses[0].moment;
    for glimpse in glimpses {
        let moment = &glimpse.moment;
        is_of_one_tick(moment, first).unwrap_or_else(|wrong| panic!("at {} s: {wrong}", moment.t_s));
        assert_eq!(glimpse.samples.last().map(|sample| sample.t_s), Some(moment.t_s));
    }
    for pair in glimpses.windows(2) {
        assert!(pair[1].moment.t_s > pair[0].moment.t_s, "time goes on");
    }
    let times: Vec<f64> =
        glimpses.iter().flat_map(|glimpse| &glimpse.samples).map(|sample| sample.t_s).collect();
    assert!(times.windows(2).all(|pair| pair[1] > pair[0]), "no tick is told twice");
    let touching = glimpses.iter().filter(|glimpse| glimpse.moment.fingers[0].entity == Some(0)).count();
    assert!(touching > glimpses.len() / 2, "{touching} of {}", glimpses.len());
}

#[test]
fn every_moment_is_of_one_tick_while_the_fast_thread_runs() {
    let (glimpses, tally) = watch(1024, Duration::from_micros(300));
    println!("{} moments, {tally:?}", glimpses.len());
    assert!(glimpses.len() > 1000, "{}", glimpses.len());
    check(&glimpses);
    let samples: usize = glimpses.iter().map(|glimpse| glimpse.samples.len()).sum();
    assert_eq!((samples as u64, tally.rows_lost), (tally.rows, 0), "each row was seen");
}

#[test]
fn where_nobody_looks_in_time_rows_are_lost_and_counted_and_the_others_are_whole() {
    let (glimpses, tally) = watch(3, Duration::from_millis(7));
    println!("{} moments, {tally:?}", glimpses.len());
    check(&glimpses);
    let samples: usize = glimpses.iter().map(|glimpse| glimpse.samples.len()).sum();
    assert_eq!(samples as u64, tally.rows, "who was sent was seen");
    assert!(tally.rows_lost > TICKS / 10, "{tally:?}");
    assert!(tally.rows + tally.rows_lost <= TICKS);
    assert!(
        tally.rows + tally.rows_lost + tally.frames_missed >= TICKS - 1,
        "the others are counted: {tally:?}"
    );
}
