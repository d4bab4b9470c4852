//! Which events somebody wants.

use super::{Class, Event};

/// Lets events through: those of all kinds, fingers and entities, but for what it is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Filter {
    /// Bit `c`: events of class `c`; `None`: of all.
    classes: Option<u32>,
    finger: Option<u32>,
    entity: Option<u32>,
}

impl Filter {
    /// All events.
    pub const ALL: Self = Self { classes: None, finger: None, entity: None };

    /// Those of these classes. That events are missing is told as well.
    pub fn of(classes: &[Class]) -> Self {
        let bits = classes.iter().fold(1 << Class::Lost as u32, |bits, class| bits | 1 << *class as u32);
        Self { classes: Some(bits), ..Self::ALL }
    }

    /// Of these those of one finger: its contacts, ties and buttons, and the grasps that it takes part in.
    #[must_use]
    pub fn finger(self, finger: u32) -> Self {
        Self { finger: Some(finger), ..self }
    }

    /// Of these those of one entity, alone or as one of a pair.
    #[must_use]
    pub fn entity(self, entity: u32) -> Self {
        Self { entity: Some(entity), ..self }
    }

    /// Of these those of the entity of this name; `None` if there is none among these names.
    pub fn entity_named(self, name: &str, names: &[String]) -> Option<Self> {
        let entity = names.iter().position(|other| other == name)?;
        Some(self.entity(entity as u32))
    }

    /// Whether it lets an event through.
    pub fn lets(&self, event: &Event) -> bool {
        let class = event.kind.class();
        if class == Class::Lost {
            return true;
        }
        if *self == Self::ALL {
            return true;
        }
        let facts = event.kind.facts();
        let is_class = self.classes.is_none_or(|bits| bits >> class as u32 & 1 == 1);
        let is_finger = self.finger.is_none_or(|finger| {
            facts.finger == Some(finger) || facts.holders.checked_shr(finger).unwrap_or(0) & 1 == 1
        });
        let is_entity = self.entity.is_none_or(|entity| [facts.entity, facts.other].contains(&Some(entity)));
        is_class && is_finger && is_entity
    }
}
