//! What a simulation file says besides its parts: steps, stopping, logs, figures, plots, view.
use crate::form::assembly;
use crate::schema::describe::{Field, Schema};
use crate::schema::kind::{
    At, Kind, color, flag, list_of, mapped, number, numbers, period, raw, short, table_of, text,
    texts, unit, vector, word,
};
use crate::schema::record::{Presence, Record, of, record};
use crate::text::print::inline;
use crate::text::report::Cx;
use crate::text::value::Text;
use linkwork_runtime::{Accuracy, Integrator, Located, Origin, Seconds, Value, remedy};
use linkwork_spatial::Vec3;

record! {
    /// One rule of what to log.
    #[derive(Clone, Debug, PartialEq)]
    pub struct LogRule: "log rule" {
        /// Patterns over variable paths; see [`match_patterns`](crate::patterns::match_patterns).
        channels: Vec<Text> = texts().need("write channels: [\"Rover.**\"]"),
        /// Sample period; `None`: every step.
        rate: Option<Seconds> = period().maybe(),
        /// Only rows of which a value has changed since the last.
        on_change: bool = flag().or(false),
        /// Only rows around events.
        around: Option<AroundForm> = of::<AroundForm>().maybe();
        origin
    }
}
record! {
    /// Windows of time around the instants from which a condition holds.
    #[derive(Clone, Debug, PartialEq)]
    pub struct AroundForm: "window of a log" {
        /// Condition, as those of transitions.
        when: Text = text().need("write when: \"Part.output > 1 N\""),
        /// From so long ahead of it.
        before: Seconds = period().or(Seconds::ZERO),
        /// To so long behind it.
        after: Seconds = period().or(Seconds::ZERO);
        origin
    }
}
/// Which number of a variable's history a figure is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Take {
    /// The value at the end.
    Last,
    /// The least value, with its sign.
    Min,
    /// The largest value, with its sign.
    Max,
    /// The largest magnitude.
    MaxAbs,
    /// The largest value less the least.
    Range,
    /// The mean over time.
    Mean,
    /// The root of the mean square over time.
    Rms,
    /// The standard deviation over time.
    Std,
    /// The value that the variable is below for this share of the time (%).
    Percentile(f64),
    /// The instant of the least value (s).
    TimeOfMin,
    /// The instant of the largest value (s).
    TimeOfMax,
    /// The instant of the largest magnitude (s).
    TimeOfMaxAbs,
}
record! {
    struct FigureForm: "figure" {
        /// Variable.
        of: Option<Text> = text().maybe(),
        /// Instead of a variable: a condition, as those of transitions; 1 while it holds, 0 while it does not.
        when: Option<Text> = text().maybe(),
        /// Of a variable: its value at the first instant at which this condition holds; none where it never does.
        at: Option<Text> = text().maybe(),
        /// Which number of its history.
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
        /// Of a percentile: which one (%), from 0 to 100.
        percent: Option<f64> = number("").at_least(0.0).maybe(),
        /// Unit as shown; that of the variable when none is written.
        unit: Option<Text> = unit().maybe();
        origin
    }
}
/// What a figure looks at.
#[derive(Clone, Debug, PartialEq)]
pub enum FigureOf {
    /// A variable.
    Variable(Text),
    /// A condition: 1 while it holds, 0 while it does not.
    Condition(Text),
}
/// A number that sums up a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Name as shown.
    pub name: String,
    /// What is looked at.
    pub of: FigureOf,
    /// A condition: the number is that of the first instant at which it holds.
    pub at: Option<Text>,
    /// Which number.
    pub take: Take,
    /// Unit as shown; `None`: that of the variable.
    pub unit: Option<Text>,
    /// Where it is written.
    pub origin: Origin,
}
record! {
    /// A plot over time.
    #[derive(Clone, Debug, PartialEq)]
    pub struct Plot: "plot" {
        /// Title.
        title: String = mapped(text(), |t| t.text, |s| Some(Text::new(s))).or(String::new()),
        /// Patterns over variable paths.
        of: Vec<Text> = texts().need("write of: [\"Part.output\"]"),
        /// Unit as shown; `None`: that of the variables.
        unit: Option<Text> = unit().maybe();
        origin
    }
}
/// How a machine moves that was put on the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlaceMotion {
    /// By forces.
    Dynamics,
    /// It rolls as its wheels turn and lies on the ground as its joints permit; nothing has inertia.
    Kinematics,
    /// Likewise, with wheels that sink in and slip as the ground's law of contact asks, all forces in balance.
    QuasiStatic,
}

impl PlaceMotion {
    /// How, in words.
    pub fn words(self) -> &'static str {
        match self {
            PlaceMotion::Dynamics => "by forces",
            PlaceMotion::Kinematics => "by kinematics",
            PlaceMotion::QuasiStatic => "quasi-statically",
        }
    }
}
record! {
    /// Where a machine is put on the ground.
    #[derive(Clone, Debug, PartialEq)]
    pub struct PlaceForm: "place" {
        /// The free root body.
        body: Text = text().need("write `body: \"Rover/chassis\"`"),
        /// x, y of its origin in the site frame (m).
        at: [f64; 2] = numbers::<2>("m").need("write `at: [x, y]` in m"),
        /// Heading about the vertical (rad).
        heading: f64 = number("rad").turn().or(0.0),
        /// Bodies that stand on the ground, by patterns; each axle is its body's y axis.
        wheels: Vec<Text> = texts().need("write `wheels: [\"Rover.Hardware.Wheels.*/wheel\"]`"),
        /// Radius of the wheels (m).
        radius: f64 = number("m").positive().need("write `radius: \"0.25 m\"`"),
        /// Bodies whose hinges adapt to the ground, by patterns.
        joints: Vec<Text> = texts().or(Vec::new()),
        /// How it moves from there: by forces, by kinematics alone, or such that forces balance at each instant.
        motion: PlaceMotion = word(&[
            ("dynamics", PlaceMotion::Dynamics),
            ("kinematics", PlaceMotion::Kinematics),
            ("quasi_static", PlaceMotion::QuasiStatic),
        ]).or(PlaceMotion::Dynamics),
        /// Path of the terrain, when there are several.
        terrain: Option<Text> = text().maybe();
        origin
    }
}
record! {
    /// What a viewer shows beside the bodies.
    #[derive(Clone, Debug, PartialEq)]
    pub struct ViewForm: "view" {
        /// Time between rows that are sent; 1/30 s when none is written.
        rate: Option<Seconds> = period().maybe(),
        /// The body that the eye follows; the first free one when neither this nor `eye` is written.
        follow: Option<Text> = text().maybe(),
        /// Where the eye stands, from that body, or in W without one (m).
        eye: Option<Vec3> = vector("m").maybe(),
        /// Bodies whose paths are drawn, by patterns.
        trails: Vec<Text> = texts().or(Vec::new()),
        /// Nodes whose axes are drawn, by patterns.
        frames: Vec<Text> = texts().or(Vec::new()),
        /// Vectors that are drawn.
        arrows: Vec<ArrowForm> = list_of(of::<ArrowForm>()).or(Vec::new()),
        /// Lines that are drawn between two points: risers, bridles, tethers.
        lines: Vec<LineForm> = list_of(of::<LineForm>()).or(Vec::new()),
        /// Jets of engines and thrusters.
        plumes: Vec<PlumeForm> = list_of(of::<PlumeForm>()).or(Vec::new()),
        /// `PART.PARAMETER` that is a list of [x, y].
        markers: Option<Text> = text().maybe(),
        /// Colour of the sky; dark grey when none is written.
        sky: Option<[f64; 4]> = color().maybe(),
        /// Colour of the ground, lighter where it is high; that of Mars when none is written.
        ground: Option<[f64; 4]> = color().maybe(),
        /// Colour of the planet that is drawn where W is a site on one, or has a radius here.
        planet: Option<[f64; 4]> = color().maybe(),
        /// Radius of a planet about the origin of W, where W is no site (m).
        planet_radius: Option<f64> = number("m").positive().maybe();
        origin
    }
}
record! {
    /// Vectors of a view.
    #[derive(Clone, Debug, PartialEq)]
    pub struct ArrowForm: "arrow" {
        /// Pattern of the vectors at whose ends arrows begin.
        at: Text = text().need("write `at: \"Part.point\"`"),
        /// Pattern of the vectors that they show.
        along: Text = text().need("write `along: \"Part.force\"`"),
        /// Length for one unit of the vector (m).
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
        /// Pattern of the nodes, bodies, or vectors (of points in W) at which they begin.
        from: Text = text().need("write `from: \"stage/hub\"`"),
        /// Pattern of those at which they end; as many, or one.
        to: Text = text().need("write `to: \"rover/hook*\"`"),
        /// Pattern of the variables that are above zero while they pull, each dimmed while its own is not; as many, or
        /// one. Without it they are bright always.
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
        /// Pattern of the nodes of the nozzles; their z is against the jet.
        at: Text = text().need("write `at: \"stage/engine*\"`"),
        /// Pattern of the variables that say how strong each is: throttle or thrust; as many, or one.
        by: Text = text().need("write `by: \"Engine*.thrust\"`"),
        /// Length for one unit of the variable (m).
        scale: f64 = number("").or(1.0),
        /// Red, green, blue, opacity.
        color: Option<[f64; 4]> = color().maybe();
        origin
    }
}
record! {
    struct AccuracyForm: "accuracy" {
        /// Part of the size of a state.
        relative: f64 = number("").at_least(0.0).or(Accuracy::default().relative),
        /// In the unit of the state.
        absolute: f64 = number("").at_least(0.0).or(Accuracy::default().absolute),
        /// Longest step.
        step_max: Option<Seconds> = period().maybe(),
        /// Absolute tolerances, in their own units, of the states that a pattern matches.
        of: Vec<(Text, f64)> = table_of(number("").at_least(0.0)).or(Vec::new()),
    }
}
record! {
    /// The fields of a simulation that an assembly has not.
    pub(crate) struct SettingsForm: "settings" {
        /// Assembly file that is the whole machine, in short.
        assembly: Option<Text> = text().maybe(),
        /// Time between rows: of logs, of sampled parts, of contact.
        step: Seconds = period().or(Seconds { num: 1, den: 1000 }),
        /// How it is integrated between rows.
        integrator: Option<Located> = raw(|| Schema::Words(Integrator::ALL.iter().map(|i| i.0).collect())).maybe(),
        /// Errors that adaptive steps may make, or `"fixed"`.
        accuracy: Option<Located> = raw(|| Schema::Any(vec![Schema::Words(vec!["fixed"]), AccuracyForm::describe()])).maybe(),
        /// When the run ends.
        until: Option<Seconds> = period().maybe(),
        /// Variable that ends the run when it becomes true.
        stop_when: Option<Text> = text().maybe(),
        /// Seed of all noise: a whole number, above 9e15 in quotes.
        seed: Option<Located> = raw(|| Schema::Any(vec![Schema::Whole { low: 0.0, high: 9e15 }, Schema::Text])).maybe(),
        /// Path of the gravity service, or `none`.
        gravity: Option<Text> = text().maybe(),
        /// Path of the mechanism as a part.
        mechanism: Option<Text> = text().maybe(),
        /// Puts a machine on the ground, or several: a list.
        place: Vec<PlaceForm> = places().or(Vec::new()),
        /// What to log.
        log: Vec<LogRule> = list_of(of::<LogRule>()).or(Vec::new()),
        /// What a viewer shows.
        view: Option<ViewForm> = of::<ViewForm>().maybe(),
        /// Numbers that sum up a run.
        figures: Option<Located> = raw(|| table_of(of::<FigureForm>()).describe()).maybe(),
        /// Whether a run keeps balances of energy, mass and charge.
        balance: bool = flag().or(true),
        /// Plots over time.
        plots: Vec<Plot> = list_of(of::<Plot>()).or(Vec::new()),
        /// The text needs no other file.
        resolved: Option<Located> = raw(|| Schema::Flag).maybe(),
        /// Phases, each the file with an overlay on it.
        phases: Option<Located> = raw(phases_schema).maybe(),
        /// The phase in which a run begins.
        start: Option<Text> = text().maybe(),
    }
}

/// One machine, or a list of them.
fn places() -> impl Kind<Of = Vec<PlaceForm>> {
    let only = |all: &Vec<PlaceForm>| if let [one] = &all[..] { Some(one.clone()) } else { None };
    short(list_of(of::<PlaceForm>()), mapped(of::<PlaceForm>(), |one| vec![one], only))
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
    /// Adaptive steps between rows; `None`: steps of the size of `step`.
    pub accuracy: Option<Accuracy>,
    /// Seed of all noise.
    pub seed: u64,
    /// Path of the gravity service.
    pub gravity: Option<Text>,
    /// Path of the mechanism as a part.
    pub mechanism: String,
    /// When to stop.
    pub until: Option<Seconds>,
    /// Variable that stops the run when it becomes true.
    pub stop_when: Option<Text>,
    /// Machines that are put on the ground, one after the other.
    pub place: Vec<PlaceForm>,
    /// What a viewer shows.
    pub view: Option<ViewForm>,
    /// What to log.
    pub log: Vec<LogRule>,
    /// Numbers that sum up a run, by name.
    pub figures: Vec<Figure>,
    /// Whether a run keeps balances of energy, mass and charge.
    pub balance: bool,
    /// Plots.
    pub plots: Vec<Plot>,
}

impl Settings {
    /// Every pattern of variables in it: of logs, plots, figures, arrows, lines, jets. Conditions are not patterns.
    #[must_use]
    pub fn patterns(&self) -> Vec<Text> {
        let mut all: Vec<Text> = Vec::new();
        all.extend(self.log.iter().flat_map(|l| l.channels.clone()));
        all.extend(self.plots.iter().flat_map(|p| p.of.clone()));
        all.extend(self.figures.iter().filter_map(|f| match &f.of {
            FigureOf::Variable(v) => Some(v.clone()),
            FigureOf::Condition(_) => None,
        }));
        if let Some(view) = &self.view {
            all.extend(view.arrows.iter().flat_map(|a| [a.at.clone(), a.along.clone()]));
            all.extend(view.lines.iter().filter_map(|l| l.pull.clone()));
            all.extend(view.plumes.iter().map(|p| p.by.clone()));
        }
        all
    }
}

/// All fields of a simulation.
pub(crate) fn all_fields() -> Vec<&'static str> {
    let of_assembly = assembly::AssemblyFields::names().into_iter().filter(|f| *f != "mounts");
    of_assembly.chain(SettingsForm::names()).collect()
}

/// The same in the schema.
pub(crate) fn schema_fields() -> Vec<Field> {
    let of_assembly = assembly::AssemblyFields::fields().into_iter().filter(|f| f.name != "mounts");
    of_assembly.chain(SettingsForm::fields()).collect()
}

record! {
    /// What only phases have.
    pub(crate) struct PhaseForm: "phase" {
        /// Phase → the condition on which the run goes there.
        to: Option<Located> = raw(|| table_of(text()).describe()).maybe(),
        /// Names of bodies, parts, loops, couplings, colliders that are gone.
        remove: Option<Located> = raw(|| list_of(text()).describe()).maybe(),
        /// The phase that this one begins from, instead of the file.
        like: Option<Text> = text().maybe(),
        /// It replaces all of the machine (resolved texts).
        whole: Option<Located> = raw(|| Schema::Flag).maybe(),
    }
}

/// `phases` in the schema.
fn phases_schema() -> Schema {
    Schema::Table(Box::new(Schema::Record("phase", || {
        let mut fields = schema_fields();
        fields.retain(|f| may_change(f.name));
        // What is laid over something has not all of its fields.
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
    "figures",
    "balance",
    "plots",
    "phases",
    "start",
    "world",
];
/// Maps of things with names.
pub(crate) const MAPS: [&str; 7] =
    ["bodies", "parts", "loops", "couplings", "colliders", "params", "exports"];

/// Fields that a phase may have.
pub(crate) fn phase_fields() -> Vec<&'static str> {
    let all = all_fields().into_iter().chain(PhaseForm::names());
    all.filter(|f| !FIXED.contains(f) && *f != "resolved").collect()
}

/// Whether a phase may say this.
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
        figures: form.figures.map(|f| figures(cx, &f)).unwrap_or_default(),
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

/// `(relative: 1e-9, absolute: 1e-9, step_max: "10 s", of: {"Body.position.*": 1e-3})`, or `fixed`.
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
            format!("choose one that has: {}", names.join(", ")),
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

/// A whole number; as a text when it has more digits than a double holds.
fn seed(cx: &mut Cx, v: &Located) -> Option<u64> {
    let seed = match &v.value {
        Value::Number(x) if x.fract() == 0.0 && (0.0..=9e15).contains(x) => Some(*x as u64),
        Value::Text(t) => t.parse().ok(),
        _ => None,
    };
    if seed.is_none() {
        let help = "write a whole number; above 9e15 in quotes: \"18446744073709551615\"";
        cx.fault(v.origin, format!("simulation: `{}` is not a seed", inline(&v.value)), help);
    }
    seed
}

fn figures(cx: &mut Cx, v: &Located) -> Vec<Figure> {
    let mut out = Vec::new();
    for (name, item) in crate::schema::read::table(cx, v, "simulation: `figures`") {
        let at = At::new(format!("figure `{name}`")).origin(cx.key(item));
        let Some(form) = FigureForm::read(cx, item, &at) else { continue };
        let FigureForm { of, when, at: first, take, percent, unit, origin } = form;
        let take = match (take, percent) {
            (Take::Percentile(_), Some(percent)) if percent <= 100.0 => Take::Percentile(percent),
            (Take::Percentile(_), _) => {
                let fact = match percent {
                    Some(percent) => format!("{}: a percentile of {percent} %", at.what),
                    None => format!("{}: which percentile is not written", at.what),
                };
                cx.fault(origin, fact, "write `percent`, from 0 to 100: percent: 95");
                continue;
            }
            (take, None) => take,
            (_, Some(_)) => {
                let fact = format!("{}: `percent` is of a percentile", at.what);
                cx.fault(origin, fact, "write take: \"percentile\", or take `percent` out");
                continue;
            }
        };
        if first.is_some() && take != Take::Last {
            let fact = format!("{}: `at` gives one value, of which nothing can be taken", at.what);
            cx.fault(origin, fact, "leave `take` out, or `at`");
            continue;
        }
        let of = match (of, when) {
            (Some(of), None) => FigureOf::Variable(of),
            (None, Some(when)) => {
                if let Some(unit) = &unit {
                    let fact = format!("{}: a condition has no unit", at.what);
                    cx.fault(unit.origin, fact, "take `unit` out: it is 1 or 0");
                }
                if let Some(first) = &first {
                    let fact = format!("{}: `at` is of a variable", at.what);
                    cx.fault(first.origin, fact, "write one condition, with `and` in it");
                }
                FigureOf::Condition(when)
            }
            (both, _) => {
                let fact = match both {
                    Some(_) => "it is of a variable and of a condition",
                    None => "it is of nothing",
                };
                let help = "write of: \"Part.output\", or when: \"Part.output > 1 N\"";
                cx.fault(origin, format!("{}: {fact}", at.what), help);
                continue;
            }
        };
        out.push(Figure { name: name.clone(), of, at: first, take, unit, origin });
    }
    out.sort_by(|a, b| a.name.cmp(&b.name));
    out
}
