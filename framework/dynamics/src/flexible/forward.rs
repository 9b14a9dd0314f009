//! Forward dynamics, M⁻¹ and compliance of a tree with flexible bodies. The tree consists of units: links, and the modes of each body as one unit.
//! The cost is linear in the number of bodies and cubic in the modes of a body.
//!
//! ```text
//! M⁻¹ x:      ε = x − S · z,   z⁺ = z + G ε  inward;   y = D^{−1/2} ε;   the impulse of y outward
//! Λ⁻¹ = J M⁻¹ J*
//! ```

use super::{Flexible, columns};
use crate::articulated::Spatial;
use crate::error::DynamicsError;
use crate::forward::rigid_mass;
use crate::linear::{M3, S3, V3, V6};
use crate::query::v3;
use crate::tree::Tree;
use crate::units::UnitsWork;
use crate::work::{Work, Workspace};
use linkwork_multibody::NodeId;

impl Flexible {
    /// Returns inertia and force of a station with everything that hangs on it, about its own origin.
    pub fn loaded(&self, slot: usize, w: &Work<f64>, uw: &UnitsWork) -> (Spatial<f64>, V6<f64>) {
        let at = self.station(slot).map(|s| &self.stations[s]);
        let (m, h, J) = at.map(|s| (s.m, s.h, s.J)).unwrap_or_default();
        let kin = &w.kin[slot];
        let (J, h) = (J.rotate(&kin.R), kin.R.mul(h));
        let z = rigid_mass(m, h, J, kin, &w.f_ext[slot], w.gravity);
        let mut P = Spatial { I: J, H: M3::skew(h), M: S3::diagonal(m) };
        P.add(&uw.inertia[slot]);
        (P, z + uw.z[slot])
    }
}

/// Calls a function with the units and their memory.
fn with_units(
    tree: &Tree,
    ws: &mut Workspace,
    f: impl FnOnce(&crate::units::Units, &mut Workspace, &mut UnitsWork) -> Result<(), DynamicsError>,
) -> Result<(), DynamicsError> {
    let units = tree.flexible.as_deref().and_then(|f| f.units.as_ref());
    let Some((units, mut uw)) = units.zip(ws.work.bend.units.take()) else { return Ok(()) };
    let done = f(units, ws, &mut uw);
    ws.work.bend.units = Some(uw);
    done
}

/// Like the rigid version: reads T at free coordinates and β̇ at prescribed ones, and writes the others.
pub(crate) fn forward_dynamics(
    tree: &Tree,
    ws: &mut Workspace,
    tau: &mut [f64],
    vdot: &mut [f64],
) -> Result<(), DynamicsError> {
    with_units(tree, ws, |units, ws, uw| {
        units.gather(tree, ws, uw, tau, vdot, &[])?;
        units.scatter(tree, ws, uw, &[], tau, vdot);
        Ok(())
    })
}

/// Factors the units for products with M⁻¹.
fn factor(
    tree: &Tree,
    ws: &mut Workspace,
    then: impl FnOnce(&mut Workspace, &mut Solve<'_>),
) -> Result<(), DynamicsError> {
    with_units(tree, ws, |units, ws, uw| {
        let mut zero = std::mem::take(&mut ws.work.bend.zero);
        zero.fill(0.0);
        let done = units.gather(tree, ws, uw, &zero, &zero, &[]);
        ws.work.bend.zero = zero;
        done?;
        let mut y = std::mem::take(&mut ws.work.bend.y);
        then(ws, &mut Solve { tree, units, uw, y: &mut y });
        ws.work.bend.y = y;
        Ok(())
    })
}

struct Solve<'a> {
    tree: &'a Tree,
    units: &'a crate::units::Units,
    uw: &'a mut UnitsWork,
    y: &'a mut [f64],
}

impl Solve<'_> {
    /// Replaces x by M⁻¹ x over the free degrees of freedom; zero at prescribed ones.
    fn run(&mut self, x: &mut [f64]) {
        self.units.pull_forces(self.tree, self.uw, x, self.y);
        self.units.impulse(self.tree, self.uw, self.y, x);
    }
}

/// Replaces `x` by M⁻¹ x over the free degrees of freedom; zero at prescribed ones.
pub(crate) fn apply_inverse_mass(
    tree: &Tree,
    ws: &mut Workspace,
    x: &mut [f64],
) -> Result<(), DynamicsError> {
    factor(tree, ws, |_, solve| solve.run(x))
}

/// Computes M⁻¹, nv × nv.
pub(crate) fn inverse_mass_matrix(
    tree: &Tree,
    ws: &mut Workspace,
    out: &mut [f64],
) -> Result<(), DynamicsError> {
    let nv = tree.nv();
    factor(tree, ws, |_, solve| {
        for (i, row) in out.chunks_exact_mut(nv).enumerate() {
            row.fill(0.0);
            row[i] = 1.0;
            solve.run(row);
        }
        // Round-off differs between a row and its column, so symmetrize.
        for i in 0..nv {
            for j in 0..i {
                let x = 0.5 * (out[i * nv + j] + out[j * nv + i]);
                (out[i * nv + j], out[j * nv + i]) = (x, x);
            }
        }
    })
}

/// Computes J M⁻¹ Jᵀ of some nodes: accelerations for unit wrenches, in their order.
pub(crate) fn compliance(
    tree: &Tree,
    flex: &Flexible,
    ws: &mut Workspace,
    nodes: &[NodeId],
    out: &mut [f64],
) -> Result<(), DynamicsError> {
    let size = 6 * nodes.len();
    let mut x = std::mem::take(&mut ws.work.bend.x);
    let done = factor(tree, ws, |ws, solve| {
        for (column, node) in nodes.iter().enumerate() {
            for c in 0..6 {
                x.fill(0.0);
                each_row(tree, flex, &ws.work, *node, |i, J| x[i] = J[c]);
                solve.run(&mut x);
                for (row, node) in nodes.iter().enumerate() {
                    let mut a = [0.0; 6];
                    each_row(tree, flex, &ws.work, *node, |i, J| {
                        a.iter_mut().zip(J).for_each(|(a, J)| *a += J * x[i]);
                    });
                    for (r, a) in a.iter().enumerate() {
                        out[(6 * row + r) * size + 6 * column + c] = *a;
                    }
                }
            }
        }
    });
    ws.work.bend.x = x;
    done
}

/// Computes the six rows of a node's Jacobian, dof by dof.
fn each_row(
    tree: &Tree,
    flex: &Flexible,
    w: &Work<f64>,
    node: NodeId,
    mut each: impl FnMut(usize, [f64; 6]),
) {
    let at = tree.node(node);
    let slot = at.slot as usize;
    let d: V3<f64> = w.kin[slot].R.mul(v3(&at.p));
    columns(tree, flex, w, slot, d, |i, J, _, _| {
        each(i, [J.n.x, J.n.y, J.n.z, J.f.x, J.f.y, J.f.z]);
    });
}
