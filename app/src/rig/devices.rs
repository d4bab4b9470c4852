//! Where the devices stand, and the driver that a scripted hand moves.

use super::{HandFile, HandMode, LONGEST_RUN_S, Rig, RigError};
use crate::mount::Mount;
use crate::simulated::{base_for_path, base_over_table};
use io_driver::config::{
    AccessConfig, Backend, DeviceConfig, DriverConfig, HandSource, ProcessConfig, RealTime, ReplyConfig,
    ReplyMode, SafetyConfig, Wish, Zeroing,
};
use io_driver::device_file::Workspace;
use io_driver::say::say;
use io_driver::sim::script::HandScript;
use io_driver::table::MAX_TABLE_BYTES;
use nalgebra::{Isometry3, Point3, Vector3};
use rt_core::input_file;
use shm_abi::segment::ClockMode;
use std::path::Path;
use std::sync::Arc;
use world::Scene;

/// Farther than that nothing is wanted (m).
const SLACKEST_M: f64 = 1.0;

impl Rig {
    /// Where a device stands, X_WD.
    pub fn base_in_world(&self, device: usize) -> Isometry3<f64> {
        self.bases.get(device).copied().unwrap_or_else(Isometry3::identity)
    }

    pub(super) fn mount(&self, device: usize) -> Mount {
        match &self.layout {
            Some(layout) => Mount::placed(&layout.placement(device)),
            None => Mount::new(self.base_in_world(device)),
        }
    }

    pub(super) fn place_bases(&self) -> Result<Vec<Isometry3<f64>>, RigError> {
        let devices = 0..self.device_count();
        match (&self.layout, &self.hand_mode) {
            (Some(layout), _) => Ok(devices.map(|device| layout.pose(device)).collect()),
            (None, HandMode::Kinematic) => Ok(Vec::new()),
            (None, HandMode::Impedance(simulated)) => {
                let workspace = simulated.arm()?.workspace;
                if simulated.is_live {
                    return Ok(devices.map(|_| self.base_over_table(&workspace)).collect());
                }
                Ok(devices.map(|device| self.base_near_path(device, &workspace)).collect())
            }
        }
    }

    /// The same with fingers that begin there (m), and devices where these reach that.
    ///
    /// # Errors
    /// If it is not known what the devices are.
    pub fn starting_at(mut self, starts: &[Vector3<f64>]) -> Result<Self, RigError> {
        for (finger, start) in self.scene.fingers.iter_mut().zip(starts) {
            finger.start_m = (*start).into();
        }
        self.bases = self.place_bases()?;
        Ok(self)
    }

    /// Whether devices go where the camera goes.
    pub fn goes_with_the_camera(&self) -> bool {
        self.layout.as_ref().is_some_and(|layout| layout.camera().is_some())
    }

    /// The same with the camera there, and all devices that go with it.
    ///
    /// # Errors
    /// If it is not known what the devices are.
    pub fn seen_from(mut self, camera: Isometry3<f64>) -> Result<Self, RigError> {
        self.layout = self.layout.map(|layout| layout.with_camera(camera));
        self.bases = self.place_bases()?;
        Ok(self)
    }

    /// What the devices of fingers all reach: corners of a box in W (m).
    ///
    /// # Errors
    /// If it is not known what the devices are.
    pub fn reach(&self) -> Result<[Vector3<f64>; 2], RigError> {
        let everywhere = [Vector3::repeat(-SLACKEST_M), Vector3::repeat(SLACKEST_M)];
        let HandMode::Impedance(simulated) = &self.hand_mode else { return Ok(everywhere) };
        let workspace = simulated.arm()?.workspace;
        let (centre, half) = (Vector3::from(workspace.centre_m), 0.5 * Vector3::from(workspace.size_m));
        let reaches = self.scene.fingers.iter().map(|finger| {
            let base = self.base_in_world(finger.device);
            let middle = (base * Point3::from(centre)).coords;
            // Of a box that stands askew, the box around it.
            let half = base.rotation.to_rotation_matrix().matrix().abs() * half;
            [middle - half, middle + half]
        });
        let common = reaches.reduce(|[least, most], [other_least, other_most]| {
            [least.sup(&other_least), most.inf(&other_most)]
        });
        Ok(common.filter(|[least, most]| least <= most).unwrap_or(everywhere))
    }

    /// Over every finger, and what can be moved and is not out of their reach.
    fn base_over_table(&self, workspace: &Workspace) -> Isometry3<f64> {
        let starts = self.scene.fingers.iter().map(|finger| finger.start_m.coords);
        let [least, most] = around(starts.clone());
        let (middle, half) = (0.5 * (least + most), 0.5 * Vector3::from(workspace.size_m));
        let things = self.moving().map(|(_, entity, _)| entity.pose.translation.vector);
        let near = things.filter(|place| (place - middle).abs() <= half);
        let [lowest, highest] = around(starts.chain(near));
        base_over_table(lowest, highest, workspace)
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

    /// How many devices the fingers need.
    pub fn device_count(&self) -> usize {
        self.scene.fingers.iter().map(|finger| finger.device + 1).max().unwrap_or(0)
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
            access: AccessConfig::default(),
            devices: (0..self.device_count()).map(|index| self.device(index)).collect(),
        }
    }

    fn device(&self, index: usize) -> DeviceConfig {
        let finger = self.scene.fingers.iter().find(|finger| finger.device == index);
        let hand = match (finger, &self.hand) {
            (Some(finger), Some(hand)) => {
                HandSource::Script { file: hand.path.clone(), finger: finger.name.clone() }
            }
            _ => HandSource::Nobody,
        };
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
        // A kinematic run renders what was computed, whatever it is.
        let slew_n_per_s = matches!(backend, Backend::Ideal(_)).then_some(f64::INFINITY);
        DeviceConfig {
            // No finger can be called so: brackets are not allowed in a name.
            name: finger.map_or_else(|| format!("(unused {index})"), |finger| finger.name.clone()),
            backend,
            peak_force_n: None,
            slew_n_per_s,
            compensates_gravity,
            zeroing: Zeroing::Known,
        }
    }
}

/// Corners of a box.
fn around(places: impl Iterator<Item = Vector3<f64>>) -> [Vector3<f64>; 2] {
    let corners = places.map(|place| [place; 2]);
    let joined = |[least, most]: [Vector3<f64>; 2], [place, _]: [Vector3<f64>; 2]| {
        [least.inf(&place), most.sup(&place)]
    };
    corners.reduce(joined).unwrap_or_default()
}

/// Reads the hand file as the driver will, so that its mistakes are told here, by this process.
pub(super) fn check_hand(path: &Path, named_by: &str, scene: &Scene) -> Result<HandFile, RigError> {
    let unreadable = |source| RigError::Unreadable { file: path.into(), named_by: named_by.into(), source };
    if !path.metadata().map_err(unreadable)?.is_file() {
        return Err(RigError::NotAFile { file: path.into(), named_by: named_by.into() });
    }
    let bytes: Arc<[u8]> = input_file::read(path, MAX_TABLE_BYTES).map_err(unreadable)?.into();
    let text: Arc<str> = input_file::text(bytes.to_vec()).map_err(unreadable)?.into();
    let fingers: Vec<&str> = scene.fingers.iter().map(|finger| finger.name.as_str()).collect();
    let script = HandScript::parse(&text, path, &fingers)?;
    if script.duration_s() > LONGEST_RUN_S {
        return Err(RigError::HandTooLong { file: path.into(), last_s: script.duration_s() });
    }
    let path = std::path::absolute(path).map_err(unreadable)?;
    let bounds = (0..fingers.len()).map(|finger| script.bounds(finger)).collect();
    Ok(HandFile { path, bytes, text, duration_s: script.duration_s(), rows: script.rows(), bounds })
}
