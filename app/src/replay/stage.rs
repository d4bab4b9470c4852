//! The scene that a recording is played to: its own, as it was attached, or another one; with changes.

use super::edit::Edit;
use crate::outcome::RunFailure;
use crate::record::read::RecordedRun;
use crate::record::{About, InputFile};
use crate::rig::{HandMode, Rig};
use crate::settings;
use rt_core::input_file;
use shm_abi::segment::ClockMode;
use std::path::{Component, Path, PathBuf};
use tempfile::TempDir;
use toml_edit::DocumentMut;
use world::{MAX_FILE_BYTES, Scene, Settings, ShapeSpec};

/// A scene that is ready to be played to.
pub(super) struct Stage {
    pub(super) rig: Rig,
    /// In words.
    pub(super) name: String,
    /// What a recording of it tells.
    pub(super) about: About,
    /// Whether the recording begins where another scene ended.
    pub(super) follows: bool,
    /// Where attached models lie meanwhile.
    _directory: Option<TempDir>,
}

impl Stage {
    /// The recording's own scene, or `other` with its data where settings say, changed by these edits.
    pub(super) fn set(
        recording: &Path,
        recorded: &RecordedRun,
        other: Option<(&Path, &Settings)>,
        edits: &[Edit],
    ) -> Result<Self, RunFailure> {
        let (file, text) = match other {
            Some((file, _)) => (file.to_path_buf(), read(file)?),
            None => attached_scene(recording, recorded)?,
        };
        let original = text.clone();
        let text = edited(&file, text, edits)?;
        let mut scene = Scene::parse(&text, &file).map_err(|error| match Scene::parse(&original, &file) {
            Ok(_) => wrong(&format_args!("{} (a line of the scene as changed: {})", error, list(edits))),
            Err(error) => wrong(&error),
        })?;
        if let Some((file, settings)) = other {
            settings::find_data(&mut scene, file, settings);
        }
        let its_hand = scene.hand.take().filter(|_| other.is_some());
        let directory = match recorded.about() {
            Some(about) if other.is_none() => unpack_models(&mut scene, about)?,
            _ => None,
        };
        let mut rig = Rig::new(&file, scene, None, None, HandMode::Kinematic, recorded.period_ns())
            .map_err(|error| wrong(&error))?;
        rig.scene.hand = its_hand;
        let mut name = match other {
            Some((file, _)) => file.display().to_string(),
            None => format!("the recording's own, {}", file.display()),
        };
        if !edits.is_empty() {
            name += &format!("; {}", list(edits));
        }
        let about = about(&rig, recorded, other.is_none(), text);
        let follows = recorded.about().is_some_and(About::follows);
        Ok(Self { rig, name, about, follows, _directory: directory })
    }
}

fn list(edits: &[Edit]) -> String {
    edits.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
}

fn wrong(error: &dyn std::fmt::Display) -> RunFailure {
    RunFailure::Start(error.to_string())
}

fn read(file: &Path) -> Result<String, RunFailure> {
    input_file::read_text(file, MAX_FILE_BYTES)
        .map_err(|error| wrong(&format_args!("cannot read the scene {}: {error}", file.display())))
}

fn attached_scene(recording: &Path, recorded: &RecordedRun) -> Result<(PathBuf, String), RunFailure> {
    let Some((path, bytes)) = recorded.about().and_then(|about| about.file("scene")) else {
        return Err(wrong(&format_args!(
            "{} has no scene in it; name the one to play it to with --scene FILE",
            recording.display()
        )));
    };
    let text = std::str::from_utf8(bytes);
    let text = text.map_err(|_| wrong(&format_args!("{}: its scene is no text", recording.display())))?;
    Ok((path.into(), text.into()))
}

fn edited(file: &Path, text: String, edits: &[Edit]) -> Result<String, RunFailure> {
    if edits.is_empty() {
        return Ok(text);
    }
    let mut document: DocumentMut =
        text.parse().map_err(|error| wrong(&format_args!("{}: {error}", file.display())))?;
    for edit in edits {
        edit.apply(&mut document).map_err(|why| wrong(&format_args!("{edit}: {why}")))?;
    }
    Ok(document.to_string())
}

/// Models and pictures that came with the recording take the place of those that the scene names.
fn unpack_models(scene: &mut Scene, about: &About) -> Result<Option<TempDir>, RunFailure> {
    let models: Vec<(&Path, &InputFile)> = about
        .files
        .iter()
        .filter_map(|file| Some((Path::new(file.name.strip_prefix("model:")?), file)))
        .collect();
    if models.is_empty() {
        return Ok(None);
    }
    let no_room = |error: std::io::Error| {
        wrong(&format_args!(
            "cannot unpack the recording's models: {error}; set TMPDIR to a directory that can be written"
        ))
    };
    let directory = tempfile::Builder::new().prefix("phantom3-replay-").tempdir().map_err(no_room)?;
    for (index, (path, file)) in models.iter().enumerate() {
        // Only the name's end is taken, for the format that it says: a recording says nothing of where to write.
        let own = directory.path().join(format!("model-{index}"));
        std::fs::create_dir(&own).map_err(no_room)?;
        let mut place = own.join("model");
        if let Some(ending) = path.extension() {
            place.set_extension(ending);
        }
        std::fs::write(&place, &file.bytes).map_err(no_room)?;
        for (beside, bytes) in about.beside(&path.to_string_lossy()) {
            // Below its own directory, and not in place of the model.
            let is_below = beside.components().all(|part| matches!(part, Component::Normal(_)));
            let to = own.join(&beside);
            if is_below && !to.exists() {
                std::fs::create_dir_all(to.parent().unwrap_or(&own)).map_err(no_room)?;
                std::fs::write(&to, bytes).map_err(no_room)?;
            }
        }
        // Where settings said where it is, the scene has no more than its name.
        let is_known = |named: &Path| models.iter().any(|(path, _)| *path == named);
        for named in model_files(scene) {
            if named.as_path() == *path || !is_known(named) && named.file_name() == path.file_name() {
                named.clone_from(&place);
            }
        }
    }
    Ok(Some(directory))
}

fn model_files(scene: &mut Scene) -> impl Iterator<Item = &mut PathBuf> {
    scene.entities.iter_mut().flat_map(|entity| {
        let model = match &mut entity.shape {
            ShapeSpec::Mesh(model) | ShapeSpec::Nurbs(model) => Some(&mut model.file),
            _ => None,
        };
        model.into_iter().chain(entity.height_map.as_mut().map(|map| &mut map.file))
    })
}

/// With the scene as it was played, and with the models under the names that it has for them.
fn about(rig: &Rig, recorded: &RecordedRun, is_own: bool, text: String) -> About {
    let mut about = About::of_run(rig, ClockMode::Virtual, recorded.period_ns(), 0);
    let models = match recorded.about() {
        Some(of_recording) if is_own => of_recording.files.clone(),
        _ => std::mem::take(&mut about.files),
    };
    about.files = models.into_iter().filter(InputFile::is_of_a_model).collect();
    let name = format!("scene:{}", rig.scene_file.display());
    about.files.insert(0, InputFile { name, bytes: text.into_bytes() });
    about
}
