//! The assembly tree and its models, class by class.
//! ```text
//! DCMotorVin          actuators.dc_motor           K_t, R; the gear is that of the hinge
//! RoverPinEncoder     sensors.encoder              at the motor's side of the gear
//! GearedPinAngle      basics.hinge_trajectory      a column of the file of steering angles
//! CompliantTerzaghi   mobility.wheel_rigid         k xⁿ (1 + 3/2 α ẋ), tangential spring and damper; with the
//! TerrainPenAnalytic  (its geometry)               ground of the terrain service
//! SoftJointStop       actuators.soft_stop          k p (1 + 3/2 α ṗ)
//! DiffConstraint      a coupling, or actuators.differential
//! NodePosAttitude     sensors.pose
//! GeneralGravity, RoverPinTruth                    nothing: gravity is a service, truth a variable of the hinge
//! ```
//! α is taken as Hunt and Crossley have it.
use crate::bodies::Body;
use crate::json::{Json, Result};
use serde_json::json;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Result of the conversion of the tree.
pub struct Out<'a> {
    bodies: &'a [Body],
    /// Text of `parts`.
    pub parts: String,
    /// Export: path of a port.
    pub exports: BTreeMap<String, String>,
    /// Unused entries.
    pub left: Vec<String>,
    /// Stiffness and damping of the differential.
    pub differential: Option<(f64, f64)>,
    /// Body: radius and width of a wheel.
    wheels: BTreeMap<String, (f64, f64)>,
    path: Vec<String>,
}

/// A model of ours: its name, parameters, bindings, rate, and its ports by the makers' names.
#[derive(Default)]
struct MappedModel {
    model: &'static str,
    params: String,
    bind: String,
    rate: &'static str,
    ports: &'static [(&'static str, &'static str)],
}

const KINDS: [&str; 5] =
    ["Actuator MODELS", "Encoder MODELS", "Motor MODELS", "Sensor MODELS", "Flow MODELS"];

impl<'a> Out<'a> {
    pub fn new(bodies: &'a [Body]) -> Result<Out<'a>> {
        Ok(Out {
            bodies,
            parts: String::new(),
            exports: BTreeMap::new(),
            left: Vec::new(),
            differential: None,
            wheels: BTreeMap::new(),
            path: Vec::new(),
        })
    }

    /// Radius and width, when a body is a wheel.
    pub fn wheel(&self, body: &str) -> Option<(f64, f64)> {
        self.wheels.get(body).copied()
    }

    /// The parts of an assembly and of those inside it.
    pub fn tree(&mut self, j: &Json, depth: usize) -> Result<()> {
        let indent = "    ".repeat(depth + 1);
        for kind in KINDS {
            for (name, model) in j.find(kind)?.map_or(Ok(Vec::new()), |m| m.entries())? {
                self.model(&name, &model, &indent)?;
            }
        }
        for (name, inner) in j.find("ASSEMBLY")?.map_or(Ok(Vec::new()), |m| m.entries())? {
            let before = self.parts.len();
            let _ = writeln!(self.parts, "{indent}{name:?}: (\n{indent}    parts: {{");
            let begin = self.parts.len();
            self.path.push(name);
            self.tree(&inner, depth + 2)?;
            self.path.pop();
            if self.parts.len() == begin {
                // The subsystem is omitted if none of its devices has a counterpart.
                self.parts.truncate(before);
            } else {
                let _ = writeln!(self.parts, "{indent}    }},\n{indent}),");
            }
        }
        Ok(())
    }

    fn model(&mut self, name: &str, j: &Json, indent: &str) -> Result<()> {
        let class = j.at("class")?.text()?;
        let params = match j.find("PARAMS")? {
            Some(params) => params,
            None => Json::read(name, "{}")?,
        };
        let made = self.made(&class, name, &params, j)?;
        for key in params.ignored()? {
            self.left.push(format!("{class}: {key}"));
        }
        let Some(made) = made else { return Ok(()) };
        let _ = write!(self.parts, "{indent}{name:?}: (model: {:?}, ", made.model);
        if !made.rate.is_empty() {
            let _ = write!(self.parts, "rate: {:?}, ", made.rate);
        }
        if !made.params.is_empty() {
            let _ = write!(self.parts, "params: {{ {} }}, ", made.params);
        }
        let _ = writeln!(self.parts, "bind: {{ {} }}),", made.bind);
        for (_, tie) in j.at("MODEL_TIES")?.entries()? {
            let port = tie.at("ioName")?.text()?;
            let Some((_, ours)) = made.ports.iter().find(|p| p.0 == port) else {
                self.left.push(format!("{class}: port {port}"));
                continue;
            };
            let mut export = tie.at("signal")?.text()?;
            if let Some(slice) = tie.find("ioSlice")? {
                let [a, b] = slice.numbers()?;
                if a != b {
                    return slice.error("a scalar is one element of a signal");
                }
                let _ = write!(export, "_{a}");
            }
            let path = format!("{}.{name}.{ours}", self.path.join("."));
            if self.exports.insert(export.clone(), path).is_some() {
                return tie.error(&format!("`{export}` is tied twice"));
            }
        }
        Ok(())
    }

    /// The body that a model is named after.
    fn body(&self, name: &str, ending: &str, j: &Json) -> Result<&'a Body> {
        let Some(stem) = name.strip_suffix(ending) else {
            return j.error(&format!("a model of this class is called <body>{ending}"));
        };
        match self.bodies.iter().find(|b| b.name == stem) {
            Some(body) => Ok(body),
            None => j.error(&format!("there is no body `{stem}`")),
        }
    }

    fn made(&mut self, class: &str, name: &str, p: &Json, j: &Json) -> Result<Option<MappedModel>> {
        let hinge = |bind: &str, body: &Body| format!("{bind:?}: \"hinge:R8Mbody/{}\"", body.name);
        Ok(Some(match class {
            "DCMotorVin" => {
                let body = self.body(name, "_motor", j)?;
                let (k, r) = (p.at("K_t")?.number()?, p.at("R")?.number()?);
                p.at("damping")?.must_be(&json!(0.0))?;
                MappedModel {
                    model: "actuators.dc_motor",
                    params: format!(
                        "\"resistance\": {r:?}, \"torque_constant\": {k:?}, \"gear\": {:?}",
                        body.gear
                    ),
                    bind: hinge("shaft", body),
                    ports: &[
                        ("voltage", "volts"),
                        ("torque", "shaft_torque"),
                        ("power", "power"),
                        ("current", "current"),
                    ],
                    ..MappedModel::default()
                }
            }
            "RoverPinEncoder" => {
                let body = self.body(name, "_encoder", j)?;
                p.at("polarity")?.must_be(&json!(1))?;
                MappedModel {
                    model: "sensors.encoder",
                    params: format!("\"ticks\": \"$encoder_ticks\", \"gear\": {:?}", body.gear),
                    bind: hinge("shaft", body),
                    rate: "$encoder_rate",
                    ports: &[("angle", "angle"), ("rate", "rate")],
                }
            }
            "GearedPinAngle" => {
                let body = self.body(name, "_motor", j)?;
                MappedModel {
                    model: "basics.hinge_trajectory",
                    params: format!(
                        "\"profile\": (file: \"$steering\", column: {:?}), \"between\": stops",
                        body.name
                    ),
                    bind: hinge("hinge", body),
                    ..MappedModel::default()
                }
            }
            "CompliantTerzaghi" => {
                let body = self.body(name, "_contact", j)?;
                p.at("normalForceModel")?.must_be(&json!("nonlinear"))?;
                p.at("tangentForceModel")?.must_be(&json!("linear"))?;
                let ([kn, kt], [an, at]) = (p.at("kp")?.numbers()?, p.at("alpha")?.numbers()?);
                let [n, m] = p.at("n")?.numbers::<2>()?;
                if m != 1.0 {
                    return p.error("only a linear tangential force can be converted");
                }
                let (r, w) = (p.at("wheel_radius")?.number()?, p.at("wheel_width")?.number()?);
                self.wheels.insert(body.name.clone(), (r, w));
                MappedModel {
                    model: "mobility.wheel_rigid",
                    params: format!(
                        "\"radius\": {r:?}, \"width\": {w:?}, \"stiffness\": {kn:?}, \"exponent\": {n:?}, \"dissipation\": {an:?}, \"tangential_stiffness\": {kt:?}, \"tangential_damping\": {at:?}, \"friction\": \"$friction\""
                    ),
                    bind: format!("\"hub\": \"node:R8Mbody/{}\"", body.name),
                    ..MappedModel::default()
                }
            }
            "TerrainPenAnalytic" => {
                p.at("axis")?.must_be(&json!([0.0, 1.0, 0.0]))?;
                let wheel = self.body(name, "_pen", j)?.name.clone();
                let same = self.wheel(&wheel)
                    == Some((p.at("radius")?.number()?, p.at("width")?.number()?));
                if !same {
                    return p.error("radius and width differ from the wheel's contact");
                }
                self.left.push(
                    "TerrainPenAnalytic: its ports (the contact queries the ground itself)".into(),
                );
                return Ok(None);
            }
            "SoftJointStop" => {
                let body = self.body(name, "_JointStop", j)?;
                p.at("n")?.must_be(&json!(1.0))?;
                let (lower, upper) =
                    (p.at("lower_bound")?.number()?, p.at("upper_bound")?.number()?);
                let (k, alpha) = (p.at("k")?.number()?, p.at("alpha")?.number()?);
                MappedModel {
                    model: "actuators.soft_stop",
                    params: format!(
                        "\"lower\": {lower:?}, \"upper\": {upper:?}, \"stiffness\": {k:?}, \"dissipation\": {:?}",
                        1.5 * alpha
                    ),
                    bind: hinge("shaft", body),
                    ..MappedModel::default()
                }
            }
            "DiffConstraint" => {
                self.body(name, "_motor", j)?;
                let both = (p.at("k")?.number()?, p.at("c")?.number()?);
                if self.differential.is_some_and(|old| old != both) {
                    return p.error("the two sides of the differential differ");
                }
                if self.differential.replace(both).is_none() {
                    let _ = writeln!(
                        self.parts,
                        "{}\"Differential\": (assembly: \"differential_${{differential}}.ron\", mounts: {{ \"left\": \"R8Mbody/RockerLeft\", \"right\": \"R8Mbody/RockerRight\" }}),",
                        "    ".repeat(2 * self.path.len() + 2)
                    );
                }
                return Ok(None);
            }
            "NodePosAttitude" => MappedModel {
                model: "sensors.pose",
                bind: "\"mount\": \"node:R8Mbody/chassis\"".into(),
                rate: "10 Hz",
                ..MappedModel::default()
            },
            "GeneralGravity" => {
                self.left.push(
                    "GeneralGravity: its ports (gravity is a service of the surroundings)".into(),
                );
                return Ok(None);
            }
            "RoverPinTruth" => {
                self.left.push(
                    "RoverPinTruth: its ports (the angle and rate of a hinge are variables)".into(),
                );
                return Ok(None);
            }
            other => return j.error(&format!("models of the class {other} are not known")),
        }))
    }
}
