//! Contact damping of a finger that rests in a wall while its counters flicker by one count.
//!
//! The wall has 1000 N/m and 5 N s/m. A count is up to 0.0292 mm at the tip of a Premium: 0.03 N of spring, which no
//! estimate can take away, and as a difference of two ticks 29 mm/s at 1 kHz, 234 mm/s at 8 kHz: 0.15 N and 1.2 N of
//! damper. Where a finger rests on the edge of a count, that is the force that it hums with.

use haptics::{Entity, Finger, Hip, Plane};
use io_driver::device::TickTime;
use io_driver::device::arm::Arm;
use io_driver::device_file::{DeviceFile, builtin};
use nalgebra::{Isometry3, Vector3};
use std::path::Path;

const STIFFNESS: f64 = 1000.0;
const DAMPING: f64 = 5.0;
/// Below the wall's surface (m).
const DEPTH_M: f64 = 2e-3;
/// At the tip, of the joint that moves it farthest (m).
const COUNT_M: f64 = 29.2e-6;

fn arm() -> Arm {
    let text = builtin("premium-1.5").unwrap();
    let Ok(DeviceFile::Arm(file)) = DeviceFile::parse(text, Path::new("premium-1.5.toml")) else {
        panic!("the Premium is an arm")
    };
    Arm::new(&file, false)
}

/// A coin's throws; the same ones every time.
struct Coin(u64);

impl Coin {
    fn throw(&mut self) -> i64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 63) as i64
    }
}

/// The damper's part of the force upwards (N): root mean square and largest, over half a second.
fn ripple(rate_hz: u64, knows_velocity: bool) -> (f64, f64) {
    let wall = Entity::new(Plane::new(Vector3::y(), DEPTH_M).unwrap(), Isometry3::identity(), STIFFNESS);
    let wall = wall.unwrap().with_damping(DAMPING).unwrap();
    let (mut arm, mut finger, mut coin) =
        (arm(), Finger::new(0.0, 1).unwrap().with_ramp_in(0.0).unwrap(), Coin(7));
    let period_ns = 1_000_000_000 / rate_hz;
    let (mut squares, mut largest, mut count) = (0.0, 0.0_f64, 0.0);
    for tick in 0..rate_hz / 2 {
        // The first pose is the home pose; the counters flicker from then on.
        let raw = if tick == 0 { [0; 3] } else { [coin.throw(), coin.throw(), coin.throw()] };
        let reading = arm.read(raw, TickTime::counted(tick, period_ns, 0));
        let velocity = knows_velocity.then_some(reading.velocity_m_per_s);
        let hip = Hip { position_W: reading.position_m, velocity_W: velocity };
        let force = finger.step(std::slice::from_ref(&wall), hip, period_ns as f64 / 1e9).force_on_user_W.y;
        let spring = STIFFNESS * (DEPTH_M - reading.position_m.y);
        // Until the window is open.
        if tick > rate_hz * 30 / 1000 {
            squares += (force - spring).powi(2);
            largest = largest.max((force - spring).abs());
            count += 1.0;
        }
    }
    ((squares / count).sqrt(), largest)
}

#[test]
fn a_resting_finger_in_a_damped_wall_does_not_hum() {
    for rate_hz in [1000, 2000, 4000, 8000] {
        let (hum, loudest_hum) = ripple(rate_hz, false);
        let (calm, loudest) = ripple(rate_hz, true);
        println!(
            "{rate_hz} Hz: difference {hum:.3} N, largest {loudest_hum:.3}; estimate {calm:.4} N, largest {loudest:.4}"
        );
        // Half of all throws differ from those before: a count in a tick, times the root of a half.
        let step_n = DAMPING * COUNT_M * rate_hz as f64;
        assert!(hum > 0.6 * step_n && loudest_hum > 0.95 * step_n, "{rate_hz} Hz: {hum} of {step_n}");
        // The mean of 30 ms is off by some 2 mm/s at 1 kHz: 10 mN, a tenth of the difference's and a third of the
        // spring's own step. More readings in that time make it less; those of the difference make it more.
        assert!(calm < 0.015 && calm < 0.12 * hum, "{rate_hz} Hz: {calm} of {hum}");
        // And a peak is below two of the spring's own steps.
        assert!(loudest < 2.0 * STIFFNESS * COUNT_M, "{rate_hz} Hz: {loudest}");
    }
}

/// Calm is easy for a damper that does nothing.
#[test]
fn a_finger_that_presses_on_is_damped_as_its_speed_asks() {
    let wall = Entity::new(Plane::new(Vector3::y(), 0.02).unwrap(), Isometry3::identity(), STIFFNESS);
    let wall = wall.unwrap().with_damping(DAMPING).unwrap();
    let (mut arm, mut finger) = (arm(), Finger::new(0.0, 1).unwrap().with_ramp_in(0.0).unwrap());
    for tick in 0..100 {
        // The upper arm sinks by five counts a tick, which is 146 mm/s.
        let reading = arm.read([0, -5 * tick, 0], TickTime::counted(tick as u64, 1_000_000, 0));
        let hip = Hip { position_W: reading.position_m, velocity_W: Some(reading.velocity_m_per_s) };
        let force = finger.step(std::slice::from_ref(&wall), hip, 1e-3).force_on_user_W.y;
        let damper = force - STIFFNESS * (0.02 - reading.position_m.y);
        // The arc that the tip goes is level with its chord to the square of the angle, 0.07 rad.
        assert!(
            tick < 5 || (damper / (DAMPING * 5.0 * COUNT_M / 1e-3) - 1.0).abs() < 0.01,
            "{tick}: {damper}"
        );
    }
}
