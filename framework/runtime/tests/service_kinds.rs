//! Kinds of services that a library defines: the runtime finds, checks and reports them as its own.
use crate::common::*;
use linkwork_runtime::*;
use linkwork_surroundings::prelude::*;

/// Water.
mod water {
    use linkwork_runtime::{BuildError, Provided};

    /// A sea.
    pub trait Sea: Send + Sync {
        /// Pressure (Pa) at a depth (m).
        fn pressure(&self, depth: f64) -> f64;
        /// Time (s) up to which it answers.
        fn end(&self) -> f64;
    }

    impl Provided for dyn Sea {
        const WORD: &'static str = "sea";
        fn failure(&self, t: f64) -> Option<BuildError> {
            (t > self.end())
                .then(|| BuildError::new("the tide tables end").help("end the run earlier"))
        }
    }
}
use water::Sea;

/// Density and end.
#[derive(Params, Clone, Debug)]
pub struct Water {
    /// Density.
    #[param(unit = "kg/m^3")]
    density: f64,
    /// Time up to which it answers.
    #[param(unit = "s", default = 1e9)]
    end: f64,
}
pub struct StillWater(Water);
impl Sea for StillWater {
    fn pressure(&self, depth: f64) -> f64 {
        self.0.density * 9.81 * depth
    }
    fn end(&self) -> f64 {
        self.0.end
    }
}
/// Water at rest.
#[service("t.still_water", water::Sea)]
impl Service for StillWater {
    type Params = Water;
    fn build(p: Water, _: &Files) -> Result<Self, BuildError> {
        Ok(StillWater(p))
    }
}

/// The sea.
#[derive(Params, Clone, Debug)]
pub struct OfSea {
    /// The sea.
    #[param(service)]
    sea: Handle<dyn Sea>,
}
pub struct Gauge {
    p: OfSea,
}
/// Pressure at a depth.
#[model("t.gauge")]
impl Model for Gauge {
    type Params = OfSea;
    type FeedthroughInputs = U;
    type FeedthroughOutputs = One;
    fn feedthrough(&self, u: &U) -> One {
        One { y: self.p.sea.pressure(u.u) }
    }
}

fn library() -> Catalogue {
    let own = vec![Entry::service::<StillWater>(), Entry::model::<Gauge>()];
    Catalogue::new([entries(), own])
}

fn gauge(seas: &[(&str, &[(&str, f64)])]) -> Result<Plan, Faults> {
    let mut parts =
        vec![part("one", "t.gain", &[("k", 3.0)], None), part("gauge", "t.gauge", &[], None)];
    parts.extend(seas.iter().map(|(path, p)| part(path, "t.still_water", p, None)));
    compile(&spec(parts, &["one.y -> gauge.u"]), &library(), &Files::default())
}

fn fault(seas: &[(&str, &[(&str, f64)])]) -> String {
    gauge(seas).err().unwrap().to_string()
}

#[test]
fn a_model_uses_a_service_of_a_kind_of_its_library() {
    let plan = gauge(&[("sea", &[("density", 1025.0)])]).unwrap_or_else(|e| panic!("{e}"));
    let sim = Simulation::new(plan.into());
    assert_eq!(sim.get("gauge.y").unwrap(), 1025.0 * 9.81 * 3.0);
    let found = sim.plan().services.first::<dyn Sea>().unwrap();
    assert_eq!((found.path(), found.pressure(1.0)), ("sea", 1025.0 * 9.81));
    let (_, object) = sim.plan().services.iter().next().unwrap();
    assert_eq!((object.kind(), object.kind().text()), (ServiceKind::of::<dyn Sea>(), "sea"));
    assert!(object.get::<dyn Gravity>().is_none());
    assert_ne!(object.kind(), ServiceKind::of::<dyn Gravity>());
}

#[test]
fn a_kind_of_a_library_is_named_in_messages() {
    let e = fault(&[]);
    assert!(e.contains("`gauge`: needs a sea service, but there is none"), "{e}");
    assert!(e.contains("add a part that provides sea"), "{e}");
    let two: [(&str, &[(&str, f64)]); 2] = [("a", &[("density", 1.0)]), ("b", &[("density", 1.0)])];
    let e = fault(&two);
    assert!(e.contains("needs a sea service, but there are 2\n  help: name one of: a, b"), "{e}");
    assert_eq!(library().get("t.still_water").unwrap().service_kind().unwrap().text(), "sea");
}

#[test]
fn a_run_stops_where_a_service_of_a_library_cannot_answer() {
    let plan =
        gauge(&[("sea", &[("density", 1025.0), ("end", 0.5)])]).unwrap_or_else(|e| panic!("{e}"));
    let mut sim = Simulation::new(plan.into());
    let e = sim.run_until(seconds(1.0)).unwrap_err();
    assert!(e.message.contains("the tide tables end"), "{e}");
    assert!((sim.time() - 0.5).abs() < 2e-3, "{}", sim.time());
}
