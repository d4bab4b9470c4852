//! Where two convex cores are nearest to each other.
//!
//! Model: the difference of all pairs of their points is convex, too, and its point nearest to the origin is their
//! distance (E. Gilbert, D. Johnson, S. Keerthi, *A fast procedure for computing the distance between complex objects in
//! three-dimensional space*). A simplex of its farthest points closes in on that point; where flat pieces lie opposite to
//! each other it is found exactly, on curved ones to the root of rounding.
//! Cost: at most [`MAX_ROUNDS`] farthest points of each; three to six between polyhedra.

use nalgebra::Vector3;

use super::convex::Convex;

/// Two cores, the first moved by `shift`.
pub(super) struct Gap<'c> {
    pub(super) a: &'c Convex<'c>,
    pub(super) b: &'c Convex<'c>,
    pub(super) shift: Vector3<f64>,
}

/// The nearest points.
#[derive(Debug, Clone, Copy)]
pub(super) struct Nearest {
    /// From B's to A's, with the shift.
    pub(super) away: Vector3<f64>,
    /// A's, without the shift.
    pub(super) on_a: Vector3<f64>,
}

/// Bound on the search.
const MAX_ROUNDS: usize = 40;
/// A distance that can become less only by this share of itself is found.
const FOUND: f64 = 1e-8;

/// A point of the difference, and A's of which it is one.
#[derive(Debug, Clone, Copy, Default)]
struct Vertex {
    difference: Vector3<f64>,
    on_a: Vector3<f64>,
}

/// Up to four vertices, and the shares of which the point nearest to the origin is made.
#[derive(Debug, Clone, Copy, Default)]
struct Simplex {
    vertices: [Vertex; 4],
    shares: [f64; 4],
    count: usize,
    nearest: Vector3<f64>,
}

impl Gap<'_> {
    fn vertex(&self, away: &Vector3<f64>) -> Vertex {
        let on_a = self.a.support(&-away);
        Vertex { difference: on_a + self.shift - self.b.support(away), on_a }
    }

    /// `None` if they overlap, or come nearer than `least_m`.
    pub(super) fn nearest(&self, start: &Vector3<f64>, least_m: f64) -> Option<Nearest> {
        let mut simplex = Simplex::of(self.vertex(start));
        let mut best = simplex;
        for _ in 0..MAX_ROUNDS {
            let v = simplex.nearest;
            let squared = v.norm_squared();
            if squared <= least_m * least_m || simplex.count == 4 {
                return None;
            }
            best = simplex;
            let vertex = self.vertex(&v);
            if squared - v.dot(&vertex.difference) <= FOUND * squared || simplex.holds(&vertex) {
                break;
            }
            simplex = simplex.with(vertex);
            if simplex.nearest.norm_squared() >= squared && simplex.count < 4 {
                break;
            }
        }
        Some(Nearest { away: best.nearest, on_a: best.on_a() })
    }
}

impl Simplex {
    fn of(vertex: Vertex) -> Self {
        let mut simplex = Self { count: 1, nearest: vertex.difference, ..Self::default() };
        simplex.vertices[0] = vertex;
        simplex.shares[0] = 1.0;
        simplex
    }

    fn holds(&self, vertex: &Vertex) -> bool {
        self.vertices[..self.count].iter().any(|other| other.difference == vertex.difference)
    }

    fn on_a(&self) -> Vector3<f64> {
        let parts = self.vertices.iter().zip(&self.shares).take(self.count);
        parts.map(|(vertex, share)| vertex.on_a * *share).sum()
    }

    /// The part of it and another vertex that is nearest to the origin; four vertices: the origin is within.
    fn with(&self, vertex: Vertex) -> Self {
        let [a, b, c, _] = self.vertices;
        match self.count {
            1 => Self::segment(vertex, a),
            2 => Self::triangle([vertex, a, b]),
            _ => Self::tetrahedron([vertex, a, b, c]),
        }
    }

    fn pick(vertices: &[Vertex], shares: &[f64]) -> Self {
        let mut simplex = Self::default();
        for (vertex, share) in vertices.iter().zip(shares) {
            simplex.vertices[simplex.count] = *vertex;
            simplex.shares[simplex.count] = *share;
            simplex.nearest += vertex.difference * *share;
            simplex.count += 1;
        }
        simplex
    }

    fn segment(a: Vertex, b: Vertex) -> Self {
        let along = b.difference - a.difference;
        let part = -a.difference.dot(&along) / along.norm_squared();
        if part.is_nan() || part <= 0.0 {
            Self::of(a)
        } else if part >= 1.0 {
            Self::of(b)
        } else {
            Self::pick(&[a, b], &[1.0 - part, part])
        }
    }

    fn triangle(corners: [Vertex; 3]) -> Self {
        let [a, b, c] = corners.map(|corner| corner.difference);
        let normal = (b - a).cross(&(c - a));
        let squared = normal.norm_squared();
        // Shares of the foot of the perpendicular.
        let share = |p: &Vector3<f64>, q: &Vector3<f64>| p.cross(q).dot(&normal) / squared;
        let shares = [share(&b, &c), share(&c, &a), share(&a, &b)];
        if shares.iter().all(|share| *share > 0.0) {
            let sum: f64 = shares.iter().sum();
            let foot = normal * (normal.dot(&a) / squared);
            return Self { nearest: foot, ..Self::pick(&corners, &shares.map(|share| share / sum)) };
        }
        let sides = [(0, 1), (0, 2), (1, 2)].map(|(i, j)| Self::segment(corners[i], corners[j]));
        Self::nearest_of(&sides)
    }

    fn tetrahedron(corners: [Vertex; 4]) -> Self {
        let mut faces = [Self::default(); 4];
        let mut count = 0;
        for (left_out, face) in [(3, [0, 1, 2]), (2, [0, 1, 3]), (1, [0, 2, 3]), (0, [1, 2, 3])] {
            let [a, b, c] = face.map(|i| corners[i].difference);
            let normal = (b - a).cross(&(c - a));
            let (inner, origin) = (normal.dot(&(corners[left_out].difference - a)), -normal.dot(&a));
            // Beyond this face, or the four lie in a plane.
            if inner * origin <= 0.0 {
                faces[count] = Self::triangle(face.map(|i| corners[i]));
                count += 1;
            }
        }
        if count == 0 {
            return Self { vertices: corners, count: 4, ..Self::default() };
        }
        Self::nearest_of(&faces[..count])
    }

    fn nearest_of(parts: &[Self]) -> Self {
        let nearer = |a: &Self, b: &Self| a.nearest.norm_squared().total_cmp(&b.nearest.norm_squared());
        parts.iter().copied().min_by(nearer).unwrap_or_default()
    }
}
