//! Fields: shared worlds that change. The field here is a row of cells with sand that walkers carry away; what is
//! left slows them down.
use crate::common;
use common::*;
use linkwork_runtime::prelude::*;
use linkwork_runtime::*;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The ground.
#[derive(Params, Clone, Debug)]
pub struct SandParams {
    /// Length of a cell.
    #[param(unit = "m", default = 0.25)]
    cell: f64,
}
/// What a walker does in a row.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Dug {
    /// Where.
    #[port("m")]
    pub at: f64,
    /// How much.
    #[port("kg")]
    pub sand: f64,
}
/// Sand that was dug, by cells, and the order in which it came.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Pits {
    cells: Vec<(i64, f64)>,
    last: f64,
    rows: u64,
}
impl Shows for Pits {
    const KIND: &'static str = "sand";
}
/// Sand on the ground.
pub struct Sand {
    p: SandParams,
}
impl Sand {
    fn cell(&self, at: f64) -> i64 {
        (at / self.p.cell).floor() as i64
    }
    fn dug(&self, pits: &Pits, at: f64) -> f64 {
        let found = pits.cells.iter().find(|c| c.0 == self.cell(at));
        found.map_or(0.0, |c| c.1)
    }
}
/// Sand that goes when it is dug.
#[field("t.sand")]
impl Field for Sand {
    type Params = SandParams;
    type Data = Pits;
    type Imprint = Dug;
    fn start(&self) -> Pits {
        Pits::default()
    }
    fn update(&self, c: &Clock, pits: &mut Pits, imprints: &[Dug], _: &[f64]) {
        pits.rows = c.n;
        for dug in imprints {
            let cell = self.cell(dug.at);
            match pits.cells.iter_mut().find(|c| c.0 == cell) {
                Some(c) => c.1 += dug.sand,
                None => pits.cells.push((cell, dug.sand)),
            }
            // This update is not commutative, so the result shows the order of the parts.
            pits.last = 0.5 * pits.last + dug.at;
        }
    }
}
/// How fast a walker walks.
#[derive(Params, Clone, Debug)]
pub struct WalkerParams {
    /// Speed on untouched ground.
    #[param(unit = "m/s", default = 1.0)]
    speed: f64,
}
/// What a walker shows.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Steps {
    /// Where it is.
    #[port("m", bind = "field")]
    pub at: f64,
    /// What it digs.
    #[port("kg", bind = "field")]
    pub sand: f64,
    /// Sand that is gone where it is.
    #[port("kg")]
    pub gone: f64,
    /// Sum over all that was dug last, in path order.
    #[port("m")]
    pub last: f64,
}
/// Where it is.
#[derive(State, Clone, Copy, Debug)]
pub struct At {
    /// Way.
    #[port("m")]
    at: f64,
}
/// Walks.
pub struct Walker {
    p: WalkerParams,
}
/// Walks, and digs where it is.
#[model("t.walker")]
impl Model for Walker {
    type Params = WalkerParams;
    type Outputs = Steps;
    type State = At;
    type Store = View<Pits>;
    fn outputs(&self, x: &At, store: &View<Pits>) -> Steps {
        let (gone, last) =
            store.with::<Sand>().map_or((0.0, 0.0), |(f, p)| (f.dug(p, x.at), p.last));
        Steps { at: x.at, sand: 0.1 * self.p.speed, gone, last }
    }
    fn derivatives(&self, x: &At, store: &View<Pits>) -> At {
        let gone = store.with::<Sand>().map_or(0.0, |(f, p)| f.dug(p, x.at));
        At { at: self.p.speed / (1.0 + gone) }
    }
}
/// What a reader without state sees.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Count {
    /// Rows that the field has had.
    #[port("1")]
    pub rows: f64,
}
/// Looks.
pub struct Watcher {}
/// Only looks.
#[model("t.watcher")]
impl Model for Watcher {
    type FeedthroughOutputs = Count;
    type Store = View<Pits>;
    fn feedthrough(&self, store: &View<Pits>) -> Count {
        Count { rows: store.get().map_or(-1.0, |pits| pits.rows as f64) }
    }
}
/// Half a writer.
pub struct Half {}
/// Where it digs, and no more.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Where {
    /// Where.
    #[port("m", bind = "field")]
    pub at: f64,
}
/// Writes half of an imprint.
#[model("t.half")]
impl Model for Half {
    type Outputs = Where;
    fn outputs(&self) -> Where {
        Where { at: 0.0 }
    }
}

fn catalogue() -> Catalogue {
    let mut all = common::catalogue();
    for entry in [
        Entry::field::<Sand>(),
        Entry::model::<Walker>(),
        Entry::model::<Watcher>(),
        Entry::model::<Half>(),
    ] {
        all.add(entry).unwrap();
    }
    all
}
fn compiled(s: &Spec) -> Arc<Plan> {
    Arc::new(compile(s, &catalogue(), &Files::default()).unwrap())
}
fn seconds(t: f64) -> Seconds {
    Seconds::new((t * 1000.0).round() as u128, 1000).unwrap()
}
fn walkers(integrator: Integrator) -> Spec {
    let parts = vec![
        part("a", "t.walker", &[("speed", 1.0)], None),
        part("b", "t.walker", &[("speed", 2.0)], None),
        part("eye", "t.watcher", &[], None),
        part("late", "t.watcher", &[], Some("0.2 s")),
        part("sand", "t.sand", &[], Some("0.1 s")),
    ];
    Spec { integrator, step: Seconds::new(5, 100).unwrap(), ..spec(parts, &[]) }
}

#[test]
fn readers_see_the_last_row_and_writers_change_the_next() {
    let plan = compiled(&walkers(Integrator::Rk4));
    let mut sim = Simulation::new(plan);
    // The first update of the field includes the work of tick 0, when both walkers were in cell 0.
    assert!((sim.get("a.gone").unwrap() - 0.3).abs() < 1e-15);
    // After that update both walkers move on 0.3 kg of removed sand until they leave the cell.
    sim.run_until(seconds(0.05)).unwrap();
    assert!((sim.get("a.at").unwrap() - 0.05 / 1.3).abs() < 1e-12);
    assert!((sim.get("b.at").unwrap() - 0.1 / 1.3).abs() < 1e-12);
    sim.run_until(seconds(0.1)).unwrap();
    assert!((sim.get("b.gone").unwrap() - 0.6).abs() < 1e-15);
    // Updates occur in the order of paths: ((a₀/2 + b₀)/2 + a₁)/2 + b₁.
    let last = 0.5 * sim.get("a.at").unwrap() + sim.get("b.at").unwrap();
    assert!((sim.get("a.last").unwrap() - last).abs() < 1e-15);
    sim.run_until(seconds(1.0)).unwrap();
    assert_eq!(sim.get("eye.rows").unwrap(), 10.0);
    // A sampled reader reads the field as it was before the update at this row.
    assert_eq!(sim.get("late.rows").unwrap(), 9.0);
}

#[test]
fn split_equals_straight_and_forks_do_not_know_of_each_other() {
    for integrator in Integrator::ALL.map(|(_, i)| i) {
        let plan = compiled(&walkers(integrator));
        let mut straight = Simulation::new(plan.clone());
        straight.run_until(seconds(3.0)).unwrap();
        let mut sim = Simulation::new(plan.clone());
        let mut snapshot = Default::default();
        for k in 1..=30 {
            sim.run_until(seconds(0.1 * f64::from(k))).unwrap();
            match k % 3 {
                0 => {
                    let checkpoint = sim.checkpoint("").unwrap();
                    sim = Simulation::new(plan.clone());
                    sim.restore(&checkpoint).unwrap();
                }
                1 => {
                    // Changes from here on do not affect the other simulation.
                    let mut other = sim.fork();
                    other.set("a.state.at", 0.1).unwrap();
                    other.run_until(seconds(0.1 * f64::from(k) + 0.5)).unwrap();
                }
                _ => {
                    sim.save_into(&mut snapshot);
                    sim.run_until(seconds(0.1 * f64::from(k) + 0.7)).unwrap();
                    sim.load_from(&snapshot).unwrap();
                }
            }
        }
        assert_eq!(sim.state(), straight.state(), "{integrator:?}");
        assert_eq!(sim.hash(), straight.hash(), "{integrator:?}");
        assert!(straight.get("a.gone").unwrap() > 0.0);
    }
}

#[test]
fn no_order_of_parts_matters() {
    let straight = compiled(&walkers(Integrator::Rk4));
    let mut turned = walkers(Integrator::Rk4);
    turned.parts.reverse();
    let turned = compiled(&turned);
    assert_eq!(straight.hash(), turned.hash());
    let [mut a, mut b] = [straight, turned].map(Simulation::new);
    a.run_until(seconds(2.0)).unwrap();
    b.run_until(seconds(2.0)).unwrap();
    assert_eq!(a.hash(), b.hash());
}

#[test]
fn without_a_field_readers_see_nothing() {
    let s = spec(vec![part("a", "t.walker", &[], None), part("eye", "t.watcher", &[], None)], &[]);
    let mut sim = Simulation::new(compiled(&s));
    sim.run_until(seconds(1.0)).unwrap();
    assert_eq!(sim.get("a.gone").unwrap(), 0.0);
    assert_eq!(sim.get("eye.rows").unwrap(), -1.0);
}

#[test]
fn the_nearest_field_is_read_unless_one_is_bound() {
    let parts = || {
        vec![
            part("north.sand", "t.sand", &[], Some("0.1 s")),
            part("north.walker", "t.walker", &[], None),
            part("south.sand", "t.sand", &[], Some("0.1 s")),
            part("south.walker", "t.walker", &[], None),
            part("eye", "t.watcher", &[], None),
        ]
    };
    let bind = |part: &str, field: &str| BindSpec {
        part: part.into(),
        bind: "field".into(),
        target: BindTarget::Field(field.into()),
        origin: Origin::NONE,
    };
    let text = |s: &Spec| compile(s, &catalogue(), &Files::default()).err().unwrap().to_string();
    let s = spec(parts(), &[]);
    let told = text(&s);
    assert!(told.contains("`eye` binds to a field of sand, but there are 2"), "{told}");
    assert!(told.contains("bind `field` to one of: north.sand, south.sand"), "{told}");

    let mut s = spec(parts(), &[]);
    s.binds = vec![bind("eye", "south.sand"), bind("north.walker", "south.sand")];
    let plan = compiled(&s);
    let readers: Vec<Vec<&str>> = (plan.fields.iter())
        .map(|f| f.readers.iter().map(|&r| &*plan.parts[r as usize].path).collect())
        .collect();
    assert_eq!(readers, [vec![], vec!["eye", "north.walker", "south.walker"]]);
    // Inside `south`, the name without a path is enough.
    s.binds.push(bind("south.walker", "sand"));
    assert_eq!(compiled(&s).fields, plan.fields);

    s.binds[0] = bind("eye", "east.sand");
    let told = text(&s);
    assert!(told.contains("`eye`: there is no field of sand `east.sand`"), "{told}");
    s.binds[0] = BindSpec { target: BindTarget::Node("rock".into()), ..bind("eye", "") };
    let told = text(&s);
    assert!(told.contains("`eye` binds `field` to an item that is not a field"), "{told}");
}

#[test]
fn half_an_imprint_and_a_field_without_a_rate_are_refused() {
    let parts = vec![part("half", "t.half", &[], None), part("sand", "t.sand", &[], None)];
    let faults = compile(&spec(parts, &[]), &catalogue(), &Files::default()).err().unwrap();
    let told = faults.to_string();
    assert!(told.contains("`half` writes to `sand`, but not sand"), "{told}");
    assert!(told.contains("`sand` (t.sand) is sampled, but has no rate"), "{told}");
}

#[test]
fn a_field_goes_over_to_the_next_phase() {
    let mut second = walkers(Integrator::Rk4);
    second.parts.retain(|p| p.path != "b");
    let [first, second] = [walkers(Integrator::Rk4), second].map(|s| compiled(&s));
    let mut sim = Simulation::new(first);
    sim.run_until(seconds(1.0)).unwrap();
    let (gone, last) = (sim.get("a.gone").unwrap(), sim.get("a.last").unwrap());
    sim.move_to(second).unwrap();
    assert_eq!((sim.get("a.gone").unwrap(), sim.get("a.last").unwrap()), (gone, last));
    sim.run_until(seconds(1.1)).unwrap();
    let at = sim.get("a.at").unwrap();
    assert!((sim.get("a.last").unwrap() - (0.5 * last + at)).abs() < 1e-15);
}
