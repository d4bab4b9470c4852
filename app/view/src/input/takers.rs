//! Receivers that keep what they took, to be done when all has been told.

use super::action::Action;
use super::bindings::Bound;
use super::code::code;
use super::router::{Receiver, Told};
use crate::news::KeyChange;
use eframe::egui::Event;

/// Takes the actions that it likes.
pub struct Actions<'l> {
    likes: &'l dyn Fn(Action) -> bool,
    /// Those that are to be done, in the order in which they came.
    pub taken: Vec<Bound>,
}

impl<'l> Actions<'l> {
    /// Of those that it likes.
    pub fn new(likes: &'l dyn Fn(Action) -> bool) -> Self {
        Self { likes, taken: Vec::new() }
    }
}

impl Receiver for Actions<'_> {
    fn take(&mut self, told: &Told<'_>) -> bool {
        let Event::Key { pressed, repeat, .. } = told.event else { return false };
        let Some(bound) = told.bound.filter(|bound| (self.likes)(bound.action)) else { return false };
        if *pressed && (!*repeat || bound.action.repeats()) {
            self.taken.push(bound);
        }
        true
    }
}

/// Takes the keys that are bound to nothing: so an experiment's recording has them.
pub struct Unbound<'t> {
    time_ns: &'t mut dyn FnMut(u32, bool) -> u64,
    /// In the order in which they came.
    pub keys: Vec<KeyChange>,
}

impl<'t> Unbound<'t> {
    /// With somebody who says when a key of this number went down or up.
    pub fn new(time_ns: &'t mut dyn FnMut(u32, bool) -> u64) -> Self {
        Self { time_ns, keys: Vec::new() }
    }
}

impl Receiver for Unbound<'_> {
    fn take(&mut self, told: &Told<'_>) -> bool {
        let Event::Key { key, pressed, repeat, .. } = told.event else { return false };
        if told.bound.is_some() {
            return false;
        }
        if let Some(code) = code(*key).filter(|_| !repeat) {
            let at_ns = (self.time_ns)(code, *pressed);
            self.keys.push(KeyChange { code, is_pressed: *pressed, at_ns });
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::{Bindings, Router, Step};
    use eframe::egui::{Key, Modifiers};

    fn key(key: Key, pressed: bool, repeat: bool) -> Event {
        Event::Key { key, physical_key: None, pressed, repeat, modifiers: Modifiers::NONE }
    }

    #[test]
    fn an_action_is_done_once_for_a_press_unless_it_is_one_of_steps() {
        let (bindings, mut router) = (Bindings::default(), Router::default());
        let mut all = Actions::new(&|_| true);
        for event in [
            key(Key::P, true, false),
            key(Key::P, true, true),
            key(Key::P, false, false),
            key(Key::K, true, false),
            key(Key::K, true, true),
            key(Key::K, false, false),
        ] {
            assert_eq!(router.tell(&event, &bindings, &mut [&mut all]), Some(0));
        }
        let done: Vec<Action> = all.taken.iter().map(|bound| bound.action).collect();
        let stiffer = Action::Stiffness(Step::More);
        assert_eq!(done, [Action::Pause, stiffer, stiffer]);
    }

    #[test]
    fn keys_that_are_bound_to_nothing_are_told_with_their_times_and_others_are_not() {
        let (bindings, mut router) = (Bindings::default(), Router::default());
        let mut clock_ns = 0;
        let mut time_ns = |_, _| {
            clock_ns += 7;
            clock_ns
        };
        let (mut none, mut unbound) = (Actions::new(&|_| false), Unbound::new(&mut time_ns));
        for event in [
            key(Key::Y, true, false),
            key(Key::Y, true, true),
            key(Key::Y, false, false),
            key(Key::P, true, false),
            key(Key::P, false, false),
            key(Key::F35, true, false),
        ] {
            router.tell(&event, &bindings, &mut [&mut none, &mut unbound]);
        }
        let change = |code, is_pressed, at_ns| KeyChange { code, is_pressed, at_ns };
        assert_eq!(unbound.keys, [change(89, true, 7), change(89, false, 14), change(65504, true, 21)]);
    }
}
