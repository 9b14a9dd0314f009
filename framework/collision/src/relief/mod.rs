//! Ground as one smooth surface over x and y, and its contact with rolling wheels.
//!
//! A [`Relief`] returns height and slopes at points; a [`Lattice`] is the smooth surface through heights on a grid. A [`Wheel`] consists of discs
//! across its width. Each disc touches the ground in [`Patch`]es that appear, move and disappear continuously. Wheel models use this module, and so
//! do colliders with [`discs`](crate::ColliderSpec::discs) on a height field, so that all wheels have the same ground.

mod discs;
mod lattice;
mod profile;

pub use discs::{DISCS, Disc, DiscContact, PATCHES, Patch, Wheel};
pub use lattice::{GridFault, Inside, Lattice};

use linkwork_multibody::spatial::Vec3;

/// A ground with height (m), ∂h/∂x and ∂h/∂y at several points x, y (m); the height is NaN where there is none.
pub trait Relief {
    /// Evaluates the ground at the points `at`.
    fn relief(&self, at: &[[f64; 2]], out: &mut [[f64; 3]]);
}

/// A ground that is defined by a function for height (m) and unit normal.
impl<T: Fn(f64, f64) -> Option<(f64, Vec3)>> Relief for T {
    fn relief(&self, at: &[[f64; 2]], out: &mut [[f64; 3]]) {
        for ([x, y], out) in at.iter().zip(out) {
            *out = self(*x, *y).map_or([f64::NAN; 3], |(h, n)| [h, -n.x / n.z, -n.y / n.z]);
        }
    }
}
