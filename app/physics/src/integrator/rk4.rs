//! The classical Runge-Kutta scheme over all bodies at once.
//!
//! Model: position, velocity, orientation and angular momentum of each body; contact points, their normals and whether they
//! hold stay what they were when the tick began, and their forces follow how far and how fast the bodies' points have moved
//! in each stage. What somebody drives goes on as it does.
//! A finger stands still for the tick: so a hand that holds still is integrated to fourth order, and one that
//! carries feels a drag of `k dt / 2`. What the user feels is the mean of the stages, which is what the body got.
//! The integrator is explicit: beyond `k dt^2 / m` of some units it throws light bodies away.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::{Gets, Limits, limited};
use crate::body::Body;
use crate::row::Row;
use crate::wrench::Wrench;

/// Where the stages lead a body.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Staged {
    moved_W: Vector3<f64>,
    velocity_W: Vector3<f64>,
    orientation: UnitQuaternion<f64>,
    angular_momentum_W: Vector3<f64>,
    /// What arms that turn during the tick make of the mean forces beyond the torque at its beginning \[N m\].
    torque_W: Vector3<f64>,
}

/// A body in a stage, or how it changes per time.
#[derive(Debug, Clone, Copy, Default)]
struct State {
    moved_W: Vector3<f64>,
    velocity_W: Vector3<f64>,
    orientation: Quaternion<f64>,
    angular_momentum_W: Vector3<f64>,
}

impl State {
    fn plus(&self, rate: &Self, dt_s: f64) -> Self {
        Self {
            moved_W: self.moved_W + rate.moved_W * dt_s,
            velocity_W: self.velocity_W + rate.velocity_W * dt_s,
            orientation: self.orientation + rate.orientation * dt_s,
            angular_momentum_W: self.angular_momentum_W + rate.angular_momentum_W * dt_s,
        }
    }
}

/// Room for the stages.
#[derive(Debug, Clone, Default)]
pub(crate) struct Stages {
    starts: Vec<State>,
    now: Vec<State>,
    sums: Vec<State>,
    wrenches: Vec<Wrench>,
    /// Of each row, the mean force and torque; and of a finger's the velocity of the body's point when the tick begins, with
    /// which its row has the finger going on.
    means: Vec<(Vector3<f64>, f64, Vector3<f64>)>,
}

/// Share of the tick at which a stage is looked at, and its weight.
const STAGES: [(f64, f64); 4] = [(0.0, 1.0 / 6.0), (0.5, 1.0 / 3.0), (0.5, 1.0 / 3.0), (1.0, 1.0 / 6.0)];

impl Stages {
    pub(crate) fn with_capacity(rows: usize, bodies: usize) -> Self {
        Self {
            starts: Vec::with_capacity(bodies),
            now: Vec::with_capacity(bodies),
            sums: Vec::with_capacity(bodies),
            wrenches: Vec::with_capacity(bodies),
            means: Vec::with_capacity(rows),
        }
    }

    /// The mean force (N) and torque (N m) of a row.
    pub(crate) fn means(&self, row: usize) -> (Vector3<f64>, f64) {
        self.means.get(row).map_or_else(Default::default, |(force_W, torque_nm, _)| (*force_W, *torque_nm))
    }

    /// Goes through the stages and notes in `gets` where they lead. The first `touches` rows are fingers', the first `springs`
    /// have forces that are known; the others are solved for afterwards.
    pub(crate) fn run(
        &mut self,
        bodies: &[Body],
        rows: &[Row],
        touches: usize,
        springs: usize,
        gets: &mut [Gets],
        dt_s: f64,
    ) {
        self.begin(bodies, rows, touches);
        for (stage, (_, weight)) in STAGES.into_iter().enumerate() {
            self.wrenches.iter_mut().for_each(|wrench| *wrench = Wrench::default());
            self.press(bodies, rows, springs, dt_s, weight);
            let next_s = STAGES.get(stage + 1).map_or(0.0, |(share, _)| share * dt_s);
            for (number, body) in bodies.iter().enumerate() {
                // What nothing moves goes on as it does.
                let (wrench, gravity_W) = match gets[number].is_fixed {
                    true => (Wrench::default(), Vector3::zeros()),
                    false => (self.wrenches[number], gets[number].gravity_W),
                };
                let rate = rate(body, &self.now[number], &wrench, &gravity_W);
                self.sums[number] = self.sums[number].plus(&rate, weight);
                self.now[number] = self.starts[number].plus(&rate, next_s);
            }
        }
        for (number, gets) in gets.iter_mut().enumerate() {
            let end = self.starts[number].plus(&self.sums[number], dt_s);
            gets.staged = Staged {
                moved_W: end.moved_W,
                velocity_W: end.velocity_W,
                orientation: UnitQuaternion::new_normalize(end.orientation),
                angular_momentum_W: end.angular_momentum_W,
                torque_W: self.sums[number].angular_momentum_W,
            };
        }
        for (row, (force_W, torque_nm, _)) in rows.iter().zip(&self.means) {
            let torque_W = row.normal_W * *torque_nm;
            let [arm_W, other_arm_W] = &row.arms_W;
            gets[row.body].staged.torque_W -= arm_W.cross(force_W) + torque_W;
            if let Some(other) = row.other {
                gets[other].staged.torque_W += other_arm_W.cross(force_W) + torque_W;
            }
        }
    }

    fn begin(&mut self, bodies: &[Body], rows: &[Row], touches: usize) {
        self.starts.clear();
        self.starts.extend(bodies.iter().map(|body| State {
            moved_W: Vector3::zeros(),
            velocity_W: body.velocity_W,
            orientation: body.orientation.into_inner(),
            angular_momentum_W: body.angular_momentum_W,
        }));
        self.now.clone_from(&self.starts);
        self.sums.clear();
        self.sums.resize(bodies.len(), State::default());
        self.wrenches.clear();
        self.wrenches.resize(bodies.len(), Wrench::default());
        self.means.clear();
        self.means.extend(rows.iter().enumerate().take(self.means.capacity()).map(|(at, row)| {
            let body = &bodies[row.body];
            let own_W = body.velocity_W + body.angular_velocity_W().cross(&row.arms_W[0]);
            (Vector3::zeros(), 0.0, if at < touches { own_W } else { Vector3::zeros() })
        }));
    }

    /// What the rows give in this stage.
    fn press(&mut self, bodies: &[Body], rows: &[Row], springs: usize, dt_s: f64, weight: f64) {
        for (row, mean) in rows.iter().zip(&mut self.means).take(springs) {
            if !row.is_finite() {
                continue;
            }
            let (arm_W, point) = point_of(&bodies[row.body], &self.now[row.body], &row.arms_W[0]);
            let (other_arm_W, other) = match row.other {
                Some(other) => point_of(&bodies[other], &self.now[other], &row.arms_W[1]),
                None => Default::default(),
            };
            let (moved_W, velocity_W) = (point.moved_W - other.moved_W, point.velocity_W - other.velocity_W);
            let rows_own_W = moved_W + mean.2 * dt_s;
            let force_W = row.project(&row.trial_W(&rows_own_W, &velocity_W));
            let turned_rad = row.normal_W.dot(&(point.turned_W - other.turned_W));
            let spin_rad_s = row.normal_W.dot(&(point.spin_W - other.spin_W));
            let torque_nm = row.torsion.after_nm(turned_rad, spin_rad_s);
            mean.0 += force_W * weight;
            mean.1 += torque_nm * weight;
            self.wrenches[row.body].add(&force_W, &arm_W);
            self.wrenches[row.body].torque_W += row.normal_W * torque_nm;
            if let Some(other) = row.other {
                self.wrenches[other].add(&-force_W, &other_arm_W);
                self.wrenches[other].torque_W -= row.normal_W * torque_nm;
            }
        }
    }
}

/// A body's point in a stage.
#[derive(Debug, Clone, Copy, Default)]
struct Point {
    moved_W: Vector3<f64>,
    velocity_W: Vector3<f64>,
    turned_W: Vector3<f64>,
    spin_W: Vector3<f64>,
}

/// Its arm, and how it moves.
fn point_of(body: &Body, now: &State, arm_W: &Vector3<f64>) -> (Vector3<f64>, Point) {
    let turn = if body.rotation_locked {
        UnitQuaternion::identity()
    } else {
        UnitQuaternion::new_normalize(now.orientation) * body.orientation.inverse()
    };
    let arm_now_W = turn * arm_W;
    let spin_W = spin_W(body, now);
    let point = Point {
        moved_W: now.moved_W + arm_now_W - arm_W,
        velocity_W: now.velocity_W + spin_W.cross(&arm_now_W),
        turned_W: turn.scaled_axis(),
        spin_W,
    };
    (arm_now_W, point)
}

fn spin_W(body: &Body, now: &State) -> Vector3<f64> {
    let turned = Body {
        orientation: UnitQuaternion::new_normalize(now.orientation),
        angular_momentum_W: now.angular_momentum_W,
        ..*body
    };
    turned.angular_velocity_W()
}

fn rate(body: &Body, now: &State, wrench: &Wrench, gravity_W: &Vector3<f64>) -> State {
    let spin_W = spin_W(body, now);
    State {
        moved_W: now.velocity_W,
        velocity_W: gravity_W + wrench.force_W / body.mass.mass_kg,
        orientation: Quaternion::from_imag(spin_W) * now.orientation * 0.5,
        angular_momentum_W: if body.rotation_locked { Vector3::zeros() } else { wrench.torque_W },
    }
}

/// Takes a body where its stages led, and where the impulses of the tick took it beyond that.
pub(super) fn advance(body: &mut Body, velocity_W: Vector3<f64>, gets: &Gets, limits: &Limits, dt_s: f64) {
    let staged = &gets.staged;
    let moved_W = staged.moved_W + (velocity_W - staged.velocity_W) * dt_s;
    body.velocity_W = velocity_W;
    body.centre_W += limited(moved_W, limits.speed_m_s * dt_s);
    if body.rotation_locked {
        return;
    }
    let start_W = body.angular_momentum_W;
    body.orientation = staged.orientation;
    body.angular_momentum_W = staged.angular_momentum_W;
    let spin_W = body.angular_velocity_W();
    body.angular_momentum_W = start_W + (gets.wrench.torque_W + staged.torque_W) * dt_s;
    limits.spin(body);
    let beyond_W = (body.angular_velocity_W() - spin_W) * dt_s;
    let orientation = UnitQuaternion::from_scaled_axis(beyond_W) * body.orientation;
    body.orientation = UnitQuaternion::new_normalize(orientation.into_inner());
}
