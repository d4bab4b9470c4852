//! The committed example: a Premium 1.5 that repeats a recorded trace.

use io_driver::config::DriverConfig;
use io_driver::device::{Effort, TickTime};
use io_driver::open::open_devices;
use nalgebra::Vector3;
use std::path::Path;

const PERIOD_NS: u64 = 1_000_000;

fn open() -> Box<dyn io_driver::device::Device> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/driver/replay.toml");
    let config = DriverConfig::load(&file).expect("the committed configuration");
    open_devices(&config).expect("its trace").remove(0)
}

fn time(tick: u64) -> TickTime {
    TickTime::counted(tick, PERIOD_NS, -1)
}

#[test]
fn the_replayed_tip_draws_the_circle_to_the_encoders_resolution() {
    let mut device = open();
    let mut farthest: f64 = 0.0;
    for tick in 0..=6000 {
        let reading = device.read(time(tick)).expect("a reading");
        let from_centre = reading.position_m - Vector3::new(0.0, 0.03, 0.0);
        // Each angle is rounded to half a count, 0.015 mm at the tip, and held for one more row of 2 ms,
        // in which the tip moves along the circle, not off it: three of the former.
        assert!((from_centre.norm() - 0.03).abs() < 45e-6, "tick {tick}: {from_centre:?}");
        farthest = farthest.max(reading.position_m.y);
    }
    assert!(farthest > 0.059, "it came round");
    let home = device.read(time(6001)).expect("a reading").position_m;
    assert!(home.norm() < 45e-6, "and home: {home:?}");
}

#[test]
fn what_is_said_to_be_rendered_is_the_force_to_the_converters_resolution() {
    let mut device = open();
    device.read(time(0)).expect("a reading");
    let wanted = Vector3::new(1.0, -0.5, 0.25);
    let written = device.write(Effort { force_on_user_n: wanted, gravity_share: 0.0 }).expect("written");
    assert_ne!(written.motor_codes, [2048; 3]);
    // Half a step of 5.5 A / 2048 through 23.4 mN m/A and a reduction of at most 13.5 over the 0.17 m link
    // is 2.5 mN an axis; three axes, and the lever arms are not all equal.
    assert!((written.force_on_user_n - wanted).norm() < 8e-3, "{written:?}");
    assert_ne!(written.force_on_user_n, wanted, "it is the rounded one");
    let zero = device.write(Effort::default()).expect("written");
    assert_eq!((zero.force_on_user_n, zero.motor_codes), (Vector3::zeros(), [2048; 3]));
}
