//! Which of a place's points carry: the others press nothing that these do not.
//!
//! Problem: two flat faces that are cut finely touch in any number of vertices and crossings. A rigid body over them stands
//! on the corners of their outline, whatever lies between these; which points count must not depend on micrometres.
//! Model: small motions change depths linearly along the face. So a point between others that is no deeper than what they
//! have there never stops anything before they do, and is left out. What stays are the corners of the points' convex
//! outline, seen along the normal, and what is deeper than the envelope of those that stay: the belly of a bowl.
//! Identity: who carried in the last tick is left out only for what is better by a margin.
//! Error: an outline is right to [`OUTLINE`] of its extent, a depth to [`DEPTH`] of the deepest one.
//! Cost: `n log n` steps for `n` points, some for each corner of their outline in pairs, and for each point that is none one
//! for each triangle of at most [`MOST_CARRIERS`]; nothing for two points.

use nalgebra::{Vector2, Vector3};

use super::mesh::Contact;
use super::mesh_role::across;

/// Moves those that carry to the front, in the order in which they are; says how many they are.
pub(super) fn sort_out(contacts: &mut [Contact], normal_M: &Vector3<f64>) -> usize {
    if contacts.len() < 3 {
        return contacts.len();
    }
    let seen = Seen::of(contacts, normal_M);
    let mut carriers = Carriers { all: [0; MOST_POINTS + 1], count: 0 };
    seen.outline(&mut carriers);
    seen.add_what_is_deeper(&mut carriers);
    let mut count = 0;
    for at in 0..contacts.len() {
        if carriers.as_slice().contains(&at) {
            contacts.swap(count, at);
            count += 1;
        }
    }
    count
}

/// Numbers of the points that carry: at first round the outline.
struct Carriers {
    all: [usize; MOST_POINTS + 1],
    count: usize,
}

impl Carriers {
    fn as_slice(&self) -> &[usize] {
        &self.all[..self.count]
    }

    fn push(&mut self, point: usize) {
        self.all[self.count] = point;
        self.count += 1;
    }

    fn remove(&mut self, at: usize) {
        self.all.copy_within(at + 1..self.count, at);
        self.count -= 1;
    }
}

/// A contact point, seen along the normal.
#[derive(Debug, Clone, Copy, Default)]
struct Point {
    at_m: Vector2<f64>,
    /// Negative where they do not touch \[m\].
    depth_m: f64,
    /// In the last tick.
    carried: bool,
}

/// All of a place's.
struct Seen {
    points: [Point; MOST_POINTS],
    count: usize,
    /// Nearer to an outline is on it \[m\].
    aside_m: f64,
    /// What is deeper by less is as deep \[m\].
    deeper_m: f64,
}

impl Seen {
    fn of(contacts: &[Contact], normal_M: &Vector3<f64>) -> Self {
        let u_M = across(normal_M);
        let v_M = normal_M.cross(&u_M);
        let mut seen =
            Self { points: [Point::default(); MOST_POINTS], count: 0, aside_m: 0.0, deeper_m: 0.0 };
        let (mut low, mut high) = (Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY));
        let mut deepest_m = 0.0_f64;
        for (point, contact) in seen.points.iter_mut().zip(contacts) {
            let at_m = Vector2::new(u_M.dot(&contact.on_mesh_M), v_M.dot(&contact.on_mesh_M));
            *point = Point { at_m, depth_m: -contact.gap_m, carried: contact.carried };
            (low, high) = (low.inf(&at_m), high.sup(&at_m));
            deepest_m = deepest_m.max(point.depth_m);
            seen.count += 1;
        }
        let extent_m = (high - low).norm();
        seen.aside_m = OUTLINE * extent_m + (DEPTHS * deepest_m).min(MOST_OUTLINE * extent_m);
        seen.deeper_m = DEPTH * deepest_m;
        seen
    }

    /// The corners of the convex outline that stick out.
    fn outline(&self, corners: &mut Carriers) {
        self.wrap(corners);
        while corners.count > 1 {
            let sticks_out = (0..corners.count).map(|at| (at, self.sticks_out_m(corners, at)));
            let Some((least, by_m)) = sticks_out.min_by(|a, b| a.1.total_cmp(&b.1)) else { break };
            if by_m >= self.aside_m && corners.count <= MOST_CORNERS {
                break;
            }
            corners.remove(least);
        }
    }

    /// All corners of the convex outline, one after the other: from the left to the right below, and back above.
    fn wrap(&self, corners: &mut Carriers) {
        let mut order = std::array::from_fn::<_, MOST_POINTS, _>(|at| at);
        let order = &mut order[..self.count];
        let place = |point: usize| (self.points[point].at_m.x, self.points[point].at_m.y);
        order.sort_unstable_by(|&a, &b| {
            let (a, b) = (place(a), place(b));
            a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        let below = self.chain(order.iter(), 0, corners);
        corners.remove(corners.count - 1);
        self.chain(order.iter().rev(), below - 1, corners);
        corners.remove(corners.count - 1);
    }

    /// Appends points that turn to the left all the way; says how many there are then. The first so many are another one's.
    fn chain<'p>(
        &self,
        points: impl Iterator<Item = &'p usize>,
        begin: usize,
        corners: &mut Carriers,
    ) -> usize {
        for &point in points {
            while corners.count >= begin + 2 {
                let [a, b] = [2, 1].map(|back| self.points[corners.all[corners.count - back]].at_m);
                if (b - a).perp(&(self.points[point].at_m - a)) > 0.0 {
                    break;
                }
                corners.remove(corners.count - 1);
            }
            corners.push(point);
        }
        corners.count
    }

    /// How far a corner is from the line between those beside it \[m\]: more, if it carried.
    fn sticks_out_m(&self, corners: &Carriers, at: usize) -> f64 {
        let count = corners.count;
        let beside = [(at + count - 1) % count, (at + 1) % count].map(|beside| corners.all[beside]);
        let corner = &self.points[corners.all[at]];
        let (_, by_m) = self.nearest_on(beside, &corner.at_m);
        if corner.carried { STAYS * by_m } else { by_m }
    }

    /// The others, the deepest first, if they are deeper than what carries already.
    fn add_what_is_deeper(&self, carriers: &mut Carriers) {
        let mut is_done = [false; MOST_POINTS];
        carriers.as_slice().iter().for_each(|&at| is_done[at] = true);
        for _ in carriers.count..self.count {
            let left = (0..self.count).filter(|&at| !is_done[at]);
            let deeper = |a: &usize, b: &usize| self.points[*a].depth_m.total_cmp(&self.points[*b].depth_m);
            let Some(next) = left.max_by(deeper) else { return };
            is_done[next] = true;
            let point = &self.points[next];
            let more_m = point.depth_m - self.envelope_m(carriers, &point.at_m);
            let more_m = if point.carried { STAYS * more_m } else { more_m };
            if more_m > self.deeper_m && carriers.count < MOST_CARRIERS {
                carriers.push(next);
            }
        }
    }

    /// The most that they have between them at a place \[m\]: next to nothing where they are not around it.
    fn envelope_m(&self, carriers: &Carriers, at_m: &Vector2<f64>) -> f64 {
        let all = carriers.as_slice();
        let mut most_m = f64::NEG_INFINITY;
        for (first, &a) in all.iter().enumerate() {
            for (second, &b) in all.iter().enumerate().skip(first) {
                let (share, aside_m) = self.nearest_on([a, b], at_m);
                if aside_m < self.aside_m {
                    let [a_m, b_m] = [a, b].map(|end| self.points[end].depth_m);
                    most_m = most_m.max(a_m + (b_m - a_m) * share);
                }
                for &c in &all[second + 1..] {
                    most_m = most_m.max(self.between_m([a, b, c], at_m).unwrap_or(most_m));
                }
            }
        }
        most_m
    }

    /// Where on the line between two points another one is nearest, as a share of the way; and how far that is \[m\].
    fn nearest_on(&self, [a, b]: [usize; 2], at_m: &Vector2<f64>) -> (f64, f64) {
        let from_m = self.points[a].at_m;
        let along_m = self.points[b].at_m - from_m;
        let length = along_m.norm_squared();
        let share = if length > 0.0 { ((at_m - from_m).dot(&along_m) / length).clamp(0.0, 1.0) } else { 0.0 };
        (share, (at_m - from_m - along_m * share).norm())
    }

    /// The depth that a triangle has at a place in it \[m\].
    fn between_m(&self, corners: [usize; 3], at_m: &Vector2<f64>) -> Option<f64> {
        let [a, b, c] = corners.map(|corner| &self.points[corner]);
        let (ab, ac, way) = (b.at_m - a.at_m, c.at_m - a.at_m, at_m - a.at_m);
        let area = ab.perp(&ac);
        let (of_b, of_c) = (way.perp(&ac) / area, ab.perp(&way) / area);
        let is_in = of_b >= 0.0 && of_c >= 0.0 && of_b + of_c <= 1.0;
        is_in.then_some(a.depth_m + (b.depth_m - a.depth_m) * of_b + (c.depth_m - a.depth_m) * of_c)
    }
}

/// Room for all points of a place.
pub(super) const MOST_POINTS: usize = 64;
/// Of an outline, and with what is deeper than they have it.
const MOST_CORNERS: usize = 8;
const MOST_CARRIERS: usize = 12;
/// A corner that sticks out by less than this share of the extent is none.
const OUTLINE: f64 = 0.02;
/// Nor by this many depths: where two sides meet, the one ends in the other; but no more than that share of the extent.
const DEPTHS: f64 = 2.0;
const MOST_OUTLINE: f64 = 0.05;
/// By so much of the deepest one's depth must be deeper what lies between others.
const DEPTH: f64 = 0.1;
/// Who carried in the last tick sticks out so many times as much.
const STAYS: f64 = 2.0;

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers between -0.5 and 0.5.
    fn noise(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }

    /// A grid of 20 mm over x and z as deep as this, in any order.
    fn grid(side: usize, seed: &mut u64, depth_m: impl Fn(f64, f64) -> f64) -> Vec<Contact> {
        let place = |at: usize| 0.02 * (at as f64 / (side - 1) as f64 - 0.5);
        let all = (0..side * side).map(|at| (place(at % side), place(at / side)));
        let mut contacts: Vec<_> = all
            .map(|(x, z)| {
                let on_mesh_M = Vector3::new(x, 0.0, z).map(|part| part + 1e-9 * noise(seed));
                let gap_m = -depth_m(x, z) * (1.0 + 1e-6 * noise(seed));
                Contact { on_mesh_M, gap_m, normal_M: -Vector3::y(), ..Contact::default() }
            })
            .collect();
        contacts.sort_by_cached_key(|_| (1e9 * noise(seed)) as i64);
        contacts
    }

    fn carrying(mut contacts: Vec<Contact>) -> Vec<[i64; 2]> {
        let count = sort_out(&mut contacts, &-Vector3::y());
        let tenths_mm = |part: f64| (1e4 * part).round() as i64;
        let places = contacts[..count].iter().map(|contact| &contact.on_mesh_M);
        let mut places: Vec<_> = places.map(|at_M| [at_M.x, at_M.z].map(tenths_mm)).collect();
        places.sort_unstable();
        places
    }

    const CORNERS: [[i64; 2]; 4] = [[-100, -100], [-100, 100], [100, -100], [100, 100]];

    #[test]
    fn a_flat_face_is_carried_by_its_corners_however_it_is_cut_and_leans() {
        let seed = &mut 5;
        for side in [2, 3, 5, 7] {
            for lean in [0.0, 2e-3, 0.02] {
                for _ in 0..50 {
                    // Leaning, some of it is clear of the other one.
                    let face = grid(side, seed, |x, z| 1e-4 + lean * (x + 0.3 * z));
                    assert_eq!(carrying(face), CORNERS, "{side} {lean}");
                }
            }
        }
    }

    #[test]
    fn a_line_is_carried_by_its_ends_and_a_bowl_by_its_belly_too() {
        let seed = &mut 6;
        for _ in 0..50 {
            let mut line = grid(7, seed, |_, _| 1e-4);
            line.retain(|contact| contact.on_mesh_M.z.abs() < 1e-6);
            assert_eq!(carrying(line), [[-100, 0], [100, 0]]);
            let bowl = carrying(grid(3, seed, |x, z| 1e-4 - x * x - z * z));
            assert!(CORNERS.iter().all(|corner| bowl.contains(corner)) && bowl.contains(&[0, 0]), "{bowl:?}");
        }
    }

    #[test]
    fn of_two_that_are_as_good_the_one_that_carried_stays() {
        let seed = &mut 7;
        for _ in 0..50 {
            // A corner that is cut off by less than what counts.
            let mut face = grid(2, seed, |_, _| 1e-4);
            face.retain(|contact| contact.on_mesh_M.x < 0.005 || contact.on_mesh_M.z < 0.005);
            let first = noise(seed) > 0.0;
            let mut at = |x: f64, z: f64, carried: bool| Contact {
                on_mesh_M: Vector3::new(x + 1e-9 * noise(seed), 0.0, z),
                gap_m: -1e-4,
                carried,
                ..Contact::default()
            };
            face.extend([at(0.01, 0.0098, first), at(0.0098, 0.01, !first)]);
            let expected = if first { [100, 98] } else { [98, 100] };
            let carriers = carrying(face);
            assert!(carriers.len() == 4 && carriers.contains(&expected), "{carriers:?}");
        }
    }
}
