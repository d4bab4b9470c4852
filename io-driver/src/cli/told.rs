//! Driver's memory for tests of commands that believe a frame alone.

use shm_abi::DriverMemory;
use shm_abi::doorbell::WaitMode;
use shm_abi::segment::{ClockMode, DriverInfo};

/// Memory of a driver that has told nothing.
pub(crate) fn memory() -> DriverMemory {
    let info = DriverInfo {
        period_ns: 1_000_000,
        reply_budget_ns: 500_000,
        max_command_age_ticks: 4,
        ramp_in_ticks: 20,
        ramp_out_ticks: 5,
        clock_mode: ClockMode::Real,
        wait_mode: WaitMode::Futex,
        is_commissioning: false,
        cpu: None,
        devices: Vec::new(),
        setup_report: String::new(),
    };
    DriverMemory::create(&info).expect("memory")
}
