use super::*;
use crate::device_file::{DeviceFile, builtin};
use crate::sim::spec::NoiseSpec;
use std::path::Path;

fn file(name: &str) -> ArmFile {
    match DeviceFile::parse(builtin(name).unwrap(), Path::new(name)) {
        Ok(DeviceFile::Arm(arm)) => *arm,
        other => panic!("{other:?}"),
    }
}

fn changed(name: &str, change: impl FnOnce(&mut SimulationSpec)) -> ArmFile {
    let mut file = file(name);
    change(file.simulation.as_mut().unwrap());
    file
}

/// Without friction, so that only what is tested acts.
fn smooth(name: &str) -> ArmFile {
    changed(name, |spec| {
        spec.coulomb_nm = [0.0; 3];
        spec.viscous_nm_s = [0.0; 3];
    })
}

fn arm(file: &ArmFile, joints: [f64; 3]) -> SimulatedArm {
    SimulatedArm::new(file, joints, 1).expect("the description says how it moves")
}

fn thrown(file: &ArmFile, joints: [f64; 3], rates: [f64; 3]) -> SimulatedArm {
    let mut arm = arm(file, joints);
    arm.shafts.rates = rates.into();
    arm.links = arm.see(arm.shafts);
    arm
}

fn energy(arm: &SimulatedArm) -> f64 {
    let (joints, rates) = (arm.links.motion.angles.into(), arm.links.motion.rates);
    let rotors = 0.5 * arm.shafts.rates.dot(&arm.rotors.component_mul(&arm.shafts.rates));
    let dynamics = &arm.spec.dynamics;
    dynamics.kinetic_energy(joints, rates.into()) + dynamics.potential_energy(joints) + rotors
}

/// Pushes the tip with a force that stays what it is.
struct Push(Vector3<f64>);

impl TipLoad for Push {
    fn force_on_tip(&self, _: Vector3<f64>, _: Vector3<f64>) -> Vector3<f64> {
        self.0
    }

    fn advance(&mut self, _: Vector3<f64>, _: Vector3<f64>, _: f64) {}
}

const INSIDE: [[f64; 3]; 3] = [[0.0, 0.2, 0.4], [0.4, 0.5, 0.9], [-0.5, 0.1, -0.1]];

#[test]
fn an_arm_that_is_thrown_keeps_its_energy() {
    for name in ["premium-1.5", "wooden-haptics"] {
        let file = smooth(name);
        let home = file.encoders.home_joint_angles_rad;
        let mut arm = thrown(&file, home, [1.5, 0.8, -0.6]);
        // Of the motion, against which the error counts; the weight's zero is anywhere.
        let motion = 0.5 * arm.shafts.rates.dot(&(arm.inertia(&arm.links) * arm.shafts.rates));
        let before = energy(&arm);
        // A tenth of a second at up to 1.5 rad/s stays within the stops.
        for _ in 0..100 {
            arm.advance(1e-3, &mut NobodyHolds);
            assert_eq!(file.mechanism.joint_limits().excess(arm.truth().joints), 0.0);
            // The rule errs by some (rate * step)^2 = 1e-8 within a turn, and does not add that up.
            assert!((energy(&arm) - before).abs() < 1e-7 * motion, "{name}");
        }
        assert!(arm.truth().joints != home);
    }
}

/// A spring to where the tip is at home.
struct Spring(f64);

impl TipLoad for Spring {
    fn force_on_tip(&self, tip: Vector3<f64>, _: Vector3<f64>) -> Vector3<f64> {
        tip * -self.0
    }

    fn advance(&mut self, _: Vector3<f64>, _: Vector3<f64>, _: f64) {}
}

#[test]
fn an_arm_that_swings_on_a_stiff_spring_swings_on() {
    let file = smooth("premium-1.5");
    let mut arm = thrown(&file, [0.0; 3], [0.2, 0.3, -0.4]);
    let stiffness = 20e3;
    let of_all = |arm: &SimulatedArm| energy(arm) + 0.5 * stiffness * arm.truth().tip.norm_squared();
    let motion = 0.5 * arm.shafts.rates.dot(&(arm.inertia(&arm.links) * arm.shafts.rates));
    let before = of_all(&arm);
    let mut largest = 0.0_f64;
    for _ in 0..3000 {
        arm.advance(1e-3, &mut Spring(stiffness));
        largest = largest.max((of_all(&arm) - before).abs() / motion);
    }
    // The lightest direction swings at 735 rad/s. A rule that keeps the area keeps an energy which differs from this
    // one by up to (omega dt)^2 / 4 = 5e-4; one that does not loses (omega dt)^4 / 16 in each of 48,000 steps, 1.3 %.
    assert!(largest < 1e-3, "{largest}");
}

#[test]
fn a_tip_that_is_pushed_goes_as_its_apparent_mass_says() {
    let file = smooth("premium-1.5");
    for (axis, grams) in [(Vector3::x(), 81.0), (Vector3::y(), 55.0), (Vector3::z(), 37.0)] {
        let mut arm = arm(&file, [0.0; 3]);
        let weight = arm.spec.dynamics.holding_torque([0.0; 3]);
        let hold =
            arm.kinematics.jacobian([0.0; 3]).transpose().try_inverse().unwrap() * Vector3::from(weight);
        let (force, time_s) = (0.05, 2e-3);
        arm.advance(time_s, &mut Push(hold + axis * force));
        let found = force * time_s / arm.truth().tip_velocity.dot(&axis);
        // The published numbers have two digits.
        assert!((found * 1e3 - grams).abs() < 0.6, "{grams} g: {found}");
    }
}

#[test]
fn a_force_that_the_motors_balance_moves_nothing() {
    for (name, sign) in
        [("premium-1.5", [1; 3]), ("premium-1.5", [-1, 1, -1]), ("wooden-haptics", [1, -1, 1])]
    {
        let mut file = smooth(name);
        file.motors.sign = sign;
        for offset in INSIDE {
            let home = Vector3::from(file.encoders.home_joint_angles_rad);
            let joints: [f64; 3] = (home + 0.5 * Vector3::from(offset)).into();
            let mut arm = arm(&file, joints);
            let force_on_user = Vector3::new(0.4, -0.7, 0.5);
            let holding = Vector3::from(arm.spec.dynamics.holding_torque(joints));
            let torque = Vector3::from(file.mechanism.joint_torque(joints, force_on_user)) + holding;
            arm.command(file.motor_map().command(torque.into()).codes);
            // Until the amplifiers have followed, hold it.
            for motor in &mut arm.motors {
                (0..64).for_each(|_| motor.advance(0.0, 31e-6));
            }
            let tip = arm.truth().tip;
            arm.advance(10e-3, &mut Push(-force_on_user));
            // What half a step of the converters is worth at the tip: 2 mN on the lightest 30 g for 10 ms.
            let step: f64 = file.motor_map().torque_per_step().iter().sum();
            let most = 0.5 * (0.5 * step / 0.17 / 0.02) * 1e-4;
            let moved = (arm.truth().tip - tip).norm();
            assert!(moved < most, "{name}: {moved} of {most}");
        }
    }
}

#[test]
fn an_arm_that_sticks_does_not_creep() {
    for cable in [None, Some(CableSpec { stiffness_nm_per_rad: [150.0; 3], damping_nm_s: [0.05; 3] })] {
        // The arm's own weight is twice its friction.
        let file = changed("premium-1.5", |spec| {
            spec.cable = cable;
            spec.coulomb_nm = [0.025; 3];
        });
        let mut arm = arm(&file, [0.1, 0.05, -0.05]);
        let mut push = Push(Vector3::new(0.015, 0.0, 0.0));
        (0..500).for_each(|_| arm.advance(1e-3, &mut push));
        let rested = (arm.links.motion, arm.shafts.angles);
        (0..20_000).for_each(|_| arm.advance(1e-3, &mut push));
        let crept = (arm.shafts.angles - rested.1).norm();
        // Rounding of angles near 0.1 in 320,000 steps, at worst all one way: 320,000 * 1.4e-17, and as much of rates.
        assert!(crept < 1e-10, "{crept} rad in 20 s, cable {cable:?}");
    }
}

#[test]
fn beyond_its_friction_an_arm_moves_and_by_its_friction_it_comes_to_rest() {
    let file = changed("premium-1.5", |spec| spec.viscous_nm_s = [0.0; 3]);
    let mut arm = thrown(&file, [0.0; 3], [0.8, 0.0, 0.0]);
    let (inertia, friction) = (arm.inertia(&arm.links)[(0, 0)], arm.spec.coulomb_nm[0]);
    let stops_s = 0.8 * inertia / friction;
    let turned = 0.5 * 0.8 * stops_s;
    for _ in 0..(stops_s * 1e3) as u32 + 2 {
        arm.advance(1e-3, &mut NobodyHolds);
    }
    let truth = arm.truth();
    assert_eq!(truth.rates[0], 0.0);
    // The other joints fall meanwhile by less than a tenth of a radian, which changes the turret's inertia; a step's
    // worth of the path.
    assert!((truth.joints[0] - turned).abs() < 0.05 * turned, "{} {turned}", truth.joints[0]);
}

#[test]
fn nobody_pushes_an_arm_through_its_stops() {
    for name in ["premium-1.5", "wooden-haptics"] {
        // What swings along the force where there is no stop comes to rest.
        let file = changed(name, |spec| spec.viscous_nm_s = [0.02; 3]);
        for direction in
            [Vector3::x(), -Vector3::x(), Vector3::y(), -Vector3::y(), Vector3::z(), -Vector3::z()]
        {
            let mut arm = arm(&file, file.encoders.home_joint_angles_rad);
            for _ in 0..3000 {
                arm.advance(1e-3, &mut Push(direction * 10.0));
                let truth = arm.truth();
                assert!(truth.tip.iter().chain(&truth.rates).all(|n| n.is_finite()));
                let excess = file.mechanism.joint_limits().excess(truth.joints);
                // 10 N on 0.4 m against the stops' stiffness, and the swing of an impact: twice that and more.
                assert!(excess < 0.4, "{name} {direction}: {excess} rad");
            }
            assert!(arm.truth().tip_velocity.norm() < 0.05, "{name} {direction}: it rests");
        }
    }
}

#[test]
fn a_cable_that_stretches_swings_where_two_masses_on_a_spring_do() {
    let cable = CableSpec { stiffness_nm_per_rad: [150.0; 3], damping_nm_s: [0.0; 3] };
    let mut file = smooth("premium-1.5");
    file.simulation.as_mut().unwrap().cable = Some(cable);
    let mut arm = arm(&file, [0.0; 3]);
    let (of_link, of_rotor) = (arm.spec.dynamics.mass_matrix([0.0; 3])[(0, 0)], arm.rotors.x);
    let closed_hz = (150.0 * (1.0 / of_link + 1.0 / of_rotor)).sqrt() / std::f64::consts::TAU;
    arm.links = arm.see(Motion { angles: Vector3::x() * 1e-3, rates: Vector3::zeros() });
    let mut crossings = Vec::new();
    let (mut time_s, dt_s) = (0.0, 31.25e-6);
    let mut before = 1.0;
    while crossings.len() < 41 {
        arm.advance(dt_s, &mut NobodyHolds);
        time_s += dt_s;
        let stretch = arm.links.motion.angles.x - arm.shafts.angles.x;
        if stretch.signum() != f64::signum(before) {
            crossings.push(time_s - dt_s * stretch / (stretch - before));
        }
        before = stretch;
    }
    let found_hz = 20.0 / (crossings[40] - crossings[0]);
    // The rule is early by (omega dt)^2 / 24 of a period: 4e-5 at 1000 rad/s.
    assert!((found_hz / closed_hz - 1.0).abs() < 1e-4, "{found_hz} {closed_hz} Hz");
}

#[test]
fn counters_show_the_motor_and_not_the_link() {
    let cable = CableSpec { stiffness_nm_per_rad: [50.0; 3], damping_nm_s: [0.5; 3] };
    let file = changed("premium-1.5", |spec| {
        spec.cable = Some(cable);
        spec.coulomb_nm = [0.025; 3];
    });
    let mut arm = arm(&file, [0.0; 3]);
    arm.switch_off();
    // Friction holds the motor; the link gives way by torque over stiffness.
    let force = 0.02;
    (0..1000).for_each(|_| arm.advance(1e-3, &mut Push(Vector3::x() * force)));
    let stretch = arm.links.motion.angles.x - arm.shafts.angles.x;
    assert!((stretch - force * 0.215 / 50.0).abs() < 1e-3 * stretch, "{stretch}");
    assert_eq!(arm.counters()[0], 0, "86 urad are 0.8 of a count of the link, none of the motor");
}

#[test]
fn amplifiers_that_nobody_serves_switch_themselves_off_until_they_are_armed_anew() {
    let file = file("premium-1.5");
    let mut arm = arm(&file, [0.0; 3]);
    let codes = file.motor_map().command([0.05, 0.0, 0.0]).codes;
    let watchdog_s = arm.spec.motor.watchdog_s;
    let pass = |arm: &mut SimulatedArm, seconds: f64| {
        (0..(seconds * 1e3) as u32).for_each(|_| arm.advance(1e-3, &mut NobodyHolds));
    };
    arm.command(codes);
    pass(&mut arm, 0.9 * watchdog_s);
    assert!(!arm.is_tripped() && arm.truth().current_a[0] > 0.1);
    pass(&mut arm, 0.2 * watchdog_s);
    assert!(arm.is_tripped());
    arm.command(codes);
    pass(&mut arm, 5e-3);
    assert!(arm.truth().current_a[0].abs() < 1e-3, "it stays off");
    arm.rearm();
    arm.command(codes);
    pass(&mut arm, 5e-3);
    assert!(!arm.is_tripped() && arm.truth().current_a[0] > 0.1);
    arm.switch_off();
    pass(&mut arm, 2.0 * watchdog_s);
    assert!(!arm.is_tripped(), "what is off on purpose needs no watchdog");
}

#[test]
fn no_length_of_time_does_harm() {
    let file = file("premium-1.5");
    let mut arm = arm(&file, [0.0; 3]);
    arm.command(file.motor_map().command([0.3, 0.2, 0.1]).codes);
    for dt_s in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e9] {
        arm.advance(dt_s, &mut Push(Vector3::new(3.0, -2.0, 1.0)));
        assert!(arm.truth().tip.iter().all(|c| c.is_finite()), "{dt_s}");
    }
}

#[test]
fn the_same_seed_gives_the_same_arm_and_another_seed_another() {
    let noisy = changed("premium-1.5", |spec| {
        spec.noise = NoiseSpec { encoder_counts_rms: 0.7, current_a_rms: 0.05 };
    });
    let counters = |seed| {
        let mut arm = SimulatedArm::new(&noisy, [0.0; 3], seed).unwrap();
        let codes = noisy.motor_map().command([0.02, 0.05, 0.01]).codes;
        std::array::from_fn::<_, 50, _>(|_| {
            arm.command(codes);
            arm.advance(1e-3, &mut NobodyHolds);
            arm.counters()
        })
    };
    assert_eq!(counters(3), counters(3));
    assert_ne!(counters(3), counters(4));
}

#[test]
fn a_handle_that_is_rolled_round_and_round_keeps_the_gimbals_counters_in_step() {
    let gimbal = "[gimbal]\ncounts_per_rev = 4000\nreduction = [1.0, 1.0, 5.18]\nsign = [1, 1, 1]\n\
                  channel = [3, 4, 5]\nhome_angles_rad = [0.0, 0.0, 0.0]\n";
    let text = format!("{}\n{gimbal}", builtin("premium-1.5").unwrap());
    let Ok(DeviceFile::Arm(file)) = DeviceFile::parse(&text, Path::new("handle.toml")) else { panic!() };
    let mut arm = arm(&file, [0.0; 3]);
    let mut last = 0;
    for degrees in 0..720 {
        let roll = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), f64::from(degrees).to_radians());
        let counter = arm.gimbal_counters(roll).unwrap()[2];
        // As a counter of 16 bits goes on: never by more than the 57.6 counts of a degree.
        let step = (counter - last + 32_768).rem_euclid(65_536) - 32_768;
        assert!(step.abs() <= 58, "{degrees} degrees: {step} counts");
        last = counter;
    }
}

#[test]
fn amplifiers_that_were_never_switched_on_are_not_watched() {
    let file = file("premium-1.5");
    let mut arm = arm(&file, [0.0; 3]);
    (0..300).for_each(|_| arm.advance(1e-3, &mut NobodyHolds));
    assert!(!arm.is_tripped());
    arm.command(file.motor_map().command([0.05, 0.0, 0.0]).codes);
    arm.advance(5e-3, &mut NobodyHolds);
    assert!(arm.truth().current_a[0] > 0.1, "they obey");
}

#[test]
fn a_motor_that_turns_brakes_itself_whichever_way_round_it_is_built_in() {
    // 1 V is all that the amplifiers have; 30 rad/s of the turret make 9.5 V of back-EMF.
    for sign in [1, -1] {
        let mut file = changed("premium-1.5", |spec| spec.motor.supply_v = 1.0);
        file.motors.sign = [sign; 3];
        let mut arm = thrown(&file, [0.0; 3], [30.0, 0.0, 0.0]);
        arm.command(file.motor_map().command([0.0; 3]).codes);
        arm.advance(1e-3, &mut NobodyHolds);
        let truth = arm.truth();
        assert!(f64::from(sign) * truth.current_a[0] < -1.0, "{sign}: {truth:?}");
    }
}

#[test]
fn the_current_s_noise_has_the_spread_that_was_asked_for() {
    let noisy = changed("premium-1.5", |spec| {
        spec.noise = NoiseSpec { encoder_counts_rms: 0.0, current_a_rms: 0.05 };
        spec.coulomb_nm = [1.0; 3];
    });
    let mut arm = arm(&noisy, [0.0; 3]);
    let codes = noisy.motor_map().zero_codes();
    let currents: Vec<f64> = (0..4000)
        .flat_map(|_| {
            arm.command(codes);
            arm.advance(1e-3, &mut NobodyHolds);
            arm.truth().current_a
        })
        .collect();
    let n = currents.len() as f64;
    let (mean, square) = (currents.iter().sum::<f64>() / n, currents.iter().map(|a| a * a).sum::<f64>() / n);
    // A millisecond is six time constants of the amplifier, so a tick's current is its own value but for 0.2 %; five
    // standard errors of mean and variance of 12,000 numbers.
    assert!(mean.abs() < 5.0 * 0.05 / n.sqrt(), "{mean}");
    assert!((square.sqrt() / 0.05 - 1.0).abs() < 0.04, "{}", square.sqrt());
}
