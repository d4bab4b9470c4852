//! Bounded reading of regular files that a user or a scene names.
//!
//! Problem: a path in a file can lead anywhere. Opening a FIFO waits for a writer for ever, `/dev/zero` never ends, a
//! terminal steals what is typed, and a directory opens and then fails with a word that explains nothing.
//! Model: what is no regular file is refused before it is opened, and again on the open descriptor, since the path may
//! have been replaced in between; that open never waits (`O_NONBLOCK`, which regular files ignore). At most one byte
//! more than the bound is read, whatever size the file had a moment ago.
//! Invariant: memory is at most the bound, and is asked for as bytes arrive.

use crate::file_kind;
use nix::fcntl::{FcntlArg, OFlag, fcntl};
use std::fs::{File, FileType, Metadata, OpenOptions};
use std::io::{self, ErrorKind, Read};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::Path;

/// Opens a regular file for reading.
///
/// # Errors
/// What the system says; [`ErrorKind::InvalidInput`], with what it is, if it is no regular file.
pub fn open(path: &Path) -> io::Result<File> {
    check(&path.metadata()?)?;
    let file = OpenOptions::new().read(true).custom_flags(libc::O_NONBLOCK | libc::O_NOCTTY).open(path)?;
    check(&file.metadata()?)?;
    Ok(file)
}

/// Opens whatever can be read to its end: a regular file, or a pipe that somebody writes.
///
/// # Errors
/// The system's error; a pipe that nobody writes, for which reading would wait for ever.
pub fn open_stream(path: &Path) -> io::Result<impl Read> {
    let found = path.metadata()?;
    if found.is_dir() {
        return Err(no_regular_file(found.file_type()));
    }
    let mut file =
        OpenOptions::new().read(true).custom_flags(libc::O_NONBLOCK | libc::O_NOCTTY).open(path)?;
    let mut begin = [0];
    let read = match file.read(&mut begin) {
        Err(error) if error.kind() == ErrorKind::WouldBlock => 0,
        Ok(0) if file.metadata()?.file_type().is_fifo() => {
            return Err(io::Error::other("nobody writes this pipe; start its writer first, or name a file"));
        }
        read => read?,
    };
    let flags = OFlag::from_bits_retain(fcntl(&file, FcntlArg::F_GETFL)?);
    fcntl(&file, FcntlArg::F_SETFL(flags - OFlag::O_NONBLOCK))?;
    Ok(io::Cursor::new(begin).take(read as u64).chain(file))
}

/// The content of a regular file.
///
/// # Errors
/// As [`open`]; [`ErrorKind::FileTooLarge`] beyond `most_bytes`; [`ErrorKind::InvalidData`], with what helps, if it is a
/// kind of file that is never meant ([`file_kind`]).
pub fn read(path: &Path, most_bytes: u64) -> io::Result<Vec<u8>> {
    let file = open(path)?;
    // Nothing is read of what is too large already.
    check_size(file.metadata()?.len(), most_bytes)?;
    let bytes = read_all(file, most_bytes)?;
    match file_kind::mistaken(&bytes) {
        Some(words) => Err(io::Error::new(ErrorKind::InvalidData, words)),
        None => Ok(bytes),
    }
}

/// All that comes out of a stream, such as standard input.
///
/// # Errors
/// The system's error; [`ErrorKind::FileTooLarge`] beyond `most_bytes`.
pub fn read_all(stream: impl Read, most_bytes: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    stream.take(most_bytes.saturating_add(1)).read_to_end(&mut bytes)?;
    check_size(bytes.len() as u64, most_bytes)?;
    Ok(bytes)
}

fn check_size(bytes: u64, most_bytes: u64) -> io::Result<()> {
    if bytes <= most_bytes {
        return Ok(());
    }
    let said = format!("it is larger than {most_bytes} bytes, the most that is read of such a file");
    Err(io::Error::new(ErrorKind::FileTooLarge, said))
}

/// The content of a regular file as text, without the byte order mark that editors of Windows put before it.
///
/// # Errors
/// As [`read`]; [`ErrorKind::InvalidData`], with the line, if it is not UTF-8.
pub fn read_text(path: &Path, most_bytes: u64) -> io::Result<String> {
    text(read(path, most_bytes)?)
}

/// The text that these bytes of a file are, as [`read_text`] returns it.
///
/// # Errors
/// [`ErrorKind::InvalidData`], with the line, if they are not UTF-8.
pub fn text(bytes: Vec<u8>) -> io::Result<String> {
    if is_utf16(&bytes) {
        return Err(io::Error::new(ErrorKind::InvalidData, UTF16));
    }
    let text = String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = 1 + valid.iter().filter(|&&byte| byte == b'\n').count();
        let said = format!("line {line} is not UTF-8 text; save the file as UTF-8");
        io::Error::new(ErrorKind::InvalidData, said)
    })?;
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}

/// Whether a file begins as text in UTF-16 does, which Windows calls Unicode.
pub fn is_utf16(begin: &[u8]) -> bool {
    begin.starts_with(&[0xff, 0xfe]) || begin.starts_with(&[0xfe, 0xff])
}

/// What to say of such a file.
pub const UTF16: &str = "it is UTF-16 text; save the file as UTF-8";

fn check(found: &Metadata) -> io::Result<()> {
    if found.is_file() {
        return Ok(());
    }
    Err(no_regular_file(found.file_type()))
}

fn no_regular_file(found: FileType) -> io::Error {
    io::Error::new(ErrorKind::InvalidInput, format!("it is {}, no regular file", kind(found)))
}

fn kind(found: FileType) -> &'static str {
    if found.is_dir() {
        "a directory"
    } else if found.is_fifo() {
        "a pipe"
    } else if found.is_socket() {
        "a socket"
    } else {
        "a device"
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::ffi::OsStrExt;

    /// A directory of its own, removed at the end.
    struct Place(std::path::PathBuf);

    impl Place {
        fn new(name: &str) -> Self {
            let path = std::env::temp_dir().join(format!("input-file-{name}-{}", std::process::id()));
            std::fs::create_dir_all(&path).expect("a directory in TMPDIR");
            Self(path)
        }

        fn write(&self, bytes: &[u8]) -> std::path::PathBuf {
            let path = self.0.join("file");
            std::fs::write(&path, bytes).expect("our own directory");
            path
        }
    }

    impl Drop for Place {
        fn drop(&mut self) {
            let _ = std::fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn a_file_is_read_up_to_its_bound_and_refused_beyond() {
        let place = Place::new("bound");
        let path = place.write(b"abc\n");
        assert_eq!(read(&path, 4).expect("as long as allowed"), b"abc\n");
        let refused = read(&path, 3).expect_err("one byte too long");
        assert_eq!(refused.kind(), ErrorKind::FileTooLarge);
        assert!(refused.to_string().contains("larger than 3 bytes"), "{refused}");
        assert_eq!(read(&place.write(b""), 0).expect("nothing is no more than nothing"), b"");
    }

    #[test]
    fn a_stream_that_never_ends_is_read_up_to_its_bound() {
        assert_eq!(read_all(&b"abc"[..], 3).expect("as long as allowed"), b"abc");
        let refused = read_all(io::repeat(b' '), 1 << 16).expect_err("it never ends");
        assert_eq!(refused.kind(), ErrorKind::FileTooLarge);
    }

    #[test]
    fn a_file_of_holes_that_is_too_large_is_not_read() {
        let place = Place::new("holes");
        let path = place.write(b"");
        File::options().write(true).open(&path).expect("our own").set_len(1 << 40).expect("holes");
        // Reading it would take hours and all memory.
        assert_eq!(read(&path, 1 << 39).expect_err("too large").kind(), ErrorKind::FileTooLarge);
    }

    #[test]
    fn what_is_not_text_is_told_with_its_line() {
        let place = Place::new("text");
        let refused = read_text(&place.write(b"a\nb\n\xff\n"), 100).expect_err("no text");
        assert_eq!(refused.to_string(), "line 3 is not UTF-8 text; save the file as UTF-8");
        assert_eq!(read_text(&place.write("ä".as_bytes()), 100).expect("text"), "ä");
        assert_eq!(read_text(&place.write("\u{feff}ä\u{feff}".as_bytes()), 100).expect("text"), "ä\u{feff}");
        for utf16 in [b"\xff\xfet\0,\0", b"\xfe\xff\0t\0,"] {
            let refused = read_text(&place.write(utf16), 100).expect_err("no UTF-8");
            assert_eq!(refused.to_string(), "it is UTF-16 text; save the file as UTF-8");
        }
    }

    #[test]
    fn a_pipe_without_a_writer_a_device_and_a_directory_are_refused_at_once() {
        let place = Place::new("kinds");
        let pipe = place.0.join("pipe");
        nix::unistd::mkfifo(&pipe, nix::sys::stat::Mode::S_IRWXU).expect("a pipe");
        let link = place.0.join("link");
        std::os::unix::fs::symlink(&pipe, &link).expect("a link");
        let zero = Path::new("/dev/zero");
        for (path, found) in
            [(&*pipe, "a pipe"), (&*link, "a pipe"), (zero, "a device"), (&*place.0, "a directory")]
        {
            let refused = read(path, 100).expect_err("no file");
            assert_eq!(refused.kind(), ErrorKind::InvalidInput, "{}", path.display());
            assert_eq!(refused.to_string(), format!("it is {found}, no regular file"));
        }
    }

    #[test]
    fn a_pipe_is_read_to_its_end_if_somebody_writes_it_and_refused_at_once_if_nobody_does() {
        use std::io::Write;
        let place = Place::new("stream");
        let pipe = place.0.join("pipe");
        nix::unistd::mkfifo(&pipe, nix::sys::stat::Mode::S_IRWXU).expect("a pipe");
        let refused = open_stream(&pipe).map(drop).expect_err("nobody writes it").to_string();
        assert!(refused.contains("nobody writes this pipe"), "{refused}");
        let both = File::options().read(true).write(true).open(&pipe).expect("our own");
        let mut writer = File::options().write(true).open(&pipe).expect("it has a reader");
        let silent = open_stream(&pipe).expect("a writer who has written nothing yet");
        writer.write_all(b"abc").expect("room");
        drop(writer);
        drop(both);
        assert_eq!(read_all(silent, 9).expect("all of it"), b"abc");
        assert_eq!(read_all(open_stream(&place.write(b"abc")).expect("a file"), 9).expect("all"), b"abc");
        assert!(open_stream(&place.0).is_err(), "a directory");
    }

    #[test]
    fn links_in_a_circle_and_names_that_cannot_be_are_the_systems_own_errors() {
        let place = Place::new("links");
        let [a, b] = ["a", "b"].map(|name| place.0.join(name));
        std::os::unix::fs::symlink(&a, &b).expect("a link");
        std::os::unix::fs::symlink(&b, &a).expect("a link");
        assert_eq!(open(&a).expect_err("a circle").raw_os_error(), Some(libc::ELOOP));
        assert_eq!(open(Path::new("")).expect_err("no name").kind(), ErrorKind::NotFound);
        let with_zero = Path::new(std::ffi::OsStr::from_bytes(b"a\0b"));
        assert_eq!(open(with_zero).expect_err("no name").kind(), ErrorKind::InvalidInput);
    }
}
