//! Product of one symbol with one vector; each visits each link once.
//!
//! With y the result, p the parent of k, children before parents (gather) or after (scatter):
//! ```text
//! φ x    gather   y(k) = x(k) + Σ_j φ(k,j) y(j)          φ* x  scatter  y(k) = x(k) + φ*(p,k) y(p)
//! ψ x    gather   with ψ(k,j) = φ(k,j) (1 − G H)         ψ* x  scatter  with ψ* = (1 − H* G*) φ*
//! ℰφ x   y(p) = Σ_k φ(p,k) x(k)                          ℰφ* x          y(k) = φ*(p,k) x(p)
//! K x    y(p) = Σ_k φ(p,k) G(k) x(k)                     K* x           y(k) = G*(k) φ*(p,k) x(p)
//! ```

use crate::side::Side;
use crate::snapshot::{LinkAt, Snapshot};
use linkwork_spatial::nalgebra::{Matrix6, Vector6};
use linkwork_spatial::{Force, Motion, Vec3};

/// The elementary operators, which are not products or sums.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Symbol {
    Phi,
    Psi,
    EPhi,
    EPsi,
    H,
    G,
    K,
    M,
    MInv,
    P,
    D,
    DInv,
    J,
    Upsilon,
}

impl Symbol {
    /// Returns true if the operator is symmetric.
    pub fn symmetric(self) -> bool {
        matches!(
            self,
            Symbol::M
                | Symbol::MInv
                | Symbol::P
                | Symbol::D
                | Symbol::DInv
                | Symbol::J
                | Symbol::Upsilon
        )
    }

    pub fn text(self) -> &'static str {
        match self {
            Symbol::Phi => "φ",
            Symbol::Psi => "ψ",
            Symbol::EPhi => "ℰφ",
            Symbol::EPsi => "ℰψ",
            Symbol::H => "H",
            Symbol::G => "G",
            Symbol::K => "K",
            Symbol::M => "M",
            Symbol::MInv => "M⁻¹",
            Symbol::P => "P",
            Symbol::D => "D",
            Symbol::DInv => "D⁻¹",
            Symbol::J => "J",
            Symbol::Upsilon => "Υ",
        }
    }
}

type V6 = Vector6<f64>;

fn get(x: &[f64], k: usize) -> V6 {
    V6::from_column_slice(&x[6 * k..6 * k + 6])
}

fn add(x: &mut [f64], k: usize, y: &V6) {
    x[6 * k..6 * k + 6].iter_mut().zip(y.iter()).for_each(|(a, b)| *a += b);
}

fn halves(x: &V6) -> (Vec3, Vec3) {
    (Vec3::new(x[0], x[1], x[2]), Vec3::new(x[3], x[4], x[5]))
}

fn join(n: &Vec3, f: &Vec3) -> V6 {
    V6::new(n.x, n.y, n.z, f.x, f.y, f.z)
}

/// Returns φ(p,k) x.
fn to_parent(l: &Vec3, x: &V6) -> V6 {
    let (n, f) = halves(x);
    let y = Force::new(n, f).shift_to_parent(l);
    join(&y.moment, &y.force)
}

/// Returns φ*(p,k) x.
fn to_child(l: &Vec3, x: &V6) -> V6 {
    let (n, f) = halves(x);
    let y = Motion::new(n, f).shift_to_child(l);
    join(&y.angular, &y.linear)
}

/// Evaluation of one symbol of one system; counts the links that it visits.
pub(crate) struct Sweep<'a> {
    pub s: &'a Snapshot,
    pub visits: u64,
}

impl<'a> Sweep<'a> {
    fn link(&mut self, k: usize) -> &'a LinkAt {
        self.visits += 1;
        &self.s.links[k]
    }

    /// Computes `out` = symbol `x`, or symbol* `x`.
    pub fn run(&mut self, symbol: Symbol, side: Side, x: &[f64], out: &mut [f64]) {
        match (symbol, side) {
            (Symbol::Phi | Symbol::Psi, Side::Plain) => self.gather(symbol, x, out),
            (Symbol::Phi | Symbol::Psi, Side::Transposed) => self.scatter(symbol, x, out),
            (Symbol::EPhi | Symbol::EPsi, Side::Plain) => self.step_in(symbol, x, out),
            (Symbol::EPhi | Symbol::EPsi, Side::Transposed) => self.step_out(symbol, x, out),
            (Symbol::H, Side::Plain) => self.per_hinge(&self.s.H, x, out),
            (Symbol::H, Side::Transposed) => self.per_link(&self.s.H, x, out),
            (Symbol::G, Side::Plain) => self.per_link(&self.s.G, x, out),
            (Symbol::G, Side::Transposed) => self.per_hinge(&self.s.G, x, out),
            (Symbol::K, Side::Plain) => self.gain(x, out),
            (Symbol::K, Side::Transposed) => self.gain_transposed(x, out),
            (Symbol::M, _) => self.blocks(|s, k| &s.links[k].M, x, out),
            (Symbol::P, _) => self.blocks(|s, k| &s.links[k].P, x, out),
            (Symbol::Upsilon, _) => {
                let all = self.s.upsilon();
                self.blocks(|_, k| &all[k], x, out);
            }
            (Symbol::MInv, _) => {
                // This symbol exists only if M is invertible, so the default is never used.
                let all = self.s.M_inv().unwrap_or(&[]);
                self.blocks(|_, k| &all[k], x, out);
            }
            (Symbol::D, _) => self.hinge_blocks(&self.s.D, x, out),
            (Symbol::DInv, _) => self.hinge_blocks(&self.s.D_inv, x, out),
            (Symbol::J, _) => {
                for k in 0..self.s.links.len() {
                    let link = self.link(k);
                    for i in link.v..link.v + link.n {
                        out[i] = link.armature * x[i];
                    }
                }
            }
        }
    }

    /// Returns (1 − G H) y.
    fn past_hinge(&self, link: &LinkAt, symbol: Symbol, y: V6) -> V6 {
        if matches!(symbol, Symbol::Phi | Symbol::EPhi) {
            return y;
        }
        let hinge = link.v..link.v + link.n;
        hinge.fold(y, |sum, i| sum - self.s.G[i] * self.s.H[i].dot(&y))
    }

    /// Returns (1 − H* G*) y.
    fn past_hinge_transposed(&self, link: &LinkAt, symbol: Symbol, y: V6) -> V6 {
        if matches!(symbol, Symbol::Phi | Symbol::EPhi) {
            return y;
        }
        let hinge = link.v..link.v + link.n;
        hinge.fold(y, |sum, i| sum - self.s.H[i] * self.s.G[i].dot(&y))
    }

    fn gather(&mut self, symbol: Symbol, x: &[f64], out: &mut [f64]) {
        out.copy_from_slice(x);
        for k in (0..self.s.links.len()).rev() {
            let link = self.link(k);
            if let Some(p) = link.parent {
                let y = self.past_hinge(link, symbol, get(out, k));
                add(out, p, &to_parent(&link.l, &y));
            }
        }
    }

    fn scatter(&mut self, symbol: Symbol, x: &[f64], out: &mut [f64]) {
        out.copy_from_slice(x);
        for k in 0..self.s.links.len() {
            let link = self.link(k);
            if let Some(p) = link.parent {
                let y = to_child(&link.l, &get(out, p));
                add(out, k, &self.past_hinge_transposed(link, symbol, y));
            }
        }
    }

    fn step_in(&mut self, symbol: Symbol, x: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for k in 0..self.s.links.len() {
            let link = self.link(k);
            if let Some(p) = link.parent {
                let y = self.past_hinge(link, symbol, get(x, k));
                add(out, p, &to_parent(&link.l, &y));
            }
        }
    }

    fn step_out(&mut self, symbol: Symbol, x: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for k in 0..self.s.links.len() {
            let link = self.link(k);
            if let Some(p) = link.parent {
                let y = to_child(&link.l, &get(x, p));
                add(out, k, &self.past_hinge_transposed(link, symbol, y));
            }
        }
    }

    fn per_hinge(&mut self, columns: &[V6], x: &[f64], out: &mut [f64]) {
        for k in 0..self.s.links.len() {
            let link = self.link(k);
            let y = get(x, k);
            for i in link.v..link.v + link.n {
                out[i] = columns[i].dot(&y);
            }
        }
    }

    fn per_link(&mut self, columns: &[V6], x: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for k in 0..self.s.links.len() {
            let link = self.link(k);
            for i in link.v..link.v + link.n {
                add(out, k, &(columns[i] * x[i]));
            }
        }
    }

    fn gain(&mut self, x: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for k in 0..self.s.links.len() {
            let link = self.link(k);
            if let Some(p) = link.parent {
                let y: V6 = (link.v..link.v + link.n).map(|i| self.s.G[i] * x[i]).sum();
                add(out, p, &to_parent(&link.l, &y));
            }
        }
    }

    fn gain_transposed(&mut self, x: &[f64], out: &mut [f64]) {
        for k in 0..self.s.links.len() {
            let link = self.link(k);
            let y = link.parent.map_or_else(V6::zeros, |p| to_child(&link.l, &get(x, p)));
            for i in link.v..link.v + link.n {
                out[i] = self.s.G[i].dot(&y);
            }
        }
    }

    fn blocks<'b>(
        &mut self,
        block: impl Fn(&'b Snapshot, usize) -> &'b Matrix6<f64>,
        x: &[f64],
        out: &mut [f64],
    ) where
        'a: 'b,
    {
        for k in 0..self.s.links.len() {
            self.visits += 1;
            let y = block(self.s, k) * get(x, k);
            out[6 * k..6 * k + 6].copy_from_slice(y.as_slice());
        }
    }

    fn hinge_blocks(&mut self, all: &[f64], x: &[f64], out: &mut [f64]) {
        for k in 0..self.s.links.len() {
            let link = self.link(k);
            let (v, n) = (link.v, link.n);
            for i in 0..n {
                let row = &all[link.block + i * n..link.block + (i + 1) * n];
                out[v + i] = row.iter().zip(&x[v..v + n]).map(|(a, b)| a * b).sum();
            }
        }
    }

    /// Applies B: maps wrenches on nodes to their links.
    pub fn nodes_in(&mut self, nodes: &[usize], x: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for (i, node) in nodes.iter().enumerate() {
            self.visits += 1;
            let at = &self.s.nodes[*node];
            if let Some(k) = at.link {
                add(out, k, &to_parent(&at.r, &get(x, i)));
            }
        }
    }

    /// Applies B*: maps motions of links to nodes.
    pub fn nodes_out(&mut self, nodes: &[usize], x: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for (i, node) in nodes.iter().enumerate() {
            self.visits += 1;
            let at = &self.s.nodes[*node];
            if let Some(k) = at.link {
                add(out, i, &to_child(&at.r, &get(x, k)));
            }
        }
    }
}
