//! Message for a start that cannot be closed: the values that do not fit together, and values that would.
use crate::plan::MechanismPlan;
use linkwork_multibody::BodyId;
use linkwork_runtime::doc::number;
use linkwork_runtime::{Fault, Origin};
use linkwork_solvers::{ROUNDED, StartError};

impl MechanismPlan {
    /// Returns the fault for a start that cannot be closed, at the first body whose values do not fit, or at the constraint.
    pub(crate) fn cannot_start(&self, e: &StartError) -> Fault {
        let m = &self.multibody;
        let (name, id) = &e.constraint;
        let at_constraint = self.origin_of(m.constraint_name(*id));
        let (unit, own) = match e.rates {
            false => ("rad or m", &self.kept.positions),
            true => ("rad or m per second", &self.kept.rates),
        };
        let kept = |b: BodyId| m.get(b).v().any(|k| own.get(k) == Some(&true));
        let fault = |fact: String, help: &str| Fault::new(at_constraint, fact).help(help);
        let Some(nearest) = &e.nearest else {
            let fact =
                format!("{name} does not close: an error of {} ({unit}) remains", number(e.left));
            let help = match m.body_ids().any(kept) {
                false => {
                    "start nearer to a closed configuration, or check lengths, frames and prescribed hinges"
                }
                true => {
                    "start nearer to a closed configuration, remove values in `initial` that follow from others, or check lengths, frames and prescribed hinges"
                }
            };
            return fault(fact, help);
        };
        let mut moved = vec![0.0; m.nv()];
        let given = match e.rates {
            false => {
                m.difference(&self.q, nearest, &mut moved);
                &self.q
            }
            true => {
                moved
                    .iter_mut()
                    .zip(nearest.iter().zip(&self.v))
                    .for_each(|(d, (a, b))| *d = a - b);
                &self.v
            }
        };
        let wrong = |b: &BodyId| {
            kept(*b) && m.get(*b).v().any(|k| own[k] && moved[k].abs() > 0.1 * ROUNDED)
        };
        let all: Vec<BodyId> = m.body_ids().filter(wrong).collect();
        let value = |values: &[f64], b: BodyId| {
            let at = if e.rates { m.get(b).v() } else { m.get(b).q() };
            match &values[at] {
                [one] => format!("{one:.6}"),
                more => format!(
                    "({})",
                    more.iter().map(|x| format!("{x:.6}")).collect::<Vec<_>>().join(", ")
                ),
            }
        };
        let list = |values: &[f64]| {
            let one = |b: &BodyId| format!("`{}` {}", m.get(*b).name(), value(values, *b));
            all.iter().map(one).collect::<Vec<_>>().join(", ")
        };
        let what = if e.rates { "rates" } else { "coordinates" };
        let fact = format!(
            "the initial {what} are not compatible with {name}: its error is {} ({unit}) with {}; the nearest compatible ones are {}",
            number(e.left),
            list(given),
            list(nearest)
        );
        let help = "correct a value, or remove it so that it follows from the others; write `approximate: true` in an `initial` whose values are approximate";
        let first = all.first().and_then(|b| self.bodies.get(m.get(*b).name()));
        let origin = first.copied().filter(|o| *o != Origin::NONE).unwrap_or(at_constraint);
        Fault::new(origin, fact).help(help)
    }
}
