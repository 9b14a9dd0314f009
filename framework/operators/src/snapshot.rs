//! The data of the operators of one system at one configuration.
//!
//! From tips to base, with the armature J of the link:
//! ```text
//! P(k) = M(k) + Σ_j φ(k,j) P⁺(j) φ*(k,j)
//! free        D = H P H* + J,  G = P H* D⁻¹,  P⁺ = P − G H P
//! prescribed  D = D⁻¹ = 0,     G = 0,         P⁺ = P
//! ```

use linkwork_dynamics::{DynamicsError, LinkView, Tree, Workspace, link_views, node_offset};
use linkwork_multibody::{Coordinate, Multibody};
use linkwork_spatial::nalgebra::{Matrix6, Vector6};
use linkwork_spatial::{Vec3, skew};
use std::sync::{Arc, OnceLock};

/// Which coordinates are treated as free.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Articulation {
    AsGiven,
    AllFree,
}

/// One link; world axes at its origin.
#[derive(Clone, Debug)]
pub(crate) struct LinkAt {
    /// `None`: the world.
    pub parent: Option<usize>,
    /// Vector from the parent's origin to the link's.
    pub l: Vec3,
    /// First index in β, and number of degrees of freedom.
    pub v: usize,
    pub n: usize,
    /// Index of its block in `D` and `D_inv` (n × n, row after row).
    pub block: usize,
    pub prescribed: bool,
    pub armature: f64,
    pub body: usize,
    pub M: Matrix6<f64>,
    pub P: Matrix6<f64>,
}

/// A node: its link and the vector from the link's origin to the node's, world axes.
#[derive(Clone, Debug)]
pub(crate) struct NodeAt {
    pub link: Option<usize>,
    pub r: Vec3,
}

#[derive(Debug)]
pub(crate) struct Snapshot {
    pub links: Vec<LinkAt>,
    pub nv: usize,
    /// Columns of H*, and of G, for each degree of freedom.
    pub H: Vec<Vector6<f64>>,
    pub G: Vec<Vector6<f64>>,
    pub D: Vec<f64>,
    pub D_inv: Vec<f64>,
    pub nodes: Vec<NodeAt>,
    upsilon: OnceLock<Vec<Matrix6<f64>>>,
    M_inv: OnceLock<Result<Vec<Matrix6<f64>>, usize>>,
    multibody: Arc<Multibody>,
}

impl Snapshot {
    #[track_caller]
    pub fn new(tree: &Tree, ws: &Workspace, which: Articulation) -> Result<Self, DynamicsError> {
        let links = link_views(tree, ws)?;
        let multibody = tree.shared_multibody();
        let nodes = multibody.node_ids().map(|node| {
            let (link, r) = node_offset(tree, ws, node);
            NodeAt { link, r }
        });
        let mut s = Self {
            links: Vec::with_capacity(links.len()),
            nv: tree.nv(),
            H: Vec::with_capacity(tree.nv()),
            G: vec![Vector6::zeros(); tree.nv()],
            D: Vec::new(),
            D_inv: Vec::new(),
            nodes: nodes.collect(),
            upsilon: OnceLock::new(),
            M_inv: OnceLock::new(),
            multibody,
        };
        for LinkView { parent, offset, v, body, coordinate, armature, inertia, hinge_map } in links
        {
            let (n, block) = (hinge_map.len(), s.D.len());
            s.H.extend(hinge_map);
            s.D.resize(block + n * n, 0.0);
            let given = coordinate == Coordinate::Prescribed;
            s.links.push(LinkAt {
                parent,
                l: offset,
                v,
                n,
                block,
                prescribed: given && which == Articulation::AsGiven,
                armature,
                body,
                M: inertia,
                P: inertia,
            });
        }
        s.D_inv = vec![0.0; s.D.len()];
        for k in (0..s.links.len()).rev() {
            if !s.articulate(k) {
                let link = &s.links[k];
                return Err(DynamicsError::Singular { body: s.name(link).to_owned(), v: link.v });
            }
        }
        Ok(s)
    }

    /// Computes D, D⁻¹ and G of a link, and adds its P⁺ to its parent's P; returns false when D is singular.
    fn articulate(&mut self, k: usize) -> bool {
        let link = &self.links[k];
        let (P, n, v) = (link.P, link.n, link.v);
        let mut P_plus = P;
        if !link.prescribed {
            let H = &self.H[v..v + n];
            let D = &mut self.D[link.block..link.block + n * n];
            let mut scale = [0.0; 6];
            for i in 0..n {
                for j in 0..n {
                    D[i * n + j] = H[i].dot(&(P * H[j]));
                }
                D[i * n + i] += link.armature;
                scale[i] = link.armature + H[i].abs().dot(&(P.abs() * H[i].abs()));
            }
            let D_inv = &mut self.D_inv[link.block..link.block + n * n];
            if !invert(D, &scale[..n], D_inv) {
                return false;
            }
            if n == 6 {
                // For a free hinge G = P H* (H P H*)⁻¹ = H⁻¹ = H*, so it transmits nothing.
                self.G[v..v + n].copy_from_slice(H);
                P_plus = Matrix6::zeros();
            } else {
                for j in 0..n {
                    let column: Vector6<f64> = (0..n).map(|i| H[i] * D_inv[i * n + j]).sum();
                    self.G[v + j] = P * column;
                }
                for j in 0..n {
                    P_plus -= self.G[v + j] * (P * H[j]).transpose();
                }
                P_plus = (P_plus + P_plus.transpose()) * 0.5;
            }
        }
        if let Some(p) = link.parent {
            let phi = phi(&link.l);
            self.links[p].P += phi * P_plus * phi.transpose();
        }
        true
    }

    /// Returns Υ of each link, base to tips; computed on first use.
    pub fn upsilon(&self) -> &[Matrix6<f64>] {
        self.upsilon.get_or_init(|| {
            let mut all: Vec<Matrix6<f64>> = Vec::with_capacity(self.links.len());
            for link in &self.links {
                let (v, n) = (link.v, link.n);
                let mut Y = Matrix6::zeros();
                let mut tau_bar = Matrix6::identity();
                for i in 0..n {
                    tau_bar -= self.G[v + i] * self.H[v + i].transpose();
                    for j in 0..n {
                        let d = self.D_inv[link.block + i * n + j];
                        Y += self.H[v + i] * self.H[v + j].transpose() * d;
                    }
                }
                if let Some(p) = link.parent {
                    let psi = phi(&link.l) * tau_bar;
                    Y += psi.transpose() * all[p] * psi;
                }
                all.push((Y + Y.transpose()) * 0.5);
            }
            all
        })
    }

    /// Returns M⁻¹ of each link, or the first link that has none; computed on first use.
    pub fn M_inv(&self) -> Result<&[Matrix6<f64>], usize> {
        let made = self.M_inv.get_or_init(|| {
            let one = |(k, link): (usize, &LinkAt)| {
                let M: Vec<f64> = link.M.transpose().iter().copied().collect();
                let scale: Vec<f64> = (0..6).map(|i| link.M[(i, i)]).collect();
                let mut out = [0.0; 36];
                invert(&M, &scale, &mut out).then(|| Matrix6::from_row_slice(&out)).ok_or(k)
            };
            self.links.iter().enumerate().map(one).collect()
        });
        made.as_deref().map_err(|k| *k)
    }

    /// Returns true when a coordinate is prescribed.
    pub fn has_prescribed(&self) -> bool {
        self.links.iter().any(|l| l.prescribed)
    }

    /// Returns true when a rotor has inertia.
    pub fn has_armature(&self) -> bool {
        self.links.iter().any(|l| l.armature > 0.0)
    }

    /// Returns the body to whose hinge a link belongs.
    pub fn name(&self, link: &LinkAt) -> &str {
        self.multibody.bodies()[link.body].name()
    }
}

/// Returns φ(p,k) as a matrix.
fn phi(l: &Vec3) -> Matrix6<f64> {
    let mut phi = Matrix6::identity();
    phi.fixed_view_mut::<3, 3>(0, 3).copy_from(&skew(l));
    phi
}

/// Inverts a symmetric positive definite matrix (row after row) by Cholesky. Returns false when a pivot is not above round-off (1e-14 of `scale`, the
/// size of the summed terms), or NaN.
fn invert(A: &[f64], scale: &[f64], out: &mut [f64]) -> bool {
    let n = scale.len();
    let mut L = [[0.0_f64; 6]; 6];
    for j in 0..n {
        let pivot = A[j * n + j] - L[j][..j].iter().map(|x| x * x).sum::<f64>();
        if !(pivot > 1e-14 * scale[j] && pivot.is_finite()) {
            return false;
        }
        L[j][j] = pivot.sqrt();
        for i in j + 1..n {
            let dot: f64 = (0..j).map(|m| L[i][m] * L[j][m]).sum();
            L[i][j] = (A[i * n + j] - dot) / L[j][j];
        }
    }
    for c in 0..n {
        let mut x = [0.0; 6];
        x[c] = 1.0;
        for i in 0..n {
            let dot: f64 = (0..i).map(|m| L[i][m] * x[m]).sum();
            x[i] = (x[i] - dot) / L[i][i];
        }
        for i in (0..n).rev() {
            let dot: f64 = (i + 1..n).map(|m| L[m][i] * x[m]).sum();
            x[i] = (x[i] - dot) / L[i][i];
        }
        for i in 0..n {
            out[i * n + c] = x[i];
        }
    }
    true
}
