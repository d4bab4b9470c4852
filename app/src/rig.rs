//! From files and arguments to everything a run needs: whatever can be wrong with the input is found here,
//! before anything is started.

use crate::fast_step::{DeviceFinger, FastStep};
use crate::mount::Mount;
use crate::recording::Names;
use haptics::{Entity, Finger, Friction, ParameterError, Plane, Shape, Sphere};
use io_driver::config::{
    Backend, DeviceConfig, DriverConfig, ProcessConfig, RealTime, ReplyConfig, ReplyMode, SafetyConfig,
};
use io_driver::sim::script::{HandError, HandScript};
use shm_abi::segment::ClockMode;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;
use world::{FrictionSpec, Layout, Scene, SceneEntity, SceneError, ShapeSpec};

/// What is wrong with the input.
#[derive(Debug, Error)]
pub enum RigError {
    /// The scene or the layout.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The hand file.
    #[error(transparent)]
    Hand(#[from] HandError),
    /// The hand file cannot be read.
    #[error(
        "cannot read the hand file {file}, named by {named_by}: {source}; name a CSV file that can be read"
    )]
    Unreadable {
        /// Which.
        file: PathBuf,
        /// Who asks for it.
        named_by: String,
        /// What the system said.
        source: io::Error,
    },
    /// The hand file is a pipe, a directory or a device.
    #[error(
        "the hand file {file}, named by {named_by}, is not a regular file; \
         allowed: a file, since every device reads it from its beginning"
    )]
    NotAFile {
        /// Which.
        file: PathBuf,
        /// Who asks for it.
        named_by: String,
    },
    /// The scene holds something that rendering refuses.
    #[error("{file}: {what}: {source}")]
    Refused {
        /// The scene's file.
        file: PathBuf,
        /// The entity or finger.
        what: String,
        /// Why.
        source: ParameterError,
    },
    /// Something of the grammar that this version has not got.
    #[error("{file}: {what} is not available in this version")]
    NotAvailable {
        /// The scene's file.
        file: PathBuf,
        /// What.
        what: String,
    },
}

/// What a run needs, checked.
#[derive(Debug, Clone)]
pub struct Rig {
    /// The scene's file, for messages.
    pub scene_file: PathBuf,
    /// The scene.
    pub scene: Scene,
    /// Where the devices stand.
    pub layout: Layout,
    /// The hand file, and how long it lasts.
    pub hand: Option<HandFile>,
    /// Length of a tick (ns).
    pub period_ns: u64,
}

/// A checked hand file.
#[derive(Debug, Clone)]
pub struct HandFile {
    /// Where it lies; absolute, since the driver reads it too.
    pub path: PathBuf,
    /// Its duration (s).
    pub duration_s: f64,
}

impl Rig {
    /// Checks scene, layout and hand together.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn new(
        scene_file: &Path,
        scene: Scene,
        layout: Layout,
        hand: Option<&Path>,
        period_ns: u64,
    ) -> Result<Self, RigError> {
        let named = match (hand, &scene.hand) {
            (Some(path), _) => Some((path, "--hand".to_owned())),
            (None, Some(path)) => Some((path.as_path(), scene_file.display().to_string())),
            (None, None) => None,
        };
        let hand = named.map(|(path, named_by)| check_hand(path, &named_by, &scene)).transpose()?;
        let rig = Self { scene_file: scene_file.into(), scene, layout, hand, period_ns };
        rig.fast_step()?;
        Ok(rig)
    }

    /// The rendering of this scene.
    ///
    /// # Errors
    /// If the scene holds something that rendering refuses.
    pub fn fast_step(&self) -> Result<FastStep, RigError> {
        let entities: Vec<Entity> =
            self.scene.entities.iter().map(|entity| self.entity(entity)).collect::<Result<_, _>>()?;
        let fingers = self.scene.fingers.iter().map(|finger| {
            let made = Finger::new(finger.radius_m, entities.len())
                .map_err(|source| self.refused(format!("finger {}", finger.name), source))?;
            let mount = Mount::placed(&self.layout.placement(finger.device));
            Ok(DeviceFinger { finger: made, device: finger.device, mount })
        });
        let fingers: Vec<DeviceFinger> = fingers.collect::<Result<_, RigError>>()?;
        Ok(FastStep::new(fingers, entities, self.period_ns))
    }

    /// What the recording's columns are called.
    pub fn names(&self) -> Names {
        Names {
            fingers: self.scene.fingers.iter().map(|finger| finger.name.clone()).collect(),
            entities: self.scene.entities.iter().map(|entity| entity.name.clone()).collect(),
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

    /// A driver whose ideal devices are the scripted hand's fingers.
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
            devices: (0..self.device_count()).map(|index| self.ideal_device(index)).collect(),
        }
    }

    fn ideal_device(&self, index: usize) -> DeviceConfig {
        let finger = self.scene.fingers.iter().find(|finger| finger.device == index);
        let hand =
            finger.and_then(|finger| self.hand.as_ref().map(|hand| (hand.path.clone(), finger.name.clone())));
        DeviceConfig {
            // No finger can be called so: brackets are not allowed in a name.
            name: finger.map_or_else(|| format!("(unused {index})"), |finger| finger.name.clone()),
            backend: Backend::Ideal {
                hand,
                start_m: finger.map_or_else(nalgebra::Vector3::zeros, |finger| finger.start_m.coords),
                base_in_world: self.layout.pose(index),
            },
            peak_force_n: None,
            compensates_gravity: false,
        }
    }

    fn entity(&self, spec: &SceneEntity) -> Result<Entity, RigError> {
        let what = || format!("entity {}", spec.name);
        let refused = |source| self.refused(what(), source);
        let shape: Shape = match spec.shape {
            ShapeSpec::Plane { normal, offset_m } => {
                Plane::new(normal.into_inner(), offset_m).map_err(refused)?.into()
            }
            ShapeSpec::Sphere { radius_m } => Sphere::new(radius_m).map_err(refused)?.into(),
            ref other => return Err(self.not_available(format!("{}: shape {other:?}", what()))),
        };
        let friction = match spec.friction {
            FrictionSpec::None => Friction::None,
            FrictionSpec::Coulomb { mu } => Friction::Coulomb { mu },
            FrictionSpec::Stiction { mu_s, mu_d } => Friction::Stiction { mu_s, mu_d },
            FrictionSpec::Viscous { mu_v_s_per_m } => Friction::Viscous { mu_v_s_per_m },
            FrictionSpec::CoulombViscous { mu, mu_v_s_per_m } => {
                Friction::CoulombViscous { mu, mu_v_s_per_m }
            }
            ref other => return Err(self.not_available(format!("{}: friction {other:?}", what()))),
        };
        Entity::new(shape, spec.pose, spec.stiffness_n_per_m)
            .and_then(|entity| entity.with_damping(spec.damping_n_s_per_m))
            .and_then(|entity| entity.with_friction(friction))
            .map_err(refused)
    }

    fn refused(&self, what: String, source: ParameterError) -> RigError {
        RigError::Refused { file: self.scene_file.clone(), what, source }
    }

    fn not_available(&self, what: String) -> RigError {
        RigError::NotAvailable { file: self.scene_file.clone(), what }
    }
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
    Ok(HandFile { path, duration_s: script.duration_s() })
}
