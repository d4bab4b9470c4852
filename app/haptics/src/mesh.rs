//! Triangle meshes for the Friction Cone Algorithm: faces that know their neighbours.
//!
//! Problem: a god-object walks from face to face, a thousand times a second, on meshes of a million triangles; no
//! step of it may depend on how large the mesh is (Melder ch. 4.2.3).
//!
//! Model: a Face Directed Connection Graph. A [`Face`] record of one cache line holds its plane, its three
//! vertices and a [`Link`] across each of its edges; faces and vertices are stored in spatial order, whatever the
//! order of the input was.
//!
//! Frames and signs: object frame B; vertices run counter-clockwise seen from outside, normals leave the material.

mod bvh;
mod face;
mod soup;

pub use bvh::{Bvh, Hit, Nearest, Triangles};
pub use face::{Face, Link};
pub use soup::TriangleSoup;
