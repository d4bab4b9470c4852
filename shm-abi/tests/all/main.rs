//! Tests of the contract over real memory, sockets and child processes.
//!
//! One program: each costs the time to link it, and tests of one program share the cores. `c_header` and `golden` have programs
//! of their own, since the headers and sources name them; `loom_protocol` has one for the words that loom brings.

#[path = "../common/mod.rs"]
mod common;

mod c_client;
mod changelog;
mod concurrent;
mod crowds_and_garbage;
mod handover;
mod held_seal;
mod minor_versions;
mod other_processes;
mod refusals;
mod sealed_memory;
mod signal_handlers;
mod socket_places;
mod stop_datagram;
mod turns;
