//! From the two JSON files of Rocky 8 (a multibody dictionary and an assembly tree of DARTS/Dshell) to assemblies.
//! ```text
//! frames      z of every body points down there, up here: x' = (x, −y, −z), J' = F J F, F = diag(1, −1, −1)
//! hinges      axes turned like that; coordinates keep their sign and zero
//! models      class by class (`models`); a class that is not in that table is an error
//! signals     become exports, element by element: Wheel_rate[2] is `Wheel_rate_2`
//! ```
//! Fields of bodies and of models' parameters without a counterpart are listed at the head of the file: all fields that were not read. Shapes are
//! made for the eye: wheels by radius and width, other bodies as rods from hinge to hinge, the chassis as the solid box of its mass and inertia.
mod bodies;
mod json;
mod models;

use json::{Json, Result};
use std::fmt::Write;

const HEAD: &str = "\
// Made by `cargo run -p linkwork-rocky8 -- FOLDER`: change the converter, not this file.
// Source: rocky8_mbody.json and rocky8_assembly.json, from public test data of nasa-jpl/dtest (Apache-2.0).
";

/// The files of `sims/rocky8` that follow from the JSON files: name and text.
///
/// # Errors
/// The first thing that is missing, contradictory or unknown, with its place in the JSON.
pub fn convert(mbody: &str, assembly: &str) -> std::result::Result<Vec<(String, String)>, String> {
    let (mbody, assembly) =
        (Json::read("rocky8_mbody.json", mbody)?, Json::read("rocky8_assembly.json", assembly)?);
    let bodies = bodies::read(&mbody.at("R8Mbody")?.at("BODIES")?)?;
    let rover = assembly.at("ASSEMBLY")?.at("R8")?;
    let copy = bodies::read(&rover.at("MBODYS")?.at("R8Mbody")?.at("BODIES")?)?;
    if copy != bodies {
        return Err("the bodies of the two files differ".into());
    }
    let hardware = rover.at("ASSEMBLY")?.at("R8Hdw")?;
    let mut out = models::Out::new(&bodies)?;
    out.tree(&hardware, 1)?;
    let mut left = bodies::left(&mbody.at("R8Mbody")?.at("BODIES")?)?;
    left.extend(out.left.clone());
    left.sort();
    left.dedup();
    Ok(vec![
        ("rocky8.ron".into(), main_file(&bodies, &out, &left)?),
        ("differential_coupling.ron".into(), coupling()),
        ("differential_spring.ron".into(), spring(&out)?),
    ])
}

fn main_file(bodies: &[bodies::Body], out: &models::Out<'_>, left: &[String]) -> Result<String> {
    let mut t = String::from(HEAD);
    t += "// Not used:\n";
    for line in left {
        let _ = writeln!(t, "//   {line}");
    }
    t += "Assembly(\n";
    t += "    doc: \"Rocky 8, a rover of JPL: rockers, bogies, six steered and driven wheels. x forward, y left, z up.\",\n";
    t += "    params: {\n";
    t += "        \"steering\": (default: \"straight.csv\", doc: \"File of the steering angles over time, positive clockwise seen from above; it has a column for each steering hinge.\"),\n";
    t += "        \"differential\": (default: \"coupling\", doc: \"Connection of the rockers: coupling (exact) or spring (the makers' penalty).\"),\n";
    t += "        \"friction\": (default: 0.6, range: (0, 10), doc: \"Coulomb coefficient of wheels and ground; the friction limit of the original model follows from a soil that the files do not contain.\"),\n";
    t += "        \"encoder_ticks\": (default: 4096, range: (1, 1e9), doc: \"Ticks of an encoder per turn of its motor; the number is not in the files.\"),\n";
    t += "        \"encoder_rate\": (default: \"100 Hz\", doc: \"Sample rate of the encoders; it is not in the files.\"),\n";
    t += "    },\n";
    t += "    parts: {\n        \"R8Mbody\": (\n            bodies: {\n";
    for body in bodies {
        t += &body.ron(bodies, out.wheel(&body.name));
    }
    t += "            },\n        ),\n";
    t += &out.parts;
    t += "    },\n    exports: {\n";
    for (name, port) in &out.exports {
        let _ = writeln!(t, "        {name:?}: {port:?},");
    }
    t += "    },\n)\n";
    Ok(t)
}

fn coupling() -> String {
    format!(
        "{HEAD}Assembly(
    doc: \"The differential as a coupling: the rockers turn by equal and opposite angles, exactly.\",
    mounts: {{ \"left\": \"the left rocker\", \"right\": \"the right rocker\" }},
    couplings: {{ \"differential\": (terms: {{ \"left\": 1, \"right\": 1 }}, solve: Embed) }},
)
"
    )
}

fn spring(out: &models::Out<'_>) -> Result<String> {
    let (k, c) = out.differential.ok_or("there is no DiffConstraint")?;
    Ok(format!(
        "{HEAD}Assembly(
    doc: \"The differential as its makers have it: a spring and a damper on the sum of the rockers' angles.\",
    mounts: {{ \"left\": \"the left rocker\", \"right\": \"the right rocker\" }},
    parts: {{
        \"Spring\": (
            model: \"actuators.differential\",
            params: {{ \"stiffness\": {k:?}, \"damping\": {c:?} }},
            bind: {{ \"left\": \"hinge:left\", \"right\": \"hinge:right\" }},
        ),
    }},
)
"
    ))
}
