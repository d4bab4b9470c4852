//! A simulated arm: rigid-body dynamics, friction, stops, motors, encoders, and cables if they stretch.
//!
//! Problem: without hardware a developer has to meet what the hardware does: it is heavy, it sticks, it counts in
//! steps, its motors are late and weak.
//!
//! Model, in the joint angles `q` of the links:
//!
//! ```text
//! (M(q) + N^2 J_rotor) q'' + C(q, q') q' + g(q) + b q' + stops(q, q') = N K i + J^T F_hand - friction
//! ```
//!
//! With cables that stretch, rotors and links are two bodies for each joint with a spring and a damper between
//! them, and the encoders see the rotors. Coulomb friction acts where the motors are.
//! Steps of [`STEP_S`] or less: the rates change by the acceleration at the step's middle, and the friction takes from
//! them what it needs to hold the joints, or all it has ([`super::joint_friction`]); the angles change by the mean of the
//! rates before and after, so that a joint that sticks does not creep. For a spring this keeps the area of phase space,
//! and with it the energy to second order for ever.
//! Frames and signs: base frame D; a positive torque turns its joint towards a larger angle.
//! Invariants: no input makes it allocate or panic. Time that is asked for in one call beyond [`LONGEST_S`] does not
//! pass: the world of a simulated arm stands still while nobody runs it.
//! Cost: two evaluations of the dynamics a step, 16 steps in a millisecond (`cargo bench -p io-driver --bench cycle`).

use super::encoder::EncoderPlant;
use super::joint_friction::JointFriction;
use super::motor::MotorPlant;
use super::spec::{CableSpec, SimulationSpec};
use super::split_mix::SplitMix64;
use crate::device_file::ArmFile;
use crate::kinematics::{Interval, JointLimits, Kinematics, Mechanism, gimbal};
use crate::motors::MotorMap;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// The longest step (s): a hundredth of the period of the stiffest spring that a description may have.
pub const STEP_S: f64 = 62.5e-6;
/// The longest time that passes in one call (s): the tick of the slowest driver.
pub const LONGEST_S: f64 = 0.1;

/// Whoever holds the tip.
pub trait TipLoad {
    /// The force on the tip (N) when it is here (m) and this fast (m/s), in D.
    fn force_on_tip(&self, tip: Vector3<f64>, velocity: Vector3<f64>) -> Vector3<f64>;

    /// Goes on by `dt_s`, in which the tip moves evenly from here (m) this fast (m/s).
    fn advance(&mut self, tip: Vector3<f64>, velocity: Vector3<f64>, dt_s: f64);
}

/// Nobody holds it.
#[derive(Debug, Clone, Copy, Default)]
pub struct NobodyHolds;

impl TipLoad for NobodyHolds {
    fn force_on_tip(&self, _: Vector3<f64>, _: Vector3<f64>) -> Vector3<f64> {
        Vector3::zeros()
    }

    fn advance(&mut self, _: Vector3<f64>, _: Vector3<f64>, _: f64) {}
}

/// What really is, which no encoder tells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// Joint angles of the links (rad).
    pub joints: [f64; 3],
    /// Their rates (rad/s).
    pub rates: [f64; 3],
    /// The tip (m).
    pub tip: Vector3<f64>,
    /// Its velocity (m/s).
    pub tip_velocity: Vector3<f64>,
    /// Motor currents (A).
    pub current_a: [f64; 3],
    /// Warmth of the warmest motor: 1 is the rated.
    pub motor_heat: f64,
}

/// The arm.
#[derive(Debug, Clone)]
pub struct SimulatedArm {
    spec: SimulationSpec,
    kinematics: Kinematics,
    limits: JointLimits,
    reduction: Vector3<f64>,
    motor_sign: Vector3<f64>,
    /// Rotors, seen from the joints (kg m^2).
    rotors: Vector3<f64>,
    map: MotorMap,
    motors: [MotorPlant; 3],
    encoders: EncoderPlant,
    gimbal: Option<EncoderPlant>,
    /// The gimbal's angles when it was read last (rad); its axes do not leap.
    gimbal_rad: Option<[f64; 3]>,
    friction: JointFriction,
    noise: SplitMix64,
    links: Seen,
    /// The rotors' own motion, in joint angles; that of the links while cables are rigid.
    shafts: Motion,
    current_noise_a: [f64; 3],
    silent_s: f64,
    is_tripped: bool,
}

/// Angles and rates of three joints.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Motion {
    angles: Vector3<f64>,
    rates: Vector3<f64>,
}

/// The links in motion, and all that their pose and rates alone decide.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Seen {
    motion: Motion,
    tip: Vector3<f64>,
    tip_velocity: Vector3<f64>,
    jacobian: Matrix3<f64>,
    /// Of the links, without rotors.
    mass: Matrix3<f64>,
    /// Weight, Coriolis and centrifugal torques, stops.
    torque: Vector3<f64>,
}

impl Seen {
    fn of(spec: &SimulationSpec, kinematics: &Kinematics, limits: &JointLimits, motion: Motion) -> Self {
        let (joints, rates) = (motion.angles.into(), motion.rates);
        let (tip, jacobian) = kinematics.forward_and_jacobian(joints);
        let (mass, torque) = spec.dynamics.mass_and_torque(joints, rates.into());
        Self {
            motion,
            tip,
            tip_velocity: jacobian * rates,
            jacobian,
            mass,
            torque: stops(spec, limits, motion) - torque,
        }
    }

    /// With what the hand does to the tip.
    fn torque_with(&self, hand: &impl TipLoad) -> Vector3<f64> {
        self.torque + self.jacobian.tr_mul(&hand.force_on_tip(self.tip, self.tip_velocity))
    }
}

impl Motion {
    /// In the middle of a step, where it has these rates. The angles go by the rates of the beginning: with better
    /// ones the rule would not keep the area of phase space.
    fn midway(self, rates: Vector3<f64>, dt_s: f64) -> Self {
        Self { angles: self.angles + self.rates * (0.5 * dt_s), rates }
    }

    /// After a step that ends with these rates, and changed them evenly.
    fn arriving(self, rates: Vector3<f64>, dt_s: f64) -> Self {
        Self { angles: self.angles + 0.5 * (self.rates + rates) * dt_s, rates }
    }
}

impl SimulatedArm {
    /// The arm of a description, at rest in the pose `joints`, amplifiers off; `None` if the description does not
    /// say how it moves.
    pub fn new(file: &ArmFile, joints: [f64; 3], seed: u64) -> Option<Self> {
        let spec = file.simulation?;
        let reduction = Vector3::from(file.motors.reduction);
        let motor = MotorPlant::new(spec.motor, file.motors.torque_constant_nm_per_a, file.heat);
        let rest = Motion { angles: joints.into(), rates: Vector3::zeros() };
        let limits = file.mechanism.joint_limits();
        Some(Self {
            spec,
            kinematics: file.mechanism,
            limits,
            reduction,
            motor_sign: file.motors.sign.map(f64::from).into(),
            rotors: reduction.map(|n| n * n * spec.motor.rotor_inertia_kg_m2),
            map: MotorMap::new(&file.motors),
            motors: std::array::from_fn(|_| motor.clone()),
            encoders: EncoderPlant::new(&file.encoders, spec.noise.encoder_counts_rms),
            gimbal: file.gimbal.as_ref().map(|gimbal| EncoderPlant::new(gimbal, 0.0)),
            gimbal_rad: None,
            friction: JointFriction::new(spec.coulomb_nm),
            noise: SplitMix64::new(seed),
            links: Seen::of(&spec, &file.mechanism, &limits, rest),
            shafts: rest,
            current_noise_a: [0.0; 3],
            silent_s: f64::NEG_INFINITY,
            is_tripped: false,
        })
    }

    /// The amplifiers get these converter codes, and are on; unless their watchdog has switched them off.
    pub fn command(&mut self, codes: [u16; 3]) {
        self.silent_s = 0.0;
        if self.is_tripped {
            return;
        }
        let currents = self.map.current_a(codes);
        for (joint, motor) in self.motors.iter_mut().enumerate() {
            motor.command(currents[joint] + self.current_noise_a[joint]);
        }
    }

    /// The amplifiers are switched off.
    pub fn switch_off(&mut self) {
        self.motors.iter_mut().for_each(MotorPlant::switch_off);
        self.silent_s = f64::NEG_INFINITY;
    }

    /// The amplifiers may be switched on again after their watchdog switched them off.
    pub fn rearm(&mut self) {
        self.is_tripped = false;
        self.silent_s = f64::NEG_INFINITY;
    }

    /// Whether their watchdog has switched them off.
    pub fn is_tripped(&self) -> bool {
        self.is_tripped
    }

    /// Raw counters now.
    pub fn counters(&mut self) -> [i64; 3] {
        self.encoders.raw(self.shafts.angles.into(), &mut self.noise)
    }

    /// Raw counters of an instrumented gimbal, if there is one, whose last link is turned like this in D.
    pub fn gimbal_counters(&mut self, orientation: UnitQuaternion<f64>) -> Option<[i64; 3]> {
        let carrier = gimbal::carrier(&self.kinematics, self.links.motion.angles.into());
        let encoders = self.gimbal.as_ref()?;
        let angles = match self.gimbal_rad {
            None => gimbal::angles(carrier, orientation),
            Some(former) => gimbal::angles_after(former, carrier, orientation),
        };
        self.gimbal_rad = Some(angles);
        Some(encoders.raw(angles, &mut self.noise))
    }

    /// Whether there is an instrumented gimbal.
    pub fn has_gimbal(&self) -> bool {
        self.gimbal.is_some()
    }

    /// Angle of a count of each joint (rad), with its sign.
    pub fn rad_per_count(&self) -> [f64; 3] {
        self.encoders.rad_per_count()
    }

    /// What really is.
    pub fn truth(&self) -> Truth {
        let Seen { motion, tip, tip_velocity, .. } = self.links;
        Truth {
            joints: motion.angles.into(),
            rates: motion.rates.into(),
            tip,
            tip_velocity,
            current_a: std::array::from_fn(|joint| self.motors[joint].current_a()),
            motor_heat: self.motors.iter().map(MotorPlant::rise).fold(0.0, f64::max),
        }
    }

    /// Goes on by `dt_s`, in equal steps.
    pub fn advance(&mut self, dt_s: f64, hand: &mut impl TipLoad) {
        // What is not a number is no time, either.
        let dt_s = if dt_s > 0.0 { dt_s.min(LONGEST_S) } else { return };
        let steps = (dt_s / STEP_S * (1.0 - 1e-9)).ceil().max(1.0);
        for _ in 0..steps as u32 {
            self.step(dt_s / steps, hand);
        }
        for (motor, noise_a) in self.motors.iter_mut().zip(&mut self.current_noise_a) {
            motor.warm(dt_s);
            *noise_a = if self.spec.noise.current_a_rms > 0.0 {
                self.spec.noise.current_a_rms * self.noise.normal()
            } else {
                0.0
            };
        }
        self.watch(dt_s);
    }

    fn watch(&mut self, dt_s: f64) {
        self.silent_s += dt_s;
        if self.silent_s > self.spec.motor.watchdog_s {
            self.is_tripped = true;
            self.motors.iter_mut().for_each(MotorPlant::switch_off);
        }
    }

    fn step(&mut self, dt_s: f64, hand: &mut impl TipLoad) {
        let drive = self.turn_motors(dt_s);
        let tip = self.links.tip;
        match self.spec.cable {
            None => self.step_rigid(drive, dt_s, hand),
            Some(cable) => self.step_elastic(&cable, drive, dt_s, hand),
        }
        hand.advance(tip, (self.links.tip - tip) / dt_s, dt_s);
    }

    /// The motors' mean torques on their joints in this step (N m).
    fn turn_motors(&mut self, dt_s: f64) -> Vector3<f64> {
        let mut torque = Vector3::zeros();
        for (joint, motor) in self.motors.iter_mut().enumerate() {
            let ratio = self.motor_sign[joint] * self.reduction[joint];
            let before = motor.torque_nm();
            motor.advance(ratio * self.shafts.rates[joint], dt_s);
            torque[joint] = ratio * 0.5 * (before + motor.torque_nm());
        }
        torque
    }

    fn step_rigid(&mut self, drive: Vector3<f64>, dt_s: f64, hand: &impl TipLoad) {
        let begin = self.links.motion;
        let inertia = self.inertia(&self.links);
        let half = self.see(self.half(begin, self.acceleration(&self.links, drive, hand), &inertia, dt_s));
        let free = begin.rates + self.acceleration(&half, drive, hand) * dt_s;
        let held = self.friction.hold(&self.inertia(&half), free, dt_s);
        self.links = self.see(begin.arriving(free + held, dt_s));
        self.shafts = self.links.motion;
    }

    fn step_elastic(&mut self, cable: &CableSpec, drive: Vector3<f64>, dt_s: f64, hand: &impl TipLoad) {
        let (links, shafts) = (self.links.motion, self.shafts);
        let rotors = Matrix3::from_diagonal(&self.rotors);
        let [of_links, of_shafts] = self.elastic(cable, &self.links, shafts, drive, hand);
        let half_links = self.see(links.midway(links.rates + of_links * (0.5 * dt_s), dt_s));
        let half_shafts = self.half(shafts, of_shafts, &rotors, dt_s);
        let [of_links, of_shafts] = self.elastic(cable, &half_links, half_shafts, drive, hand);
        let free = shafts.rates + of_shafts * dt_s;
        let held = self.friction.hold(&rotors, free, dt_s);
        self.links = self.see(links.arriving(links.rates + of_links * dt_s, dt_s));
        self.shafts = shafts.arriving(free + held, dt_s);
    }

    /// Where friction acts, at the middle of a step: what sticks does not seem to move there, either.
    fn half(&self, begin: Motion, acceleration: Vector3<f64>, inertia: &Matrix3<f64>, dt_s: f64) -> Motion {
        let free = begin.rates + acceleration * (0.5 * dt_s);
        let mut friction = self.friction;
        begin.midway(free + friction.hold(inertia, free, 0.5 * dt_s), dt_s)
    }

    fn see(&self, motion: Motion) -> Seen {
        Seen::of(&self.spec, &self.kinematics, &self.limits, motion)
    }

    /// Of links and rotors.
    fn inertia(&self, links: &Seen) -> Matrix3<f64> {
        links.mass + Matrix3::from_diagonal(&self.rotors)
    }

    fn viscous(&self, motion: Motion) -> Vector3<f64> {
        Vector3::from(self.spec.viscous_nm_s).component_mul(&motion.rates)
    }

    fn acceleration(&self, links: &Seen, drive: Vector3<f64>, hand: &impl TipLoad) -> Vector3<f64> {
        let torque = drive - self.viscous(links.motion) + links.torque_with(hand);
        solve(&self.inertia(links), torque)
    }

    /// Of links and of shafts.
    fn elastic(
        &self,
        cable: &CableSpec,
        links: &Seen,
        shafts: Motion,
        drive: Vector3<f64>,
        hand: &impl TipLoad,
    ) -> [Vector3<f64>; 2] {
        let stretch = shafts.angles - links.motion.angles;
        let stretching = shafts.rates - links.motion.rates;
        let pull = Vector3::from(cable.stiffness_nm_per_rad).component_mul(&stretch)
            + Vector3::from(cable.damping_nm_s).component_mul(&stretching);
        let of_links = solve(&links.mass, pull + links.torque_with(hand));
        [of_links, (drive - self.viscous(shafts) - pull).component_div(&self.rotors)]
    }
}

/// What the stops push, each joint's own and the elbow's between the last two.
fn stops(spec: &SimulationSpec, limits: &JointLimits, motion: Motion) -> Vector3<f64> {
    let own: [f64; 3] = std::array::from_fn(|joint| {
        stop(spec, limits.joints[joint], motion.angles[joint], motion.rates[joint])
    });
    let sign = limits.elbow_sign;
    let bend = limits.elbow_angle(motion.angles.into());
    let elbow = stop(spec, limits.elbow, bend, motion.rates[2] + sign * motion.rates[1]);
    Vector3::new(own[0], own[1] + sign * elbow, own[2] + elbow)
}

/// A stop pushes and never pulls.
fn stop(spec: &SimulationSpec, interval: Interval, angle: f64, rate: f64) -> f64 {
    let (stiffness, damping) = (spec.stop_stiffness_nm_per_rad, spec.stop_damping_nm_s);
    if angle < interval.min {
        (stiffness * (interval.min - angle) - damping * rate).max(0.0)
    } else if angle > interval.max {
        (stiffness * (interval.max - angle) - damping * rate).min(0.0)
    } else {
        0.0
    }
}

/// `M a = torque` for a turret that is not coupled with the other two joints, as in every parallelogram linkage.
fn solve(mass: &Matrix3<f64>, torque: Vector3<f64>) -> Vector3<f64> {
    let [a, b, d] = [mass[(1, 1)], mass[(1, 2)], mass[(2, 2)]];
    let determinant = a * d - b * b;
    Vector3::new(
        torque.x / mass[(0, 0)],
        (d * torque.y - b * torque.z) / determinant,
        (a * torque.z - b * torque.y) / determinant,
    )
}

#[cfg(test)]
mod tests;
