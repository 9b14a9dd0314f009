//! Bodies and hinges.
use crate::json::{Json, Result};
use serde_json::json;
use std::fmt::Write;

/// Hinge of a body on its parent.
#[derive(Clone, Debug, PartialEq)]
pub enum Joint {
    /// Six degrees of freedom, on the world.
    Free,
    /// A pin about an axis.
    Pin {
        /// Axis.
        axis: [f64; 3],
        /// The motion is prescribed.
        prescribed: bool,
    },
}

/// A body, in axes with z up.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Name.
    pub name: String,
    /// Body that carries it, or `world`.
    pub parent: String,
    /// Hinge in the parent (m).
    pub at: [f64; 3],
    /// Mass (kg).
    pub mass: f64,
    /// Centre of mass (m).
    pub com: [f64; 3],
    /// Inertia about it: xx, yy, zz, xy, xz, yz (kg m²).
    pub inertia: [f64; 6],
    /// Hinge.
    pub joint: Joint,
    /// Turns of the motor for each turn of the hinge.
    pub gear: f64,
}

/// y and z the other way.
fn turned([x, y, z]: [f64; 3]) -> [f64; 3] {
    // The sums avoid negative zeros.
    [x + 0.0, 0.0 - y, 0.0 - z]
}

/// A ratio that is a whole number but for rounding.
fn whole(x: f64) -> f64 {
    if (x - x.round()).abs() < 1e-9 * x.abs() { x.round() } else { x }
}

fn body(name: &str, j: &Json) -> Result<Body> {
    j.at("bodyToJoint")?.must_be(&json!([0.0, 0.0, 0.0]))?;
    let rows: Vec<[f64; 3]> =
        j.at("cmInertia")?.items()?.iter().map(Json::numbers).collect::<Result<_>>()?;
    let [x, y, z] = rows[..] else { return j.error("an inertia has three rows") };
    if (x[1], x[2], y[2]) != (y[0], z[0], z[1]) {
        return j.error("the inertia is not symmetric");
    }
    let (joint, parent, at, gear) = match j.at("jointType")?.text()?.as_str() {
        "FULL6DOF" => (Joint::Free, "world".to_string(), [0.0; 3], 1.0),
        "PIN" => {
            let axes = j.at("jointAxes")?.items()?;
            let [axis] = &axes[..] else { return j.error("a pin has one axis") };
            let prescribed = j.at("prescribed")?.flag()?;
            j.at("prescribeType")?.must_be(&json!(if prescribed { "Q" } else { "NONE" }))?;
            let joint = Joint::Pin { axis: turned(axis.numbers()?), prescribed };
            let ratio = j.at("gearRatio")?.number()?;
            let at = turned(j.at("inbToJoint")?.numbers()?);
            (joint, j.at("inbBody")?.text()?, at, whole(1.0 / ratio))
        }
        other => return j.error(&format!("a hinge of the type {other} is not known")),
    };
    Ok(Body {
        name: name.into(),
        parent,
        at,
        mass: j.at("mass")?.number()?,
        com: turned(j.at("bodyToCM")?.numbers()?),
        inertia: [x[0], y[1], z[2], 0.0 - x[1], 0.0 - x[2], y[2]],
        joint,
        gear,
    })
}

/// All bodies, parents before children, else by name.
pub fn read(j: &Json) -> Result<Vec<Body>> {
    let mut rest: Vec<Body> =
        j.entries()?.iter().map(|(name, b)| body(name, b)).collect::<Result<_>>()?;
    let mut out: Vec<Body> = Vec::new();
    while !rest.is_empty() {
        let there = |b: &Body| b.parent == "world" || out.iter().any(|o| o.name == b.parent);
        let (ready, later): (Vec<_>, Vec<_>) = rest.into_iter().partition(there);
        if ready.is_empty() {
            return j.error(&format!("the parent of `{}` does not exist", later[0].name));
        }
        out.extend(ready);
        rest = later;
    }
    Ok(out)
}

/// Fields of bodies that are not used.
pub fn left(j: &Json) -> Result<Vec<String>> {
    let mut out = Vec::new();
    for (name, b) in j.entries()? {
        body(&name, &b)?;
        for key in b.ignored()? {
            let plain = matches!(key.as_str(), "prescribeType" | "prescribed");
            if !(plain && b.at("jointType")?.text()? == "FULL6DOF") {
                out.push(format!(
                    "bodies: {key} (places of models on their bodies; all are at the origin)"
                ));
            }
        }
        for nodes in ["ACTUATOR_NODES", "SENSOR_NODES"] {
            for (_, node) in b.find(nodes)?.map_or(Ok(Vec::new()), |n| n.entries())? {
                node.at("bodyToNode")?.must_be(&json!([0.0, 0.0, 0.0]))?;
            }
        }
    }
    Ok(out)
}

/// To a micrometre: a shape is to be seen.
fn short(x: f64) -> f64 {
    (x * 1e6).round() / 1e6
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|c| c * c).sum::<f64>().sqrt()
}

impl Body {
    /// Returns the body as an entry of `bodies`; `wheel`: radius and width.
    pub fn ron(&self, all: &[Body], wheel: Option<(f64, f64)>) -> String {
        let hinge = match &self.joint {
            Joint::Free => "Free".to_string(),
            Joint::Pin { axis, prescribed: false } => format!("Pin({axis:?})"),
            Joint::Pin { axis, prescribed: true } => {
                format!("Pin(axis: {axis:?}, prescribed: true)")
            }
        };
        let mut t = format!(
            "                {:?}: (\n                    parent: {:?}, ",
            self.name, self.parent
        );
        if self.parent != "world" {
            let _ = write!(t, "at: (position: {:?}), ", self.at);
        }
        let _ = writeln!(t, "hinge: {hinge},");
        let _ = writeln!(
            t,
            "                    mass: {:?}, com: {:?}, inertia: {:?},",
            self.mass, self.com, self.inertia
        );
        let [x, y, z, ..] = self.inertia;
        if x + y < z || y + z < x || z + x < y {
            t += "                    inertia_check: PositiveMoments, // the rotor of the motor is lumped into it\n";
        }
        let _ =
            writeln!(t, "                    shapes: [{}],", self.shapes(all, wheel).join(", "));
        t += "                ),\n";
        t
    }

    fn shapes(&self, all: &[Body], wheel: Option<(f64, f64)>) -> Vec<String> {
        if let Some((r, w)) = wheel {
            return vec![
                format!(
                    "(shape: Cylinder(radius: {r:?}, length: {w:?}, axis: [0, 1, 0]), color: [0.32, 0.33, 0.36], name: \"tyre\")"
                ),
                format!(
                    "(shape: Box([0.02, {:?}, {:?}]), color: [0.85, 0.85, 0.88], name: \"spoke\")",
                    short(w + 0.01),
                    short(2.0 * r - 0.02)
                ),
            ];
        }
        if self.joint == Joint::Free {
            // The sides a, b, c of the box follow from 12 J_xx = m (b² + c²), and so on.
            let [x, y, z, ..] = self.inertia;
            let side = |s: f64| ((6.0 * s / self.mass).sqrt() * 1000.0).round() / 1000.0;
            let sides = [side(y + z - x), side(z + x - y), side(x + y - z)];
            return vec![format!(
                "(shape: Box({sides:?}), at: (position: {:?}), color: [0.88, 0.86, 0.80], name: \"body\")",
                self.com
            )];
        }
        let ends: Vec<[f64; 3]> =
            all.iter().filter(|b| b.parent == self.name).map(|b| b.at).collect();
        let rod = |(k, end): (usize, [f64; 3])| {
            let l = length(end);
            let (l, middle) = (short(l), end.map(|c| short(0.5 * c)));
            format!(
                "(shape: Cylinder(radius: 0.015, length: {l:?}, axis: {end:?}), at: (position: {middle:?}), color: [0.75, 0.72, 0.62], name: \"rod {}\")",
                k + 1
            )
        };
        ends.into_iter().filter(|e| length(*e) > 0.0).enumerate().map(rod).collect()
    }
}
