//! The kernel's table of a network's Unix sockets, proc_pid_net(5).
//!
//! Problem: the kernel tells it in pieces, and leaves a socket out where another of its bucket is closed between two of them.
//! Model: it is read [`READINGS`] times, and all that was told counts: that it tells of a process already proves nothing, for
//! anybody can write lines into it.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;

/// Times that a network's table is read at most. Under a user who does nothing but close sockets, one reading of 300 had left
/// out one of 150.
const READINGS: usize = 3;

/// Knowledge of which sockets are a process's.
pub(super) enum Whose {
    /// It has those of these numbers.
    Held(BTreeSet<u64>),
    /// They were named by this number of a process.
    Named(u32),
}

/// The listening sockets that a network's table tells of, by their numbers; a connection that was taken has a line with the same
/// name and another number. One number may be told of with several names: by others, with a name that has an end of a line in it.
#[derive(Default)]
pub(super) struct Table {
    sockets: BTreeSet<(u64, Vec<u8>)>,
    readings: usize,
}

impl Table {
    /// Names under which the sockets of a process were made. The table is read at the first question.
    pub(super) fn sockets_of(
        &mut self,
        whose: &Whose,
        read: impl Fn() -> Option<Vec<u8>>,
    ) -> impl Iterator<Item = &Path> {
        let is_its = |number: u64, name: &[u8]| match whose {
            Whose::Held(held) => held.contains(&number),
            Whose::Named(pid) => process_of(name) == Some(*pid),
        };
        while self.readings < READINGS {
            let Some(text) = read() else { break };
            self.readings += 1;
            self.sockets.extend(text.split(|byte| *byte == b'\n').filter_map(socket_of));
        }
        let its = self.sockets.iter().filter(move |(number, name)| is_its(*number, name));
        its.map(|(_, name)| Path::new(OsStr::from_bytes(name)))
    }
}

/// Number and name of the listening socket that a line of the table tells of.
fn socket_of(line: &[u8]) -> Option<(u64, Vec<u8>)> {
    /// Of a stream, and that it listens.
    const TYPE_STREAM: &[u8] = b"0001";
    const FLAG_LISTENS: u32 = 0x1_0000;
    let mut rest = line;
    // Address, references, protocol, flags, type, state and number come before the name, which may have blanks.
    let fields = [(); 7].map(|()| {
        rest = rest.trim_ascii_start();
        let (field, after) = rest.split_at(rest.iter().position(|byte| *byte == b' ').unwrap_or(rest.len()));
        rest = after;
        field
    });
    let [_, _, _, flags, kind, _, number] = fields;
    let flags = u32::from_str_radix(str::from_utf8(flags).ok()?, 16).ok()?;
    let number = str::from_utf8(number).ok()?.parse().ok()?;
    let name = rest.strip_prefix(b" ")?;
    let is_of_a_file = !name.is_empty() && !name.starts_with(b"@");
    let is_one = kind == TYPE_STREAM && flags & FLAG_LISTENS != 0 && is_of_a_file;
    is_one.then(|| (number, name.to_vec()))
}

/// The number of the process that is to have made a socket of this name.
fn process_of(name: &[u8]) -> Option<u32> {
    let number = &name[without_number(name).len()..];
    str::from_utf8(number.strip_prefix(b".")?).ok()?.parse().ok()
}

/// The path that a socket has, by the name under which a driver made it.
pub(super) fn made_as(name: &Path) -> &Path {
    Path::new(OsStr::from_bytes(without_number(name.as_os_str().as_bytes())))
}

/// A name without the number behind it.
fn without_number(name: &[u8]) -> &[u8] {
    match name.iter().rposition(|byte| *byte == b'.') {
        Some(at) if !name[at + 1..].is_empty() && name[at + 1..].iter().all(u8::is_ascii_digit) => {
            &name[..at]
        }
        _ => name,
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    fn line(number: u64, name: &str) -> String {
        format!("0000000000000000: 00000002 00000000 00010000 0001 01 {number} {name}\n")
    }

    #[test]
    fn a_line_of_the_table_names_the_socket_that_listens() {
        let told = line(114_705, "/run/a b/driver.sock.77");
        let name = b"/run/a b/driver.sock.77".to_vec();
        assert_eq!(socket_of(told.trim_end().as_bytes()), Some((114_705, name.clone())));
        assert_eq!((process_of(&name), without_number(&name)), (Some(77), &b"/run/a b/driver.sock"[..]));
        let stop = b"/run/x.stop.77";
        assert_eq!((process_of(stop), without_number(stop)), (Some(77), &b"/run/x.stop"[..]));
        for other in [&b"/run/driver.sock"[..], b"/run/driver.", b"/run/driver.7a", b""] {
            assert_eq!((process_of(other), without_number(other)), (None, other));
        }
        for other in [
            "Num       RefCount Protocol Flags    Type St Inode Path",
            "0000000000000000: 00000003 00000000 00000000 0001 03 114707",
            "0000000000000000: 00000002 00000000 00000000 0002 01 114706 /run/driver.sock.stop.77",
            "0000000000000000: 00000003 00000000 00000000 0001 03 114709 /run/driver.sock.77",
            "0000000000000000: 00000002 00000000 00010000 0001 01 114705 @hidden.77",
            "",
        ] {
            assert_eq!(socket_of(other.as_bytes()), None, "{other}");
        }
    }

    fn names(table: &mut Table, whose: &Whose, text: &str) -> Vec<String> {
        let read = || Some(text.as_bytes().to_vec());
        table.sockets_of(whose, read).map(|name| made_as(name).display().to_string()).collect()
    }

    /// Whoever names a socket by another process's number does not give it to that one.
    #[test]
    fn a_process_has_the_sockets_that_it_holds_and_not_those_of_its_number() {
        let text =
            line(5, "/run/driver.sock.77") + &line(6, "/tmp/decoy.77") + &line(7, "/run/other.sock.78");
        let held = |numbers: &[u64]| Whose::Held(numbers.iter().copied().collect());
        assert_eq!(names(&mut Table::default(), &held(&[5, 9]), &text), ["/run/driver.sock"]);
        assert!(names(&mut Table::default(), &held(&[9]), &text).is_empty());
        // Of one whose descriptors we may not see, both.
        assert_eq!(
            names(&mut Table::default(), &Whose::Named(77), &text),
            ["/run/driver.sock", "/tmp/decoy"]
        );
    }

    #[test]
    fn a_driver_that_a_reading_left_out_is_found_by_the_next() {
        let readings = Cell::new(0);
        let text = |number: u64| line(number, &format!("/run/{number}.sock.{number}")).into_bytes();
        let read = || {
            readings.set(readings.get() + 1);
            Some(if readings.get() == 1 { text(77) } else { text(78) })
        };
        let of = |number: u64| Whose::Held([number].into());
        let mut table = Table::default();
        assert_eq!(table.sockets_of(&of(78), read).collect::<Vec<_>>(), [Path::new("/run/78.sock.78")]);
        assert_eq!(table.sockets_of(&of(77), read).count(), 1, "of an earlier reading");
        // Many who have no socket cost no more than one.
        for number in 0..5 {
            assert_eq!(table.sockets_of(&of(number), read).count(), 0);
        }
        assert_eq!(readings.get(), READINGS);
        // Of a process that has ended there is nothing to read, which says nothing of others.
        let mut table = Table::default();
        assert_eq!(table.sockets_of(&of(78), || None).count(), 0);
        assert_eq!(table.sockets_of(&of(78), || Some(text(78))).count(), 1);
        // A line that anybody may have written ends no search.
        for whose in [of(78), Whose::Named(78)] {
            let (mut table, readings) = (Table::default(), Cell::new(0));
            let read = || {
                readings.set(readings.get() + 1);
                Some(text(78))
            };
            assert_eq!((table.sockets_of(&whose, read).count(), readings.get()), (1, READINGS));
        }
    }
}
