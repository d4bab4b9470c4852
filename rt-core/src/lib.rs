//! What every hard real-time loop on Linux needs, and nothing about haptics.
//!
//! Problem: a loop that must act every millisecond is lost to details of the operating system:
//! a page fault, a frequency change, a log line, a signal, a promotion that silently did nothing.
//! Each module here deals with one of them.
//!
//! | before the loop | inside the loop | when it ends |
//! |---|---|---|
//! | [`setup`]: scheduling, CPU, memory, each read back | [`periodic`]: wake on an absolute grid | [`signals`]: asked to stop, as a flag |
//! | [`cpu`]: which CPUs there are | [`histogram`]: latencies without allocation | [`epitaph`]: a dying process says why |
//! | [`privileges`], [`sandbox`]: give up what the loop does not need | | |
//! | [`process`]: die with the parent | [`log`]: messages formatted by another thread | [`usage`]: faults and switches it suffered |
//!
//! [`calibrate`] measures how long a loop has to spin, [`spin_margin`] learns it, and [`phase_keeper`] steps
//! aside from what comes at the same phase. [`last_act`] is what a
//! dying process still stores to the hardware. [`clock`] is under all of them, and [`alloc_guard`] lets a test
//! show that a loop does not allocate.
//! [`input_file`] reads files that others name, [`output_file`] opens those to be written, [`replacement`] has them
//! take their places when they are whole, [`separators`] and [`toml_slips`] know what is usually wrong
//! in tables and in TOML, [`type_words`] how types are called, [`likeness`] which word was meant, [`limits`] what to do where the system has no more to give,
//! and [`plain_text`] keeps foreign text from acting on a terminal.
//! [`doctor`] says whether the machine is ready for any of this, [`read_back`] what root has set for it, and
//! [`installed`] names what a laboratory's installation consists of.
//!
//! Invariants: what a module marks as fit for the loop neither allocates nor locks nor opens a file
//! nor panics; `unsafe` code lives in the private module `sys` alone; nothing is assumed from a
//! return code that can be read back from the kernel.

#![deny(unsafe_code)]

pub mod alloc_guard;
pub mod calibrate;
pub mod clock;
pub mod cpu;
pub mod doctor;
pub mod epitaph;
pub mod file_kind;
pub mod histogram;
pub mod input_file;
pub mod installed;
pub mod last_act;
pub mod likeness;
pub mod limits;
pub mod log;
pub mod output_file;
pub mod periodic;
pub mod phase_keeper;
pub mod plain_text;
pub mod privileges;
pub mod process;
pub mod read_back;
pub mod replacement;
pub mod sandbox;
pub mod schedule;
pub mod separators;
pub mod setup;
pub mod signals;
pub mod spin_margin;
pub mod time_namespace;
pub mod toml_slips;
pub mod type_words;
pub mod usage;

#[allow(unsafe_code, reason = "the one place for system calls that no safe crate wraps")]
mod sys;

mod call_names;

#[cfg(test)]
mod test_child;
