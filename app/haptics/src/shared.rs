//! A part that somebody else wrote, shared by all who use it.

use std::fmt;
use std::ops::Deref;
use std::sync::Arc;

/// An `Arc` that is equal to its clones only: what it holds need not be comparable.
pub struct Shared<T: ?Sized>(Arc<T>);

impl<T: ?Sized> From<Arc<T>> for Shared<T> {
    fn from(part: Arc<T>) -> Self {
        Self(part)
    }
}

impl<T: ?Sized> Clone for Shared<T> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<T: ?Sized> Deref for Shared<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0
    }
}

impl<T: ?Sized> PartialEq for Shared<T> {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl<T: ?Sized + fmt::Debug> fmt::Debug for Shared<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
