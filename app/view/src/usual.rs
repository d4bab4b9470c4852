//! What shines and who looks on where a scene does not say.

use crate::stage::Thing;
use haptics::Entity;
use nalgebra::{Isometry3, Point3, Vector3};
use world::{LightKind, Scene, SceneCamera, SceneEntity, SceneLight, ShapeSpec};

/// Not nearer than what is so large needs (m).
const LEAST_REACH_M: f64 = 0.08;
/// Red, green, blue: told apart by most eyes (after Okabe and Ito), and from what marks fingers and forces.
const COLOURS: [[f64; 3]; 6] = [
    [0.34, 0.60, 0.80],
    [0.85, 0.55, 0.30],
    [0.40, 0.68, 0.58],
    [0.75, 0.55, 0.70],
    [0.55, 0.55, 0.78],
    [0.78, 0.72, 0.50],
];

/// The sun from above, behind the left shoulder, and some light from everywhere.
pub(crate) fn lights() -> Vec<SceneLight> {
    let grey = |share| [share; 3];
    let light = |name: &str, kind, diffuse, ambient, casts_shadow| SceneLight {
        name: name.into(),
        kind,
        diffuse: grey(diffuse),
        specular: grey(diffuse),
        ambient: grey(ambient),
        casts_shadow,
    };
    let direction = nalgebra::Unit::new_normalize(Vector3::new(0.45, -1.0, -0.35));
    vec![
        light("sky", LightKind::Ambient, 0.0, 0.4, false),
        light("sun", LightKind::Directional { direction }, 0.6, 0.0, true),
    ]
}

/// Tells things apart where a scene says no colour at all: planes stay as they are.
pub(crate) fn colour(scene: &Scene, things: &mut [Thing]) {
    let says_one = |entity: &SceneEntity| {
        let of_faces = entity.faces.iter().any(|faces| faces.colour.is_some());
        of_faces || entity.visuals.iter().any(|visual| visual.colour.is_some())
    };
    if scene.entities.iter().any(says_one) || things.iter().any(|thing| thing.is_coloured) {
        return;
    }
    for thing in things.iter_mut().filter(|thing| has_end(scene, thing)) {
        let [r, g, b] = COLOURS[thing.entity % COLOURS.len()];
        thing.colour = [r, g, b, 1.0];
    }
}

fn has_end(scene: &Scene, thing: &Thing) -> bool {
    scene.entities.get(thing.entity).is_some_and(|spec| !matches!(spec.shape, ShapeSpec::Plane { .. }))
}

/// Sees all fingers and all that has an end, from the front and above.
pub(crate) fn camera(scene: &Scene, entities: &[Entity], things: &[Thing]) -> SceneCamera {
    let (least, most) = extent(scene, entities, things);
    let middle = 0.5 * (least + most);
    let reach_m = (0.5 * (most - least).norm()).max(LEAST_REACH_M);
    let field_of_view_deg = SceneCamera::DEFAULT_FIELD_OF_VIEW_DEG;
    // A ball around everything fits between the upper and the lower edge.
    let away_m = reach_m / (0.5 * field_of_view_deg.to_radians()).sin();
    let eye = Point3::from(middle + away_m * Vector3::new(0.25, 0.6, 1.0).normalize());
    // A frame that looks along z has x to the left; a camera's looks along -z.
    let pose = Isometry3::face_towards(&eye, &(eye + (eye.coords - middle)), &Vector3::y());
    SceneCamera {
        name: "usual".into(),
        pose,
        field_of_view_deg,
        near_m: 0.02 * away_m,
        far_m: (50.0 * away_m).max(SceneCamera::DEFAULT_FAR_M),
    }
}

/// The corners of a box around what is to be seen (m); planes have none.
fn extent(scene: &Scene, entities: &[Entity], things: &[Thing]) -> (Vector3<f64>, Vector3<f64>) {
    let fingers = scene.fingers.iter().map(|finger| finger.start_m.coords);
    let corners = things.iter().filter(|thing| has_end(scene, thing)).flat_map(|thing| {
        let pose = entities.get(thing.entity).map_or(thing.pose, |entity| entity.X_WB * thing.pose);
        thing.triangles.places.iter().map(move |place| (pose * place).coords)
    });
    let all = fingers.chain(corners).map(|place| (place, place));
    all.reduce(|(least, most), (place, _)| (least.inf(&place), most.sup(&place))).unwrap_or_default()
}
