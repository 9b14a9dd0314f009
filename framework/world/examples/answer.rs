//! Answers questions about files and models of the world as JSON, for comparisons with other programs in `tests/differential`.
//!
//! Each line of the standard input is a JSON object with the field `ask`; each line of the output answers one of them. Units are SI; times of kernels
//! are TDB seconds past J2000; epochs are texts such as `2020-01-31 12:00:00 UTC`.
//!
//! ```text
//! gravity    format, file, points        mu, radius, degree, accelerations in body-fixed axes
//! kernel     file, target, centre, times [position, velocity] or an error for each time
//! earth      epoch, dut1, pole           rotation from GCRS to ITRS, row by row, TT and TDB as Julian dates
//! air        epoch, place, f107, f107_mean, ap     density, temperature, number densities
//! magnetic   epoch, place                field: north, east, down, T
//! elements   lines, minutes              [position, velocity] in TEME
//! ```
//! A place is geodetic latitude and longitude in degrees and altitude in metres over WGS 84.
#![allow(clippy::unwrap_used)]

use linkwork_world::WorldError;
use linkwork_world::atmosphere::{Magnetic, Msis, SpaceWeather};
use linkwork_world::ephemeris::Spk;
use linkwork_world::gravity::{Format, Harmonics, Keep, read};
use linkwork_world::magnetic::Igrf;
use linkwork_world::orbit::TwoLine;
use linkwork_world::planet::rotation::{EarthParameters, gcrs_to_itrs};
use linkwork_world::planet::{Ellipsoid, Epoch, Geodetic, PointMotion};
use linkwork_world::spatial::Vec3;
use serde_json::{Value, json};
use std::io::BufRead;

fn main() {
    let msis = Msis::new();
    for line in std::io::stdin().lock().lines() {
        let q: Value = serde_json::from_str(&line.unwrap()).unwrap();
        let answer = match q["ask"].as_str().unwrap() {
            "gravity" => gravity(&q),
            "kernel" => kernel(&q),
            "earth" => earth(&q),
            "air" => air(&msis, &q),
            "magnetic" => magnetic(&q),
            "elements" => elements(&q),
            other => panic!("there is no question `{other}`"),
        };
        println!("{}", answer.unwrap_or_else(|e| json!({ "error": e.to_string() })));
    }
}

fn number(v: &Value) -> f64 {
    v.as_f64().unwrap()
}

fn numbers(v: &Value) -> Vec<f64> {
    v.as_array().unwrap().iter().map(number).collect()
}

fn vector(v: &Value) -> Vec3 {
    Vec3::from_iterator(numbers(v))
}

fn motion(m: &PointMotion) -> Value {
    json!([m.position.as_slice(), m.velocity.as_slice()])
}

fn epoch(q: &Value) -> Result<Epoch, WorldError> {
    Epoch::parse(q["epoch"].as_str().unwrap())
}

fn place(q: &Value) -> Geodetic {
    let p = numbers(&q["place"]);
    Geodetic::from_degrees(p[0], p[1], p[2])
}

fn gravity(q: &Value) -> Result<Value, WorldError> {
    let format = match q["format"].as_str().unwrap() {
        "icgem" => Format::Icgem,
        "shadr" => Format::Shadr,
        "gmat" => Format::Gmat,
        other => panic!("there is no format `{other}`"),
    };
    let file = q["file"].as_str().unwrap();
    let field = read(format, file, &std::fs::read_to_string(file).unwrap(), Keep::All)?;
    let harmonics = Harmonics::new(&field);
    let points = q["points"].as_array().unwrap();
    let pulls: Vec<Vec<f64>> =
        points.iter().map(|p| harmonics.acceleration(&vector(p)).as_slice().to_vec()).collect();
    let (mu, radius, degree) = (field.mu, field.radius, field.degree());
    Ok(json!({ "mu": mu, "radius": radius, "degree": degree, "accelerations": pulls }))
}

fn kernel(q: &Value) -> Result<Value, WorldError> {
    let file = q["file"].as_str().unwrap();
    let spk = Spk::parse(file, &std::fs::read(file).unwrap())?;
    let body = |name: &str| i32::try_from(q[name].as_i64().unwrap()).unwrap();
    let states = numbers(&q["times"]).into_iter().map(|et| {
        match spk.between(body("target"), body("centre"), et) {
            Ok(m) => motion(&m),
            Err(e) => json!(e.to_string()),
        }
    });
    Ok(json!({ "states": states.collect::<Vec<Value>>() }))
}

fn earth(q: &Value) -> Result<Value, WorldError> {
    let at = epoch(q)?;
    let pole = numbers(&q["pole"]);
    let parameters = EarthParameters {
        dut1: number(&q["dut1"]),
        pole: [pole[0], pole[1]],
        ..EarthParameters::default()
    };
    let turn = gcrs_to_itrs(&at, &parameters).transpose();
    Ok(json!({ "rotation": turn.as_slice(), "tt": at.tt(), "tdb": at.tdb_days() }))
}

fn air(msis: &Msis, q: &Value) -> Result<Value, WorldError> {
    let magnetic = match numbers(&q["ap"])[..] {
        [daily] => Magnetic::Daily(daily),
        [a, b, c, d, e, f] => Magnetic::History([a, b, c, d, e, f]),
        _ => panic!("ap has one or six numbers"),
    };
    let (f107, f107_mean) = (number(&q["f107"]), number(&q["f107_mean"]));
    let air = msis.at(&epoch(q)?, &place(q), &SpaceWeather { f107, f107_mean, magnetic })?;
    let (density, temperature) = (air.density, air.temperature);
    Ok(json!({ "density": density, "temperature": temperature, "species": air.species }))
}

fn magnetic(q: &Value) -> Result<Value, WorldError> {
    let (at, field) = (place(q), Igrf::v14().at(&epoch(q)?)?);
    let b = at.east_north_up().inverse() * field.at(&Ellipsoid::wgs84().position(&at));
    Ok(json!({ "field": [b.y, b.x, -b.z] }))
}

fn elements(q: &Value) -> Result<Value, WorldError> {
    let lines: Vec<&str> =
        q["lines"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    let all = TwoLine::read("lines", &lines.join("\n"))?;
    let states = numbers(&q["minutes"]).into_iter().map(|minutes| {
        match all[0].state(&all[0].epoch.plus(60.0 * minutes)) {
            Ok(m) => motion(&m),
            Err(e) => json!(e.to_string()),
        }
    });
    Ok(json!({ "states": states.collect::<Vec<Value>>() }))
}
