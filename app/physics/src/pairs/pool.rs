//! Room for pairs, in chunks: more of them can be added without moving a pair.

use std::ops::{Index, IndexMut};

use crate::pair::Pair;

/// The most chunks: two million pairs.
const MAX_CHUNKS: usize = 16_384;
/// Pairs of a chunk.
pub(crate) const CHUNK: usize = 128;
/// The most pairs.
pub(super) const MOST: usize = MAX_CHUNKS * CHUNK;

/// Pairs by their places.
#[derive(Debug, Clone)]
pub(super) struct Pool {
    chunks: Vec<Chunk>,
}

/// Room for [`CHUNK`] pairs.
pub(super) type Chunk = Box<[Pair]>;

/// Chunks for so many pairs.
pub(super) fn chunks(pairs: usize) -> Vec<Chunk> {
    (0..pairs.div_ceil(CHUNK)).map(|_| chunk(Pair::with_room)).collect()
}

/// Chunk of who has no deadlines.
pub(super) fn small_chunk() -> Chunk {
    chunk(Pair::with_little_room)
}

fn chunk(pair: impl Fn() -> Pair) -> Chunk {
    (0..CHUNK).map(|_| pair()).collect()
}

impl Pool {
    pub(super) fn new(chunks: Vec<Chunk>) -> Self {
        let mut pool = Self { chunks: Vec::with_capacity(MAX_CHUNKS) };
        pool.chunks.extend(chunks);
        pool
    }

    /// Number of pairs that have room.
    pub(super) fn len(&self) -> usize {
        self.chunks.len() * CHUNK
    }

    /// Takes one more chunk, if there may be one. For who has no deadlines.
    pub(super) fn grow(&mut self) -> bool {
        let may = self.chunks.len() < MAX_CHUNKS;
        if may {
            self.chunks.push(small_chunk());
        }
        may
    }

    /// Takes these chunks, but for what is too much.
    pub(super) fn add(&mut self, chunks: &mut Vec<Chunk>) {
        let taken = chunks.len().min(MAX_CHUNKS - self.chunks.len());
        self.chunks.extend(chunks.drain(..taken));
    }
}

impl Index<u32> for Pool {
    type Output = Pair;

    fn index(&self, place: u32) -> &Pair {
        &self.chunks[place as usize / CHUNK][place as usize % CHUNK]
    }
}

impl IndexMut<u32> for Pool {
    fn index_mut(&mut self, place: u32) -> &mut Pair {
        &mut self.chunks[place as usize / CHUNK][place as usize % CHUNK]
    }
}
