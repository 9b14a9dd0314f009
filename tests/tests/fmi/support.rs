//! FMUs for tests, compiled from C at run time, and simulations that contain them.
use linkwork_assembly::{Options, load_file};
use linkwork_runtime::{Catalogue, Files, Program, Seconds, Simulation};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use tempfile::TempDir;

/// The spring, or the ball, of `c/model.h`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    Spring = 1,
    Ball = 2,
}

/// The token with which the C code is compiled.
pub const TOKEN: &str = "{8c4e810f-3df3-4a00-8276-176fa3c9f9e0}";

/// A folder with FMUs and a simulation.
pub struct Bench {
    pub dir: TempDir,
}

/// Returns whether there is a C compiler. Without one the test is skipped, with a message; if CI is set this is a failure.
pub fn compiler() -> bool {
    let there = Command::new("cc").arg("--version").output().is_ok_and(|o| o.status.success());
    if !there {
        assert!(std::env::var_os("CI").is_none(), "there is no C compiler `cc`");
        println!("skipped: there is no C compiler `cc`");
    }
    there
}

/// Returns the model description of an FMU.
pub fn description(version: u8, model: Model) -> String {
    let (id, token) = ("unit", TOKEN);
    let spring = model == Model::Spring;
    let reals: Vec<(&str, u32, &str, &str)> = match model {
        Model::Spring => vec![
            ("x", 1, "output", "start=\"1\" unit=\"m\""),
            ("v", 2, "output", "start=\"0\" unit=\"m/s\""),
            ("mass", 5, "parameter", "start=\"1\" unit=\"kg\""),
            ("stiffness", 6, "parameter", "start=\"4\""),
            ("damping", 7, "parameter", "start=\"0.4\""),
            ("force", 8, "input", "start=\"0\" unit=\"N\""),
            ("spring.a", 9, "output", "unit=\"m/s2\""),
        ],
        Model::Ball => vec![
            ("h", 1, "output", "start=\"1\" unit=\"m\""),
            ("v", 2, "output", "start=\"0\" unit=\"m/s\""),
            ("gravity", 5, "parameter", "start=\"9.81\""),
            ("restitution", 6, "parameter", "start=\"0.8\""),
            ("on_at", 7, "parameter", "start=\"0.25\" unit=\"s\""),
            ("gap", 9, "output", "unit=\"m\""),
        ],
    };
    let wholes: &[(&str, u32, &str, &str)] = match model {
        Model::Spring => &[("fault", 23, "parameter", "Integer")],
        Model::Ball => &[
            ("n", 20, "output", "Integer"),
            ("lamp", 21, "output", "Boolean"),
            ("floor", 22, "input", "Integer"),
            ("fault", 23, "parameter", "Integer"),
        ],
    };
    let units = "<UnitDefinitions>\
        <Unit name=\"m\"><BaseUnit m=\"1\"/></Unit><Unit name=\"mm\"><BaseUnit m=\"1\" factor=\"0.001\"/></Unit>\
        <Unit name=\"s\"><BaseUnit s=\"1\"/></Unit><Unit name=\"kg\"><BaseUnit kg=\"1\"/></Unit>\
        <Unit name=\"m/s\"><BaseUnit m=\"1\" s=\"-1\"/></Unit><Unit name=\"m/s2\"><BaseUnit m=\"1\" s=\"-2\"/></Unit>\
        <Unit name=\"N\"><BaseUnit kg=\"1\" m=\"1\" s=\"-2\"/></Unit></UnitDefinitions>";
    // States, parameters and inputs have start values; other outputs are computed.
    let exact = |name: &str, causality: &str| match (name, causality) {
        ("x" | "v" | "h", _) => " initial=\"exact\"",
        _ => "",
    };
    let varying = |causality: &str| if causality == "parameter" { "fixed" } else { "continuous" };
    let start = |causality: &str, kind: &str| match (causality, kind) {
        ("output", _) => "",
        (_, "Boolean") => "start=\"false\"",
        _ => "start=\"0\"",
    };
    let holds = |causality: &str| if causality == "parameter" { "fixed" } else { "discrete" };
    let mut v = String::new();
    if version == 2 {
        for (name, vr, causality, more) in &reals {
            v += &format!(
                "<ScalarVariable name=\"{name}\" valueReference=\"{vr}\" causality=\"{causality}\" \
                 variability=\"{}\"{}><Real {more}/></ScalarVariable>\n",
                varying(causality),
                exact(name, causality)
            );
        }
        // Indices start at 1, and the derivatives follow the reals.
        let (dx, dv) = (reals.len() + 1, reals.len() + 2);
        for (name, vr, of) in [("der(x)", 3, 1), ("der(v)", 4, 2)] {
            v += &format!(
                "<ScalarVariable name=\"{name}\" valueReference=\"{vr}\"><Real derivative=\"{of}\"/></ScalarVariable>\n"
            );
        }
        for (name, vr, causality, kind) in wholes {
            v += &format!(
                "<ScalarVariable name=\"{name}\" valueReference=\"{vr}\" causality=\"{causality}\" \
                 variability=\"{}\"><{kind} {}/></ScalarVariable>\n",
                holds(causality),
                start(causality, kind)
            );
        }
        let outputs = if spring {
            // x and v do not depend on inputs; a depends on the force (index 6).
            "<Unknown index=\"1\" dependencies=\"\"/><Unknown index=\"2\" dependencies=\"\"/>\
             <Unknown index=\"7\" dependencies=\"1 2 6\"/>"
        } else {
            "<Unknown index=\"1\"/><Unknown index=\"2\"/><Unknown index=\"6\"/>\
             <Unknown index=\"9\"/><Unknown index=\"10\"/>"
        };
        let can = "canGetAndSetFMUstate=\"true\" canSerializeFMUstate=\"true\"";
        return format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
             <fmiModelDescription fmiVersion=\"2.0\" modelName=\"{model:?}\" guid=\"{token}\" numberOfEventIndicators=\"1\">\n\
             <ModelExchange modelIdentifier=\"{id}\" {can}/>\n\
             <CoSimulation modelIdentifier=\"{id}\" {can} canHandleVariableCommunicationStepSize=\"true\"/>\n\
             {units}<ModelVariables>{v}</ModelVariables>\n\
             <ModelStructure><Outputs>{outputs}</Outputs>\
             <Derivatives><Unknown index=\"{dx}\"/><Unknown index=\"{dv}\"/></Derivatives></ModelStructure>\n\
             </fmiModelDescription>"
        );
    }
    v += "<Float64 name=\"time\" valueReference=\"0\" causality=\"independent\"/>\n";
    for (name, vr, causality, more) in &reals {
        v += &format!(
            "<Float64 name=\"{name}\" valueReference=\"{vr}\" causality=\"{causality}\" \
             variability=\"{}\"{} {more}/>\n",
            varying(causality),
            exact(name, causality)
        );
    }
    for (name, vr, of) in [("der(x)", 3, 1), ("der(v)", 4, 2)] {
        v += &format!("<Float64 name=\"{name}\" valueReference=\"{vr}\" derivative=\"{of}\"/>\n");
    }
    for (name, vr, causality, kind) in wholes {
        let kind = if *kind == "Integer" { "Int32" } else { kind };
        v += &format!(
            "<{kind} name=\"{name}\" valueReference=\"{vr}\" causality=\"{causality}\" variability=\"{}\" {}/>\n",
            holds(causality),
            start(causality, kind)
        );
    }
    v += "<Float64 name=\"both\" valueReference=\"30\" causality=\"output\"><Dimension start=\"2\"/></Float64>\n";
    v += "<Float64 name=\"z\" valueReference=\"31\"/>\n";
    let outputs = if spring {
        "<Output valueReference=\"1\" dependencies=\"\"/><Output valueReference=\"2\" dependencies=\"\"/>\
         <Output valueReference=\"9\" dependencies=\"1 2 8\"/><Output valueReference=\"30\" dependencies=\"1 2\"/>"
    } else {
        "<Output valueReference=\"1\"/><Output valueReference=\"2\"/><Output valueReference=\"9\"/>\
         <Output valueReference=\"20\"/><Output valueReference=\"21\"/><Output valueReference=\"30\"/>"
    };
    let can = "canGetAndSetFMUState=\"true\" canSerializeFMUState=\"true\"";
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <fmiModelDescription fmiVersion=\"3.0\" modelName=\"{model:?}\" instantiationToken=\"{token}\">\n\
         <ModelExchange modelIdentifier=\"{id}\" {can} needsCompletedIntegratorStep=\"true\"/>\n\
         <CoSimulation modelIdentifier=\"{id}\" {can} canHandleVariableCommunicationStepSize=\"true\"/>\n\
         {units}<ModelVariables>{v}</ModelVariables>\n\
         <ModelStructure>{outputs}<ContinuousStateDerivative valueReference=\"3\"/>\
         <ContinuousStateDerivative valueReference=\"4\"/><EventIndicator valueReference=\"31\"/></ModelStructure>\n\
         </fmiModelDescription>"
    )
}

/// The folder of binaries for this machine.
pub fn platform(version: u8) -> String {
    let (arch, os) = (std::env::consts::ARCH, std::env::consts::OS);
    match (version, arch) {
        (2, "x86_64") => format!("{os}64"),
        _ => format!("{arch}-{os}"),
    }
}

/// Path of the shared library in the archive.
pub fn binary(version: u8) -> String {
    format!("binaries/{}/unit{}", platform(version), std::env::consts::DLL_SUFFIX)
}

/// Compiles the C code, with additional macros.
pub fn library(dir: &Path, version: u8, model: Model) -> Vec<u8> {
    let c = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/fmi/c");
    let out = dir.join(format!("unit{version}{}.so", model as u8));
    if !out.exists() {
        let status = Command::new("cc")
            .args(["-shared", "-fPIC", "-O1", "-o"])
            .arg(&out)
            .arg(format!("-DMODEL={}", model as u8))
            .arg(format!("-DGUID=\"{TOKEN}\""))
            .arg(c.join(format!("fmi{version}.c")))
            .arg("-lm")
            .status();
        assert!(status.unwrap().success(), "cc failed");
    }
    std::fs::read(out).unwrap()
}

/// Writes an archive.
pub fn pack(path: &Path, entries: &[(&str, &[u8])]) {
    linkwork_fmi::write_archive(path, entries).unwrap();
}

impl Bench {
    pub fn new() -> Bench {
        Bench { dir: tempfile::tempdir().unwrap() }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// Writes an FMU with an edited description.
    pub fn unit(&self, name: &str, version: u8, model: Model, edit: impl Fn(String) -> String) {
        let (text, code) =
            (edit(description(version, model)), library(self.dir.path(), version, model));
        let entries: [(&str, &[u8]); 2] =
            [("modelDescription.xml", text.as_bytes()), (&binary(version), &code)];
        pack(&self.path(name), &entries);
    }

    /// Loads a simulation from a text.
    pub fn sim(&self, text: &str) -> Result<Simulation, String> {
        Ok(Simulation::of(self.program(text)?))
    }

    /// Compiles a simulation from a text.
    pub fn program(&self, text: &str) -> Result<Arc<Program>, String> {
        let file = self.path("sim.ron");
        std::fs::write(&file, text).unwrap();
        let libraries = linkwork_assemblies::libraries().into_iter();
        let catalogue = Catalogue::new(libraries.chain([linkwork_fmi::catalogue()]));
        let loaded = load_file(&file, &Options::new(&catalogue)).map_err(|f| f.render(false))?;
        let program = loaded
            .compile(&catalogue, &Files::default())
            .map_err(|f| linkwork_assembly::Failure {
                faults: f.0,
                sources: loaded.sources.clone(),
            })
            .map_err(|f| f.render(false))?;
        Ok(Arc::new(program))
    }
}

pub fn seconds(x: f64) -> Seconds {
    Seconds::from_decimal(x).unwrap()
}

pub fn run(sim: &mut Simulation, until: f64) {
    sim.run_until(seconds(until)).unwrap();
}
