//! Which files a run is recorded in: those that were asked for, and beside each one of its own for every other scene.

use super::destination::{Stream, is_same_place, is_standard_output, shown};
use super::opened::HALF_REPLACED;
use super::{
    About, Backpressure, Beginning, Opened, RecordFile, Recorder, View, begin_all, create, create_events,
    create_under_way,
};
use crate::book::Book;
use crate::recording::RecordingError;
use crate::rig::Rig;
use io_driver::device::Extras;
use io_driver::say::say;
use std::fs::File;
use std::io::Read;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// What recordings of a run have in common.
pub struct Files {
    /// Where rows are to go.
    pub record: Vec<PathBuf>,
    /// Where events alone are to go.
    pub events: Vec<PathBuf>,
    /// What the devices tell besides positions.
    pub extras: Vec<Extras>,
    /// Length of a tick (ns).
    pub period_ns: u64,
    /// Whether the run waits for them.
    pub backpressure: Backpressure,
    /// What was ordered.
    pub book: Book,
    /// What is told of the run that it begins with.
    pub about: About,
    /// Files that later scenes are not recorded in: what the run reads, and whatever else it writes.
    pub taken: Vec<PathBuf>,
}

impl Files {
    /// Those of the scene that the run begins with; and files of events, which go on whatever the scene is.
    ///
    /// # Errors
    /// If one cannot be made.
    pub fn first(&self, rig: &Rig, view: &View) -> Result<Vec<Recorder>, RecordingError> {
        let paths: Vec<&PathBuf> = self.record.iter().chain(&self.events).collect();
        let begun = begin_all(&paths, |number, file| self.begin(number, file, rig, view))
            .map_err(|error| if self.is_of_events(&error) { error.of_events() } else { error })?;
        Recorder::start_all(paths.into_iter().zip(begun), |path, file| self.start(path, file, rig))
    }

    fn is_of_events(&self, error: &RecordingError) -> bool {
        self.events.iter().any(|file| shown(file) == error.file())
    }

    /// The file of this number, of those of rows and then of events.
    fn begin(
        &self,
        number: usize,
        file: Opened,
        rig: &Rig,
        view: &View,
    ) -> Result<RecordFile, RecordingError> {
        let names = rig.names(&self.extras);
        if number < self.record.len() {
            create(file, names, self.period_ns, &self.about, view, (&self.book, 0))
        } else {
            create_events(file, names, self.period_ns, &self.book)
        }
    }

    /// Those of the scene of this number, after the first, or why one cannot be made, which keeps none of the others. On the
    /// standard output a table has one header, which is that of the first scene.
    pub fn of_scene(&mut self, rig: &Rig, view: &View, number: u32) -> Vec<Result<Recorder, RecordingError>> {
        let (streams, files): (Vec<_>, Vec<_>) =
            self.record.clone().into_iter().partition(|path| is_standard_output(path));
        if !streams.is_empty() {
            say(format_args!(
                "phantom3: the table on the standard output ends with the scene; other scenes are recorded in files: \
                 --record FILE"
            ));
        }
        files.iter().map(|first| self.begin_beside(first, rig, view, number)).collect()
    }

    /// The recording of the scene of this number, beside that of the first one.
    fn begin_beside(
        &mut self,
        first: &Path,
        rig: &Rig,
        view: &View,
        number: u32,
    ) -> Result<Recorder, RecordingError> {
        let about = self.about.followed_by(rig, first);
        let inputs = rig.input_files();
        let taken: Vec<&PathBuf> =
            self.taken.iter().chain(&self.record).chain(&self.events).chain(&inputs).collect();
        let (path, file) = open_free_place(first, number, &taken)?;
        let names = rig.names(&self.extras);
        let file = create(file, names, self.period_ns, &about, view, (&self.book, number))?;
        self.taken.push(path.clone());
        self.start(&path, file, rig)
    }

    /// One that begins in the middle of the scene of this number.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn under_way(
        &self,
        path: &Path,
        (rig, view, number): (&Rig, &View, u32),
        beginning: &Beginning,
    ) -> Result<Recorder, RecordingError> {
        let about = self.about.under_way((number > 0).then_some(rig), beginning);
        let scene = ((&self.book, number), beginning.run_tick);
        let file = create_under_way(path, rig.names(&self.extras), self.period_ns, &about, view, scene)?;
        self.start(path, file, rig)
    }

    fn start(&self, path: &Path, file: RecordFile, rig: &Rig) -> Result<Recorder, RecordingError> {
        let bodies = rig.names(&self.extras).bodies.len();
        Recorder::start(path, file, bodies, self.period_ns, self.backpressure.clone())
    }
}

/// File for the second scene `out.2.mcap`, for the next `out.3.mcap`; or of the first number behind it that is not taken, that only
/// a recording has by that one name, and that can be opened and is written by nobody else: nobody has named the file.
///
/// # Errors
/// If the system refuses.
fn open_free_place(
    first: &Path,
    scene: u32,
    taken: &[&PathBuf],
) -> Result<(PathBuf, Opened), RecordingError> {
    let mut number = scene + 1;
    loop {
        let place = numbered(first, number);
        let is_taken = taken.iter().any(|other| is_same_place(&place, other));
        if !is_taken && Stream::that_is(&place).is_none() && !is_of_others(&place) {
            match Opened::recording(&place) {
                Err(_) if place.symlink_metadata().is_ok() => {}
                opened => return opened.map(|file| (place, file)),
            }
        }
        number += 1;
    }
}

/// True of a link, a file of several names, one that begins as no recording does, and what is no file: a directory, a pipe.
fn is_of_others(place: &Path) -> bool {
    let Ok(found) = place.symlink_metadata() else { return false };
    !found.is_file() || found.nlink() > 1 || !begins_as_recording(place, found.len())
}

/// True of a table or MCAP, of one that was replacing an earlier content when its process was killed, and of a file that was made and
/// not begun. One that cannot be read tells nothing.
fn begins_as_recording(file: &Path, bytes: u64) -> bool {
    let mut first = Vec::new();
    let read = File::open(file).and_then(|file| file.take(FIRST_BYTES).read_to_end(&mut first));
    match first.split_first() {
        None => bytes == 0 && read.is_ok(),
        Some((&HALF_REPLACED, rest)) => goes_on_as_table(rest) || goes_on_as_mcap(rest),
        Some((b't', rest)) => goes_on_as_table(rest),
        Some((0x89, rest)) => goes_on_as_mcap(rest),
        Some(_) => false,
    }
}

/// Asked of what is behind the `t` of a table: its second column is where the first finger's device is. A hand's file begins with
/// a time, too.
fn goes_on_as_table(rest: &[u8]) -> bool {
    let mut columns = rest.split(|&byte| byte == b',');
    columns.next() == Some(b"") && columns.next().is_some_and(|column| column.ends_with(b"_hip_x"))
}

/// Asked of what is behind the first byte of MCAP.
fn goes_on_as_mcap(rest: &[u8]) -> bool {
    rest.starts_with(b"MCAP0\r\n")
}

/// As many as a time and a finger's name need.
const FIRST_BYTES: u64 = 4096;

fn numbered(path: &Path, number: u32) -> PathBuf {
    match path.extension() {
        Some(ending) => path.with_extension(format!("{number}.{}", ending.to_string_lossy())),
        None => path.with_extension(number.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_begins_with_a_time_is_no_recording_yet() {
        let is_table = goes_on_as_table;
        assert!(is_table(b",f0_hip_x,f0_hip_y") && is_table(b",thumb_hip_x"));
        assert!(!is_table(b",f0_x,f0_y,f0_z") && !is_table(b",reaction_ms") && !is_table(b""));
    }

    fn free_place(first: &Path, scene: u32, taken: &[&PathBuf]) -> PathBuf {
        open_free_place(first, scene, taken).expect("a file").0
    }

    #[test]
    fn the_second_scene_is_recorded_beside_the_first() {
        let place = |path: &str, scene: u32| numbered(Path::new(path), scene + 1).display().to_string();
        assert_eq!([place("a/out.mcap", 1), place("a/out.mcap", 2)], ["a/out.2.mcap", "a/out.3.mcap"]);
        assert_eq!([place("out", 2), place("o.b.csv", 1)], ["out.3", "o.b.2.csv"]);
    }

    #[test]
    fn a_number_whose_file_is_taken_is_passed_over() {
        let directory = tempfile::tempdir().expect("a directory");
        let file = |name: &str| directory.path().join(name);
        let taken = [file("./w.2.csv"), file("w.3.csv")];
        let place = free_place(&file("w.csv"), 1, &taken.iter().collect::<Vec<_>>());
        assert_eq!(place, file("w.4.csv"));
    }

    #[test]
    fn only_an_earlier_recording_that_has_no_other_name_and_that_nobody_writes_is_written_over() {
        let directory = tempfile::tempdir().expect("a directory");
        let file = |name: &str| directory.path().join(name);
        let first = file("w.csv");
        std::fs::write(file("precious.csv"), "t,f0\n0,1\n").expect("room");
        std::os::unix::fs::symlink(file("precious.csv"), file("w.2.csv")).expect("a link");
        std::fs::hard_link(file("precious.csv"), file("w.3.csv")).expect("a link");
        std::os::unix::fs::symlink(file("nowhere"), file("w.4.csv")).expect("a link");
        std::fs::write(file("w.5.csv"), "trial,answer\n1,yes\n").expect("room");
        std::fs::create_dir(file("w.6.csv")).expect("a directory");
        let (kind, mode) = (rustix::fs::FileType::Fifo, rustix::fs::Mode::RUSR);
        rustix::fs::mknodat(rustix::fs::CWD, file("w.7.csv"), kind, mode, 0).expect("a pipe");
        let _other_run = Opened::recording(&file("w.8.csv")).expect("a file");
        std::fs::write(file("w.9.csv"), "\0\0\0\0").expect("room");
        assert_eq!(free_place(&first, 1, &[]), file("w.10.csv"));
        for recording in [
            &b"t,f0_hip_x,f0_hip_y\n0,1,2\n"[..],
            b"\x89MCAP0\r\nrest",
            b"\0,f0_hip_x,f0",
            b"\0MCAP0\r\nhalf",
            b"",
        ] {
            std::fs::write(file("w.10.csv"), recording).expect("room");
            assert_eq!(free_place(&first, 1, &[]), file("w.10.csv"), "a rerun writes the same files again");
        }
    }
}
