//! What keys want of the hand.

use super::action::Action;
use super::router::{Receiver, Told};
use eframe::egui::{Event, Key};

/// The keys of the hand that are held, and what others asked for.
#[derive(Debug, Clone, Default)]
pub struct HandKeys {
    held: Vec<(Key, Action, bool)>,
    stays_closed: bool,
    fingers: Option<usize>,
}

impl HandKeys {
    /// Where it is to go, as somebody sees it: right, up, nearer; each -1, 0 or 1.
    pub fn way(&self) -> [f64; 3] {
        self.sum(|action| if let Action::Move(way) = action { way } else { [0; 3] })
    }

    /// How it is to turn: about what points right, up, nearer; each -1, 0 or 1.
    pub fn turn(&self) -> [f64; 3] {
        self.sum(|action| if let Action::Turn(about) = action { about } else { [0; 3] })
    }

    /// Whether it is to do so slowly.
    pub fn is_fine(&self) -> bool {
        self.held.iter().any(|(.., is_fine)| *is_fine)
    }

    /// Whether it is to be closed.
    pub fn is_closed(&self) -> bool {
        self.stays_closed || self.held.iter().any(|(_, action, _)| *action == Action::Grip)
    }

    /// How many fingers are to close from now on, once.
    pub fn take_fingers(&mut self) -> Option<usize> {
        self.fingers.take()
    }

    fn sum(&self, of: impl Fn(Action) -> [i8; 3]) -> [f64; 3] {
        let mut sum = [0.0f64; 3];
        for way in self.held.iter().map(|(_, action, _)| of(*action)) {
            sum.iter_mut().zip(way).for_each(|(sum, way)| *sum = (*sum + f64::from(way)).clamp(-1.0, 1.0));
        }
        sum
    }
}

impl Receiver for HandKeys {
    fn take(&mut self, told: &Told<'_>) -> bool {
        let (Event::Key { key, pressed, .. }, Some(bound)) = (told.event, told.bound) else { return false };
        match bound.action {
            Action::Move(_) | Action::Turn(_) | Action::Grip => {
                self.held.retain(|(held, ..)| held != key);
                if *pressed {
                    self.held.push((*key, bound.action, bound.is_fine));
                }
            }
            Action::GripToggle => {
                let is_first = *pressed && !matches!(told.event, Event::Key { repeat: true, .. });
                self.stays_closed ^= is_first;
            }
            Action::Fingers(fingers) if *pressed => self.fingers = Some(fingers.into()),
            Action::Fingers(_) => {}
            _ => return false,
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::{Bindings, Router};
    use eframe::egui::Modifiers;

    struct Set {
        keys: HandKeys,
        router: Router,
    }

    impl Set {
        fn key(&mut self, key: Key, pressed: bool, modifiers: Modifiers) -> bool {
            let event = Event::Key { key, physical_key: None, pressed, repeat: false, modifiers };
            self.router.tell(&event, &Bindings::default(), &mut [&mut self.keys]).is_some()
        }
    }

    #[test]
    fn the_hand_goes_while_keys_are_held_and_closes_for_as_long_as_it_is_told() {
        let mut set = Set { keys: HandKeys::default(), router: Router::default() };
        let none = Modifiers::NONE;
        assert!(set.key(Key::ArrowRight, true, none) && set.key(Key::PageUp, true, Modifiers::SHIFT));
        assert_eq!((set.keys.way(), set.keys.is_fine()), ([1.0, 1.0, 0.0], true));
        assert!(set.key(Key::ArrowLeft, true, none));
        assert_eq!(set.keys.way(), [0.0, 1.0, 0.0], "both ways is none");
        for key in [Key::ArrowRight, Key::ArrowLeft, Key::PageUp] {
            assert!(set.key(key, false, none));
        }
        assert_eq!((set.keys.way(), set.keys.is_fine()), ([0.0; 3], false));
        assert!(set.key(Key::Q, true, none));
        assert_eq!(set.keys.turn(), [0.0, 1.0, 0.0]);
        assert!(set.key(Key::Space, true, none) && set.keys.is_closed());
        assert!(set.key(Key::Space, false, none) && !set.keys.is_closed());
        assert!(set.key(Key::G, true, none) && set.key(Key::G, false, none) && set.keys.is_closed());
        assert!(set.key(Key::G, true, none) && !set.keys.is_closed());
        assert!(set.key(Key::Num3, true, none));
        assert_eq!((set.keys.take_fingers(), set.keys.take_fingers()), (Some(3), None));
        assert!(!set.key(Key::P, true, none), "not the hand's");
    }
}
