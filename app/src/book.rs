//! What the numbers in a run's events stand for, as far as that changes while it goes on: which order, which scene.
//!
//! Model: the slow side writes down what it sends before it sends it, so whoever finds a number in an event finds what it
//! means. Nobody here is a real-time thread.

use crate::columns::Names;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Shared by whoever sends orders and whoever writes events down.
#[derive(Debug, Clone, Default)]
pub struct Book(Arc<Mutex<Pages>>);

#[derive(Debug, Default)]
struct Pages {
    orders: Vec<String>,
    scenes: Vec<(String, Names)>,
}

impl Book {
    /// An order in words; answers its number, the next one.
    pub fn add_order(&self, words: &str) -> u64 {
        let mut pages = self.pages();
        pages.orders.push(words.into());
        pages.orders.len() as u64 - 1
    }

    /// The order of this number, in words; empty if there is none.
    pub fn order(&self, number: u64) -> String {
        self.pages().orders.get(number as usize).cloned().unwrap_or_default()
    }

    /// Another scene, what it is called, and whom its numbers mean. The first to be added has the number 1: 0 is that with
    /// which the run began.
    pub fn add_scene(&self, name: &str, names: Names) -> u32 {
        let mut pages = self.pages();
        pages.scenes.push((name.into(), names));
        pages.scenes.len() as u32
    }

    /// The scene of this number, if it is none that the run began with.
    pub fn scene(&self, number: u32) -> Option<(String, Names)> {
        self.pages().scenes.get((number as usize).checked_sub(1)?).cloned()
    }

    fn pages(&self) -> MutexGuard<'_, Pages> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
