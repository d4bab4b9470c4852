//! Kinds of files that are never what was meant, told by their first bytes.
//!
//! Problem: a checkout without Git LFS has small texts in place of its models; what is downloaded is often packed, or the
//! page that shows the file. A parser would name line 1 and a keyword that nobody wrote.
//! Model: the first bytes of such kinds, which no file that we read begins with, and what helps.

/// So many bytes are enough to tell.
pub const BEGIN_BYTES: usize = 64;

/// What the file is, and what helps; `None`: it may be what was meant.
pub fn mistaken(begin: &[u8]) -> Option<&'static str> {
    let is_kind = |(kind, _): &&(&[u8], _)| {
        begin.get(..kind.len()).is_some_and(|first| first.eq_ignore_ascii_case(kind))
    };
    KINDS.iter().find(is_kind).map(|(_, words)| *words)
}

/// The same where no picture can be meant either.
pub fn mistaken_for_text(begin: &[u8]) -> Option<&'static str> {
    let pictures: [&[u8]; 3] = [b"\x89PNG", b"\xff\xd8\xff", b"GIF8"];
    let is_picture = pictures.iter().any(|kind| begin.starts_with(kind));
    mistaken(begin).or_else(|| is_picture.then_some("it is a picture; name the file itself"))
}

const KINDS: [(&[u8], &str); 9] = [
    (b"\x1f\x8b", "it is compressed by gzip; unpack it with gunzip"),
    (b"\xfd7zXZ\0", "it is compressed by xz; unpack it with unxz"),
    (b"BZh", "it is compressed by bzip2; unpack it with bunzip2"),
    (b"\x28\xb5\x2f\xfd", "it is compressed by zstd; unpack it with unzstd"),
    (b"PK\x03\x04", "it is a ZIP archive, as spreadsheets are; unpack it, or save the table as CSV"),
    (
        b"version https://git-lfs.github.com/spec/",
        "it is a pointer of Git LFS, which stands for the file; fetch the file with `git lfs pull`",
    ),
    (b"<!DOCTYPE html", WEB_PAGE),
    (b"<html", WEB_PAGE),
    (b"%PDF-", "it is a PDF document; name the file itself"),
];

const WEB_PAGE: &str = "it is a page of the web; download the file that the page shows";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_packed_or_stands_for_a_file_is_told_and_what_only_begins_so_is_not() {
        let pointer = b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n";
        assert!(mistaken(pointer).is_some_and(|words| words.contains("git lfs pull")));
        assert!(mistaken(b"\x1f\x8b\x08").is_some_and(|words| words.contains("gunzip")));
        assert!(mistaken(b"<!doctype HTML><title>").is_some_and(|words| words.contains("page")));
        assert_eq!(mistaken(b"\x89PNG\r\n"), None);
        assert!(mistaken_for_text(b"\x89PNG\r\n").is_some_and(|words| words.contains("picture")));
        assert!(KINDS.iter().all(|(kind, _)| kind.len() <= BEGIN_BYTES));
        for other in [&b""[..], b"\x1f", b"PK", b"version 1", b"v 0 0 0\n", b"solid PK\x03\x04"] {
            assert_eq!(mistaken(other), None, "{}", other.escape_ascii());
        }
    }
}
