//! Vertices that are one: for each the first that is equal to it up to rounding.
//!
//! Model: first what is equal to the bit (-0 equals 0), by hashing. Of what is left, whatever lies within a few roundings
//! of the mesh's largest coordinate of an earlier vertex becomes that one. Vertices are sorted into cells that are much
//! larger than that, so that nearly each looks into one cell, and one beside a border into those behind it, too.
//! Invariant: vertices that are equal to the bit become the same one. No chain of close vertices moves one further than
//! the tolerance.

use super::repair::ROUNDING;
use super::report::Finding;
use nalgebra::Vector3;

/// For each vertex the one that stands for it. Noted is each place that another one stands for, but no vertex that is equal to an
/// earlier one to the bit.
pub(super) fn merge(vertices: &[Vector3<f64>], welded: &mut Finding) -> Vec<u32> {
    let mut stands_for = first_equal(vertices);
    let tolerance = ROUNDING * vertices.iter().map(Vector3::amax).fold(0.0, f64::max);
    if tolerance > 0.0 {
        merge_close(vertices, tolerance, &mut stands_for, welded);
    }
    stands_for
}

/// Open addressing with linear probing. Whatever the hash, the answer depends on the input alone.
struct Table {
    slots: Vec<u32>,
}

const FREE: u32 = u32::MAX;

impl Table {
    fn for_vertices(count: usize) -> Self {
        Self { slots: vec![FREE; (2 * count).next_power_of_two()] }
    }

    /// The first entry of this hash or one beside it for which `is_wanted` holds.
    fn find(&self, hash: u64, is_wanted: impl Fn(u32) -> bool) -> Result<u32, usize> {
        let mask = self.slots.len() - 1;
        let mut slot = hash as usize & mask;
        while self.slots[slot] != FREE {
            if is_wanted(self.slots[slot]) {
                return Ok(self.slots[slot]);
            }
            slot = (slot + 1) & mask;
        }
        Err(slot)
    }
}

fn first_equal(vertices: &[Vector3<f64>]) -> Vec<u32> {
    let mut table = Table::for_vertices(vertices.len());
    let first_of = |(index, vertex): (u32, &Vector3<f64>)| {
        // Equal vertices have equal hashes: adding 0 makes -0 a 0.
        let hash = hash(vertex.map(|x| (x + 0.0).to_bits()));
        table.find(hash, |other| vertices[other as usize] == *vertex).unwrap_or_else(|slot| {
            table.slots[slot] = index;
            index
        })
    };
    (0..).zip(vertices).map(first_of).collect()
}

/// A cell is so many tolerances wide.
const CELL: f64 = 1024.0;

fn merge_close(vertices: &[Vector3<f64>], tolerance: f64, stands_for: &mut [u32], welded: &mut Finding) {
    let mut table = Table::for_vertices(vertices.len());
    let per_cell = 1.0 / (CELL * tolerance);
    // No border at zero, around which the roundings of symmetric parts lie.
    let cell = |x: f64| (x * per_cell + 0.5).floor() as i64 as u64;
    for index in 0..vertices.len() {
        if stands_for[index] != index as u32 {
            // It comes after the first of its equals, whose fate is known.
            stands_for[index] = stands_for[stands_for[index] as usize];
            continue;
        }
        let vertex = &vertices[index];
        let is_close = |other: u32| (vertices[other as usize] - vertex).amax() <= tolerance;
        let (low, high) = (vertex.map(|x| cell(x - tolerance)), vertex.map(|x| cell(x + tolerance)));
        let own = hash(vertex.map(cell));
        let mut found = table.find(own, is_close);
        if low != high && found.is_err() {
            let corner = |corner: usize| {
                Vector3::from_fn(|axis, _| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] })
            };
            found = (0..8).find_map(|i| table.find(hash(corner(i)), is_close).ok()).ok_or(()).or(found);
        }
        match found {
            Ok(other) => {
                stands_for[index] = other;
                welded.note(index);
            }
            Err(slot) => table.slots[slot] = index as u32,
        }
    }
}

fn hash(words: Vector3<u64>) -> u64 {
    let mix = |h: u64, x: &u64| {
        let h = (h ^ x).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        h ^ (h >> 29)
    };
    words.iter().fold(0, mix)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn merged(vertices: &[[f64; 3]]) -> Vec<u32> {
        let vertices: Vec<_> = vertices.iter().map(|v| Vector3::from(*v)).collect();
        merge(&vertices, &mut Finding::default())
    }

    #[test]
    fn vertices_that_differ_by_rounding_become_the_first_of_them_and_others_stay() {
        let size = 0.1;
        let noise = ROUNDING * size;
        for at in [0.0, 3e-17, -3e-17, 0.05, 511.9 * noise, 512.0 * noise, 512.1 * noise, -512.0 * noise] {
            let near = |by: f64| [at + by, at - by, at];
            let vertices = [[size; 3], near(0.0), near(0.9 * noise), near(-0.9 * noise), near(3.0 * noise)];
            assert_eq!(merged(&vertices), [0, 1, 1, 1, 4], "at {at}");
        }
    }

    #[test]
    fn equal_vertices_stay_together_wherever_others_lie_between() {
        let noise = ROUNDING;
        let chain = [0.0, 0.8, 1.6, 0.8, 2.4, 0.0, 1.6].map(|x| [x * noise, 0.0, 1.0]);
        assert_eq!(merged(&chain), [0, 0, 2, 0, 2, 0, 2]);
    }

    #[test]
    fn zeros_of_both_signs_are_one_and_a_mesh_of_zeros_is_a_point() {
        assert_eq!(merged(&[[0.0; 3], [-0.0; 3], [0.0, -0.0, 0.0]]), [0; 3]);
    }

    /// Against the comparison of all pairs.
    #[test]
    fn cells_find_what_the_comparison_of_all_pairs_finds() {
        let mut state = 7_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 33) as f64 / f64::from(1_u32 << 31)
        };
        for round in 0..200 {
            let tolerance = ROUNDING;
            // Few places, many of them beside a border of cells, and noise of half the tolerance, so that all of a
            // place are close and different places are not.
            let places: Vec<[f64; 3]> = (0..20)
                .map(|_| [0; 3].map(|_| ((random() * 9.0).floor() - 4.0) * CELL * tolerance / 2.0))
                .collect();
            let mut vertices = vec![Vector3::from([1.0; 3])];
            for _ in 0..200 {
                let place = places[(random() * 19.99) as usize];
                vertices.push(Vector3::from(place.map(|x| x + (random() - 0.5) * tolerance)));
            }
            let found = merge(&vertices, &mut Finding::default());
            for (index, other) in found.iter().enumerate() {
                let first = (0..=index).find(|&i| (vertices[i] - vertices[index]).amax() <= tolerance);
                assert_eq!(Some(*other as usize), first, "round {round}, vertex {index}");
            }
        }
    }
}
