//! The application Phantom3: fingers, scenes and the threads that make them felt.
//!
//! Problem: haptic rendering must answer the driver's every frame within the same tick, while files,
//! progress and people take the time they take.
//!
//! One tick is [`fast_step::FastStep`], pure; [`fast_loop::FastLoop`] puts it between the driver's frame and
//! the command that answers it. Who moves the clock: [`virtual_clock`] in one process, [`two_processes`]
//! with [`fast_thread`] in real time or in lockstep. The slow side is [`slow`]; what it records is [`record`], and
//! [`replay`] plays it again.

#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod attachment_totals;
pub mod book;
mod bounded_lines;
pub mod calibrate;
pub mod check;
pub mod child;
pub mod cli;
pub mod columns;
pub mod control;
pub mod convert;
pub mod demo;
pub mod displaced;
pub mod export;
pub mod fast_loop;
pub mod fast_step;
pub mod fast_thread;
mod interrupted;
pub mod lists_end;
pub mod live;
mod loading;
pub mod moments;
pub mod mount;
mod not_zeroed;
pub mod on_request;
pub mod outcome;
mod outputs;
pub mod pace;
pub mod passive_port;
mod per_shape;
pub mod picture;
pub mod plausible;
pub mod play;
pub mod premises;
pub mod progress;
pub mod record;
pub mod recording;
pub mod replay;
pub mod report;
pub mod rig;
pub mod room_supply;
pub mod row;
pub mod row_queue;
pub mod run;
pub mod settings;
pub mod shown;
pub mod simulated;
pub mod slow;
pub mod slow_thread;
pub mod snapshots;
pub mod spectator;
pub mod study;
pub mod two_processes;
pub mod virtual_clock;
