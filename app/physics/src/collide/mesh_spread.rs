//! All vertices of a mesh that lie low over a plane, as no more contact points than a pair may have.
//!
//! Problem: a soft contact holds energy in its springs. Where a few vertices stand for many, what they hold changes whenever
//! others take their places, and what is round is rocked and rolled by that for ever.
//! Model: each vertex that touches is a spring, `V = k / 2 sum d_i^2`. Up to [`MAX_POINTS`] of them within reach each is a contact
//! point. More are grouped, each with the nearest of so many that were chosen far from each other: a group presses at the
//! middle of its load, as deep and as hard as has the force and the energy of all of it. So both, and the torque, are those
//! of all vertices, whoever was chosen.
//! Of more than [`MOST_VERTICES`] within reach only every second one counts, or every fourth, and so on: of each its number
//! says whether it does, wherever the mesh stands.
//! Identity: a chosen one stays chosen while it is within reach; how many count changes only where they are too many or few.
//! Cost: a query, and a distance for each vertex and chosen one: tens of microseconds, of thousands of vertices up to
//! some hundreds. Where there are more than it has
//! room for, they are looked at again after a while.

use nalgebra::Vector3;

use super::MAX_POINTS;
use super::mesh::Contact;
use super::mesh_corner::Corner;
use super::mesh_span::Standing;

/// Memory from tick to tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Spread {
    /// Names of the contacts of vertices that were chosen; 0: none.
    chosen: [u32; MAX_POINTS],
    /// Number of times that every second one was left out.
    halvings: u32,
    /// A few stand for all, for there are too many.
    is_crowded: bool,
    /// Ticks until they are counted again.
    waits: u32,
}

impl Spread {
    /// True if a few vertices stand for many that press softly.
    pub(crate) fn is_crowded(&self) -> bool {
        self.is_crowded
    }

    /// Takes note that others than vertices touch, too, or that a few vertices stand for all.
    pub(super) fn set_crowded(&mut self, is_crowded: bool) {
        self.is_crowded = is_crowded;
    }
}

/// A vertex within reach, as what it touches sees it.
#[derive(Debug, Clone, Copy, Default)]
struct Low {
    contact: Contact,
    /// Nearest of those that were chosen, and the distance to it, squared \[m^2\].
    group: usize,
    apart_m2: f64,
}

/// Vertices within reach, and which of them were chosen.
pub(super) struct Lows {
    all: [Low; MOST_VERTICES],
    count: usize,
    chosen: [u32; MAX_POINTS],
    groups: usize,
    /// Number of times that every second one is left out.
    halvings: u32,
}

/// Tells no more contact points than there is room for, for all vertices that `find` finds; `false`: they are too many, and none
/// is told.
pub(super) fn tell(
    memory: &mut Spread,
    room: usize,
    find: impl Fn(&mut Lows) -> bool,
    mut tell: impl FnMut(&Contact),
) -> bool {
    if memory.waits > 0 {
        memory.waits -= 1;
        return false;
    }
    let mut lows = Lows {
        all: [Low::default(); MOST_VERTICES],
        count: 0,
        chosen: [0; MAX_POINTS],
        groups: 0,
        halvings: memory.halvings,
    };
    while !find(&mut lows) {
        if lows.halvings == MOST_HALVINGS {
            (memory.halvings, memory.is_crowded, memory.waits) = (MOST_HALVINGS, true, WAITS);
            return false;
        }
        (lows.count, lows.halvings) = (0, lows.halvings + 1);
    }
    // Where there are few, more count from the next tick on.
    let are_few = lows.count < FEW_VERTICES;
    memory.halvings = lows.halvings.saturating_sub(u32::from(are_few));
    memory.is_crowded = false;
    if lows.count <= room {
        lows.all[..lows.count].iter().for_each(|low| tell(&low.contact));
        memory.chosen = lows.chosen;
        return true;
    }
    lows.choose(&memory.chosen, room);
    memory.chosen = lows.chosen;
    (0..lows.groups).for_each(|group| tell(&lows.contact(group)));
    true
}

/// Vertices that were seen, plus one, each at the first free place from that of its number on.
struct Seen {
    names: [u32; SEEN],
}

/// A number whose low bits are those of no neighbour.
fn scattered(number: u32) -> u32 {
    let product = number.wrapping_mul(SCATTER);
    product ^ product >> 16
}

impl Seen {
    /// Takes note of a vertex; `false`: it was seen before.
    fn is_new(&mut self, number: u32) -> bool {
        let first = scattered(number) as usize;
        for step in 0..SEEN {
            let name = &mut self.names[(first + step) % SEEN];
            if *name == 0 {
                *name = number + 1;
                return true;
            }
            if *name == number + 1 {
                return false;
            }
        }
        false
    }
}

impl Lows {
    /// Adds all of a mesh within reach of which a corner counts, as `see` sees them; `false`: there is no room for them.
    pub(super) fn find(
        &mut self,
        standing: &Standing<'_>,
        counts: impl Fn(Corner) -> bool,
        mut see: impl FnMut(Corner) -> Option<Contact>,
    ) -> bool {
        let mesh = standing.mesh;
        let (all, count, halvings) = (&mut self.all, &mut self.count, self.halvings);
        let (mut seen, mut looks) = (Seen { names: [0; SEEN] }, 0);
        let add = |corner: Corner| {
            let number = corner.vertex(mesh);
            let is_left_out = !scattered(number).is_multiple_of(1 << halvings);
            if is_left_out || !counts(corner) || !seen.is_new(number) {
                return true;
            }
            looks += 1;
            let Some(contact) = see(corner) else { return looks < MOST_LOOKS };
            let Some(place) = all.get_mut(*count) else { return false };
            *place = Low { contact, group: 0, apart_m2: f64::INFINITY };
            *count += 1;
            true
        };
        standing.for_each_low(add, MOST_VISITS)
    }

    /// Chooses those of the last tick that are there, and then the one that is farthest from all that are chosen, again and again.
    fn choose(&mut self, last: &[u32; MAX_POINTS], room: usize) {
        for &name in last.iter().filter(|&&name| name != 0) {
            let place = self.all[..self.count].iter().position(|low| low.contact.id == name);
            if let Some(at) = place.filter(|_| self.groups < room) {
                self.take(at);
            }
        }
        if self.groups == 0 {
            self.take(0);
        }
        while self.groups < room {
            let apart = |at: &usize| self.all[*at].apart_m2;
            let farthest = (0..self.count).max_by(|a, b| apart(a).total_cmp(&apart(b)));
            let Some(farthest) = farthest.filter(|at| apart(at) > 0.0) else { break };
            self.take(farthest);
        }
    }

    fn take(&mut self, at: usize) {
        let group = self.groups;
        let Contact { id, on_mesh_M, .. } = self.all[at].contact;
        self.chosen[group] = id;
        self.groups += 1;
        for low in &mut self.all[..self.count] {
            let apart_m2 = (low.contact.on_mesh_M - on_mesh_M).norm_squared();
            if apart_m2 < low.apart_m2 {
                (low.group, low.apart_m2) = (group, apart_m2);
            }
        }
    }

    /// The contact point of a group: where nothing of it touches, the lowest.
    fn contact(&self, group: usize) -> Contact {
        let own = || self.all[..self.count].iter().filter(|low| low.group == group).map(|low| &low.contact);
        let (mut deep_m, mut deep_m2, mut rolls_m) = (0.0, 0.0, 0.0);
        let (mut at_M, mut normal_M) = (Vector3::zeros(), Vector3::zeros());
        for low in own().filter(|low| low.gap_m < 0.0) {
            deep_m -= low.gap_m;
            deep_m2 += low.gap_m * low.gap_m;
            rolls_m -= low.gap_m * low.rolls;
            at_M -= low.on_mesh_M * low.gap_m;
            normal_M -= low.normal_M * low.gap_m;
        }
        let force_m = normal_M.norm();
        let id = self.chosen[group];
        if deep_m2 == 0.0 || force_m < LEAST_FORCE * deep_m {
            let lowest = own().min_by(|a, b| a.gap_m.total_cmp(&b.gap_m));
            // A chosen one is its group's.
            return Contact { id, ..lowest.copied().unwrap_or_default() };
        }
        // So the springs' force is the sum of all, and so is what they hold.
        let (on_mesh_M, normal_M) = (at_M / deep_m, normal_M / force_m);
        let on_other_M = on_mesh_M - normal_M * (deep_m2 / force_m);
        let share = force_m * force_m / deep_m2;
        let rolls = rolls_m / deep_m;
        Contact { id, on_mesh_M, on_other_M, normal_M, gap_m: -force_m, share, rolls, carried: false }
    }
}

/// The most within reach of which all count.
pub(super) const MOST_VERTICES: usize = 256;
/// Ticks for which there are too many, once there were.
const WAITS: u32 = 31;
/// Number below which twice as many count, if there are.
const FEW_VERTICES: usize = 96;
/// A sixteenth is left then.
const MOST_HALVINGS: u32 = 4;
/// Room for so many, three quarters of it empty.
const SEEN: usize = 4 * MOST_VERTICES;
/// Odd, and nearest to the golden section of all numbers.
const SCATTER: u32 = 2_654_435_769;
/// Sum of what a group presses, of its parts': less is none, for these press against each other.
const LEAST_FORCE: f64 = 0.1;
/// Vertices that are looked at, whether they are within reach or not.
const MOST_LOOKS: usize = 2 * MOST_VERTICES;
/// Bound on the nodes of the hierarchy and the runs of faces that are looked at. With a fourth, few stood for all of a can of a thousand
/// sides, and it rocked. Balls of a hundred thousand triangles without rolling friction sway for longer
/// than with a fourth.
const MOST_VISITS: usize = 8192;
