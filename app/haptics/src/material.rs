//! What well-known materials feel like: friction against a fingertip, and how firmly and calmly they are rendered.
//!
//! Friction: the coefficient of skin against a material depends on load, moisture, cleanliness and person by a factor
//! of two and more; the published values are means. Each study gives one number, static or sliding. The other one is
//! a choice of ours throughout: sliding is 0.8 of static, rounded to two digits. A value without a study is said to be a
//! choice.
//! Density: of one kind of the material, or the middle of a published range; it gives what moves a mass. How much of a bounce
//! comes back is no property of a material: it depends on the partner, on the shape and above all on the speed, and falls from
//! near 1 as soon as anything yields. So there is no number for it here.
//! Torsional and rolling friction between entities: choices of ours, larger for what is softer.
//! Stiffness and damping: all of them choices of ours. No desktop device tells aluminium from glass by stiffness: what is hard is
//! as stiff as the device renders stably without damping at 1 kHz (`Limits::stiffness_n_per_m`), and what is
//! softer comes below it, in an order that felt right, not in proportion to any modulus.
//!
//! References:
//! - Buchholz, Frederick, Armstrong, *An investigation of human palmar skin friction and the effects of materials, pinch
//!   force and moisture*, Ergonomics 31(3), 1988: static, two-finger pinch of 20 and 39 N, seven people.
//! - Seo and others, *Friction coefficients in a longitudinal direction between the finger pad and
//!   selected materials for different normal forces and curvatures*, Ergonomics 52(5), 2009: sliding, 1 to 20 N.
//! - Savescu, Latash, Zatsiorsky, *A technique to determine friction at the fingertips*, J. Applied Biomechanics 24(1),
//!   2008: sliding, 4 N.
//! - Gott, Byrne, *Measuring the haptic characteristics of various wood finishes*, J. Experimental Secondary
//!   Science 3(1), 2013.
//! - Derler, Gerhardt, *Tribology of skin: review and analysis of experimental results for the friction coefficient of
//!   human skin*, Tribology Letters 45, 2012: dry skin against smooth and rough solids is typically 0.5.
//! - *CRC Handbook of Chemistry and Physics*, table "Density of various solids": ice, paper (0.7 to 1.15), oak (0.60 to 0.90), dry
//!   leather, soft commercial rubber.
//! - OpenStax, *College Physics*, table 11.1: aluminium, steel, common glass in the mean.
//! - ICRP Publication 110, *Adult Reference Computational Phantoms*, 2009: skin.
//! - Polyurethane Foam Association, *InTouch* 1(2): most uses of foam have 0.9 to 2.5 lb/ft3.

use crate::error::ParameterError;
use crate::friction::Friction;

/// How a material feels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// Its name in a scene.
    pub name: &'static str,
    /// Static friction against a dry fingertip.
    pub mu_s: f64,
    /// Sliding friction against a dry fingertip.
    pub mu_d: f64,
    /// How stiff it is rendered (N/m).
    pub stiffness_n_per_m: f64,
    /// How calmly (N s/m).
    pub damping_n_s_per_m: f64,
    /// Where the friction is from.
    pub source: &'static str,
    /// How heavy it is (kg/m^3).
    pub density_kg_m3: f64,
    /// Where the density is from.
    pub density_source: &'static str,
    /// Torque per normal force that its contacts with other entities resist, about the normal and across it (m).
    pub turning_friction_m: f64,
}

impl Material {
    /// All there are.
    pub const ALL: [Self; 12] = [
        // Seo et al.: mean of sliding at 1 to 20 N. (Buchholz et al., static at 20 N and more: 0.38.)
        Self::of("aluminium", 0.75, 0.60, HARD, SEO, (2700.0, OPENSTAX)),
        // The review's typical value for dry skin.
        Self::of("steel", 0.62, 0.50, HARD, DERLER, (7800.0, OPENSTAX)),
        // Between the review's dry 0.5 and moist > 1: smooth glass soon has the skin's own moisture under it.
        Self::of("glass", 0.88, 0.70, HARD, OURS, (2600.0, OPENSTAX)),
        // Low, as everybody knows of wet ice; nobody seems to have measured fingertips on it.
        Self::of("ice", 0.06, 0.05, HARD, OURS, (917.0, CRC)),
        // Gott, Byrne: the least static value, of raw wood; lacquered in gloss up to ten times as much.
        Self::of("wood", 0.46, 0.37, (900.0, 1.0), GOTT, (750.0, CRC)),
        // Buchholz et al., dry (moist 0.42). As it lies on a table.
        Self::of("paper", 0.27, 0.22, (800.0, 1.0), BUCHHOLZ, (925.0, CRC)),
        // Buchholz et al.: suede, dry (moist 0.66).
        Self::of("leather", 0.39, 0.31, (600.0, 1.5), BUCHHOLZ, (860.0, CRC)),
        // Buchholz et al.: smooth vinyl, dry and moist.
        Self::of("vinyl", 0.53, 0.42, (600.0, 1.5), BUCHHOLZ, (1300.0, OURS)),
        // Seo et al.: mean of four rubber hoses, sliding at 1 to 20 N.
        Self::of("rubber", 1.12, 0.90, (400.0, 2.0), SEO, (1100.0, CRC)),
        // Savescu et al., at 4 N. (Buchholz et al., static at 20 N and more, grit 320: 0.61.)
        Self::of("sandpaper", 1.20, 0.96, (900.0, 1.0), SAVESCU, (1500.0, OURS)),
        // Skin on skin.
        Self::of("skin", 0.62, 0.50, (250.0, 1.5), OURS, (1090.0, ICRP)),
        // Dry upholstery foam.
        Self::of("foam", 0.62, 0.50, (120.0, 1.0), OURS, (30.0, PFA)),
    ];

    /// Their names, in the same order.
    pub const NAMES: [&'static str; Self::ALL.len()] = {
        let mut names = [""; Self::ALL.len()];
        let mut i = 0;
        while i < names.len() {
            names[i] = Self::ALL[i].name;
            i += 1;
        }
        names
    };

    /// The one of this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        const ALL: &[Material] = &Material::ALL;
        ALL.iter().find(|material| material.name == name)
    }

    /// Its friction.
    ///
    /// Errors: none for those of the table.
    pub fn friction(&self) -> Result<Friction, ParameterError> {
        Friction::stiction(self.mu_s, self.mu_d)
    }

    const fn of(
        name: &'static str,
        mu_s: f64,
        mu_d: f64,
        (stiffness_n_per_m, damping_n_s_per_m): (f64, f64),
        source: &'static str,
        (density_kg_m3, density_source): (f64, &'static str),
    ) -> Self {
        Self {
            name,
            mu_s,
            mu_d,
            stiffness_n_per_m,
            damping_n_s_per_m,
            source,
            density_kg_m3,
            density_source,
            // The softer it feels, the larger the patch: from a tenth of a millimetre to one.
            turning_friction_m: if stiffness_n_per_m >= HARD.0 {
                1e-4
            } else if stiffness_n_per_m >= 600.0 {
                2e-4
            } else if stiffness_n_per_m >= 250.0 {
                5e-4
            } else {
                1e-3
            },
        }
    }
}

/// Stiffness (N/m) and damping (N s/m) of what does not give way.
const HARD: (f64, f64) = (1000.0, 1.0);

const SEO: &str = "mu_d: Seo et al. 2009, Ergonomics 52(5); mu_s: choice";
const DERLER: &str = "mu_d: Derler, Gerhardt 2012, Tribology Letters 45, typical of dry skin; mu_s: choice";
const GOTT: &str = "mu_s: Gott, Byrne 2013, raw wood; mu_d: choice";
const BUCHHOLZ: &str = "mu_s: Buchholz et al. 1988, Ergonomics 31(3); mu_d: choice";
const SAVESCU: &str = "mu_d: Savescu et al. 2008, J. Applied Biomechanics 24(1); mu_s: choice";
const CRC: &str = "CRC Handbook";
const OPENSTAX: &str = "OpenStax College Physics";
const ICRP: &str = "ICRP 110";
const PFA: &str = "PFA InTouch 1(2)";
const OURS: &str = "choice";
