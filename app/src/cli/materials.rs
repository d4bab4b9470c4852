//! `phantom3 materials`.

use crate::outputs;
use haptics::Material;
use std::fmt::Write;

/// What `material = "..."` of an entity stands for, a line each.
pub(super) fn print_materials() {
    let mut out = String::new();
    // A string takes everything.
    let _ = writeln!(
        out,
        "{:<10} {:>5} {:>5} {:>14} {:>15} {:>14}  source of the friction; of the density",
        "material", "mu_s", "mu_d", "stiffness N/m", "damping N s/m", "density kg/m3"
    );
    for made_of in Material::ALL {
        let Material { name, mu_s, mu_d, stiffness_n_per_m, damping_n_s_per_m, source, .. } = made_of;
        let (density_kg_m3, density_source) = (made_of.density_kg_m3, made_of.density_source);
        let _ = writeln!(
            out,
            "{name:<10} {mu_s:>5.2} {mu_d:>5.2} {stiffness_n_per_m:>14.0} {damping_n_s_per_m:>15.1} \
             {density_kg_m3:>14.0}  {source}; density: {density_source}"
        );
    }
    let _ = writeln!(out, "Friction is that of a dry fingertip; all of stiffness and damping is a choice.");
    outputs::print(&out);
}
