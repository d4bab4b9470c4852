//! The thread that seals the segments of commanders.
//!
//! Problem: sealing takes the lock of the segment's file, uninterruptibly, and a commander that writes into that file holds it
//! for as long as the memory that it writes from takes to come.
//! Model: whoever serves hands an offer over and looks for the result in its later turns; an offer that takes too long is
//! forgotten, whatever becomes of it then.
//! Limit: while one offer is held up so, nobody else gets a lease, and a process that is killed ends when it is let go.

use crate::segment::{CommanderView, LeaseOffer, SegmentError};
use std::io;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};

/// Sealing touches pages, and no more.
const STACK_BYTES: usize = 128 * 1024;

/// The other end of it. It ends with this value, once it has nothing to seal.
#[derive(Debug)]
pub(super) struct Sealer {
    offers: SyncSender<(u64, LeaseOffer)>,
    results: Receiver<(u64, Result<CommanderView, SegmentError>)>,
}

impl Sealer {
    /// Starts the thread.
    ///
    /// # Errors
    /// Refusal by the system.
    pub(super) fn start() -> io::Result<Self> {
        let (offers, offered) = sync_channel::<(u64, LeaseOffer)>(0);
        let (tell, results) = sync_channel(MOST_RESULTS);
        let (tell_begun, begun) = sync_channel::<()>(0);
        let thread = std::thread::Builder::new().name("sealer".into()).stack_size(STACK_BYTES);
        thread.spawn(move || {
            drop(tell_begun);
            for (lease, offer) in offered {
                // Nobody who serves is left.
                if tell.send((lease, offer.seal())).is_err() {
                    break;
                }
            }
        })?;
        // A sandbox that is shut next may know nothing of the calls by which threads begin.
        let _ = begun.recv();
        Ok(Self { offers, results })
    }

    /// Begins to seal what this lease was offered; the offer itself where another one is being sealed.
    pub(super) fn begin(&self, lease: u64, offer: LeaseOffer) -> Result<(), LeaseOffer> {
        self.offers.try_send((lease, offer)).map_err(|refused| match refused {
            TrySendError::Full((_, offer)) | TrySendError::Disconnected((_, offer)) => offer,
        })
    }

    /// The result for an offer, and which lease's it was.
    pub(super) fn result(&self) -> Option<(u64, Result<CommanderView, SegmentError>)> {
        self.results.try_recv().ok()
    }
}

/// As many as come between two turns.
const MOST_RESULTS: usize = 4;
