//! The table `[linkage]` of a PHANToM Premium.

use serde::Deserialize;
use toml::Spanned;

use super::arm::{JointTable, LENGTH, LinkageTable, QUARTER_TURNS, joint_limits};
use crate::kinematics::{JointConvention, Kinematics, Premium};
use crate::toml_report::{SpannedList, TomlReport, TomlText};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Linkage {
    link_lengths_m: SpannedList,
    cable_reduction: SpannedList,
    home_joint_angles_rad: SpannedList,
    joint_limits_rad: Spanned<Vec<SpannedList>>,
    elbow_limits_rad: SpannedList,
}

impl LinkageTable for Linkage {
    const KIND: &'static str = "premium";
    const CONVENTION: JointConvention = Premium::CONVENTION;

    fn joints(&self) -> JointTable<'_> {
        JointTable {
            cable_reduction: &self.cable_reduction,
            home_joint_angles_rad: &self.home_joint_angles_rad,
            joint_limits_rad: &self.joint_limits_rad,
            elbow_limits_rad: &self.elbow_limits_rad,
        }
    }

    fn mechanism(&self, toml: &TomlText<'_>) -> Result<(Kinematics, [f64; 2]), TomlReport> {
        let limits = joint_limits(toml, &self.joints(), -1.0, QUARTER_TURNS)?;
        let premium = Premium::new(toml.numbers(&self.link_lengths_m, LENGTH)?, limits);
        Ok((Kinematics::Premium(premium), premium.link_lengths_m()))
    }
}
