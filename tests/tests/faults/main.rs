//! Faults: something fails, is killed, lies or is in the way. Motors go off, words are said, work goes on.

mod app_killed;
mod app_stopped;
mod c_program;
mod campaign;
mod crowds;
mod descriptors;
mod devices;
mod driver_dies;
mod driver_gone;
mod full;
mod garbage;
mod held_terminal;
mod leases;
mod rivals;
mod service;
mod stops;
mod stuck_service;
mod versions;
