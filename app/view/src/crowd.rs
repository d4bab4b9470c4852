//! Things in the graphics memory: those that look alike are drawn together.
//!
//! Model: a call to the graphics takes as long as some thousand triangles. Opaque things of the same triangles are drawn by one
//! call, however many they are; what light goes through is drawn one by one, since it is sorted by how far away it is.

use crate::painter::{bytes, mask, material, mesh_of};
use crate::stage::Thing;
use crate::triangles::Triangles;
use std::sync::Arc;
use three_d::{Context, Geometry, Gm, InstancedMesh, Instances, Mat4, Mesh, Object, PhysicalMaterial};

/// All things of a stage.
pub(crate) struct Crowd {
    alike: Vec<Alike>,
    clear: Vec<Clear>,
}

/// Opaque things of the same triangles.
struct Alike {
    triangles: Arc<Triangles>,
    casts_shadow: bool,
    things: Vec<Thing>,
    shown: Instances,
    model: Gm<InstancedMesh, PhysicalMaterial>,
}

/// A thing that light goes through.
struct Clear {
    thing: Thing,
    is_seen: bool,
    at: Mat4,
    model: Gm<Mesh, PhysicalMaterial>,
}

impl Crowd {
    pub(crate) fn new(context: &Context, things: &[Thing]) -> Self {
        let (mut alike, mut clear) = (Vec::<Alike>::new(), Vec::new());
        for thing in things {
            if thing.colour[3] < 1.0 {
                clear.push(Clear::new(context, thing));
                continue;
            }
            let is_like = |known: &&mut Alike| {
                Arc::ptr_eq(&known.triangles, &thing.triangles) && known.casts_shadow == thing.casts_shadow
            };
            match alike.iter_mut().find(is_like) {
                Some(known) => known.things.push(thing.clone()),
                None => alike.push(Alike::new(context, thing)),
            }
        }
        Self { alike, clear }
    }

    /// Puts each thing of which `look` tells where it is and which colour it has there, and hides the others; says whether
    /// anything stands elsewhere than before.
    pub(crate) fn place(&mut self, look: impl Fn(&Thing) -> Option<(Mat4, [f64; 4])>) -> bool {
        let mut is_moved = false;
        for alike in &mut self.alike {
            is_moved |= alike.place(&look);
        }
        for clear in &mut self.clear {
            is_moved |= clear.place(look(&clear.thing));
        }
        is_moved
    }

    /// Lets only these of red, green and blue be drawn.
    pub(crate) fn mask(&mut self, channels: [bool; 3]) {
        self.alike.iter_mut().for_each(|alike| mask(&mut alike.model.material, channels));
        self.clear.iter_mut().for_each(|clear| mask(&mut clear.model.material, channels));
    }

    pub(crate) fn objects(&self) -> impl Iterator<Item = &dyn Object> {
        let alike =
            self.alike.iter().filter(|alike| alike.is_seen()).map(|alike| &alike.model as &dyn Object);
        let clear = self.clear.iter().filter(|clear| clear.is_seen);
        alike.chain(clear.map(|clear| &clear.model as &dyn Object))
    }

    /// Those that cast shadows.
    pub(crate) fn casting(&self) -> Vec<&dyn Geometry> {
        let alike = self.alike.iter().filter(|alike| alike.casts_shadow && alike.is_seen());
        let clear = self.clear.iter().filter(|clear| clear.thing.casts_shadow && clear.is_seen);
        let alike = alike.map(|alike| &alike.model.geometry as &dyn Geometry);
        alike.chain(clear.map(|clear| &clear.model.geometry as &dyn Geometry)).collect()
    }
}

impl Alike {
    fn new(context: &Context, first: &Thing) -> Self {
        let shown = Instances { colors: Some(Vec::new()), ..Instances::default() };
        let mesh = InstancedMesh::new(context, &shown, &mesh_of(&first.triangles));
        Self {
            triangles: Arc::clone(&first.triangles),
            casts_shadow: first.casts_shadow,
            things: vec![first.clone()],
            shown,
            model: Gm::new(mesh, material(context, [1.0; 4])),
        }
    }

    fn place(&mut self, look: impl Fn(&Thing) -> Option<(Mat4, [f64; 4])>) -> bool {
        let seen = self.things.iter().filter_map(look).map(|(at, colour)| (at, bytes(colour)));
        let (transformations, colours): (Vec<_>, Vec<_>) = seen.unzip();
        let is_moved = transformations != self.shown.transformations;
        if is_moved || self.shown.colors.as_ref() != Some(&colours) {
            self.shown = Instances { transformations, colors: Some(colours), ..Instances::default() };
            self.model.set_instances(&self.shown);
        }
        is_moved
    }

    fn is_seen(&self) -> bool {
        !self.shown.transformations.is_empty()
    }
}

impl Clear {
    fn new(context: &Context, thing: &Thing) -> Self {
        let mesh = Mesh::new(context, &mesh_of(&thing.triangles));
        let model = Gm::new(mesh, material(context, thing.colour));
        Self { thing: thing.clone(), is_seen: false, at: Mat4::from_scale(0.0), model }
    }

    fn place(&mut self, look: Option<(Mat4, [f64; 4])>) -> bool {
        let was_seen = std::mem::replace(&mut self.is_seen, look.is_some());
        let Some((at, colour)) = look else { return was_seen };
        self.model.material.albedo = bytes(colour);
        self.model.set_transformation(at);
        !was_seen || std::mem::replace(&mut self.at, at) != at
    }
}
