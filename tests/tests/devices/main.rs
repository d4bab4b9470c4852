//! Devices on real processes, from the first trial to three at once.

mod calibration;
mod commissioning;
mod damping_is_calm;
mod emulated_arm;
mod switches;
mod three_phantoms;
mod three_phantoms_driver;
mod zeroing;
