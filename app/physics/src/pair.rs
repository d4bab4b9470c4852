//! Two entities that may touch: a body, and another body or what is fixed.
//!
//! Model: each contact point is a spring of its own; a face at rest on four points is four springs ([`surfacing`],
//! [`pressed`]). A contact that is found deep at once (objects placed into each other) is let out slowly.

mod crossing;
mod ledger;
mod pressed;
mod surfacing;
mod turning;

use haptics::{Entity, Form, Shape};
use nalgebra::{Isometry3, Vector3};

use crate::anchor::Anchor;
use crate::body::Body;
use crate::broad_phase::Aabb;
use crate::collide::{
    ContactPoint, ContactPoints, MAX_POINTS, PairMemory, Patches, Places, Solid, bounding_ball,
    contact_points,
};
use crate::pairs::Who;
use crate::restitution::{Meeting, Stop, spin_W, velocity};
use crate::row::Row;
use crate::solver::Motion;
pub(crate) use crossing::{ANCHORS_AT_ONCE, Head};
use ledger::{Allowed, Ledger, MAX_SPRINGS, SPRINGS_OF_POINT, Stretched};
pub(crate) use pressed::HARD;
use pressed::row;
pub(crate) use pressed::{LET_OUT_M_S, let_out_m_s};
pub use surfacing::{Response, Surfacing};

/// A pair and its contact points.
#[derive(Debug, Clone)]
pub(crate) struct Pair {
    /// Of the entities: A's, which is a body, and B's.
    pub(crate) entities: [usize; 2],
    /// Places of the bodies in this tick; B may be fixed.
    pub(crate) bodies: (usize, Option<usize>),
    pub(crate) surfacing: Surfacing,
    memory: PairMemory,
    /// The memory holds anything.
    remembers: bool,
    /// One of them is a mesh: only then its places are looked at.
    has_mesh: bool,
    /// Those beyond the count are whatever was there. There is room for all, or of who has no deadlines for as many as there
    /// were so far.
    anchors: Box<[Anchor]>,
    count: usize,
    /// Nobody has looked yet whether it touches.
    is_new: bool,
    /// One of them was driven while the other one waited for its turn.
    was_pushed: bool,
    ledger: Ledger,
    /// Where its rows of this tick begin.
    first_row: usize,
    rows: usize,
}

/// What a tick's contact points are written to.
pub(crate) struct Gathered<'t> {
    pub(crate) rows: &'t mut Vec<Row>,
    /// The most rows that there may be then.
    pub(crate) most_rows: usize,
    /// Points that had no room.
    pub(crate) left_out: &'t mut u64,
    /// Those that may meet what they touch.
    pub(crate) meetings: &'t mut Vec<Meeting>,
    /// Room for a pair's anchors of the last tick.
    pub(crate) last: &'t mut [Anchor; MAX_POINTS],
}

/// The state that a tick begins with.
pub(crate) struct Start<'t> {
    pub(crate) entities: &'t [Entity],
    pub(crate) bodies: &'t [Body],
    /// As they are without contacts, at the end of the tick.
    pub(crate) motions: &'t [Motion],
    /// Part of that which the tick adds to what they were.
    pub(crate) changes: &'t [Motion],
    /// The most that any point of each moves per time \[m/s\].
    pub(crate) speeds_m_s: &'t [f64],
    /// The same if others strike it in the tick \[m/s\].
    pub(crate) struck_m_s: &'t [f64],
    pub(crate) dt_s: f64,
    /// Whether forces are those of the end of the tick.
    pub(crate) is_implicit: bool,
}

/// The state that it ends with.
pub(crate) struct End<'t> {
    pub(crate) rows: &'t [Row],
    pub(crate) motions: &'t [Motion],
    /// Where they were when it began.
    pub(crate) entities: &'t [Entity],
    pub(crate) dt_s: f64,
}

impl Pair {
    /// Room for all that a pair may have.
    pub(crate) fn with_room() -> Self {
        Self::of(vec![Anchor::default(); MAX_POINTS], PairMemory::default())
    }

    /// No room for points yet, which most pairs of boxes that only come near never have; it is allocated when it is needed.
    pub(crate) fn with_little_room() -> Self {
        let memory = PairMemory { patches: Places::later(), ..PairMemory::default() };
        Self::of(Vec::new(), memory)
    }

    fn of(anchors: Vec<Anchor>, memory: PairMemory) -> Self {
        Self {
            entities: [0; 2],
            bodies: (0, None),
            surfacing: Surfacing::default(),
            memory,
            remembers: false,
            has_mesh: false,
            anchors: anchors.into(),
            count: 0,
            is_new: false,
            was_pushed: false,
            ledger: Ledger::default(),
            first_row: 0,
            rows: 0,
        }
    }

    /// Room for so many points, of who has [little](Self::with_little_room).
    fn make_room(&mut self, points: usize) {
        if points > self.anchors.len() {
            let room = [FEW_POINTS, SOME_POINTS].into_iter().find(|&room| points <= room);
            let mut more = vec![Anchor::default(); room.unwrap_or(MAX_POINTS)];
            more[..self.anchors.len()].copy_from_slice(&self.anchors);
            self.anchors = more.into();
        }
    }

    /// Begins one that has not touched yet, in the place of one that has ended. What nobody reads of that stays. What they hold
    /// where they are is theirs if somebody has put one of them there.
    pub(crate) fn begin(
        &mut self,
        entities: [usize; 2],
        has_mesh: bool,
        surfacing: Surfacing,
        was_put: bool,
    ) {
        self.forget(has_mesh);
        (self.entities, self.surfacing, self.has_mesh) = (entities, surfacing, has_mesh);
        (self.bodies, self.is_new, self.was_pushed) = ((0, None), was_put, false);
    }

    fn forget(&mut self, has_mesh: bool) {
        (self.count, self.first_row, self.rows, self.remembers) = (0, 0, 0, false);
        self.ledger = Ledger::default();
        self.memory.words = Default::default();
        if has_mesh {
            *self.memory.patches = Patches::default();
        }
    }

    /// Looks again what the two surfaces are.
    pub(crate) fn resurface(&mut self, who: &Who<'_>) {
        let [a, b] = self.entities;
        self.surfacing = Surfacing::between(&who.all[a], &who.all[b], &who.contacts);
    }

    /// The force on A in the last tick \[N\], over all points.
    pub(crate) fn force_W(&self, rows: &[Row]) -> Vector3<f64> {
        self.rows(rows).iter().map(|row| row.force_W).sum()
    }

    /// Finds where it touches, and appends a row for each point; notes those that may meet what they touch. Says whether the
    /// two are near enough to touch.
    pub(crate) fn gather(&mut self, start: &Start<'_>, gathered: &mut Gathered<'_>) -> bool {
        let Gathered { rows, most_rows, left_out, meetings, last } = gathered;
        (self.first_row, self.rows) = (rows.len(), 0);
        let [a, b] = self.entities.map(|index| &start.entities[index]);
        let speed_m_s = self.closing_speed(start.speeds_m_s);
        let struck_m_s = self.closing_speed(start.struck_m_s);
        let reach_m = REACH_M + struck_m_s * start.dt_s;
        if !is_near(a, b, reach_m) {
            self.pass_by();
            // Somebody has looked: whoever is found deep from now on was not placed there.
            self.is_new = false;
            return false;
        }
        self.remembers = true;
        let (in_A, in_B) = (Solid { shape: &a.shape, X_W: &a.X_WB }, Solid { shape: &b.shape, X_W: &b.X_WB });
        self.memory.is_soft = self.surfacing.is_as_felt() && start.is_implicit;
        self.memory.is_b_fixed = self.bodies.1.is_none();
        let mut found = ContactPoints::default();
        contact_points(in_A, in_B, reach_m, &mut self.memory, &mut found);
        if rows.len() > *most_rows / 2 {
            // Where room is scarce it is for what may touch in this tick.
            found.forget_beyond(struck_m_s * start.dt_s);
        }
        let poses = [[&a.X_WB, &b.X_WB], [&a.previous_X_WB, &b.previous_X_WB]];
        let begins = self.count == 0;
        let deep = if self.surfacing.is_as_felt() {
            // Soft things may rest so deep.
            let presses_m = reach_m.max(self.throws_m(LET_OUT_M_S, start));
            Deep { from_m: presses_m, presses_m }
        } else {
            Deep { from_m: reach_m.min(self.surfacing.deepest_rest_m()), presses_m: 0.0 }
        };
        self.carry(&found, poses, deep, speed_m_s * start.dt_s, last);
        let pressed = self.anchors[..self.count].iter().filter(|anchor| anchor.is_pressed()).count();
        let (surfacing, is_soft) = (self.surfacing, self.memory.is_soft);
        let turning_m = move |point: &ContactPoint| turning::lengths_m(&surfacing, point, pressed, is_soft);
        for (anchor, point) in self.anchors.iter_mut().zip(found.as_slice()) {
            if turning_m(point) == [0.0; 2] {
                anchor.turn_back(0.0);
            }
        }
        // A contact that is not found for a tick may still be there: until then the account stays.
        if self.count > 0 {
            self.press(found.as_slice(), begins, start);
        }
        self.is_new = false;
        for (anchor, point) in self.anchors.iter_mut().zip(found.as_slice()) {
            if rows.len() >= *most_rows {
                **left_out += 1;
                continue;
            }
            let (mut row, stop_n_s_per_m) = row(self.bodies, &self.surfacing, anchor, point, &b.X_WB, start);
            let k = surfacing.stiffness_n_per_m;
            turning::resist(&mut row, turning_m(point), k, &anchor.turned_W(&b.X_WB), start);
            let response = self.surfacing.response;
            if let Some(restitution) = response.restitution() {
                let stop = Stop { n_s_per_m: stop_n_s_per_m, is_always: !response.has_springs() };
                meetings.push(Meeting::of((rows.len(), &row), stop, restitution, anchor, start));
            }
            rows.push(row);
            self.rows += 1;
        }
        true
    }

    /// How far each point's springs are stretched: as far as it is deep and was dragged, if that was worked for.
    fn press(&mut self, points: &[ContactPoint], begins: bool, start: &Start<'_>) {
        let k = self.surfacing.stiffness_n_per_m;
        let has_springs = self.surfacing.response.has_springs();
        let mut springs = [Stretched::default(); MAX_SPRINGS];
        let (mut full, mut is_let_out) = (0.0, false);
        let [pushing_m, squeezed_m] = [self.pushing_m(start), self.squeezed_m(start)];
        for (at, (anchor, point)) in self.anchors.iter_mut().zip(points).enumerate() {
            let depth_m = point.depth_m();
            let let_out_m = let_out_m_s(anchor.granted_m, start.dt_s) * start.dt_s;
            anchor.granted_m = (anchor.granted_m - let_out_m).clamp(0.0, depth_m);
            if self.ledger.lets_out() {
                // The account would pay for any depth: beyond what was worked springs lengthen slowly, and not far.
                let worked_m = anchor.worked_m();
                let pressed_m = worked_m.max((worked_m + let_out_m).min(pushing_m));
                anchor.granted_m = anchor.granted_m.max(depth_m - pressed_m);
            }
            if squeezed_m.is_finite() {
                let is_carried = !comes_nearer(self.bodies.1, point, start);
                let squeezed_m =
                    if is_carried { squeezed_m.max(CARRIED * anchor.pressed_m) } else { squeezed_m };
                anchor.granted_m = anchor.granted_m.max(depth_m - squeezed_m);
            }
            is_let_out |= anchor.granted_m > 0.0;
            anchor.pressed_m = if point.gap_m < 0.0 { depth_m - anchor.granted_m } else { -point.gap_m };
            anchor.share = point.share;
            let first = SPRINGS_OF_POINT * at;
            let [dragged, turned] = [anchor.stretch_squared(), anchor.turned_squared()];
            springs[first + 1] = Stretched { found: dragged, worked: anchor.worked[1] };
            springs[first + 2] = Stretched { found: turned, worked: anchor.worked[2] };
            full += dragged + turned;
            if has_springs {
                let found = point.share * anchor.pressed_m.max(0.0).powi(2);
                springs[first] = Stretched { found, worked: anchor.worked[0] };
                full += point.share * depth_m * depth_m;
            }
        }
        let full_j = 0.5 * k * full;
        // Whoever is found deep later was not placed there: nobody has paid for that, or will be paid.
        if begins && self.ledger.is_closed() && self.is_new {
            self.ledger = Ledger::of(full_j, is_let_out);
        }
        if std::mem::take(&mut self.was_pushed) {
            self.ledger.refund(full_j);
        }
        self.ledger.cut(full_j, is_let_out);
        let springs = &springs[..SPRINGS_OF_POINT * points.len().min(MAX_POINTS)];
        let allowed = self.ledger.allow(springs, k, is_let_out);
        if allowed == Allowed::Everything || !start.is_implicit {
            return;
        }
        for (anchor, springs) in self.anchors.iter_mut().zip(springs.chunks_exact(SPRINGS_OF_POINT)) {
            if has_springs && anchor.pressed_m > 0.0 {
                anchor.pressed_m *= (allowed.of(&springs[0]) / springs[0].found).sqrt().min(1.0);
            }
            anchor.slacken(allowed.of(&springs[1]));
            if springs[2].found > 0.0 {
                anchor.turn_back((allowed.of(&springs[2]) / springs[2].found).sqrt().min(1.0));
            }
        }
    }

    /// Depth up to which springs are pressed that let something out \[m\]: it is no faster then when they throw it, and the
    /// heaviest rests less deep.
    fn pushing_m(&self, start: &Start<'_>) -> f64 {
        self.throws_m(LET_OUT_M_S, start).max(self.surfacing.deepest_rest_m().min(REACH_M))
    }

    /// Depth up to which what is driven presses where it comes nearer \[m\]: it would squeeze things by any force, and they would be
    /// shot out. It goes through what does not give way.
    fn squeezed_m(&self, start: &Start<'_>) -> f64 {
        let is_driven = self
            .bodies
            .1
            .is_some_and(|b| start.motions[b].inverse_mass == 0.0 && !start.motions[b].is_still());
        if is_driven {
            self.throws_m(SQUEEZED_M_S, start).max(self.surfacing.deepest_rest_m())
        } else {
            f64::INFINITY
        }
    }

    /// Depth from which a spring throws what it presses at this speed \[m\].
    fn throws_m(&self, speed_m_s: f64, start: &Start<'_>) -> f64 {
        let (a, b) = self.bodies;
        let per_kg = start.motions[a].inverse_mass + b.map_or(0.0, |b| start.motions[b].inverse_mass);
        speed_m_s / (self.surfacing.stiffness_n_per_m * per_kg).sqrt()
    }

    /// Somebody has put one of them where it is: what they held is gone, what they hold there is theirs.
    pub(crate) fn was_put(&mut self) {
        self.pass_by();
        self.is_new = true;
    }

    /// Takes note that one was driven nearer while the other one waited for its turn: who drives it has worked for that.
    pub(crate) fn was_pushed(&mut self) {
        self.was_pushed = true;
    }

    /// True if it had rows in the last tick.
    pub(crate) fn touches(&self) -> bool {
        self.rows > 0
    }

    /// Its rows of the last tick.
    pub(crate) fn rows<'r>(&self, rows: &'r [Row]) -> &'r [Row] {
        rows.get(self.first_row..self.first_row + self.rows).unwrap_or_default()
    }

    /// What its springs may hold \[J\]; negative: what has to be paid back first.
    pub(crate) fn elastic_energy_j(&self) -> f64 {
        self.ledger.held_j()
    }

    /// They do not touch in this tick.
    pub(crate) fn pass_by(&mut self) {
        (self.count, self.rows) = (0, 0);
        self.ledger = Ledger::default();
        // They may meet again from another side.
        if std::mem::take(&mut self.remembers) {
            self.memory.words = Default::default();
            if self.has_mesh {
                *self.memory.patches = Patches::default();
            }
        }
    }

    /// Pays what a body owes out of what its springs hold; says what is left of that (J).
    pub(crate) fn pay(&mut self, owed_j: f64) -> f64 {
        self.ledger.pay(owed_j)
    }

    /// Part of a row's force that is a spring's: along the normal impulses are no springs', and those of an impact not across it either.
    fn of_spring_W(&self, row: &Row) -> Vector3<f64> {
        let is_spring = row.stiffness[1] == self.surfacing.stiffness_n_per_m;
        match (is_spring, self.surfacing.response.has_springs()) {
            (true, true) => row.force_W,
            (true, false) => row.force_W - row.normal_W * row.normal_W.dot(&row.force_W),
            (false, _) => Vector3::zeros(),
        }
    }

    /// Work of its impulses, by the velocities that they left (J), negative: taken from the bodies; and a body of it that moves.
    pub(crate) fn impulses_j(&self, end: &End<'_>) -> Option<(usize, f64)> {
        // Without rows its places are of another tick.
        if self.rows == 0 || self.surfacing.response.restitution().is_none() {
            return None;
        }
        let body = self.moving(end).into_iter().flatten().next()?;
        let put_in_w = |row: &Row| (row.force_W - self.of_spring_W(row)).dot(&velocity(row, end.motions));
        Some((body, self.rows(end.rows).iter().map(put_in_w).sum::<f64>() * end.dt_s))
    }

    /// Those of its bodies that anything moves.
    fn moving(&self, end: &End<'_>) -> [Option<usize>; 2] {
        [Some(self.bodies.0), self.bodies.1].map(|body| body.filter(|&body| end.motions[body].is_movable()))
    }

    /// Takes note of how the tick ended, and of which rows met in it after it had begun. `spare_j`: of each body what the tick itself
    /// took from it (J), negative: what it owes; a pair that can use it takes it.
    pub(crate) fn settle(&mut self, end: &End<'_>, has_met: impl Fn(usize) -> bool, spare_j: &mut [f64]) {
        if self.rows == 0 {
            return;
        }
        let X_WB = &end.entities[self.entities[1]].X_WB;
        let own = end.rows.iter().enumerate().skip(self.first_row).take(self.rows);
        let (mut presses, mut worked_j) = (false, 0.0);
        let stiffness_n_per_m = self.surfacing.stiffness_n_per_m;
        for (anchor, (at, row)) in self.anchors.iter_mut().zip(own) {
            anchor.approached |= has_met(at);
            let velocity_W = velocity(row, end.motions);
            if row.stiffness[1] != stiffness_n_per_m {
                // An impact lets go of what friction had stretched.
                anchor.release();
            }
            anchor.settle(row, &(velocity_W * end.dt_s), X_WB);
            turning::settle(row, anchor, &(spin_W(row, end.motions) * end.dt_s), X_WB);
        }
        for row in self.rows(end.rows) {
            let force_W = self.of_spring_W(row);
            presses |= force_W != Vector3::zeros();
            worked_j += force_W.dot(&velocity(row, end.motions)) * end.dt_s;
            worked_j += row.torque_W().dot(&spin_W(row, end.motions)) * end.dt_s;
        }
        self.ledger.enter(worked_j);
        // Of pairs without a mesh that is whatever was there.
        if self.has_mesh && self.memory.patches.spread.is_crowded() {
            let squares = self.anchors[..self.rows].iter().map(|anchor| anchor.worked.iter().sum::<f64>());
            self.ledger.lose_beyond(0.5 * stiffness_n_per_m * squares.sum::<f64>());
        }
        if presses && self.ledger.owes() {
            for body in self.moving(end).into_iter().flatten() {
                let refunded_j = spare_j[body].max(0.0);
                spare_j[body] -= refunded_j;
                self.ledger.refund(refunded_j);
            }
        }
        let debt_j = self.ledger.take_debt();
        if let Some(body) = self.moving(end).into_iter().flatten().next() {
            spare_j[body] -= debt_j;
        }
    }

    /// The anchors of the points that were found, in their order: those of the last tick where they go on.
    fn carry(
        &mut self,
        found: &ContactPoints,
        [now, last]: [[&Isometry3<f64>; 2]; 2],
        deep: Deep,
        moved_m: f64,
        last_anchors: &mut [Anchor; MAX_POINTS],
    ) {
        let was = &mut last_anchors[..self.count];
        was.copy_from_slice(&self.anchors[..self.count]);
        let mut is_free = [false; MAX_POINTS];
        is_free.iter_mut().take(self.count).for_each(|free| *free = true);
        let begins = self.count == 0;
        self.count = found.as_slice().len();
        self.make_room(self.count);
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
            if begins && self.ledger.is_closed() && point.depth_m() > deep.from_m {
                self.anchors[at].granted_m = point.depth_m() - deep.presses_m;
            }
        }
    }

    /// The most that A and B can come nearer to each other per time if they are as fast as that \[m/s\].
    fn closing_speed(&self, speeds_m_s: &[f64]) -> f64 {
        let (a, b) = self.bodies;
        speeds_m_s[a] + b.map_or(0.0, |b| speeds_m_s[b])
    }
}

/// A depth in which a contact may be found at once \[m\].
#[derive(Debug, Clone, Copy)]
struct Deep {
    /// From which on it is let out slowly.
    from_m: f64,
    /// Part of it that presses at once.
    presses_m: f64,
}

/// The most that any point of a body moves per time \[m/s\].
pub(crate) fn fastest_point_m_s(entity: &Entity, body: &Body, motion: &Motion) -> f64 {
    let farthest_m = bounding_ball(&entity.shape)
        .map_or(0.0, |(centre_B, radius_m)| radius_m + (centre_B - body.mass.centre_B).norm());
    motion.velocity_W.norm() + motion.angular_velocity_W.norm() * farthest_m
}

/// Whether two entities may touch that come nearer by no more than this (m).
pub(crate) fn is_near(a: &Entity, b: &Entity, reach_m: f64) -> bool {
    let centre = |entity: &Entity, at_B: Vector3<f64>| (entity.X_WB * nalgebra::Point3::from(at_B)).coords;
    let do_balls_meet = match (bounding_ball(&a.shape), bounding_ball(&b.shape)) {
        (Some((at_a, r_a)), Some((at_b, r_b))) => {
            (centre(a, at_a) - centre(b, at_b)).norm_squared() <= (r_a + r_b + reach_m).powi(2)
        }
        (Some((at_a, r_a)), None) => {
            let Shape::Form(Form::Plane(plane)) = &b.shape else { return true };
            let at_B = b.X_WB.inverse_transform_point(&centre(a, at_a).into()).coords;
            return plane.normal_B().dot(&at_B) - plane.offset_m() <= r_a + reach_m;
        }
        _ => return true,
    };
    // Boxes side by side on a shelf are in each other's balls long before they touch.
    do_balls_meet
        && match (Aabb::of_entity(a), Aabb::of_entity(b)) {
            (Some(one), Some(other)) => one.grown(reach_m).overlaps(&other),
            _ => true,
        }
}

/// True where the second one moves into the first. Where it slides along, what it carries presses as deep as it did.
fn comes_nearer(second: Option<usize>, point: &ContactPoint, start: &Start<'_>) -> bool {
    second.is_some_and(|b| {
        let motion = &start.motions[b];
        let arm_W = point.point_W - start.bodies[b].centre_W;
        let velocity_W = motion.velocity_W + motion.angular_velocity_W.cross(&arm_W);
        velocity_W.dot(&point.normal_W) > ALONG * velocity_W.norm()
    })
}

/// Speed at which things come out at most that something driven squeezes \[m/s\].
const SQUEEZED_M_S: f64 = 1.0;
/// So much deeper in a tick may press what is carried along.
const CARRIED: f64 = 1.02;
/// Sine of a way along a face that comes no nearer.
const ALONG: f64 = 1e-3;
/// Contact points of a pair that has little room: a face at rest has so many, and two forms no more than twice that, but for
/// rings.
const FEW_POINTS: usize = 4;
const SOME_POINTS: usize = 8;
/// Contact points are looked for from this distance on \[m\].
pub(crate) const REACH_M: f64 = 1e-3;
/// A contact point of another name within this distance is the same one \[m\].
const NEAR_M: f64 = 2e-4;
