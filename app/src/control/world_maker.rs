//! The worlds that orders bring, made before their time: by a thread of its own where time does not wait.
//!
//! Problem: a world of ten thousand things takes a second to make, in which whoever makes it looks at nothing else, neither at rows
//! that wait nor at the end of the run.
//! Invariants: worlds come in the order in which they were asked for; a run that ends does not wait for one.

use super::desk::{Coming, Means};
use super::order::{Other, Replacement};
use crate::displaced::Displaced;
use crate::record::View;
use crate::rig::Rig;
use crate::row_queue::row_queue_of;
use crate::shown::Shown;
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, Sender};

/// Rows of another scene that may wait.
const ROWS: usize = 2048;
/// Changed bodies that come with them.
const BODIES: usize = 1 << 18;

/// A world that is to be made.
#[derive(Clone)]
pub(super) struct Wanted {
    pub(super) rig: Arc<Rig>,
    /// It is that of another scene.
    pub(super) is_other: bool,
}

/// A world, and what others get of it if its scene is another one.
pub(super) type Made = (Box<Replacement>, Option<Coming>);

/// A scene as it begins. Its slow list, if it is somebody's to step, is his.
pub(super) fn make(wanted: &Wanted, means: &Means) -> Result<Made, String> {
    if wanted.is_other {
        other_world(&wanted.rig, means)
    } else {
        Ok((world(&wanted.rig, None, means)?, None))
    }
}

fn world(rig: &Rig, other: Option<Other>, means: &Means) -> Result<Box<Replacement>, String> {
    let step = rig.fast_step().map_err(|error| error.to_string())?;
    let mut world = Replacement::new(step, other);
    if let Some(slow_lists) = &means.slow_lists
        && let Some(slow) = world.step.take_slow()
    {
        // Nobody to step it: the run is over.
        let _ = slow_lists.send(slow.waiting());
    }
    Ok(world)
}

fn other_world(rig: &Rig, means: &Means) -> Result<Made, String> {
    let names = rig.names(&means.extras);
    let bodies = names.bodies.len();
    let (sender, rows) = row_queue_of(ROWS, BODIES, bodies);
    let displaced = Displaced::new(rig.scene.entities.len());
    let other = Other { rows: sender, bodies: Vec::with_capacity(bodies), displaced, number: 0 };
    let mut world = world(rig, Some(other), means)?;
    let number = means.book.add_scene(&rig.scene_file.display().to_string(), names);
    if let Some(other) = &mut world.other {
        other.number = number;
    }
    let view = View::new(&rig.scene, world.step.entities(), means.is_recorded_as_seen);
    let shown = means.is_shown.then(|| Shown::new(rig, world.step.entities()));
    Ok((world, Some(Coming { rows, rig: rig.clone(), view, shown })))
}

/// The thread that makes them. It ends with its owner, once it has made what it is at.
pub(super) struct WorldMaker {
    wanted: Sender<Wanted>,
    made: Receiver<Result<Made, String>>,
    under_way: usize,
}

impl WorldMaker {
    /// Starts it.
    ///
    /// # Errors
    /// If there can be no thread.
    pub(super) fn start(means: Means) -> std::io::Result<Self> {
        let (wanted, all_wanted) = mpsc::channel::<Wanted>();
        let (send_made, made) = mpsc::channel();
        std::thread::Builder::new().name("world-maker".into()).spawn(move || {
            for wanted in all_wanted {
                if send_made.send(make(&wanted, &means)).is_err() {
                    // Who has asked is gone.
                    break;
                }
            }
        })?;
        Ok(Self { wanted, made, under_way: 0 })
    }

    /// Number that has been asked for and not been taken.
    pub(super) fn under_way(&self) -> usize {
        self.under_way
    }

    /// Asks for one.
    pub(super) fn want(&mut self, wanted: Wanted) {
        // It lives as long as this.
        self.under_way += usize::from(self.wanted.send(wanted).is_ok());
    }

    /// The next one, if it has been made.
    pub(super) fn take(&mut self) -> Option<Result<Made, String>> {
        let made = self.made.try_recv().ok()?;
        self.under_way -= 1;
        Some(made)
    }
}
