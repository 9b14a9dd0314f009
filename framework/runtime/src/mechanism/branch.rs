//! Notices that a mechanism changed its branch where the rank of its constraints drops.
//!
//! ```text
//! near      the independence of the rows is below 1e-3: links are in line within about a milliradian
//! jump      max |β − β₀| > 0.3 max |β₀| + 5 max |β̇₀| (t − t₀)      β₀, β̇₀, t₀: before it came near
//! ```
//! A parallelogram whose links are in line may continue as a parallelogram or as an anti-parallelogram: positions and constraints
//! permit both, velocities only one. Rates are smooth on that one, so a jump shows that a step ended on the other, or stopped the
//! mechanism there. It happens where error control makes steps end within round-off of the configuration.
use super::plan::MechanismPlan;
use crate::block::Failure;

/// Independence below which a configuration counts as one where the rank drops.
const NEAR: f64 = 1e-3;
/// Part of the rates that may change near it, and the factor of the accelerations before it.
const RATES: f64 = 0.3;
const ACCELERATIONS: f64 = 5.0;

/// The rates before the mechanism came near such a configuration.
#[derive(Clone, Debug, Default)]
pub(super) struct Branch {
    rates: Vec<f64>,
    fastest: f64,
    acceleration: f64,
    time: f64,
    known: bool,
}

fn greatest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |most, x| most.max(x.abs()))
}

impl Branch {
    pub fn new(rates: usize) -> Self {
        Self { rates: vec![0.0; rates], ..Self::default() }
    }

    /// After a step, with the rates `v` on the constraints, the last accelerations and the time.
    ///
    /// # Errors
    /// The rates jumped.
    pub fn check(
        &mut self,
        plan: &MechanismPlan,
        independence: f64,
        (v, vdot): (&[f64], &[f64]),
        time: f64,
    ) -> Result<(), Box<Failure>> {
        if self.known {
            let jump = v.iter().zip(&self.rates).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
            let since = (time - self.time).max(0.0);
            let may = RATES * self.fastest + ACCELERATIONS * self.acceleration * since;
            if jump > may && independence < NEAR {
                return Err(self.failure(plan, v));
            }
        }
        if independence >= NEAR {
            self.rates.copy_from_slice(v);
            (self.fastest, self.acceleration) = (greatest(v), greatest(vdot));
            (self.time, self.known) = (time, true);
        }
        Ok(())
    }

    fn failure(&self, plan: &MechanismPlan, v: &[f64]) -> Box<Failure> {
        let constraints = plan.multibody.constraints();
        let names: Vec<&str> = constraints.map(|c| plan.multibody.constraint_name(c)).collect();
        let message = format!(
            "the constraints ({}) lose rank here, as where links are in line, and the rates jumped from at most {:.4} to {:.4}: the mechanism changed to another branch of its motion or stopped on it",
            names.join(", "),
            self.fastest,
            greatest(v),
        );
        let help = "use a fixed step (`integrator: \"rk4\", step: \"1 ms\"`) or a coarser `accuracy`, so that steps pass this configuration; or add a constraint that decides, as a second parallel link does";
        Box::new(Failure { message, help: Some(help.into()) })
    }
}
