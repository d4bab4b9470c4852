//! Depths of a ball at several places of a mesh, shared: what presses twice in one direction counts once.

use super::PATCH_POINTS;
use super::mesh::Contact;

/// Takes from each depth what the others' normals share of it: afterwards the depths `l` are such that what presses along
/// each normal is what its own depth `d` was, `l_i + sum c_ij l_j = d_i`, or they are zero and there is more.
pub(super) fn share(contacts: &mut [Contact]) {
    let count = contacts.len().min(PATCH_POINTS);
    if contacts.iter().filter(|contact| contact.gap_m < 0.0).count() < 2 {
        return;
    }
    let (mut depths, mut cosines) = ([0.0; PATCH_POINTS], [[0.0; PATCH_POINTS]; PATCH_POINTS]);
    for i in 0..count {
        depths[i] = -contacts[i].gap_m;
        for j in 0..count {
            cosines[i][j] = contacts[i].normal_M.dot(&contacts[j].normal_M).max(0.0);
        }
        cosines[i][i] = 1.0 + STIFF;
    }
    let mut carries = [false; PATCH_POINTS];
    (0..count).for_each(|i| carries[i] = depths[i] > 0.0);
    let mut loads = [0.0; PATCH_POINTS];
    for _ in 0..SHARE_ROUNDS {
        loads = solve(&cosines, &depths, &carries);
        // Who would pull carries nothing; who is pressed more than the others' loads explain carries again.
        let least = (0..count).filter(|&i| carries[i]).min_by(|&i, &j| loads[i].total_cmp(&loads[j]));
        if let Some(least) = least.filter(|&least| loads[least] < 0.0) {
            carries[least] = false;
            continue;
        }
        let missing = |i: usize| depths[i] - (0..count).map(|j| cosines[i][j] * loads[j]).sum::<f64>();
        let most = (0..count).filter(|&i| !carries[i]).max_by(|&i, &j| missing(i).total_cmp(&missing(j)));
        match most.filter(|&most| missing(most) > 1e-12 * depths[most].abs()) {
            Some(most) => carries[most] = true,
            None => break,
        }
    }
    for (i, contact) in contacts.iter_mut().enumerate().take(count) {
        (contact.gap_m, contact.share) = match carries[i] {
            true => (-loads[i].max(0.0), loads[i].max(0.0) / depths[i]),
            false => (contact.gap_m.max(0.0), 1.0),
        };
    }
}

/// Loads of those that carry, which take their depths together; by elimination: the matrix is positive definite.
fn solve(
    cosines: &[[f64; PATCH_POINTS]; PATCH_POINTS],
    depths: &[f64; PATCH_POINTS],
    carries: &[bool; PATCH_POINTS],
) -> [f64; PATCH_POINTS] {
    let (mut m, mut loads) = (*cosines, *depths);
    for i in (0..PATCH_POINTS).filter(|&i| carries[i]) {
        for j in (i + 1..PATCH_POINTS).filter(|&j| carries[j]) {
            let factor = m[j][i] / m[i][i];
            (i..PATCH_POINTS).for_each(|k| m[j][k] -= factor * m[i][k]);
            loads[j] -= factor * loads[i];
        }
    }
    for i in (0..PATCH_POINTS).rev() {
        if !carries[i] {
            loads[i] = 0.0;
            continue;
        }
        let others: f64 = (i + 1..PATCH_POINTS).filter(|&j| carries[j]).map(|j| m[i][j] * loads[j]).sum();
        loads[i] = (loads[i] - others) / m[i][i];
    }
    loads
}

/// Of what shares of a depth cannot be told apart to rounding, each gets the same.
const STIFF: f64 = 1e-9;
/// Each changes who carries by one.
const SHARE_ROUNDS: usize = 16;
