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
//! Cost: a query, and a distance for each vertex and chosen one: up to some tens of microseconds. Where there are more than it has
//! room for, they are looked at again after a while.

use nalgebra::Vector3;

use super::MAX_POINTS;
use super::mesh::{About, Contact};
use super::mesh_corner::Corner;
use super::mesh_span::Standing;

/// Memory from tick to tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Spread {
    /// Vertices that were chosen, plus one; 0: none.
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
}

/// A vertex within reach.
#[derive(Debug, Clone, Copy, Default)]
struct Low {
    number: u32,
    at_M: Vector3<f64>,
    gap_m: f64,
    /// Nearest of those that were chosen, and the distance to it, squared \[m^2\].
    group: usize,
    apart_m2: f64,
}

/// Vertices within reach, and which of them were chosen.
struct Lows {
    all: [Low; MOST_VERTICES],
    count: usize,
    chosen: [u32; MAX_POINTS],
    groups: usize,
}

/// Tells contact points for all vertices within reach of what they stand on, which is `normal_M` from them; `false`: they are too
/// many, and none is told.
pub(super) fn tell(
    standing: &Standing<'_>,
    normal_M: &Vector3<f64>,
    memory: &mut Spread,
    mut tell: impl FnMut(&Contact),
) -> bool {
    if memory.waits > 0 {
        memory.waits -= 1;
        return false;
    }
    let mut lows =
        Lows { all: [Low::default(); MOST_VERTICES], count: 0, chosen: [0; MAX_POINTS], groups: 0 };
    while !lows.find(standing, memory.halvings) {
        if memory.halvings == MOST_HALVINGS {
            (memory.is_crowded, memory.waits) = (true, WAITS);
            return false;
        }
        memory.halvings += 1;
    }
    memory.is_crowded = false;
    if lows.count < FEW_VERTICES {
        // From the next tick on.
        memory.halvings = memory.halvings.saturating_sub(1);
    }
    if lows.count <= MAX_POINTS {
        for low in &lows.all[..lows.count] {
            tell(&Contact::new(About::Vertex(low.number), low.at_M, *normal_M, low.gap_m));
        }
        memory.chosen = lows.chosen;
        return true;
    }
    lows.choose(&memory.chosen);
    memory.chosen = lows.chosen;
    for group in 0..lows.groups {
        tell(&lows.contact(group, normal_M));
    }
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
    /// Finds all within reach that count; `false`: there is no room for them.
    fn find(&mut self, standing: &Standing<'_>, halvings: u32) -> bool {
        let mesh = standing.mesh;
        self.count = 0;
        let (all, count) = (&mut self.all, &mut self.count);
        let mut seen = Seen { names: [0; SEEN] };
        let see = |corner: Corner| {
            let (number, at_M) = (corner.vertex(mesh), *corner.point_M(mesh));
            if !scattered(number).is_multiple_of(1 << halvings) || !seen.is_new(number) {
                return true;
            }
            let Some(place) = all.get_mut(*count) else { return false };
            let gap_m = standing.height_m(corner);
            *place = Low { number, at_M, gap_m, group: 0, apart_m2: f64::INFINITY };
            *count += 1;
            true
        };
        standing.for_each_low(see, MOST_VISITS)
    }

    /// Chooses those of the last tick that are there, and then the one that is farthest from all that are chosen, again and again.
    fn choose(&mut self, last: &[u32; MAX_POINTS]) {
        for &name in last.iter().filter(|&&name| name != 0) {
            if let Some(at) = self.all[..self.count].iter().position(|low| low.number + 1 == name) {
                self.take(at);
            }
        }
        if self.groups == 0 {
            self.take(0);
        }
        while self.groups < MAX_POINTS {
            let apart = |at: &usize| self.all[*at].apart_m2;
            let farthest = (0..self.count).max_by(|a, b| apart(a).total_cmp(&apart(b)));
            let Some(farthest) = farthest.filter(|at| apart(at) > 0.0) else { break };
            self.take(farthest);
        }
    }

    fn take(&mut self, at: usize) {
        let group = self.groups;
        let Low { number, at_M, .. } = self.all[at];
        self.chosen[group] = number + 1;
        self.groups += 1;
        for low in &mut self.all[..self.count] {
            let apart_m2 = (low.at_M - at_M).norm_squared();
            if apart_m2 < low.apart_m2 {
                (low.group, low.apart_m2) = (group, apart_m2);
            }
        }
    }

    /// The contact point of a group: where nothing of it touches, the lowest.
    fn contact(&self, group: usize, normal_M: &Vector3<f64>) -> Contact {
        let own = || self.all[..self.count].iter().filter(|low| low.group == group);
        let (mut deep_m, mut deep_m2, mut at_M) = (0.0, 0.0, Vector3::zeros());
        for low in own().filter(|low| low.gap_m < 0.0) {
            deep_m -= low.gap_m;
            deep_m2 += low.gap_m * low.gap_m;
            at_M -= low.at_M * low.gap_m;
        }
        let about = About::Vertex(self.chosen[group] - 1);
        if deep_m2 == 0.0 {
            let lowest = own().min_by(|a, b| a.gap_m.total_cmp(&b.gap_m));
            // A chosen one is its group's.
            let low = lowest.copied().unwrap_or_default();
            return Contact::new(about, low.at_M, *normal_M, low.gap_m);
        }
        // So the springs' force is the sum of all, and so is what they hold.
        let share = deep_m * deep_m / deep_m2;
        let contact = Contact::new(about, at_M / deep_m, *normal_M, -deep_m2 / deep_m);
        Contact { gap_m: -deep_m, share, ..contact }
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
/// Bound on the nodes of the hierarchy and the runs of faces that are looked at.
const MOST_VISITS: usize = 2048;
