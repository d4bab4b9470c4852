//! Rewrites a file and has it brought to disk: block interrupts, journal, write-back threads.

use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::path::Path;

/// The file never grows beyond this. It has no name: it vanishes with the process.
pub(super) const BYTES: usize = 64 << 20;
const CHUNK: usize = 1 << 20;

pub(super) fn work(directory: &Path) -> std::io::Error {
    tempfile::tempfile_in(directory).map_or_else(|error| error, |file| rewrite(&file))
}

fn rewrite(file: &File) -> std::io::Error {
    let chunk = vec![0xA5_u8; CHUNK];
    let round = || {
        let mut out = file;
        out.seek(SeekFrom::Start(0))?;
        for _ in 0..BYTES / CHUNK {
            out.write_all(&chunk)?;
            out.sync_data()?;
        }
        Ok(())
    };
    loop {
        // A full disk is load as well, but must not become a busy loop.
        if let Err(error) = round() {
            let error: std::io::Error = error;
            if error.kind() != std::io::ErrorKind::StorageFull {
                return error;
            }
            std::thread::sleep(std::time::Duration::from_millis(200));
        }
    }
}
