//! An arm whose motors, once warm, cannot hold its weight: the weight is cut first, and no force comes of that, nor any
//! growth beyond the slew rate.

use io_driver::device::Effort;
use io_driver::device_file::{ArmFile, DeviceFile, builtin};
use io_driver::drive::Drive;
use io_driver::kinematics::Mechanism;
use io_driver::safety::workspace::Edge;
use io_driver::safety::{Elapsed, Guard, Limits};
use nalgebra::Vector3;
use shm_abi::frame::LIMIT_HEAT;
use std::path::Path;

const PERIOD_NS: u64 = 1_000_000;
/// Force of the converters' steps over the arm's levers (N).
const CODES_N: f64 = 0.05;

/// A WoodenHaptics whose motors stand half as much for ever as its weight asks of them.
const HEAVY: [(&str, &str); 3] = [
    ("continuous_current_a = 3.0 ", "continuous_current_a = 0.6 "),
    ("mass_a_kg = 0.0817", "mass_a_kg = 0.15"),
    ("mass_be_kg = 0.170", "mass_be_kg = 0.40"),
];

fn wooden_haptics(changes: &[(&str, &str)]) -> ArmFile {
    let mut text = builtin("wooden-haptics").expect("it is built in").to_owned();
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    match DeviceFile::parse(&text, Path::new("wooden-haptics.toml")) {
        Ok(DeviceFile::Arm(arm_file)) => *arm_file,
        other => panic!("{other:?}"),
    }
}

/// Numbers of no order between -0.5 and 0.5.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }
}

/// Motion of an arm, and the force that is asked of it.
#[derive(Debug)]
struct Trial {
    /// Of the joints, at random (rad/s).
    speed: f64,
    slew_n_per_s: f64,
    /// Ticks for which a force is asked.
    hold: u64,
    seed: u64,
}

/// From a force to the nearest one of those to which the last may be shortened.
fn beyond_shortened(last: Vector3<f64>, force: Vector3<f64>) -> f64 {
    let squared = last.norm_squared();
    let share = if squared > 0.0 { (force.dot(&last) / squared).clamp(0.0, 1.0) } else { 0.0 };
    (force - last * share).norm()
}

impl Trial {
    /// Two minutes of forces up to a bit beyond the peak; checks every step, and returns in how many ticks the weight or
    /// the force was cut for warmth.
    fn play(&self, file: &ArmFile) -> u64 {
        let gravity = file.gravity.expect("it has bodies");
        let everywhere = Vector3::repeat(9.0);
        let edge = Edge { min_m: -everywhere, max_m: everywhere, margin_m: 0.02 };
        let mut guard = Guard::new(Limits {
            peak_n: file.peak_force_n,
            slew_n_per_s: self.slew_n_per_s,
            speed_m_per_s: f64::INFINITY,
            edge,
        });
        let mut drive = Drive::new(file.mechanism, &file.motors, file.heat, Some(gravity));
        let mut numbers = Numbers(self.seed);
        let home = file.encoders.home_joint_angles_rad;
        let (mut joints, mut rate, mut wanted) = (home, [0.0; 3], Vector3::zeros());
        let (mut last, mut warm) = (Vector3::zeros(), 0);
        let step = self.slew_n_per_s * PERIOD_NS as f64 / 1e9;
        for tick in 0..120_000 {
            drive.pass(1e-3);
            if tick % self.hold == 0 {
                let direction = Vector3::from_fn(|_, _| numbers.next()).normalize();
                wanted = direction * ((numbers.next() + 0.5) * 1.2 * file.peak_force_n);
            }
            if tick % 200 == 0 {
                rate = [0, 1, 2].map(|j| self.speed * numbers.next() - 0.5 * (joints[j] - home[j]));
            }
            joints = [0, 1, 2].map(|j| joints[j] + 1e-3 * rate[j]);
            let effort = |force_on_user_n| Effort { force_on_user_n, gravity_share: 1.0 };
            let elapsed = Elapsed::new(PERIOD_NS, PERIOD_NS);
            let asked = guard.restrain(wanted, 1.0, elapsed, |force| drive.attainable(joints, effort(force)));
            let (_, written) = drive.render(joints, effort(asked.force_on_user_n)).expect("finite");
            warm += u64::from((asked.limits | written.limits) & LIMIT_HEAT != 0);
            let told = written.force_on_user_n;
            // Where a force can be told from the codes at all.
            if file.mechanism.singularity(joints).inverse_condition() > 0.05 {
                let beyond = ((told - last).norm() - step).min(beyond_shortened(last, told));
                assert!(beyond <= CODES_N, "{self:?}, tick {tick}: {last} to {told}, {beyond} N too much");
            }
            last = told;
        }
        warm
    }
}

#[test]
fn no_force_grows_faster_than_the_slew_rate_where_warm_motors_cannot_hold_the_weight() {
    let arm = wooden_haptics(&HEAVY);
    for (speed, slew_n_per_s, hold) in [(0.0, 1000.0, 50), (1.0, 1000.0, 50), (3.0, 5000.0, 20)] {
        for seed in [1, 2] {
            let warm = Trial { speed, slew_n_per_s, hold, seed }.play(&arm);
            // Else it would show nothing.
            assert!(warm > 10_000, "{warm} ticks");
        }
    }
}

/// A pose in which its weight asks most of a joint, away from those in which forces cannot be told.
fn heaviest_pose(arm: &ArmFile) -> [f64; 3] {
    let gravity = arm.gravity.expect("it has bodies");
    let limits = arm.mechanism.joint_limits();
    let angles = || (-30..=30).map(|step| 0.1 * f64::from(step));
    let poses = angles().flat_map(|upper| angles().map(move |forearm| [0.0, upper, forearm]));
    let is_usual = |joints: &[f64; 3]| {
        limits.contains(*joints) && arm.mechanism.singularity(*joints).inverse_condition() > 0.2
    };
    let weight =
        |joints: &[f64; 3]| gravity.holding_torque(*joints).into_iter().map(f64::abs).fold(0.0, f64::max);
    poses.filter(is_usual).max_by(|a, b| weight(a).total_cmp(&weight(b))).expect("it has poses")
}

/// The arm sags by its own weight; it is not pushed.
#[test]
fn with_no_force_asked_none_is_given_however_little_of_the_weight_is_held() {
    let arm = wooden_haptics(&HEAVY);
    let joints = heaviest_pose(&arm);
    let mut drive = Drive::new(arm.mechanism, &arm.motors, arm.heat, arm.gravity);
    let effort = |force_on_user_n| Effort { force_on_user_n, gravity_share: 1.0 };
    let mut cut = 0;
    for round in 0..60 {
        // Ten seconds of the peak force along an axis and back make the motors warm.
        let mut push = Vector3::zeros();
        push[round % 3] = if round % 2 == 0 { arm.peak_force_n } else { -arm.peak_force_n };
        for _ in 0..10 {
            let force = drive.attainable(joints, effort(push)).force_on_user_n;
            drive.render(joints, effort(force)).expect("finite");
            drive.pass(1.0);
        }
        let none = effort(Vector3::zeros());
        assert_eq!(drive.attainable(joints, none).force_on_user_n, Vector3::zeros());
        let (_, written) = drive.render(joints, none).expect("finite");
        assert!(written.force_on_user_n.norm() <= CODES_N, "{written:?}");
        cut += u32::from(written.limits & LIMIT_HEAT != 0);
    }
    assert!(cut > 10, "{cut} rounds: the motors hold all of the weight");
}
