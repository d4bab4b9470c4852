//! What can happen.
//!
//! Frames and signs: W; a finger's force and impulse are those on the user, a pair's those on its first entity.
//! Invariant: an event is `Copy` and has no heap: fingers and entities are numbers in the order of the scene.

use nalgebra::Vector3;

/// Something that happened.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// In which tick of the run.
    pub run_tick: u64,
    /// What.
    pub kind: Kind,
}

/// What happened, and to whom.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Kind {
    /// A finger's contact with an entity changed.
    FingerTouch {
        /// Which finger.
        finger: u32,
        /// Which entity.
        entity: u32,
        /// How.
        change: Change,
        /// The contact so far.
        life: Life,
    },
    /// A contact between two entities began or ended.
    PairTouch {
        /// Which two; the first can move.
        entities: [u32; 2],
        /// How.
        change: Change,
        /// The contact so far.
        life: Life,
    },
    /// An entity that moves is held: by two fingers or more, or by one that it is tied to.
    Grasp {
        /// Which entity.
        entity: u32,
        /// Bit `i`: by finger `i`.
        fingers: u32,
    },
    /// It is not held any more.
    Release {
        /// Which entity.
        entity: u32,
        /// For how long it was (s).
        lasted_s: f64,
    },
    /// An entity was tied to a finger (`Begins`), or let go (`Ends`).
    Tie {
        /// Which finger.
        finger: u32,
        /// Which entity.
        entity: u32,
        /// How.
        change: Change,
    },
    /// An entity goes on being stepped by another thread.
    ListChange {
        /// Which entity.
        entity: u32,
        /// By whose.
        to: List,
    },
    /// An entity stands still for good.
    Parked {
        /// Which entity.
        entity: u32,
        /// Why.
        why: Why,
    },
    /// A button of a finger's device.
    Button {
        /// Which finger.
        finger: u32,
        /// Which button of its device.
        button: u32,
        /// Whether it went down.
        is_pressed: bool,
    },
    /// A key of the keyboard.
    Key {
        /// Which, as the source numbers them.
        code: u32,
        /// Whether it went down.
        is_pressed: bool,
    },
    /// A trial of a study began or ended.
    Trial {
        /// Which of the two.
        change: Change,
        /// Its number.
        number: u32,
    },
    /// A finger went through a door: from one space into another. 0 is the world, `i + 1` behind the door of the scene's
    /// environment `i`.
    Door {
        /// Which finger.
        finger: u32,
        /// Where it was.
        from: u32,
        /// Where it is.
        to: u32,
    },
    /// A finger's force was cut: it rose or turned by more than finger and entities have moved for.
    Cut {
        /// Which finger.
        finger: u32,
        /// Whose contact; `None`: what is felt beside contacts.
        entity: Option<u32>,
        /// By how much (N).
        force_n: f64,
    },
    /// There is more at a finger's place than it can feel at once.
    Crowded {
        /// Which finger.
        finger: u32,
    },
    /// A finger feels less than it presses with, and goes through: what stops it would move if that had been stepped.
    GaveWay {
        /// Which finger.
        finger: u32,
    },
    /// All that moves is more than a tick has time for: bodies wait for their turns, or do not any more.
    Overload {
        /// Which of the two.
        change: Change,
        /// Number that wait; at the end, the most that did.
        waiting: u32,
    },
    /// The driver switched the motors off, which ends a run.
    Fault {
        /// Number of its fault in the shared-memory contract.
        reason: u64,
    },
    /// The scene was put back to its beginning. What touched before has ended.
    Reset,
    /// Another scene goes on in place of the one that was, whose contacts have ended. Numbers mean its fingers and entities
    /// from here on.
    Scene {
        /// The how-many-th of the run; that with which it began is 0.
        number: u32,
    },
    /// An order was taken.
    Order {
        /// Which, in the order in which they came, from 0.
        number: u64,
    },
    /// So many events are missing here: whoever takes them was too slow.
    Lost {
        /// How many.
        count: u64,
    },
}

/// What became of a contact, a tie or a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// It is new.
    Begins,
    /// It slides from this tick on.
    Slips,
    /// It holds again, or is about to end.
    Sticks,
    /// It is over.
    Ends,
}

/// Which thread steps an entity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum List {
    /// That which renders forces.
    Fast,
    /// That of what no finger is near.
    Slow,
}

/// Why an entity was parked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Why {
    /// It left the world.
    LeftTheWorld,
    /// Where it was or how it moved was no number any more.
    NotANumber,
}

impl From<physics::Reason> for Why {
    fn from(reason: physics::Reason) -> Self {
        match reason {
            physics::Reason::LeftTheWorld => Self::LeftTheWorld,
            physics::Reason::NotANumber => Self::NotANumber,
        }
    }
}

/// What a contact has done so far.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Life {
    /// Force in the last tick that it had any in (N).
    pub force_n: f64,
    /// The largest so far (N).
    pub peak_n: f64,
    /// The sum of force and length of tick (N s).
    pub impulse_W: Vector3<f64>,
    /// From its first to its last tick with force, both counted (s).
    pub lasted_s: f64,
}

impl Life {
    /// This, and then that: of a contact that two sides have watched one after the other.
    pub(super) fn followed_by(&self, then: &Self) -> Self {
        Self {
            force_n: then.force_n,
            peak_n: self.peak_n.max(then.peak_n),
            impulse_W: self.impulse_W + then.impulse_W,
            lasted_s: self.lasted_s + then.lasted_s,
        }
    }

    /// Another tick of this length (s) with this force (N), the time since the last one (s) being part of its life.
    pub(super) fn go_on(&mut self, force_W: &Vector3<f64>, dt_s: f64, since_s: f64) {
        if *force_W != Vector3::zeros() {
            self.force_n = force_W.norm();
        }
        self.peak_n = self.peak_n.max(self.force_n);
        self.impulse_W += force_W * dt_s;
        self.lasted_s += since_s;
    }
}

/// Kinds without their details: what filters and counts go by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// [`Kind::FingerTouch`] that begins or ends.
    Contact,
    /// [`Kind::FingerTouch`] that slips or sticks.
    Slip,
    /// [`Kind::PairTouch`].
    Pair,
    /// [`Kind::Grasp`] and [`Kind::Release`].
    Grasp,
    /// [`Kind::Tie`].
    Tie,
    /// [`Kind::ListChange`].
    List,
    /// [`Kind::Parked`].
    Parked,
    /// [`Kind::Button`].
    Button,
    /// [`Kind::Key`].
    Key,
    /// [`Kind::Trial`].
    Trial,
    /// [`Kind::Door`].
    Door,
    /// [`Kind::Cut`].
    Cut,
    /// [`Kind::Crowded`].
    Crowd,
    /// [`Kind::GaveWay`].
    GaveWay,
    /// [`Kind::Overload`].
    Overload,
    /// [`Kind::Fault`].
    Fault,
    /// [`Kind::Reset`] and [`Kind::Scene`].
    Reset,
    /// [`Kind::Order`].
    Order,
    /// [`Kind::Lost`].
    Lost,
}

impl Class {
    /// All of them, with their words.
    pub const ALL: [(Self, &str); 19] = [
        (Self::Contact, "contacts"),
        (Self::Slip, "slips"),
        (Self::Pair, "pairs"),
        (Self::Grasp, "grasps"),
        (Self::Tie, "ties"),
        (Self::List, "lists"),
        (Self::Parked, "parked"),
        (Self::Button, "buttons"),
        (Self::Key, "keys"),
        (Self::Trial, "trials"),
        (Self::Door, "doors"),
        (Self::Cut, "cuts"),
        (Self::Crowd, "crowds"),
        (Self::GaveWay, "gave-ways"),
        (Self::Overload, "overloads"),
        (Self::Fault, "faults"),
        (Self::Reset, "resets"),
        (Self::Order, "orders"),
        (Self::Lost, "lost"),
    ];
}

/// What an event says, whatever its kind: for those who write it down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facts {
    /// The kind's word, such as `contact-begin`.
    pub word: &'static str,
    /// Which finger.
    pub finger: Option<u32>,
    /// Which entity.
    pub entity: Option<u32>,
    /// Which other entity.
    pub other: Option<u32>,
    /// Bit `i`: finger `i` holds the entity.
    pub holders: u32,
    /// The contact so far.
    pub life: Option<Life>,
    /// How much force was cut (N).
    pub force_n: Option<f64>,
    /// How long a grasp lasted (s).
    pub lasted_s: Option<f64>,
    /// A number: of the button, the key, the trial; how many were lost.
    pub number: Option<u64>,
    /// From which space into which.
    pub spaces: Option<[u32; 2]>,
    /// Which list, or why.
    pub text: &'static str,
}

impl Facts {
    const fn of(word: &'static str) -> Self {
        Self {
            word,
            finger: None,
            entity: None,
            other: None,
            holders: 0,
            life: None,
            force_n: None,
            lasted_s: None,
            number: None,
            spaces: None,
            text: "",
        }
    }
}

impl Kind {
    /// What it is, roughly.
    pub fn class(&self) -> Class {
        match self {
            Self::FingerTouch { change: Change::Slips | Change::Sticks, .. } => Class::Slip,
            Self::FingerTouch { .. } => Class::Contact,
            Self::PairTouch { .. } => Class::Pair,
            Self::Grasp { .. } | Self::Release { .. } => Class::Grasp,
            Self::Tie { .. } => Class::Tie,
            Self::ListChange { .. } => Class::List,
            Self::Parked { .. } => Class::Parked,
            Self::Button { .. } => Class::Button,
            Self::Key { .. } => Class::Key,
            Self::Trial { .. } => Class::Trial,
            Self::Door { .. } => Class::Door,
            Self::Cut { .. } => Class::Cut,
            Self::Crowded { .. } => Class::Crowd,
            Self::GaveWay { .. } => Class::GaveWay,
            Self::Overload { .. } => Class::Overload,
            Self::Fault { .. } => Class::Fault,
            Self::Reset | Self::Scene { .. } => Class::Reset,
            Self::Order { .. } => Class::Order,
            Self::Lost { .. } => Class::Lost,
        }
    }

    /// Whether it ends what an event before it began: one contact, grasp or key makes two events.
    pub fn is_end(&self) -> bool {
        match self {
            Self::FingerTouch { change, .. } => matches!(change, Change::Ends | Change::Sticks),
            Self::PairTouch { change, .. }
            | Self::Tie { change, .. }
            | Self::Trial { change, .. }
            | Self::Overload { change, .. } => *change == Change::Ends,
            Self::Release { .. } => true,
            Self::Button { is_pressed, .. } | Self::Key { is_pressed, .. } => !is_pressed,
            _ => false,
        }
    }

    /// What it says.
    pub fn facts(&self) -> Facts {
        let of = Facts::of;
        match *self {
            Self::FingerTouch { finger, entity, change, life } => {
                let word = match change {
                    Change::Begins => "contact-begin",
                    Change::Slips => "slip-begin",
                    Change::Sticks => "slip-end",
                    Change::Ends => "contact-end",
                };
                Facts { finger: Some(finger), entity: Some(entity), life: Some(life), ..of(word) }
            }
            Self::PairTouch { entities: [entity, other], change, life } => {
                let word = if change == Change::Ends { "pair-end" } else { "pair-begin" };
                Facts { entity: Some(entity), other: Some(other), life: Some(life), ..of(word) }
            }
            Self::Grasp { entity, fingers } => {
                Facts { entity: Some(entity), holders: fingers, ..of("grasp") }
            }
            Self::Release { entity, lasted_s } => {
                Facts { entity: Some(entity), lasted_s: Some(lasted_s), ..of("release") }
            }
            Self::Tie { finger, entity, change } => {
                let word = if change == Change::Ends { "untied" } else { "tied" };
                Facts { finger: Some(finger), entity: Some(entity), ..of(word) }
            }
            Self::ListChange { entity, to } => {
                let text = if to == List::Fast { "fast" } else { "slow" };
                Facts { entity: Some(entity), text, ..of("list-change") }
            }
            Self::Parked { entity, why } => {
                let text = if why == Why::LeftTheWorld { "left the world" } else { "not a number" };
                Facts { entity: Some(entity), text, ..of("parked") }
            }
            Self::Button { finger, button, is_pressed } => {
                let word = if is_pressed { "button-down" } else { "button-up" };
                Facts { finger: Some(finger), number: Some(button.into()), ..of(word) }
            }
            Self::Key { code, is_pressed } => {
                let word = if is_pressed { "key-down" } else { "key-up" };
                Facts { number: Some(code.into()), ..of(word) }
            }
            Self::Trial { change, number } => {
                let word = if change == Change::Ends { "trial-end" } else { "trial-begin" };
                Facts { number: Some(number.into()), ..of(word) }
            }
            Self::Door { finger, from, to } => {
                Facts { finger: Some(finger), spaces: Some([from, to]), ..of("door") }
            }
            Self::Cut { finger, entity, force_n } => {
                Facts { finger: Some(finger), entity, force_n: Some(force_n), ..of("cut") }
            }
            Self::Crowded { finger } => Facts { finger: Some(finger), ..of("crowded") },
            Self::GaveWay { finger } => Facts { finger: Some(finger), ..of("gave-way") },
            Self::Overload { change, waiting } => {
                let word = if change == Change::Ends { "overload-end" } else { "overload-begin" };
                Facts { number: Some(waiting.into()), ..of(word) }
            }
            Self::Fault { reason } => Facts { number: Some(reason), ..of("fault") },
            Self::Reset => of("reset"),
            Self::Scene { number } => Facts { number: Some(number.into()), ..of("scene") },
            Self::Order { number } => Facts { number: Some(number), ..of("order") },
            Self::Lost { count } => Facts { number: Some(count), ..of("events-lost") },
        }
    }
}
