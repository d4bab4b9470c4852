//! What people do with keys and mouse at a window, and who gets it (Melder 7.2.12).
//!
//! Model: an event goes to one receiver after the other until one takes it ([`Router`]): the thing that people have chosen,
//! the camera, the hand, the application. With a key comes the [`Action`] that it is bound to ([`Bindings`]); a file can
//! bind other keys. Nothing here needs a window.

mod action;
mod bindings;
mod chord;
mod code;
mod hand_keys;
mod help;
mod key_times;
mod router;
mod takers;

pub use action::{Action, Group, Step};
pub use bindings::{Bindings, Bound};
pub use chord::Chord;
pub use code::code;
pub use hand_keys::HandKeys;
pub use help::{HelpLine, help};
pub use key_times::{KeyHeard, KeyTimes, ServerClock, without_pad};
pub use router::{Receiver, Router, Told};
pub use takers::{Actions, Unbound};
