//! A cube of 0.1 kg and 50 mm between two fingers that press it along x, its centre off the line that joins them.
#![allow(dead_code, unreachable_pub)]

use std::f64::consts::PI;

use haptics::Cuboid;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use physics::{FingerSettings, Settings, SoftFinger};

use crate::common::*;

pub const EDGE: f64 = 0.05;
pub const MASS: f64 = 0.1;
/// About any axis through the centre.
pub const INERTIA: f64 = MASS * EDGE * EDGE / 6.0;

/// A grasp about an axis along x through the origin.
pub struct Held {
    pub world: World,
    pub stiffness: f64,
    pub mu: f64,
    /// From the axis to the centre of mass.
    pub arm: f64,
}

impl Held {
    /// The centre of mass hangs at this angle (rad) from straight below the axis, this far from it (m).
    pub fn new(soft: SoftFinger, stiffness: f64, mu: f64, arm: f64, angle: f64) -> Self {
        Self::in_a_world_of(Settings::default(), soft, [stiffness, mu], arm, angle)
    }

    /// As `new`, with other settings, the cube of this stiffness and friction.
    pub fn in_a_world_of(
        world: Settings,
        soft: SoftFinger,
        [stiffness, mu]: [f64; 2],
        arm: f64,
        angle: f64,
    ) -> Self {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle);
        let centre = turn * Vector3::new(0.0, -arm, 0.0);
        let pose = Isometry3::from_parts(Translation3::from(centre), turn);
        let cube = object(Cuboid::new([EDGE; 3]).unwrap(), pose, stiffness, mu);
        let state = body(&cube, MASS);
        let settings = FingerSettings { soft: soft.validated().unwrap(), attachment: None };
        let world = World::new(vec![cube], &[(0, state)], world, 2).with_fingers(settings);
        Self { world, stiffness, mu, arm }
    }

    /// What each finger must press with so that friction carries the cube (N).
    pub fn needed(&self) -> f64 {
        MASS * G / (2.0 * self.mu)
    }

    /// One tick in which each finger presses with this force (N).
    pub fn squeeze(&mut self, force: f64) {
        let x = 0.5 * EDGE - force / self.stiffness;
        self.world.step(&[Vector3::new(-x, 0.0, 0.0), Vector3::new(x, 0.0, 0.0)]);
    }

    /// So many seconds of it.
    pub fn squeeze_for(&mut self, seconds: f64, force: f64) {
        for _ in 0..(seconds / DT).round() as usize {
            self.squeeze(force);
        }
    }

    /// From one force to another, smoothly.
    pub fn relax(&mut self, seconds: f64, from: f64, to: f64) {
        let ticks = (seconds / DT).round() as usize;
        for tick in 0..ticks {
            let share = 0.5 - 0.5 * (PI * tick as f64 / ticks as f64).cos();
            self.squeeze(from + (to - from) * share);
        }
    }

    /// Of the cube about x (rad).
    pub fn angle(&self) -> f64 {
        self.world.body().orientation.scaled_axis().x
    }

    /// Kinetic and potential energy (J).
    pub fn energy(&self) -> f64 {
        let body = self.world.body();
        body.kinetic_energy_j() + MASS * G * body.centre_W.y
    }

    /// `m g L` (N m).
    pub fn weight_moment(&self) -> f64 {
        MASS * G * self.arm
    }

    /// About the axis (kg m^2).
    pub fn inertia(&self) -> f64 {
        INERTIA + MASS * self.arm * self.arm
    }
}
