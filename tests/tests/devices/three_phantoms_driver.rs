//! config/driver/three-phantoms.toml: three simulated arms of which one leans and one lies on its side.
//!
//! Which way their weight pulls is told by the bodies' centres in the world, from the drawing and nothing else.

use bytemuck::Zeroable;
use haptics::Finger;
use io_driver::config::{Backend, DriverConfig};
use nalgebra::{Isometry3, Vector3};
use phantom3::fast_loop::{FastLoop, Turn, WhenFull};
use phantom3::fast_step::{DeviceFinger, FastStep};
use phantom3::mount::Mount;
use phantom3::row_queue::row_queue;
use phantom3::virtual_clock::VirtualDriver;
use shm_abi::segment::ClockMode;
use shm_abi::{DriverState, Frame};
use std::path::{Path, PathBuf};
use world::Layout;

fn config(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../config").join(name)
}

fn three_phantoms() -> DriverConfig {
    let mut config = DriverConfig::load(&config("driver/three-phantoms.toml")).expect("in order");
    config.clock = ClockMode::Virtual;
    config
}

/// The same, with nobody at the tips, and full authority at once, so that no arm falls before it is held.
fn let_go(is_compensated: bool) -> DriverConfig {
    let mut config = three_phantoms();
    config.safety.ramp_in_ns = config.period_ns;
    for device in &mut config.devices {
        device.compensates_gravity = is_compensated;
        let Backend::Simulated { holder, .. } = &mut device.backend else { panic!("simulated") };
        *holder = None;
    }
    config
}

fn bases(config: &DriverConfig) -> [Isometry3<f64>; 3] {
    [0, 1, 2].map(|device| config.devices[device].backend.wish().expect("simulated").base_in_world)
}

/// Runs the driver with an application that has nothing to touch, and shows each frame.
fn run(config: &DriverConfig, ticks: u64, mut look: impl FnMut(&Frame)) {
    let finger = |device: usize| DeviceFinger {
        finger: Finger::new(0.005, 0).expect("a finger"),
        device,
        mount: Mount::new(bases(config)[device]),
    };
    let step = FastStep::new(vec![finger(0), finger(1), finger(2)], Vec::new(), config.period_ns);
    // Nobody reads the rows.
    let (rows, _) = row_queue(0);
    let mut fast = FastLoop::new(step, rows, WhenFull::Drop, u64::MAX, config.period_ns);
    let mut driver = VirtualDriver::open(config).expect("the driver file opens");
    let mut frame = Frame::zeroed();
    for tick in 1..=ticks {
        let turn = driver.tick(tick, &mut fast);
        assert!(!matches!(turn, Turn::Fault(_)), "tick {tick}: {turn:?}");
        driver.view().read_frame(tick, &mut frame).expect("this tick's");
        look(&frame);
    }
}

fn tip(frame: &Frame, device: usize) -> Vector3<f64> {
    Vector3::from(frame.devices[device].position_m_measured)
}

/// Height (m) of a Premium's moving masses in the world, of all together above its shoulder: a, c, be and
/// df of the paper (Cavusoglu, Feygin, Tendick), each at its place.
fn height_m(base_in_world: &Isometry3<f64>, [turret, upper_arm, forearm]: [f64; 3]) -> f64 {
    let ahead = Vector3::new(turret.sin(), 0.0, turret.cos());
    let out = ahead * upper_arm.cos() + Vector3::y() * upper_arm.sin();
    let down = ahead * forearm.sin() - Vector3::y() * forearm.cos();
    let bodies = [
        (0.0202, out * 0.215 + down * 0.085),
        (0.0249, out * 0.1075 + down * 0.0325),
        (0.2359, out * -0.0368),
        (0.1906, down * -0.0527),
    ];
    let mass: f64 = bodies.iter().map(|(mass, _)| mass).sum();
    bodies.iter().map(|(share, place)| share / mass * (base_in_world.rotation * place).y).sum()
}

fn joints(frame: &Frame, device: usize) -> [f64; 3] {
    let angles = &frame.devices[device].joint_angle_rad;
    [angles[0], angles[1], angles[2]]
}

#[test]
fn the_drivers_devices_stand_as_the_right_hands_layout_says_in_its_order() {
    let config_of_driver = three_phantoms();
    let names: Vec<&str> = config_of_driver.devices.iter().map(|device| device.name.as_str()).collect();
    assert_eq!(names, ["thumb", "index", "middle"]);
    let layout = Layout::load(config("layouts/three-phantoms-right.toml")).expect("in order");
    for (device, base) in bases(&config_of_driver).iter().enumerate() {
        let told = layout.placement(device).rigid().expect("rigid");
        assert_eq!(base.translation, told.translation, "{}", names[device]);
        // The same digits, brought to length 1 by two libraries' callers.
        assert!(base.rotation.angle_to(&told.rotation) < 1e-15, "{}", names[device]);
    }
}

#[test]
fn for_two_seconds_every_tip_rests_where_its_hand_is_and_no_force_is_felt() {
    let config = three_phantoms();
    let starts: [Vector3<f64>; 3] = [0, 1, 2].map(|device| {
        let wish = config.devices[device].backend.wish().expect("simulated");
        wish.base_in_world.inverse_transform_point(&wish.start_m.into()).coords
    });
    let (mut farthest_m, mut active) = ([0.0_f64; 3], 0);
    run(&config, 2000, |frame| {
        active += u64::from(frame.state == DriverState::Active as u64);
        for device in 0..3 {
            farthest_m[device] = farthest_m[device].max((tip(frame, device) - starts[device]).norm());
            let state = &frame.devices[device];
            assert_eq!(state.force_on_user_n_commanded, [0.0; 3]);
            // Half a step of each converter: 0.2 mN m over levers of 0.05 to 0.3 m.
            let applied = Vector3::from(state.force_on_user_n_applied).norm();
            assert!(applied < 8e-3, "device {device}, tick {}: {applied} N", frame.tick);
        }
    });
    assert!(active > 1700, "active for {active} ticks");
    assert!(farthest_m.iter().all(|moved| *moved < 3e-3), "{farthest_m:?} m");
}

#[test]
fn a_leaning_arm_that_nobody_holds_is_held_by_its_motors() {
    let mut first = [None; 3];
    let mut farthest_m = [0.0_f64; 3];
    run(&let_go(true), 1000, |frame| {
        for device in 0..3 {
            let start = first[device].get_or_insert(tip(frame, device));
            farthest_m[device] = farthest_m[device].max((tip(frame, device) - *start).norm());
        }
    });
    // What it falls in the tick or two before authority: 50 rad/s^2 on 0.2 m make 0.02 mm, and a count or two.
    assert!(farthest_m.iter().all(|moved| *moved < 0.2e-3), "{farthest_m:?} m");
}

/// What the masses' height asks of each joint (N m): its slope by central differences, times weight.
fn weight_nm(base_in_world: &Isometry3<f64>, joints: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|joint| {
        let moved = |by: f64| std::array::from_fn(|j| joints[j] + if j == joint { by } else { 0.0 });
        let slope = height_m(base_in_world, moved(1e-5)) - height_m(base_in_world, moved(-1e-5));
        9.80665 * (0.0202 + 0.0249 + 0.2359 + 0.1906) * slope / 2e-5
    })
}

#[test]
fn an_arm_that_nothing_holds_falls_towards_the_worlds_down_however_it_stands() {
    let config = let_go(false);
    let bases = bases(&config);
    let mut joints_of: Vec<[[f64; 3]; 3]> = Vec::new();
    run(&config, 150, |frame| joints_of.push([0, 1, 2].map(|device| joints(frame, device))));
    let mut falling = [[false; 3]; 3];
    for device in 0..3 {
        let (began, ended) = (joints_of[0][device], joints_of[149][device]);
        let weight_nm = weight_nm(&bases[device], began);
        for joint in 0..3 {
            let (weight_nm, turned) = (weight_nm[joint], ended[joint] - began[joint]);
            falling[device][joint] = weight_nm.abs() > FRICTION_NM[joint];
            let what = format!("device {device}, joint {joint}: {turned} rad under {weight_nm} N m");
            if falling[device][joint] {
                // At the least 0.7 mN m above friction on 2.6 g m^2 for 150 ms: 3 mrad.
                assert!(-turned * weight_nm.signum() > 3e-3, "{what}");
            } else {
                // A count is 0.14 mrad; what sticks may be dragged by what falls.
                assert!(turned.abs() < 0.5e-3, "{what}");
            }
        }
        let fallen_m = height_m(&bases[device], began) - height_m(&bases[device], ended);
        assert!(fallen_m > 0.0, "device {device}: its masses fell by {fallen_m} m");
    }
    // Upright its upper arm; leaning all three; on its side the turret alone, which carries nothing upright.
    assert_eq!(falling, [[false, true, false], [true, true, true], [true, false, false]]);
}

/// Of the joints (N m), config/driver/devices/premium-1.5.toml.
const FRICTION_NM: [f64; 3] = [0.0086, 0.0086, 0.0068];
