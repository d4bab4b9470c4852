//! Safe wrappers round the few system and C library calls that no safe crate offers.
//!
//! Each file holds one concern and hides it behind functions that cannot be misused.

pub(crate) mod at_once;
pub(crate) mod capability;
pub(crate) mod counting_allocator;
pub(crate) mod fatal;
pub(crate) mod inherited;
pub(crate) mod malloc;
pub(crate) mod mapped_word;
pub(crate) mod sched;
pub(crate) mod seccomp;
pub(crate) mod stack;

mod static_registers;

pub(crate) use static_registers::static_register;

#[cfg(test)]
pub(crate) mod shared_words;
