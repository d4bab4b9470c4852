//! Names that the programs share with what `config/system/install.sh` puts on a machine.
//!
//! Remedies and the fix plan name these, so that a machine set up by either has one group and no file twice; a
//! test compares them with the installed files.

/// Whoever is in this group may command the devices and run real-time threads.
pub const GROUP: &str = "phantom3";

/// Sets at each boot what takes root, and undoes it when it is stopped.
pub const MACHINE_UNIT: &str = "phantom3-machine.service";

/// Where units are put.
pub const UNITS: &str = "/etc/systemd/system";

/// Runs the driver.
pub const DRIVER_UNIT: &str = "phantom3-driver.service";

/// Made by [`DRIVER_UNIT`] for the driver's socket.
pub const RUNTIME_DIRECTORY: &str = "/run/phantom3";

/// Which CPUs [`MACHINE_UNIT`] keeps free: `LOOP_CPU=N`, `FAST_CPU=N`.
pub const MACHINE_CONF: &str = "/etc/phantom3/machine.conf";

/// Where [`MACHINE_UNIT`] publishes what it set and read back; see [`crate::read_back`].
pub const READ_BACK: &str = "/run/phantom3-machine/read-back";

/// Lets the group hold `/dev/cpu_dma_latency`, which Debian leaves to root.
pub const LATENCY_RULE: &str =
    "SUBSYSTEM==\"misc\", KERNEL==\"cpu_dma_latency\", GROUP=\"phantom3\", MODE=\"0660\"";
