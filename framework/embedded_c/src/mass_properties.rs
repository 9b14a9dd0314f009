//! Mass properties that callers pass.
use crate::edge::value;
use crate::status::Fault;
use linkwork_embedded::spatial::{MassProperties, Mat3};

/// # Safety
/// The conditions in the crate documentation apply.
pub(crate) unsafe fn mass_of(
    mass: f64,
    center: *const f64,
    inertia: *const f64,
) -> Result<MassProperties, Fault> {
    // SAFETY: guaranteed by the caller.
    let (center, inertia) = unsafe {
        (value("center", center.cast::<[f64; 3]>())?, value("inertia", inertia.cast::<[f64; 9]>())?)
    };
    Ok(MassProperties::new(mass, center.into(), Mat3::from_row_slice(&inertia)))
}
