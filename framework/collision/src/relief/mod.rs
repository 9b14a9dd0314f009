//! Ground as one smooth surface over x and y, and where what rolls meets it.
//!
//! A [`Relief`] answers with height and slopes at points; a [`Lattice`] is the smooth surface through heights on a grid. A [`Wheel`] is discs across
//! its width, each of which meets the ground in [`Patch`]es that come, move and go without jumps. Models of wheels ask here, and colliders
//! with [`discs`](crate::ColliderSpec::discs) do on a height field, so that a wheel finds the same ground whatever carries it.

mod discs;
mod lattice;
mod profile;

pub use discs::{DISCS, Disc, DiscContact, PATCHES, Patch, Wheel};
pub use lattice::{GridFault, Inside, Lattice};

use linkwork_multibody::spatial::Vec3;

/// A ground by height (m), ∂h/∂x and ∂h/∂y at each of several points x, y (m); the height is NaN where there is none.
pub trait Relief {
    /// Those of the points `at`.
    fn relief(&self, at: &[[f64; 2]], out: &mut [[f64; 3]]);
}

/// A ground by height (m) and unit normal.
impl<T: Fn(f64, f64) -> Option<(f64, Vec3)>> Relief for T {
    fn relief(&self, at: &[[f64; 2]], out: &mut [[f64; 3]]) {
        for ([x, y], out) in at.iter().zip(out) {
            *out = self(*x, *y).map_or([f64::NAN; 3], |(h, n)| [h, -n.x / n.z, -n.y / n.z]);
        }
    }
}
