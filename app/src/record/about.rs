//! What a recording tells of the run that it is of: with what it was made, and everything to play it again.
//!
//! Model: facts are words under a name. Files are the run's inputs as they were: the scene and the hand as they were
//! parsed, the models and pictures that the scene names as they are read again, each under the path that the scene
//! resolves to. One that has changed since, or cannot be read, is left out, which is a fact and is told.
//! Invariant: nothing here depends on the time of day or on where outputs go, unless the clock is not virtual; so equal
//! inputs give equal recordings.

use crate::columns::Names;
use crate::rig::{HandMode, Rig};
use io_driver::device::Extras;
use io_driver::table::MAX_TABLE_BYTES;
use rt_core::input_file;
use serde_json::{Value, json};
use shm_abi::segment::ClockMode;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

/// The fact that names the first recording of the run.
const FOLLOWS: &str = "follows";
/// The facts of a recording that was asked for while the run went on: its first tick, and what had been ordered before.
const BEGINS_TICK: &str = "begins_tick";
const ORDERED_BEFORE: &str = "ordered_before";
/// Facts that begin so say why a file is not here.
const LEFT_OUT: &str = "left out: ";

/// Names of files begin so that a model consists of beside itself.
const BESIDE: &str = "beside:";

/// More than this of models and pictures is not put into a recording.
const MOST_MODEL_BYTES: u64 = 64 << 20;
/// More than this a recording's files never have: scene, hand, and the others.
pub(super) const MOST_FILE_BYTES: u64 = 2 * MAX_TABLE_BYTES + MOST_MODEL_BYTES;

/// A file that the run read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputFile {
    /// Part that it has in the run: `scene`, `hand`, `layout` or `model`; then `:` and its path. A file that a model consists of
    /// beside itself is `beside`, its path is a list in JSON: that of the model, and its own from the model's directory.
    pub name: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

impl InputFile {
    /// True for a model or a picture, or a part of one.
    pub fn is_of_a_model(&self) -> bool {
        ["model:", BESIDE].iter().any(|what| self.name.starts_with(what))
    }
}

/// Where in a run a recording begins that was asked for while it went on.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Beginning {
    /// Its first tick.
    pub run_tick: u64,
    /// What had been ordered by then, in words.
    pub ordered: Vec<String>,
}

/// Facts and files.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct About {
    /// The facts.
    pub facts: BTreeMap<String, String>,
    /// The files.
    pub files: Vec<InputFile>,
}

impl About {
    /// Of a run of this rig.
    pub fn of_run(rig: &Rig, clock: ClockMode, period_ns: u64, seed: u64) -> Self {
        let mut about = Self::default();
        about.tell("program", format!("phantom3 {}", env!("CARGO_PKG_VERSION")));
        about.tell("abi", format!("{}.{}", shm_abi::layout::ABI_MAJOR, shm_abi::layout::ABI_MINOR));
        about.tell("clock", clock.name().into());
        about.tell("period_ns", period_ns.to_string());
        about.tell("seed", seed.to_string());
        about.tell("arguments", json!(inputs_of(std::env::args_os())).to_string());
        about.tell("scene", rig.scene_file.display().to_string());
        about.tell("scene_name", rig.scene.name.clone());
        let hand_mode = match &rig.hand_mode {
            HandMode::Kinematic => "kinematic".to_owned(),
            HandMode::Impedance(devices) => format!(
                "impedance, hand {} ({:?}), device {}",
                devices.hand_model.display(),
                devices.firmness,
                devices.description.display()
            ),
        };
        about.tell("hand_mode", hand_mode);
        about.tell("host", host());
        if clock != ClockMode::Virtual {
            let started = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
            about.tell("started_unix_ns", started.as_nanos().to_string());
        }
        about.attach_inputs(rig);
        about
    }

    /// Of another scene of the same run, whose recording goes on beside this one.
    #[must_use]
    pub fn followed_by(&self, rig: &Rig, recording: &Path) -> Self {
        let mut next = Self { facts: self.facts.clone(), files: Vec::new() };
        next.facts.retain(|name, _| !name.starts_with(LEFT_OUT));
        next.tell("scene", rig.scene_file.display().to_string());
        next.tell("scene_name", rig.scene.name.clone());
        let first = recording.file_name().unwrap_or_default().to_string_lossy();
        next.tell(FOLLOWS, first.into_owned());
        next.attach_inputs(rig);
        next
    }

    /// Of a recording that begins in the middle of a run; with the inputs of `other` if that is the scene which goes on.
    #[must_use]
    pub fn under_way(&self, other: Option<&Rig>, beginning: &Beginning) -> Self {
        let mut about = match other {
            Some(rig) => self.followed_by(rig, Path::new("")),
            None => self.clone(),
        };
        about.facts.remove(FOLLOWS);
        about.tell(BEGINS_TICK, beginning.run_tick.to_string());
        if !beginning.ordered.is_empty() {
            about.tell(ORDERED_BEFORE, beginning.ordered.join("\n"));
        }
        about
    }

    /// The first tick of a recording that begins in the middle of a run.
    pub fn begins_tick(&self) -> Option<u64> {
        self.facts.get(BEGINS_TICK)?.parse().ok()
    }

    /// Whether the recording is of a scene that took over from another one.
    pub fn follows(&self) -> bool {
        self.facts.contains_key(FOLLOWS)
    }

    /// Adds a fact.
    pub fn tell(&mut self, name: &str, fact: String) {
        self.facts.insert(name.into(), fact);
    }

    /// The inputs that are not here though the run read them, each with the reason.
    pub fn left_out(&self) -> impl Iterator<Item = (&str, &str)> {
        self.facts.iter().filter_map(|(name, why)| Some((name.strip_prefix(LEFT_OUT)?, &**why)))
    }

    /// Adds the files of a rig, as it was made of them.
    fn attach_inputs(&mut self, rig: &Rig) {
        let name = format!("scene:{}", rig.scene_file.display());
        self.files.push(InputFile { name, bytes: rig.scene.text.as_str().into() });
        if let Some(hand) = &rig.hand {
            // The rig keeps the absolute path, which is another on every machine.
            let name = hand.path.file_name().map(PathBuf::from).unwrap_or_default();
            self.files
                .push(InputFile { name: format!("hand:{}", name.display()), bytes: hand.bytes.to_vec() });
        }
        let mut left = MOST_MODEL_BYTES;
        let mut models: Vec<&PathBuf> = rig.model_files().collect();
        models.sort_unstable();
        models.dedup();
        for model in models {
            self.attach_model(rig, model, format!("model:{}", model.display()), &mut left);
            let directory = model.parent().unwrap_or(Path::new(""));
            for beside in rig.names_beside(model) {
                let path = json!([model.display().to_string(), beside.display().to_string()]);
                self.attach_model(rig, &directory.join(beside), format!("{BESIDE}{path}"), &mut left);
            }
        }
    }

    fn attach_model(&mut self, rig: &Rig, file: &Path, name: String, left: &mut u64) {
        let length = file.metadata().map_or(0, |file| file.len());
        let Some(rest) = left.checked_sub(length) else {
            return self.leave_out(file, format!("{length} bytes"));
        };
        *left = rest;
        match input_file::read(file, MAX_TABLE_BYTES) {
            Err(error) => self.leave_out(file, format!("it cannot be read any more: {error}")),
            Ok(_) if rig.has_changed(file) => {
                self.leave_out(file, "it has changed since the run read it".into());
            }
            Ok(bytes) => self.files.push(InputFile { name, bytes }),
        }
    }

    /// The files that a model consists of beside itself, each with its path from the model's directory.
    pub fn beside<'a>(&'a self, model: &'a str) -> impl Iterator<Item = (PathBuf, &'a [u8])> {
        self.files.iter().filter_map(move |file| {
            let path = file.name.strip_prefix(BESIDE)?;
            let [of, beside]: [String; 2] = serde_json::from_str(path).ok()?;
            (of == model).then_some((beside.into(), &file.bytes[..]))
        })
    }

    fn leave_out(&mut self, file: &Path, why: String) {
        self.tell(&format!("{LEFT_OUT}{}", file.display()), why);
    }

    /// The file that is this to the run.
    pub fn file(&self, what: &str) -> Option<(&str, &[u8])> {
        self.files.iter().find_map(|file| {
            let path = file.name.strip_prefix(what)?.strip_prefix(':')?;
            Some((path, &file.bytes[..]))
        })
    }
}

/// The machine and its kernel, as far as they say.
fn host() -> String {
    let word = |file: &str| std::fs::read_to_string(file).unwrap_or_default().trim().to_owned();
    ["/proc/sys/kernel/hostname", "/proc/sys/kernel/osrelease"].map(word).join(" ")
}

/// Arguments without the program's name and without where recordings go.
fn inputs_of(arguments: impl IntoIterator<Item = OsString>) -> Vec<String> {
    let mut inputs = Vec::new();
    let mut words = arguments.into_iter().skip(1).map(|word| word.to_string_lossy().into_owned());
    while let Some(word) = words.next() {
        if word == "--record" {
            words.next();
        } else if !word.starts_with("--record=") {
            inputs.push(word);
        }
    }
    inputs
}

/// Names as facts.
pub(super) fn columns_of(names: &Names) -> BTreeMap<String, String> {
    let extras = |tells: fn(&Extras) -> bool| json!(names.extras.iter().map(tells).collect::<Vec<_>>());
    [
        ("fingers", json!(names.fingers)),
        ("entities", json!(names.entities)),
        ("objects", json!(names.bodies)),
        ("orientations", extras(|extras| extras.orientation)),
        ("buttons", extras(|extras| extras.buttons)),
        ("passive", json!(names.passive)),
        ("torques", json!(names.torques)),
        ("ties", json!(names.ties)),
        ("grasp_quality", json!(names.grasp_quality)),
        ("spaces", json!(names.spaces)),
        ("lists", json!(names.lists)),
        ("as_of", json!(names.as_of)),
        ("fields", json!(super::schema::field_names(names))),
    ]
    .map(|(name, value)| (name.to_owned(), value.to_string()))
    .into()
}

/// Names of such facts; `None` if they are not complete.
pub(super) fn names_of(facts: &BTreeMap<String, String>) -> Option<Names> {
    let list = |name: &str| serde_json::from_str::<Value>(facts.get(name)?).ok();
    let word = |value: &Value| value.as_str().map(str::to_owned);
    let words = |name: &str| list(name)?.as_array()?.iter().map(word).collect::<Option<Vec<_>>>();
    let flags = |name: &str| list(name)?.as_array()?.iter().map(Value::as_bool).collect::<Option<Vec<_>>>();
    let of_device = |(orientation, buttons)| Extras { orientation, buttons };
    Some(Names {
        fingers: words("fingers")?,
        extras: flags("orientations")?.into_iter().zip(flags("buttons")?).map(of_device).collect(),
        passive: flags("passive")?,
        torques: flags("torques")?,
        entities: words("entities")?,
        bodies: words("objects")?,
        ties: flags("ties")?,
        grasp_quality: list("grasp_quality")?.as_bool()?,
        // Not in recordings of before there were doors.
        spaces: words("spaces"),
        // Recordings of earlier versions do not have these.
        lists: list("lists").and_then(|lists| lists.as_bool()).unwrap_or_default(),
        as_of: list("as_of").and_then(|as_of| as_of.as_bool()).unwrap_or_default(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn where_a_recording_goes_is_no_input_of_it() {
        let words = |line: &str| line.split(' ').map(OsString::from).collect::<Vec<_>>();
        let line = "phantom3 run a.toml --record x.mcap --seed 3 --record=y.csv --headless";
        assert_eq!(inputs_of(words(line)), ["run", "a.toml", "--seed", "3", "--headless"]);
    }

    /// Editors save files while a run begins.
    #[test]
    fn inputs_that_change_after_they_were_read_are_attached_as_they_were_or_not_at_all() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = |name: &str| directory.path().join(name);
        let cube = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
        let entity = |model: &str| format!("[[entity]]\nshape = {{ kind = \"mesh\", file = \"{model}\" }}\n");
        let scene = format!("[[finger]]\n{}{}{}", entity("a.obj"), entity("b.obj"), entity("c.obj"));
        let hand = "t,f0_x,f0_y,f0_z\n0,0,0,0\n1,0,0,0\n";
        for (name, text) in
            [("s.toml", &*scene), ("h.csv", hand), ("a.obj", cube), ("b.obj", cube), ("c.obj", cube)]
        {
            std::fs::write(path(name), text).expect("room");
        }
        let read = world::Scene::load(path("s.toml")).expect("a scene");
        let rig = Rig::new(&path("s.toml"), read, None, Some(&path("h.csv")), HandMode::Kinematic, 1_000_000);
        let rig = rig.expect("a rig");
        for (name, text) in [("s.toml", "[[finger]]\n"), ("h.csv", "t\n"), ("b.obj", "v 9 9 9\n")] {
            std::fs::write(path(name), text).expect("room");
        }
        std::fs::remove_file(path("c.obj")).expect("ours");
        let about = About::of_run(&rig, ClockMode::Virtual, 1_000_000, 0);
        let [scene_now, hand_now] = ["scene", "hand"].map(|what| about.file(what).expect("attached").1);
        assert_eq!((scene_now, hand_now), (scene.as_bytes(), hand.as_bytes()));
        let models: Vec<_> = about.files.iter().filter(|file| file.name.starts_with("model:")).collect();
        assert!(models.len() == 1 && models[0].name.ends_with("a.obj"), "{models:?}");
        let left_out: Vec<_> = about.left_out().collect();
        let [(b, changed), (c, gone)] = left_out[..] else { panic!("{left_out:?}") };
        assert!(b.ends_with("b.obj") && changed.contains("has changed since the run read it"), "{changed}");
        assert!(c.ends_with("c.obj") && gone.contains("cannot be read any more"), "{gone}");
    }

    #[test]
    fn names_come_back_from_what_is_told_of_them() {
        let names = Names {
            fingers: vec!["a".into(), "b".into()],
            extras: vec![Extras { orientation: true, buttons: false }, Extras::default()],
            passive: vec![false, true],
            torques: vec![true, false],
            entities: vec!["table".into()],
            bodies: vec![],
            ties: vec![false, false],
            grasp_quality: true,
            spaces: Some(vec!["inside".into()]),
            lists: true,
            as_of: true,
        };
        let facts = columns_of(&names);
        assert_eq!(names_of(&facts), Some(names));
        let without = facts.into_iter().filter(|(name, _)| name != "ties").collect();
        assert_eq!(names_of(&without), None);
    }
}
