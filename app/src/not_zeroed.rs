//! Devices that do not know where they are: what a person has to do before anything can be felt.

use io_driver::status;
use shm_abi::{DriverView, Frame, endpoint};
use std::path::Path;
use std::time::{Duration, Instant};

/// A driver that has just been started tells its first frame within a tick.
const FIRST_FRAME: Duration = Duration::from_secs(1);

/// The newest frame, and of a driver that has just been started, its first.
pub(crate) fn first_frame(driver: &DriverView) -> Option<Frame> {
    let begun = Instant::now();
    while driver.latest_tick().is_none() && begun.elapsed() < FIRST_FRAME {
        std::thread::sleep(Duration::from_millis(1));
    }
    driver.read_latest()
}

/// Which devices of the driver at `socket` have to be zeroed, and how; `None`: none has to.
pub(crate) fn words(driver: &DriverView, socket: &Path) -> Option<String> {
    first_frame(driver);
    let names = status::not_zeroed(driver);
    if names.is_empty() {
        return None;
    }
    let command = names.iter().fold("io-driver zero".to_owned(), |line, name| line + " --device " + name);
    let place = place(socket);
    Some(format!(
        "the driver does not know yet where its device {} is, and until then no device gets force; \
         bring it into its zeroing pose, then `{command}{place}` (or `phantom3 driver zero ...`)",
        names.join(", nor where its device ")
    ))
}

/// Option that names the driver at this socket to `io-driver`; empty where it finds that by itself.
pub(crate) fn place(socket: &Path) -> String {
    if socket == endpoint::for_application() {
        String::new()
    } else {
        format!(" --socket {}", socket.display())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_socket_that_a_driver_program_does_not_find_by_itself_is_named() {
        assert_eq!(place(&endpoint::for_application()), "");
        assert_eq!(place(Path::new("/elsewhere/driver.sock")), " --socket /elsewhere/driver.sock");
    }
}
