//! Materials of a mesh's faces, by the names that its file gives them.
//!
//! ```toml
//! [[entity.faces]]
//! of = "tyre"                       # a group, an object, a node or a material of the file; or ["tyre", "rim"]
//! material = "rubber"
//! [[entity.faces]]
//! of = "hub"
//! friction = { model = "coulomb", mu = 0.1 }
//! stiffness_n_per_m = 2000.0
//! colour = [0.2, 0.2, 0.2]
//! ```
//! A face that several of them name is of the first. What one does not say is as the entity says it.

use crate::colour::read_colour;
use crate::error::{Location, SceneError};
use crate::friction::FrictionSpec;
use crate::material::read_material;
use crate::reader::{Bound, Table};
use crate::shape::ShapeSpec;
use crate::vocabulary::Vocabulary;

/// One `[[entity.faces]]`.
#[derive(Debug, Clone, PartialEq)]
pub struct FacesSpec {
    /// Names in the model's file.
    pub of: Vec<String>,
    /// Of these faces.
    pub friction: FrictionSpec,
    /// Normal force per depth.
    pub stiffness_n_per_m: f64,
    /// Normal force per speed of approach.
    pub damping_n_s_per_m: f64,
    /// Red, green, blue and opacity, 0 to 1, where what is felt is seen; default the entity's.
    pub colour: Option<[f64; 4]>,
    /// Where `of` stands, for messages.
    pub at: Location,
}

/// Values of the entity for all of its faces.
pub(crate) struct Usual<'e> {
    pub(crate) friction: &'e FrictionSpec,
    pub(crate) stiffness_n_per_m: f64,
    pub(crate) damping_n_s_per_m: f64,
}

impl FacesSpec {
    /// Those of an entity, in the order of the file.
    pub(crate) fn read_all(
        entity: &Table<'_>,
        shape: &ShapeSpec,
        usual: &Usual<'_>,
    ) -> Result<Vec<Self>, SceneError> {
        let tables = entity.tables_up_to(MOST, "faces")?;
        match tables.first() {
            Some(_) if !matches!(shape, ShapeSpec::Mesh(_)) => Err(SceneError::WrongType {
                at: entity.at("faces"),
                found: format!("faces of a {}", shape.kind()),
                allowed: "faces of a mesh, whose file names them".into(),
            }),
            _ => tables.iter().map(|table| Self::read(table, usual)).collect(),
        }
    }

    fn read(table: &Table<'_>, usual: &Usual<'_>) -> Result<Self, SceneError> {
        table.check_keys(&KEYS)?;
        let of = table.require("of", NAMES)?;
        let names = if of.is_list() { of.items(NAMES)? } else { vec![of] };
        let of: Result<Vec<String>, _> =
            names.iter().map(|name| name.text(NAMES).map(str::to_owned)).collect();
        let made_of = read_material(table)?;
        let has_friction = table.get("friction").is_some() || made_of.is_some();
        let friction =
            if has_friction { FrictionSpec::read(table, made_of)? } else { usual.friction.clone() };
        let stiffness = made_of.map_or(usual.stiffness_n_per_m, |made_of| made_of.stiffness_n_per_m);
        let damping = made_of.map_or(usual.damping_n_s_per_m, |made_of| made_of.damping_n_s_per_m);
        Ok(Self {
            of: of?,
            friction,
            stiffness_n_per_m: table.number_or("stiffness_n_per_m", Bound::Positive, stiffness)?,
            damping_n_s_per_m: table.number_or("damping_n_s_per_m", Bound::NotNegative, damping)?,
            colour: table.get("colour").map(|value| read_colour(&value)).transpose()?,
            at: *table.at("of"),
        })
    }
}

/// More materials than any model has.
const MOST: usize = 1000;
const NAMES: &str =
    "the name of a group, an object or a material in the model's file, or a list of such names";
const KEYS: Vocabulary = Vocabulary {
    available: &["of", "material", "friction", "stiffness_n_per_m", "damping_n_s_per_m", "colour"],
    later: &[],
};
