//! All friction models, under one name each.
//!
//! Every model is a [`FrictionLaw`] of its own in `friction/`, usable alone; [`Friction`] is what an
//! entity has. Unless a model says otherwise its friction is a ratio: the normal force scales it.
//!
//! The god-object and friction models that were made for a mass on a table: the contact's spring, from
//! god-object G to surface point S, is the stiffness that such models give to their bonds or bristles,
//! and the strain of those is `S - G`. A model says when G holds and how far it slides; the force
//! follows. Coulomb's jump at speed zero, which most of them were made to soften, is none here.
//!
//! | model | sticks | sticks again | drifts under noise |
//! |---|---|---|---|
//! | none, viscous | never | - | - |
//! | Coulomb, Coulomb and viscous | up to `mu N` | at once | no |
//! | stiction | up to `mu_s N` | below `mu_d N`, with a margin | no |
//! | Stribeck, curve | up to `mu_s N` | where no slide is in balance, with a margin | no |
//! | Karnopp | up to `mu_s N` | at speeds up to `v_min` | no |
//! | Dahl, LuGre | never | - | yes |
//! | Hayward and Armstrong | up to a part of `mu N` | at once | where noise reaches beyond that part |
//! | bristle | until a bond snaps | at once | no |
//! | reset integrator | up to `mu_s N` | below `mu_d N`, without margin | no |
//! | fixed cone | up to a force | as stiction, if that is its kind | no |

mod bristle;
mod classical;
mod curve;
mod dahl;
mod fixed_cone;
mod hayward;
mod karnopp;
mod lugre;
mod reset_integrator;
mod sliding;
mod stribeck;

pub use bristle::{Bristles, MAX_BRISTLES};
pub use curve::{FrictionCurve, MAX_CURVE_POINTS};
pub use dahl::Dahl;
pub use fixed_cone::FixedCone;
pub use hayward::HaywardArmstrong;
pub use karnopp::Karnopp;
pub use lugre::LuGre;
pub use reset_integrator::ResetIntegrator;
pub use stribeck::Stribeck;

use crate::error::{ParameterError, at_least_zero, static_at_least};
use crate::friction_law::{FrictionLaw, FrictionMemory, FrictionQuery};
use crate::shared::Shared;
use classical::Classical;
use std::sync::Arc;

/// How far below the dynamic friction circle a sliding contact must relax before it sticks again,
/// as a fraction (the epsilon of Melder eq. 7.35).
///
/// It should be about one encoder step over `mu_d * depth`: 2 % is 30 um at 5 mm depth and
/// mu_d = 0.3, the step of a desktop device. A smaller one re-sticks whenever the encoder happens
/// not to move during one tick.
pub const RESTICK_MARGIN: f64 = 0.02;

/// Friction of an entity. The constructors refuse parameters outside their range.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Friction {
    /// No friction: the classic god-object.
    #[default]
    None,
    /// One coefficient for holding and sliding.
    Coulomb {
        /// Friction coefficient, >= 0.
        mu: f64,
    },
    /// Stick-slip: it takes more to break away than to keep sliding.
    Stiction {
        /// Static coefficient, >= `mu_d`.
        mu_s: f64,
        /// Dynamic coefficient, >= 0.
        mu_d: f64,
    },
    /// Friction proportional to normal force and speed; never holds.
    Viscous {
        /// Viscous coefficient \[s/m\], >= 0.
        mu_v_s_per_m: f64,
    },
    /// Coulomb friction that grows with speed.
    CoulombViscous {
        /// Friction coefficient at rest, >= 0.
        mu: f64,
        /// Viscous coefficient \[s/m\], >= 0.
        mu_v_s_per_m: f64,
    },
    /// Falls from static to dynamic friction with speed.
    Stribeck(Stribeck),
    /// Drawn against speed, point by point.
    Curve(FrictionCurve),
    /// Stuck at low speeds.
    Karnopp(Karnopp),
    /// A strain that yields; it drifts under noise.
    Dahl(Dahl),
    /// A strain that yields from a limit on; it does not drift.
    HaywardArmstrong(HaywardArmstrong),
    /// Dahl's strain with Stribeck's curve; it drifts under noise.
    LuGre(LuGre),
    /// Bonds that snap and form anew at random.
    Bristle(Bristles),
    /// The bristles' force without their bonds.
    ResetIntegrator(ResetIntegrator),
    /// Independent of the normal force.
    FixedCone(FixedCone),
    /// Somebody's own law.
    Own(Shared<dyn OwnLaw>),
}

/// A [`FrictionLaw`] that an entity can share between threads.
pub trait OwnLaw: FrictionLaw + std::fmt::Debug + Send + Sync {}

impl<L: FrictionLaw + std::fmt::Debug + Send + Sync> OwnLaw for L {}

impl Friction {
    /// Coulomb friction. Errors: `mu` not finite or negative.
    pub fn coulomb(mu: f64) -> Result<Self, ParameterError> {
        Self::Coulomb { mu }.validated()
    }

    /// Stick-slip friction. Errors: a value not finite or negative, or `mu_s < mu_d`.
    pub fn stiction(mu_s: f64, mu_d: f64) -> Result<Self, ParameterError> {
        Self::Stiction { mu_s, mu_d }.validated()
    }

    /// Viscous friction. Errors: a value not finite or negative.
    pub fn viscous(mu_v_s_per_m: f64) -> Result<Self, ParameterError> {
        Self::Viscous { mu_v_s_per_m }.validated()
    }

    /// Coulomb plus viscous friction. Errors: a value not finite or negative.
    pub fn coulomb_viscous(mu: f64, mu_v_s_per_m: f64) -> Result<Self, ParameterError> {
        Self::CoulombViscous { mu, mu_v_s_per_m }.validated()
    }

    /// Stribeck friction: see [`Stribeck::new`].
    pub fn stribeck(mu_s: f64, mu_d: f64, v_s_m_s: f64, mu_v_s_per_m: f64) -> Result<Self, ParameterError> {
        Stribeck::new(mu_s, mu_d, v_s_m_s, mu_v_s_per_m).map(Self::Stribeck)
    }

    /// Friction drawn against speed (m/s), with `mu_s` at rest: see [`FrictionCurve::new`].
    pub fn curve(mu_s: f64, points: &[(f64, f64)]) -> Result<Self, ParameterError> {
        FrictionCurve::new(mu_s, points).map(Self::Curve)
    }

    /// Karnopp's friction: see [`Karnopp::new`].
    pub fn karnopp(mu_s: f64, mu_d: f64, v_min_m_s: f64, mu_v_s_per_m: f64) -> Result<Self, ParameterError> {
        Karnopp::new(mu_s, mu_d, v_min_m_s, mu_v_s_per_m).map(Self::Karnopp)
    }

    /// Dahl's friction: see [`Dahl::new`].
    pub fn dahl(mu: f64) -> Result<Self, ParameterError> {
        Dahl::new(mu).map(Self::Dahl)
    }

    /// Hayward and Armstrong's friction: see [`HaywardArmstrong::new`].
    pub fn hayward_armstrong(mu: f64, stick_fraction: f64) -> Result<Self, ParameterError> {
        HaywardArmstrong::new(mu, stick_fraction).map(Self::HaywardArmstrong)
    }

    /// LuGre friction with the curve of [`Stribeck::new`]: see [`LuGre::new`].
    pub fn lugre(
        mu_s: f64,
        mu_d: f64,
        v_s_m_s: f64,
        mu_v_s_per_m: f64,
        damping_n_s_per_m: f64,
    ) -> Result<Self, ParameterError> {
        let steady = Stribeck::new(mu_s, mu_d, v_s_m_s, mu_v_s_per_m)?;
        LuGre::new(steady, damping_n_s_per_m).map(Self::LuGre)
    }

    /// Bristles: see [`Bristles::new`].
    pub fn bristle(mu: f64, bonds: usize, seed: u64) -> Result<Self, ParameterError> {
        Bristles::new(mu, bonds, seed).map(Self::Bristle)
    }

    /// The reset integrator: see [`ResetIntegrator::new`].
    pub fn reset_integrator(mu_s: f64, mu_d: f64, damping_n_s_per_m: f64) -> Result<Self, ParameterError> {
        ResetIntegrator::new(mu_s, mu_d, damping_n_s_per_m).map(Self::ResetIntegrator)
    }

    /// Friction of a fixed force: see [`FixedCone::new`].
    pub fn fixed_cone(friction_n: f64, static_n: Option<f64>) -> Result<Self, ParameterError> {
        FixedCone::new(friction_n, static_n).map(Self::FixedCone)
    }

    /// Somebody's own law.
    pub fn own(law: impl OwnLaw + 'static) -> Self {
        let law: Arc<dyn OwnLaw> = Arc::new(law);
        Self::Own(law.into())
    }

    /// The same friction, if its parameters are in range; for values built without a constructor.
    ///
    /// The models that are types of their own cannot be built with other ones.
    pub fn validated(self) -> Result<Self, ParameterError> {
        match self {
            Self::Coulomb { mu } => _ = at_least_zero("mu", mu)?,
            Self::Stiction { mu_s, mu_d } => static_at_least(mu_s, mu_d)?,
            Self::Viscous { mu_v_s_per_m } => _ = at_least_zero("mu_v_s_per_m", mu_v_s_per_m)?,
            Self::CoulombViscous { mu, mu_v_s_per_m } => {
                at_least_zero("mu", mu)?;
                at_least_zero("mu_v_s_per_m", mu_v_s_per_m)?;
            }
            _ => {}
        }
        Ok(self)
    }

    /// Radius of the circle that holds the god-object (m), with the normal force over the stiffness as load (m): while a
    /// contact sticks, it lies within this of the HIP's foot on its tangent plane. `None`: somebody's own law, which may go
    /// by what it remembers.
    pub fn circle_m(&self, load_m: f64, stiffness_n_per_m: f64) -> Option<f64> {
        let query = FrictionQuery { load_m, stiffness_n_per_m, ..FrictionQuery::default() };
        let is_own = matches!(self, Self::Own(_));
        (!is_own).then(|| self.held_limit_m(&query, &FrictionMemory::default()))
    }

    /// The models that are given by coefficients alone.
    fn classical(&self) -> Classical {
        match *self {
            Self::Coulomb { mu } => Classical::smooth(mu, 0.0),
            Self::Stiction { mu_s, mu_d } => Classical::stiction(mu_s, mu_d),
            Self::Viscous { mu_v_s_per_m } => Classical::smooth(0.0, mu_v_s_per_m),
            Self::CoulombViscous { mu, mu_v_s_per_m } => Classical::smooth(mu, mu_v_s_per_m),
            _ => Classical::smooth(0.0, 0.0),
        }
    }
}

/// Asks the law behind the name, without a call through a table.
macro_rules! ask {
    ($friction:expr, $law:ident => $answer:expr) => {
        match $friction {
            Friction::Stribeck($law) => $answer,
            Friction::Curve($law) => $answer,
            Friction::Karnopp($law) => $answer,
            Friction::Dahl($law) => $answer,
            Friction::HaywardArmstrong($law) => $answer,
            Friction::LuGre($law) => $answer,
            Friction::Bristle($law) => $answer,
            Friction::ResetIntegrator($law) => $answer,
            Friction::FixedCone($law) => $answer,
            Friction::Own($law) => $answer,
            classical => {
                let $law = classical.classical();
                $answer
            }
        }
    };
}

impl FrictionLaw for Friction {
    fn holds(&self, query: &FrictionQuery, memory: &mut FrictionMemory) -> bool {
        ask!(self, law => law.holds(query, memory))
    }

    fn slide(&self, query: &FrictionQuery, memory: &FrictionMemory) -> f64 {
        ask!(self, law => law.slide(query, memory))
    }

    fn held_limit_m(&self, query: &FrictionQuery, memory: &FrictionMemory) -> f64 {
        ask!(self, law => law.held_limit_m(query, memory))
    }

    fn drags(&self) -> bool {
        match self {
            Self::LuGre(_) | Self::ResetIntegrator(_) => true,
            Self::Own(law) => law.drags(),
            _ => false,
        }
    }

    fn drag_m(&self, query: &FrictionQuery, memory: &FrictionMemory) -> f64 {
        ask!(self, law => law.drag_m(query, memory))
    }
}
