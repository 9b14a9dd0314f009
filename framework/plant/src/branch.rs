//! Notices that a projection moved a mechanism to another branch of its motion.
//!
//! ```text
//! near      the independence of the rows is below 0.1: links are in line within about 6 degrees
//! jump      max |β₁ − β₀| > 0.1 max |β₀|          β₀, β₁: rates before and after the projection
//! ```
//! A parallelogram whose links are in line may continue as a parallelogram or as an anti-parallelogram: positions and constraints permit both, but
//! the rates permit only one. A sufficiently short step follows this branch within its error, and the projection at its end removes only this error.
//! Therefore a projection that changes the rates by a large fraction shows that the step was too long: it ended on the other branch, or stopped
//! there.
use crate::plan::MechanismPlan;
use linkwork_runtime::Failure;
use linkwork_solvers::NEAR;

/// Fraction of the rates that a projection may change there.
const RATES: f64 = 0.1;

fn greatest(x: impl Iterator<Item = f64>) -> f64 {
    x.fold(0.0, |most, x| most.max(x.abs()))
}

/// Compares the rates of a mechanism before a projection with those after it, `v`.
///
/// # Errors
/// The mechanism changed its branch.
pub(crate) fn check(
    plan: &MechanismPlan,
    independence: f64,
    before: &[f64],
    v: &[f64],
) -> Result<(), Box<Failure>> {
    if independence >= NEAR {
        return Ok(());
    }
    let jump = greatest(v.iter().zip(before).map(|(a, b)| a - b));
    let fastest = greatest(before.iter().copied());
    if jump <= RATES * fastest {
        return Ok(());
    }
    let constraints = plan.multibody.constraints();
    let names: Vec<&str> = constraints.map(|c| plan.multibody.constraint_name(c)).collect();
    let message = format!(
        "the constraints ({}) are nearly singular here, for example because links are in line, and at the end of the step the rates violate them by {jump:.3} rad/s or m/s (the largest rate is {fastest:.3}): the mechanism would jump to another branch of its motion",
        names.join(", "),
    );
    let help = "use a shorter step or smaller tolerances in `accuracy`; or add a constraint that selects the branch, such as a second parallel link";
    Err(Box::new(Failure { message, help: Some(help.into()) }))
}
