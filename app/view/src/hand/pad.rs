//! A game controller that moves the hand, where there is one: the kernel's joysticks, `/dev/input/js0` and on.
//!
//! Model: the kernel tells changes as events of eight bytes (Documentation/input/joydev/joystick-api.rst), which are read
//! without waiting. Left stick: right and up in the picture; right stick: away and back, and the grip's turn; a trigger
//! closes the grip as long as it is pressed halfway. So with axes 0 to 5 as the kernel numbers those of the usual
//! controllers with two sticks and two triggers. A device that is not there, or that one may not read, is none.

use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Read};
use std::os::unix::fs::OpenOptionsExt;

const AXES: usize = 6;
const LEFT_X: usize = 0;
const LEFT_Y: usize = 1;
const LEFT_TRIGGER: usize = 2;
const RIGHT_X: usize = 3;
const RIGHT_Y: usize = 4;
const RIGHT_TRIGGER: usize = 5;
/// Sticks that are let go come back to within this of their middle.
const DEAD: f64 = 0.15;
/// What a turn of the window reads at most.
const MOST_EVENTS: usize = 64;
/// So many devices are tried.
const DEVICES: usize = 4;
/// Between two looks for one (s).
const PAUSE_S: f64 = 2.0;
/// The event's type: an axis; told first is how it stands.
const AXIS: u8 = 0x02;
const INITIAL: u8 = 0x80;
/// O_NONBLOCK of Linux on the usual machines.
const WITHOUT_WAITING: i32 = 0o4000;

/// Where sticks and triggers are: -1 to 1.
#[derive(Debug, Default)]
pub(super) struct Pad {
    device: Option<File>,
    axes: [f64; AXES],
    /// Until the next look for a device (s).
    pause_s: f64,
}

/// What it wants: shares of the fastest, -1 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Push {
    /// To the right in the picture.
    pub(super) right: f64,
    /// Upwards in it.
    pub(super) up: f64,
    /// Away.
    pub(super) away: f64,
    /// Of the grip, to the left.
    pub(super) turn: f64,
    /// Whether the grip closes.
    pub(super) closes: bool,
}

impl Pad {
    /// What it wants now, so long (s) after it was asked last.
    pub(super) fn push(&mut self, dt_s: f64) -> Push {
        self.pause_s -= dt_s;
        if self.device.is_none() && self.pause_s <= 0.0 {
            (self.device, self.axes, self.pause_s) = (find(), released(), PAUSE_S);
        }
        let Some(device) = &mut self.device else { return Push::default() };
        let mut event = [0; 8];
        let mut is_gone = false;
        for _ in 0..MOST_EVENTS {
            match device.read(&mut event) {
                Ok(8) => take(&mut self.axes, event),
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                _ => {
                    is_gone = true;
                    break;
                }
            }
        }
        if is_gone {
            self.device = None;
            return Push::default();
        }
        pushed(&self.axes)
    }
}

fn find() -> Option<File> {
    let mut options = OpenOptions::new();
    options.read(true).custom_flags(WITHOUT_WAITING);
    (0..DEVICES).find_map(|number| options.open(format!("/dev/input/js{number}")).ok())
}

/// Sticks in the middle, triggers out.
fn released() -> [f64; AXES] {
    let mut axes = [0.0; AXES];
    (axes[LEFT_TRIGGER], axes[RIGHT_TRIGGER]) = (-1.0, -1.0);
    axes
}

/// Time (4 bytes), value (2), type, number.
fn take(axes: &mut [f64; AXES], [_, _, _, _, low, high, kind, number]: [u8; 8]) {
    if kind & !INITIAL == AXIS
        && let Some(axis) = axes.get_mut(usize::from(number))
    {
        *axis = (f64::from(i16::from_ne_bytes([low, high])) / 32767.0).max(-1.0);
    }
}

fn pushed(axes: &[f64; AXES]) -> Push {
    // Finely near the middle.
    let stick = |axis: usize| {
        let beyond = ((axes[axis].abs() - DEAD) / (1.0 - DEAD)).max(0.0);
        beyond * beyond * axes[axis].signum()
    };
    Push {
        right: stick(LEFT_X),
        // The kernel's y is down, and towards.
        up: -stick(LEFT_Y),
        away: -stick(RIGHT_Y),
        turn: -stick(RIGHT_X),
        closes: axes[LEFT_TRIGGER].max(axes[RIGHT_TRIGGER]) > 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(value: i16, kind: u8, number: u8) -> [u8; 8] {
        let [low, high] = value.to_ne_bytes();
        [1, 2, 3, 4, low, high, kind, number]
    }

    #[test]
    fn sticks_move_the_hand_and_a_trigger_closes_it() {
        let mut axes = released();
        assert_eq!(pushed(&axes), Push::default(), "nobody touches it");
        for (value, number) in [(32767, 0), (-32768, 1), (-32767, 4), (32767, 3)] {
            take(&mut axes, event(value, AXIS, number));
        }
        let Push { right, up, away, turn, closes } = pushed(&axes);
        assert_eq!(([right, up, away, turn], closes), ([1.0, 1.0, 1.0, -1.0], false));
        for trigger in [2, 5] {
            take(&mut axes, event(2000, AXIS, trigger));
            assert!(pushed(&axes).closes);
            take(&mut axes, event(-32767, AXIS | INITIAL, trigger));
            assert!(!pushed(&axes).closes);
        }
    }

    #[test]
    fn what_is_near_the_middle_is_nothing_and_half_way_is_less_than_half() {
        let mut axes = released();
        take(&mut axes, event(4900, AXIS | INITIAL, 0));
        assert_eq!(pushed(&axes).right, 0.0);
        take(&mut axes, event(-16384, AXIS, 0));
        // ((0.5 - 0.15) / 0.85)^2 = 0.17
        assert!((pushed(&axes).right + 0.17).abs() < 0.005, "{}", pushed(&axes).right);
    }

    #[test]
    fn buttons_and_axes_that_nobody_knows_change_nothing() {
        let mut axes = released();
        for event in
            [event(1, 1, 0), event(1, 1 | INITIAL, 0), event(32767, AXIS, 6), event(32767, AXIS, 255)]
        {
            take(&mut axes, event);
        }
        assert_eq!(axes, released());
    }

    #[test]
    fn where_there_is_no_device_the_hand_stays() {
        let mut pad = Pad { device: None, axes: released(), pause_s: f64::INFINITY };
        assert_eq!(pad.push(1.0), Push::default());
        assert!(pad.device.is_none());
    }
}
