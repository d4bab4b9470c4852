//! What can be seen of a scene: who looks like what, what shines, and who looks on.

use crate::rims;
use crate::shapes;
use crate::solids;
use crate::triangles::Triangles;
use crate::usual;
use haptics::mesh::TriangleSoup;
use haptics::{Entity, Shape};
use nalgebra::Isometry3;
use std::sync::Arc;
use world::model::Texture;
use world::seen::{SeenForm, SeenPart};
use world::{FrictionSpec, MassSpec, Scene, SceneCamera, SceneEntity, SceneLight, ShapeSpec};

/// What can be seen.
#[derive(Debug, Clone, Default)]
pub struct Stage {
    /// Things, each of an entity.
    pub things: Vec<Thing>,
    /// Rims of meshes that are felt, each of an entity.
    pub rims: Vec<Thing>,
    /// Lights; never none.
    pub lights: Vec<SceneLight>,
    /// Cameras; never none.
    pub cameras: Vec<SceneCamera>,
    /// Of each finger, its radius (m); 0 for a point.
    pub radii_m: Vec<f64>,
    /// Entities of which something cannot be drawn, and why.
    pub not_drawn: Vec<String>,
    /// Names of the fingers.
    pub fingers: Vec<String>,
    /// Of each entity, what the scene says of it.
    pub known: Vec<Known>,
}

/// What a scene says of an entity beside its looks.
#[derive(Debug, Clone, PartialEq)]
pub struct Known {
    /// Its name.
    pub name: String,
    /// Of its shape.
    pub kind: &'static str,
    /// How heavy it is; `None`: it does not move by itself.
    pub mass: Option<MassSpec>,
    /// N/m.
    pub stiffness_n_per_m: f64,
    /// N s/m.
    pub damping_n_s_per_m: f64,
    /// Of its surface.
    pub friction: FrictionSpec,
    /// Whether fingers feel it.
    pub is_felt: bool,
}

/// Something to be seen of an entity.
#[derive(Debug, Clone)]
pub struct Thing {
    /// Of which.
    pub entity: usize,
    /// In its own frame V; things that look alike share them.
    pub triangles: Arc<Triangles>,
    /// From V to the entity's frame.
    pub pose: Isometry3<f64>,
    /// Red, green, blue, opacity: 0 to 1.
    pub colour: [f64; 4],
    /// True where scene or file say the colour.
    pub is_coloured: bool,
    /// Texture on the triangles; its colours are multiplied with `colour`.
    pub texture: Option<Arc<Texture>>,
    /// Whether light does not go through.
    pub casts_shadow: bool,
    /// Which space it is in: 0 the world, otherwise behind a door.
    pub space: u32,
}

impl Thing {
    /// True if light goes through it, somewhere at least.
    pub(crate) fn is_clear(&self) -> bool {
        self.colour[3] < 1.0 || self.texture.as_ref().is_some_and(|texture| texture.is_clear)
    }
}

/// What is left of the opacity of walls behind a door, so that eyes outside see in.
const WALL_OPACITY: f64 = 0.25;

impl Stage {
    /// Of a scene whose entities, as they are felt, are these, in the same order.
    pub fn new(scene: &Scene, entities: &[Entity]) -> Self {
        let seen = scene.seen();
        let mut stage = Self {
            lights: seen.lights.to_vec(),
            cameras: seen.cameras.to_vec(),
            radii_m: scene.fingers.iter().map(|finger| finger.radius_m).collect(),
            fingers: scene.fingers.iter().map(|finger| finger.name.clone()).collect(),
            known: scene.entities.iter().map(Known::new).collect(),
            ..Self::default()
        };
        let told = seen.unreadable.iter().map(|(at, why)| format!("{at}: {why}"));
        stage.not_drawn.extend(told);
        stage.not_drawn.extend(seen.plain.iter().map(|(at, why)| format!("{at}: {why}")));
        let mut looks = Looks::default();
        for part in &seen.parts {
            let index = scene.entities.iter().position(|spec| std::ptr::eq(spec, part.entity)).unwrap_or(0);
            let felt = entities.get(index);
            let space = felt.map_or(0, |entity| entity.space);
            let is_clear = space != 0 && is_wall(scene, &part.entity.name);
            let [r, g, b, opacity] = part.colour;
            match looks.of(part, felt.map(|entity| &entity.shape)) {
                Some(triangles) => stage.things.push(Thing {
                    entity: index,
                    triangles,
                    pose: part.X_BV,
                    colour: [r, g, b, if is_clear { WALL_OPACITY * opacity } else { opacity }],
                    is_coloured: part.is_coloured,
                    texture: part.texture(),
                    casts_shadow: part.casts_shadow && !is_clear,
                    space,
                }),
                None => stage
                    .not_drawn
                    .push(format!("{}: what it is drawn as has no triangles", part.entity.name)),
            }
        }
        usual::colour(scene, &mut stage.things);
        stage.rims = rims::all(&scene.entities, entities);
        if stage.lights.is_empty() {
            stage.lights = usual::lights();
        }
        if stage.cameras.is_empty() {
            stage.cameras = vec![usual::camera(scene, entities, &stage.things)];
        }
        stage
    }
}

impl Stage {
    /// What an entity is called.
    pub fn name(&self, entity: usize) -> &str {
        self.known.get(entity).map_or("?", |known| known.name.as_str())
    }
}

impl Known {
    fn new(entity: &SceneEntity) -> Self {
        Self {
            name: entity.name.clone(),
            kind: entity.shape.kind(),
            mass: entity.motion.map(|motion| motion.mass),
            stiffness_n_per_m: entity.stiffness_n_per_m,
            damping_n_s_per_m: entity.damping_n_s_per_m,
            friction: entity.friction.clone(),
            is_felt: entity.is_haptic,
        }
    }
}

/// Whether an entity is part of an environment itself.
fn is_wall(scene: &Scene, name: &String) -> bool {
    scene.environments.iter().any(|environment| environment.parts.contains(name))
}

/// The triangles made so far: what looks alike shares them.
#[derive(Default)]
struct Looks<'s> {
    files: Vec<(*const TriangleSoup, [f64; 3], Arc<Triangles>)>,
    shapes: Vec<(&'s ShapeSpec, Arc<Triangles>)>,
}

impl<'s> Looks<'s> {
    fn of(&mut self, part: &SeenPart<'s>, felt: Option<&Shape>) -> Option<Arc<Triangles>> {
        match &part.form {
            SeenForm::Triangles { soup, scale, painting } => {
                let alike = |(of, by, _): &&(*const TriangleSoup, [f64; 3], _)| {
                    *of == Arc::as_ptr(soup) && by == scale
                };
                if let Some((.., made)) = self.files.iter().find(alike) {
                    return Some(Arc::clone(made));
                }
                let uv = painting.as_ref().map_or(&[][..], |painting| &painting.uv);
                let smooth = shapes::smooth(&soup.vertices, &soup.faces, uv);
                let made = Arc::new(smooth.scaled(&(*scale).into()));
                self.files.push((Arc::as_ptr(soup), *scale, Arc::clone(&made)));
                Some(made)
            }
            SeenForm::Shape(spec) => {
                if let Some((_, made)) = self.shapes.iter().find(|(of, _)| of == spec) {
                    return Some(Arc::clone(made));
                }
                // What only a model knows is known of what is felt.
                let model = felt.filter(|_| std::ptr::eq(*spec, &raw const part.entity.shape));
                let made = Arc::new(match model {
                    None if spec.is_csg() => solids::triangles(&spec.csg().ok()?),
                    model => shapes::triangles(spec, model)?,
                });
                self.shapes.push((spec, Arc::clone(&made)));
                Some(made)
            }
        }
    }
}
