//! The switches that guard the motors: emergency stop and dead-man, wired to buttons of the devices.
//!
//! Model: a switch is a button of a device. An emergency stop that is normally closed reads 1 at rest, so that a
//! broken wire reads as pressed. A dead-man's switch is held by what closes the circuit, so that a broken wire reads
//! as let go; the configuration refuses one that is normally closed.
//! Signs: an emergency stop that is pressed is a fault, whose leaving has to be asked for; a dead-man's switch
//! that is let go ramps the force out, and holding it again ramps it in.
//! Cost: two comparisons.

use shm_abi::Frame;
use shm_abi::frame::{INPUT_DEAD_MAN_HELD, INPUT_DEAD_MAN_PRESENT, INPUT_EMERGENCY_STOP};

/// A button of a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Switch {
    /// Index of the device.
    pub device: usize,
    /// Index of its button.
    pub button: u32,
    /// Whether the circuit is closed, and the bit set, while nobody presses it.
    pub normally_closed: bool,
}

/// Those of a driver; each may be absent.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Switches {
    /// Pressed is a fault.
    pub emergency_stop: Option<Switch>,
    /// Force is let through only while it is held.
    pub dead_man: Option<Switch>,
}

/// What the switches say in a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Inputs(pub u64);

impl Switches {
    /// Reads them from the buttons in a frame.
    pub fn read(&self, frame: &Frame) -> Inputs {
        let pressed = |switch: &Switch| switch.is_pressed(frame);
        let mut bits = 0;
        if self.emergency_stop.as_ref().is_some_and(pressed) {
            bits |= INPUT_EMERGENCY_STOP;
        }
        if let Some(switch) = &self.dead_man {
            bits |= INPUT_DEAD_MAN_PRESENT;
            bits |= if pressed(switch) { INPUT_DEAD_MAN_HELD } else { 0 };
        }
        Inputs(bits)
    }
}

impl Switch {
    fn is_pressed(&self, frame: &Frame) -> bool {
        let buttons = frame.devices.get(self.device).map_or(0, |device| device.buttons);
        let is_closed = buttons.checked_shr(self.button).unwrap_or(0) & 1 == 1;
        is_closed != self.normally_closed
    }
}

impl Inputs {
    /// An emergency stop is pressed.
    pub fn is_emergency(self) -> bool {
        self.0 & INPUT_EMERGENCY_STOP != 0
    }

    /// Somebody holds the dead-man's switch, or there is none.
    pub fn is_attended(self) -> bool {
        self.0 & INPUT_DEAD_MAN_PRESENT == 0 || self.0 & INPUT_DEAD_MAN_HELD != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;

    fn frame(buttons: u64) -> Frame {
        let mut frame = Frame::zeroed();
        frame.devices[1].buttons = buttons;
        frame
    }

    fn switch(normally_closed: bool) -> Switch {
        Switch { device: 1, button: 2, normally_closed }
    }

    #[test]
    fn without_switches_nothing_stops_and_nobody_has_to_hold() {
        let inputs = Switches::default().read(&frame(u64::MAX));
        assert!(!inputs.is_emergency() && inputs.is_attended());
    }

    #[test]
    fn an_emergency_stop_reads_pressed_by_its_own_wiring_and_a_cut_wire_stops() {
        for (normally_closed, buttons, expected) in
            [(false, 0b100, true), (false, 0b011, false), (true, 0b100, false), (true, 0, true)]
        {
            let switches = Switches { emergency_stop: Some(switch(normally_closed)), dead_man: None };
            assert_eq!(switches.read(&frame(buttons)).is_emergency(), expected);
        }
    }

    #[test]
    fn a_dead_mans_switch_has_to_be_held() {
        let switches = Switches { emergency_stop: None, dead_man: Some(switch(false)) };
        assert!(switches.read(&frame(0b100)).is_attended());
        let let_go = switches.read(&frame(0));
        assert!(!let_go.is_attended());
        assert_eq!(let_go.0, INPUT_DEAD_MAN_PRESENT);
    }

    #[test]
    fn a_switch_on_a_device_or_bit_that_is_not_there_is_open() {
        for (device, button) in [(99, 0), (1, 64), (1, u32::MAX)] {
            let open = Switch { device, button, normally_closed: false };
            let switches = Switches { emergency_stop: Some(open), dead_man: Some(open) };
            let inputs = switches.read(&frame(u64::MAX));
            assert!(!inputs.is_emergency() && !inputs.is_attended());
        }
    }
}
