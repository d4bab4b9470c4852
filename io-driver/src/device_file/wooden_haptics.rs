//! The table `[linkage]` of an arm of the WoodenHaptics family.

use serde::Deserialize;
use toml::Spanned;

use super::arm::{FROM_FOLDED, JointTable, LENGTH, LinkageTable, POSITION, joint_limits};
use crate::kinematics::{JointConvention, Kinematics, WoodenHaptics};
use crate::toml_report::{SpannedList, TomlReport, TomlText};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Linkage {
    body_lengths_m: SpannedList,
    origin_m: SpannedList,
    cable_reduction: SpannedList,
    home_joint_angles_rad: SpannedList,
    joint_limits_rad: Spanned<Vec<SpannedList>>,
    elbow_limits_rad: SpannedList,
}

impl LinkageTable for Linkage {
    const KIND: &'static str = "wooden-haptics";
    const CONVENTION: JointConvention = WoodenHaptics::CONVENTION;

    fn joints(&self) -> JointTable<'_> {
        JointTable {
            cable_reduction: &self.cable_reduction,
            home_joint_angles_rad: &self.home_joint_angles_rad,
            joint_limits_rad: &self.joint_limits_rad,
            elbow_limits_rad: &self.elbow_limits_rad,
        }
    }

    fn mechanism(&self, toml: &TomlText<'_>) -> Result<(Kinematics, [f64; 2]), TomlReport> {
        let limits = joint_limits(toml, &self.joints(), 1.0, FROM_FOLDED)?;
        let lengths = toml.numbers(&self.body_lengths_m, LENGTH)?;
        let arm = WoodenHaptics::new(lengths, toml.numbers(&self.origin_m, POSITION)?, limits);
        Ok((Kinematics::WoodenHaptics(arm), arm.link_lengths_m()))
    }
}
