//! Safe wrappers round the few system and C library calls that no safe crate offers.
//!
//! Each file holds one concern and hides it behind functions that cannot be misused; the one
//! exception, [`fatal::install_fatal_handlers_with`], is `unsafe` and says what it asks for.

pub(crate) mod counting_allocator;
pub(crate) mod fatal;
pub(crate) mod malloc;
pub(crate) mod mapped_word;
pub(crate) mod sched;
pub(crate) mod stack;

#[cfg(test)]
pub(crate) mod shared_words;
