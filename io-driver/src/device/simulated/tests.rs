use super::*;
use crate::device_file::{ArmFile, DeviceFile, builtin};
use crate::kinematics::Mechanism;
use crate::live_hand::{LiveFinger, LiveHand, LiveWish};
use crate::sim::hand::HandModel;
use crate::sim::hand::model_file::{self, Firmness};
use crate::sim::script::HandScript;
use nalgebra::Translation3;
use std::path::Path;

const LATE_NS: u64 = 400_000;
const TICK_S: f64 = 1e-3;

fn file() -> ArmFile {
    match DeviceFile::parse(builtin("premium-1.5").unwrap(), Path::new("premium-1.5")) {
        Ok(DeviceFile::Arm(arm)) => *arm,
        other => panic!("{other:?}"),
    }
}

fn pen() -> HandModel {
    let text = model_file::builtin("pen-grip").unwrap();
    let mut model = model_file::parse(text, Path::new("pen-grip"), Firmness::Usual).unwrap();
    model.tremor.rms_m = Vector3::zeros();
    model
}

fn device(file: &ArmFile, at_D: Vector3<f64>, base: Isometry3<f64>, holder: Holder) -> SimulatedDevice {
    let info = DeviceInfo {
        name: "f0".into(),
        kind: file.kind.into(),
        peak_force_n: 8.0,
        continuous_force_n: 8.0,
        workspace_min_m: [f64::NEG_INFINITY; 3],
        workspace_max_m: [f64::INFINITY; 3],
        slew_n_per_s: f64::INFINITY,
        speed_limit_m_per_s: f64::INFINITY,
    };
    let plant = SimulatedArm::new(file, file.mechanism.inverse(at_D).unwrap(), 1).unwrap();
    let arm = Arm::new(file, false).with_zeroing(crate::config::Zeroing::Known);
    SimulatedDevice::new(info, arm, plant, holder, base, Latency::Nominal(LATE_NS))
}

fn free(file: &ArmFile) -> SimulatedDevice {
    device(file, Vector3::zeros(), Isometry3::identity(), Holder::Nobody)
}

fn held(model: &HandModel, at_D: Vector3<f64>, wish: Wish, board: &Arc<TipBoard>) -> Holder {
    let hand = ImpedanceHand::new(model, at_D, 1);
    Holder::Hand(Box::new(HeldBy { hand, wish, board: Arc::clone(board), place: 0 }))
}

fn tick(tick: u64) -> TickTime {
    TickTime::counted(tick, 1_000_000, -1)
}

fn push(force: Vector3<f64>) -> Effort {
    Effort { force_on_user_n: force, gravity_share: 1.0 }
}

#[test]
fn the_first_reading_finds_the_arm_where_it_begins_and_no_time_has_passed() {
    let mut device = free(&file());
    let before = device.truth();
    let reading = device.read(tick(77)).unwrap();
    assert_eq!(device.truth(), before);
    assert_eq!((reading.is_valid, reading.position_m), (true, Vector3::zeros()));
}

#[test]
fn values_take_effect_as_long_after_the_reading_as_the_latency_says() {
    let file = file();
    let (mut device, mut plant) = (free(&file), free(&file).plant);
    device.read(tick(1)).unwrap();
    let written = device.write(push(Vector3::new(0.0, 1.0, 0.5))).unwrap();
    device.read(tick(2)).unwrap();
    plant.advance(LATE_NS as f64 / 1e9, &mut NobodyHolds);
    plant.command(written.motor_codes.map(|code| code as u16));
    plant.advance(TICK_S - LATE_NS as f64 / 1e9, &mut NobodyHolds);
    // Two sums of the same nanoseconds, one rounding apart.
    assert!((device.truth().tip - plant.truth().tip).norm() < 1e-15);
    assert!(device.truth().current_a[1].abs() > 0.1, "and they do take effect");
}

#[test]
fn a_stall_of_the_driver_is_a_standstill_of_the_world() {
    let after = |next| {
        let mut device = free(&file());
        device.read(tick(1)).unwrap();
        device.write(push(Vector3::y())).unwrap();
        device.read(tick(next)).unwrap();
        device.truth()
    };
    assert_eq!(after(6), after(5001), "no more than five milliseconds");
    assert_ne!(after(5), after(6));
}

#[test]
fn whatever_was_written_a_release_in_the_same_tick_switches_off() {
    for release_first in [false, true] {
        let mut device = free(&file());
        device.read(tick(1)).unwrap();
        if release_first {
            device.release();
            // What a fault leaves of the force.
            device.write(Effort::default()).unwrap();
        } else {
            device.write(push(Vector3::y())).unwrap();
            device.release();
        }
        device.read(tick(2)).unwrap();
        assert_eq!(device.truth().current_a, [0.0; 3], "release first: {release_first}");
    }
}

#[test]
fn amplifiers_that_tripped_are_a_fault_in_each_tick_until_they_are_armed_and_give_nothing_before_the_next_value()
 {
    let mut file = file();
    file.simulation.as_mut().unwrap().motor.watchdog_s = 3e-3;
    let mut device = free(&file);
    device.read(tick(1)).unwrap();
    device.write(push(Vector3::y())).unwrap();
    for late in [6, 7] {
        assert_eq!(device.read(tick(late)), Err(FaultReason::AmplifierTripped));
        device.release();
    }
    device.rearm();
    for well in 8..20 {
        assert!(device.read(tick(well)).unwrap().is_valid, "it kept its place");
        device.write(Effort::default()).unwrap();
    }
    // Twelve milliseconds are a hundred of the winding's time constants.
    assert!(device.truth().current_a.iter().all(|current| current.abs() < 1e-3));
    device.write(push(Vector3::y())).unwrap();
    device.read(tick(20)).unwrap();
    assert!(device.truth().current_a[1].abs() > 0.1);
}

#[test]
fn a_hand_that_rests_somewhere_in_the_world_holds_the_tip_there_however_the_base_stands() {
    let at_D = Vector3::new(0.02, 0.03, -0.04);
    let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * 2.0);
    let base = Isometry3::from_parts(Translation3::new(0.4, -0.2, 0.3), turn);
    let at_W = (base * Point3::from(at_D)).coords;
    let board = Arc::new(TipBoard::default());
    let mut device = device(&file(), at_D, base, held(&pen(), at_D, Wish::Resting(at_W), &board));
    let mut reading = device.read(tick(1)).unwrap();
    for n in 2..2000 {
        device.write(Effort::default()).unwrap();
        reading = device.read(tick(n)).unwrap();
    }
    // Some tenths of a newton of weight on 65 N/m.
    assert!((reading.position_m - at_D).norm() < 0.01, "{}", reading.position_m);
    let told = board.others(1).unwrap();
    assert!(
        (told - (base * Point3::from(device.truth().tip)).coords).norm() < 1e-15,
        "its partners know, in W"
    );
}

#[test]
fn a_handle_that_the_script_turns_in_the_world_is_measured_in_the_base() {
    let gimbal = "[gimbal]\ncounts_per_rev = 4000\nreduction = [10.0, 10.0, 10.0]\nsign = [1, 1, 1]\n\
                  channel = [3, 4, 5]\nhome_angles_rad = [0.0, 0.0, 0.0]\n";
    let text = format!("{}\n{gimbal}", builtin("premium-1.5").unwrap());
    let Ok(DeviceFile::Arm(file)) = DeviceFile::parse(&text, Path::new("handle.toml")) else { panic!() };
    let script = "t,f0_x,f0_y,f0_z,f0_qw,f0_qx,f0_qy,f0_qz\n0,0,0,0,0.8,0,0.6,0\n";
    let script = HandScript::parse(script, Path::new("hand.csv"), &["f0"]).unwrap();
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, 0.5, -0.2));
    let base = Isometry3::from_parts(Translation3::identity(), turn);
    let wish = Wish::Scripted(HandPlayer::new(script), 0);
    let holder = held(&pen(), Vector3::zeros(), wish, &Arc::new(TipBoard::default()));
    let reading = device(&file, Vector3::zeros(), base, holder).read(tick(1)).unwrap();
    let [w, x, y, z] = reading.orientation_wxyz;
    let measured = UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z));
    let scripted = UnitQuaternion::new_normalize(nalgebra::Quaternion::new(0.8, 0.0, 0.6, 0.0));
    // Half a count of 0.16 mrad in each of three axes.
    assert!((turn * measured).angle_to(&scripted) < 3e-4, "{measured}");
}

#[test]
fn when_the_scripts_time_jumps_back_the_hand_goes_back_no_faster_than_a_hand() {
    let script = "t,f0_x,f0_y,f0_z\n0,0,0,0\n0.3,0.1,0.05,0\n";
    let script = HandScript::parse(script, Path::new("hand.csv"), &["f0"]).unwrap();
    let wish = Wish::Scripted(HandPlayer::new(script), 0);
    let board = Arc::new(TipBoard::default());
    let holder = held(&pen(), Vector3::zeros(), wish, &board);
    let mut device = device(&file(), Vector3::zeros(), Isometry3::identity(), holder);
    let mut farthest = 0.0_f64;
    for n in 0..3000_i64 {
        let run_tick = if n < 800 { n } else { -1 };
        let reading = device.read(TickTime { run_tick, ..tick(1 + n as u64) }).unwrap();
        device.write(Effort::default()).unwrap();
        farthest = farthest.max(reading.position_m.x);
        // The hand's own limit is 1 m/s; its mass swings over that.
        assert!(device.truth().tip_velocity.norm() < 1.5, "tick {n}");
    }
    assert!(farthest > 0.08 && device.truth().tip.x.abs() < 0.02, "there {farthest} and back");
}

#[test]
fn a_hand_that_minds_feels_the_force_on_itself_and_presses_towards_its_partner() {
    let tip_after = |minds_slip| {
        let board = Arc::new(TipBoard::default());
        board.tell(1, Vector3::new(0.05, 0.0, 0.0));
        let model = HandModel { minds_slip, ..pen() };
        let holder = held(&model, Vector3::zeros(), Wish::Resting(Vector3::zeros()), &board);
        let mut device = device(&file(), Vector3::zeros(), Isometry3::identity(), holder);
        for n in 1..1500 {
            device.read(tick(n)).unwrap();
            // What is squeezed between the two pushes the finger back, and pulls it down by its weight.
            device.write(push(Vector3::new(-0.8, -0.6, 0.0))).unwrap();
        }
        device.truth().tip
    };
    let more = tip_after(true) - tip_after(false);
    assert!(more.x > 2e-3, "{more}");
}

#[test]
fn a_live_hand_that_jumps_moves_the_arm_no_faster_than_a_person_and_stays_when_nobody_moves_it_any_more() {
    let (file, directory) = (file(), tempfile::tempdir().unwrap());
    let path = directory.path().join("hand");
    let mut live = LiveHand::create(&path).unwrap();
    let finger = LiveFinger::open(&path, 2, LiveWish::at(Vector3::zeros())).unwrap();
    let holder = held(&pen(), Vector3::zeros(), Wish::Live(finger), &Arc::default());
    let mut device = device(&file, Vector3::zeros(), Isometry3::identity(), holder);
    let go_to = Vector3::new(0.03, 0.04, 0.0);
    let (mut fastest, mut buttons) = (0.0f64, 0);
    for number in 1..3000 {
        if number == 10 {
            live.want(2, &LiveWish { buttons: 5, ..LiveWish::at(go_to) });
        }
        buttons = device.read(tick(number)).unwrap().buttons;
        // The motors carry the arm's weight, and nothing else.
        device.write(push(Vector3::zeros())).unwrap();
        fastest = fastest.max(device.truth().tip_velocity.norm());
        assert!(number > 9 || device.truth().tip.norm() < 1e-4, "{number}: {}", device.truth().tip);
    }
    // A hand's fastest is 1 m/s; its springs may swing over that.
    assert!((0.1..1.5).contains(&fastest), "{fastest}");
    // The weight, which this arm's motors do not carry, moves a soft hand by some millimetres.
    let arrived = device.truth().tip;
    assert!((arrived - go_to).norm() < 5e-3, "{arrived}");
    assert_eq!(buttons, 5);
    drop(live);
    let velocity = device.truth().tip_velocity;
    for number in 3000..4000 {
        device.read(tick(number)).unwrap();
        device.write(push(Vector3::zeros())).unwrap();
    }
    // What was left of the swinging.
    assert!((device.truth().tip - arrived).norm() < 1e-4 + velocity.norm(), "{}", device.truth().tip);
}
