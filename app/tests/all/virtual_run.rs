//! Runs on the virtual clock, in one thread.

use patience::prelude::*;
use phantom3::fast_loop::{FastLoop, WhenFull};
use phantom3::outcome::Stop;
use phantom3::progress::Progress;
use phantom3::rig::{HandMode, Rig};
use phantom3::row_queue::row_queue_of;
use phantom3::slow::SlowSide;
use phantom3::virtual_clock::VirtualDriver;
use rt_core::signals::StopSignals;
use shm_abi::segment::ClockMode;
use std::path::Path;
use world::Scene;
use world::events::Hub;

/// Of thirty thousand things that move and change fewer rows fit into the queue than there are ticks between two turns of the
/// slow side.
#[test]
fn a_run_goes_on_though_few_rows_fit_into_its_queue() {
    for places in [2, 3, 39] {
        // One that waits for itself would wait for ever.
        let run = std::thread::spawn(move || run(places));
        run.bounded_join().unwrap_or_else(|_| panic!("a run with {places} places"));
    }
}

fn run(places: usize) {
    let scene = "[[finger]]\n[[entity]]\nname = \"ball\"\nmass_kg = 0.1\n\
                 shape = { kind = \"sphere\", radius_m = 0.01 }\ngrid = { count = [8, 1, 1], spacing_m = [0.1, 1, 1] }\n";
    let file = Path::new("scene.toml");
    let scene = Scene::parse(scene, file).expect("a scene");
    let rig = Rig::new(file, scene, None, None, HandMode::Kinematic, 1_000_000).expect("a rig");
    let mut driver = VirtualDriver::open(&rig.driver_config(ClockMode::Virtual)).expect("devices");
    let step = rig.fast_step().expect("a step");
    let (rows, taken) = row_queue_of(places, usize::MAX, step.bodies().len());
    let mut fast = FastLoop::new(step, rows, WhenFull::Wait, 500, rig.period_ns);
    let mut slow = SlowSide::new(taken, Hub::new(Vec::new()), Vec::new());
    let mut progress = Progress::new(500, rig.period_ns);
    let signals = StopSignals::install().expect("signals");
    let stop = driver.run(&mut fast, &mut slow, &mut progress, &signals);
    assert!(matches!(stop, Stop::Finished), "{places} places");
    assert_eq!((fast.tally.rows, fast.tally.rows_lost), (500, 0), "{places} places");
}
