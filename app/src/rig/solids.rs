//! Solids joined of others: each is built once for all entities that are alike, as a shelf's are.

use super::material::Unfit;
use haptics::Csg;
use std::collections::BTreeMap;
use std::sync::Arc;
use world::ShapeSpec;

/// Those that were built so far.
#[derive(Debug, Default)]
pub(super) struct Solids {
    /// By what the scene says of them, which is printed to the bit.
    built: BTreeMap<String, Arc<Csg>>,
}

impl Solids {
    /// The solid of a shape that is joined of others.
    pub(super) fn solid(&mut self, spec: &ShapeSpec) -> Result<Arc<Csg>, Unfit> {
        let said = format!("{spec:?}");
        if let Some(built) = self.built.get(&said) {
            return Ok(Arc::clone(built));
        }
        let built = Arc::new(spec.csg()?);
        self.built.insert(said, Arc::clone(&built));
        Ok(built)
    }
}
