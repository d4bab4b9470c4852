//! `io-driver end-lease`.
//!
//! Model: whose lease it was is what the frame before the request tells; with none there is nothing to end, which is
//! said, since whoever asks wants somebody's force away. Whoever gets no place to look from is told so.

use super::{EXIT_USAGE, fail};
use crate::print::print_line;
use shm_abi::client;
use std::path::Path;
use std::process::ExitCode;

const NAME: &str = "io-driver";

/// Asks, and says what was ended.
pub(super) fn end_lease(socket: &Path) -> ExitCode {
    let lease =
        client::observe(socket, NAME).map(|observer| observer.driver.read_latest().map(|frame| frame.lease));
    if let Err(error) = client::end_lease(socket, NAME) {
        return fail(&error, EXIT_USAGE);
    }
    print_line(&match lease {
        Ok(Some(0)) => "nobody commanded the devices".into(),
        Ok(Some(lease)) => format!("lease {lease} is ended; its force ramps out"),
        Ok(None) => "the lease is ended, if there was one: the driver has told no frame".to_owned(),
        Err(error) => format!("the lease is ended, if there was one; whose it was cannot be seen: {error}"),
    });
    ExitCode::SUCCESS
}
