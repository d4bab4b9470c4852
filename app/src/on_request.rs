//! Recordings that people ask for while a run goes on.
//!
//! Model: such a recording begins with the next row and is complete in itself: its first row has all bodies, and it tells in
//! which tick it begins, what scene that is of and what had been ordered before. Contacts that were there already have no
//! beginning in its events; rows tell of them. Should another scene take over, it ends, and another one begins.

use crate::control::desk::Coming;
use crate::record::{Beginning, Files, Recorder, View};
use crate::recording::RecordingError;
use crate::rig::Rig;
use chrono::{DateTime, Local, TimeZone};
use std::path::{Path, PathBuf};

/// Who makes them.
pub struct OnRequest {
    /// Where they go; `None`: where the program is.
    directory: Option<PathBuf>,
    /// The scene that runs, what is to be seen of it, and the how-many-th of the run it is.
    rig: Rig,
    view: View,
    scene: u32,
    recorder: Option<Recorder>,
}

impl OnRequest {
    /// For a run that begins with this scene.
    pub fn new(directory: Option<PathBuf>, rig: Rig, view: View) -> Self {
        Self { directory, rig, view, scene: 0, recorder: None }
    }

    /// Another scene takes over. What was recorded of the one before, if anything.
    pub fn go_on_with(&mut self, coming: &Coming, scene: u32) -> Option<Recorder> {
        (self.rig, self.view, self.scene) = (coming.rig.clone(), coming.view.clone(), scene);
        self.recorder.take()
    }

    /// Where the next one would go.
    pub fn next_path(&self) -> PathBuf {
        free_path(self.directory.as_deref().unwrap_or(Path::new("")), &Local::now())
    }

    /// Begins one here; whatever was under way has to have ended.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn begin(
        &mut self,
        files: &Files,
        path: &Path,
        beginning: &Beginning,
    ) -> Result<&mut Recorder, RecordingError> {
        let begun = files.under_way(path, (&self.rig, &self.view, self.scene), beginning)?;
        Ok(self.recorder.insert(begun))
    }

    /// The one that is under way.
    pub fn recorder(&mut self) -> Option<&mut Recorder> {
        self.recorder.as_mut()
    }

    /// Ends it. It goes on to write what waits, and says at the end what became of it.
    pub fn end(&mut self) -> Option<Recorder> {
        let mut recorder = self.recorder.take()?;
        recorder.close();
        Some(recorder)
    }

    /// Whether it takes no more, because the file does not.
    pub fn has_failed(&self) -> bool {
        self.recorder.as_ref().is_some_and(Recorder::has_failed)
    }

    /// Where it goes, if one is under way.
    pub fn path(&self) -> Option<&Path> {
        self.recorder.as_ref().map(Recorder::path)
    }
}

/// `phantom3-YYYYMMDD-HHMMSS.mcap`, or with a number if that is there.
fn free_path<Z: TimeZone<Offset: std::fmt::Display>>(directory: &Path, now: &DateTime<Z>) -> PathBuf {
    let time = now.format("%Y%m%d-%H%M%S");
    let mut path = directory.join(format!("phantom3-{time}.mcap"));
    let mut number = 1;
    while path.exists() {
        number += 1;
        path = directory.join(format!("phantom3-{time}-{number}.mcap"));
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;
    use chrono::Utc;

    #[test]
    fn recordings_are_called_by_their_time_and_none_is_overwritten() {
        let directory = tempfile::tempdir().expect("room");
        let leap = Utc.with_ymd_and_hms(2024, 2, 29, 23, 59, 8).single().expect("a time");
        let at = |name: &str| directory.path().join(name);
        assert_eq!(free_path(directory.path(), &leap), at("phantom3-20240229-235908.mcap"));
        std::fs::write(at("phantom3-20240229-235908.mcap"), "taken").expect("room");
        assert_eq!(free_path(directory.path(), &leap), at("phantom3-20240229-235908-2.mcap"));
    }
}
