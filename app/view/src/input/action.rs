//! What keys can be bound to.

/// What a key can do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action {
    /// The window closes, and the run ends.
    Exit,
    /// What keys do is shown, or not.
    Help,
    /// The panel is shown, or not.
    Panel,
    /// Things stand still, or go on.
    Pause,
    /// Everything goes where it began.
    Reset,
    /// A recording begins, or ends.
    Record,
    /// What is seen of the scene becomes a file.
    Snapshot,
    /// Of all fingers, or of the chosen thing.
    Stiffness(Step),
    /// Of all fingers, or of the chosen thing.
    Damping(Step),
    /// Shadows are drawn, or not.
    Shadows,
    /// Hands, forces and contacts are drawn, or not.
    Overlay,
    /// Things change their colour while they are touched, or not.
    Highlight,
    /// Two eyes are served in the next way.
    Stereo,
    /// Between the eyes.
    Separation(Step),
    /// To where both eyes see the same.
    Convergence(Step),
    /// The next camera of the scene.
    NextCamera,
    /// The camera is where it began.
    HomeCamera,
    /// The next thing is chosen, or the one before.
    Choose(Step),
    /// Nothing is chosen.
    ChooseNone,
    /// The sun is chosen, or no longer.
    ChooseSun,
    /// What is chosen moves along an axis of the world; if nothing is, the hand does.
    Move([i8; 3]),
    /// What is chosen turns about an axis of the world; if nothing is, the hand does.
    Turn([i8; 3]),
    /// The hand is closed while the key is held.
    Grip,
    /// The hand closes, or opens.
    GripToggle,
    /// So many fingers close.
    Fingers(u8),
}

/// Which way something is changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// More, farther, onward.
    More,
    /// Less, nearer, back.
    Less,
}

/// What an action is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Group {
    /// The run and the window.
    Run,
    /// What is drawn.
    Picture,
    /// Things, and the hand.
    Things,
}

/// What is known of an action.
pub(super) struct Known {
    pub(super) action: Action,
    /// In files.
    pub(super) name: &'static str,
    /// For people.
    pub(super) says: &'static str,
    pub(super) group: Group,
    /// Unless a file says otherwise.
    pub(super) keys: &'static [&'static str],
}

const fn known(
    action: Action,
    name: &'static str,
    says: &'static str,
    group: Group,
    keys: &'static [&'static str],
) -> Known {
    Known { action, name, says, group, keys }
}

use Action::*;
use Group::{Picture, Run, Things};
use Step::{Less, More};

/// All of them, in the order in which they are explained.
pub(super) const KNOWN: [Known; 42] = [
    known(Exit, "exit", "close the window, end the run", Run, &["Escape", "Ctrl+Q"]),
    known(Help, "help", "show or hide this help", Run, &["F1", "H"]),
    known(Panel, "panel", "show or hide the panel", Run, &["F10"]),
    known(Pause, "pause", "let things stand still, or go on", Run, &["P"]),
    known(Reset, "reset", "put everything where it began", Run, &["Backspace"]),
    known(Record, "record", "begin or end a recording", Run, &["Ctrl+R"]),
    known(Snapshot, "snapshot", "save the scene as a picture", Run, &["F12"]),
    known(Stiffness(More), "stiffness-more", "stiffness times 1.1", Run, &["K"]),
    known(Stiffness(Less), "stiffness-less", "stiffness divided by 1.1", Run, &["Shift+K"]),
    known(Damping(More), "damping-more", "damping times 1.1", Run, &["B"]),
    known(Damping(Less), "damping-less", "damping divided by 1.1", Run, &["Shift+B"]),
    known(Shadows, "shadows", "shadows on or off", Picture, &["F2"]),
    known(Overlay, "overlay", "fingers, forces, rims on or off", Picture, &["F3"]),
    known(Highlight, "highlight", "colour of touched things on or off", Picture, &["F4"]),
    known(Stereo, "stereo", "next way to serve two eyes", Picture, &["F5"]),
    known(Separation(Less), "separation-less", "eyes nearer together", Picture, &["F6"]),
    known(Separation(More), "separation-more", "eyes farther apart", Picture, &["F7"]),
    known(Convergence(Less), "convergence-nearer", "eyes agree nearer", Picture, &["F8"]),
    known(Convergence(More), "convergence-farther", "eyes agree farther away", Picture, &["F9"]),
    known(NextCamera, "camera-next", "next camera of the scene", Picture, &["C"]),
    known(HomeCamera, "camera-reset", "camera back where it began", Picture, &["Home"]),
    known(Choose(More), "choose-next", "choose the next thing", Things, &["Period"]),
    known(Choose(Less), "choose-previous", "choose the thing before", Things, &["Comma"]),
    known(ChooseNone, "choose-none", "choose nothing", Things, &["N"]),
    known(ChooseSun, "choose-sun", "choose the sun: arrows turn it", Things, &["L"]),
    known(Move([-1, 0, 0]), "move-left", "move left (-x)", Things, &["Left"]),
    known(Move([1, 0, 0]), "move-right", "move right (+x)", Things, &["Right"]),
    known(Move([0, 0, -1]), "move-away", "move away (-z)", Things, &["Up"]),
    known(Move([0, 0, 1]), "move-near", "move near (+z)", Things, &["Down"]),
    known(Move([0, 1, 0]), "move-up", "move up (+y)", Things, &["PageUp"]),
    known(Move([0, -1, 0]), "move-down", "move down (-y)", Things, &["PageDown"]),
    known(Turn([0, 1, 0]), "turn-left", "turn left (about +y)", Things, &["Q"]),
    known(Turn([0, -1, 0]), "turn-right", "turn right (about -y)", Things, &["E"]),
    known(Turn([-1, 0, 0]), "turn-away", "turn away (about -x)", Things, &["Ctrl+Up"]),
    known(Turn([1, 0, 0]), "turn-near", "turn near (about +x)", Things, &["Ctrl+Down"]),
    known(Turn([0, 0, 1]), "roll-left", "roll left (about +z)", Things, &["Ctrl+Left"]),
    known(Turn([0, 0, -1]), "roll-right", "roll right (about -z)", Things, &["Ctrl+Right"]),
    known(Grip, "grip", "hand closed while held", Things, &["Space"]),
    known(GripToggle, "grip-toggle", "close or open the hand", Things, &["G"]),
    known(Fingers(1), "fingers-1", "one finger", Things, &["1"]),
    known(Fingers(2), "fingers-2", "two fingers", Things, &["2"]),
    known(Fingers(3), "fingers-3", "three fingers", Things, &["3"]),
];

/// What files call them.
pub(super) const NAMES: [&str; KNOWN.len()] = {
    let mut names = [""; KNOWN.len()];
    let mut at = 0;
    while at < names.len() {
        names[at] = KNOWN[at].name;
        at += 1;
    }
    names
};

impl Action {
    /// Whether Shift makes it finer, where no key says otherwise.
    pub(super) fn has_fine_step(self) -> bool {
        matches!(self, Move(_) | Turn(_))
    }

    /// Whether it is done again while the key is held.
    pub fn repeats(self) -> bool {
        matches!(
            self,
            Move(_) | Turn(_) | Separation(_) | Convergence(_) | Stiffness(_) | Damping(_) | Choose(_)
        )
    }

    /// What files call it.
    pub fn name(self) -> &'static str {
        KNOWN.iter().find(|known| known.action == self).map_or("", |known| known.name)
    }
}

impl Step {
    /// A number that is to become larger or smaller by a factor.
    pub fn times(self, number: f64, factor: f64) -> f64 {
        match self {
            More => number * factor,
            Less => number / factor,
        }
    }
}
