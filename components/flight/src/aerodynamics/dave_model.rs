//! `flight.dave_model`: part for any static model of a DAVE-ML file, such as inertia, propulsion or a control law.
//! ```text
//! inputs    every variable that the file leaves open, by its varID        outputs   every `isOutput`, by its varID
//! ```
//! Ports are in SI; the file's units are converted. The file's static shots are run when it is loaded, and a file that fails its own shots is an error.
//! Use `flight.dave_aerodynamics` for forces of the air, and `flight.wired_mass` to give a body the computed mass.

use super::dave::{DaveFile, Replacement};
use linkwork_formats::daveml::{DaveVariable, Role, unit_text};
use linkwork_runtime::prelude::*;
use linkwork_runtime::{Unit, remedy};

/// A file, and constants of it whose values are replaced here.
#[derive(Params, Clone, Debug)]
pub struct DaveModelParams {
    /// The file.
    pub model: DaveFile,
    /// Constants of the file that have other values here.
    #[param(default = Vec::new())]
    pub set: Vec<Replacement>,
}

/// A static model.
pub struct DaveStatic {
    p: DaveModelParams,
    /// Index and factor to SI of inputs and outputs.
    inputs: Vec<(usize, f64)>,
    outputs: Vec<(usize, f64)>,
    start: Vec<f64>,
}

const BASE: [&str; 8] = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];

/// The unit of a variable.
fn unit(v: &DaveVariable) -> Option<Unit> {
    unit_text(&v.units).and_then(|t| Unit::parse(&t).ok())
}

/// Returns the SI unit of the same quantity: `kg m^2`.
fn si(unit: &Unit) -> String {
    let factors = BASE.iter().zip(unit.exponents).filter(|(_, p)| *p != 0);
    let text = |(base, p): (&&str, i8)| match p {
        1 => (*base).to_string(),
        p => format!("{base}^{p}"),
    };
    let all: Vec<String> = factors.map(text).collect();
    if all.is_empty() { "1".into() } else { all.join(" ") }
}

fn inputs(p: &DaveModelParams) -> impl Iterator<Item = (usize, &DaveVariable)> {
    p.model.model().variables.iter().enumerate().filter(|(_, v)| v.role == Role::Input)
}

fn outputs(p: &DaveModelParams) -> impl Iterator<Item = (usize, &DaveVariable)> {
    // A variable that is both an input and an output is left out, because the caller already has
    // it.
    p.model.model().variables.iter().enumerate().filter(|(_, v)| v.output && v.role != Role::Input)
}

fn port(v: &DaveVariable) -> PortSpec {
    let plain = |c: char| if c.is_alphanumeric() { c } else { '_' };
    let name: String = v.id.chars().map(plain).collect();
    let doc = if v.doc.is_empty() { format!("`{}` of the file.", v.name) } else { v.doc.clone() };
    let unit = unit(v).map_or("*".to_string(), |u| si(&u));
    PortSpec::named(name, PortKind::Numbers, 1).unit_of(unit).doc_of(doc)
}

/// A static model of a DAVE-ML file: inertia, propulsion or a control law, with a port for each of its inputs and outputs.
#[model("flight.dave_model")]
impl SizedModel for DaveStatic {
    type Params = DaveModelParams;
    fn ports(p: &DaveModelParams) -> SizedPorts {
        let open = |v: &DaveVariable| match v.initial {
            Some(x) => port(v).or(x * unit(v).map_or(1.0, |u| u.scale)),
            None => port(v),
        };
        SizedPorts {
            feedthrough_inputs: inputs(p).map(|(_, v)| open(v)).collect(),
            feedthrough_outputs: outputs(p).map(|(_, v)| port(v)).collect(),
            ..SizedPorts::default()
        }
    }

    fn build(p: DaveModelParams) -> Result<Self, BuildError> {
        let m = p.model.model().clone();
        let wrong = |param: &str, fact: String, help: String| {
            Err(BuildError::new(fact).help(help).at(param))
        };
        let mut start = vec![0.0; m.variables.len()];
        m.start(&mut start);
        for r in &p.set {
            match m.find(&r.variable) {
                Some(k) if m.variables[k].role == Role::Constant => start[k] = r.value,
                _ => {
                    let constants = m.variables.iter().filter(|v| v.role == Role::Constant);
                    let ids: Vec<&str> = constants.map(|v| v.id.as_str()).collect();
                    let fact = format!("`{}` is not a constant of the file", r.variable);
                    return wrong("set", fact, remedy(&r.variable, "constants", &ids));
                }
            }
        }
        let strange = inputs(&p).chain(outputs(&p)).find(|(_, v)| unit(v).is_none());
        if let Some((_, v)) = strange {
            let fact = format!("the unit `{}` of `{}` is not known", v.units, v.id);
            let help = "write units of the standard in the file, e.g. m_s, rad, Pa";
            return wrong("model", fact, help.into());
        }
        if outputs(&p).next().is_none() {
            let help = "mark a variable with <isOutput/> in the file";
            return wrong("model", "the file has no output".into(), help.into());
        }
        let place = |(k, v): (usize, &DaveVariable)| (k, unit(v).map_or(1.0, |u| u.scale));
        let (inputs, outputs) = (inputs(&p).map(place).collect(), outputs(&p).map(place).collect());
        Ok(DaveStatic { inputs, outputs, start, p })
    }

    fn feedthrough(&self, u: &[f64], y: &mut [f64]) {
        let mut memory = [0.0; super::dave::VARIABLES];
        let values = &mut memory[..self.start.len()];
        values.copy_from_slice(&self.start);
        for ((k, factor), x) in self.inputs.iter().zip(u) {
            values[*k] = x / factor;
        }
        self.p.model.model().evaluate(values);
        for (y, (k, factor)) in y.iter_mut().zip(&self.outputs) {
            *y = values[*k] * factor;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A part of the inertia model of the two-stage rocket in NASA/TM-2015-218675 (NESC check case 17), in the form in which it is published.
    const ROCKET: &str = r#"<?xml version="1.0"?>
<DAVEfunc xmlns="http://daveml.org/2010/DAVEML"><fileHeader name="rocket"><author name="a" org="b"/><creationDate date="2013-08-09"/></fileHeader>
<variableDef name="rocketHasStaged" varID="stagedFlag" units="nd"/>
<variableDef name="stage1fuelConsumed" varID="stg1fuelUsed" units="kg"/>
<variableDef name="stage2fuelConsumed" varID="stg2fuelUsed" units="kg"/>
<variableDef name="a" varID="ignite1" units="kgm2" initialValue="353250"/><variableDef name="b" varID="burnout1" units="kgm2" initialValue="150750"/>
<variableDef name="c" varID="ignite2" units="kgm2" initialValue="111375"/><variableDef name="d" varID="burnout2" units="kgm2" initialValue="21375"/>
<variableDef name="stage1FuelRemainingFrac" varID="frac1" units="frac" minValue="0" maxValue="1"><calculation><math xmlns="http://www.w3.org/1998/Math/MathML">
 <apply><divide/><apply><minus/><cn>180000</cn><ci>stg1fuelUsed</ci></apply><cn>180000</cn></apply></math></calculation><isOutput/></variableDef>
<variableDef name="stage2FuelRemainingFrac" varID="frac2" units="frac" minValue="0" maxValue="1"><calculation><math xmlns="http://www.w3.org/1998/Math/MathML">
 <apply><divide/><apply><minus/><cn>80000</cn><ci>stg2fuelUsed</ci></apply><cn>80000</cn></apply></math></calculation><isOutput/></variableDef>
<variableDef name="bodyMomentOfInertia_Roll" varID="XIXX" units="kgm2"><calculation><math xmlns="http://www.w3.org/1998/Math/MathML">
 <apply><piecewise><piece><apply><plus/><ci>burnout2</ci><apply><times/><apply><minus/><ci>ignite2</ci><ci>burnout2</ci></apply><ci>frac2</ci></apply></apply>
 <apply><gt/><ci>stagedFlag</ci><cn>0</cn></apply></piece>
 <otherwise><apply><plus/><ci>burnout1</ci><apply><times/><apply><minus/><ci>ignite1</ci><ci>burnout1</ci></apply><ci>frac1</ci></apply></apply></otherwise></piecewise></apply>
 </math></calculation><isOutput/><isStdAIAA/></variableDef></DAVEfunc>"#;

    #[test]
    fn the_inertia_of_a_rocket_follows_its_propellant_and_its_stage() {
        let p = |set| DaveModelParams { model: DaveFile::new("rocket.dml", ROCKET).unwrap(), set };
        let ports = DaveStatic::ports(&p(Vec::new()));
        let names = |all: &[PortSpec]| -> Vec<String> {
            all.iter().map(|p| format!("{} {}", p.name, p.unit)).collect()
        };
        let inputs = names(&ports.feedthrough_inputs);
        assert_eq!(inputs, ["stagedFlag 1", "stg1fuelUsed kg", "stg2fuelUsed kg"]);
        assert_eq!(names(&ports.feedthrough_outputs), ["frac1 1", "frac2 1", "XIXX kg m^2"]);
        let run = |set, u: [f64; 3]| {
            let mut y = [0.0; 3];
            let m = DaveStatic::build(p(set)).unwrap();
            m.feedthrough(&u, &mut y);
            y
        };
        // The value for half of the first stage's propellant is the mean of 353250 and 150750.
        assert_eq!(run(Vec::new(), [0.0, 90_000.0, 0.0]), [0.5, 1.0, 252_000.0]);
        assert_eq!(run(Vec::new(), [1.0, 180_000.0, 60_000.0]), [0.0, 0.25, 43_875.0]);
        let other = || vec![Replacement { variable: "ignite1".into(), value: 151_750.0 }];
        assert_eq!(run(other(), [0.0, 90_000.0, 0.0])[2], 151_250.0);
        let wrong = vec![Replacement { variable: "XIXX".into(), value: 1.0 }];
        assert!(DaveStatic::build(p(wrong)).is_err());
    }
}
