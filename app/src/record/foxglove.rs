//! Messages that Foxglove knows without being told: what it draws.
//!
//! Model: the well-known schemas of the package `foxglove` (names and field numbers as published), as far as they are
//! used here: frames that move, and bodies made of boxes, balls, cylinders, triangles and arrows.

use super::descriptor::{Kind, MessageType, ProtoFile};
use super::wire::Message;
use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};

/// The file that others import.
pub(super) const FILE: &str = "foxglove/phantom3_subset.proto";
/// Where timestamps are described.
const TIMESTAMP_FILE: &str = "google/protobuf/timestamp.proto";
const DURATION_FILE: &str = "google/protobuf/duration.proto";

const TIMESTAMP: Kind = Kind::Message(".google.protobuf.Timestamp");
const DURATION: Kind = Kind::Message(".google.protobuf.Duration");
/// `foxglove.Vector3`
pub(super) const VECTOR3: Kind = Kind::Message(".foxglove.Vector3");
/// `foxglove.Quaternion`
pub(super) const QUATERNION: Kind = Kind::Message(".foxglove.Quaternion");
const POSE: Kind = Kind::Message(".foxglove.Pose");
const POINT3: Kind = Kind::Message(".foxglove.Point3");
const COLOR: Kind = Kind::Message(".foxglove.Color");

/// Red, green, blue and how little shines through, 0 to 1.
pub(super) type Rgba = [f64; 4];

/// The descriptors of everything in this file, and of what it needs.
pub(super) fn files() -> Vec<ProtoFile> {
    use Kind::{Bool, Double, Fixed32, Int32, Int64, Message as Of, Text};
    let time = |name| MessageType::new(name, &[(1, "seconds", Int64), (2, "nanos", Int32)]);
    let xyz = [(1, "x", Double), (2, "y", Double), (3, "z", Double)];
    let solid = [(1, "pose", POSE), (2, "size", VECTOR3), (3, "color", COLOR)];
    let google = |name, message| ProtoFile {
        name,
        package: "google.protobuf",
        imports: &[],
        messages: vec![time(message)],
    };
    let messages = vec![
        MessageType::new("Vector3", &xyz),
        MessageType::new("Point3", &xyz),
        MessageType::new("Quaternion", &[xyz[0], xyz[1], xyz[2], (4, "w", Double)]),
        MessageType::new("Pose", &[(1, "position", VECTOR3), (2, "orientation", QUATERNION)]),
        MessageType::new("Color", &[(1, "r", Double), (2, "g", Double), (3, "b", Double), (4, "a", Double)]),
        MessageType::new(
            "FrameTransform",
            &[
                (1, "timestamp", TIMESTAMP),
                (2, "parent_frame_id", Text),
                (3, "child_frame_id", Text),
                (4, "translation", VECTOR3),
                (5, "rotation", QUATERNION),
            ],
        ),
        MessageType::new("FrameTransforms", &[]).with_repeated(&[(
            1,
            "transforms",
            Of(".foxglove.FrameTransform"),
        )]),
        MessageType::new("CubePrimitive", &solid),
        MessageType::new("SpherePrimitive", &solid),
        MessageType::new(
            "CylinderPrimitive",
            &[solid[0], solid[1], (3, "bottom_scale", Double), (4, "top_scale", Double), (5, "color", COLOR)],
        ),
        MessageType::new(
            "ArrowPrimitive",
            &[
                (1, "pose", POSE),
                (2, "shaft_length", Double),
                (3, "shaft_diameter", Double),
                (4, "head_length", Double),
                (5, "head_diameter", Double),
                (6, "color", COLOR),
            ],
        ),
        MessageType::new("TriangleListPrimitive", &[(1, "pose", POSE), (3, "color", COLOR)])
            .with_repeated(&[(2, "points", POINT3), (5, "indices", Fixed32)]),
        MessageType::new(
            "SceneEntity",
            &[
                (1, "timestamp", TIMESTAMP),
                (2, "frame_id", Text),
                (3, "id", Text),
                (4, "lifetime", DURATION),
                (5, "frame_locked", Bool),
            ],
        )
        .with_repeated(&[
            (7, "arrows", Of(".foxglove.ArrowPrimitive")),
            (8, "cubes", Of(".foxglove.CubePrimitive")),
            (9, "spheres", Of(".foxglove.SpherePrimitive")),
            (10, "cylinders", Of(".foxglove.CylinderPrimitive")),
            (12, "triangles", Of(".foxglove.TriangleListPrimitive")),
        ]),
        MessageType::new("SceneUpdate", &[]).with_repeated(&[(2, "entities", Of(".foxglove.SceneEntity"))]),
    ];
    vec![
        google(TIMESTAMP_FILE, "Timestamp"),
        google(DURATION_FILE, "Duration"),
        ProtoFile { name: FILE, package: "foxglove", imports: &[TIMESTAMP_FILE, DURATION_FILE], messages },
    ]
}

/// A vector or a point.
pub(super) fn vector(out: &mut Message, field: u32, v: &Vector3<f64>) {
    out.message(field, |out| {
        out.double(1, v.x).double(2, v.y).double(3, v.z);
    });
}

/// A quaternion.
pub(super) fn quaternion(out: &mut Message, field: u32, q: &Quaternion<f64>) {
    out.message(field, |out| {
        out.double(1, q.i).double(2, q.j).double(3, q.k).double(4, q.w);
    });
}

/// A time since the run's beginning.
pub(super) fn timestamp(out: &mut Message, field: u32, time_ns: u64) {
    out.message(field, |out| {
        out.whole(1, time_ns / 1_000_000_000).whole(2, time_ns % 1_000_000_000);
    });
}

/// The frame that everything stands in.
pub(super) const WORLD: &str = "world";

/// One of a `FrameTransforms` message: where a frame is in the world.
pub(super) fn frame_in_world(
    out: &mut Message,
    time_ns: u64,
    frame: &str,
    at: &Vector3<f64>,
    turned: &Quaternion<f64>,
) {
    out.message(1, |out| {
        timestamp(out, 1, time_ns);
        out.text(2, WORLD).text(3, frame);
        vector(out, 4, at);
        quaternion(out, 5, turned);
    });
}

/// One of a `SceneUpdate` message; `parts` writes what it is made of.
pub(super) fn scene_entity(
    out: &mut Message,
    time_ns: u64,
    frame: &str,
    id: &str,
    parts: impl FnOnce(&mut Message),
) {
    out.message(2, |out| {
        timestamp(out, 1, time_ns);
        out.text(2, frame).text(3, id).whole(5, 1);
        parts(out);
    });
}

fn pose(out: &mut Message, pose: &Isometry3<f64>) {
    out.message(1, |out| {
        vector(out, 1, &pose.translation.vector);
        quaternion(out, 2, &pose.rotation);
    });
}

fn color(out: &mut Message, field: u32, rgba: Rgba) {
    out.message(field, |out| {
        for (field, value) in (1..).zip(rgba) {
            out.double(field, value);
        }
    });
}

/// A box of a scene entity; full lengths of its edges.
pub(super) fn cube(out: &mut Message, at: &Isometry3<f64>, size: Vector3<f64>, rgba: Rgba) {
    out.message(8, |out| solid(out, at, size, rgba));
}

/// A ball or an ellipsoid of a scene entity; full lengths.
pub(super) fn sphere(out: &mut Message, at: &Isometry3<f64>, size: Vector3<f64>, rgba: Rgba) {
    out.message(9, |out| solid(out, at, size, rgba));
}

fn solid(out: &mut Message, at: &Isometry3<f64>, size: Vector3<f64>, rgba: Rgba) {
    pose(out, at);
    vector(out, 2, &size);
    color(out, 3, rgba);
}

/// A cylinder or the frustum of a cone of a scene entity, its axis along y as everywhere here; Foxglove's is z.
pub(super) fn cylinder(out: &mut Message, at: &Isometry3<f64>, radii: [f64; 2], length: f64, rgba: Rgba) {
    let z_to_y = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -std::f64::consts::FRAC_PI_2);
    let widest = radii[0].max(radii[1]);
    out.message(10, |out| {
        pose(out, &(at * z_to_y));
        vector(out, 2, &Vector3::new(2.0 * widest, 2.0 * widest, length));
        out.double(3, radii[0] / widest).double(4, radii[1] / widest);
        color(out, 5, rgba);
    });
}

/// Triangles of a scene entity.
pub(super) fn triangles(
    out: &mut Message,
    at: &Isometry3<f64>,
    points: impl IntoIterator<Item = Vector3<f64>>,
    indices: &[u32],
    rgba: Rgba,
) {
    out.message(12, |out| {
        pose(out, at);
        for point in points {
            vector(out, 2, &point);
        }
        color(out, 3, rgba);
        out.packed_fixed32(5, indices);
    });
}

/// An arrow of a scene entity from a point on, so thick.
pub(super) fn arrow(out: &mut Message, from: &Vector3<f64>, along: &Vector3<f64>, thick_m: f64, rgba: Rgba) {
    let length = along.norm();
    let turned = UnitQuaternion::rotation_between(&Vector3::x(), along)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI));
    let head = (3.0 * thick_m).min(0.5 * length);
    out.message(7, |out| {
        pose(out, &Isometry3::from_parts((*from).into(), turned));
        out.double(2, length - head).double(3, thick_m).double(4, head).double(5, 2.0 * thick_m);
        color(out, 6, rgba);
    });
}
