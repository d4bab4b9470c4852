//! `io-driver end-lease`.
//!
//! Model: whose lease it was is what the frame before the request tells; with none there is nothing to end, which is
//! said, since whoever asks wants somebody's force away.

use super::{EXIT_USAGE, fail};
use crate::print::print_line;
use shm_abi::client;
use std::path::Path;
use std::process::ExitCode;

const NAME: &str = "io-driver";

/// Asks, and says what was ended.
pub(super) fn end_lease(socket: &Path) -> ExitCode {
    let frame = client::observe(socket, NAME).ok().and_then(|observer| observer.driver.read_latest());
    if let Err(error) = client::end_lease(socket, NAME) {
        return fail(&error, EXIT_USAGE);
    }
    print_line(&match frame.map(|frame| frame.lease) {
        Some(0) => "nobody commanded the devices".into(),
        Some(lease) => format!("lease {lease} is ended; its force ramps out"),
        None => "the lease is ended, if there was one: the driver has told no frame".to_owned(),
    });
    ExitCode::SUCCESS
}
