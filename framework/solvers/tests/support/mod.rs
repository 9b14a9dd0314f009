//! Contact problems for tests and benches: random ones, and small ones from mechanics.
#![allow(dead_code)]

#[path = "../../../../tests/common/splitmix.rs"]
mod splitmix;
use linkwork_solvers::contact::{Cone, Contact, Factor, Method, Problem, Report, Settings};
use splitmix::splitmix;

/// A problem that owns its data.
#[derive(Clone, Debug, Default)]
pub struct Case {
    pub start: Vec<u32>,
    pub dof: Vec<u32>,
    pub e: Vec<[f64; 4]>,
    pub dofs: usize,
    pub cones: Vec<Cone>,
    pub b: Vec<[f64; 4]>,
    pub r: Vec<[f64; 4]>,
}

impl Case {
    pub fn new(dofs: usize) -> Case {
        Case { dofs, start: vec![0], ..Case::default() }
    }

    /// A group with entries (dof, rows); zero entries are kept.
    pub fn add(&mut self, cone: Cone, entries: &[(usize, [f64; 4])], b: [f64; 4]) -> &mut Case {
        let mut entries = entries.to_vec();
        entries.sort_by_key(|e| e.0);
        self.dof.extend(entries.iter().map(|e| e.0 as u32));
        self.e.extend(entries.iter().map(|e| e.1));
        self.start.push(self.dof.len() as u32);
        self.cones.push(cone);
        self.b.push(b);
        self
    }

    pub fn problem(&self) -> Problem<'_> {
        let (start, dof, e) = (&self.start[..], &self.dof[..], &self.e[..]);
        let factor = Factor { start, dof, e, dofs: self.dofs };
        Problem::new(factor, &self.cones, &self.b, &self.r).unwrap()
    }

    /// Solves from a cold start.
    pub fn solve(&self, method: Method, tolerance: f64) -> (Vec<[f64; 4]>, Report) {
        let settings = Settings { method, tolerance, sweeps: 20_000, steps: 100, ..generous() };
        let mut lambda = vec![[0.0; 4]; self.cones.len()];
        let report = Contact::new(settings).solve(&self.problem(), &mut lambda).unwrap();
        (lambda, report)
    }

    /// y = Eᵀ λ.
    pub fn pulled(&self, lambda: &[[f64; 4]]) -> Vec<f64> {
        let mut y = vec![0.0; self.dofs];
        for (g, l) in lambda.iter().enumerate() {
            for i in self.start[g] as usize..self.start[g + 1] as usize {
                for k in 0..4 {
                    y[self.dof[i] as usize] += self.e[i][k] * l[k];
                }
            }
        }
        y
    }

    /// v = E Eᵀ λ + b + R λ.
    pub fn velocities(&self, lambda: &[[f64; 4]]) -> Vec<[f64; 4]> {
        let y = self.pulled(lambda);
        let mut v = self.b.clone();
        for g in 0..self.cones.len() {
            for i in self.start[g] as usize..self.start[g + 1] as usize {
                for k in 0..4 {
                    v[g][k] += self.e[i][k] * y[self.dof[i] as usize];
                }
            }
            for k in 0..4 {
                v[g][k] += self.r.get(g).map_or(0.0, |r| r[k] * lambda[g][k]);
            }
        }
        v
    }
}

pub fn generous() -> Settings {
    Settings::default()
}

/// Numbers from a seed: SplitMix64.
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        splitmix(&mut self.0)
    }
    /// In [−1, 1).
    pub fn number(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
    /// In [a, b).
    pub fn between(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * 0.5 * (self.number() + 1.0)
    }
    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }
}

/// b = E u for a random u, so that some y brings every row to rest and a solution exists: `groups` groups of the kinds given by `kind`, each on
/// `touched` of `dofs` degrees of freedom.
pub fn random(
    seed: u64,
    dofs: usize,
    groups: usize,
    touched: usize,
    kind: impl Fn(&mut Random, usize) -> Cone,
) -> Case {
    let mut rng = Random(seed);
    let mut case = Case::new(dofs);
    let u: Vec<f64> = (0..dofs).map(|_| rng.number()).collect();
    for g in 0..groups {
        let cone = kind(&mut rng, g);
        let mut free: Vec<usize> = (0..dofs).collect();
        let mut entries = Vec::new();
        for _ in 0..touched.min(dofs) {
            let d = free.swap_remove(rng.below(free.len()));
            let mut e = [0.0; 4];
            e[..cone.rows()].fill_with(|| rng.number());
            entries.push((d, e));
        }
        let mut b = [0.0; 4];
        for (d, e) in &entries {
            for k in 0..4 {
                b[k] += e[k] * u[*d];
            }
        }
        case.add(cone, &entries, b);
    }
    case
}

/// Every kind of group in turn; bounds and coefficients random.
pub fn mixed(rng: &mut Random, g: usize) -> Cone {
    match g % 5 {
        0 => Cone::Coulomb { friction: rng.between(0.1, 0.9) },
        1 => Cone::Equality { rows: 1 + g / 5 % 4 },
        2 => Cone::Unilateral,
        3 => Cone::Dry { bound: rng.between(0.05, 0.5) },
        _ => Cone::Spinning { friction: rng.between(0.1, 0.9), spin: rng.between(0.05, 0.3) },
    }
}

pub fn coulomb(rng: &mut Random, _: usize) -> Cone {
    Cone::Coulomb { friction: rng.between(0.2, 0.8) }
}

/// Cross product.
pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Free rigid bodies with diagonal inertia, for contacts between points of them.
pub struct Body {
    pub mass: f64,
    pub inertia: [f64; 3],
    pub place: [f64; 3],
    /// [ω; v] before the impulses.
    pub velocity: [f64; 6],
}

/// A contact at `p` between body `a` and body `b`, or the ground; the frame's first axis is the
/// normal, towards `a`. b = free velocity.
pub fn touch(
    case: &mut Case,
    bodies: &[Body],
    a: usize,
    b: Option<usize>,
    p: [f64; 3],
    frame: [[f64; 3]; 3],
    cone: Cone,
) {
    let (mut entries, mut free) = (Vec::new(), [0.0; 4]);
    for (body, sign) in [(Some(a), 1.0), (b, -1.0)] {
        let Some(k) = body else { continue };
        let body = &bodies[k];
        let arm: [f64; 3] = std::array::from_fn(|i| p[i] - body.place[i]);
        let mut rows = [[0.0; 4]; 6];
        for row in 0..cone.rows().min(3) {
            let turn = cross(arm, frame[row]);
            for i in 0..3 {
                rows[i][row] = sign * turn[i] / body.inertia[i].sqrt();
                rows[3 + i][row] = sign * frame[row][i] / body.mass.sqrt();
                free[row] += sign * (turn[i] * body.velocity[i]);
                free[row] += sign * (frame[row][i] * body.velocity[3 + i]);
            }
        }
        if cone.rows() == 4 {
            for i in 0..3 {
                rows[i][3] = sign * frame[0][i] / body.inertia[i].sqrt();
                free[3] += sign * frame[0][i] * body.velocity[i];
            }
        }
        entries.extend((0..6).map(|i| (6 * k + i, rows[i])));
    }
    case.add(cone, &entries, free);
}

/// Axes with the normal along z.
pub const UP: [[f64; 3]; 3] = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

/// 20 cubes of 0.2 m in five leaning stacks, 60 contacts on 120 degrees of freedom, one step of 2 ms after rest, pushed by `push` (m/s).
pub fn pile(push: f64) -> Case {
    let mut rng = Random(20);
    let (half, step) = (0.1, 2e-3);
    let mut bodies = Vec::new();
    for column in 0..5 {
        for level in 0..4 {
            let mass = rng.between(0.6, 1.6);
            let i = mass * 4.0 * half * half / 6.0;
            let offset = [rng.number() * 0.02, rng.number() * 0.02];
            let place =
                [0.21 * column as f64 + offset[0], offset[1], half * (1 + 2 * level) as f64];
            let mut velocity = [0.0; 6];
            velocity[5] = -9.81 * step;
            velocity[3] = push * (1.0 + rng.number());
            velocity[4] = push * rng.number();
            bodies.push(Body { mass, inertia: [i, 1.1 * i, 0.9 * i], place, velocity });
        }
    }
    let mut case = Case::new(6 * bodies.len());
    for k in 0..20 {
        let (level, c) = (k % 4, bodies[k].place);
        let below = (level > 0).then(|| k - 1);
        let corners: &[[f64; 2]] = if level % 2 == 0 {
            &[[1.0, 1.0], [-1.0, 1.0], [0.1, -1.0]]
        } else {
            &[[1.0, -1.0], [-1.0, -1.0], [-0.2, 1.0]]
        };
        for corner in corners {
            let p = [c[0] + 0.9 * half * corner[0], c[1] + 0.9 * half * corner[1], c[2] - half];
            touch(&mut case, &bodies, k, below, p, UP, Cone::Coulomb { friction: 0.5 });
        }
    }
    case
}

/// 11 contacts on 27 degrees of freedom, each touching all: a humanoid with full rows.
pub fn humanoid(seed: u64) -> Case {
    random(seed, 27, 11, 27, |rng, _| Cone::Coulomb { friction: rng.between(0.6, 1.0) })
}
