//! Who gets what people do.

use super::bindings::{Bindings, Bound};
use eframe::egui::{Event, Key, Modifiers, PointerButton, Pos2};

/// What somebody did.
#[derive(Debug, Clone, Copy)]
pub struct Told<'e> {
    /// As the window got it.
    pub event: &'e Event,
    /// What the key means, if it is bound to anything.
    pub bound: Option<Bound>,
}

/// Somebody who may take what people do.
pub trait Receiver {
    /// Whether it was for this receiver: then nobody after it gets it.
    fn take(&mut self, told: &Told<'_>) -> bool;
}

/// Tells receivers, one after the other, until one takes it. A key or a button that was pressed for one of them is let go
/// for the same, whoever would take it by then.
#[derive(Debug, Default)]
pub struct Router {
    held: Vec<Hold>,
}

#[derive(Debug, Clone, Copy)]
struct Hold {
    held: Held,
    taker: Option<usize>,
    /// What it meant when it was pressed.
    bound: Option<Bound>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Held {
    Key(Key),
    Button(PointerButton),
}

impl Router {
    /// Tells the receivers, who are the same in the same order every time; says which of them took it.
    pub fn tell(
        &mut self,
        event: &Event,
        bindings: &Bindings,
        receivers: &mut [&mut dyn Receiver],
    ) -> Option<usize> {
        let change = change(event);
        if let Some((held, false)) = change {
            let at = self.held.iter().position(|hold| hold.held == held)?;
            let Hold { taker, bound, .. } = self.held.swap_remove(at);
            let told = Told { event, bound };
            return taker.filter(|taker| receivers.get_mut(*taker).is_some_and(|taker| taker.take(&told)));
        }
        let bound = match event {
            Event::Key { key, modifiers, .. } => bindings.bound(*key, *modifiers),
            _ => None,
        };
        let told = Told { event, bound };
        let taker = receivers.iter_mut().position(|receiver| receiver.take(&told));
        if let Some((held, true)) = change {
            // A key that repeats stays with whom it was pressed for.
            if !self.held.iter().any(|hold| hold.held == held) {
                self.held.push(Hold { held, taker, bound });
            }
        }
        taker
    }

    /// Lets go of everything that is held: who looks away from the window is not told when keys are.
    pub fn let_go(&mut self, bindings: &Bindings, receivers: &mut [&mut dyn Receiver]) {
        for hold in self.held.clone() {
            let (pressed, modifiers) = (false, Modifiers::NONE);
            let event = match hold.held {
                Held::Key(key) => Event::Key { key, physical_key: None, pressed, repeat: false, modifiers },
                Held::Button(button) => Event::PointerButton { pos: Pos2::ZERO, button, pressed, modifiers },
            };
            self.tell(&event, bindings, receivers);
        }
    }
}

/// Which key or button an event is about, and whether it is pressed then.
fn change(event: &Event) -> Option<(Held, bool)> {
    match *event {
        Event::Key { key, pressed, .. } => Some((Held::Key(key), pressed)),
        Event::PointerButton { button, pressed, .. } => Some((Held::Button(button), pressed)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::Action;

    /// Takes what it likes, and keeps what it was told.
    struct Somebody<F> {
        likes: F,
        told: Vec<String>,
    }

    impl<F: Fn(&Told<'_>) -> bool> Receiver for Somebody<F> {
        fn take(&mut self, told: &Told<'_>) -> bool {
            let what = match told.event {
                Event::Key { key, pressed, .. } => format!("{key:?} {pressed}"),
                Event::PointerButton { button, pressed, .. } => format!("{button:?} {pressed}"),
                other => format!("{other:?}"),
            };
            self.told.push(what);
            (self.likes)(told)
        }
    }

    fn somebody<F: Fn(&Told<'_>) -> bool>(likes: F) -> Somebody<F> {
        Somebody { likes, told: Vec::new() }
    }

    fn key(key: Key, pressed: bool) -> Event {
        Event::Key { key, physical_key: None, pressed, repeat: false, modifiers: Modifiers::NONE }
    }

    fn is(told: &Told<'_>, action: Action) -> bool {
        told.bound.is_some_and(|bound| bound.action == action)
    }

    #[test]
    fn an_event_goes_from_one_to_the_next_until_one_takes_it() {
        let (bindings, mut router) = (Bindings::default(), Router::default());
        let right = Action::Move([1, 0, 0]);
        let (mut thing, mut hand, mut all) =
            (somebody(|told| is(told, right)), somebody(|told| is(told, Action::Grip)), somebody(|_| true));
        let mut tell = |event: &Event| router.tell(event, &bindings, &mut [&mut thing, &mut hand, &mut all]);
        assert_eq!(tell(&key(Key::ArrowRight, true)), Some(0));
        assert_eq!(tell(&key(Key::Space, true)), Some(1));
        assert_eq!(tell(&key(Key::P, true)), Some(2));
        assert_eq!(tell(&Event::PointerMoved(Pos2::ZERO)), Some(2));
        assert_eq!(all.told, ["P true", "PointerMoved([0.0 0.0])"]);
        assert_eq!(hand.told.len(), 3, "it saw all but the first");
    }

    #[test]
    fn a_key_is_let_go_for_whom_it_was_pressed_for() {
        let (bindings, mut router) = (Bindings::default(), Router::default());
        let (mut first, mut second) = (somebody(|_| false), somebody(|_| true));
        assert_eq!(router.tell(&key(Key::Space, true), &bindings, &mut [&mut first, &mut second]), Some(1));
        // Now the first one would take everything.
        let mut first = somebody(|_| true);
        assert_eq!(router.tell(&key(Key::Space, false), &bindings, &mut [&mut first, &mut second]), Some(1));
        assert_eq!((first.told.len(), second.told.len()), (0, 2));
        assert_eq!(router.tell(&key(Key::A, false), &bindings, &mut [&mut first, &mut second]), None);
        assert!(first.told.is_empty(), "it was pressed before anybody listened");
    }

    #[test]
    fn what_is_held_is_let_go_of_when_nobody_looks_any_more_and_means_what_it_meant() {
        let (bindings, mut router) = (Bindings::default(), Router::default());
        let mut hand = somebody(|told| is(told, Action::Grip));
        let with_ctrl = Event::Key {
            key: Key::Space,
            physical_key: None,
            pressed: false,
            repeat: false,
            modifiers: Modifiers::CTRL,
        };
        router.tell(&key(Key::Space, true), &bindings, &mut [&mut hand]);
        assert_eq!(router.tell(&with_ctrl, &bindings, &mut [&mut hand]), Some(0), "Ctrl came later");
        router.tell(&key(Key::Space, true), &bindings, &mut [&mut hand]);
        router.let_go(&bindings, &mut [&mut hand]);
        router.let_go(&bindings, &mut [&mut hand]);
        assert_eq!(hand.told, ["Space true", "Space false", "Space true", "Space false"]);
    }

    #[test]
    fn with_a_key_comes_what_it_is_bound_to_even_if_it_was_bound_otherwise_by_a_file() {
        let bindings = Bindings::parse("[keys]\npause = \"Z\"", std::path::Path::new("k.toml")).unwrap();
        let mut router = Router::default();
        let mut pause = somebody(|told| is(told, Action::Pause));
        assert_eq!(router.tell(&key(Key::Z, true), &bindings, &mut [&mut pause]), Some(0));
        assert_eq!(router.tell(&key(Key::P, true), &bindings, &mut [&mut pause]), None);
    }
}
