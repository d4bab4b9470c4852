//! One 32-bit word of a file that can only be mapped, as the memory of a PCI card.

use nix::sys::mman::{MapFlags, ProtFlags, mmap, munmap};
use std::fs::File;
use std::io;
use std::num::NonZeroUsize;
use std::path::Path;

/// One page of the machines Linux runs on, at least; mappings begin on its multiples.
const PAGE: usize = 4096;

/// Reads the word at `offset`, which must be a multiple of 4 within the first page.
///
/// # Errors
/// As the system says; `InvalidInput` if the file does not reach that far, since reading beyond its
/// end would be a bus error.
pub(crate) fn read(path: &Path, offset: usize) -> io::Result<u32> {
    let file = File::open(path)?;
    let bytes = file.metadata()?.len();
    if !offset.is_multiple_of(4) || offset + 4 > PAGE || (offset + 4) as u64 > bytes {
        let error = format!("{bytes} bytes have no word at {offset:#x}");
        return Err(io::Error::new(io::ErrorKind::InvalidInput, error));
    }
    let length = NonZeroUsize::new(offset + 4).ok_or(io::ErrorKind::InvalidInput)?;
    // SAFETY: a fresh mapping at an address of the kernel's choice touches no memory of ours.
    let base = unsafe { mmap(None, length, ProtFlags::PROT_READ, MapFlags::MAP_SHARED, &file, 0) }?;
    let word = base.as_ptr().cast::<u8>().wrapping_add(offset).cast::<u32>();
    // SAFETY: `word` lies within the mapping (checked against the file's length above), is aligned,
    // since mappings begin on a page and `offset` is a multiple of 4, and any bits are a u32.
    let value = unsafe { word.read_volatile() };
    // SAFETY: exactly the mapping made above, to which no reference is left.
    unsafe { munmap(base, length.get()) }?;
    Ok(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_is_read_and_one_beyond_the_end_is_refused() {
        let path = std::env::temp_dir().join(format!("rt-core-word-{}", std::process::id()));
        std::fs::write(&path, [0, 0, 0, 0, 0xFE, 0xCA, 0xAA, 0x55]).unwrap();
        assert_eq!(read(&path, 4).unwrap(), u32::from_ne_bytes([0xFE, 0xCA, 0xAA, 0x55]));
        for offset in [2, 8, 4096] {
            assert_eq!(read(&path, offset).unwrap_err().kind(), io::ErrorKind::InvalidInput, "{offset}");
        }
        std::fs::remove_file(&path).unwrap();
        assert_eq!(read(&path, 4).unwrap_err().kind(), io::ErrorKind::NotFound);
    }
}
