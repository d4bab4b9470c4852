//! Whatever arm a description tells of goes the whole way: counters, tip, force, weight, codes; played back
//! from a trace and on an emulated card.

use io_driver::config::DriverConfig;
use io_driver::device::{Device, Effort, TickTime};
use io_driver::device_file::{ArmFile, BUILTIN_NAMES, DeviceFile, Workspace, builtin};
use io_driver::emulator::card::Card;
use io_driver::emulator::motion::Motion;
use io_driver::emulator::process::{Emulator, Play, tally_of};
use io_driver::kinematics::Mechanism;
use io_driver::open::open_devices;
use nalgebra::{UnitQuaternion, Vector3};
use rt_core::clock::monotonic_ns;
use std::path::Path;

/// Names and descriptions of all arms that come with the program.
fn arms() -> Vec<(&'static str, ArmFile)> {
    let described = BUILTIN_NAMES.into_iter().map(|name| {
        let text = builtin(name).expect("it is built in");
        (name, DeviceFile::parse(text, Path::new(name)).expect("it is good"))
    });
    let arms = described.filter_map(|(name, file)| match file {
        DeviceFile::Arm(arm) => Some((name, *arm)),
        DeviceFile::Ideal(_) => None,
    });
    arms.collect()
}

/// The only device of a configuration with this `[[device]]`.
fn open(device: &str) -> Box<dyn Device> {
    let config = DriverConfig::parse(&format!("[[device]]\n{device}"), Path::new("driver.toml")).unwrap();
    open_devices(&config).unwrap().remove(0)
}

fn time(tick: u64) -> TickTime {
    TickTime::counted(tick, 1_000_000, -1)
}

/// A device whose counters stay at home for a tick and then are these.
fn replayed(directory: &Path, name: &str, counts: [i64; 3]) -> Box<dyn Device> {
    let trace = directory.join(format!("{name}.csv"));
    let [c0, c1, c2] = counts;
    std::fs::write(&trace, format!("t,c0,c1,c2\n0,0,0,0\n0.001,{c0},{c1},{c2}\n")).unwrap();
    open(&format!(
        "backend = \"replay\"\ndescription = \"{name}\"\ntrace = {trace:?}\ngravity_compensation = true\n"
    ))
}

#[test]
fn there_are_arms_of_both_kinds() {
    let kinds: Vec<&str> = arms().iter().map(|(_, arm)| arm.kind).collect();
    assert_eq!(kinds, ["premium", "wooden-haptics"]);
    // As long as shared memory has room for.
    assert!(kinds.iter().all(|kind| kind.len() <= 16), "{kinds:?}");
}

#[test]
fn counters_become_the_tip_and_a_force_the_codes_that_make_it_while_the_weight_is_held() {
    let directory = tempfile::tempdir().unwrap();
    for (name, arm) in arms() {
        let home = arm.encoders.home_joint_angles_rad;
        let joints = [home[0] + 0.2, home[1] + 0.15, home[2] - 0.1];
        let counts = {
            let map = arm.joint_map();
            map.angles_to_counts(joints)
        };
        let mut device = replayed(directory.path(), name, counts);
        device.read(time(0)).unwrap();
        let reading = (1..=3).map(|tick| device.read(time(tick)).unwrap()).last().unwrap();
        // Each angle to half a count; together at most the reach, half a metre, times that of the coarsest.
        let half_counts = 0.5 * arm.joint_map().rad_per_count().iter().sum::<f64>();
        let off = reading.position_m - arm.mechanism.forward(joints);
        assert!(off.norm() < 0.5 * half_counts, "{name}: {off}");

        let wanted = Vector3::new(0.8, -0.6, 0.5);
        let written = device.write(Effort { force_on_user_n: wanted, gravity_share: 1.0 }).unwrap();
        let at: [f64; 3] = std::array::from_fn(|j| reading.joint_angle_rad[j]);
        let codes = written.motor_codes.map(|code| code as u16);
        let made = arm.motor_map().joint_torque(codes);
        let (push, hold) = (arm.mechanism.joint_torque(at, wanted), arm.gravity.unwrap().holding_torque(at));
        let steps = arm.motor_map().torque_per_step();
        for j in 0..3 {
            // Half a step of the converter, and rounding.
            assert!((made[j] - push[j] - hold[j]).abs() < 0.501 * steps[j], "{name}, joint {j}");
        }
        assert!(hold[1].abs() > 0.01, "{name}: the weight can be felt there: {hold:?}");
        // Half a step on each joint over its lever, of which none is below 50 mm here.
        let tolerance = 0.5 * Vector3::from(steps).norm() / arm.mechanism.singularity(at).smallest;
        assert!((written.force_on_user_n - wanted).norm() < tolerance, "{name}: {written:?}");
    }
}

/// Through registers, converters and amplifiers and back through counters: a wrong sign anywhere shows.
#[test]
fn on_an_emulated_card_the_tip_yields_to_the_side_that_it_is_pushed_to() {
    let directory = tempfile::tempdir().unwrap();
    for (name, arm) in arms() {
        for axis in 0..3 {
            let path = directory.path().join(format!("{name}-{axis}"));
            let card = Card::create(&path).unwrap();
            let home = arm.encoders.home_joint_angles_rad;
            let motion = Motion::Yielding { viscosity_nm_s: 0.1, joints: home };
            let play =
                Play { peak_n: 2.0, step_n: 2.0, watchdog_ns: u64::MAX, poll_ns: 1, counter_offset: 0 };
            let mut emulator = Emulator::new(card, arm.clone(), motion, play);
            let mut device = open(&format!(
                "backend = \"emulated\"\nzeroing = \"at-start\"\ndescription = \"{name}\"\ncard = {path:?}\n"
            ));

            let began_ns = monotonic_ns();
            let push = Vector3::from_fn(|i, _| if i == axis { 1.0 } else { 0.0 });
            let mut tip = Vector3::zeros();
            for tick in 0..20 {
                emulator.turn(began_ns + tick * 1_000_000);
                tip = device.read(time(tick)).unwrap().position_m;
                device.write(Effort { force_on_user_n: push, gravity_share: 1.0 }).unwrap();
            }
            let moved = tip - arm.mechanism.forward(home);
            // 1 N over some 0.2 m turns a joint at 2 rad/s, the tip at 0.4 m/s, for 18 ms: 7 mm.
            assert!((0.003..0.015).contains(&moved[axis]), "{name} along {axis}: {moved}");
            // At home each axis is a joint's own, but for the swing of its arc: moved^2 / (2 * 0.17 m).
            assert!((moved - push * moved[axis]).norm() < 0.5e-3, "{name} along {axis}: {moved}");
            let tally = tally_of(card);
            assert_eq!((tally.wrong(), tally.lost), (0, 0), "{name}: {tally:?}");
        }
    }
}

/// Compensation for a base that stands otherwise than told makes up for a weight that is not there, on top of the real one.
#[test]
fn weight_and_mistake_together_are_as_much_as_the_safety_page_says() {
    let arms: Vec<_> = arms().into_iter().filter_map(|(name, arm)| Some((name, arm.gravity?, arm))).collect();
    let most = |name: &str| -> (f64, f64) {
        let (_, gravity, arm) =
            arms.iter().find(|(other, ..)| *other == name).expect("its bodies are described");
        // Up may be anywhere: along the axes of the base, and between them.
        let ups = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [1, 0, 1], [0, 1, 1], [1, 1, 1]].map(|up| {
            let up = Vector3::from(up.map(f64::from));
            UnitQuaternion::rotation_between(&Vector3::y(), &up).expect("no half turn")
        });
        let steps = || (0..=8).map(|step| f64::from(step) / 8.0 - 0.5);
        let Workspace { size_m, centre_m } = arm.workspace;
        let places = steps().flat_map(|x| steps().flat_map(move |y| steps().map(move |z| [x, y, z])));
        let places = places.map(|at| Vector3::from_fn(|axis, _| centre_m[axis] + size_m[axis] * at[axis]));
        let (mut torque_nm, mut force_n) = (0.0_f64, 0.0_f64);
        for joints in places.filter_map(|place| arm.mechanism.inverse(place).ok()) {
            for up in &ups {
                let held = Vector3::from(gravity.in_base(up).holding_torque(joints));
                torque_nm = torque_nm.max(held.amax());
                let at_the_tip = arm.mechanism.jacobian(joints).transpose().try_inverse();
                force_n = force_n.max(at_the_tip.map_or(0.0, |inverse| (inverse * held).norm()));
            }
        }
        println!("{name}: {:.3} N m, {:.2} N", 2.0 * torque_nm, 2.0 * force_n);
        (2.0 * torque_nm, 2.0 * force_n)
    };
    for (name, torque_nm, force_n) in [("premium-1.5", 0.175, 4.1), ("wooden-haptics", 0.62, 4.5)] {
        let (found_nm, found_n) = most(name);
        assert!((0.95 * torque_nm..torque_nm).contains(&found_nm), "{name}: {found_nm} N m");
        assert!((0.95 * force_n..force_n).contains(&found_n), "{name}: {found_n} N");
    }
}
