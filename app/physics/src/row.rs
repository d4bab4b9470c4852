//! One point at which a body is pressed: a spring with damper and friction cone, as a function of how the point moves.
//!
//! Model: with `d` how far the body's point has moved in the tick relative to what presses it, and `u` how fast it does,
//! the trial force is `rest - k d - b u`, with stiffness and damping of their own along the normal and across it. Its
//! normal part is never negative (contacts never pull). Its tangential part is kept inside the friction cone; on the rim
//! there is no damping, so that sliding ratios are exact.
//! Frames and signs: W; `normal_W` points to the body that is pressed; forces are forces on that body.

use nalgebra::{Matrix3, Vector3};

/// A contact point in a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Number of the body that is pressed.
    pub body: usize,
    /// Number of the body that presses; `None`: a finger, or what is fixed.
    pub other: Option<usize>,
    /// From the centre of mass of either to the contact point \[m\].
    pub arms_W: [Vector3<f64>; 2],
    /// Unit normal, to the body.
    pub normal_W: Vector3<f64>,
    /// Force on the body if the point does not move \[N\].
    pub rest_W: Vector3<f64>,
    /// \[N/m\], along the normal and across it.
    pub stiffness: [f64; 2],
    /// \[N s/m\], along the normal and, while it sticks, across it.
    pub damping: [f64; 2],
    /// Ratio of tangential to normal force up to which it sticks.
    pub mu_hold: f64,
    /// That with which it slides, <= `mu_hold`.
    pub mu_slide: f64,
    /// Whether it sticks or slides: at first as in the last tick, then as this one has it.
    pub held: Held,
    /// Force on the body \[N\]: at first a guess, then the answer.
    pub force_W: Vector3<f64>,
    /// What of its turning about the normal the contact resists.
    pub torsion: Torsion,
    /// Its resistance to rolling.
    pub rolling: Rolling,
    /// Torques that torsion and rolling hold per normal force, beside their own limits \[m\].
    pub turning_m: [f64; 2],
    /// A tie, not a contact: it pulls as well as it presses, in every direction up to this force \[N\]; there is no cone.
    pub tie_n: Option<f64>,
}

/// Resistance of a contact point to turning about its normal: a spring with damper and limit, as the row itself.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Torsion {
    /// Torque on the body about the normal if it does not turn \[N m\].
    pub rest_nm: f64,
    /// \[N m/rad\]
    pub stiffness_nm_per_rad: f64,
    /// \[N m s/rad\]
    pub damping_nm_s_per_rad: f64,
    /// The torque stays within this, whatever presses \[N m\].
    pub most_nm: f64,
    /// At first a guess, then the answer \[N m\].
    pub torque_nm: f64,
}

impl Torsion {
    /// By how much the trial torque falls per angular velocity that lasts for the tick \[N m s\].
    #[inline]
    pub(crate) fn falls(&self, dt_s: f64) -> f64 {
        self.stiffness_nm_per_rad * dt_s + self.damping_nm_s_per_rad
    }

    /// The torque if the body turns about the normal at `spin_rad_s` all the tick \[N m\].
    #[inline]
    pub(crate) fn at_end_nm(&self, spin_rad_s: f64, dt_s: f64, most_nm: f64) -> f64 {
        (self.rest_nm - self.falls(dt_s) * spin_rad_s).clamp(-most_nm, most_nm)
    }

    /// The torque after a turn about the normal (rad), while it turns so fast \[N m\].
    #[inline]
    pub(crate) fn after_nm(&self, turned_rad: f64, spin_rad_s: f64) -> f64 {
        let (k, b) = (self.stiffness_nm_per_rad, self.damping_nm_s_per_rad);
        (self.rest_nm - k * turned_rad - b * spin_rad_s).clamp(-self.most_nm, self.most_nm)
    }

    /// By how much that torque falls per angular velocity, where it stands \[N m s\].
    #[inline]
    pub(crate) fn falls_at_end(&self, spin_rad_s: f64, dt_s: f64, most_nm: f64) -> f64 {
        let falls = self.falls(dt_s);
        if (self.rest_nm - falls * spin_rad_s).abs() < most_nm { falls } else { 0.0 }
    }

    /// The slope of the line to where the torque stands from where there is none \[N m s\]: what a torque at its limit, which
    /// does not change at all, is worth on the way back.
    #[inline]
    pub(crate) fn chord(&self, spin_rad_s: f64, dt_s: f64, most_nm: f64) -> f64 {
        let (falls, trial_nm) = (self.falls(dt_s), self.rest_nm - self.falls(dt_s) * spin_rad_s);
        if trial_nm.abs() <= most_nm { falls } else { falls * (most_nm / trial_nm.abs()) }
    }
}

/// Resistance of a contact point to rolling, which is turning across its normal: a spring with damper and limit, as torsion.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Rolling {
    /// Torque on the body, across the normal, if it does not turn \[N m\].
    pub rest_W: Vector3<f64>,
    /// \[N m/rad\]
    pub stiffness_nm_per_rad: f64,
    /// \[N m s/rad\]
    pub damping_nm_s_per_rad: f64,
    /// The torque is no larger, whatever presses \[N m\].
    pub most_nm: f64,
    /// At first a guess, then the answer \[N m\].
    pub torque_W: Vector3<f64>,
}

impl Rolling {
    /// By how much the trial torque falls per angular velocity that lasts for the tick \[N m s\].
    #[inline]
    pub(crate) fn falls(&self, dt_s: f64) -> f64 {
        self.stiffness_nm_per_rad * dt_s + self.damping_nm_s_per_rad
    }

    /// The torque if the body turns at `across_W` (rad/s), across the normal, all the tick \[N m\].
    #[inline]
    pub(crate) fn at_end_W(&self, across_W: &Vector3<f64>, dt_s: f64, most_nm: f64) -> Vector3<f64> {
        within_ball(&(self.rest_W - across_W * self.falls(dt_s)), most_nm)
    }

    /// By how much that torque falls per angular velocity, where it stands \[N m s\]; `normal_W` is the contact's.
    #[inline]
    pub(crate) fn falls_at_end_W(
        &self,
        normal_W: &Vector3<f64>,
        across_W: &Vector3<f64>,
        dt_s: f64,
        most_nm: f64,
    ) -> Matrix3<f64> {
        let plane = Matrix3::identity() - normal_W * normal_W.transpose();
        let falls = self.falls(dt_s);
        let trial_W = self.rest_W - across_W * falls;
        let trial_nm = trial_W.norm();
        if trial_nm <= most_nm {
            return plane * falls;
        }
        let t = trial_W / trial_nm;
        (plane - t * t.transpose()) * (falls * most_nm / trial_nm)
    }
}

/// What friction does at a contact point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Held {
    /// It holds.
    #[default]
    Stick,
    /// It slides, or has slid and was not caught again.
    Slip,
}

impl Row {
    /// The trial force after a displacement (m) at a velocity (m/s), both of the body's point relative to the other's.
    #[inline]
    pub fn trial_W(&self, displacement_W: &Vector3<f64>, velocity_W: &Vector3<f64>) -> Vector3<f64> {
        let [k_n, k_t] = self.stiffness;
        let [b_n, b_t] = self.dampings();
        let change = |along: f64, across: f64, v: &Vector3<f64>| {
            let v_n = self.normal_W.dot(v);
            v * across + self.normal_W * (v_n * (along - across))
        };
        self.rest_W - change(k_n, k_t, displacement_W) - change(b_n, b_t, velocity_W)
    }

    /// A row that only turns, about this axis (unit): the body, against what is fixed.
    pub fn turning(body: usize, axis_W: Vector3<f64>, torsion: Torsion) -> Self {
        Self {
            body,
            other: None,
            arms_W: [Vector3::zeros(); 2],
            normal_W: axis_W,
            rest_W: Vector3::zeros(),
            stiffness: [0.0; 2],
            damping: [0.0; 2],
            mu_hold: 0.0,
            mu_slide: 0.0,
            held: Held::Stick,
            force_W: Vector3::zeros(),
            torsion,
            rolling: Rolling::default(),
            turning_m: [0.0; 2],
            tie_n: None,
        }
    }

    /// The torque on the body, beside that of the force \[N m\].
    #[inline]
    pub(crate) fn torque_W(&self) -> Vector3<f64> {
        self.normal_W * self.torsion.torque_nm + self.rolling.torque_W
    }

    /// Without a force and a torque.
    pub(crate) fn silence(&mut self) {
        self.force_W = Vector3::zeros();
        (self.torsion.torque_nm, self.rolling.torque_W) = (0.0, Vector3::zeros());
    }

    /// The force: what of a trial force does not pull and lies in the cone; of a tie, what is not too much.
    #[inline]
    pub fn project(&self, trial_W: &Vector3<f64>) -> Vector3<f64> {
        if let Some(most_n) = self.tie_n {
            return within_ball(trial_W, most_n);
        }
        let normal_n = self.normal_W.dot(trial_W);
        if normal_n.is_nan() || normal_n <= 0.0 {
            return Vector3::zeros();
        }
        let across_W = trial_W - self.normal_W * normal_n;
        let (across_n, most_n) = (across_W.norm(), self.mu() * normal_n);
        // To the last bit what it was, if it may stay.
        if across_n <= most_n { *trial_W } else { self.normal_W * normal_n + across_W * (most_n / across_n) }
    }

    /// The ratio that counts now.
    #[inline]
    pub(crate) fn mu(&self) -> f64 {
        match self.held {
            Held::Stick => self.mu_hold,
            Held::Slip => self.mu_slide,
        }
    }

    /// Whether all of it is made of numbers, and springs and dampers take energy rather than give it.
    pub(crate) fn is_finite(&self) -> bool {
        let (torsion, rolling) = (&self.torsion, &self.rolling);
        let [a_W, b_W] = &self.arms_W;
        let vectors = [a_W, b_W, &self.normal_W, &self.rest_W, &self.force_W, &rolling.rest_W];
        let not_negative = [
            self.stiffness[0],
            self.stiffness[1],
            self.damping[0],
            self.damping[1],
            self.mu_hold,
            self.mu_slide,
            torsion.stiffness_nm_per_rad,
            torsion.damping_nm_s_per_rad,
            torsion.most_nm,
            rolling.stiffness_nm_per_rad,
            rolling.damping_nm_s_per_rad,
            rolling.most_nm,
            self.turning_m[0],
            self.turning_m[1],
        ];
        // Zero times what is no number, or infinite, is no number.
        let zero = vectors.iter().fold(Vector3::zeros(), |zero: Vector3<f64>, v| zero + *v * 0.0).sum()
            + not_negative.iter().fold(torsion.rest_nm * 0.0, |zero, x| zero + x * 0.0);
        zero == 0.0
            && not_negative.iter().fold(0.0_f64, |least, x| least.min(*x)) >= 0.0
            && self.tie_n.is_none_or(|most_n| most_n.is_finite() && most_n >= 0.0)
    }

    #[inline]
    fn dampings(&self) -> [f64; 2] {
        let [b_n, b_t] = self.damping;
        match self.held {
            Held::Stick => [b_n, b_t],
            Held::Slip => [b_n, 0.0],
        }
    }

    /// By how much the trial force falls per velocity that lasts for the tick \[N s/m\]: along the normal, and across.
    #[inline]
    pub(crate) fn falls(&self, dt_s: f64) -> [f64; 2] {
        let [k_n, k_t] = self.stiffness;
        let [b_n, b_t] = self.dampings();
        [k_n * dt_s + b_n, k_t * dt_s + b_t]
    }

    /// The force if its point moves at `velocity_W` (m/s) all the tick.
    #[inline]
    pub(crate) fn at_end_W(&self, velocity_W: &Vector3<f64>, dt_s: f64) -> Vector3<f64> {
        self.project(&self.trial_at_end_W(velocity_W, dt_s))
    }

    #[inline]
    pub(crate) fn trial_at_end_W(&self, velocity_W: &Vector3<f64>, dt_s: f64) -> Vector3<f64> {
        let [along, across] = self.falls(dt_s);
        let v_n = self.normal_W.dot(velocity_W);
        self.rest_W - velocity_W * across - self.normal_W * (v_n * (along - across))
    }

    /// By how much that force falls per velocity, where it stands \[N s/m\].
    #[inline]
    pub(crate) fn falls_at_end_W(&self, velocity_W: &Vector3<f64>, dt_s: f64) -> Matrix3<f64> {
        let [along, across] = self.falls(dt_s);
        let n = self.normal_W;
        let trial_W = self.trial_at_end_W(velocity_W, dt_s);
        if let Some(most_n) = self.tie_n {
            let length_n = trial_W.norm();
            let falls_W = Matrix3::from_diagonal_element(across) + n * n.transpose() * (along - across);
            let unit_W = trial_W / length_n;
            return if length_n <= most_n {
                falls_W
            } else {
                (Matrix3::identity() - unit_W * unit_W.transpose()) * falls_W * (most_n / length_n)
            };
        }
        let normal_n = n.dot(&trial_W);
        if normal_n <= 0.0 {
            return Matrix3::zeros();
        }
        let across_W = trial_W - n * normal_n;
        let (across_n, mu) = (across_W.norm(), self.mu());
        if across_n <= mu * normal_n && mu > 0.0 {
            return Matrix3::from_diagonal_element(across) + n * n.transpose() * (along - across);
        }
        // It slides: the tangential part turns with the trial's, and grows with the normal one.
        let t = if across_n > 0.0 { across_W / across_n } else { Vector3::zeros() };
        let share = if across_n > 0.0 { mu * normal_n / across_n } else { 0.0 };
        (n + t * mu) * n.transpose() * along
            + (Matrix3::identity() - n * n.transpose() - t * t.transpose()) * (across * share)
    }
}

/// Torques beside that of the force: what torsion and rolling hold grows with what presses.
impl Row {
    /// True of a row that may have any.
    #[inline]
    pub(crate) fn has_torque(&self) -> bool {
        self.torsion.most_nm.max(self.rolling.most_nm) > 0.0 || self.turning_m[0].max(self.turning_m[1]) > 0.0
    }

    /// Force along the normal if that is the trial force, or none \[N\].
    #[inline]
    pub(crate) fn presses_n(&self, trial_W: &Vector3<f64>) -> f64 {
        self.normal_W.dot(trial_W).max(0.0)
    }

    /// Limits of torsion and rolling where so much presses (N) \[N m\].
    #[inline]
    pub(crate) fn most_turning_nm(&self, presses_n: f64) -> [f64; 2] {
        let [about_m, across_m] = self.turning_m;
        [self.torsion.most_nm + about_m * presses_n, self.rolling.most_nm + across_m * presses_n]
    }

    /// Makes the guesses of its torques such as it can have with its force.
    #[inline]
    pub(crate) fn begin_torque(&mut self) {
        let [most_nm, most_across_nm] = self.most_turning_nm(self.presses_n(&self.force_W));
        let guess_nm = if self.torsion.torque_nm.is_finite() { self.torsion.torque_nm } else { 0.0 };
        self.torsion.torque_nm = guess_nm.clamp(-most_nm, most_nm);
        self.rolling.torque_W = within_ball(&self.rolling.torque_W, most_across_nm);
    }

    /// Torques about the normal and across it if the body turns like that all the tick (rad/s) while
    /// so much presses (N).
    #[inline]
    pub(crate) fn turning_at_end(
        &self,
        spin_W: &Vector3<f64>,
        dt_s: f64,
        presses_n: f64,
    ) -> (f64, Vector3<f64>) {
        let [most_nm, most_across_nm] = self.most_turning_nm(presses_n);
        let spin_rad_s = self.normal_W.dot(spin_W);
        let across_W = spin_W - self.normal_W * spin_rad_s;
        let torque_nm = self.torsion.at_end_nm(spin_rad_s, dt_s, most_nm);
        (torque_nm, self.rolling.at_end_W(&across_W, dt_s, most_across_nm))
    }

    /// Fall of these per spin, where they stand \[N m s\]; of torsion the chords, if wanted.
    #[inline]
    pub(crate) fn turning_falls_W(
        &self,
        spin_W: &Vector3<f64>,
        dt_s: f64,
        presses_n: f64,
        chords: bool,
    ) -> Matrix3<f64> {
        let [most_nm, most_across_nm] = self.most_turning_nm(presses_n);
        let n = &self.normal_W;
        let spin_rad_s = n.dot(spin_W);
        let twists = match chords {
            true => self.torsion.chord(spin_rad_s, dt_s, most_nm),
            false => self.torsion.falls_at_end(spin_rad_s, dt_s, most_nm),
        };
        let across_W = spin_W - n * spin_rad_s;
        n * n.transpose() * twists + self.rolling.falls_at_end_W(n, &across_W, dt_s, most_across_nm)
    }

    /// Fall of these per velocity of the point, which takes from what presses (N) \[N s\].
    #[inline]
    pub(crate) fn turning_falls_by_velocity_W(
        &self,
        spin_W: &Vector3<f64>,
        dt_s: f64,
        presses_n: f64,
    ) -> Matrix3<f64> {
        if presses_n <= 0.0 {
            return Matrix3::zeros();
        }
        let [most_nm, most_across_nm] = self.most_turning_nm(presses_n);
        let n = &self.normal_W;
        let (torque_nm, torque_W) = self.turning_at_end(spin_W, dt_s, presses_n);
        let mut grows_W = Vector3::zeros();
        if torque_nm.abs() >= most_nm {
            grows_W += n * self.turning_m[0].copysign(torque_nm);
        }
        let across_nm = torque_W.norm();
        if across_nm > 0.0 && across_nm >= most_across_nm * (1.0 - LIMIT) {
            grows_W += torque_W * (self.turning_m[1] / across_nm);
        }
        grows_W * n.transpose() * self.falls(dt_s)[0]
    }
}

/// Roundings of a length.
const LIMIT: f64 = 1e-14;

/// With friction that holds a given force, whatever presses: the slopes of a convex function of the velocity.
impl Row {
    /// As [`Self::at_end_W`], if friction holds what it does where so much presses (N).
    pub(crate) fn at_end_within_W(
        &self,
        velocity_W: &Vector3<f64>,
        dt_s: f64,
        presses_n: f64,
    ) -> Vector3<f64> {
        let trial_W = self.trial_at_end_W(velocity_W, dt_s);
        if self.tie_n.is_some() {
            return self.project(&trial_W);
        }
        let normal_n = self.normal_W.dot(&trial_W);
        let across_W = trial_W - self.normal_W * normal_n;
        self.normal_W * normal_n.max(0.0) + within_ball(&across_W, self.mu() * presses_n)
    }

    /// As [`Self::falls_at_end_W`].
    pub(crate) fn falls_within_W(
        &self,
        velocity_W: &Vector3<f64>,
        dt_s: f64,
        presses_n: f64,
    ) -> Matrix3<f64> {
        if self.tie_n.is_some() {
            return self.falls_at_end_W(velocity_W, dt_s);
        }
        let [along, across] = self.falls(dt_s);
        let n = self.normal_W;
        let trial_W = self.trial_at_end_W(velocity_W, dt_s);
        let normal_n = n.dot(&trial_W);
        let across_W = trial_W - n * normal_n;
        let (across_n, most_n) = (across_W.norm(), self.mu() * presses_n);
        let pressed = if normal_n > 0.0 { n * n.transpose() * along } else { Matrix3::zeros() };
        let plane = Matrix3::identity() - n * n.transpose();
        if across_n <= most_n {
            return pressed + plane * across;
        }
        let t = across_W / across_n;
        pressed + (plane - t * t.transpose()) * (across * most_n / across_n)
    }
}

/// A force, cut to this length; one that is no number is none.
pub(crate) fn within_ball(force_W: &Vector3<f64>, most_n: f64) -> Vector3<f64> {
    let length_n = force_W.norm();
    if length_n <= most_n {
        *force_W
    } else if length_n.is_finite() {
        force_W * (most_n / length_n)
    } else {
        Vector3::zeros()
    }
}
