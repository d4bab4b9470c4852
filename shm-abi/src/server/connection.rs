//! One client of the server, and how far it has come.

use super::lapsed;
use super::places::{Owner, Purpose};
use crate::handshake::Request;
use crate::peer::{Peer, Process, has_unread};
use crate::segment::{LeaseOffer, TAKEN_WITHIN};
use bytemuck::Zeroable;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::net::RecvFlags;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

#[derive(Debug)]
pub(super) struct Connection {
    pub(super) stream: UnixStream,
    pub(super) peer: Peer,
    pub(super) stage: Stage,
    /// Purpose for which it was sent descriptors, if it was.
    purpose: Option<Purpose>,
}

#[derive(Debug)]
pub(super) enum Stage {
    /// Has sent so many bytes of its request.
    Asking { bytes: [u8; size_of::<Request>()], filled: usize, since: Instant },
    /// Got the driver's segment.
    Observing,
    /// Holds the lease, as long as this process lives.
    Commanding {
        lease: u64,
        name: String,
        process: Process,
        /// The loop knows nothing of the lease as long as there is one.
        offer: Option<Offer>,
    },
    /// To be forgotten, as soon as it holds nothing of ours.
    Gone,
}

/// Stages of a lease that is not in force yet.
#[derive(Debug)]
pub(super) enum Offer {
    /// Handed over.
    Made(LeaseOffer),
    /// Mapped by the commander; being sealed.
    Sealing { since: Instant },
}

impl Offer {
    /// Reason, in words.
    pub(super) fn why_overdue(&self) -> String {
        let seconds = TAKEN_WITHIN.as_secs();
        match self {
            Self::Made(_) => format!(
                "it has not mapped its memory within {seconds} s, or the memory of another is being sealed"
            ),
            Self::Sealing { .. } => {
                format!("its memory could not be sealed within {seconds} s: something writes into it")
            }
        }
    }

    /// True if it could have been mapped by now, and has not been.
    pub(super) fn is_idle(&self) -> bool {
        matches!(self, Self::Made(offer) if offer.is_idle(lapsed::MAPPED_WITHIN))
    }

    /// Mapped, and not being sealed because another one is.
    pub(super) fn waits_for_others(&self) -> bool {
        matches!(self, Self::Made(offer) if offer.is_mapped())
    }

    /// True if it had time enough.
    pub(super) fn is_overdue(&self) -> bool {
        match self {
            Self::Made(offer) => offer.is_overdue(),
            Self::Sealing { since } => since.elapsed() > TAKEN_WITHIN,
        }
    }
}

/// What a look at a connection brought.
pub(super) enum Heard {
    Nothing,
    Request(Request),
    End,
}

impl Connection {
    pub(super) fn new(stream: UnixStream, peer: Peer) -> Self {
        let stage = Stage::Asking { bytes: [0; size_of::<Request>()], filled: 0, since: Instant::now() };
        Self { stream, peer, stage, purpose: None }
    }

    /// Goes on to where its request has led it.
    pub(super) fn served(&mut self, stage: Stage) {
        match stage {
            Stage::Observing => self.purpose = Some(Purpose::Observe),
            Stage::Commanding { .. } => self.purpose = Some(Purpose::Command),
            Stage::Asking { .. } | Stage::Gone => {}
        }
        self.stage = stage;
    }

    pub(super) fn is_gone(&self) -> bool {
        matches!(self.stage, Stage::Gone)
    }

    /// True of one that is gone while descriptors that it was sent lie there unread: they count against the driver, so that it
    /// keeps its place.
    pub(super) fn left_descriptors(&self) -> bool {
        self.is_gone() && self.purpose.is_some() && has_unread(self.stream.as_fd())
    }

    /// True of one that has a place of this purpose: it looks on, or has left.
    pub(super) fn has_place(&self, purpose: Purpose) -> bool {
        self.purpose == Some(purpose) && (matches!(self.stage, Stage::Observing) || self.left_descriptors())
    }

    pub(super) fn owner(&self) -> Owner {
        Owner { user: self.peer.user(), pid: self.peer.pid }
    }

    pub(super) fn is_asking(&self) -> bool {
        matches!(self.stage, Stage::Asking { .. })
    }

    pub(super) fn receive(&mut self) -> Heard {
        let Stage::Asking { bytes, filled, .. } = &mut self.stage else {
            // Nothing is expected any more: this is the end, or a client that does not keep to the protocol.
            return Heard::End;
        };
        match rustix::net::recv(&self.stream, &mut bytes[*filled..], RecvFlags::empty()) {
            Ok((_, 0)) => return Heard::End,
            Ok((_, more)) => *filled += more,
            Err(errno) => return heard_error(errno),
        }
        if *filled < bytes.len() {
            return Heard::Nothing;
        }
        let mut request = Request::zeroed();
        bytemuck::bytes_of_mut(&mut request).copy_from_slice(bytes);
        Heard::Request(request)
    }

    /// Whether the other end hung up, or the process that holds the lease has ended; never blocks.
    pub(super) fn is_over(&self) -> bool {
        let mut fds = vec![PollFd::new(&self.stream, PollFlags::RDHUP)];
        fds.extend(self.process().map(|fd| PollFd::from_borrowed_fd(fd, PollFlags::IN)));
        poll(&mut fds, Some(&timespec(Duration::ZERO))).is_ok_and(|ready| ready > 0)
    }

    /// Readable when the process that holds the lease has ended.
    pub(super) fn process(&self) -> Option<BorrowedFd<'_>> {
        match &self.stage {
            Stage::Commanding { process, .. } => process.fd(),
            _ => None,
        }
    }

    /// The groups of the client's user.
    pub(super) fn groups(&self) -> Vec<u32> {
        self.peer.groups(self.stream.as_fd())
    }
}

fn heard_error(errno: Errno) -> Heard {
    if errno == Errno::AGAIN || errno == Errno::INTR { Heard::Nothing } else { Heard::End }
}

pub(super) fn timespec(duration: Duration) -> Timespec {
    Timespec {
        tv_sec: i64::try_from(duration.as_secs()).unwrap_or(i64::MAX),
        tv_nsec: duration.subsec_nanos().into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_may_come_later_is_no_end() {
        for errno in [Errno::AGAIN, Errno::INTR] {
            assert!(matches!(heard_error(errno), Heard::Nothing), "{errno}");
        }
        for errno in [Errno::CONNRESET, Errno::PIPE, Errno::BADF] {
            assert!(matches!(heard_error(errno), Heard::End), "{errno}");
        }
    }
}
