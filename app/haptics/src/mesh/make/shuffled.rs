//! The same mesh in another order.

use crate::mesh::TriangleSoup;

/// The same faces and vertices in random order, each face beginning with a random one of its corners.
///
/// The same seed gives the same order everywhere.
pub fn shuffled(soup: &TriangleSoup, seed: u64) -> TriangleSoup {
    let mut random = SplitMix64(seed);
    let order = permutation(soup.vertices.len(), &mut random);
    let mut new_index = vec![0_u32; order.len()];
    for (new, &old) in order.iter().enumerate() {
        new_index[old as usize] = new as u32;
    }
    let vertices = order.iter().map(|&old| soup.vertices[old as usize]).collect();
    let order = permutation(soup.faces.len(), &mut random);
    let face = |old: u32| {
        let mut face = soup.faces[old as usize].map(|v| new_index[v as usize]);
        face.rotate_left(random.below(3));
        face
    };
    TriangleSoup { vertices, faces: order.into_iter().map(face).collect() }
}

/// Fisher and Yates.
fn permutation(n: usize, random: &mut SplitMix64) -> Vec<u32> {
    let mut order: Vec<u32> = (0..n as u32).collect();
    for i in (1..n).rev() {
        order.swap(i, random.below(i + 1));
    }
    order
}

/// Steele, Lea and Flood's generator.
struct SplitMix64(u64);

impl SplitMix64 {
    /// Below n; its bias of n / 2^64 does not matter here.
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((u128::from(z ^ (z >> 31)) * n as u128) >> 64) as usize
    }
}
