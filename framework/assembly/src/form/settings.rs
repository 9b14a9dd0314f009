//! Settings of a simulation file: steps, stopping, logs, metrics, plots, view.
use crate::form::assembly;
use crate::schema::describe::{Field, Schema};
use crate::schema::kind::{
    At, Kind, color, flag, list_of, mapped, number, numbers, one_or_list, period, raw, short,
    table_of, text, texts, unit, vector, word,
};
use crate::schema::record::{Presence, Record, of, record};
use crate::text::print::inline;
use crate::text::report::Cx;
use crate::text::value::Text;
use linkwork_runtime::{Accuracy, Integrator, Located, Origin, Seconds, Value, remedy};
use linkwork_spatial::Vec3;

record! {
    /// One rule of the log.
    #[derive(Clone, Debug, PartialEq)]
    pub struct LogRule: "log rule" {
        /// Patterns for variable paths; see [`match_patterns`](crate::patterns::match_patterns).
        channels: Vec<Text> = texts().need("write channels: [\"Rover.**\"]"),
        /// Sample period; `None`: every step.
        rate: Option<Seconds> = period().maybe(),
        /// Keep only samples in which a value has changed since the last one.
        on_change: bool = flag().or(false),
        /// Keep only samples around events.
        around: Option<AroundForm> = of::<AroundForm>().maybe();
        origin
    }
}
record! {
    /// Windows of time around the instants at which a condition becomes true.
    #[derive(Clone, Debug, PartialEq)]
    pub struct AroundForm: "window of a log" {
        /// Condition, as in transitions.
        when: Text = text().need("write when: \"Part.output > 1 N\""),
        /// Length of the window before the instant.
        before: Seconds = period().or(Seconds::ZERO),
        /// Length of the window after the instant.
        after: Seconds = period().or(Seconds::ZERO);
        origin
    }
}
/// The statistic that a metric takes of a variable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Take {
    /// The value at the end.
    Last,
    /// The smallest value, with its sign.
    Min,
    /// The largest value, with its sign.
    Max,
    /// The largest magnitude.
    MaxAbs,
    /// The difference between the largest and the smallest value.
    Range,
    /// The mean over time.
    Mean,
    /// RMS over time.
    Rms,
    /// The standard deviation over time.
    Std,
    /// Percentile: the value below which the variable is for this fraction of the time (%).
    Percentile(f64),
    /// The instant of the smallest value (s).
    TimeOfMin,
    /// The instant of the largest value (s).
    TimeOfMax,
    /// The instant of the largest magnitude (s).
    TimeOfMaxAbs,
}
record! {
    struct MetricForm: "metric" {
        /// Variable.
        of: Option<Text> = text().maybe(),
        /// Alternative to a variable: a condition, as in transitions; 1 while it is true, 0 while it is false.
        when: Option<Text> = text().maybe(),
        /// Value of the variable at the first instant at which this condition is true; no value if it never is.
        at: Option<Text> = text().maybe(),
        /// The statistic.
        take: Take = word(&[
            ("last", Take::Last),
            ("min", Take::Min),
            ("max", Take::Max),
            ("max_abs", Take::MaxAbs),
            ("range", Take::Range),
            ("mean", Take::Mean),
            ("rms", Take::Rms),
            ("std", Take::Std),
            ("percentile", Take::Percentile(0.0)),
            ("time_of_min", Take::TimeOfMin),
            ("time_of_max", Take::TimeOfMax),
            ("time_of_max_abs", Take::TimeOfMaxAbs),
        ]).or(Take::Last),
        /// The percentile (%), from 0 to 100.
        percent: Option<f64> = number("").at_least(0.0).maybe(),
        /// Displayed unit (default: that of the variable).
        unit: Option<Text> = unit().maybe();
        origin
    }
}
/// Observed quantity of a metric.
#[derive(Clone, Debug, PartialEq)]
pub enum MetricOf {
    /// A variable.
    Variable(Text),
    /// A condition: 1 while it is true, 0 while it is false.
    Condition(Text),
}
/// A metric: a number that summarizes a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Metric {
    /// Name as shown.
    pub name: String,
    /// Observed quantity.
    pub of: MetricOf,
    /// A condition: the metric is the value at the first instant at which it is true.
    pub at: Option<Text>,
    /// Number that the metric computes.
    pub take: Take,
    /// Displayed unit; `None`: that of the variable.
    pub unit: Option<Text>,
    /// Position in the file.
    pub origin: Origin,
}
record! {
    /// A plot over time.
    #[derive(Clone, Debug, PartialEq)]
    pub struct Plot: "plot" {
        /// Title.
        title: String = mapped(text(), |t| t.text, |s| Some(Text::new(s))).or(String::new()),
        /// Patterns for variable paths.
        of: Vec<Text> = texts().need("write of: [\"Part.output\"]"),
        /// Displayed unit (default: that of the variables).
        unit: Option<Text> = unit().maybe();
        origin
    }
}
/// Motion of a machine that was placed on the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlaceMotion {
    /// Motion by forces.
    Dynamics,
    /// Kinematic: it rolls as its wheels rotate, and its joints adapt to the ground; no inertia.
    Kinematics,
    /// Quasi-static: like kinematic, with wheel sinkage and slip that follow from the ground contact, and all forces in equilibrium.
    QuasiStatic,
}

impl PlaceMotion {
    /// Returns its name.
    pub fn words(self) -> &'static str {
        match self {
            PlaceMotion::Dynamics => "by forces",
            PlaceMotion::Kinematics => "by kinematics",
            PlaceMotion::QuasiStatic => "quasi-statically",
        }
    }
}
record! {
    /// Placement of a machine on the ground.
    #[derive(Clone, Debug, PartialEq)]
    pub struct PlacementForm: "place" {
        /// The free root body.
        body: Text = text().need("write `body: \"Rover/chassis\"`"),
        /// x, y of its origin in the site frame (m).
        at: [f64; 2] = numbers::<2>("m").need("write `at: [x, y]` in m"),
        /// Heading about the vertical (rad).
        heading: f64 = number("rad").turn().or(0.0),
        /// Wheels on the ground, by patterns; each axle is its body's y axis.
        wheels: Vec<Text> = texts().need("write `wheels: [\"Rover.Hardware.Wheels.*/wheel\"]`"),
        /// Radius of the wheels (m): one for all, or a list with one for each entry of `wheels`.
        radius: Vec<f64> = radii().need("write `radius: \"0.25 m\"`, or a list with one radius for each entry of `wheels`"),
        /// Bodies whose hinges adapt to the ground, by patterns.
        joints: Vec<Text> = texts().or(Vec::new()),
        /// Motion: by forces, kinematic, or quasi-static.
        motion: PlaceMotion = word(&[
            ("dynamics", PlaceMotion::Dynamics),
            ("kinematics", PlaceMotion::Kinematics),
            ("quasi_static", PlaceMotion::QuasiStatic),
        ]).or(PlaceMotion::Dynamics),
        /// Path of the terrain, if there are several.
        terrain: Option<Text> = text().maybe();
        origin
    }
}
record! {
    /// What a viewer shows in addition to the bodies.
    #[derive(Clone, Debug, PartialEq)]
    pub struct ViewForm: "view" {
        /// Sample period (default: 1/30 s).
        rate: Option<Seconds> = period().maybe(),
        /// The body that the camera follows (default, without `eye`: the first free body).
        follow: Option<Text> = text().maybe(),
        /// Position of the camera relative to that body, or in W without one (m).
        eye: Option<Vec3> = vector("m").maybe(),
        /// Bodies with a trail, by patterns.
        trails: Vec<Text> = texts().or(Vec::new()),
        /// Nodes with visible axes, by patterns.
        frames: Vec<Text> = texts().or(Vec::new()),
        /// Vectors that are drawn as arrows.
        arrows: Vec<ArrowForm> = list_of(of::<ArrowForm>()).or(Vec::new()),
        /// Lines between two points: risers, bridles, tethers.
        lines: Vec<LineForm> = list_of(of::<LineForm>()).or(Vec::new()),
        /// Jets of engines and thrusters.
        plumes: Vec<PlumeForm> = list_of(of::<PlumeForm>()).or(Vec::new()),
        /// Labelled points: `PART.PARAMETER` that is a list of [x, y].
        markers: Option<Text> = text().maybe(),
        /// Colour of the sky (default: dark grey).
        sky: Option<[f64; 4]> = color().maybe(),
        /// Colour of the ground, lighter at larger heights (default: that of Mars).
        ground: Option<[f64; 4]> = color().maybe(),
        /// Colour of the planet, which is drawn if W is a site or `planet_radius` is given.
        planet: Option<[f64; 4]> = color().maybe(),
        /// Radius of a planet about the origin of W, if W is not a site (m).
        planet_radius: Option<f64> = number("m").positive().maybe();
        origin
    }
}
record! {
    /// Vectors of a view.
    #[derive(Clone, Debug, PartialEq)]
    pub struct ArrowForm: "arrow" {
        /// Pattern of the points at which arrows begin.
        at: Text = text().need("write `at: \"Part.point\"`"),
        /// Pattern of the displayed vectors.
        along: Text = text().need("write `along: \"Part.force\"`"),
        /// Length per unit of the vector (m).
        scale: f64 = number("").or(1.0),
        /// Red, green, blue, opacity.
        color: Option<[f64; 4]> = color().maybe();
        origin
    }
}
record! {
    /// Lines of a view.
    #[derive(Clone, Debug, PartialEq)]
    pub struct LineForm: "line" {
        /// Pattern of the start points: nodes, bodies, or vectors (points in W).
        from: Text = text().need("write `from: \"stage/hub\"`"),
        /// Pattern of the end points; an equal number, or one.
        to: Text = text().need("write `to: \"rover/hook*\"`"),
        /// Pattern of variables that are positive while a line is taut; a line is dimmed while its variable is not. An equal number, or one. Default:
        /// always bright.
        pull: Option<Text> = text().maybe(),
        /// Red, green, blue, opacity.
        color: Option<[f64; 4]> = color().maybe();
        origin
    }
}
record! {
    /// Jets of a view.
    #[derive(Clone, Debug, PartialEq)]
    pub struct PlumeForm: "plume" {
        /// Pattern of the nodes of the nozzles; their z axis is opposite to the jet.
        at: Text = text().need("write `at: \"stage/engine*\"`"),
        /// Pattern of the variables of the jets' strength: throttle or thrust; an equal number, or one.
        by: Text = text().need("write `by: \"Engine*.thrust\"`"),
        /// Length per unit of the variable (m).
        scale: f64 = number("").or(1.0),
        /// Red, green, blue, opacity.
        color: Option<[f64; 4]> = color().maybe();
        origin
    }
}
record! {
    struct AccuracyForm: "accuracy" {
        /// Relative to the size of a state.
        relative: f64 = number("").at_least(0.0).or(Accuracy::default().relative),
        /// Absolute, in the unit of the state.
        absolute: f64 = number("").at_least(0.0).or(Accuracy::default().absolute),
        /// Longest step.
        step_max: Option<Seconds> = period().maybe(),
        /// Absolute tolerances, in their own units, of the states that a pattern matches.
        of: Vec<(Text, f64)> = table_of(number("").at_least(0.0)).or(Vec::new()),
    }
}
record! {
    /// The fields of a simulation that an assembly does not have.
    pub(crate) struct SettingsForm: "settings" {
        /// Short form: assembly file of the whole machine.
        assembly: Option<Text> = text().maybe(),
        /// Time between ticks: of logs, sampled parts and contact.
        step: Seconds = period().or(Seconds { num: 1, den: 1000 }),
        /// Integrator between ticks.
        integrator: Option<Located> = raw(|| Schema::Words(Integrator::ALL.iter().map(|i| i.0).collect())).maybe(),
        /// Tolerances of adaptive steps, or `"fixed"`.
        accuracy: Option<Located> = raw(|| Schema::Any(vec![Schema::Words(vec!["fixed"]), AccuracyForm::describe()])).maybe(),
        /// End time of the run.
        until: Option<Seconds> = period().maybe(),
        /// Variable that ends the run when it becomes true.
        stop_when: Option<Text> = text().maybe(),
        /// Seed of all noise: an integer, in quotes above 9e15.
        seed: Option<Located> = raw(|| Schema::Any(vec![Schema::Whole { low: 0.0, high: 9e15 }, Schema::Text])).maybe(),
        /// Path of the gravity service, or `none`.
        gravity: Option<Text> = text().maybe(),
        /// Path of the mechanism as a part.
        mechanism: Option<Text> = text().maybe(),
        /// Placement of a machine on the ground, or a list for several machines.
        place: Vec<PlacementForm> = places().or(Vec::new()),
        /// Rules of the log.
        log: Vec<LogRule> = list_of(of::<LogRule>()).or(Vec::new()),
        /// Scene of the viewer.
        view: Option<ViewForm> = of::<ViewForm>().maybe(),
        /// Metrics: numbers that summarize a run.
        metrics: Option<Located> = raw(|| table_of(of::<MetricForm>()).describe()).maybe(),
        /// Whether balances of energy, mass and charge are computed.
        balance: bool = flag().or(true),
        /// Plots over time.
        plots: Vec<Plot> = list_of(of::<Plot>()).or(Vec::new()),
        /// The text does not need other files.
        resolved: Option<Located> = raw(|| Schema::Flag).maybe(),
        /// Phases; each is the file with an overlay.
        phases: Option<Located> = raw(phases_schema).maybe(),
        /// The phase in which a run begins.
        start: Option<Text> = text().maybe(),
    }
}

/// Reads one radius, or a list of radii.
fn radii() -> impl Kind<Of = Vec<f64>> {
    let only = |all: &Vec<f64>| if let [one] = all[..] { Some(one) } else { None };
    one_or_list(
        mapped(number("m").positive(), |one| vec![one], only),
        list_of(number("m").positive()),
    )
}

/// Reads one machine, or a list of machines.
fn places() -> impl Kind<Of = Vec<PlacementForm>> {
    let only =
        |all: &Vec<PlacementForm>| if let [one] = &all[..] { Some(one.clone()) } else { None };
    short(list_of(of::<PlacementForm>()), mapped(of::<PlacementForm>(), |one| vec![one], only))
}

/// Settings of a simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Documentation.
    pub doc: String,
    /// Integration step.
    pub step: Seconds,
    /// Integrator.
    pub integrator: Integrator,
    /// Adaptive steps between ticks; `None`: fixed steps of the size `step`.
    pub accuracy: Option<Accuracy>,
    /// Seed of all noise.
    pub seed: u64,
    /// Path of the gravity service.
    pub gravity: Option<Text>,
    /// Path of the mechanism as a part.
    pub mechanism: String,
    /// Time at which a run stops.
    pub until: Option<Seconds>,
    /// Variable that stops the run when it becomes true.
    pub stop_when: Option<Text>,
    /// Machines that are placed on the ground, one after the other.
    pub place: Vec<PlacementForm>,
    /// Scene of the viewer.
    pub view: Option<ViewForm>,
    /// Rules of the log.
    pub log: Vec<LogRule>,
    /// Metrics, by name.
    pub metrics: Vec<Metric>,
    /// Whether balances of energy, mass and charge are computed.
    pub balance: bool,
    /// Plots.
    pub plots: Vec<Plot>,
}

impl Settings {
    /// Returns all patterns of variables: of logs, plots, metrics, arrows, lines, jets. Conditions are not patterns.
    #[must_use]
    pub fn patterns(&self) -> Vec<Text> {
        let mut all: Vec<Text> = Vec::new();
        all.extend(self.log.iter().flat_map(|l| l.channels.clone()));
        all.extend(self.plots.iter().flat_map(|p| p.of.clone()));
        all.extend(self.metrics.iter().filter_map(|f| match &f.of {
            MetricOf::Variable(v) => Some(v.clone()),
            MetricOf::Condition(_) => None,
        }));
        if let Some(view) = &self.view {
            all.extend(view.arrows.iter().flat_map(|a| [a.at.clone(), a.along.clone()]));
            all.extend(view.lines.iter().filter_map(|l| l.pull.clone()));
            all.extend(view.plumes.iter().map(|p| p.by.clone()));
        }
        all
    }
}

/// Returns the names of all fields of a simulation.
pub(crate) fn all_fields() -> Vec<&'static str> {
    let of_assembly = assembly::AssemblyFields::names().into_iter().filter(|f| *f != "mounts");
    of_assembly.chain(SettingsForm::names()).collect()
}

/// Returns all fields of a simulation for the schema.
pub(crate) fn schema_fields() -> Vec<Field> {
    let of_assembly = assembly::AssemblyFields::fields().into_iter().filter(|f| f.name != "mounts");
    of_assembly.chain(SettingsForm::fields()).collect()
}

record! {
    /// Fields that only phases have.
    pub(crate) struct PhaseForm: "phase" {
        /// Transitions: target phase → condition.
        to: Option<Located> = raw(|| table_of(text()).describe()).maybe(),
        /// Names of bodies, parts, loops, couplings, colliders that are removed.
        remove: Option<Located> = raw(|| list_of(text()).describe()).maybe(),
        /// The phase on which this one is based, instead of the file.
        like: Option<Text> = text().maybe(),
        /// It replaces the whole machine (in resolved texts).
        whole: Option<Located> = raw(|| Schema::Flag).maybe(),
    }
}

/// Returns the schema of `phases`.
fn phases_schema() -> Schema {
    Schema::Table(Box::new(Schema::Record("phase", || {
        let mut fields = schema_fields();
        fields.retain(|f| may_change(f.name));
        // Entries of an overlay need not be complete.
        for f in fields.iter_mut().filter(|f| MAPS.contains(&f.name)) {
            f.schema = Schema::Table(Box::new(Schema::Any(Vec::new())));
        }
        fields.extend(PhaseForm::fields());
        fields
    })))
}

/// Fields of a simulation that a phase cannot change.
pub(crate) const FIXED: [&str; 15] = [
    "assembly",
    "name",
    "mounts",
    "until",
    "stop_when",
    "seed",
    "place",
    "log",
    "view",
    "metrics",
    "balance",
    "plots",
    "phases",
    "start",
    "world",
];
/// Fields that are maps of named entries.
pub(crate) const MAPS: [&str; 7] =
    ["bodies", "parts", "loops", "couplings", "colliders", "params", "exports"];

/// Returns the fields that a phase may have.
pub(crate) fn phase_fields() -> Vec<&'static str> {
    let all = all_fields().into_iter().chain(PhaseForm::names());
    all.filter(|f| !FIXED.contains(f) && *f != "resolved").collect()
}

/// Returns whether a phase may change a field.
pub(crate) fn may_change(field: &str) -> bool {
    phase_fields().contains(&field)
}

/// Reads the settings; parameters have been replaced.
pub(crate) fn read(cx: &mut Cx, v: &Located) -> Settings {
    let at = At::new("simulation");
    let empty = Value::Null.into();
    let form = SettingsForm::read_fields(cx, v, &at)
        .or_else(|| SettingsForm::read_fields(cx, &empty, &at));
    let Some(form) = form else { unreachable!("all fields have a default") };
    if let Some(step) = v.get("step").filter(|_| form.step.num == 0) {
        cx.fault(step.origin, "the integration step is zero", "write for example step: \"1 ms\"");
    }
    let integrator = form.integrator.map_or(Integrator::Rk4, |i| integrator(cx, &i));
    let adaptive = integrator.method().error_order() > 0;
    let accuracy = match form.accuracy {
        Some(a) => accuracy(cx, &a, integrator, &at.field("accuracy")),
        None => adaptive.then(Accuracy::default),
    };
    let doc = v.get("doc").and_then(|d| text().read(cx, d, &at.field("doc")));
    Settings {
        doc: doc.map(|t| t.text).unwrap_or_default(),
        step: form.step,
        integrator,
        accuracy,
        seed: form.seed.and_then(|s| seed(cx, &s)).unwrap_or(0),
        gravity: form.gravity,
        mechanism: form.mechanism.map_or_else(|| "Mechanism".into(), |t| t.text),
        until: form.until,
        stop_when: form.stop_when,
        place: form.place,
        view: form.view,
        log: form.log,
        metrics: form.metrics.map(|f| metrics(cx, &f)).unwrap_or_default(),
        balance: form.balance,
        plots: form.plots,
    }
}

fn plain_word(v: &Located) -> Option<&str> {
    match &v.value {
        Value::Text(t) => Some(t),
        Value::Variant(name, inner) if inner.value == Value::Null => Some(name),
        _ => None,
    }
}

fn integrator(cx: &mut Cx, v: &Located) -> Integrator {
    let known = Integrator::ALL.iter().find(|(name, _)| plain_word(v) == Some(name));
    match (known, plain_word(v)) {
        (Some((_, integrator)), _) => *integrator,
        (None, other) => {
            let shown = other.map_or_else(|| v.value.what().to_string(), |w| format!("`{w}`"));
            let help = remedy(other.unwrap_or(""), "integrators", &Integrator::ALL.map(|i| i.0));
            cx.fault(v.origin, format!("simulation: there is no integrator {shown}"), help);
            Integrator::Rk4
        }
    }
}

/// Reads `(relative: 1e-9, absolute: 1e-9, step_max: "10 s", of: {"Body.position.*": 1e-3})`, or `fixed`.
fn accuracy(cx: &mut Cx, v: &Located, integrator: Integrator, at: &At<'_>) -> Option<Accuracy> {
    if plain_word(v) == Some("fixed") {
        return None;
    }
    if integrator.method().error_order() == 0 {
        let adaptive = Integrator::ALL.iter().filter(|i| i.1.method().error_order() > 0);
        let names: Vec<&str> = adaptive.map(|i| i.0).collect();
        cx.fault(
            v.origin,
            format!("{}: this integrator has no error estimate", at.what),
            format!("choose one with an error estimate: {}", names.join(", ")),
        );
        return None;
    }
    let form = AccuracyForm::read(cx, v, at)?;
    Some(Accuracy {
        relative: form.relative,
        absolute: form.absolute,
        step_max: form.step_max.map_or(f64::INFINITY, Seconds::seconds),
        of: form.of.into_iter().map(|(p, x)| (p.text, x, p.origin)).collect(),
    })
}

/// Reads an integer, as text if a double cannot represent it.
fn seed(cx: &mut Cx, v: &Located) -> Option<u64> {
    let seed = match &v.value {
        Value::Number(x) if x.fract() == 0.0 && (0.0..=9e15).contains(x) => Some(*x as u64),
        Value::Text(t) => t.parse().ok(),
        _ => None,
    };
    if seed.is_none() {
        let help = "write an integer, in quotes above 9e15: \"18446744073709551615\"";
        cx.fault(v.origin, format!("simulation: `{}` is not a seed", inline(&v.value)), help);
    }
    seed
}

fn metrics(cx: &mut Cx, v: &Located) -> Vec<Metric> {
    let mut out = Vec::new();
    for (name, item) in crate::schema::read::table(cx, v, "simulation: `metrics`") {
        let at = At::new(format!("metric `{name}`")).origin(cx.key(item));
        let Some(form) = MetricForm::read(cx, item, &at) else { continue };
        let MetricForm { of, when, at: first, take, percent, unit, origin } = form;
        let take = match (take, percent) {
            (Take::Percentile(_), Some(percent)) if percent <= 100.0 => Take::Percentile(percent),
            (Take::Percentile(_), _) => {
                let fact = match percent {
                    Some(percent) => format!("{}: `percent` is {percent}, above 100", at.what),
                    None => format!("{}: `percent` is missing", at.what),
                };
                cx.fault(origin, fact, "write `percent`, from 0 to 100: percent: 95");
                continue;
            }
            (take, None) => take,
            (_, Some(_)) => {
                let fact = format!("{}: `percent` requires take: \"percentile\"", at.what);
                cx.fault(origin, fact, "write take: \"percentile\", or remove `percent`");
                continue;
            }
        };
        if first.is_some() && take != Take::Last {
            let fact = format!("{}: `at` selects one value, so `take` is not allowed", at.what);
            cx.fault(origin, fact, "remove `take` or `at`");
            continue;
        }
        let of = match (of, when) {
            (Some(of), None) => MetricOf::Variable(of),
            (None, Some(when)) => {
                if let Some(unit) = &unit {
                    let fact = format!("{}: a condition does not have a unit", at.what);
                    cx.fault(unit.origin, fact, "remove `unit`: the value is 1 or 0");
                }
                if let Some(first) = &first {
                    let fact = format!("{}: `at` requires a variable", at.what);
                    cx.fault(first.origin, fact, "combine the conditions with `and`");
                }
                MetricOf::Condition(when)
            }
            (both, _) => {
                let fact = match both {
                    Some(_) => "it has both a variable and a condition",
                    None => "it lacks a variable or a condition",
                };
                let help = "write of: \"Part.output\", or when: \"Part.output > 1 N\"";
                cx.fault(origin, format!("{}: {fact}", at.what), help);
                continue;
            }
        };
        out.push(Metric { name: name.clone(), of, at: first, take, unit, origin });
    }
    out.sort_by(|a, b| a.name.cmp(&b.name));
    out
}
