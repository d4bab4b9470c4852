//! A spherical finger's place for one entity, whatever that is made of.

use crate::csg::BallOnCsg;
use crate::mesh::BallOnMesh;
use crate::rolling::Share;

/// State of one spherical finger towards one entity; at most one of them is in contact.
#[derive(Debug, Clone, Default)]
pub(crate) struct Balls {
    pub(crate) on_mesh: BallOnMesh,
    pub(crate) on_csg: BallOnCsg,
}

impl Balls {
    pub(crate) fn is_touching(&self) -> bool {
        self.on_mesh.is_touching() || self.on_csg.is_touching()
    }

    /// The features that it presses on, in this tick.
    pub(crate) fn shares(&self) -> impl Iterator<Item = Share> {
        self.on_mesh.shares().chain(self.on_csg.shares())
    }
}
