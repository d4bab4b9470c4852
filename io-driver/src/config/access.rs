//! `[access]`: which groups may look, command and administer.

use rt_core::privileges::{UserError, group_id};
use serde::Deserialize;
use shm_abi::rights::Rights;

/// Which groups, by name or number, have which rights; see [`shm_abi::rights`].
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AccessConfig {
    /// To look, and to stop the motors; `None`: whoever can connect.
    pub look: Option<String>,
    /// To command, to zero and to leave a fault; `None`: whoever may look.
    pub command: Option<String>,
    /// To end the driver, others' leases and others' emergency stops; `None`: only root and the driver's own user.
    pub administer: Option<String>,
}

impl AccessConfig {
    /// The groups as this machine knows them. To be called as the user that the driver runs as.
    ///
    /// # Errors
    /// If there is no such group.
    pub fn resolve(&self) -> Result<Rights, UserError> {
        let id = |group: &Option<String>| group.as_deref().map(group_id).transpose();
        let (look, command, administer) = (id(&self.look)?, id(&self.command)?, id(&self.administer)?);
        Ok(Rights { look, command, administer, ..Rights::open() })
    }

    /// Each key with its group, where there is one.
    pub(super) fn groups(&self) -> impl Iterator<Item = (&'static str, &str)> {
        let keys = [("look", &self.look), ("command", &self.command), ("administer", &self.administer)];
        keys.into_iter().filter_map(|(key, group)| Some((key, group.as_deref()?)))
    }
}
