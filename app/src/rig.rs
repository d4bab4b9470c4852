//! From files and arguments to everything a run needs: whatever can be wrong with the input is found here,
//! before anything is started.

mod doors;
mod effects;
mod error;
mod material;
mod models;
mod moving;
mod pictures;
mod problems;
mod solids;

pub use self::error::RigError;
use self::material::Unfit;
use self::models::Models;
pub use self::moving::Passing;
pub(crate) use self::moving::in_words;
use self::pictures::Pictures;
pub use self::problems::Problems;
use self::solids::Solids;
use crate::fast_step::{DeviceFinger, FastStep};
use crate::mount::Mount;
use crate::recording::Names;
use crate::simulated::{SimulatedDevices, base_for_path};
use haptics::mesh::MeshReport;
use haptics::passivity::Passivity;
use haptics::{Algorithm, Door, Entity, Finger, ParameterError};
use io_driver::config::{
    Backend, DeviceConfig, DriverConfig, ProcessConfig, RealTime, ReplyConfig, ReplyMode, SafetyConfig, Wish,
    Zeroing,
};
use io_driver::device::Extras;
use io_driver::device_file::Workspace;
use io_driver::open::open_devices;
use io_driver::say::say;
use io_driver::sim::script::HandScript;
use nalgebra::{Isometry3, Vector3};
use physics::Body;
use shm_abi::segment::ClockMode;
use std::path::{Path, PathBuf};
use world::{AlgorithmSpec, Layout, Scene, SceneEntity, SceneFinger, ShapeSpec};

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
    /// Where it lies; absolute, since the driver reads it too.
    pub path: PathBuf,
    /// Its duration (s).
    pub duration_s: f64,
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
        let scene = doors::without_what_is_only_seen(scene);
        let mut rig = Self {
            scene_file: scene_file.into(),
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
            problems.keep(open_devices(&rig.driver_config(ClockMode::Virtual)));
        }
        hand.and(step).map(|_| rig)
    }

    /// The same at another tick length (ns): the running driver's.
    #[must_use]
    pub fn at_period(self, period_ns: u64) -> Self {
        Self { period_ns, ..self }
    }

    /// Another scene for the same devices, where they are and as they are moved.
    ///
    /// # Errors
    /// The first thing that is wrong with it.
    pub fn beside(&self, scene_file: &Path) -> Result<Self, RigError> {
        let scene = Scene { hand: None, ..Scene::load(scene_file)? };
        let rig =
            Self::new(scene_file, scene, self.layout.clone(), None, HandMode::Kinematic, self.period_ns)?;
        let (bases, hand_mode, hand) = (self.bases.clone(), self.hand_mode.clone(), self.hand.clone());
        Ok(Self { bases, hand_mode, hand, ..rig })
    }

    /// Where a device stands, X_WD.
    pub fn base_in_world(&self, device: usize) -> Isometry3<f64> {
        self.bases.get(device).copied().unwrap_or_else(Isometry3::identity)
    }

    fn mount(&self, device: usize) -> Mount {
        match &self.layout {
            Some(layout) => Mount::placed(&layout.placement(device)),
            None => Mount::new(self.base_in_world(device)),
        }
    }

    fn place_bases(&self) -> Result<Vec<Isometry3<f64>>, RigError> {
        let devices = 0..self.device_count();
        match (&self.layout, &self.hand_mode) {
            (Some(layout), _) => Ok(devices.map(|device| layout.pose(device)).collect()),
            (None, HandMode::Kinematic) => Ok(Vec::new()),
            (None, HandMode::Impedance(simulated)) => {
                let workspace = simulated.arm()?.workspace;
                Ok(devices.map(|device| self.base_near_path(device, &workspace)).collect())
            }
        }
    }

    /// So that the finger's path lies within the workspace.
    fn base_near_path(&self, device: usize, workspace: &Workspace) -> Isometry3<f64> {
        let Some(index) = self.scene.fingers.iter().position(|finger| finger.device == device) else {
            return Isometry3::identity();
        };
        let finger = &self.scene.fingers[index];
        let bounds = self.hand.as_ref().and_then(|hand| hand.bounds.get(index).copied().flatten());
        let [lowest, highest] = bounds.unwrap_or([finger.start_m.coords; 2]);
        let base = base_for_path(lowest, highest, workspace);
        if base != Isometry3::identity() {
            let [x, y, z]: [f64; 3] = base.translation.vector.into();
            say(format_args!(
                "phantom3: the device of finger {} stands at [{x:.4}, {y:.4}, {z:.4}] m, so that the hand's path lies in \
                 its workspace; --layout says otherwise",
                finger.name
            ));
        }
        base
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
            let is_loaded = self.models.has(spec) && self.pictures.has(spec);
            is_loaded.then(|| problems.keep(self.entity(spec, &mut solids))).flatten()
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
        let finger = Finger::new(spec.radius_m, entities.len().min(MOST_NEAR))
            .map_err(|source| self.refused(None, format!("finger {}", spec.name), source))?;
        self.check_felt(entities, spec)?;
        let finger = finger.within(self.space(spec.within.as_ref()));
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
        let of = |device: usize| devices.get(device).copied().unwrap_or_default();
        Names {
            extras: self.scene.fingers.iter().map(|finger| of(finger.device)).collect(),
            passive: self.scene.fingers.iter().map(|finger| finger.passivity.is_some()).collect(),
            torques: self.scene.fingers.iter().map(has_torque).collect(),
            ties: self.scene.fingers.iter().map(|finger| finger.attach.is_some()).collect(),
            grasp_quality: self.scene.dynamics.grasp_quality,
            spaces: self.space_names(),
            fingers: self.scene.fingers.iter().map(|finger| finger.name.clone()).collect(),
            entities: self.scene.entities.iter().map(|entity| entity.name.clone()).collect(),
            bodies: self.moving().map(|(_, entity, _)| entity.name.clone()).collect(),
        }
    }

    /// How many devices the fingers need.
    pub fn device_count(&self) -> usize {
        self.scene.fingers.iter().map(|finger| finger.device + 1).max().unwrap_or(0)
    }

    /// How long the run lasts if nobody says: as long as the hand file, and at least a second.
    pub fn default_seconds(&self) -> f64 {
        self.hand.as_ref().map_or(1.0, |hand| hand.duration_s.max(1.0))
    }

    /// A driver whose devices are the scripted hand's fingers.
    pub fn driver_config(&self, clock: ClockMode) -> DriverConfig {
        let period_ns = self.period_ns;
        let reply = ReplyConfig { mode: ReplyMode::OnArrival, budget_ns: period_ns / 2 };
        DriverConfig {
            period_ns,
            clock,
            socket: None,
            real_time: RealTime::usual(period_ns, reply.budget_ns),
            reply,
            safety: SafetyConfig::usual(period_ns),
            process: ProcessConfig::default(),
            devices: (0..self.device_count()).map(|index| self.device(index)).collect(),
        }
    }

    fn device(&self, index: usize) -> DeviceConfig {
        let finger = self.scene.fingers.iter().find(|finger| finger.device == index);
        let hand =
            finger.and_then(|finger| self.hand.as_ref().map(|hand| (hand.path.clone(), finger.name.clone())));
        let wish = Wish {
            hand,
            start_m: finger.map_or_else(Vector3::zeros, |finger| finger.start_m.coords),
            base_in_world: self.base_in_world(index),
        };
        let (backend, compensates_gravity) = match &self.hand_mode {
            // A device that is no finger's needs no hand.
            HandMode::Impedance(simulated) if finger.is_some() => (simulated.backend(wish), true),
            _ => (Backend::Ideal(wish), false),
        };
        DeviceConfig {
            // No finger can be called so: brackets are not allowed in a name.
            name: finger.map_or_else(|| format!("(unused {index})"), |finger| finger.name.clone()),
            backend,
            peak_force_n: None,
            compensates_gravity,
            zeroing: Zeroing::Known,
        }
    }

    fn entity(&self, spec: &SceneEntity, solids: &mut Solids) -> Result<Entity, RigError> {
        let what = || format!("entity {}", spec.name);
        let refused = |source| refused(spec, source);
        let unfit = |unfit| self.unfit((&spec.file, spec.line), what(), unfit);
        self.check_rendered(spec, what())?;
        let shape =
            material::shape(&spec.shape, &self.models, spec.height_map.is_some(), solids).map_err(unfit)?;
        let friction = material::friction(&spec.friction).map_err(unfit)?;
        let algorithm = material::algorithm(spec.algorithm).map_err(unfit)?;
        let shading = material::shading(spec, &self.models).map_err(unfit)?;
        let height_map =
            spec.height_map.as_ref().map(|map| self.pictures.height_map(map, &shape)).transpose()?;
        let entity = Entity::new(shape, spec.pose, spec.stiffness_n_per_m)
            .and_then(|entity| entity.with_damping(spec.damping_n_s_per_m))
            .and_then(|entity| entity.with_friction(friction))
            .and_then(|entity| match spec.restitution {
                Some(restitution) => entity.with_restitution(restitution),
                None => Ok(entity),
            })
            .map(|entity| entity.with_algorithm(algorithm).with_shading(shading))
            .map_err(refused)?;
        let entity = match height_map {
            Some(height_map) => entity.with_height_map(height_map),
            None => entity,
        };
        let entity = if spec.is_collidable { entity } else { entity.without_collisions() };
        let entity = entity.within(self.space(spec.within.as_ref()));
        if spec.is_haptic { self.with_surface_effects(entity, spec) } else { Ok(entity.without_fingers()) }
    }

    /// The algorithms to compare with know surfaces, and trees have none of their own.
    fn check_rendered(&self, spec: &SceneEntity, what: String) -> Result<(), RigError> {
        let found = match spec.algorithm {
            AlgorithmSpec::VectorField => "vector-field",
            AlgorithmSpec::ClassicGodObject => "classic",
            _ => return Ok(()),
        };
        if !material::is_csg(&spec.shape) {
            return Ok(());
        }
        Err(RigError::NotRendered { file: spec.file.to_path_buf(), line: spec.line, what, found })
    }

    /// What balls cannot feel by its equation they feel in triangles, made once for all forms that are alike.
    fn prepared(&self, entities: Vec<Entity>) -> Vec<Entity> {
        let mut made: Vec<Entity> = Vec::new();
        let mut prepare = |entity: Entity, radius_m: f64| {
            if !entity.is_haptic || entity.is_felt_by(radius_m) {
                return entity;
            }
            if let Some(alike) = made.iter().find(|other| other.shape == entity.shape) {
                return Entity { for_balls: alike.for_balls.clone(), ..entity };
            }
            let entity = entity.prepared_for(radius_m);
            made.push(entity.clone());
            entity
        };
        let radii = || self.scene.fingers.iter().map(|finger| finger.radius_m);
        entities.into_iter().map(|entity| radii().fold(entity, &mut prepare)).collect()
    }

    /// A finger would pass through what it cannot feel, without a word.
    fn check_felt(&self, entities: &[Entity], finger: &SceneFinger) -> Result<(), RigError> {
        let is_lost = |entity: &Entity| entity.is_haptic && !entity.is_felt_by(finger.radius_m);
        let not_felt = entities.iter().position(is_lost);
        let Some(index) = not_felt else { return Ok(()) };
        let spec = &self.scene.entities[index];
        let with_cone = entities[index].clone().with_algorithm(Algorithm::FrictionCone);
        // Somebody's own shape may be felt by small balls only.
        let by_smaller = entities[index].is_felt_by(1e-3 * finger.radius_m);
        Err(RigError::NotFelt {
            file: spec.file.to_path_buf(),
            line: spec.line,
            finger: finger.name.clone(),
            radius_m: finger.radius_m,
            entity: spec.name.clone(),
            kind: spec.shape.kind(),
            otherwise: match () {
                () if with_cone.is_felt_by(finger.radius_m) => ", algorithm = \"friction-cone\"",
                () if by_smaller => ", a smaller radius",
                () => "",
            },
        })
    }

    /// The meshes, each with its file and what was found in it.
    pub fn mesh_reports(&self) -> &[(PathBuf, MeshReport)] {
        self.models.reports()
    }

    /// The model and picture files that it is made of.
    pub fn model_files(&self) -> impl Iterator<Item = &PathBuf> {
        let models = self.scene.entities.iter().filter_map(|entity| match &entity.shape {
            ShapeSpec::Mesh(model) | ShapeSpec::Nurbs(model) => Some(&model.file),
            _ => None,
        });
        models.chain(self.scene.entities.iter().filter_map(|entity| Some(&entity.height_map.as_ref()?.file)))
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

/// A finger feels no more entities at once.
const MOST_NEAR: usize = 128;

/// Why an entity of the scene is refused.
fn refused(spec: &SceneEntity, source: ParameterError) -> RigError {
    let (file, what) = (spec.file.to_path_buf(), format!("entity {}", spec.name));
    RigError::Refused { file, line: Some(spec.line), what, source }
}

/// Whether contacts turn it: it has a radius, a pad, or something tied to it.
fn has_torque(finger: &SceneFinger) -> bool {
    finger.radius_m > 0.0 || finger.soft.is_some() || finger.attach.is_some()
}

/// Reads the hand file as the driver will, so that its mistakes are told here, by this process.
fn check_hand(path: &Path, named_by: &str, scene: &Scene) -> Result<HandFile, RigError> {
    let unreadable = |source| RigError::Unreadable { file: path.into(), named_by: named_by.into(), source };
    if !path.metadata().map_err(unreadable)?.is_file() {
        return Err(RigError::NotAFile { file: path.into(), named_by: named_by.into() });
    }
    let text = std::fs::read_to_string(path).map_err(unreadable)?;
    let fingers: Vec<&str> = scene.fingers.iter().map(|finger| finger.name.as_str()).collect();
    let script = HandScript::parse(&text, path, &fingers)?;
    let path = std::path::absolute(path).map_err(unreadable)?;
    let bounds = (0..fingers.len()).map(|finger| script.bounds(finger)).collect();
    Ok(HandFile { path, duration_s: script.duration_s(), bounds })
}
