//! Registers that live as long as the process, found through an atomic pointer.

use std::sync::atomic::{AtomicPtr, AtomicU32, Ordering};

/// The register behind a place that holds null or what was once a `&'static AtomicU32`.
pub(crate) fn static_register(place: &AtomicPtr<AtomicU32>) -> Option<&'static AtomicU32> {
    // SAFETY: the places are private to `last_act`, which stores nothing but `&'static AtomicU32` there.
    unsafe { place.load(Ordering::SeqCst).as_ref() }
}
