//! Templates: an object that entities are made from, as the thesis tells the two apart (Melder 7.2.1).
//!
//! ```toml
//! [[template]]
//! name = "cup"
//! shape = { kind = "mesh", file = "cup.obj" }
//! mass_kg = 0.3
//!
//! [[entity]]
//! template = "cup"                       # all its keys but the name
//! shape = { scale = 1.2 }                # of tables only what differs
//! friction = { model = "coulomb", mu = 0.3 }   # a table that says what it is stands for itself
//! ```
//! A template may build on another. It need not have a shape: it is then a material of one's own.

use std::collections::BTreeMap;

use crate::error::SceneError;
use crate::names::Names;
use crate::problems::Problems;
use crate::reader::Table;
use rt_core::likeness::nearest;
use rt_core::plain_text::{self, quoted};

/// How many templates may build on each other.
pub const MAX_TEMPLATE_DEPTH: usize = 8;

/// All templates of a scene, by name.
#[derive(Debug, Default)]
pub(crate) struct Templates<'d> {
    by_name: BTreeMap<String, Table<'d>>,
    /// How many entities each is used by, one of a grid counted as one.
    uses: BTreeMap<String, usize>,
}

/// What a scene has of a template.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SceneTemplate {
    /// Unique among the templates.
    pub name: String,
    /// How many entities are made from it, those of templates that build on it included.
    pub entities: usize,
}

impl<'d> Templates<'d> {
    /// Takes the templates of a file.
    pub(crate) fn add(&mut self, table: Table<'d>, names: &mut Names<'d>, problems: &mut Problems) {
        let named = names.claim_written(&table, "a name, by which entities call it");
        if let Some(name) = problems.keep(named) {
            self.uses.insert(name.clone(), 0);
            self.by_name.insert(name, table);
        }
    }

    /// All of them.
    pub(crate) fn tables(&self) -> impl Iterator<Item = &Table<'d>> {
        self.by_name.values()
    }

    /// A table laid over the template that it names, if it names one.
    pub(crate) fn complete(&self, table: Table<'d>) -> Result<Table<'d>, SceneError> {
        self.laid(table, MAX_TEMPLATE_DEPTH)
    }

    fn laid(&self, table: Table<'d>, depth_left: usize) -> Result<Table<'d>, SceneError> {
        let Some(value) = table.own("template") else { return Ok(table) };
        let name = value.text("the name of a [[template]]")?;
        let Some(template) = self.by_name.get(name) else {
            let names = || self.by_name.keys().map(String::as_str);
            let meant = nearest(name, names())
                .map_or_else(String::new, |meant| format!(" (did you mean `{meant}`?)"));
            let found = format!("{}, which no [[template]] is called{meant}", quoted(name));
            return Err(SceneError::NoSuchName { at: value.at(), found, allowed: listed(names()) });
        };
        if depth_left == 0 {
            return Err(SceneError::TemplatesTooDeep { at: value.at(), limit: MAX_TEMPLATE_DEPTH });
        }
        Ok(table.over(self.laid(template.clone(), depth_left - 1)?))
    }

    /// Takes note of an entity, or of so many, made from a table.
    pub(crate) fn used(&mut self, table: &Table<'_>, times: usize) {
        let mut next = table.own("template").and_then(|value| value.text("").ok());
        for _ in 0..MAX_TEMPLATE_DEPTH {
            let Some(name) = next else { return };
            if let Some(uses) = self.uses.get_mut(name) {
                *uses += times;
            }
            next = self.by_name.get(name).and_then(|table| table.own("template")?.text("").ok());
        }
    }

    /// What the scene keeps of them.
    pub(crate) fn told(self) -> Vec<SceneTemplate> {
        self.uses.into_iter().map(|(name, entities)| SceneTemplate { name, entities }).collect()
    }
}

/// Some of the names that there are.
pub(crate) fn listed<'n>(names: impl Iterator<Item = &'n str>) -> String {
    let names = plain_text::listed(names);
    if names.is_empty() { "none, since there is none".into() } else { names }
}
