//! Refuses bodies that cannot exist.

use haptics::ParameterError;
use thiserror::Error;

/// Why an entity cannot be a body.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum BodyError {
    /// A single value outside its range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// No mass distribution has such moments.
    #[error(
        "inertia_kg_m2 is [{}, {}, {}]; allowed are three finite numbers > 0 of which none is more than the sum of the \
         other two",
        .moments[0], .moments[1], .moments[2]
    )]
    Inertia {
        /// Principal moments found (kg m^2).
        moments: [f64; 3],
    },
    /// Nearly all of the mass is in the middle.
    #[error(
        "inertia_kg_m2 is {moment_kg_m2} about {axis}; allowed is at least {least_kg_m2}, a thousandth of what a full box of \
         this size and mass has: kilogrammes times square metres"
    )]
    Concentrated {
        /// Own axis of the entity.
        axis: &'static str,
        /// Moment found (kg m^2).
        moment_kg_m2: f64,
        /// Least one allowed (kg m^2).
        least_kg_m2: f64,
    },
    /// Infinite, or without a volume.
    #[error(
        "a {shape} has no inertia of its own; give `inertia_kg_m2`, or leave out `mass_kg` and it is fixed"
    )]
    NoInertia {
        /// What it is.
        shape: &'static str,
    },
    /// It has no inside.
    #[error(
        "a mesh of {faces} faces that is open or cannot be oriented encloses no volume and has no inertia of its own; \
         close it, or give `inertia_kg_m2` and `centre_of_mass_m`, or leave out `mass_kg` and it is fixed"
    )]
    OpenMesh {
        /// How many triangles.
        faces: usize,
    },
    /// Its inside is nothing.
    #[error(
        "a closed mesh encloses a volume of {volume_m3} m^3; allowed is more than a rounding of its size to the third; \
         thicken it, or give `inertia_kg_m2` and `centre_of_mass_m`, or leave out `mass_kg` and it is fixed"
    )]
    NoVolume {
        /// Volume found (m^3).
        volume_m3: f64,
    },
    /// It could not be told where it touches.
    #[error("a {shape} cannot move: nobody finds its contact points; leave out `mass_kg` and it is fixed")]
    NoContactPoints {
        /// What it is.
        shape: &'static str,
    },
}
