//! How an entity moves: `mass_kg` or `density_kg_m3`, or `movable` by the density of its material, and what goes with them;
//! without any of these it is fixed.

use haptics::Material;
use nalgebra::Vector3;

use crate::error::SceneError;
use crate::reader::{Bound, Table};

/// What a scene says of an entity that moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionSpec {
    /// How heavy it is.
    pub mass: MassSpec,
    /// Principal moments about the centre of mass, along the axes of the entity's frame (kg m^2); default those of a solid
    /// of its shape and one density.
    pub inertia_kg_m2: Option<[f64; 3]>,
    /// In the entity's frame (m); default that of a solid of its shape and one density.
    pub centre_of_mass_m: Option<[f64; 3]>,
    /// Of the entity's frame, at first (m/s); default at rest.
    pub velocity_m_s: Vector3<f64>,
    /// At first, in the world (rad/s); default none.
    pub angular_velocity_rad_s: Vector3<f64>,
    /// It keeps its orientation; default no.
    pub rotation_locked: bool,
}

/// How heavy an entity is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MassSpec {
    /// kg, > 0.
    Mass(f64),
    /// kg/m^3, > 0.
    Density(f64),
}

impl MotionSpec {
    /// Contact damping of an entity that moves and gives none (N s/m).
    pub const DEFAULT_DAMPING_N_S_PER_M: f64 = 1.0;

    /// Of an entity; `None`: it is fixed.
    pub(crate) fn read(entity: &Table<'_>, material: Option<&Material>) -> Result<Option<Self>, SceneError> {
        let number = |key: &str| entity.get(key).map(|value| value.number(Bound::Positive)).transpose();
        let movable = entity.get("movable").map(|value| value.truth()).transpose()?;
        let mass = match (number("mass_kg")?, number("density_kg_m3")?) {
            (None, None) if movable != Some(true) => return Self::fixed(entity),
            (None, None) => match material {
                Some(made_of) => MassSpec::Density(made_of.density_kg_m3),
                None => return Err(entity.missing("mass_kg", OF_MOVABLE)),
            },
            _ if movable == Some(false) => {
                let value = entity.require("movable", "true")?;
                return Err(value.out_of_range("true, or neither `mass_kg` nor `density_kg_m3`"));
            }
            (Some(mass), None) => MassSpec::Mass(mass),
            (None, Some(density)) => MassSpec::Density(density),
            (Some(_), Some(_)) => {
                let value = entity.require("density_kg_m3", Bound::Positive)?;
                return Err(value.out_of_range("either `mass_kg` or `density_kg_m3`, not both"));
            }
        };
        let numbers =
            |key: &str, bound| entity.get(key).map(|value| value.numbers_in::<3>(bound)).transpose();
        let inertia_kg_m2 = numbers("inertia_kg_m2", Bound::Positive)?;
        Ok(Some(Self {
            mass,
            inertia_kg_m2,
            centre_of_mass_m: numbers("centre_of_mass_m", Bound::Any)?,
            velocity_m_s: entity.numbers_or("velocity_m_s", [0.0; 3])?.into(),
            angular_velocity_rad_s: entity.numbers_or("angular_velocity_rad_s", [0.0; 3])?.into(),
            rotation_locked: entity.get("rotation_locked").map_or(Ok(false), |value| value.truth())?,
        }))
    }

    /// What only an entity that moves can have is refused for one that does not.
    fn fixed(entity: &Table<'_>) -> Result<Option<Self>, SceneError> {
        for key in OF_MOVING {
            if entity.get(key).is_some() {
                let allowed = format!("a number above 0: an entity with `{key}` moves; or leave out `{key}`");
                return Err(entity.missing("mass_kg", allowed));
            }
        }
        Ok(None)
    }
}

/// What makes a mass.
const OF_MOVABLE: &str = "a number above 0, or `density_kg_m3`, or a `material`, which has a density: an entity with \
                          `movable = true` has a mass";
/// Keys that need a mass.
const OF_MOVING: [&str; 5] =
    ["inertia_kg_m2", "centre_of_mass_m", "velocity_m_s", "angular_velocity_rad_s", "rotation_locked"];
