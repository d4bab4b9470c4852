//! Two entities that may touch: a body, and another body or what is fixed.
//!
//! Model: stiffnesses in series, dampings added, friction the geometric mean (each contact point is a spring of its own; a
//! face at rest on four points is four springs). The *force response* presses with the depth (Melder eq. 6.2, with damping
//! and without pulling); the *impulse response* reflects the approaching velocity (eq. 6.1, corrected).
//! A contact that is found deep at once (objects placed into each other) is let out slowly.

use haptics::Entity;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::anchor::Anchor;
use crate::body::Body;
use crate::collide::{
    ContactPoint, ContactPoints, MAX_POINTS, PairMemory, Solid, bounding_ball, contact_points,
};
use crate::pair_friction::PairFriction;
use crate::row::{Row, Torsion};
use crate::solver::Motion;

/// How a contact between entities answers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Response {
    /// A spring and a damper.
    #[default]
    Force,
    /// Velocities are reflected.
    Impulse {
        /// e, 0 to 1: how much of the approaching velocity comes back.
        restitution: f64,
    },
}

/// What two surfaces make of each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surfacing {
    /// Of each contact point \[N/m\].
    pub stiffness_n_per_m: f64,
    /// Of each contact point \[N s/m\].
    pub damping_n_s_per_m: f64,
    /// Ratios.
    pub friction: PairFriction,
    /// How it answers.
    pub response: Response,
}

impl Surfacing {
    /// Of two entities.
    pub fn between(a: &Entity, b: &Entity, response: Response) -> Self {
        let (k_a, k_b) = (a.stiffness_n_per_m, b.stiffness_n_per_m);
        Self {
            stiffness_n_per_m: k_a / (1.0 + k_a / k_b),
            damping_n_s_per_m: a.damping_n_s_per_m + b.damping_n_s_per_m,
            friction: PairFriction::between(&a.friction, &b.friction),
            response,
        }
    }
}

/// A pair and its contact points.
#[derive(Debug, Clone)]
pub(crate) struct Pair {
    /// Of the entities: A's, which is a body, and B's.
    pub(crate) entities: [usize; 2],
    /// Of the bodies; B may be fixed.
    pub(crate) bodies: (usize, Option<usize>),
    pub(crate) surfacing: Surfacing,
    memory: PairMemory,
    /// The memory holds anything.
    remembers: bool,
    anchors: [Anchor; MAX_POINTS],
    /// Those of the last tick, as many as there were.
    last: [Anchor; MAX_POINTS],
    count: usize,
    /// Where its rows of this tick begin.
    first_row: usize,
    rows: usize,
}

/// The state that a tick begins with.
pub(crate) struct Start<'t> {
    pub(crate) entities: &'t [Entity],
    pub(crate) bodies: &'t [Body],
    /// As they are without contacts, at the end of the tick.
    pub(crate) motions: &'t [Motion],
    /// The most that any point of each moves per time \[m/s\].
    pub(crate) speeds_m_s: &'t [f64],
    pub(crate) dt_s: f64,
    /// Whether forces are those of the end of the tick.
    pub(crate) is_implicit: bool,
}

impl Pair {
    pub(crate) fn new(entities: [usize; 2], bodies: (usize, Option<usize>), surfacing: Surfacing) -> Self {
        let anchors = [Anchor::default(); MAX_POINTS];
        Self {
            entities,
            bodies,
            surfacing,
            memory: PairMemory::default(),
            remembers: false,
            anchors,
            last: anchors,
            count: 0,
            first_row: 0,
            rows: 0,
        }
    }

    /// Finds where it touches, and appends a row for each point; notes which rows are impacts.
    pub(crate) fn gather(&mut self, start: &Start<'_>, rows: &mut Vec<Row>, impacts: &mut Vec<usize>) {
        (self.first_row, self.rows) = (rows.len(), 0);
        let [a, b] = self.entities.map(|index| &start.entities[index]);
        let speed_m_s = self.closing_speed(start);
        let reach_m = REACH_M + speed_m_s * start.dt_s;
        if !is_near(a, b, reach_m) {
            self.count = 0;
            // They may meet again from another side.
            if std::mem::take(&mut self.remembers) {
                self.memory = PairMemory::default();
            }
            return;
        }
        self.remembers = true;
        let (in_A, in_B) = (Solid { shape: &a.shape, X_W: &a.X_WB }, Solid { shape: &b.shape, X_W: &b.X_WB });
        let mut found = ContactPoints::default();
        contact_points(in_A, in_B, reach_m, &mut self.memory, &mut found);
        let poses = [[&a.X_WB, &b.X_WB], [&a.previous_X_WB, &b.previous_X_WB]];
        self.carry(&found, poses, reach_m, speed_m_s * start.dt_s);
        for (anchor, point) in self.anchors.iter_mut().zip(found.as_slice()) {
            if rows.len() == rows.capacity() {
                return;
            }
            let let_out_m = let_out_m_s(anchor.granted_m, start.dt_s) * start.dt_s;
            anchor.granted_m = (anchor.granted_m - let_out_m).clamp(0.0, (-point.gap_m).max(0.0));
            let (row, is_impact) = row(self.bodies, &self.surfacing, anchor, point, &b.X_WB, start);
            if is_impact {
                impacts.push(rows.len());
            }
            rows.push(row);
            self.rows += 1;
        }
    }

    /// Takes note of how the tick ended.
    pub(crate) fn settle(&mut self, rows: &[Row], motions: &[Motion], entities: &[Entity], dt_s: f64) {
        let X_WB = &entities[self.entities[1]].X_WB;
        let own = rows.iter().skip(self.first_row).take(self.rows);
        for (anchor, row) in self.anchors.iter_mut().zip(own) {
            let mut velocity_W = motions[row.body].at(&row.arms_W[0]);
            if let Some(other) = row.other {
                velocity_W -= motions[other].at(&row.arms_W[1]);
            }
            anchor.settle(row, &(velocity_W * dt_s), X_WB);
        }
    }

    /// The anchors of the points that were found, in their order: those of the last tick where they go on.
    fn carry(
        &mut self,
        found: &ContactPoints,
        [now, last]: [[&Isometry3<f64>; 2]; 2],
        reach_m: f64,
        moved_m: f64,
    ) {
        self.last[..self.count].copy_from_slice(&self.anchors[..self.count]);
        let was = &self.last[..self.count];
        let mut is_free = [false; MAX_POINTS];
        is_free.iter_mut().take(self.count).for_each(|free| *free = true);
        let begins = self.count == 0;
        self.count = found.as_slice().len();
        let mut is_new = [false; MAX_POINTS];
        for (at, point) in found.as_slice().iter().enumerate() {
            let same = (0..was.len()).find(|&old| is_free[old] && was[old].id == point.id);
            is_new[at] = same.is_none();
            if let Some(old) = same {
                is_free[old] = false;
                self.anchors[at] = was[old];
                self.anchors[at].carry(point, now, last);
            }
        }
        for (at, point) in found.as_slice().iter().enumerate().filter(|(at, _)| is_new[*at]) {
            // The same contact under another name: it came from one face of a mesh to the next.
            let near_m = NEAR_M + 2.0 * moved_m;
            let is_near =
                |old: &usize| is_free[*old] && (was[*old].point_W(now[1]) - point.point_W).norm() < near_m;
            if let Some(old) = (0..was.len()).find(is_near) {
                is_free[old] = false;
                self.anchors[at] = was[old];
                self.anchors[at].carry(point, now, last);
                continue;
            }
            self.anchors[at] = Anchor::begin(point, now[0], now[1]);
            if begins && -point.gap_m > reach_m {
                self.anchors[at].granted_m = -point.gap_m;
            }
        }
    }

    /// The most that A and B can come nearer to each other per time \[m/s\].
    fn closing_speed(&self, start: &Start<'_>) -> f64 {
        let (a, b) = self.bodies;
        start.speeds_m_s[a] + b.map_or(0.0, |b| start.speeds_m_s[b])
    }
}

/// The most that any point of a body moves per time \[m/s\].
pub(crate) fn fastest_point_m_s(entity: &Entity, body: &Body, motion: &Motion) -> f64 {
    let farthest_m = bounding_ball(&entity.shape)
        .map_or(0.0, |(centre_B, radius_m)| radius_m + (centre_B - body.mass.centre_B).norm());
    motion.velocity_W.norm() + motion.angular_velocity_W.norm() * farthest_m
}

fn is_near(a: &Entity, b: &Entity, reach_m: f64) -> bool {
    let centre = |entity: &Entity, at_B: Vector3<f64>| (entity.X_WB * nalgebra::Point3::from(at_B)).coords;
    match (bounding_ball(&a.shape), bounding_ball(&b.shape)) {
        (Some((at_a, r_a)), Some((at_b, r_b))) => {
            (centre(a, at_a) - centre(b, at_b)).norm_squared() <= (r_a + r_b + reach_m).powi(2)
        }
        _ => true,
    }
}

fn row(
    (body, other): (usize, Option<usize>),
    surfacing: &Surfacing,
    anchor: &mut Anchor,
    point: &ContactPoint,
    X_WB: &Isometry3<f64>,
    start: &Start<'_>,
) -> (Row, bool) {
    let dt_s = start.dt_s;
    let arm = |body: usize, side: usize| {
        let arm_W = point.point_W - start.bodies[body].centre_W;
        // Material on an arm that turns moves along the chord: at right angles to the arm of the tick's middle. What rolls
        // touches with other material by then.
        let goes_along = anchor.is_same_material[side] && start.is_implicit;
        if goes_along { middle_W(&start.motions[body], dt_s) * arm_W } else { arm_W }
    };
    let (k, b) = (surfacing.stiffness_n_per_m, surfacing.damping_n_s_per_m);
    let gap_m = point.gap_m + anchor.granted_m;
    let n = point.normal_W;
    let mut row = Row {
        body,
        other,
        arms_W: [arm(body, 0), other.map_or(Vector3::zeros(), |other| arm(other, 1))],
        normal_W: n,
        rest_W: Vector3::zeros(),
        stiffness: [k; 2],
        damping: [b; 2],
        mu_hold: surfacing.friction.mu_hold,
        mu_slide: surfacing.friction.mu_slide,
        held: anchor.held(),
        force_W: anchor.force_W(X_WB),
        torsion: Torsion::default(),
        tie_n: None,
    };
    let rest_n = match surfacing.response {
        //= melder#6.2
        Response::Force if gap_m < 0.0 => -k * gap_m,
        // Of a force that is known when the tick begins nothing is damped before they meet.
        Response::Force if !start.is_implicit => {
            row.damping[0] = 0.0;
            -k * gap_m
        }
        // Only what is left of the tick when they meet is damped.
        Response::Force => {
            (row.stiffness[0], row.damping[0]) = (k + b / dt_s, 0.0);
            -row.stiffness[0] * gap_m
        }
        Response::Impulse { restitution } => {
            let stop = stop_n_s_per_m(&row, start);
            (row.stiffness, row.damping) = ([0.0, k], [stop, b]);
            let impact = Impact::of(&row, gap_m, restitution, anchor, start);
            if impact.is_one {
                // What an impulse gives across the normal lasts no longer than the impulse.
                row.stiffness[1] = stop / dt_s;
            }
            let wanted_m_s = match gap_m {
                _ if impact.bounce_m_s > 0.0 => impact.bounce_m_s,
                gap_m if gap_m < 0.0 => let_out_m_s(-gap_m, dt_s),
                _ => -gap_m / dt_s,
            };
            if impact.is_one {
                row.rest_W = n * (stop * wanted_m_s);
                return (row, true);
            }
            stop * wanted_m_s
        }
    };
    row.rest_W = n * rest_n - anchor.stretch_W(X_WB) * row.stiffness[1];
    (row, false)
}

/// How far a body turns in half a tick, if nothing touches it.
fn middle_W(motion: &Motion, dt_s: f64) -> UnitQuaternion<f64> {
    // Beyond a radian a chord is none.
    let turn_W = motion.angular_velocity_W * (0.5 * dt_s);
    UnitQuaternion::from_scaled_axis(if turn_W.norm_squared() < 0.25 { turn_W } else { Vector3::zeros() })
}

/// What a row's point does that meets the other in a tick.
struct Impact {
    is_one: bool,
    /// With which normal velocity it leaves the tick; 0 and below: it stays.
    bounce_m_s: f64,
}

impl Impact {
    /// The velocity that it leaves with is the reflected one of the beginning of the tick, less what gravity takes from it in
    /// the whole tick: so a ball that does not lose anything else loses `(g dt)^2 / 2` of energy per mass in each bounce, and never
    /// gains. What approaches no faster than gravity makes it in a tick rests, and a bounce that gravity would end
    /// within the tick is none. Nor is one that anything else ended so: a contact that closes in a tick in which it did not
    /// approach was pushed back before it got off, and rests.
    fn of(row: &Row, gap_m: f64, restitution: f64, anchor: &mut Anchor, start: &Start<'_>) -> Self {
        let along = |velocity_W: &Vector3<f64>| row.normal_W.dot(velocity_W);
        let (now_m_s, freely_m_s) = (along(&at_start(row, start)), along(&freely(row, start)));
        let falls_m_s = (freely_m_s - now_m_s).min(0.0);
        let approaches = now_m_s < falls_m_s;
        let was_pushed_back = anchor.is_pressed() && !anchor.approached;
        anchor.approached = approaches;
        let is_one = approaches && !was_pushed_back && gap_m < -freely_m_s * start.dt_s;
        //= melder#6.1
        Self { is_one, bounce_m_s: if is_one { restitution * -now_m_s + falls_m_s } else { 0.0 } }
    }
}

/// Velocity of A's point relative to B's when the tick begins.
fn at_start(row: &Row, start: &Start<'_>) -> Vector3<f64> {
    let at = |body: usize, arm_W: &Vector3<f64>| {
        let body = &start.bodies[body];
        body.velocity_W + body.angular_velocity_W().cross(arm_W)
    };
    at(row.body, &row.arms_W[0]) - row.other.map_or(Vector3::zeros(), |other| at(other, &row.arms_W[1]))
}

/// The same at its end, if nothing touched anything.
fn freely(row: &Row, start: &Start<'_>) -> Vector3<f64> {
    let at = |body: usize, arm_W: &Vector3<f64>| start.motions[body].at(arm_W);
    at(row.body, &row.arms_W[0]) - row.other.map_or(Vector3::zeros(), |other| at(other, &row.arms_W[1]))
}

/// A damping so large that velocities are what is wanted.
fn stop_n_s_per_m(row: &Row, start: &Start<'_>) -> f64 {
    let give = |body: usize, arm_W: &Vector3<f64>| {
        let motion = &start.motions[body];
        let turns_W = arm_W.cross(&row.normal_W);
        motion.inverse_mass + turns_W.dot(&(motion.inverse_inertia_W * turns_W))
    };
    let gives = give(row.body, &row.arms_W[0]) + row.other.map_or(0.0, |other| give(other, &row.arms_W[1]));
    // Nothing can be stopped that nothing moves.
    if gives > 0.0 { HARD / (gives * start.dt_s) } else { 0.0 }
}

/// How fast a depth that should not be there is let out.
fn let_out_m_s(depth_m: f64, dt_s: f64) -> f64 {
    (depth_m / LET_OUT_S.max(dt_s)).min(LET_OUT_M_S)
}

/// Contact points are looked for from this distance on \[m\].
pub(crate) const REACH_M: f64 = 1e-3;
/// A contact point of another name within this distance is the same one \[m\].
const NEAR_M: f64 = 2e-4;
/// A depth that should not be there falls by `e` in this time \[s\]. The body then slows down by less than gravity slows it,
/// for depths up to `g t^2`, 0.1 m: it follows, and does not hop.
const LET_OUT_S: f64 = 0.1;
/// And never faster than this \[m/s\].
const LET_OUT_M_S: f64 = 0.2;
/// How many times harder than what moves impulses stop: velocities are right to one part in so many, and solved for with as
/// many times the rounding.
const HARD: f64 = 1e6;
