//! Contact of fingers with surfaces by the Friction Cone Algorithm, as a pure library.
//!
//! Problem: every tick a device reports where each finger is (its HIP, the haptic interaction
//! point); the force the user must feel has to come back within microseconds, with friction that
//! neither drifts nor chatters.
//!
//! Model: while the HIP is inside an object, a god-object stays on the object's surface. It rests
//! while it lies inside the friction circle, where the friction cone at the HIP meets the surface,
//! and is drawn to the circle's rim when it does not. The spring between the two is the force
//! (N. Melder, *Multi-Finger Manipulation Physics for Haptic Rendering*, ch. 4.1-4.2.1 and 7.5.3;
//! cited as `melder#4.6`). Where a printed equation is wrong, its item says `corrected` and how.
//!
//! Layers, each usable alone:
//! - [`FrictionLaw`] / [`Friction`]: does it hold, and if not, how far does it slide;
//! - [`Surface`] / [`Plane`], [`Sphere`], [`Shape`]: where is the surface;
//! - [`FrictionCone`]: one god-object on any surface under any law;
//! - [`Finger`]: all contacts of one finger with all entities, in the world frame.
//!
//! Frames and signs: W world, B body; a suffix names the frame (`hip_B`), a pose `X_WB` maps B to
//! W. SI units, `f64`, y up. Normals leave the material. A force always says on whom it acts.
//!
//! Invariants: a step never allocates, panics, reads a clock or loops without a constant bound; it
//! returns finite values for every input; contacts never pull.
//!
//! Cost: one tick of one finger is linear in the number of entities; a contact takes one round
//! while it sticks, two on a plane and a handful on a curved surface while it slides.
#![forbid(unsafe_code)]
#![deny(missing_docs)]
// Names carry their frame (`hip_B`, `X_WB`), which is worth more here than the case lint.
#![allow(non_snake_case)]

mod algorithm;
mod balls;
mod capsule;
mod chart;
mod classic_god_object;
mod cone;
mod constraints;
mod contact;
mod contact_stiffness;
mod convex;
mod csg;
mod cuboid;
mod cylinder;
mod door;
mod effects;
mod ellipsoid;
mod entity;
mod error;
mod face_materials;
mod finger;
mod frame;
mod friction;
mod friction_cone;
mod friction_law;
mod frustum;
mod grip;
mod height_map;
mod hip;
mod material;
pub mod mesh;
pub mod nurbs;
mod onset;
pub mod passivity;
mod plane;
mod quartic;
mod rolling;
mod scaled;
mod shading;
mod shape;
mod shared;
mod slide;
mod slots;
mod sphere;
mod surface;
mod tangent_view;
mod tessellated;
mod torus;
mod touch_points;
mod vector_field;

pub use algorithm::{Algorithm, CONTACT_WORDS, ContactAlgorithm, ContactMemory, Touch, TouchInput};
pub use capsule::Capsule;
pub use chart::{Chart, Coordinate, POLE_SHARE};
pub use classic_god_object::ClassicGodObject;
pub use cone::Cone;
pub use contact::{Contact, RAMP_IN_S};
pub use csg::{Csg, CsgError, CsgOp, CsgPart, CsgTree, Facets, MAX_DEPTH, MAX_LEAVES, PartShape};
pub use cuboid::Cuboid;
pub use cylinder::Cylinder;
pub use door::{Crossing, Door, FADE_S, Passage, SLAB_M, WORLD};
pub use effects::{
    Effects, Field, FieldKind, FingerEffects, Gains, Guide, HYSTERESIS_M, Limits, MAX_PATH_POINTS,
    MOST_FORCE_N, Magnetism, Moment, Reaction, Region, Track, Vibration,
};
pub use ellipsoid::{Ellipsoid, LARGEST_RATIO};
pub use entity::{Entity, Felt};
pub use error::ParameterError;
pub use face_materials::{FaceMaterial, FaceMaterials, FeltMaterial};
pub use finger::{ContactState, Finger, FingerOutput};
pub use friction::{
    Bristles, Dahl, FixedCone, Friction, FrictionCurve, HaywardArmstrong, Karnopp, LuGre, MAX_BRISTLES,
    MAX_CURVE_POINTS, OwnLaw, RESTICK_MARGIN, ResetIntegrator, Stribeck,
};
pub use friction_cone::{ConeForce, ConeInput, FrictionCone};
pub use friction_law::{FrictionLaw, FrictionMemory, FrictionQuery, FrictionState, MEMORY_WORDS};
pub use height_map::{
    Border, HeightForm, HeightGrid, HeightMap, HeightMapError, HeightSurvey, MAX_GRID_SIDE, PictureScale,
};
pub use hip::Hip;
pub use material::Material;
pub use nurbs::{Nurbs, NurbsError, NurbsPatch, NurbsReport};
pub use plane::Plane;
pub use scaled::Scaled;
pub use shading::{BoxRegions, Regions, Shading, ShadingForm};
pub use shape::{Form, OwnSurface, Shape};
pub use shared::Shared;
pub use slide::MAX_SLIDE_ROUNDS;
pub use sphere::Sphere;
pub use surface::{Feature, Surface, SurfacePoint};
pub use torus::Torus;
pub use touch_points::{MAX_TOUCH_POINTS, TouchPoint, TouchPoints};
pub use vector_field::VectorField;
