//! Two entities that may touch: a body, and another body or what is fixed.
//!
//! Model: stiffnesses in series, dampings added, friction the geometric mean (each contact point is a spring of its own; a
//! face at rest on four points is four springs). The *force response* presses with the depth (Melder eq. 6.2, with damping
//! and without pulling); the *impulse response* reflects the approaching velocity (eq. 6.1, corrected).
//! A contact that is found deep at once (objects placed into each other) is let out slowly.

use haptics::Entity;
use nalgebra::{Isometry3, Vector3};

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
    anchors: [Anchor; MAX_POINTS],
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
    pub(crate) dt_s: f64,
}

impl Pair {
    pub(crate) fn new(entities: [usize; 2], bodies: (usize, Option<usize>), surfacing: Surfacing) -> Self {
        let anchors = [Anchor::default(); MAX_POINTS];
        Self {
            entities,
            bodies,
            surfacing,
            memory: PairMemory::default(),
            anchors,
            count: 0,
            first_row: 0,
            rows: 0,
        }
    }

    /// Finds where it touches, and appends a row for each point.
    pub(crate) fn gather(&mut self, start: &Start<'_>, rows: &mut Vec<Row>) {
        (self.first_row, self.rows) = (rows.len(), 0);
        let [a, b] = self.entities.map(|index| &start.entities[index]);
        let speed_m_s = self.closing_speed(start);
        let reach_m = REACH_M + speed_m_s * start.dt_s;
        if !is_near(a, b, reach_m) {
            self.count = 0;
            return;
        }
        let (in_A, in_B) = (Solid { shape: &a.shape, X_W: &a.X_WB }, Solid { shape: &b.shape, X_W: &b.X_WB });
        let mut found = ContactPoints::default();
        contact_points(in_A, in_B, reach_m, &mut self.memory, &mut found);
        self.carry(&found, &a.X_WB, &b.X_WB, reach_m, speed_m_s * start.dt_s);
        for (anchor, point) in self.anchors.iter_mut().zip(found.as_slice()) {
            if rows.len() == rows.capacity() {
                return;
            }
            anchor.granted_m =
                (anchor.granted_m - LET_OUT_M_S * start.dt_s).clamp(0.0, (-point.gap_m).max(0.0));
            rows.push(row(self.bodies, &self.surfacing, anchor, point, &b.X_WB, start));
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
        X_WA: &Isometry3<f64>,
        X_WB: &Isometry3<f64>,
        reach_m: f64,
        moved_m: f64,
    ) {
        let was = self.anchors;
        let mut is_free = [false; MAX_POINTS];
        is_free.iter_mut().take(self.count).for_each(|free| *free = true);
        let begins = self.count == 0;
        self.count = found.as_slice().len();
        let mut is_new = [false; MAX_POINTS];
        for (at, point) in found.as_slice().iter().enumerate() {
            let same = (0..MAX_POINTS).find(|&old| is_free[old] && was[old].id == point.id);
            is_new[at] = same.is_none();
            if let Some(old) = same {
                is_free[old] = false;
                self.anchors[at] = was[old];
                self.anchors[at].carry(point, X_WA, X_WB);
            }
        }
        for (at, point) in found.as_slice().iter().enumerate().filter(|(at, _)| is_new[*at]) {
            // The same contact under another name: it came from one face of a mesh to the next.
            let near_m = NEAR_M + 2.0 * moved_m;
            let is_near =
                |old: &usize| is_free[*old] && (was[*old].point_W(X_WB) - point.point_W).norm() < near_m;
            if let Some(old) = (0..MAX_POINTS).find(is_near) {
                is_free[old] = false;
                self.anchors[at] = was[old];
                self.anchors[at].carry(point, X_WA, X_WB);
                continue;
            }
            self.anchors[at] = Anchor::begin(point, X_WA, X_WB);
            if begins && -point.gap_m > reach_m {
                self.anchors[at].granted_m = -point.gap_m;
            }
        }
    }

    /// The most that A and B can come nearer to each other per time \[m/s\].
    fn closing_speed(&self, start: &Start<'_>) -> f64 {
        let speed = |body: usize, entity: usize| {
            let motion = &start.motions[body];
            let ball = bounding_ball(&start.entities[entity].shape).map_or(0.0, |(centre_B, radius_m)| {
                radius_m + (centre_B - start.bodies[body].mass.centre_B).norm()
            });
            motion.velocity_W.norm() + motion.angular_velocity_W.norm() * ball
        };
        let (a, b) = self.bodies;
        speed(a, self.entities[0]) + b.map_or(0.0, |b| speed(b, self.entities[1]))
    }
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
    anchor: &Anchor,
    point: &ContactPoint,
    X_WB: &Isometry3<f64>,
    start: &Start<'_>,
) -> Row {
    let arm = |body: usize| point.point_W - start.bodies[body].centre_W;
    let dt_s = start.dt_s;
    let (k, b) = (surfacing.stiffness_n_per_m, surfacing.damping_n_s_per_m);
    let gap_m = point.gap_m + anchor.granted_m;
    let n = point.normal_W;
    let mut row = Row {
        body,
        other,
        arms_W: [arm(body), other.map_or(Vector3::zeros(), arm)],
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
        // Only what is left of the tick when they meet is damped.
        Response::Force => {
            (row.stiffness[0], row.damping[0]) = (k + b / dt_s, 0.0);
            -row.stiffness[0] * gap_m
        }
        Response::Impulse { restitution } => {
            let stop = hard(&row, start);
            let approach_m_s = -n.dot(&relative(&row, start));
            // Slower than what gravity brings up in a few ticks, it rests.
            //= melder#6.1
            let bounce_m_s = if approach_m_s > SLOW_M_S && gap_m < approach_m_s * dt_s {
                restitution * approach_m_s
            } else {
                0.0
            };
            let wanted_m_s = if gap_m < 0.0 { -gap_m * CORRECTED / dt_s } else { -gap_m / dt_s };
            (row.stiffness, row.damping) = ([0.0, k], [stop, b]);
            stop * if bounce_m_s > 0.0 { bounce_m_s } else { wanted_m_s.min(LET_OUT_M_S) }
        }
    };
    row.rest_W = n * rest_n - anchor.stretch_W(X_WB) * row.stiffness[1];
    row
}

/// Velocity of A's point relative to B's when the tick begins.
fn relative(row: &Row, start: &Start<'_>) -> Vector3<f64> {
    let at = |body: usize, arm_W: &Vector3<f64>| {
        let body = &start.bodies[body];
        body.velocity_W + body.angular_velocity_W().cross(arm_W)
    };
    at(row.body, &row.arms_W[0]) - row.other.map_or(Vector3::zeros(), |other| at(other, &row.arms_W[1]))
}

/// A damping so large that velocities are what is wanted.
fn hard(row: &Row, start: &Start<'_>) -> f64 {
    let inverse = |body: usize| start.motions[body].inverse_mass;
    HARD / ((inverse(row.body) + row.other.map_or(0.0, inverse)) * start.dt_s)
}

/// Contact points are looked for from this distance on \[m\].
const REACH_M: f64 = 1e-3;
/// A contact point of another name within this distance is the same one \[m\].
const NEAR_M: f64 = 2e-4;
/// How fast a depth that was there from the start is let out \[m/s\].
const LET_OUT_M_S: f64 = 0.2;
/// Approaching slower than this, nothing bounces \[m/s\].
const SLOW_M_S: f64 = 0.02;
/// How much of a depth an impulse response takes back in a tick.
const CORRECTED: f64 = 0.2;
/// How many times harder than the bodies' masses impulses stop.
const HARD: f64 = 1e4;
