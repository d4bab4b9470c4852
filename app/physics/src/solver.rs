//! What all contact points do at the end of the tick, together.
//!
//! Problem: with springs as stiff as fingers want them and bodies as light as a gram, forces that belong to the beginning
//! of a tick throw the body farther than the springs are long; the next tick throws it back (explicit integration fails
//! from `k dt^2 / m` = 4 on). And what lifts the lowest of a stack lifts all of it within the tick (Melder ch. 6.1.3).
//!
//! Model: each [`Row`]'s force is that of the end of the tick, `project(rest - (k dt + b) u)`, where `u` is the velocity
//! that all forces of the tick leave its point with. Bodies that press each other are an island ([`island`]): six unknowns a
//! body, whatever the number of its contact points, and they are found together by Newton's method ([`newton`]). Islands of more
//! than [`blocks::MAX_BODIES`], or that are more entangled than a tick has time for, are found body by body in turns ([`together`]).
//! Warm: all begin with the forces of the last tick, or with its velocities if these are nearer.
//!
//! Invariant: velocities and forces belong together to rounding, however many turns were made: what the bodies got is the
//! sum of the rows' forces. Where stiction breaks, that row slides for the rest of the tick. Rows that are not made of
//! numbers press nothing.
//! Cost: rows times rounds, at most [`MAX_SWEEPS`] an island, 1 to 5 in the common case; none for what rests.

mod blocks;
mod equations;
mod hold;
mod island;
mod link;
mod motion;
mod newton;
mod relax;
mod six;
mod together;

use nalgebra::Vector3;

use crate::row::{Held, Row};
pub use island::Islands;
pub use motion::Motion;
use newton::Newton;

/// The most rounds over all rows of an island in a tick.
pub const MAX_SWEEPS: usize = 120;

/// How well the forces of a tick were found.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Solved {
    /// Rounds made: of the island that took most.
    pub sweeps: usize,
    /// What is left of the equations, as a share of all forces by their kinetic energy; of the island where it is largest.
    pub residual: f64,
    /// Islands for which no answer was found; theirs is one that contacts can give.
    pub unsolved: usize,
}

impl Solved {
    /// With what was found elsewhere in the same tick.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            sweeps: self.sweeps.max(other.sweeps),
            residual: self.residual.max(other.residual),
            unsolved: self.unsolved + other.unsolved,
        }
    }
}

/// Room for what is worked out once per tick.
#[derive(Debug, Clone, Default)]
pub struct Solver {
    room: [usize; 2],
    islands: Islands,
    /// Numbers of rows: those of each island, then the unsound ones.
    order: Vec<usize>,
    /// Of each row, its island; of an unsound one, their number.
    homes: Vec<usize>,
    /// Where the rows of each island begin in `order`.
    starts: Vec<usize>,
    /// Of each body, its place in its island.
    places: Vec<usize>,
    /// Of each body, whether it is made of numbers.
    are_finite: Vec<bool>,
    newton: Newton,
    together: together::Room,
}

impl Solver {
    /// Room for so many rows and bodies.
    pub fn with_capacity(rows: usize, bodies: usize) -> Self {
        Self {
            room: [rows, bodies],
            islands: Islands::with_capacity(bodies),
            order: Vec::with_capacity(rows),
            homes: Vec::with_capacity(rows),
            starts: Vec::with_capacity(bodies + 2),
            places: Vec::with_capacity(bodies),
            are_finite: Vec::with_capacity(bodies),
            newton: Newton::with_capacity(rows, bodies),
            together: together::Room::with_capacity(rows),
        }
    }

    /// Takes so many rows from now on, for which it may allocate.
    pub(crate) fn make_room_for(&mut self, rows: usize) {
        self.room[0] = self.room[0].max(rows);
    }

    /// Tells what velocity gravity has given to all bodies in the tick to come \[m/s\]: what rests,
    /// or goes on as it did, is found sooner.
    pub(crate) fn expect(&mut self, fall_W: &Vector3<f64>) {
        self.newton.fall_W = *fall_W;
    }

    /// The islands of the last tick that was solved.
    pub fn islands(&self) -> &Islands {
        &self.islands
    }

    /// Finds which bodies these rows join.
    pub(crate) fn find_islands(&mut self, rows: &[Row], motions: &[Motion]) -> &Islands {
        let _ = self.islands.of(rows, motions);
        &self.islands
    }

    /// Changes the rows' forces to those of the end of the tick, and the motions to what these leave.
    ///
    /// `motions` come in as they were without any row, `force_W` of the rows as a guess. Rows beyond the room are left out:
    /// their force is zero.
    pub fn solve(&mut self, rows: &mut [Row], motions: &mut [Motion], dt_s: f64) -> Solved {
        let (rows, beyond) = rows.split_at_mut(self.room[0].min(rows.len()));
        let bodies = self.room[1].min(motions.len());
        let motions = &mut motions[..bodies];
        beyond.iter_mut().for_each(Row::silence);
        self.sort(rows, motions);
        let Self { islands, order, starts, places, newton, together, .. } = self;
        let mut solved = Solved::default();
        for (number, bodies) in islands.iter().enumerate() {
            let which = &order[starts[number]..starts[number + 1]];
            let of_island = match bodies {
                _ if which.is_empty() => continue,
                [body] if is_alone(rows, which, motions) => {
                    newton.solve_alone(rows, which, &mut motions[*body], dt_s)
                }
                _ => {
                    let place = |body: usize| (islands.island_of(body) == Some(number)).then(|| places[body]);
                    newton
                        .solve_together(rows, which, (bodies, place), motions, dt_s)
                        .unwrap_or_else(|| together::solve(together, newton, which, rows, motions, dt_s))
                }
            };
            solved = solved.and(of_island);
        }
        order[starts[islands.iter().len()]..].iter().for_each(|&at| rows[at].silence());
        solved
    }

    /// Which rows are to be solved together: sorted by counting, which is stable and without a heap.
    fn sort(&mut self, rows: &[Row], motions: &[Motion]) {
        let islands = self.islands.of(rows, motions).len();
        self.places.clear();
        self.places.resize(motions.len(), 0);
        for bodies in self.islands.iter() {
            bodies.iter().enumerate().for_each(|(place, &body)| self.places[body] = place);
        }
        self.homes.clear();
        self.are_finite.clear();
        self.are_finite.extend(motions.iter().map(Motion::is_finite));
        let home = |row: &Row| {
            let home = is_sound(row, &self.are_finite).then(|| home(row, motions, &self.islands));
            home.flatten().unwrap_or(islands)
        };
        self.homes.extend(rows.iter().map(home));
        self.starts.clear();
        self.starts.resize(islands + 2, 0);
        self.homes.iter().for_each(|&home| self.starts[home + 1] += 1);
        (1..islands + 2).for_each(|at| self.starts[at] += self.starts[at - 1]);
        self.order.clear();
        self.order.resize(rows.len(), 0);
        for (at, &home) in self.homes.iter().enumerate() {
            let next = &mut self.starts[home];
            self.order[*next] = at;
            *next += 1;
        }
        // Each has moved to where the next one began.
        self.starts.rotate_right(1);
        self.starts[0] = 0;
    }
}

/// The island of a row: that of a body which it moves.
fn home(row: &Row, motions: &[Motion], islands: &Islands) -> Option<usize> {
    let is_movable = |body: &usize| motions[*body].is_movable();
    let moved_other = row.other.filter(is_movable);
    islands.island_of(if is_movable(&row.body) { row.body } else { moved_other.unwrap_or(row.body) })
}

/// Whether these rows are all between their body and what stands still.
fn is_alone(rows: &[Row], which: &[usize], motions: &[Motion]) -> bool {
    let first = rows[which[0]].body;
    let stands = |other: usize| motions[other].is_still() && !motions[other].is_movable();
    which.iter().all(|&at| rows[at].body == first && rows[at].other.is_none_or(stands))
}

/// Whether bodies and numbers of a row exist.
fn is_sound(row: &Row, are_finite: &[bool]) -> bool {
    let exists = |body: usize| are_finite.get(body) == Some(&true);
    exists(row.body) && row.other.is_none_or(|other| other != row.body && exists(other)) && row.is_finite()
}

/// Where stiction is at its limit it breaks; says whether sliding takes another force than holding did.
fn lets_slip(row: &mut Row) -> bool {
    let breaks = row.held == Held::Stick && row.tie_n.is_none() && is_at_the_rim(row, row.mu_hold);
    if breaks {
        row.held = Held::Slip;
    }
    breaks && (row.mu_slide < row.mu_hold || row.damping[1] > 0.0)
}

/// Whether the tangential force is all that this ratio allows.
fn is_at_the_rim(row: &Row, mu: f64) -> bool {
    let normal_n = row.normal_W.dot(&row.force_W);
    let across_n = (row.force_W - row.normal_W * normal_n).norm();
    normal_n > 0.0 && across_n >= mu * normal_n * (1.0 - RIM)
}

/// Roundings of a force.
const RIM: f64 = 1e-9;
