//! The report of the balances of a run.
use super::Balance;
use linkwork_runtime::balance::{Kind, Quantity};
use linkwork_runtime::doc::number;
use linkwork_runtime::{Account, Fault};
use serde::Serialize;
use std::collections::BTreeMap;

/// Residual, relative to the exchanged amount of a part, above which its balance is not closed.
pub(crate) const TOLERANCE: f64 = 0.02;

/// Residual, relative to the largest exchanged amount of any part or to the largest amount stored in the part, that is not reported. The second
/// is the accuracy of the integration: the kinetic energy of a spacecraft in orbit is a million times larger than what it exchanges.
const NEGLIGIBLE: f64 = 1e-6;

/// The balance of a part. Amounts are positive into the part.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Part {
    /// Amounts by term.
    pub terms: BTreeMap<String, f64>,
    /// The residual; `None` for a part that exchanges with the surroundings of the simulation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual: Option<f64>,
    /// The largest residual with which the balance is closed: 2 % of `carried`, plus `uncertainty`, plus 1e-6 of the largest stored amount.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// Largest amount that one of its terms has exchanged, counting both directions.
    pub carried: f64,
    /// Bound of the quadrature error from jumps of sampled outputs, in fixed steps.
    pub uncertainty: f64,
    /// Largest amount that was stored in it.
    #[serde(skip)]
    pub stored: f64,
}

impl Part {
    /// Returns whether it is closed only because of its `uncertainty`.
    pub fn is_uncertain(&self) -> bool {
        let without = self.tolerance.unwrap_or(0.0) - self.uncertainty;
        self.residual.is_some_and(|r| r.abs() > without) && !self.is_open()
    }

    /// Returns whether it must be closed and is not.
    pub fn is_open(&self) -> bool {
        self.residual.is_some_and(|r| !(r.abs() <= self.tolerance.unwrap_or(0.0)))
    }
}

/// The balance of a quantity. Amounts are positive into the simulation or into the part.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Report {
    /// Unit of all amounts.
    pub unit: &'static str,
    /// Sums over the parts, by kind of term.
    pub totals: BTreeMap<&'static str, f64>,
    /// The parts.
    pub parts: BTreeMap<String, Part>,
    /// Sum of the residuals of the parts that must be closed.
    pub residual: f64,
    /// Largest amount that a part has exchanged.
    pub carried: f64,
    /// The parts whose balance is not closed.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub not_closed: Vec<String>,
    /// Exchanges that are not counted, such as contact by impulses. A part with such an exchange does not have a residual.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub not_counted: Vec<String>,
}

/// The balances of a run by quantity; quantities without a term are omitted.
pub type Balances = BTreeMap<&'static str, Report>;

/// Returns the name of a kind of term in the totals.
fn total(kind: Kind, amount: f64) -> &'static str {
    match kind {
        Kind::Electrical if amount < 0.0 => "given to electrical nodes",
        Kind::Electrical => "taken from electrical nodes",
        Kind::Heat if amount < 0.0 => "given to heat nodes",
        Kind::Heat => "taken from heat nodes",
        Kind::Propellant if amount < 0.0 => "given to propellant lines",
        Kind::Propellant => "taken from propellant lines",
        Kind::Work => "work of parts on the mechanism",
        Kind::Stored => "stored in parts",
        Kind::Gained => "gained by parts",
        Kind::Lost => "lost by parts",
    }
}

impl Balance {
    /// Returns the balances from the start to the last instant.
    pub fn report(&self) -> Balances {
        Quantity::ALL.into_iter().filter_map(|q| Some((q.name(), self.of(q)?))).collect()
    }

    fn of(&self, quantity: Quantity) -> Option<Report> {
        let mut report = Report { unit: quantity.unit(), ..Report::default() };
        let sums = &self.sums;
        let mut parts: Vec<Part> = vec![Part::default(); self.parts.len()];
        let mut any = vec![false; self.parts.len()];
        let mut put =
            |k: usize, name: String, amount: f64, [carried, uncertain, stored]: [f64; 3]| {
                // Two terms of a part can have the same name: a connector and a binding.
                *parts[k].terms.entry(name).or_default() += amount;
                parts[k].carried = parts[k].carried.max(carried);
                parts[k].uncertainty += uncertain;
                parts[k].stored = parts[k].stored.max(stored);
                any[k] = true;
            };
        let (mut work, mut work_through, mut uncertain_work) = (0.0, 0.0, 0.0);
        for (k, flow) in self.flows.iter().enumerate().filter(|(_, f)| f.quantity == quantity) {
            let (amount, carried) = (sums.sum[k], sums.through[k]);
            let shown = if flow.kind == Kind::Work { -amount } else { amount };
            *report.totals.entry(total(flow.kind, amount)).or_default() += shown;
            if flow.kind == Kind::Work {
                work -= sums.held[k];
                work_through += carried;
                uncertain_work += sums.uncertainty[k];
            }
            put(flow.part, flow.name.clone(), amount, [carried, sums.uncertainty[k], 0.0]);
        }
        for (k, stock) in self.stocks.iter().enumerate().filter(|(_, s)| s.quantity == quantity) {
            let change = sums.last[k] - sums.first[k];
            if change.is_finite() {
                *report.totals.entry("stored in parts").or_default() += change;
                let name = format!("stored {}", stock.name);
                put(stock.part, name, -change, [change.abs(), 0.0, sums.largest[k]]);
            }
        }
        let (flows, stocks) = (self.flows.len(), self.stocks.len());
        for (k, own) in self.own.iter().enumerate().filter(|(_, o)| o.quantity == quantity) {
            let (amount, carried) = match own.account {
                Account::Stored => {
                    let change = sums.last[stocks + k] - sums.first[stocks + k];
                    (if change.is_finite() { -change } else { 0.0 }, change.abs())
                }
                Account::Gained => (sums.sum[flows + k], sums.through[flows + k]),
                Account::Lost => (-sums.sum[flows + k], sums.through[flows + k]),
            };
            let shown = if own.account == Account::Stored { -amount } else { amount };
            if shown != 0.0 {
                *report.totals.entry(own.name).or_default() += shown;
            }
            let rate = own.account != Account::Stored;
            let uncertain = if rate { sums.uncertainty[flows + k] } else { 0.0 };
            let stored = if rate { 0.0 } else { sums.largest[stocks + k] };
            put(own.part, own.name.to_string(), amount, [carried, uncertain, stored]);
        }
        for (k, part) in self.parts.iter().enumerate() {
            if part.own.receives_work && quantity == Quantity::Energy {
                put(k, "work of parts".into(), work, [work_through, uncertain_work, 0.0]);
            }
        }
        for ((terms, mut part), any) in self.parts.iter().zip(parts).zip(any) {
            if !any {
                continue;
            }
            let left: f64 = part.terms.values().sum();
            let own = quantity == Quantity::Energy && !terms.own.known.is_empty();
            let unknown: Vec<String> = match own {
                true => self.silent().chain(terms.own.unknown.iter().cloned()).collect(),
                false => terms.silent.clone(),
            };
            if sums.changed {
                part.terms.insert("changes from outside".into(), -left);
                let outside = "changes of variables from outside";
                if !report.not_counted.iter().any(|name| name == outside) {
                    report.not_counted.push(outside.into());
                }
            } else if own && !unknown.is_empty() {
                part.terms.insert(format!("not counted: {}", unknown.join(", ")), -left);
                *report.totals.entry("not counted").or_default() -= left;
                report.not_counted.extend(unknown);
            } else if own || terms.has_to_close(quantity) {
                part.residual = Some(left);
                report.residual += left;
            }
            report.carried = report.carried.max(part.carried);
            report.parts.insert(terms.part.clone(), part);
        }
        for (path, part) in &mut report.parts {
            // Parts with a negligible exchange, such as round-off and starts from rest, are closed.
            let own = TOLERANCE * part.carried + part.uncertainty + NEGLIGIBLE * part.stored;
            part.tolerance = part.residual.map(|_| own.max(NEGLIGIBLE * report.carried));
            if part.is_open() {
                report.not_closed.push(path.clone());
            }
        }
        (!report.parts.is_empty()).then_some(report)
    }

    /// Returns the torques and wrenches whose work no part reports.
    fn silent(&self) -> impl Iterator<Item = String> + '_ {
        self.parts.iter().flat_map(|p| p.silent.iter().map(|name| format!("`{}.{name}`", p.part)))
    }

    /// Returns a warning for each part whose balance is not closed.
    pub fn warnings(&self) -> Vec<Fault> {
        let mut all = Vec::new();
        for (name, report) in self.report() {
            for (path, part) in report.parts.iter().filter(|(_, part)| part.is_open()) {
                let unit = report.unit;
                let terms: Vec<String> = part
                    .terms
                    .iter()
                    .map(|(name, y)| format!("{name} {} {unit}", number(*y)))
                    .collect();
                let fact = format!(
                    "the balance of {name} of `{path}` is not closed: the residual is {} {unit}, but at most {} {unit} of {} {unit} are accepted ({})",
                    number(part.residual.unwrap_or(f64::NAN)),
                    number(part.tolerance.unwrap_or(f64::NAN)),
                    number(part.carried),
                    terms.join(", ")
                );
                let help = "use a shorter `step`, an `integrator` of higher order, or smaller tolerances in `accuracy`; if the residual remains, the model does not conserve the quantity. `balance: false` disables balances";
                let origin = self.parts.iter().find(|p| p.part == *path).map(|p| p.origin);
                let origin = origin.unwrap_or(linkwork_runtime::Origin::NONE);
                all.push(Fault::new(origin, fact).help(help));
            }
        }
        all
    }
}
