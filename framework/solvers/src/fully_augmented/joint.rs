//! A hinge between two bodies at a state: the motions that it permits, and those that it forbids.
//!
//! Quantities are about the body's centre of mass c, in world axes; p is the origin of the frame in which a subhinge starts, and A = [ω̇; c̈]:
//! ```text
//! A − φ* A_parent = H θ̈ + b
//! pin     H = [h; h × (c − p)]       b: ω̇ += ω × h θ̇
//! slider  H = [0; h]                    c̈ += ω̇ × d + ω × (ω × d) + 2 ω × h θ̇,   d = h θ
//! ball    H = [R; R × (c − p)]          ω̇ += ω × R β
//! free    both, d in the frame before and rates in the one behind
//! H_f = Q R                             free coordinates without rotors
//! N* (A − φ* A_parent − H_a θ̈_a) = N* (H_p θ̈_p + b)      N across Q: the rows
//! ```
//! θ̈_a are coordinates with rotors: unknowns with separate inertia I_a. θ̈_p are prescribed.

use super::bodies::{State, join};
use linkwork_multibody::{Body, Coordinate, SubhingeKind};
use linkwork_spatial::nalgebra::Vector6;
use linkwork_spatial::{Mat3, Pose, Vec3};

type V6 = Vector6<f64>;

/// Columns whose independent part is relatively smaller than this count as dependent.
const DEPENDENT: f64 = 1e-9;

/// Treatment of a coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Role {
    Plain,
    /// Has the inertia of its rotor.
    Rotor(f64),
    Prescribed(f64),
}

/// Q, R of up to six columns, and the orthogonal complement.
#[derive(Clone, Debug, Default)]
pub(super) struct Basis {
    pub n: usize,
    pub Q: [V6; 6],
    R: [[f64; 6]; 6],
}

impl Basis {
    /// Factors the columns. Returns false if one depends on the others.
    pub fn fill(&mut self, columns: impl Iterator<Item = V6>) -> bool {
        self.n = 0;
        self.R = [[0.0; 6]; 6];
        for column in columns {
            let n = self.n;
            if n == 6 {
                return false;
            }
            let mut rest = column;
            // Two passes of orthogonalization are enough.
            for _ in 0..2 {
                for i in 0..n {
                    let along = self.Q[i].dot(&rest);
                    rest -= self.Q[i] * along;
                    self.R[i][n] += along;
                }
            }
            let size = rest.norm();
            if !(size > DEPENDENT * column.norm()) {
                return false;
            }
            (self.R[n][n], self.Q[n]) = (size, rest / size);
            self.n += 1;
        }
        true
    }

    /// Computes the rest of the six directions, in `Q[n..]`.
    pub fn complete(&mut self) {
        for k in self.n..6 {
            let (mut best, mut size) = (V6::zeros(), 0.0);
            for e in 0..6 {
                let mut rest = V6::zeros();
                rest[e] = 1.0;
                for _ in 0..2 {
                    for q in &self.Q[..k] {
                        rest -= q * q.dot(&rest);
                    }
                }
                if rest.norm() > size {
                    (best, size) = (rest, rest.norm());
                }
            }
            self.Q[k] = best / size;
        }
    }

    /// Computes x = R⁻¹ Q* y: the coordinates of y in the span of the columns.
    pub fn coordinates(&self, y: &V6) -> [f64; 6] {
        let mut x = [0.0; 6];
        for i in (0..self.n).rev() {
            let known: f64 = (i + 1..self.n).map(|j| self.R[i][j] * x[j]).sum();
            x[i] = (self.Q[i].dot(y) - known) / self.R[i][i];
        }
        x
    }

    /// Computes w = Q R⁻* x: the wrench within the span that does work x on the columns.
    pub fn wrench(&self, x: &[f64; 6]) -> V6 {
        let (mut y, mut w) = ([0.0; 6], V6::zeros());
        for i in 0..self.n {
            let known: f64 = (0..i).map(|j| self.R[j][i] * y[j]).sum();
            y[i] = (x[i] - known) / self.R[i][i];
            w += self.Q[i] * y[i];
        }
        w
    }
}

/// A moving hinge and its indices among bodies and coordinates.
#[derive(Clone, Debug)]
pub(super) struct Joint {
    /// Group that it carries, and its parent group (`None`: the world).
    pub child: usize,
    pub parent: Option<usize>,
    /// Index of the body in the mechanism, and of its parent.
    pub body: usize,
    pub v: usize,
    pub roles: Vec<Role>,
    /// Columns H, and the bias b.
    pub H: Vec<V6>,
    pub b: V6,
    /// Basis of plain coordinates, completed by the rows N.
    pub plain: Basis,
    /// Basis of all coordinates, if couplings need them.
    pub all: Basis,
    pub coupled: bool,
    /// Torques of plain coordinates as a wrench; later the whole wrench on the child.
    pub torque: V6,
}

impl Joint {
    pub fn new(body: &Body, place: usize, child: usize, parent: Option<usize>) -> Self {
        let role = |s: &linkwork_multibody::SubhingeRange| {
            let inertia = s.subhinge.reflected_inertia();
            match s.subhinge.coordinate {
                Coordinate::Prescribed => Role::Prescribed(inertia),
                Coordinate::Free if inertia > 0.0 => Role::Rotor(inertia),
                Coordinate::Free => Role::Plain,
            }
        };
        let roles: Vec<Role> =
            (body.subhinges().iter()).flat_map(|s| s.v.clone().map(move |_| role(s))).collect();
        Self {
            child,
            parent,
            body: place,
            v: body.v().start,
            H: vec![V6::zeros(); roles.len()],
            roles,
            b: V6::zeros(),
            plain: Basis::default(),
            all: Basis::default(),
            coupled: false,
            torque: V6::zeros(),
        }
    }

    /// Returns the number of rows that it forbids.
    pub fn rows(&self) -> usize {
        6 - self.roles.iter().filter(|r| **r == Role::Plain).count().min(6)
    }

    /// Returns the directions of the rows.
    pub fn N(&self) -> &[V6] {
        &self.plain.Q[self.plain.n..]
    }

    /// Computes H, b and N at a state. `parent` is the pose of the parent body. Returns false if its free axes are dependent.
    pub fn place(
        &mut self,
        body: &Body,
        parent: &Pose,
        (from, to): (&State, &State),
        (q, v): (&[f64], &[f64]),
    ) -> bool {
        let start = *parent * body.hinge_in_parent();
        let (mut R, mut p) = (start.rotation, start.position);
        let (mut w, mut alpha) = (from.w, Vec3::zeros());
        let mut a = w.cross(&w.cross(&(p - from.c)));
        let mut at = 0;
        for s in body.subhinges() {
            let (q, v) = (&q[s.q.clone()], &v[s.v.clone()]);
            let X = s.subhinge.kind.pose(q);
            // The quantities are the displacement of the origin, its rate relative to the frame,
            // and the rotation.
            let d = R * X.position;
            let (u, turn, extra) = match s.subhinge.kind {
                SubhingeKind::Locked => continue,
                SubhingeKind::Pin { axis } => (Vec3::zeros(), R * axis * v[0], Vec3::zeros()),
                SubhingeKind::Slider { axis } => (R * axis * v[0], Vec3::zeros(), Vec3::zeros()),
                SubhingeKind::Screw { axis, pitch } => {
                    (R * axis * (pitch * v[0]), R * axis * v[0], Vec3::zeros())
                }
                SubhingeKind::Ball => {
                    let turn = R * (X.rotation * Vec3::new(v[0], v[1], v[2]));
                    (Vec3::zeros(), turn, Vec3::zeros())
                }
                SubhingeKind::Free => {
                    let behind = R * X.rotation;
                    let turn = behind * Vec3::new(v[0], v[1], v[2]);
                    let u = behind * Vec3::new(v[3], v[4], v[5]);
                    (u, turn, turn.cross(&u))
                }
            };
            a += alpha.cross(&d) + w.cross(&w.cross(&d)) + 2.0 * w.cross(&u) + extra;
            alpha += w.cross(&turn);
            w += turn;
            p += d;
            let before = R;
            R *= X.rotation;
            let axes = match s.subhinge.kind.axis() {
                Some(axis) => before * axis,
                None => Vec3::zeros(),
            };
            at += columns(
                &s.subhinge.kind,
                &axes,
                &R.to_rotation_matrix().into_inner(),
                &(to.c - p),
                &mut self.H[at..],
            );
        }
        let r = to.c - p;
        a += alpha.cross(&r) + w.cross(&w.cross(&r));
        self.b = join(&alpha, &a);
        let (H, roles) = (&self.H, &self.roles);
        let plain = H.iter().zip(roles).filter(|(_, r)| **r == Role::Plain).map(|(h, _)| *h);
        let sound = self.plain.fill(plain);
        self.plain.complete();
        sound && (!self.coupled || self.all.fill(H.iter().copied()))
    }
}

/// Writes the columns of one subhinge. Returns their number.
fn columns(kind: &SubhingeKind, h: &Vec3, R: &Mat3, r: &Vec3, out: &mut [V6]) -> usize {
    let turn = |h: Vec3| join(&h, &h.cross(r));
    match kind {
        SubhingeKind::Pin { .. } => out[0] = turn(*h),
        SubhingeKind::Slider { .. } => out[0] = join(&Vec3::zeros(), h),
        SubhingeKind::Screw { pitch, .. } => {
            out[0] = turn(*h) + join(&Vec3::zeros(), &(h * *pitch));
        }
        SubhingeKind::Ball | SubhingeKind::Free => {
            for (j, axis) in R.column_iter().enumerate() {
                let axis = axis.into_owned();
                out[j] = turn(axis);
                if *kind == SubhingeKind::Free {
                    out[3 + j] = join(&Vec3::zeros(), &axis);
                }
            }
        }
        SubhingeKind::Locked => {}
    }
    kind.nv()
}
