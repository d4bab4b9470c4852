//! Content of an MCAP chunk: decompressed within bounds and checked.
//!
//! Model: a chunk says how large its content is. It is believed up to [`MOST_CHUNK_BYTES`] and up to what its compressed
//! bytes can make: LZ4 makes at most 255 bytes of one.

use super::mcap_record::Chunk;
use std::io::{ErrorKind, Read};

/// The most that a chunk's records may have: chunks of ours have half of it at most.
const MOST_CHUNK_BYTES: u64 = 64 << 20;
/// Of a byte of LZ4.
const MOST_EXPANSION: u64 = 255;

/// Why a chunk's records cannot be had.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum ChunkError {
    /// It is sound, as far as is known, and compressed by something else.
    Compression(String),
    /// What is wrong with it.
    Damage(String),
    /// There is no memory for what is in it.
    Memory,
}

impl From<String> for ChunkError {
    fn from(why: String) -> Self {
        Self::Damage(why)
    }
}

/// The library tells its own lack of memory in words.
fn wrong(error: &std::io::Error) -> ChunkError {
    if error.kind() == ErrorKind::OutOfMemory || error.to_string().contains("allocation_failed") {
        return ChunkError::Memory;
    }
    ChunkError::Damage(format!("a chunk cannot be expanded: {error}"))
}

/// The records of a chunk.
///
/// # Errors
/// Why they cannot be had.
pub(super) fn content(chunk: &Chunk<'_>) -> Result<Vec<u8>, ChunkError> {
    let content = match chunk.compression {
        "" => copied(chunk.records)?,
        "lz4" => expand(chunk)?,
        other => return Err(ChunkError::Compression(other.into())),
    };
    if content.len() as u64 != chunk.uncompressed_bytes {
        return Err(
            format!("a chunk has {} bytes, and says {}", content.len(), chunk.uncompressed_bytes).into()
        );
    }
    let crc = crc32fast::hash(&content);
    if chunk.crc != 0 && chunk.crc != crc {
        return Err(format!("the check sum of a chunk is {crc:08x}, and should be {:08x}", chunk.crc).into());
    }
    Ok(content)
}

fn copied(records: &[u8]) -> Result<Vec<u8>, ChunkError> {
    let mut content = Vec::new();
    content.try_reserve_exact(records.len()).map_err(|_| ChunkError::Memory)?;
    content.extend_from_slice(records);
    Ok(content)
}

fn expand(chunk: &Chunk<'_>) -> Result<Vec<u8>, ChunkError> {
    let most = MOST_CHUNK_BYTES.min((chunk.records.len() as u64).saturating_mul(MOST_EXPANSION));
    let said = chunk.uncompressed_bytes;
    if said > most {
        return Err(format!("a chunk says that it has {said} bytes; allowed: at most {most}").into());
    }
    let mut content = Vec::new();
    content.try_reserve_exact(said as usize).map_err(|_| ChunkError::Memory)?;
    let decoder = lz4::Decoder::new(chunk.records).map_err(|error| wrong(&error))?;
    decoder.take(said + 1).read_to_end(&mut content).map_err(|error| wrong(&error))?;
    Ok(content)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn compressed(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = lz4::EncoderBuilder::new().build(Vec::new()).expect("memory");
        encoder.write_all(bytes).expect("memory");
        encoder.finish().0
    }

    fn chunk<'a>(records: &'a [u8], compression: &'a str, of: &[u8]) -> Chunk<'a> {
        let (uncompressed_bytes, crc) = (of.len() as u64, crc32fast::hash(of));
        Chunk { uncompressed_bytes, crc, compression, records }
    }

    #[test]
    fn what_was_compressed_comes_back_and_every_flipped_bit_is_found() {
        let records: Vec<u8> = (0..5000u32).map(|i| (i / 7) as u8).collect();
        let small = compressed(&records);
        assert_eq!(content(&chunk(&small, "lz4", &records)).expect("whole"), records);
        assert_eq!(content(&chunk(&records, "", &records)).expect("whole"), records);
        for at in 0..small.len() {
            let mut flipped = small.clone();
            flipped[at] ^= 0x10;
            // Not every bit of the frame's head is of the content.
            if let Ok(other) = content(&chunk(&flipped, "lz4", &records)) {
                assert_eq!(other, records, "byte {at}");
            }
        }
    }

    #[test]
    fn a_size_that_its_bytes_cannot_have_is_refused_before_memory_is_asked_for() {
        let records = [0; 100];
        let small = compressed(&records);
        let lie = |uncompressed_bytes| {
            let lie = Chunk { uncompressed_bytes, ..chunk(&small, "lz4", &records) };
            match content(&lie).expect_err("a lie") {
                ChunkError::Damage(why) => why,
                other => panic!("{other:?}"),
            }
        };
        assert!(lie(u64::MAX).contains("allowed: at most"), "{}", lie(u64::MAX));
        assert!(lie(1 << 32).contains("allowed: at most"));
        assert!(lie(101).contains("has 100 bytes, and says 101"));
        assert!(lie(99).contains("has 100 bytes, and says 99"));
        let zstd = Chunk { compression: "zstd", ..chunk(&small, "lz4", &records) };
        assert_eq!(content(&zstd), Err(ChunkError::Compression("zstd".into())), "no damage");
    }
}
