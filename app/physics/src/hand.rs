//! What fingers do to bodies besides pressing at points: pads that resist turning, gimbals, ties.
//!
//! Model: all of it is rows among the contact points of the tick. Pads of the `coulomb` model turn with the row of their
//! touch; those of the other models with a row of their own about the grasp axis of the body ([`GraspAxis`]); a tie
//! ([`Attachment`]) has one row that pulls, and three that turn.
//! Who turns along with a gimbal: what its finger touches; and the other finger of the grasp axis where that has no gimbal
//! itself, for nobody knows better (else its pad would hold back what the first one turns).
//! Invariant: no allocation after `new`; bounded by the number of touches. A finger of a number nobody knows is a point.

use haptics::Entity;
use nalgebra::{UnitQuaternion, Vector3};

use crate::attach::{Attachment, Bond, ROWS_OF_BOND, TiedFinger};
use crate::body::Body;
use crate::gimbal::Gimbal;
use crate::grasp_axis::{AxisMemory, GraspAxis, Hung, Pad, opposed};
use crate::limit_surface::{Shares, Slip};
use crate::roster::Roster;
use crate::row::Row;
use crate::soft_finger::SoftFinger;
use crate::solver::Motion;
use crate::touch::Touch;
use crate::twist::{Hold, Twist};

/// What a finger is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FingerSettings {
    /// Its pad.
    pub soft: SoftFinger,
    /// How it ties objects to itself; `None`: its button does nothing.
    pub attachment: Option<Attachment>,
}

impl Default for FingerSettings {
    /// A point without a button.
    fn default() -> Self {
        Self { soft: SoftFinger::POINT, attachment: None }
    }
}

/// What a finger does in a tick, and what it is made to feel for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FingerTick {
    /// Its HIP \[m\].
    pub hip_W: Vector3<f64>,
    /// How fast that moves \[m/s\], where somebody knows better than the difference of two positions, which comes in steps.
    pub hip_velocity_W: Option<Vector3<f64>>,
    /// Its orientation, where it has an instrumented gimbal.
    pub gimbal: Option<UnitQuaternion<f64>>,
    /// Whether its button is held.
    pub is_button_held: bool,
    /// Answer: force of its tie on the user \[N\], on top of those of its touches.
    pub force_on_user_W: Vector3<f64>,
    /// Answer: torque of pads and tie on the user \[N m\], for hardware that renders it.
    pub torque_on_user_W: Vector3<f64>,
    /// Answer: the entity that is tied to it.
    pub attached: Option<usize>,
}

impl FingerTick {
    /// A finger that is there, without gimbal or button.
    pub fn at(hip_W: Vector3<f64>) -> Self {
        Self {
            hip_W,
            hip_velocity_W: None,
            gimbal: None,
            is_button_held: false,
            force_on_user_W: Vector3::zeros(),
            torque_on_user_W: Vector3::zeros(),
            attached: None,
        }
    }
}

/// All fingers, and what they remember of what they hold.
#[derive(Debug, Clone, Default)]
pub(crate) struct Hand {
    fingers: Box<[Memory]>,
    /// Of each body.
    axes: Box<[AxisMemory]>,
    held: Box<[Option<GraspAxis>]>,
}

#[derive(Debug, Clone, Default)]
struct Memory {
    settings: FingerSettings,
    gimbal: Gimbal,
    /// By how much it turned in this tick; `None`: nobody knows.
    turn_W: Option<Vector3<f64>>,
    pads: [PadMemory; MAX_PADS],
    bond: Option<Bond>,
    /// Its HIP in the last tick \[m\], and how fast it moves \[m/s\].
    hip_W: Option<Vector3<f64>>,
    velocity_W: Vector3<f64>,
}

impl Memory {
    /// Takes note of where the finger is in this tick.
    fn move_to(&mut self, tick: &FingerTick, dt_s: f64) {
        let is_number = |v_W: &Vector3<f64>| v_W.iter().all(|x| x.is_finite());
        let last_W = self.hip_W.replace(tick.hip_W);
        let difference_W = last_W.map(|last_W| (tick.hip_W - last_W) / dt_s);
        self.velocity_W = tick.hip_velocity_W.or(difference_W).filter(is_number).unwrap_or_default();
    }
}

/// A pad's memory of what it touches.
#[derive(Debug, Clone, Copy, Default)]
struct PadMemory {
    body: Option<usize>,
    twist: Twist,
    slip: Slip,
    /// The touch's row in this tick.
    row: Option<usize>,
}

/// The state that a tick begins with, and what was found in it.
pub(crate) struct HandStart<'t> {
    pub(crate) touches: &'t [Touch],
    /// Of each touch, its row.
    pub(crate) touch_rows: &'t [Option<usize>],
    pub(crate) entities: &'t [Entity],
    pub(crate) roster: &'t Roster,
    /// Those that are awake.
    pub(crate) bodies: &'t [Body],
    pub(crate) gravity_W: Vector3<f64>,
    pub(crate) dt_s: f64,
}

impl Hand {
    /// Of these fingers, in a world of so many bodies.
    pub(crate) fn new(fingers: &[FingerSettings], bodies: usize) -> Self {
        Self {
            fingers: fingers.iter().map(|&settings| Memory { settings, ..Memory::default() }).collect(),
            axes: vec![AxisMemory::default(); bodies].into(),
            held: vec![None; bodies].into(),
        }
    }

    /// The most rows that it appends in a tick.
    pub(crate) fn most_rows(&self) -> usize {
        // No body is held by fewer than two.
        self.fingers.len() * ROWS_OF_BOND + self.axes.len().min(self.fingers.len() * MAX_PADS)
    }

    /// Whether a finger holds it by a tie.
    pub(crate) fn is_tied_to(&self, body: usize) -> bool {
        self.fingers.iter().any(|finger| finger.bond.is_some_and(|bond| bond.body == body))
    }

    /// The grasp axis of a body in the last tick.
    pub(crate) fn axis(&self, body: usize) -> Option<GraspAxis> {
        *self.held.get(body)?
    }

    /// Gives the touches' rows their torsion, and appends the rows of ties and grasp axes.
    pub(crate) fn gather(&mut self, start: &HandStart<'_>, ticks: &[FingerTick], rows: &mut Vec<Row>) {
        if self.fingers.is_empty() {
            return;
        }
        for (index, finger) in self.fingers.iter_mut().enumerate() {
            let orientation = ticks.get(index).and_then(|tick| tick.gimbal);
            finger.turn_W = finger.gimbal.turn_W(orientation);
            if let Some(tick) = ticks.get(index) {
                finger.move_to(tick, start.dt_s);
            }
            finger.pads.iter_mut().for_each(|pad| pad.row = None);
        }
        for place in 0..start.roster.awake().len() {
            self.grasp(start, place, rows);
        }
        for finger in &mut self.fingers {
            finger.pads.iter_mut().filter(|pad| pad.row.is_none()).for_each(|pad| pad.body = None);
        }
        self.tie(start, ticks, rows);
    }

    /// All that the fingers do to the turning of one body.
    fn grasp(&mut self, start: &HandStart<'_>, place: usize, rows: &mut Vec<Row>) {
        let body = start.roster.awake()[place];
        let own = start.roster.entities[body];
        let mut pads = [Pad::default(); MAX_TOUCHES_OF_BODY];
        let mut at = [0; MAX_TOUCHES_OF_BODY];
        let mut count = 0;
        for (touch, row) in start.touches.iter().zip(start.touch_rows) {
            let Some(row) = row.filter(|_| touch.entity == own) else { continue };
            let Some(finger) = self.fingers.get(touch.finger) else { continue };
            if count == MAX_TOUCHES_OF_BODY {
                break;
            }
            let normal_n = touch.normal_W.dot(&touch.force_on_user_W).max(0.0);
            let circle = finger.settings.soft.circle(touch, &start.entities[touch.entity], normal_n);
            let (point_W, inward_W) = (touch.point_W, -touch.normal_W);
            let across_n = (touch.force_on_user_W - touch.normal_W * normal_n).norm();
            pads[count] = Pad { finger: touch.finger, point_W, inward_W, normal_n, across_n, circle };
            at[count] = row;
            count += 1;
        }
        let pads = &pads[..count];
        let pair = opposed(pads);
        for (of, pad) in pads.iter().enumerate() {
            let partner = pair.and_then(|(i, j)| match of {
                _ if of == i => Some(pads[j].finger),
                _ if of == j => Some(pads[i].finger),
                _ => None,
            });
            self.press(pad, partner, (body, &start.bodies[place]), &mut rows[at[of]], (at[of], start.dt_s));
        }
        self.held[body] = pair.map(|(i, j)| axis_of(&pads[i], &pads[j]));
        match pair {
            Some((i, j)) => self.turn_about_axis(start, place, [&pads[i], &pads[j]], rows),
            None => self.axes[body].end(),
        }
    }

    /// Torsional friction of one pad about its own normal, and what it leaves of the other friction.
    fn press(
        &mut self,
        pad: &Pad,
        partner: Option<usize>,
        (body, state): (usize, &Body),
        row: &mut Row,
        (number, dt_s): (usize, f64),
    ) {
        let partner_W = partner.and_then(|partner| self.fingers[partner].turn_W);
        let finger = &mut self.fingers[pad.finger];
        let soft = finger.settings.soft;
        let mut hold = Hold {
            stiffness_nm_per_rad: soft.stiffness_nm_per_rad,
            damping_nm_s_per_rad: soft.damping_nm_s_per_rad,
            most_nm: soft.most_nm(&pad.circle),
        };
        let turn_W = finger.turn_W.or(partner_W).filter(|_| soft.follows(&pad.circle));
        let known = finger.pads.iter().position(|pad| pad.body == Some(body));
        let Some(place) = known.or_else(|| finger.pads.iter().position(|pad| pad.body.is_none())) else {
            return;
        };
        let memory = &mut finger.pads[place];
        if known.is_none() {
            let twist = Twist::begin(state.orientation);
            *memory = PadMemory { body: Some(body), twist, ..PadMemory::default() };
        }
        memory.row = Some(number);
        let turn_W = turn_W.unwrap_or_default();
        memory.twist.carry(&state.orientation, &pad.inward_W, &turn_W);
        let (most_n, most_nm) = (pad.circle.most_n(), hold.most_nm);
        if soft.shares() && most_n > 0.0 {
            let asked_nm = memory.twist.asked_nm(hold.stiffness_nm_per_rad).abs();
            let asked = Shares { friction: pad.across_n / most_n, torsion: asked_nm / most_nm };
            let arm_W = pad.point_W - state.centre_W;
            let moving_W = state.velocity_W + state.angular_velocity_W().cross(&arm_W);
            let slip_W = moving_W - finger.velocity_W;
            let slip_W = slip_W - pad.inward_W * pad.inward_W.dot(&slip_W);
            let turned_rad = pad.inward_W.dot(&(state.angular_velocity_W() * dt_s - turn_W));
            let slid_m =
                Shares { friction: slip_W.norm() * dt_s, torsion: turned_rad.abs() * (most_nm / most_n) };
            let left = memory.slip.shares(&asked, &slid_m);
            hold.most_nm *= left.torsion;
            let mu = left.friction * most_n / pad.normal_n;
            (row.mu_hold, row.mu_slide) = (row.mu_hold.min(mu), row.mu_slide.min(mu));
        }
        row.torsion = memory.twist.torsion(&hold);
    }

    /// What two pads that hold a body between them do about the line that joins them.
    fn turn_about_axis(&mut self, start: &HandStart<'_>, place: usize, pads: [&Pad; 2], rows: &mut Vec<Row>) {
        let body = &start.bodies[place];
        let smaller = if pads[1].circle.area_m2() < pads[0].circle.area_m2() { pads[1] } else { pads[0] };
        let axis = axis_of(pads[0], pads[1]);
        let turns = pads.map(|pad| self.fingers[pad.finger].turn_W);
        let gimbals_W = match turns {
            [Some(one), Some(other)] => (one + other) * 0.5,
            [one, other] => one.or(other).unwrap_or_default(),
        };
        let weight_W = start.gravity_W * body.mass.mass_kg;
        let hung = Hung {
            orientation: &body.orientation,
            gravity_nm: (body.centre_W - axis.point_W).cross(&weight_W).dot(&axis.axis_W),
            spin_rad_s: axis.axis_W.dot(&body.angular_velocity_W()),
            gimbals_W,
        };
        let soft = self.fingers[smaller.finger].settings.soft;
        let memory = &mut self.axes[start.roster.awake()[place]];
        memory.row = None;
        let Some(torsion) = memory.torsion(&axis, &soft, &smaller.circle, &hung) else { return };
        if rows.len() < rows.capacity() {
            memory.row = Some(rows.len());
            rows.push(Row::turning(place, axis.axis_W, torsion));
        }
    }

    /// Begins, goes on with and ends ties.
    fn tie(&mut self, start: &HandStart<'_>, ticks: &[FingerTick], rows: &mut Vec<Row>) {
        for (index, finger) in self.fingers.iter_mut().enumerate() {
            let tick = ticks.get(index).filter(|tick| tick.hip_W.iter().all(|x| x.is_finite()));
            let (Some(tick), Some(attachment)) = (tick, finger.settings.attachment) else {
                finger.bond = None;
                continue;
            };
            if finger.bond.is_none() && tick.is_button_held {
                let touched = touched_by(index, start);
                finger.bond =
                    touched.map(|(body, place)| Bond::begin(body, tick.hip_W, &start.bodies[place]));
            }
            // What does not move any more would hold the finger for ever.
            let tied = finger.bond.as_mut().and_then(|bond| Some((start.roster.place(bond.body)?, bond)));
            let Some((place, bond)) = tied else {
                finger.bond = None;
                continue;
            };
            let tied = TiedFinger {
                hip_W: tick.hip_W,
                velocity_W: tick.hip_velocity_W,
                is_held: tick.is_button_held,
                turn_W: finger.turn_W,
                place,
                body: &start.bodies[place],
                dt_s: start.dt_s,
            };
            if !bond.gather(&attachment, &tied, rows) {
                finger.bond = None;
            }
        }
    }

    /// Takes note of how the tick ended, and tells the fingers.
    pub(crate) fn settle(
        &mut self,
        rows: &[Row],
        motions: &[Motion],
        roster: &Roster,
        ticks: &mut [FingerTick],
        dt_s: f64,
    ) {
        for tick in ticks.iter_mut() {
            (tick.force_on_user_W, tick.torque_on_user_W, tick.attached) = Default::default();
        }
        for (index, finger) in self.fingers.iter_mut().enumerate() {
            let (mut force_W, mut torque_W) = Default::default();
            if let Some(bond) = &mut finger.bond {
                (force_W, torque_W) = bond.settle(rows);
            }
            for pad in &mut finger.pads {
                let Some(row) = pad.row.and_then(|row| rows.get(row)) else { continue };
                let spin_rad_s = row.normal_W.dot(&motions[row.body].angular_velocity_W);
                pad.twist.settle(&row.torsion, spin_rad_s, dt_s);
                torque_W -= row.normal_W * row.torsion.torque_nm;
            }
            if let Some(tick) = ticks.get_mut(index) {
                (tick.force_on_user_W, tick.torque_on_user_W) = (force_W, torque_W);
                tick.attached = finger.bond.map(|bond| roster.entities[bond.body]);
            }
        }
        if self.fingers.is_empty() {
            return;
        }
        for &body in roster.awake() {
            let (memory, axis) = (&mut self.axes[body], &self.held[body]);
            let (Some(row), Some(axis)) = (memory.row.and_then(|row| rows.get(row)), axis) else { continue };
            let spin_rad_s = row.normal_W.dot(&motions[row.body].angular_velocity_W);
            memory.settle(&row.torsion, spin_rad_s, dt_s);
            // Of both pads: each has half of it.
            for finger in axis.fingers {
                if let Some(tick) = ticks.get_mut(finger) {
                    tick.torque_on_user_W -= row.normal_W * (0.5 * row.torsion.torque_nm);
                }
            }
        }
    }
}

/// The body that a finger presses hardest, and its place.
fn touched_by(finger: usize, start: &HandStart<'_>) -> Option<(usize, usize)> {
    let mut hardest: Option<(f64, usize)> = None;
    for (touch, row) in start.touches.iter().zip(start.touch_rows) {
        let force_n = touch.force_on_user_W.norm();
        if touch.finger == finger && row.is_some() && hardest.is_none_or(|(most, _)| force_n > most) {
            hardest = Some((force_n, touch.entity));
        }
    }
    let place = start.roster.place_of_entity(hardest?.1)?;
    Some((start.roster.awake()[place], place))
}

fn axis_of(one: &Pad, other: &Pad) -> GraspAxis {
    let between_W = other.point_W - one.point_W;
    GraspAxis {
        fingers: [one.finger, other.finger],
        point_W: one.point_W,
        axis_W: between_W / between_W.norm(),
    }
}

/// A finger holds on to so many bodies at once by torsion; further ones it touches as a point.
const MAX_PADS: usize = 4;
/// So many touches of a body resist its turning; further ones are points.
const MAX_TOUCHES_OF_BODY: usize = 8;
