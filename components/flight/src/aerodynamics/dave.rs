//! `flight.dave_aerodynamics`: the aerodynamic model of a DAVE-ML file, as NASA and others publish them.
//! ```text
//! inputs   standard names of AIAA S-119: trueAirspeed, angleOfAttack, angleOfSideslip, mach (machNumber),
//!          dynamicPressure, airDensity, totalAngleOfAttack, bodyAngularRate_Roll, _Pitch, _Yaw; beside them
//!          altitudeMSL (geodeticAltitude), above the ellipsoid of the atmosphere's planet, and reynoldsNumber;
//!          other inputs of the file are named in `controls` and come through the port of that name, as do these
//!          where they are named there
//! Re       ρ V l/μ(T): l is `reynolds_length`, or c̄; ρ V/μ(T) where the file's unit is 1/m or 1/ft (`_m`, `_ft`)
//! force    body: q S (C_X, C_Y, C_Z)     or from lift and drag: q S (−C_D cos α + C_L sin α, C_Y, −C_D sin α − C_L cos α)
//! moment   q S (b C_l, c̄ C_m, b C_n) about the node, body axes
//! S, c̄, b  referenceWingArea, referenceWingChord, referenceWingSpan of the file
//! ```
//! The file's units are converted to SI. Its static shots are evaluated when it is loaded, and a file that fails its own shots is rejected. `set`
//! replaces constants. Beyond the end of a table, its last value is used, or the run stops.

use super::air_data::{AirData, Outside, check_air_rate};
use super::axisymmetric::{Edge, TableExit, leaves, remark};
use crate::mesh::{named_text, show_text};
use linkwork_formats::daveml::{DaveModel, Role, read_dave, unit_text};
use linkwork_runtime::{Located, Param, ParamSpec, ReadCx, Unit, Value};
use linkwork_surroundings::prelude::*;
use std::sync::Arc;

/// Variables that a file may have.
pub(super) const VARIABLES: usize = 1024;
/// Inputs that the port `controls` supplies.
const CONTROLS: usize = 12;

/// A DAVE-ML file as a parameter: its name, or `(name: "..", text: "..")` with the content of the file.
#[derive(Clone, Debug)]
pub struct DaveFile {
    name: String,
    text: Arc<str>,
    model: Arc<DaveModel>,
}

impl DaveFile {
    /// From a text.
    ///
    /// # Errors
    /// The text has faults (each is listed with its place), or static shots of the file fail.
    pub fn new(name: &str, text: &str) -> Result<DaveFile, String> {
        let model = read_dave(text, name).map_err(|e| e.to_string())?;
        let failed = model.check();
        if !failed.is_empty() {
            let lines: Vec<String> = failed.iter().map(ToString::to_string).collect();
            return Err(format!("{name} fails its own check data:\n{}", lines.join("\n")));
        }
        Ok(DaveFile { name: name.into(), text: text.into(), model: Arc::new(model) })
    }
}

impl DaveFile {
    /// Returns the model of the file.
    pub(super) fn model(&self) -> &DaveModel {
        &self.model
    }
}

impl Param for DaveFile {
    fn kind() -> String {
        r#"name of a DAVE-ML file, or (name: "..", text: "..") with its content"#.into()
    }
    fn read(v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<DaveFile> {
        let at = format!("`{}.{}`", cx.path, spec.name);
        let (name, text) = named_text(v, spec, cx, "brick_aero.dml")?;
        match DaveFile::new(&name, &text) {
            Ok(file) => Some(file),
            Err(e) => {
                let (fact, help) = e.split_once("\n  help: ").unwrap_or((&e, "correct the file"));
                cx.fault(v.origin, format!("{at}: {fact}"), Some(help.into()));
                None
            }
        }
    }
    fn show(&self) -> Value {
        show_text(&self.name, &self.text)
    }
}

/// Kind of coefficients from which the force is computed.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Forces {
    /// The kind that the file has; the file must have one kind only.
    Found,
    /// aeroBodyForceCoefficient_X, _Y, _Z.
    Body,
    /// totalCoefficientOfLift, totalCoefficientOfDrag, and aeroBodyForceCoefficient_Y.
    Stability,
}

/// A constant of the file whose value is replaced.
#[derive(Params, Clone, Debug)]
pub struct Replacement {
    /// Its `varID`.
    pub variable: String,
    /// The new value, in the file's units.
    pub value: f64,
}

/// A file, and settings that are not in it.
#[derive(Params, Clone, Debug)]
pub struct DaveParams {
    /// The file.
    pub model: DaveFile,
    /// Kind of coefficients from which the force is computed: found, body, stability.
    #[param(default = Forces::Found)]
    pub forces: Forces,
    /// Constants of the file whose values are replaced here.
    #[param(default = Vec::new())]
    pub set: Vec<Replacement>,
    /// Inputs of the file (`varID`), in the order of the port `controls`; at most twelve.
    #[param(default = Vec::new())]
    pub controls: Vec<String>,
    /// Angular velocity of the air, W, relative to which the body rates are measured; default: the rate of the `world`; zero: rates relative to W.
    #[param(unit = "rad/s", default = Vec3::zeros())]
    pub air_rate: Vec3,
    /// Length of the file's Reynolds number; default: its referenceWingChord.
    #[param(unit = "m")]
    pub reynolds_length: Option<f64>,
    /// Behaviour beyond the ends of the tables: clamp, stop.
    #[param(default = Outside::Clamp)]
    pub outside: Outside,
    /// The air.
    #[param(service)]
    pub atmosphere: Handle<dyn Atmosphere>,
    /// The world, with whose body the air rotates.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
}

/// Body and controls.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DaveIn {
    /// Node with body axes at the reference point of the moments.
    #[port(bind = "body")]
    pub body: NodeState,
    /// The inputs named in `controls`, each in SI (angles in rad).
    #[port("*", default = [0.0; CONTROLS])]
    pub controls: [f64; CONTROLS],
    /// Gust velocity in addition to the wind, W, for example from `flight.gusts`.
    #[port("m/s", default = Vec3::zeros())]
    pub gust: Vec3,
    /// Angular velocity of the air in addition to `air_rate`, W, for example `rotation` of `flight.gusts`.
    #[port("rad/s", default = Vec3::zeros())]
    pub gust_rate: Vec3,
}

/// Load and flow.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DaveOut {
    /// Force and moment at the node.
    #[port(bind = "body")]
    pub load: Wrench,
    /// Force over q S, body axes.
    #[port("1")]
    pub force_coefficient: Vec3,
    /// Moment over q S and (b, c̄, b).
    #[port("1")]
    pub moment_coefficient: Vec3,
    /// Speed through the air.
    #[port("m/s")]
    pub airspeed: f64,
    /// Mach number.
    #[port("1")]
    pub mach: f64,
    /// Dynamic pressure.
    #[port("Pa")]
    pub dynamic_pressure: f64,
    /// Angle of attack.
    #[port("rad")]
    pub alpha: f64,
    /// Angle of sideslip.
    #[port("rad")]
    pub beta: f64,
}

/// Flag of the table range.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TableFlag {
    /// The flow has been outside the tables.
    #[port]
    pub outside: bool,
}

/// Flow quantities that can be inputs of the file.
const FLOW: [(&[&str], &str); 12] = [
    (&["trueAirspeed"], "m/s"),
    (&["angleOfAttack"], "rad"),
    (&["angleOfSideslip"], "rad"),
    (&["mach", "machNumber", "Mach"], "1"),
    (&["dynamicPressure"], "Pa"),
    (&["airDensity", "density"], "kg/m^3"),
    (&["bodyAngularRate_Roll"], "rad/s"),
    (&["bodyAngularRate_Pitch"], "rad/s"),
    (&["bodyAngularRate_Yaw"], "rad/s"),
    (&["totalAngleOfAttack"], "rad"),
    (&["altitudeMSL", "altitudeMsl", "geodeticAltitude"], "m"),
    (&["reynoldsNumber"], "1"),
];
/// Indices of the last two quantities, which not every atmosphere defines.
const ALTITUDE: usize = 10;
const REYNOLDS: usize = 11;

/// Reference length of pitching moments.
const CHORD: &str = "referenceWingChord";

/// Coefficients and lengths among the outputs of the file, by the names that files have for them.
const RESULTS: [(&[&str], &str); 11] = [
    (&["aeroBodyForceCoefficient_X"], "1"),
    (&["aeroBodyForceCoefficient_Y"], "1"),
    (&["aeroBodyForceCoefficient_Z"], "1"),
    (&["totalCoefficientOfLift"], "1"),
    (&["totalCoefficientOfDrag"], "1"),
    (&["aeroBodyMomentCoefficient_Roll"], "1"),
    (&["aeroBodyMomentCoefficient_Pitch"], "1"),
    (&["aeroBodyMomentCoefficient_Yaw"], "1"),
    (&["referenceWingArea", "referenceArea"], "m^2"),
    (&[CHORD, "longitudinalReferenceLength"], "m"),
    (&["referenceWingSpan", "lateralReferenceLength", "lateralReferencelength"], "m"),
];

/// A variable by a standard name, which files write as `name` or as `varID`.
fn standard(m: &DaveModel, names: &[&str]) -> Option<usize> {
    names.iter().find_map(|name| m.named(name).or_else(|| m.find(name)))
}

/// A variable of the file, and the factor from its unit to SI.
type Place = Option<(usize, f64)>;

/// The aerodynamics of a file.
pub struct DaveAerodynamics {
    p: DaveParams,
    flow: [Place; FLOW.len()],
    /// Length of the Reynolds number, m.
    length: f64,
    controls: Vec<(usize, f64)>,
    results: [Place; RESULTS.len()],
    /// Force from lift and drag.
    stability: bool,
    /// Values before inputs come.
    start: Vec<f64>,
}

impl DaveAerodynamics {
    /// The factor to SI of a variable, which must be of the same quantity as `wanted`.
    fn factor(model: &DaveModel, k: usize, wanted: &str) -> Result<f64, BuildError> {
        let v = &model.variables[k];
        let unit = unit_text(&v.units).and_then(|t| Unit::parse(&t).ok());
        let want = Unit::parse(wanted).map_err(|e| BuildError::new(e.to_string()))?;
        match unit {
            // An angle may be written without a unit.
            Some(u) if u.same_quantity(&want) => Ok(u.scale),
            Some(u) if wanted == "rad" && u.same_quantity(&Unit::ONE) => Ok(u.scale),
            _ => Err(BuildError::new(format!(
                "`{}` is in `{}`, not in a unit of {wanted}",
                v.id, v.units
            ))
            .help("correct `units` in the file")
            .at("model")),
        }
    }

    /// The flow at the node.
    fn air(&self, t: f64, u: &DaveIn) -> AirData {
        AirData::met(&self.p.atmosphere, t, &u.body, &(self.p.air_rate + u.gust_rate), &u.gust)
    }

    fn inside(&self, t: f64, u: &DaveIn) -> f64 {
        self.evaluate(t, &self.air(t, u), u).1
    }

    /// Height above the ellipsoid, m, and the Reynolds number in the definition of the file, in SI; 0 if the file does not use them.
    fn height_and_reynolds(&self, t: f64, a: &AirData, position: Vec3) -> [f64; 2] {
        let air = &self.p.atmosphere;
        let nan = f64::NAN;
        let height = |_| air.altitude(t, position).unwrap_or(nan);
        let reynolds =
            |_| self.length * a.unit_reynolds(air.viscosity(a.temperature).unwrap_or(nan));
        [self.flow[ALTITUDE].map_or(0.0, height), self.flow[REYNOLDS].map_or(0.0, reynolds)]
    }

    /// Describes a flow that is beyond the tables of the file.
    fn reach(&self, a: &AirData) -> String {
        let [alpha, beta] = [a.alpha(), a.beta()].map(f64::to_degrees);
        let name = &self.p.model.name;
        format!("those of {name}, at Mach {:.4}, α {alpha:.2} deg, β {beta:.2} deg", a.mach)
    }

    fn evaluate(&self, t: f64, a: &AirData, u: &DaveIn) -> ([f64; RESULTS.len()], f64) {
        let mut memory = [0.0; VARIABLES];
        let values = &mut memory[..self.start.len()];
        values.copy_from_slice(&self.start);
        let [height, reynolds] = self.height_and_reynolds(t, a, u.body.position);
        let flow = [
            a.speed,
            a.alpha(),
            a.beta(),
            a.mach,
            a.pressure,
            a.density,
            a.angular.x,
            a.angular.y,
            a.angular.z,
            a.alpha_total(),
            height,
            reynolds,
        ];
        for (place, value) in self.flow.iter().zip(flow) {
            if let Some((k, factor)) = place {
                values[*k] = value / factor;
            }
        }
        for ((k, factor), value) in self.controls.iter().zip(&u.controls) {
            values[*k] = value / factor;
        }
        let inside = self.p.model.model.evaluate(values);
        (self.results.map(|r| r.map_or(0.0, |(k, factor)| values[k] * factor)), inside)
    }
}

/// Inputs that the flow gives, and the length of the Reynolds number (m). Variables in `controls` do not come from the flow.
fn flow(p: &DaveParams, start: &[f64]) -> Result<([Place; FLOW.len()], f64), BuildError> {
    let m = &p.model.model;
    let (mut flow, mut length) = ([None; FLOW.len()], 1.0);
    for (n, (slot, (names, unit))) in flow.iter_mut().zip(FLOW).enumerate() {
        let Some(k) = standard(m, names) else { continue };
        let v = &m.variables[k];
        if v.role != Role::Input || p.controls.contains(&v.id) {
            continue;
        }
        let unknown = match n {
            ALTITUDE if p.atmosphere.altitude(0.0, Vec3::zeros()).is_none() => {
                "the planet above which the altitude is measured"
            }
            REYNOLDS if p.atmosphere.viscosity(273.15).is_none() => "the viscosity of its gas",
            _ => "",
        };
        if !unknown.is_empty() {
            let fact = format!(
                "{} needs {}, but the atmosphere does not define {unknown}",
                p.model.name, v.name
            );
            let help = format!(
                "use an atmosphere that does, such as `environment.us76`, or write controls: [\"{}\"]",
                v.id
            );
            return Err(BuildError::new(fact).help(help).at("atmosphere"));
        }
        let factor = match n {
            REYNOLDS => {
                let (factor, l) = reynolds(p, k, start)?;
                length = l;
                factor
            }
            _ => DaveAerodynamics::factor(m, k, unit)?,
        };
        *slot = Some((k, factor));
    }
    if p.reynolds_length.is_some() && flow[REYNOLDS].is_none() {
        let fact = format!("{} does not use the `reynoldsNumber` of the flow", p.model.name);
        return Err(BuildError::new(fact).help("remove `reynolds_length`").at("reynolds_length"));
    }
    Ok((flow, length))
}

/// The factor of the Reynolds number `k` to SI, and its length: 1 m for one that the file has per length.
fn reynolds(p: &DaveParams, k: usize, start: &[f64]) -> Result<(f64, f64), BuildError> {
    let m = &p.model.model;
    let told =
        |param: &str, fact: String, help: &str| Err(BuildError::new(fact).help(help).at(param));
    if let Ok(factor) = DaveAerodynamics::factor(m, k, "1/m") {
        return match p.reynolds_length {
            None => Ok((factor, 1.0)),
            Some(_) => {
                let fact = format!(
                    "`{}` is per unit of length (its unit is {}), so it needs no reference length",
                    m.variables[k].id, m.variables[k].units
                );
                told("reynolds_length", fact, "remove `reynolds_length`")
            }
        };
    }
    let factor = DaveAerodynamics::factor(m, k, "1")?;
    if let Some(length) = p.reynolds_length {
        if length > 0.0 && length.is_finite() {
            return Ok((factor, length));
        }
        let fact = format!("the reference length of the Reynolds number is {length} m");
        return told("reynolds_length", fact, "write a length above 0");
    }
    let chord = standard(m, RESULTS[9].0).filter(|c| m.variables[*c].role == Role::Constant);
    let length = match chord {
        Some(c) => start[c] * DaveAerodynamics::factor(m, c, "m")?,
        None => 0.0,
    };
    if length > 0.0 {
        return Ok((factor, length));
    }
    let fact = format!(
        "{} needs `reynoldsNumber`, but it has no constant `{CHORD}` above 0 as its reference length",
        p.model.name
    );
    told("reynolds_length", fact, "write the reference length of its Reynolds number in m")
}

/// The aerodynamic model of a DAVE-ML file: tables and formulas over the flow, the body's rates and controls.
#[model("flight.dave_aerodynamics")]
impl Model for DaveAerodynamics {
    type Params = DaveParams;
    type FeedthroughInputs = DaveIn;
    type Outputs = TableFlag;
    type FeedthroughOutputs = DaveOut;
    type DiscreteState = TableExit;
    type Guards = Edge;
    fn build(p: DaveParams) -> Result<Self, BuildError> {
        check_air_rate(&p.air_rate, p.world.as_ref(), "air_rate")?;
        let m = p.model.model.clone();
        let wrong = |param: &str, fact: String, help: String| {
            Err(BuildError::new(fact).help(help).at(param))
        };
        if m.variables.len() > VARIABLES {
            let fact = format!("{} has {} variables", p.model.name, m.variables.len());
            return wrong(
                "model",
                fact,
                format!("split the model: the limit is {VARIABLES} variables"),
            );
        }
        let mut start = vec![0.0; m.variables.len()];
        m.start(&mut start);
        let ids = || m.variables.iter().map(|v| v.id.as_str()).collect::<Vec<_>>();
        for r in &p.set {
            match m.find(&r.variable) {
                Some(k) if m.variables[k].role == Role::Constant => start[k] = r.value,
                Some(_) => {
                    let fact = format!("`{}` is not a constant of {}", r.variable, p.model.name);
                    return wrong(
                        "set",
                        fact,
                        "`set` can replace only the values of constants".into(),
                    );
                }
                None => {
                    let fact = format!("{} has no variable `{}`", p.model.name, r.variable);
                    let help = linkwork_runtime::remedy(&r.variable, "variables", &ids());
                    return wrong("set", fact, help);
                }
            }
        }
        let (flow, length) = flow(&p, &start)?;
        let mut controls = Vec::new();
        for id in &p.controls {
            match m.find(id) {
                Some(k) if m.variables[k].role == Role::Input => {
                    let units = &m.variables[k].units;
                    let Some(unit) = unit_text(units).and_then(|t| Unit::parse(&t).ok()) else {
                        let fact = format!("the unit `{units}` of `{id}` is not known");
                        let help = "write units of the standard in the file, e.g. m_s, rad, Pa";
                        return wrong("controls", fact, help.into());
                    };
                    controls.push((k, unit.scale));
                }
                _ => {
                    let fact = format!("{} has no input `{id}`", p.model.name);
                    let help = linkwork_runtime::remedy(id, "variables", &ids());
                    return wrong("controls", fact, help);
                }
            }
        }
        if controls.len() > CONTROLS {
            let fact = format!("{} controls", controls.len());
            return wrong("controls", fact, format!("the limit is {CONTROLS} controls"));
        }
        let known = |k: usize| flow.iter().flatten().chain(&controls).any(|(i, _)| *i == k);
        let open: Vec<&str> = (0..m.variables.len())
            .filter(|k| m.variables[*k].role == Role::Input && !known(*k))
            .filter(|k| m.variables[*k].initial.is_none())
            .map(|k| m.variables[k].id.as_str())
            .collect();
        if !open.is_empty() {
            let fact = format!("{} has inputs without a source: {}", p.model.name, open.join(", "));
            return wrong(
                "controls",
                fact,
                format!("write controls: [\"{}\"]", open.join("\", \"")),
            );
        }
        let mut results = [None; RESULTS.len()];
        for (slot, (names, unit)) in results.iter_mut().zip(RESULTS) {
            if let Some(k) = standard(&m, names) {
                *slot = Some((k, Self::factor(&m, k, unit)?));
            }
        }
        let (body, lift) = (results[0].or(results[2]), results[3].or(results[4]));
        let absent = match p.forces {
            Forces::Stability => lift.is_none(),
            Forces::Body => body.is_none(),
            Forces::Found => false,
        };
        if absent {
            let fact =
                format!("{} does not define the coefficients that `forces` selects", p.model.name);
            return wrong("forces", fact, "write the other value, or remove `forces`".into());
        }
        let stability = match (p.forces, body, lift) {
            (Forces::Stability, _, _) | (Forces::Found, None, Some(_)) => true,
            (Forces::Body, _, _) | (Forces::Found, _, None) => false,
            (Forces::Found, Some(_), Some(_)) => {
                let fact = format!("{} defines both body forces and lift and drag", p.model.name);
                return wrong("forces", fact, "write forces: body or stability".into());
            }
        };
        let needed = |k: usize| {
            // A coefficient that is always 0 does not need a reference length.
            let acts = |k: usize| {
                results[k].is_some_and(|(v, _): (usize, f64)| {
                    m.variables[v].role != Role::Constant || start[v] != 0.0
                })
            };
            match k {
                8 => true,
                9 => acts(6),
                _ => acts(5) || acts(7),
            }
        };
        if let Some(k) = (8..RESULTS.len()).find(|k| results[*k].is_none() && needed(*k)) {
            let fact = format!("{} has no `{}`", p.model.name, RESULTS[k].0[0]);
            return wrong("model", fact, "coefficients need it: define it in the file".into());
        }
        Ok(DaveAerodynamics { p, flow, length, controls, results, stability, start })
    }
    fn outputs(&self, d: &TableExit) -> TableFlag {
        TableFlag { outside: d.outside }
    }
    fn feedthrough(&self, clock: &Clock, u: &DaveIn) -> DaveOut {
        let a = self.air(clock.t, u);
        let r = self.evaluate(clock.t, &a, u).0;
        let (s, co) = a.alpha().sin_cos();
        let force = if self.stability {
            Vec3::new(-r[4] * co + r[3] * s, r[1], -r[4] * s - r[3] * co)
        } else {
            Vec3::new(r[0], r[1], r[2])
        };
        let moment = Vec3::new(r[5], r[6], r[7]);
        let (area, chord, span) = (r[8], r[9], r[10]);
        let qs = a.pressure * area;
        let arms = Vec3::new(span, chord, span);
        let R = u.body.rotation;
        DaveOut {
            load: Wrench {
                moment: R * (moment.component_mul(&arms) * qs),
                force: R * (force * qs),
            },
            force_coefficient: force,
            moment_coefficient: moment,
            airspeed: a.speed,
            mach: a.mach,
            dynamic_pressure: a.pressure,
            alpha: a.alpha(),
            beta: a.beta(),
        }
    }
    fn guards(&self, clock: &Clock, d: &TableExit, u: &DaveIn) -> Edge {
        Edge::at(self.inside(clock.t, u), d)
    }
    fn handle_event(&self) -> ((), TableExit) {
        // The flow leaves or enters the range, so it has been outside at least once.
        ((), TableExit { outside: true })
    }
    fn runtime_warning(
        &self,
        clock: &Clock,
        fired: Fired<'_>,
        d: &TableExit,
        u: &DaveIn,
    ) -> Option<BuildError> {
        leaves(self.p.outside, fired, || self.reach(&self.air(clock.t, u)), d)
    }
    fn startup_warnings(&self, clock: &Clock, u: &DaveIn) -> Vec<BuildError> {
        remark(self.p.outside, self.inside(clock.t, u), || self.reach(&self.air(clock.t, u)))
    }
}

#[cfg(test)]
#[path = "dave_tests.rs"]
mod tests;
