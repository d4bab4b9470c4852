//! From files and arguments to everything a run needs: whatever can be wrong with the input is found here,
//! before anything is started.

mod devices;
mod doors;
mod effects;
mod entities;
mod error;
mod face_labels;
mod file_version;
mod material;
mod models;
mod moving;
mod pictures;
mod problems;
mod solids;

use self::devices::check_hand;
use self::entities::is_only_seen;
pub use self::error::RigError;
use self::file_version::FileVersion;
use self::material::Unfit;
use self::models::Models;
pub use self::moving::Passing;
pub(crate) use self::moving::in_words;
use self::pictures::Pictures;
pub use self::problems::Problems;
use self::solids::Solids;
use crate::fast_step::{DeviceFinger, FastStep};
use crate::recording::Names;
use crate::settings;
use crate::simulated::SimulatedDevices;
use haptics::mesh::MeshReport;
use haptics::passivity::Passivity;
use haptics::{Door, Entity, Finger, Friction, ParameterError};
use io_driver::device::Extras;
use io_driver::open::{HandFiles, open_devices_with};
use nalgebra::{Isometry3, Vector3};
use physics::{Aabb, Body, BroadPhase};
use shm_abi::segment::ClockMode;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use world::{FacesSpec, FrictionSpec, Layout, Scene, SceneEntity, SceneFinger, Settings, ShapeSpec};

/// A day (s): longer runs are asked for by repeating them.
pub(crate) const LONGEST_RUN_S: f64 = 86_400.0;

/// What a run needs, checked.
#[derive(Debug, Clone)]
pub struct Rig {
    /// The scene's file, for messages.
    pub scene_file: PathBuf,
    /// The scene.
    pub scene: Scene,
    /// Where the devices stand; `None`: nobody has said.
    pub layout: Option<Layout>,
    /// How the hand moves the devices.
    pub hand_mode: HandMode,
    /// The hand file, and how long it lasts.
    pub hand: Option<HandFile>,
    /// Length of a tick (ns).
    pub period_ns: u64,
    /// X_WD of each device; beyond the list the world's origin.
    bases: Vec<Isometry3<f64>>,
    models: Models,
    pictures: Pictures,
    /// The files of both, before they were read.
    versions: BTreeMap<PathBuf, FileVersion>,
    /// Of models that consist of several files, the others, by their paths from the model's directory.
    beside: BTreeMap<PathBuf, Vec<PathBuf>>,
}

/// How the hand moves the devices that are not real.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum HandMode {
    /// The fingers follow it exactly.
    #[default]
    Kinematic,
    /// It pulls simulated devices.
    Impedance(SimulatedDevices),
}

/// A checked hand file.
#[derive(Debug, Clone)]
pub struct HandFile {
    /// Absolute path: the driver is told of it, too.
    pub path: PathBuf,
    /// Its content, which the run goes by whatever becomes of the file.
    pub bytes: Arc<[u8]>,
    /// The same as text.
    pub text: Arc<str>,
    /// Its duration (s).
    pub duration_s: f64,
    /// Number of its rows.
    pub rows: usize,
    /// Corners of the box that each finger's path fills, in W (m); `None` without a path.
    pub bounds: Vec<Option<[Vector3<f64>; 2]>>,
}

impl Rig {
    /// Checks scene, layout and hand together.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn new(
        scene_file: &Path,
        scene: Scene,
        layout: Option<Layout>,
        hand: Option<&Path>,
        hand_mode: HandMode,
        period_ns: u64,
    ) -> Result<Self, RigError> {
        let mut problems = Problems::default();
        let rig = Self::examine(scene_file, scene, layout, hand, hand_mode, period_ns, &mut problems);
        problems.first_or(rig)
    }

    /// The same, but all that is wrong goes to `problems`; `None`: there is too much to go on with.
    pub fn examine(
        scene_file: &Path,
        scene: Scene,
        layout: Option<Layout>,
        hand: Option<&Path>,
        hand_mode: HandMode,
        period_ns: u64,
        problems: &mut Problems,
    ) -> Option<Self> {
        let named = match (hand, &scene.hand) {
            (Some(path), _) => Some((path, "--hand".to_owned())),
            (None, Some(path)) => Some((path.as_path(), scene_file.display().to_string())),
            (None, None) => None,
        };
        let hand = named.map(|(path, named_by)| check_hand(path, &named_by, &scene)).transpose();
        let hand = problems.keep(hand);
        let version = |file: &PathBuf| Some((file.clone(), FileVersion::of(file)?));
        let beside = beside(&scene);
        let parts = beside.iter().flat_map(|(model, names)| files_beside(model, names));
        let versions = model_files(&scene).cloned().chain(parts).filter_map(|file| version(&file)).collect();
        let mut rig = Self {
            scene_file: scene_file.into(),
            versions,
            beside,
            models: Models::load(&scene, problems),
            pictures: Pictures::load(&scene, problems),
            scene,
            layout,
            hand_mode,
            bases: Vec::new(),
            hand: hand.clone().flatten(),
            period_ns,
        };
        rig.bases = problems.keep(rig.place_bases())?;
        let step = rig.assemble(problems);
        rig.tell_what_passes(step.as_ref().map_or(&[], FastStep::entities));
        if let HandMode::Impedance(simulated) = &rig.hand_mode {
            // What the driver would find wrong is found here, before anything is started, and told in words of what
            // was asked for: the driver knows of files only.
            problems.keep(simulated.arm());
            problems.keep(simulated.hand());
            problems.keep(open_devices_with(&rig.driver_config(ClockMode::Virtual), rig.hand_files()));
        }
        hand.and(step).map(|_| rig)
    }

    /// The hand file as it was read, for the driver's devices.
    pub fn hand_files(&self) -> HandFiles {
        self.hand.iter().map(|hand| (hand.path.clone(), Arc::clone(&hand.text))).collect()
    }

    /// The same at another tick length (ns): the running driver's.
    #[must_use]
    pub fn at_period(self, period_ns: u64) -> Self {
        Self { period_ns, ..self }
    }

    /// Another scene for the same devices, where they are and as they are moved; what is not where the scene says is where
    /// the settings say.
    ///
    /// # Errors
    /// The first thing that is wrong with it.
    pub fn beside(&self, scene_file: &Path, settings: &Settings) -> Result<Self, RigError> {
        let scene_file = &settings::find(scene_file, &settings.scenes.value);
        let mut scene = Scene::load(scene_file)?;
        settings::find_data(&mut scene, scene_file, settings);
        let its_hand = scene.hand.take();
        let mut rig =
            Self::new(scene_file, scene, self.layout.clone(), None, HandMode::Kinematic, self.period_ns)?;
        rig.scene.hand = its_hand;
        let (bases, hand_mode, hand) = (self.bases.clone(), self.hand_mode.clone(), self.hand.clone());
        Ok(Self { bases, hand_mode, hand, ..rig })
    }

    /// The rendering of this scene.
    ///
    /// # Errors
    /// If the scene holds something that rendering refuses.
    pub fn fast_step(&self) -> Result<FastStep, RigError> {
        let mut problems = Problems::default();
        let step = self.assemble(&mut problems);
        problems.first_or(step)
    }

    fn assemble(&self, problems: &mut Problems) -> Option<FastStep> {
        let mut solids = Solids::default();
        let entity = |spec: &SceneEntity| {
            // That its model or picture cannot be had was told when they were loaded.
            let made = if is_only_seen(&self.scene, spec) {
                self.models.has(spec).then(|| self.only_seen(spec, &mut solids))
            } else {
                (self.models.has(spec) && self.pictures.has(spec)).then(|| self.entity(spec, &mut solids))
            };
            made.and_then(|made| problems.keep(made))
        };
        let entities: Vec<Option<Entity>> = self.scene.entities.iter().map(entity).collect();
        let passivities: Vec<Option<Option<Passivity>>> =
            self.scene.fingers.iter().map(|finger| problems.keep(self.passivity(finger))).collect();
        let effects = problems.keep(self.effects());
        let entities: Vec<Entity> = entities.into_iter().collect::<Option<_>>()?;
        let entities = self.prepared(entities);
        let fingers: Vec<Option<DeviceFinger>> =
            self.scene.fingers.iter().map(|finger| problems.keep(self.finger(finger, &entities))).collect();
        let bodies: Vec<(usize, Body)> =
            self.bodies(&entities).filter_map(|body| problems.keep(body)).collect();
        let doors: Vec<Door> = self.doors().filter_map(|door| problems.keep(door)).collect();
        let (fields, guides) = effects?;
        if !problems.is_empty() {
            return None;
        }
        let step = FastStep::new(fingers.into_iter().collect::<Option<_>>()?, entities, self.period_ns);
        let step = if bodies.is_empty() { step } else { problems.keep(self.with_objects(step, &bodies))? };
        let passivities: Vec<Option<Passivity>> = passivities.into_iter().collect::<Option<_>>()?;
        Some(step.with_effects(fields, guides).with_passivities(passivities).with_doors(doors))
    }

    fn finger(&self, spec: &SceneFinger, entities: &[Entity]) -> Result<DeviceFinger, RigError> {
        let finger = Finger::new(spec.radius_m, capacity(entities, spec.radius_m))
            .map_err(|source| self.refused(None, format!("finger {}", spec.name), source))?;
        self.check_felt(entities, spec)?;
        let finger = finger.with_room_for(entities).within(self.space(spec.within.as_ref()));
        Ok(DeviceFinger { finger, device: spec.device, mount: self.mount(spec.device) })
    }

    fn passivity(&self, finger: &SceneFinger) -> Result<Option<Passivity>, RigError> {
        let Some(spec) = &finger.passivity else { return Ok(None) };
        let what = || format!("passivity of finger {}", finger.name);
        let refused = |source| self.refused(None, what(), source);
        material::passivity(spec, self.period_ns as f64 / 1e9).map(Some).map_err(refused)
    }

    /// What the recording's columns are called, for devices that tell so much.
    pub fn names(&self, devices: &[Extras]) -> Names {
        let lists = self.moving().count() > self.scene.dynamics.lists.fast_bodies;
        let of = |device: usize| devices.get(device).copied().unwrap_or_default();
        Names {
            extras: self.scene.fingers.iter().map(|finger| of(finger.device)).collect(),
            passive: self.scene.fingers.iter().map(|finger| finger.passivity.is_some()).collect(),
            torques: self.scene.fingers.iter().map(has_torque).collect(),
            ties: self.scene.fingers.iter().map(|finger| finger.attach.is_some()).collect(),
            grasp_quality: self.scene.dynamics.grasp_quality,
            spaces: self.space_names(),
            lists,
            as_of: lists,
            fingers: self.scene.fingers.iter().map(|finger| finger.name.clone()).collect(),
            entities: self.scene.entities.iter().map(|entity| entity.name.clone()).collect(),
            bodies: self.moving().map(|(_, entity, _)| entity.name.clone()).collect(),
        }
    }

    /// How long the run lasts if nobody says (s): as long as the hand file, and at least a second; with a live hand for ever.
    pub fn default_seconds(&self) -> f64 {
        if self.is_live() {
            return f64::INFINITY;
        }
        self.hand.as_ref().map_or(1.0, |hand| hand.duration_s.max(1.0))
    }

    /// Whether somebody at a window, and no file, says where the fingers shall be.
    pub fn is_live(&self) -> bool {
        matches!(&self.hand_mode, HandMode::Impedance(simulated) if simulated.is_live)
    }

    /// The meshes, each with its file and what was found in it.
    pub fn mesh_reports(&self) -> &[(PathBuf, MeshReport)] {
        self.models.reports()
    }

    /// Tables of `[[entity.faces]]` that no face of their mesh is left for.
    pub fn idle_faces(&self) -> impl Iterator<Item = &FacesSpec> {
        self.scene.entities.iter().flat_map(|entity| self.models.idle_faces(entity))
    }

    /// The model and picture files that it is made of.
    pub fn model_files(&self) -> impl Iterator<Item = &PathBuf> {
        model_files(&self.scene)
    }

    /// The files that such a file consists of beside itself, by their paths from its directory.
    pub fn names_beside(&self, model_file: &Path) -> &[PathBuf] {
        self.beside.get(model_file).map_or(&[], Vec::as_slice)
    }

    /// True for a file of a model that is not what was read of it any more.
    pub fn has_changed(&self, model_file: &Path) -> bool {
        self.versions.get(model_file).copied() != FileVersion::of(model_file)
    }

    /// All files that it consists of, also those that this run does not read: nothing is written into them.
    pub fn input_files(&self) -> Vec<PathBuf> {
        let devices = match &self.hand_mode {
            HandMode::Impedance(devices) => vec![&devices.description, &devices.hand_model],
            HandMode::Kinematic => Vec::new(),
        };
        let hands = self.hand.iter().map(|hand| &hand.path).chain(&self.scene.hand);
        let scenes = [&self.scene_file].into_iter().chain(&self.scene.included);
        let named = scenes.chain(hands).chain(devices).chain(all_model_files(&self.scene)).cloned();
        named.chain(self.beside.iter().flat_map(|(model, names)| files_beside(model, names))).collect()
    }

    fn refused(&self, line: Option<usize>, what: String, source: ParameterError) -> RigError {
        RigError::Refused { file: self.scene_file.clone(), line, what, source }
    }

    /// Why something that begins in this line of the scene has no counterpart in rendering.
    fn unfit(&self, (file, line): (&Path, usize), what: String, unfit: Unfit) -> RigError {
        let file = file.to_path_buf();
        match unfit {
            Unfit::Refused(source) => RigError::Refused { file, line: Some(line), what, source },
            Unfit::NoSolid(source) => RigError::NoSolid { file, line, what, source },
            Unfit::NotAvailable(it) => self.not_available(format!("{what}: {it}")),
        }
    }

    fn not_available(&self, what: String) -> RigError {
        RigError::NotAvailable { file: self.scene_file.clone(), what }
    }
}

fn model_files(scene: &Scene) -> impl Iterator<Item = &PathBuf> {
    let models = scene.entities.iter().filter_map(|entity| match &entity.shape {
        ShapeSpec::Mesh(model) | ShapeSpec::Nurbs(model) => Some(&model.file),
        _ => None,
    });
    models.chain(scene.entities.iter().filter_map(|entity| Some(&entity.height_map.as_ref()?.file)))
}

/// Those that are felt, and those that are only seen.
fn all_model_files(scene: &Scene) -> impl Iterator<Item = &PathBuf> {
    let visuals = scene.entities.iter().flat_map(|entity| &*entity.visuals);
    let seen = visuals.filter_map(|visual| match &visual.shape {
        Some(ShapeSpec::Mesh(model) | ShapeSpec::Nurbs(model)) => Some(&model.file),
        _ => None,
    });
    model_files(scene).chain(seen)
}

/// Of each model that consists of several files, the others.
fn beside(scene: &Scene) -> BTreeMap<PathBuf, Vec<PathBuf>> {
    let files: BTreeSet<&PathBuf> = all_model_files(scene).collect();
    let named = files.into_iter().map(|file| (file.clone(), world::model::files_beside(file)));
    named.filter(|(_, names)| !names.is_empty()).collect()
}

fn files_beside<'m>(model: &'m Path, names: &'m [PathBuf]) -> impl Iterator<Item = PathBuf> + 'm {
    let directory = model.parent().unwrap_or(Path::new(""));
    names.iter().map(move |name| directory.join(name))
}

/// The friction that this says.
///
/// # Errors
/// What rendering refuses of it.
pub fn friction(spec: &FrictionSpec) -> Result<Friction, String> {
    material::friction(spec).map_err(|unfit| match unfit {
        Unfit::Refused(error) => error.to_string(),
        Unfit::NoSolid(error) => error.to_string(),
        Unfit::NotAvailable(what) => format!("this version has no {what}"),
    })
}

/// How many entities a finger can feel at once: as many as overlap at one place, and room for more that are near.
fn capacity(entities: &[Entity], radius_m: f64) -> usize {
    let broad_phase = BroadPhase::new(entities);
    let boxes: Vec<Aabb> = entities.iter().filter_map(Aabb::of_entity).collect();
    let crowd_at = |place: &Aabb| {
        let mut crowd = 0;
        broad_phase.near(&Aabb::of_ball(&place.middle_W(), radius_m), |_| crowd += 1);
        crowd
    };
    // Of many, some tell enough.
    let every = boxes.len().div_ceil(MOST_PLACES).max(1);
    let crowd = boxes.iter().step_by(every).map(crowd_at).max().unwrap_or_default();
    entities.len().min(crowd.clamp(LEAST_SLOTS, MOST_SLOTS))
}

/// Slots of a finger, where there are so many entities.
const LEAST_SLOTS: usize = 128;
/// A tick looks at each.
const MOST_SLOTS: usize = 1024;
/// Places at which crowds are counted.
const MOST_PLACES: usize = 1024;

/// Whether contacts turn it: it has a radius, a pad, or something tied to it.
fn has_torque(finger: &SceneFinger) -> bool {
    finger.radius_m > 0.0 || finger.soft.is_some() || finger.attach.is_some()
}
