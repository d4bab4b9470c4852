//! Rigid-body dynamics of an arm with three actuated joints: mass, Coriolis and centrifugal terms, weight.
//!
//! Problem: what a hand feels of a device is its mass as well as its motors; without it a simulated device
//! would follow any force at once and no loop could oscillate.
//! Model: a turret carries a parallelogram linkage of links `l1` (upper arm) and `l2` (forearm), with the
//! bodies of [`Bodies`] and the moments of [`Inertias`]. In the linkage's angles, with `A = l1 (l2 m_a + l3
//! m_c) / 2`,
//!
//! ```text
//! M11 = c0 + c2 cos 2 theta2 + c3 cos 2 theta3 + 2 A cos theta2 sin theta3,   M12 = M13 = 0
//! M22, M33 constant,   M23 = M32 = -A sin(theta2 - theta3)
//! M qdd + C(q, qd) qd + dV/dq = tau
//! ```
//!
//! and C by Christoffel symbols of M. Rotors of motors are not included: they are the motors' matter.
//! Frames and signs: base frame D, y along the turret's axis; it stands upright unless it is told otherwise
//! ([`Dynamics::in_base`]), which only the weight minds. Joints are the mechanism's own
//! ([`JointConvention`]); a positive torque turns its joint towards a larger angle. SI, radians.
//! Invariants: `M` is symmetric and independent of the turret; `dM/dt - 2 C` is skew-symmetric, so the motion
//! neither makes nor loses energy.
//! Cost: two sine-cosine pairs a call, three for the weight; no loop, no allocation.
//! Reference: Cavusoglu, Feygin, Tendick, A critical study of the mechanical and electrical properties of the
//! PHANToM haptic interface, Presence 11(6), 2002. Transcriptions of its C have `+A cos(theta2 - theta3)` for
//! what is `-A cos(theta2 - theta3)` in C32; the symbols of M decide.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::kinematics::gravity::{Bodies, Gravity};
use crate::kinematics::{JointConvention, LinkagePose};

/// Moments of inertia (kg m^2) about x, y, z of the pose in which the upper arm is level towards the user (z)
/// and the forearm hangs (y).
///
/// Those of `a` and `c` are about the bodies' own centres, which the links carry around. Those of `be` and
/// `df`, which turn about the shoulder, are about the shoulder: the mass times the square of its lever (`l5`,
/// `l6`) is in them. That is how the paper's equations use them: no mass of these two stands beside them in
/// `M`.
///
/// Nothing asks that the largest of three is at most the sum of the other two, as for any real body: the
/// paper's own numbers miss that by up to 4 %, which is within what it claims of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inertias {
    /// Forearm, about its centre.
    pub a_kg_m2: [f64; 3],
    /// Parallel link, about its centre.
    pub c_kg_m2: [f64; 3],
    /// Upper arm and motor, about the shoulder.
    pub be_kg_m2: [f64; 3],
    /// Driving link and motor, about the shoulder.
    pub df_kg_m2: [f64; 3],
    /// Turret, about its axis.
    pub base_yy_kg_m2: f64,
}

/// The equations of motion of an arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dynamics {
    /// `c0`, `c2`, `c3`: the turret's moment by the angles of the links.
    turret: [f64; 3],
    /// `M22`.
    upper_arm: f64,
    /// `M33`.
    forearm: f64,
    /// `A`.
    coupling: f64,
    gravity: Gravity,
    convention: JointConvention,
}

/// Half the slope of `M11` along `theta2` and `theta3`, and the slope of `M23` along `theta3`.
struct Slopes {
    half_m11: [f64; 2],
    m23: f64,
}

impl Dynamics {
    /// Of an arm with these links (upper arm, forearm; m) and bodies, which names its joints so.
    pub fn new(links_m: [f64; 2], bodies: &Bodies, inertias: &Inertias, convention: JointConvention) -> Self {
        let [l1, l2] = links_m;
        let Bodies { mass_a_kg: ma, mass_c_kg: mc, l3_m: l3, .. } = *bodies;
        let Inertias { a_kg_m2: a, c_kg_m2: c, be_kg_m2: be, df_kg_m2: df, base_yy_kg_m2 } = *inertias;
        // What a and c weigh on the square of a lever: l1 cos theta2, and along the forearm.
        let (along_l1, along_l2) = (l1 * l1 * (ma + 0.25 * mc), 0.25 * l2 * l2 * ma + l3 * l3 * mc);
        let [_, y, z] = std::array::from_fn(|i| [be[i] + c[i], a[i] + df[i]]);
        Self {
            turret: [
                base_yy_kg_m2 + 0.5 * (y[0] + z[0] + y[1] + z[1] + along_l1 + along_l2),
                0.5 * (y[0] - z[0] + along_l1),
                0.5 * (y[1] - z[1] - along_l2),
            ],
            upper_arm: be[0] + c[0] + along_l1,
            forearm: a[0] + df[0] + along_l2,
            coupling: 0.5 * l1 * (l2 * ma + l3 * mc),
            gravity: Gravity::new(links_m, bodies, convention),
            convention,
        }
    }

    /// The same arm in a base that stands in the world like this (R_WD).
    pub fn in_base(self, base_in_world: &UnitQuaternion<f64>) -> Self {
        Self { gravity: self.gravity.in_base(base_in_world), ..self }
    }

    /// Joint-space mass `M` (kg m^2): the torque per acceleration of each joint.
    pub fn mass_matrix(&self, joints: [f64; 3]) -> Matrix3<f64> {
        self.mass_matrix_at(&self.pose(joints))
    }

    fn mass_matrix_at(&self, pose: &LinkagePose) -> Matrix3<f64> {
        let LinkagePose { sin: [_, sin2, sin3], cos: [_, cos2, cos3] } = *pose;
        let [c0, c2, c3] = self.turret;
        // Double angles and the angle between the links come from these four, which saves half of the time.
        let m11 = c0
            + c2 * (cos2 * cos2 - sin2 * sin2)
            + c3 * (cos3 * cos3 - sin3 * sin3)
            + 2.0 * self.coupling * cos2 * sin3;
        let m23 = -self.coupling * (sin2 * cos3 - cos2 * sin3) * self.mirrored(1, 2);
        Matrix3::new(m11, 0.0, 0.0, 0.0, self.upper_arm, m23, 0.0, m23, self.forearm)
    }

    /// Coriolis and centrifugal matrix `C` (N m s/rad), by Christoffel symbols: `C qd` are the torques that
    /// keep the joints at these rates (rad/s), and `dM/dt - 2 C` is skew-symmetric.
    pub fn coriolis(&self, joints: [f64; 3], rates: [f64; 3]) -> Matrix3<f64> {
        self.coriolis_at(&self.pose(joints), rates)
    }

    fn coriolis_at(&self, pose: &LinkagePose, rates: [f64; 3]) -> Matrix3<f64> {
        let Slopes { half_m11: [a, b], m23 } = self.slopes(pose);
        let [w1, w2, w3] = self.convention.turned(rates);
        // M23 depends on theta2 - theta3 alone: its slopes along the two are opposite.
        let linkage =
            Matrix3::new(a * w2 + b * w3, a * w1, b * w1, -a * w1, 0.0, m23 * w3, -b * w1, -m23 * w2, 0.0);
        Matrix3::from_fn(|i, j| self.mirrored(i, j) * linkage[(i, j)])
    }

    /// All that the motion needs at once, for the price of one: the mass matrix, and the torques (N m) that keep the
    /// joints at these rates (rad/s) against Coriolis and centrifugal forces and weight, `C qd + dV/dq`.
    pub fn mass_and_torque(&self, joints: [f64; 3], rates: [f64; 3]) -> (Matrix3<f64>, Vector3<f64>) {
        let pose = self.pose(joints);
        let coriolis = self.coriolis_at(&pose, rates) * Vector3::from(rates);
        let holding = Vector3::from(self.gravity.holding_torque_at(&pose));
        (self.mass_matrix_at(&pose), coriolis + holding)
    }

    /// Joint torques (N m) that hold the arm against its weight.
    pub fn holding_torque(&self, joints: [f64; 3]) -> [f64; 3] {
        self.gravity.holding_torque(joints)
    }

    /// Energy of the motion (J).
    pub fn kinetic_energy(&self, joints: [f64; 3], rates: [f64; 3]) -> f64 {
        let rates = Vector3::from(rates);
        0.5 * rates.dot(&(self.mass_matrix(joints) * rates))
    }

    /// Energy of the weight (J), zero with all centres at the shoulder's height.
    pub fn potential_energy(&self, joints: [f64; 3]) -> f64 {
        self.gravity.potential_energy(joints)
    }

    fn pose(&self, joints: [f64; 3]) -> LinkagePose {
        LinkagePose::at(self.convention.linkage_angles(joints))
    }

    fn slopes(&self, pose: &LinkagePose) -> Slopes {
        let LinkagePose { sin: [_, sin2, sin3], cos: [_, cos2, cos3] } = *pose;
        let [_, c2, c3] = self.turret;
        let along2 = -2.0 * c2 * sin2 * cos2 - self.coupling * sin2 * sin3;
        let along3 = -2.0 * c3 * sin3 * cos3 + self.coupling * cos2 * cos3;
        // sin 2x = 2 sin x cos x, and half of the slope -2 c sin 2x.
        Slopes { half_m11: [along2, along3], m23: self.coupling * (cos2 * cos3 + sin2 * sin3) }
    }

    /// The sign by which an element of a matrix changes sides.
    fn mirrored(&self, row: usize, column: usize) -> f64 {
        self.convention.sign[row] * self.convention.sign[column]
    }
}
