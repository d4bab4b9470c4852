//! Pictures of what fingers feel.
//!
//! Model: a [`Stage`] is what can be seen of a scene and does not change; a [`Moment`] is where everything is and what the
//! fingers feel at one time. A [`Painter`](painter::Painter) draws moments of a stage in a graphics context: a window's, or one
//! without a display ([`picture::Studio`]). Lights, cameras and colours are the scene's.
//!
//! Nothing here runs in a tick. A machine without graphics libraries builds and runs it; pictures are then missing, and
//! the error says what to install.
//!
//! Frames and units are those of the scene: metres, y up, cameras look along -z.
#![deny(missing_docs)]
#![deny(unsafe_code)]

pub mod camera_man;
mod crowd;
pub mod eyes;
pub mod hand;
pub mod input;
mod lamp;
pub mod moment;
pub mod news;
#[allow(unsafe_code, reason = "the system's graphics library, which is loaded at run time")]
mod offscreen;
mod overlay;
pub mod painter;
pub mod panel;
pub mod pick;
pub mod picture;
pub mod playback;
mod rims;
pub mod shapes;
mod solids;
pub mod stage;
pub mod status_line;
pub mod steering;
pub mod text;
pub mod triangles;
mod usual;
pub mod window;

pub use eyes::Eyes;
pub use moment::{ContactMoment, FingerMoment, Moment};
pub use news::{Ask, Glimpse, KeyChange, News, Reins, Sample, Status, Wish};
pub use offscreen::{NoPictures, Offscreen};
pub use picture::{Picture, Studio};
pub use stage::{Known, Stage, Thing};
pub use text::Note;
pub use triangles::Triangles;
pub use window::{NoWindow, OpenWindow, WindowSpec, is_display_lost};
