//! A ball among walls, contact by contact: each with a friction cone of its own. Slow and obvious.
//!
//! The walls are half spaces in front of which the ball's centre C stays. The loads are those of the contacts without
//! friction, found wall by wall (Hildreth's method). Each contact takes what it can of the pull, along its own plane and
//! inside its own circle of `mu` times its own load; what all of them together leave over draws C straight on until a wall
//! is in the way. No common circle, no sum of loads and no direction that is free of all walls is put in.
#![allow(dead_code, non_snake_case)]

use nalgebra::Vector3;

/// In front: `normal . x >= offset`, of the ball's centre.
pub(crate) type Wall = (Vector3<f64>, f64);

/// What happens at a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cone {
    pub(crate) normal: Vector3<f64>,
    /// Over stiffness (m).
    pub(crate) load: f64,
    /// Tangential force on the user over stiffness (m).
    pub(crate) tangential: Vector3<f64>,
    wall: usize,
}

/// Friction coefficients of every wall.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Coefficients {
    pub(crate) to_hold: f64,
    pub(crate) to_slide: f64,
    /// Share of the sliding circle within which a slide ends.
    pub(crate) to_catch: f64,
}

/// A ball among walls.
#[derive(Debug, Clone)]
pub(crate) struct Cones {
    walls: Vec<Wall>,
    mu: Coefficients,
    /// Of each wall's contact.
    slides: Vec<bool>,
    last_hip: Option<Vector3<f64>>,
    pub(crate) centre: Option<Vector3<f64>>,
    pub(crate) pressed: Vec<Cone>,
}

impl Cones {
    pub(crate) fn new(walls: Vec<Wall>, mu: Coefficients) -> Self {
        let slides = vec![false; walls.len()];
        Self { walls, mu, slides, last_hip: None, centre: None, pressed: Vec::new() }
    }

    /// One tick; the force on the user over stiffness (m).
    pub(crate) fn step(&mut self, hip: &Vector3<f64>) -> Vector3<f64> {
        let last_hip = self.last_hip.replace(*hip).unwrap_or(*hip);
        self.pressed.clear();
        if self.walls.iter().all(|wall| height(wall, hip) >= 0.0) {
            self.centre = None;
            return Vector3::zeros();
        }
        let centre = self.centre.unwrap_or_else(|| {
            self.slides.fill(false);
            self.first_hit(&last_hip, &(hip - last_hip))
        });
        self.centre = Some(self.drawn(centre, hip));
        self.pressed.iter().map(|cone| cone.normal * cone.load + cone.tangential).sum()
    }

    fn drawn(&mut self, mut centre: Vector3<f64>, hip: &Vector3<f64>) -> Vector3<f64> {
        let mu = self.mu;
        let holds = |slides: bool| if slides { mu.to_catch * mu.to_slide } else { mu.to_hold };
        let left = self.share_out(&centre, hip, holds);
        if left.norm() <= self.rest() {
            self.slides.fill(false);
            return centre;
        }
        // Of all contacts, those that are met on the way too: each slides as far as the centre does.
        self.slides.fill(true);
        for _ in 0..MOST_MEETINGS {
            let left = self.share_out(&centre, hip, |_| mu.to_slide);
            if left.norm() <= self.rest() {
                break;
            }
            centre = self.first_hit(&centre, &left);
        }
        centre
    }

    /// Gives each contact its load and what its cone can take of the pull; what is left of the pull.
    fn share_out(
        &mut self,
        centre: &Vector3<f64>,
        hip: &Vector3<f64>,
        mu: impl Fn(bool) -> f64,
    ) -> Vector3<f64> {
        let (loads, nearest) = self.loads(centre, hip);
        let lag = centre - nearest;
        let sum: f64 = loads.iter().map(|(_, load)| load).sum();
        // Of all ways to share the pull out, that with the least sum of `t^2 / load`: by a multiplier.
        let (mut asked, mut felt) = (Vector3::zeros(), Vector3::repeat(f64::INFINITY));
        for _ in 0..MOST_SHARINGS {
            let cone = |&(wall, load): &(usize, f64)| {
                let normal = self.walls[wall].0;
                let along: Vector3<f64> = asked - normal * normal.dot(&asked);
                let shortened = along * (mu(self.slides[wall]) / along.norm()).min(1.0);
                Cone {
                    normal,
                    load,
                    tangential: if along == Vector3::zeros() { along } else { shortened * load },
                    wall,
                }
            };
            self.pressed = loads.iter().map(cone).collect();
            let before = std::mem::replace(&mut felt, self.pressed.iter().map(|cone| cone.tangential).sum());
            if (felt - before).norm() <= SMALLEST || sum == 0.0 {
                break;
            }
            asked += (lag - felt) / sum;
        }
        felt - lag
    }

    /// Of the walls that are touched, those which the HIP presses, without friction; where the centre would then be.
    fn loads(&self, centre: &Vector3<f64>, hip: &Vector3<f64>) -> (Vec<(usize, f64)>, Vector3<f64>) {
        let touched = (0..self.walls.len()).filter(|&i| height(&self.walls[i], centre) <= TOUCHING);
        let mut loads: Vec<_> = touched.map(|wall| (wall, 0.0)).collect();
        let mut nearest = *hip;
        for _ in 0..MOST_SWEEPS {
            let mut change = 0.0_f64;
            for (wall, load) in &mut loads {
                let wall = &self.walls[*wall];
                let more = (*load - height(wall, &nearest)).max(0.0) - *load;
                nearest += wall.0 * more;
                *load += more;
                change = change.max(more.abs());
            }
            // Without what rounding added up.
            nearest =
                hip + loads.iter().map(|(wall, load)| self.walls[*wall].0 * *load).sum::<Vector3<f64>>();
            if change <= 4.0 * SMALLEST {
                break;
            }
        }
        loads.retain(|(_, load)| *load > 0.0);
        (loads, nearest)
    }

    /// The end of a straight way, or where it meets a wall that is not touched yet.
    fn first_hit(&self, from: &Vector3<f64>, way: &Vector3<f64>) -> Vector3<f64> {
        let share = self.walls.iter().map(|wall| {
            let (before, after) = (height(wall, from), height(wall, &(from + way)));
            if before > TOUCHING && after < 0.0 { before / (before - after) } else { 1.0 }
        });
        from + way * share.fold(1.0, f64::min)
    }

    fn rest(&self) -> f64 {
        REST * self.pressed.iter().map(|cone| cone.load).sum::<f64>() + SMALLEST
    }
}

fn height((normal, offset): &Wall, x: &Vector3<f64>) -> f64 {
    normal.dot(x) - offset
}

/// Ten thousand roundings of positions of 0.1 m, and a hundredth of what the finger calls touching (m).
const TOUCHING: f64 = 1e-13;
/// A rounding of positions of 0.1 m (m).
const SMALLEST: f64 = 1e-17;
/// Ten times what the finger calls rest, against the load.
const REST: f64 = 1e-11;
const MOST_SWEEPS: usize = 100_000;
const MOST_SHARINGS: usize = 1000;
const MOST_MEETINGS: usize = 64;
