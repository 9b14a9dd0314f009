//! Rates: the common tick, and the static table of the work that is due at each row.
use super::flat::Variability;
use super::order::Order;
use super::part::Part;
use crate::author::time::Seconds;
use crate::author::value::{Fault, Origin};
use crate::plan::compiled::{FieldPlan, Row, TickWork};
use crate::plan::spec::Spec;
use std::collections::{BTreeMap, BTreeSet};

/// Largest number of rows; rates with more rows are rejected, because they have no small common period.
const ROWS_MAX: u64 = 1 << 20;

/// Checks the rates and gives each sampled part its period and offset in ticks.
/// `tick`: of the whole program.
pub(crate) fn rates(
    spec: &Spec,
    parts: &mut [Part<'_>],
    tick: Option<Seconds>,
    faults: &mut Vec<Fault>,
) {
    let base = match base(spec, parts, tick) {
        Some(base) => base,
        None => {
            faults.push(
                Fault::new(Origin::NONE, "the sample periods and the step have no common tick")
                    .help("choose rates that are multiples of each other"),
            );
            return;
        }
    };
    for part in parts {
        let p = part.spec;
        let d = part.prototype.description();
        match p.rate {
            None if d.functions.update && d.continuous.is_empty() => faults.push(
                Fault::new(
                    p.origin,
                    format!("`{}` ({}) is sampled, but has no rate", p.path, p.model),
                )
                .help("write `rate: \"50 Hz\"`"),
            ),
            None if d.functions.update => faults.push(
                Fault::new(
                    p.origin,
                    format!("`{}` ({}) has updates, but no rate", p.path, p.model),
                )
                .help("write `rate: \"50 Hz\"`"),
            ),
            None => {}
            Some(_) if !d.functions.update && !d.continuous.is_empty() => faults.push(
                Fault::new(
                    p.rate_origin,
                    format!("`{}` ({}) is continuous: a rate has no effect on it", p.path, p.model),
                )
                .help("remove the rate"),
            ),
            Some(rate) if rate.num == 0 => {
                faults.push(Fault::new(p.rate_origin, format!("`{}`: the period is zero", p.path)));
            }
            Some(rate) => {
                let (period, offset) = (rate.ticks(base), p.offset.ticks(base));
                if let (Some(period), Some(offset)) = (period, offset) {
                    if offset >= period {
                        faults.push(
                            Fault::new(
                                p.rate_origin,
                                format!(
                                    "`{}`: the offset {} is not below the period {rate}",
                                    p.path, p.offset
                                ),
                            )
                            .help("write an offset below the period"),
                        );
                    }
                    part.wiring.period = period;
                    part.wiring.offset = offset;
                    part.wiring.period_s = rate.seconds();
                }
            }
        }
    }
}

fn base(spec: &Spec, parts: &[Part<'_>], tick: Option<Seconds>) -> Option<Seconds> {
    let step = tick.map_or(Some(spec.step), |tick| spec.step.common(tick))?;
    parts.iter().try_fold(step, |base, part| match part.spec.rate {
        Some(rate) if rate.num > 0 => {
            let base = base.common(rate)?;
            if part.spec.offset.num > 0 { base.common(part.spec.offset) } else { Some(base) }
        }
        _ => Some(base),
    })
}

/// The table.
pub(crate) struct Timing {
    pub base: Seconds,
    pub rows: Vec<Row>,
    pub works: Vec<TickWork>,
}

pub(crate) fn table(
    spec: &Spec,
    parts: &[Part<'_>],
    tick: Option<Seconds>,
    order: &Order,
    fields: &[FieldPlan],
) -> Result<Timing, Vec<Fault>> {
    let none = || {
        vec![
            Fault::new(Origin::NONE, "the sample periods and the step have no small common period")
                .help(format!("they are: {}", listing(spec, parts))),
        ]
    };
    let base = base(spec, parts, tick).ok_or_else(none)?;
    let step = spec.step.ticks(base).ok_or_else(none)?;
    let mut classes: BTreeSet<(u64, u64)> = parts
        .iter()
        .filter(|p| p.wiring.period > 0)
        .map(|p| (p.wiring.period, p.wiring.offset))
        .collect();
    classes.insert((step, 0));
    let hyper = classes
        .iter()
        .try_fold(1u64, |h, (p, _)| (h / gcd(h, *p)).checked_mul(*p))
        .ok_or_else(none)?;
    if classes.iter().map(|(p, _)| hyper / p).sum::<u64>() > ROWS_MAX {
        return Err(none());
    }
    let ticks: BTreeSet<u64> =
        classes.iter().flat_map(|&(p, o)| (0..hyper / p).map(move |k| k * p + o)).collect();
    let ticks: Vec<u64> = ticks.into_iter().collect();
    let mut known: BTreeMap<TickWork, u32> = BTreeMap::new();
    let mut by_classes: BTreeMap<Vec<bool>, u32> = BTreeMap::new();
    let mut rows = Vec::with_capacity(ticks.len());
    for (k, &at) in ticks.iter().enumerate() {
        let due: Vec<bool> = classes.iter().map(|&(p, o)| at % p == o).collect();
        let index = match by_classes.get(&due) {
            Some(&index) => index,
            None => {
                let work = work_at(at, parts, order, fields);
                let n = known.len() as u32;
                let index = *known.entry(work).or_insert(n);
                by_classes.insert(due, index);
                index
            }
        };
        let next = ticks.get(k + 1).copied().unwrap_or(hyper + ticks[0]);
        rows.push(Row { at, gap: next - at, work: index });
    }
    let mut works = vec![TickWork::default(); known.len()];
    for (work, index) in known {
        works[index as usize] = work;
    }
    Ok(Timing { base, rows, works })
}

fn work_at(at: u64, parts: &[Part<'_>], order: &Order, fields: &[FieldPlan]) -> TickWork {
    let due = |set: &BTreeSet<(u64, u64)>| set.iter().any(|&(p, o)| at % p == o);
    let ops = (0..order.ops.len())
        .filter(|&k| match &order.variability[k] {
            Variability::Constant => false,
            Variability::Sampled(set) => due(set),
            Variability::Continuous => true,
        })
        .map(|k| k as u32)
        .collect();
    let updated = |k: u32| {
        let p = &parts[k as usize];
        let w = &p.wiring;
        p.prototype.description().functions.update && w.period > 0 && at % w.period == w.offset
    };
    let field = |k: u32| fields.iter().any(|f| f.block == k);
    let updates: Vec<u32> = (0..parts.len() as u32).filter(|&k| updated(k) && !field(k)).collect();
    let continuous = |k: &u32| parts[*k as usize].wiring.period == 0;
    let fields: Vec<(u32, &FieldPlan)> =
        (0..).zip(fields).filter(|(_, f)| updated(f.block)).collect();
    let refresh = updates.iter().any(|k| order.hybrid.contains(k))
        || fields.iter().any(|(_, f)| f.readers.iter().any(continuous));
    TickWork { ops, updates, fields: fields.into_iter().map(|(k, _)| k).collect(), refresh }
}

/// Returns the greatest tick of which the step and all periods and offsets are multiples.
pub(crate) fn common_tick(spec: &Spec) -> Option<Seconds> {
    let times = spec.parts.iter().flat_map(|p| p.rate.into_iter().chain([p.offset]));
    times.filter(|t| t.num > 0).try_fold(spec.step, Seconds::common)
}

fn listing(spec: &Spec, parts: &[Part<'_>]) -> String {
    let mut all = vec![format!("step {}", spec.step)];
    all.extend(parts.iter().filter_map(|p| p.spec.rate.map(|r| format!("{} {r}", p.spec.path))));
    all.join(", ")
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}
