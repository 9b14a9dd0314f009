//! The balances of a run: energy, propellant mass and electric charge, integrated during the run with constant memory.
//!
//! ```text
//! adaptive steps   ∫ rate dt by Simpson's rule on the dense output, with intervals halved until the result converges
//! fixed steps      the trapezoidal rule with the values at ticks and events, without further evaluations; the average of a variable
//!                  that the integrator averages over a step (pulses of thrusters)
//! work             work on the mechanism by methods of first order, which hold forces over a step: a₀ (b₀ + b₁)/2 for a product a b
//! stored           difference between the values at the end and at the start
//! ```
//! A sampled output jumps at a tick. The last stage of an `rk4` step has the values right before the jump. The trapezoidal rule uses the new value on
//! both sides of the tick with other fixed steps, and for variables that no stage evaluates. The error is then about h |Δ|/2 for a change Δ of the
//! rate and a step h that ends at a sample; with `rk4`, a tenth of this. The sum of these errors is the uncertainty of a term.
mod report;

pub use report::{Balances, Part, Report};

use linkwork_runtime::balance::{Kind, PartTerms, Quantity, terms};
use linkwork_runtime::{Account, ObserverRequest, Place, Program, Stretch};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A product of columns: factor, column, second column.
type Product = (f64, u32, Option<u32>);

/// A term of a part that is integrated from a rate.
#[derive(Clone, Debug)]
struct Flow {
    part: usize,
    quantity: Quantity,
    kind: Kind,
    name: String,
    products: std::ops::Range<usize>,
}

/// An interval whose end value is not known yet: its length, whether its method is of first order, and whether it ends at a sample.
#[derive(Clone, Copy, Debug, Default)]
struct Pending {
    length: f64,
    first_order: bool,
    sampled: bool,
}

/// The flows to which an interval is added.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Which {
    All,
    /// Those whose values at the end are known.
    Known,
    /// Those to which it has not been added yet.
    Rest,
}

/// An amount that is stored in a part.
#[derive(Clone, Debug)]
struct Stock {
    part: usize,
    quantity: Quantity,
    name: String,
    column: u32,
}

/// A balance term that a block integrates itself.
#[derive(Clone, Debug)]
struct BlockTerm {
    part: usize,
    quantity: Quantity,
    account: Account,
    name: &'static str,
}

/// Integrals so far, of flows and then of the blocks' own terms; first and last amounts, of stocks and then of the blocks' own terms.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Sums {
    keys: Vec<String>,
    sum: Vec<f64>,
    /// ∫ |rate| dt
    through: Vec<f64>,
    /// Work as computed by methods of first order; equal to `sum` for other methods.
    held: Vec<f64>,
    /// Bound of the error of `sum` from jumps at samples, and from the blocks' own terms between ticks.
    uncertainty: Vec<f64>,
    first: Vec<f64>,
    last: Vec<f64>,
    /// Largest magnitude of each amount.
    #[serde(default)]
    largest: Vec<f64>,
    /// A state was set from outside, or a variable was pinned: no balance has to close.
    #[serde(default)]
    changed: bool,
}

/// The balances of a run.
#[derive(Clone, Debug, Default)]
pub struct Balance {
    parts: Vec<PartTerms>,
    flows: Vec<Flow>,
    products: Vec<Product>,
    stocks: Vec<Stock>,
    own: Vec<BlockTerm>,
    places: Vec<Place>,
    accounts: Vec<(String, usize)>,
    sums: Sums,
    /// Values at the beginning of an interval whose end is not known yet, its length, and whether its method is of first order.
    begin: Vec<f64>,
    pending: Pending,
    /// Averages over the interval, NaN for variables that are not averages; values at its end that are known already, otherwise NaN; the flows to
    /// which the pending interval has been added.
    average: Vec<f64>,
    end: Vec<f64>,
    added: Vec<bool>,
    /// Instant and rates of the blocks' own terms at the last tick.
    row: (f64, Vec<f64>),
    /// Rates at an instant, sums of a quadrature rule, and the previous estimate.
    rates: Vec<f64>,
    rule: Vec<f64>,
    estimate: Vec<f64>,
    inner: Vec<f64>,
    /// Largest mean rate of each flow over a step.
    size: Vec<f64>,
    /// First column of the variables, and of the blocks' own terms.
    first: usize,
    first_own: usize,
}

/// Accepted error of an integral over a step, relative to the largest rate, and largest number of halvings of an interval.
const ACCURACY: f64 = 1e-5;
const HALVINGS: u32 = 7;

impl Balance {
    /// Returns the balances of a program; `None` if it does not have any term.
    pub fn new(program: &Program) -> Option<Balance> {
        let variables = &program.phases[0].plan.variables;
        let mut all = Balance { parts: terms(program), ..Balance::default() };
        let mut columns: BTreeMap<String, Option<u32>> = BTreeMap::new();
        let mut places = Vec::new();
        let mut column = |path: &String| {
            *columns.entry(path.clone()).or_insert_with(|| {
                let place = variables.get(path)?.place;
                places.push(place);
                Some(places.len() as u32 - 1)
            })
        };
        for (k, part) in all.parts.iter().enumerate() {
            for term in &part.terms {
                let (quantity, name) = (term.quantity, term.name.clone());
                if let (Kind::Stored, [(_, path, _)]) = (term.kind, &term.of[..]) {
                    let stock =
                        column(path).map(|column| Stock { part: k, quantity, name, column });
                    all.stocks.extend(stock);
                    continue;
                }
                let begin = all.products.len();
                for (factor, a, b) in &term.of {
                    let (Some(a), b) = (column(a), b.as_ref().map(&mut column)) else { continue };
                    match b {
                        Some(None) => {}
                        b => all.products.push((*factor, a, b.flatten())),
                    }
                }
                let products = begin..all.products.len();
                all.flows.push(Flow { part: k, quantity, kind: term.kind, name, products });
            }
            if !part.own.known.is_empty() {
                all.accounts.push((part.part.clone(), part.own.known.len()));
                all.own.extend(part.own.known.iter().map(|own| BlockTerm {
                    part: k,
                    quantity: own.quantity,
                    account: own.account,
                    name: own.name,
                }));
            }
        }
        all.places = places;
        let (flows, own) = (all.flows.len(), all.own.len());
        let keys = all.flows.iter().map(|f| {
            format!("{} {:?} {:?} {}", all.parts[f.part].part, f.quantity, f.kind, f.name)
        });
        let stocks = all
            .stocks
            .iter()
            .map(|s| format!("{} {:?} {}", all.parts[s.part].part, s.quantity, s.name));
        let owned = all.own.iter().map(|o| format!("{} {}", all.parts[o.part].part, o.name));
        all.sums = Sums {
            keys: keys.chain(stocks).chain(owned).collect(),
            sum: vec![0.0; flows + own],
            through: vec![0.0; flows + own],
            held: vec![0.0; flows],
            uncertainty: vec![0.0; flows + own],
            first: vec![f64::NAN; all.stocks.len() + own],
            last: vec![f64::NAN; all.stocks.len() + own],
            largest: vec![0.0; all.stocks.len() + own],
            changed: false,
        };
        for room in [&mut all.begin, &mut all.average, &mut all.end] {
            *room = vec![f64::NAN; all.places.len()];
        }
        all.added = vec![false; flows];
        all.row = (f64::NAN, vec![f64::NAN; own]);
        for room in
            [&mut all.rates, &mut all.rule, &mut all.estimate, &mut all.inner, &mut all.size]
        {
            *room = vec![0.0; flows];
        }
        (!all.parts.is_empty()).then_some(all)
    }

    /// Adds the variables that it observes.
    pub(crate) fn want(&mut self, wanted: &mut ObserverRequest) {
        self.first = wanted.places.len() + wanted.sparing.len();
        wanted.sparing.extend(&self.places);
        self.first_own = self.first + self.places.len();
        wanted.accounts.extend(self.accounts.iter().cloned());
    }

    /// Returns the state for a checkpoint.
    pub(crate) fn save(&self) -> Saved {
        Saved(self.sums.clone())
    }

    /// Restores the state from a checkpoint of a run with the same terms. The balances of another run start again.
    pub(crate) fn restore(&mut self, saved: Saved) {
        let same = saved.0.keys == self.sums.keys
            && saved.0.sum.len() == self.sums.sum.len()
            && saved.0.through.len() == self.sums.through.len()
            && saved.0.held.len() == self.sums.held.len()
            && saved.0.uncertainty.len() == self.sums.uncertainty.len()
            && saved.0.first.len() == self.sums.first.len()
            && saved.0.last.len() == self.sums.last.len()
            && saved.0.largest.len() == self.sums.largest.len();
        if same {
            self.sums = saved.0;
        }
    }

    /// Notes that a state or a pin was changed from outside, which adds or removes an unknown amount.
    pub(crate) fn changed(&mut self) {
        self.sums.changed = true;
    }

    /// Processes the values at an instant.
    pub(crate) fn instant(&mut self, t: f64, values: &[f64]) {
        let own = &values[self.first..self.first_own];
        self.close(own);
        let Balance { sums, stocks, own: accounts, .. } = self;
        let reported = &values[self.first_own..];
        let amounts = stocks.iter().map(|s| own[s.column as usize]).chain(reported.iter().copied());
        for (k, y) in amounts.enumerate() {
            if y.is_finite() {
                sums.last[k] = y;
                sums.largest[k] = sums.largest[k].max(y.abs());
                if sums.first[k].is_nan() {
                    sums.first[k] = y;
                }
            }
        }
        let (flows, h) = (self.flows.len(), t - self.row.0);
        for (k, y) in reported.iter().enumerate().take(accounts.len()) {
            let before = self.row.1[k];
            if h > 0.0 && before.is_finite() && y.is_finite() {
                sums.sum[flows + k] += 0.5 * h * (before + y);
                sums.through[flows + k] += 0.5 * h * (before.abs() + y.abs());
                // Ticks can be far apart, so accumulate a bound of the error of the trapezoidal
                // rule.
                sums.uncertainty[flows + k] += 0.5 * h * (y - before).abs();
            }
            self.row.1[k] = *y;
        }
        self.row.0 = t;
    }

    /// Adds the pending interval, whose end has these values.
    fn close(&mut self, end: &[f64]) {
        let pending = std::mem::take(&mut self.pending);
        if pending.length > 0.0 {
            let begin = std::mem::take(&mut self.begin);
            self.straight(pending, &begin, end, Which::Rest);
            self.begin = begin;
            self.added.fill(false);
        }
    }

    /// Adds an interval from the values at its ends.
    fn straight(&mut self, over: Pending, begin: &[f64], end: &[f64], which: Which) {
        let Pending { length, first_order, sampled } = over;
        for (k, flow) in self.flows.iter().enumerate() {
            let products = &self.products[flow.products.clone()];
            match which {
                Which::All => {}
                Which::Known => {
                    let known = |column: u32| !end[column as usize].is_nan();
                    self.added[k] =
                        products.iter().all(|(_, a, b)| known(*a) && b.is_none_or(known));
                    if !self.added[k] {
                        continue;
                    }
                }
                Which::Rest if self.added[k] => continue,
                Which::Rest => {}
            }
            let ends = |column: u32| {
                let (column, average) = (column as usize, self.average[column as usize]);
                match average.is_nan() {
                    true => (begin[column], end[column]),
                    false => (average, average),
                }
            };
            let (mut from, mut to, mut held) = (0.0, 0.0, 0.0);
            for (factor, a, b) in products {
                let ((a0, a1), (b0, b1)) = (ends(*a), b.map_or((1.0, 1.0), ends));
                from += factor * a0 * b0;
                to += factor * a1 * b1;
                // A force is held over the step, and its work uses the mean of the velocities at both ends.
                held += if b.is_some() {
                    factor * a0 * 0.5 * (b0 + b1)
                } else {
                    factor * 0.5 * (a0 + a1)
                };
            }
            // A part that appears or disappears with a phase has a value at one end only.
            let mean = match (from.is_finite(), to.is_finite()) {
                (true, true) => 0.5 * (from + to),
                (true, false) => from,
                (false, true) => to,
                (false, false) => continue,
            };
            let work = if first_order && held.is_finite() { held } else { mean };
            self.sums.sum[k] += length * mean;
            self.sums.held[k] += length * work;
            self.sums.through[k] += length * mean.abs();
            if sampled && from.is_finite() && to.is_finite() {
                // The last stage of a step is near its end, but not at it.
                let share = if which == Which::Known { 0.05 } else { 0.5 };
                self.sums.uncertainty[k] += share * length * (to - from).abs();
            }
            self.size[k] = self.size[k].max(from.abs()).max(to.abs());
        }
    }

    /// Processes the values over an interval.
    pub(crate) fn stretch(&mut self, over: &mut Stretch<'_>) {
        let own = self.first..self.first_own;
        let pending = Pending {
            length: over.length(),
            first_order: over.is_first_order(),
            sampled: over.ends_at_sample(),
        };
        if self.pending.length > 0.0 {
            // The values at the start of this interval are the end values of the previous one.
            self.close(&over.start()[own.clone()]);
        }
        for (k, average) in self.average.iter_mut().enumerate() {
            *average = over.average(self.first + k).unwrap_or(f64::NAN);
        }
        if !over.has_all() {
            self.begin.copy_from_slice(&over.start()[own]);
            if pending.sampled && !pending.first_order {
                for (k, end) in self.end.iter_mut().enumerate() {
                    *end = over.before_end(self.first + k).unwrap_or(f64::NAN);
                }
                let (begin, end) = (std::mem::take(&mut self.begin), std::mem::take(&mut self.end));
                self.straight(pending, &begin, &end, Which::Known);
                (self.begin, self.end) = (begin, end);
            }
            self.pending = pending;
        } else if over.is_wide() {
            self.dense(over);
        } else {
            let (begin, end) = (&over.start()[own.clone()], &over.end()[own]);
            self.straight(Pending { sampled: false, ..pending }, begin, end, Which::All);
        }
    }

    /// Computes the rates of all flows at these values, into `rates`.
    fn evaluate(&mut self, values: &[f64]) {
        let values = &values[self.first..self.first_own];
        for (rate, flow) in self.rates.iter_mut().zip(&self.flows) {
            let each = |(factor, a, b): &Product| {
                factor * values[*a as usize] * b.map_or(1.0, |b| values[b as usize])
            };
            let sum: f64 = self.products[flow.products.clone()].iter().map(each).sum();
            *rate = if sum.is_finite() { sum } else { 0.0 };
        }
    }

    /// Integrates an adaptive step with Simpson's rule on the dense output.
    fn dense(&mut self, over: &mut Stretch<'_>) {
        let length = over.length();
        self.evaluate(over.start());
        self.rule.copy_from_slice(&self.rates);
        self.evaluate(over.end());
        for k in 0..self.flows.len() {
            self.size[k] = self.size[k].max(self.rule[k].abs()).max(self.rates[k].abs());
            self.rule[k] = 0.5 * (self.rule[k] + self.rates[k]);
        }
        self.estimate.copy_from_slice(&self.rule);
        // `rule` is the result of the trapezoidal rule with n panels: half of the sum of the ends,
        // and the points between.
        let mut panels = 1_u32;
        'halving: for level in 0..=HALVINGS {
            self.inner.fill(0.0);
            for k in 0..panels {
                let part = (f64::from(k) + 0.5) / f64::from(panels);
                let Some(values) = over.at(part) else { break 'halving };
                self.evaluate(values);
                self.inner.iter_mut().zip(&self.rates).for_each(|(sum, rate)| *sum += rate);
            }
            let n = f64::from(panels);
            let mut agrees = true;
            for k in 0..self.flows.len() {
                let (before, halved) =
                    (self.rule[k] / n, (self.rule[k] + self.inner[k]) / (2.0 * n));
                let simpson = (4.0 * halved - before) / 3.0;
                self.size[k] = self.size[k].max(simpson.abs());
                // The first estimate is the trapezoidal rule. The error of Simpson's rule is about the square of its error.
                let accuracy = if level == 0 { ACCURACY.sqrt() } else { ACCURACY };
                agrees &= (simpson - self.estimate[k]).abs() <= accuracy * self.size[k];
                self.estimate[k] = simpson;
                self.rule[k] += self.inner[k];
            }
            panels *= 2;
            if agrees {
                break;
            }
        }
        for k in 0..self.flows.len() {
            self.sums.sum[k] += length * self.estimate[k];
            self.sums.held[k] += length * self.estimate[k];
            self.sums.through[k] += length * self.estimate[k].abs();
        }
    }
}

/// The state of balances in a checkpoint.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Saved(Sums);
