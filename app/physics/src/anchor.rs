//! What a contact point between two entities remembers.
//!
//! Model: every contact point has a friction cone of its own (Melder ch. 6.3.1). Its god-object is kept as the *stretch*,
//! how far the body's point has been dragged from where friction holds it, along the other's tangent plane: 0 where the
//! contact begins, and the spring of it is the friction. From tick to tick the stretch grows by what the body's material at
//! the contact moved relative to the other's. So a vertex that stands still is held at the very same place for ever, and a
//! ball that rolls drags nothing. A contact that slides leaves its stretch on the rim of the friction circle.
//! Frames: the stretch is kept in the other's frame, which carries it along.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::collide::ContactPoint;
use crate::row::{Held, Row};

/// A contact point's memory.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Anchor {
    /// Which features touch.
    pub id: u32,
    /// The material that was at the contact, of the body and of the other, each in its own frame \[m\].
    materials: [Vector3<f64>; 2],
    /// Of either, whether it is the same material as in the last tick: a vertex, not a ball that rolls.
    pub(crate) is_same_material: [bool; 2],
    /// In the other's frame, before the motion of the tick \[m\].
    stretch: Vector3<f64>,
    /// Force on the body in the last tick \[N\], in the other's frame.
    force: Vector3<f64>,
    /// Turn of the body against its torsional and rolling friction, at the rim of their patch \[m\]; in the
    /// other's frame, at the end of the tick.
    turned: Vector3<f64>,
    /// Whether it stuck or slid.
    held: Held,
    /// It came nearer when the last tick began, fast enough to bounce.
    pub(crate) approached: bool,
    /// Speed at which it met in the last tick, and has to leave in this one \[m/s\]; 0: it need not.
    pub(crate) owed_m_s: f64,
    /// How much of a depth that was there from the start is still granted \[m\].
    pub(crate) granted_m: f64,
    /// How far its spring is pressed \[m\]; negative: how far it is from touching.
    pub(crate) pressed_m: f64,
    /// Which part of a spring it is.
    pub(crate) share: f64,
    /// Stretches of its springs when the last tick ended, along the normal, across it and in turning \[m^2\], squared:
    /// what the forces have worked against.
    pub(crate) worked: [f64; 3],
}

impl Anchor {
    /// A contact that begins here, pressed by nothing yet.
    pub(crate) fn begin(point: &ContactPoint, X_WA: &Isometry3<f64>, X_WB: &Isometry3<f64>) -> Self {
        let mut anchor = Self { id: point.id, ..Self::default() };
        anchor.touch(point, X_WA, X_WB);
        anchor.is_same_material = [false; 2];
        anchor
    }

    /// Goes on at this point: takes note of what moved since the last tick.
    ///
    /// Poses of the body and of the other: now, and in the last tick.
    pub(crate) fn carry(
        &mut self,
        point: &ContactPoint,
        now: [&Isometry3<f64>; 2],
        last: [&Isometry3<f64>; 2],
    ) {
        let [X_WA, X_WB] = now;
        // What moved before anything pressed stretched nothing.
        if self.is_pressed() {
            let [a_A, b_B] = self.materials.map(Point3::from);
            let at = Point3::from(point.point_W);
            let [a_now_A, b_now_B] = now.map(|pose| pose.inverse_transform_point(&at));
            // The mean of where the material that was at the contact has come to, and of where that which is now has come
            // from: either alone makes a ball that rolls and spins drag by `omega^2 r dt^2 / 2` in each tick.
            let moved_W = (X_WA * a_A - X_WB * b_B + (last[1] * b_now_B - last[0] * a_now_A)) * 0.5;
            // Along the normal it is another spring's: here it would be taken for a turn of the stretch.
            let across_W = moved_W - point.normal_W * point.normal_W.dot(&moved_W);
            self.stretch += X_WB.inverse_transform_vector(&across_W);
        }
        self.id = point.id;
        self.touch(point, X_WA, X_WB);
    }

    fn touch(&mut self, point: &ContactPoint, X_WA: &Isometry3<f64>, X_WB: &Isometry3<f64>) {
        let at = Point3::from(point.point_W);
        let materials = [X_WA, X_WB].map(|pose| pose.inverse_transform_point(&at).coords);
        let is_same = |side: usize| (materials[side] - self.materials[side]).norm_squared() < SAME_M * SAME_M;
        self.is_same_material = [is_same(0), is_same(1)];
        self.materials = materials;
        let normal_B = X_WB.inverse_transform_vector(&point.normal_W);
        // Seen in the tangent plane, and no shorter for its having turned.
        let length_m = self.stretch.norm();
        let along_B = self.stretch - normal_B * normal_B.dot(&self.stretch);
        let along_m = along_B.norm();
        self.stretch =
            if along_m > 0.0 { along_B * (length_m.min(2.0 * along_m) / along_m) } else { along_B };
    }

    pub(crate) fn stretch_W(&self, X_WB: &Isometry3<f64>) -> Vector3<f64> {
        X_WB.rotation * self.stretch
    }

    /// How far the point has been dragged \[m^2\], squared.
    pub(crate) fn stretch_squared(&self) -> f64 {
        self.stretch.norm_squared()
    }

    /// Lets go of a part of the stretch: what is left of its square.
    pub(crate) fn slacken(&mut self, squared: f64) {
        let was = self.stretch.norm_squared();
        self.stretch *= if was > 0.0 { (squared / was).sqrt() } else { 0.0 };
    }

    /// Lets go of all of it.
    pub(crate) fn release(&mut self) {
        self.stretch = Vector3::zeros();
    }

    pub(crate) fn force_W(&self, X_WB: &Isometry3<f64>) -> Vector3<f64> {
        X_WB.rotation * self.force
    }

    /// Turn of the body, in W \[m\].
    pub(crate) fn turned_W(&self, X_WB: &Isometry3<f64>) -> Vector3<f64> {
        X_WB.rotation * self.turned
    }

    /// Its square \[m^2\].
    pub(crate) fn turned_squared(&self) -> f64 {
        self.turned.norm_squared()
    }

    /// Lets go of what it was turned by, but for this part.
    pub(crate) fn turn_back(&mut self, share: f64) {
        self.turned *= share;
    }

    /// Remembers how far it has been turned when the tick ended (m, in W).
    pub(crate) fn turn(&mut self, turned_W: &Vector3<f64>, X_WB: &Isometry3<f64>) {
        self.turned = X_WB.inverse_transform_vector(turned_W);
        self.worked[2] = self.turned.norm_squared();
    }

    /// Depth that its spring was pressed by when the last tick ended \[m\].
    pub(crate) fn worked_m(&self) -> f64 {
        if self.share > 0.0 { (self.worked[0] / self.share).sqrt() } else { 0.0 }
    }

    pub(crate) fn held(&self) -> Held {
        self.held
    }

    /// Whether it was pressed in the last tick.
    pub(crate) fn is_pressed(&self) -> bool {
        self.force != Vector3::zeros()
    }

    /// Where it was, when nobody knows what it is now \[m\], in W.
    pub(crate) fn point_W(&self, X_WB: &Isometry3<f64>) -> Vector3<f64> {
        (X_WB * Point3::from(self.materials[1])).coords
    }

    /// Remembers how the tick ended: `moved_W` is how far the body's point moves in it relative to the other's (m).
    pub(crate) fn settle(&mut self, row: &Row, moved_W: &Vector3<f64>, X_WB: &Isometry3<f64>) {
        self.force = X_WB.inverse_transform_vector(&row.force_W);
        let k = row.stiffness[1];
        let n = row.normal_W;
        let normal_n = n.dot(&row.force_W);
        if row.held == Held::Slip && k > 0.0 {
            // What the spring is stretched by at the end, less what it will be found to have moved until then.
            let across_W = row.force_W - n * normal_n;
            let moved_across_W = moved_W - n * n.dot(moved_W);
            self.stretch = X_WB.inverse_transform_vector(&(-across_W / k - moved_across_W));
        }
        if normal_n == 0.0 {
            self.stretch = Vector3::zeros();
        }
        let pressed_m = (self.pressed_m - n.dot(moved_W)).max(0.0);
        let dragged_W = self.stretch_W(X_WB) + moved_W - n * n.dot(moved_W);
        let is_dragged = normal_n > 0.0;
        self.worked[0] = self.share * pressed_m * pressed_m;
        self.worked[1] = if is_dragged { dragged_W.norm_squared() } else { 0.0 };
        self.held = match row.held {
            Held::Slip if normal_n > 0.0 && is_caught(row, normal_n) => Held::Stick,
            Held::Slip if normal_n == 0.0 => Held::Stick,
            held => held,
        };
    }
}

/// Whether a contact that slid is so far inside its circle that it sticks again (Melder eq. 7.35, in squares).
fn is_caught(row: &Row, normal_n: f64) -> bool {
    let across = (row.force_W - row.normal_W * normal_n).norm_squared();
    // One coefficient for both catches at once.
    let share = if row.mu_slide == row.mu_hold { 1.0 - 1e-9 } else { 1.0 - haptics::RESTICK_MARGIN };
    across < (share * row.mu_slide * normal_n).powi(2)
}

/// Nearer is the same material \[m\]: what moves less in a tick does not matter.
const SAME_M: f64 = 1e-9;
