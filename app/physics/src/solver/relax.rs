//! Contact points one by one: slow, and nearer whatever they are.

use super::Motion;
use super::equations::Equations;
use crate::row::Row;

/// Projected Gauss-Seidel: each point in turn goes as far to what its velocity asks for, along the normal and across it, as it
/// may if that is to lessen what is left, and stays in its cone. Bodies move as the rows' forces have them move.
pub(super) fn turns(equations: &Equations<'_>, rows: &mut [Row], moving: &mut [Motion], turns: usize) {
    let dt_s = equations.dt_s;
    for link in (0..turns).flat_map(|_| equations.links) {
        let row = &mut rows[link.row];
        let most_give = link.most_give;
        let [along, across] = row.falls(dt_s).map(|falls| 1.0 / (1.0 + falls * most_give * dt_s));
        let missing_W = row.trial_at_end_W(&link.velocity_W(row, moving), dt_s) - row.force_W;
        let missing_n = row.normal_W.dot(&missing_W);
        let wanted_W = row.force_W + missing_W * across + row.normal_W * (missing_n * (along - across));
        let change_W = row.project(&wanted_W) - row.force_W;
        row.force_W += change_W;
        link.push(row, &(change_W * dt_s), moving);
        if row.has_torque() {
            let presses_n = row.presses_n(&row.force_W);
            let asked_nm = row.turning_at_end(&link.spin_W(moving), dt_s, presses_n).0;
            let share = 1.0 / (1.0 + row.torsion.falls(dt_s) * link.turn_about(row, moving) * dt_s);
            let change_nm = (asked_nm - row.torsion.torque_nm) * share;
            row.torsion.torque_nm += change_nm;
            link.turn(&(row.normal_W * (change_nm * dt_s)), moving);
            let asked_W = row.turning_at_end(&link.spin_W(moving), dt_s, presses_n).1;
            let share = 1.0 / (1.0 + row.rolling.falls(dt_s) * link.most_turn * dt_s);
            let change_W = (asked_W - row.rolling.torque_W) * share;
            row.rolling.torque_W += change_W;
            link.turn(&(change_W * dt_s), moving);
        }
    }
}
