//! Linear equations of bodies that press each other: a matrix of 6 x 6 blocks, of which most are zero.
//!
//! Model: block Gaussian elimination. A body is eliminated when fewest of those that are left depend on it, the lower number
//! first: chains, stacks and trees go from their ends and fill nothing in; cost grows with their length, not its cube. Pivots
//! are sought within blocks. Forces take energy, so a block that stands on the diagonal is never small beside its row but where
//! friction slides on long arms; where that makes one singular, there is no answer, and whoever asks has another way.
//! Only blocks that can be other than zero have room, in the order in which elimination comes to them.
//! Which bodies depend on which are bits of a word: [`MAX_BODIES`].
//! Cost: a product of blocks for each two that depend on a body when it is eliminated, at most [`MAX_PRODUCTS`].

use super::six::{Block, NOTHING, Triangles, Vector6, take_image, take_product};

/// The most bodies that are solved for together.
pub(super) const MAX_BODIES: usize = 128;
/// The most products of blocks in an elimination: a millisecond or less. Body by body such islands take several, and are not
/// solved.
const MAX_PRODUCTS: usize = 16_384;

/// Bodies, each a bit at its place.
type Bits = u128;

/// Room for such a matrix, and in which order it is eliminated.
#[derive(Debug, Clone, Default)]
pub(super) struct Blocks {
    stride: usize,
    blocks: Vec<Block>,
    /// Of two bodies, which block is theirs: row by row.
    numbers: Vec<u16>,
    order: Vec<usize>,
    /// Of each body, which depend on it when it is eliminated.
    later: Vec<Bits>,
    products: usize,
}

impl Blocks {
    pub(super) fn with_capacity(bodies: usize) -> Self {
        let stride = bodies.min(MAX_BODIES);
        // Of the numbers of those that depend on each body the squares have that sum at most.
        let pairs = (stride * stride.saturating_sub(1) / 2).min((stride * MAX_PRODUCTS).isqrt());
        Self {
            stride,
            blocks: vec![NOTHING; stride + 2 * pairs],
            numbers: vec![0; stride * stride],
            order: Vec::with_capacity(stride),
            later: Vec::with_capacity(stride),
            products: 0,
        }
    }

    /// Products of blocks that an elimination takes, as it is planned.
    pub(super) fn products(&self) -> usize {
        self.products
    }

    /// Finds the order for bodies that depend on each other like this, in pairs; says whether there is room for them.
    pub(super) fn plan(&mut self, bodies: usize, pairs: impl Iterator<Item = [usize; 2]>) -> bool {
        if bodies > self.stride {
            return false;
        }
        let near = &mut self.later;
        near.clear();
        near.resize(bodies, 0);
        for [a, b] in pairs {
            near[a] |= 1 << b;
            near[b] |= 1 << a;
        }
        self.order.clear();
        self.products = 0;
        let mut left = Bits::MAX >> (MAX_BODIES - bodies.max(1));
        for _ in 0..bodies {
            let degree = |&body: &usize| (near[body] & left).count_ones();
            let Some(next) = bits(left).min_by_key(degree) else { break };
            left &= !(1 << next);
            let later = near[next] & left;
            near[next] = later;
            bits(later).for_each(|body| near[body] |= later & !(1 << body));
            self.products += (later.count_ones() * later.count_ones()) as usize;
            self.order.push(next);
            if self.products > MAX_PRODUCTS {
                return false;
            }
        }
        self.number();
        true
    }

    /// Gives each block that elimination needs a number.
    fn number(&mut self) {
        let mut next = 0;
        for &body in &self.order {
            self.numbers[body * self.stride + body] = next;
            next += 1;
            for other in bits(self.later[body]) {
                self.numbers[body * self.stride + other] = next;
                self.numbers[other * self.stride + body] = next + 1;
                next += 2;
            }
        }
    }

    /// Makes all blocks zero that elimination needs.
    pub(super) fn clear(&mut self) {
        let pairs: u32 = self.later.iter().map(|later| later.count_ones()).sum();
        self.blocks[..self.order.len() + 2 * pairs as usize].fill(NOTHING);
    }

    #[inline]
    pub(super) fn at(&mut self, row: usize, column: usize) -> &mut Block {
        &mut self.blocks[self.numbers[row * self.stride + column] as usize]
    }

    /// Changes all blocks that can be other than zero, by their row and column.
    pub(super) fn for_each(&mut self, mut change: impl FnMut(usize, usize, &mut Block)) {
        let mut blocks = self.blocks.iter_mut();
        let mut next = |row, column| {
            if let Some(block) = blocks.next() {
                change(row, column, block);
            }
        };
        for &body in &self.order {
            next(body, body);
            for other in bits(self.later[body]) {
                next(body, other);
                next(other, body);
            }
        }
    }

    /// Solves for the right-hand side, in its place; says whether there is an answer. The blocks are used up.
    pub(super) fn solve(&mut self, side: &mut [Vector6]) -> bool {
        let Self { stride, blocks, numbers, order, later, .. } = self;
        let number = |row: usize, column: usize| numbers[row * *stride + column] as usize;
        for &body in order.iter() {
            let Some(triangles) = Triangles::of(&blocks[number(body, body)]) else { return false };
            triangles.solve(&mut side[body]);
            for other in bits(later[body]) {
                triangles.solve_block(&mut blocks[number(body, other)]);
            }
            for row in bits(later[body]) {
                let factor = blocks[number(row, body)];
                let known = side[body];
                take_image(&mut side[row], &factor, &known);
                for column in bits(later[body]) {
                    let right = blocks[number(body, column)];
                    take_product(&mut blocks[number(row, column)], &factor, &right);
                }
            }
        }
        for &body in order.iter().rev() {
            for other in bits(later[body]) {
                let known = side[other];
                take_image(&mut side[body], &blocks[number(body, other)], &known);
            }
        }
        true
    }
}

/// The places of the bits that are set, from the lowest.
#[inline]
fn bits(mut word: Bits) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let at = word.trailing_zeros() as usize;
        word &= word.wrapping_sub(1);
        (at < MAX_BODIES).then_some(at)
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;

    /// Numbers between -0.5 and 0.5.
    fn noise(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }

    #[test]
    fn elimination_of_blocks_is_that_of_the_whole_matrix() {
        let seed = &mut 7;
        for bodies in [1, 2, 5, 9, 16] {
            for chords in [0, 1, 3, 12] {
                let chain = (1..bodies).map(|body| [body - 1, body]);
                let across = (0..chords)
                    .filter(|_| bodies > 3)
                    .map(|at| [at % bodies, (at + 2 + bodies / 2) % bodies]);
                let pairs: Vec<_> = chain.chain(across).filter(|[a, b]| a != b).collect();
                let mut blocks = Blocks::with_capacity(bodies);
                assert!(blocks.plan(bodies, pairs.iter().copied()));
                blocks.clear();
                let mut whole = DMatrix::<f64>::zeros(6 * bodies, 6 * bodies);
                let diagonal = (0..bodies).map(|body| [body, body]);
                for [a, b] in pairs.iter().flat_map(|&[a, b]| [[a, b], [b, a]]).chain(diagonal) {
                    for (row, values) in blocks.at(a, b).iter_mut().enumerate() {
                        for (column, value) in values.iter_mut().enumerate() {
                            // The largest is never where elimination begins.
                            *value = noise(seed) + if a == b && (row + 1) % 6 == column { 8.0 } else { 0.0 };
                            whole[(6 * a + row, 6 * b + column)] = *value;
                        }
                    }
                }
                let side = DVector::from_fn(6 * bodies, |_, _| noise(seed));
                let mut fast: Vec<_> =
                    (0..bodies).map(|body| Vector6::from_fn(|at, _| side[6 * body + at])).collect();
                assert!(blocks.solve(&mut fast));
                let slow = whole.lu().solve(&side).unwrap();
                for (at, slow) in slow.iter().enumerate() {
                    // Roundings of a matrix whose condition is below 100.
                    assert!((fast[at / 6][at % 6] - slow).abs() < 1e-13, "{bodies} {chords}");
                }
            }
        }
    }

    #[test]
    fn chains_and_trees_fill_nothing_in() {
        const MANY: usize = MAX_BODIES;
        let mut blocks = Blocks::with_capacity(MANY);
        assert!(blocks.plan(MANY, (1..MANY).map(|body| [body, body / 2])));
        assert_eq!(blocks.later.iter().map(|later| later.count_ones()).sum::<u32>(), MANY as u32 - 1);
        // Everybody presses everybody: too much for a tick.
        assert!(
            !blocks.plan(MANY, (0..MANY * MANY).map(|at| [at / MANY, at % MANY]).filter(|[a, b]| a != b))
        );
        assert!(!blocks.plan(MANY + 1, std::iter::empty()));
    }
}
