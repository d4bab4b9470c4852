//! A commander that holds up the seal of its own segment.

use crate::common::desk::{Desk, SHORT, is_closed};
use crate::common::wait_until;
use patience::prelude::*;
use shm_abi::CommanderMemory;
use shm_abi::handshake::RequestKind;
use shm_abi::segment::TAKEN_WITHIN;
use shm_abi::server::ServerEvent;
use std::fs::File;
use std::io::Read;
use std::os::fd::{AsFd, AsRawFd, FromRawFd, OwnedFd};
use std::thread::JoinHandle;

/// Sealing waits for whoever writes into the file, and a write waits for the memory that it takes bytes from.
#[test]
fn whoever_writes_while_its_segment_is_to_be_sealed_holds_up_nobody_but_the_next_lease() {
    let mut desk = Desk::open();
    let (mut holder, fd) = desk.offered(RequestKind::Command);
    let fd = fd.expect("the segment");
    let Some(writer) = HeldWriter::start(&fd) else {
        println!("skipped: no memory that can be withheld (userfaultfd) for this user");
        return;
    };
    CommanderMemory::map(fd.as_fd()).unwrap();
    let begun = std::time::Instant::now();
    patience::watched(patience::limit(), "the service goes on", || {
        while begun.elapsed() < TAKEN_WITHIN {
            desk.granted(RequestKind::Observe);
        }
    });
    wait_until("the holder's offer is forgotten", || {
        desk.poll(SHORT);
        has_ended(&holder)
    });
    assert!(is_closed(&mut holder));
    // Nobody has got a lease, and the reason is told.
    let [ServerEvent::Trouble { message }] = &desk.events[..] else { panic!("{:?}", desk.events) };
    assert!(message.contains("could not be sealed within 2 s"), "{message}");
    writer.let_go();
    // What is sealed at last was nobody's any more, and the next one gets a lease of its own.
    desk.granted(RequestKind::Command);
}

fn has_ended(stream: &std::os::unix::net::UnixStream) -> bool {
    stream.set_nonblocking(true).unwrap();
    let ended = matches!((&*stream).read(&mut [0; 1]), Ok(0));
    stream.set_nonblocking(false).unwrap();
    ended
}

/// A thread that writes into a file from memory that does not come.
struct HeldWriter {
    withheld: OwnedFd,
    thread: JoinHandle<()>,
}

impl HeldWriter {
    /// Returns once it holds the file; `None` where the system does not let us withhold memory.
    fn start(file: &OwnedFd) -> Option<Self> {
        const PAGE: usize = 4096;
        // SAFETY: a system call that makes a descriptor.
        let made = unsafe { libc::syscall(libc::SYS_userfaultfd, libc::O_CLOEXEC) };
        // SAFETY: it is ours alone.
        let withheld = (made >= 0).then(|| unsafe { OwnedFd::from_raw_fd(made as i32) })?;
        let page = memmap2::MmapOptions::new().len(PAGE).map_anon().unwrap();
        let address = page.as_ptr() as u64;
        // `struct uffdio_api`, then `struct uffdio_register` for pages that are missing (linux/userfaultfd.h).
        ioctl(&withheld, 0xc018_aa3f, &mut [0xaa, 0, 0]);
        ioctl(&withheld, 0xc020_aa00, &mut [address, PAGE as u64, 1, 0]);
        let file = File::from(file.try_clone().unwrap());
        let thread = std::thread::spawn(move || {
            // SAFETY: the page lives until the call is over; nobody else looks at it.
            let written = unsafe { libc::pwrite(file.as_raw_fd(), page.as_ptr().cast(), 1, 0) };
            // It may have been sealed meanwhile.
            assert!(written == 1 || written == -1);
        });
        let mut fault = [0; 32];
        let mut events = File::from(withheld.try_clone().unwrap());
        patience::watched(patience::limit(), "the writer waits for its page", || {
            events.read_exact(&mut fault).unwrap();
        });
        Some(Self { withheld, thread })
    }

    /// Whoever waits for the page gets an empty one.
    fn let_go(self) {
        drop(self.withheld);
        self.thread.bounded_join().unwrap();
    }
}

fn ioctl<const WORDS: usize>(fd: &OwnedFd, request: u64, words: &mut [u64; WORDS]) {
    // SAFETY: the structure of this request has so many words.
    let result = unsafe { libc::ioctl(fd.as_raw_fd(), request as libc::Ioctl, words.as_mut_ptr()) };
    assert_eq!(result, 0, "{request:x}: {}", std::io::Error::last_os_error());
}
