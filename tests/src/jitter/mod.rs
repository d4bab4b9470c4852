//! `jitter`: how late the real-time loops of this machine are, and why.
//!
//! Problem: a laboratory must know, before it trusts a machine with a force, what its latencies are over days; which
//! of its tweaks helped; and what the one spike was. Absolute figures of one run mean little, so ours, a reference and
//! the real programs take turns.
//!
//! | step | where |
//! |---|---|
//! | what is asked for | [`options`], [`plan`] |
//! | other processes, tied to this one | [`roles`], [`child`] |
//! | turns: a bare loop; cyclictest; driver and application | [`session`] over [`loop_slice`], [`cyclictest_slice`], [`driver_slice`] |
//! | every frame of the ring | [`observer`] |
//! | load | [`load`] |
//! | what is kept, in bounded memory | [`bank`], [`timeline`], [`worst`] |
//! | why: the kernel's books around an event | [`circumstances`], [`proc_books`], [`neighbours`], [`machine`] |
//! | results | [`document`], [`save`], [`table`], [`sheets`], [`pictures`] |
//! | verdicts | [`compare`], [`gate`], [`spread`] |
//!
//! Invariants: it observes read-only and from another CPU; memory is bounded for any duration; whatever ends it, the
//! results so far are written and no process is left.

pub mod bank;
pub mod child;
pub mod circumstances;
pub mod cli;
pub mod compare;
pub mod cyclictest;
pub mod cyclictest_slice;
pub mod document;
pub mod driver_slice;
pub mod error;
pub mod gate;
pub mod live;
pub mod load;
pub mod loop_slice;
pub mod machine;
pub mod metric;
pub mod neighbours;
pub mod observer;
pub mod options;
pub mod origin;
pub mod percentiles;
pub mod pictures;
pub mod plan;
pub mod proc_books;
pub mod roles;
pub mod save;
pub mod session;
pub mod sheets;
pub mod spread;
pub mod table;
pub mod timeline;
pub mod waiting_loop;
pub mod worst;
