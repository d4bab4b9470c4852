//! A hand without hardware in a run: what people do at a window, in a file that the driver follows.
//!
//! Model: the file lies in memory, in a directory that only this user can enter, until the driver has it; then nobody needs
//! its name any more, and whatever ends this process leaves nothing behind.

use crate::child::private_directory;
use crate::outcome::RunFailure;
use crate::rig::Rig;
use io_driver::config::{DriverConfig, HandSource};
use io_driver::live_hand::{LiveHand, LiveWish};
use nalgebra::Vector3;
use std::path::PathBuf;
use tempfile::TempDir;
use view::hand::MouseHand;
use view::{Reins, Wish};

/// Where files lie in memory.
const MEMORY: &str = "/dev/shm";

/// The file, as long as the driver has not opened it.
#[derive(Debug)]
pub struct LiveHandFile {
    hand: LiveHand,
    path: PathBuf,
    _directory: TempDir,
}

impl LiveHandFile {
    /// Makes it.
    ///
    /// # Errors
    /// If there is no place for it.
    pub fn make() -> Result<Self, RunFailure> {
        let failed = |error: &dyn std::fmt::Display| RunFailure::Start(error.to_string());
        let in_memory = tempfile::Builder::new().prefix("phantom3-").tempdir_in(MEMORY);
        let directory = in_memory.or_else(|_| private_directory()).map_err(|error| {
            failed(&format_args!("cannot make a directory for what the hand wants: {error}"))
        })?;
        let path = directory.path().join("hand");
        let hand = LiveHand::create(&path).map_err(|error| failed(&error))?;
        Ok(Self { hand, path, _directory: directory })
    }

    /// Has the devices that follow a hand follow this one; each is the finger of its own number.
    pub fn lead(&self, config: &mut DriverConfig) {
        for (finger, device) in config.devices.iter_mut().enumerate() {
            if let Some(wish) = device.backend.wish_mut() {
                wish.hand = HandSource::Live { file: self.path.clone(), finger };
            }
        }
    }

    /// The driver has it: the scene's fingers are pulled from now on.
    ///
    /// # Errors
    /// If nobody knows how far the devices reach.
    pub fn into_reins(self, rig: &Rig) -> Result<LiveReins, RunFailure> {
        let reach = rig.reach().map_err(|error| RunFailure::Start(error.to_string()))?;
        let fingers = &rig.scene.fingers;
        Ok(LiveReins {
            hand: self.hand,
            devices: fingers.iter().map(|finger| finger.device).collect(),
            starts: fingers.iter().map(|finger| finger.start_m.coords).collect(),
            reach,
        })
    }
}

/// Pulls the fingers of a scene.
#[derive(Debug)]
pub struct LiveReins {
    hand: LiveHand,
    /// Of each finger.
    devices: Vec<usize>,
    /// Where each begins (m).
    starts: Vec<Vector3<f64>>,
    /// Corners of what all devices reach (m).
    reach: [Vector3<f64>; 2],
}

impl Reins for LiveReins {
    fn hand(&self) -> MouseHand {
        MouseHand::starting_at(&self.starts, self.reach)
    }

    fn pull(&mut self, wishes: &[Wish]) {
        for (wish, device) in wishes.iter().zip(&self.devices) {
            let Wish { place, orientation, buttons } = *wish;
            self.hand.want(*device, &LiveWish { place, orientation, buttons });
        }
    }
}
