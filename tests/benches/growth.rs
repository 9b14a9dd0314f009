//! Cost per unit as the work grows: rovers in one simulation, parts of a dataflow, nodes of a terrain. `x` is the cost per unit divided by that of the
//! first row, so a cost that grows faster than the work is more than 1.
//!
//! `tests/benches/scale`, or `cargo bench --profile release --workspace --bench growth [-- rovers|parts|terrain [numbers]]`
//!
//! Times are the least of several repetitions, because the machine is shared.
#![allow(missing_docs, clippy::disallowed_methods)]
#[path = "../common/mod.rs"]
mod common;

use linkwork_environment::height_field::HeightField;
use linkwork_runtime::Simulation;
use std::fmt::Write;
use std::hint::black_box;
use std::time::Instant;

/// Returns the least time of some repetitions, s.
fn least(repetitions: usize, mut run: impl FnMut() -> Result<(), String>) -> Result<f64, String> {
    let mut best = f64::INFINITY;
    for _ in 0..repetitions {
        let begin = Instant::now();
        run()?;
        best = best.min(begin.elapsed().as_secs_f64());
    }
    Ok(best)
}

fn steps(sim: &mut Simulation, count: usize) -> Result<(), String> {
    for _ in 0..count {
        sim.step().map_err(|e| e.to_string())?;
    }
    Ok(())
}

/// The costs per unit of the first row.
#[derive(Default)]
struct Growth(Option<[f64; 2]>);

impl Growth {
    /// Returns the ratios to the first row.
    fn ratios(&mut self, now: [f64; 2]) -> [f64; 2] {
        let first = self.0.get_or_insert(now);
        [now[0] / first[0], now[1] / first[1]]
    }
}

/// Rovers with six rigid wheels in a square grid on one slope; each pair of rovers may touch.
fn rovers(number: usize) -> String {
    let side = (number as f64).sqrt().ceil() as usize;
    let (mut parts, mut place) = (String::new(), String::new());
    for k in 0..number {
        let at = |k: usize| 6.0 * (k as f64 - 0.5 * (side - 1) as f64);
        let (x, y) = (at(k % side), at(k / side));
        let _ = write!(
            parts,
            r#""R{k}": (assembly: "rovers/rocker_bogie.ron", params: {{ "world": "worlds/outside.ron",
                "waypoints": [[{}, {y}]], "start": [{x}, {y}, 0] }}),"#,
            x + 3.0
        );
        let _ = write!(
            place,
            r#"(body: "R{k}.Hardware.Chassis/chassis", at: [{x}, {y}], wheels: ["R{k}.Hardware.Wheels.*/wheel"], radius: "0.25 m",
                joints: ["R{k}.Hardware.Chassis/rocker_*", "R{k}.Hardware.Chassis/bogie_*"]),"#
        );
    }
    format!(
        r#"Simulation(parts: {{ "Site": (assembly: "worlds/slope.ron"), {parts} }},
            contact: (compliant: (stiffness: 3e5, bristle_stiffness: 3e5, bristle_damping: 3e3)),
            step: "1 ms", integrator: "semi_implicit_euler", until: "60 s", place: [{place}])"#
    )
}

fn print_rovers(numbers: &[usize]) -> Result<(), String> {
    println!("rovers      loading s   s each     x  step µs   µs each     x");
    let mut growth = Growth::default();
    for number in numbers {
        let (text, n) = (rovers(*number), *number as f64);
        let mut sim = None;
        let loading = least(1, || {
            sim = Some(common::scene(&text, &[])?);
            Ok(())
        })?;
        let Some(mut sim) = sim else { continue };
        steps(&mut sim, 200)?;
        let chunk = (4000 / number).clamp(50, 500);
        let step = least(5, || steps(&mut sim, chunk))? / chunk as f64;
        let [a, b] = growth.ratios([loading / n, step / n]);
        println!(
            "{number:>6} {loading:>14.3} {:>8.4} {a:>5.2} {:>8.1} {:>9.2} {b:>5.2}",
            loading / n,
            1e6 * step,
            1e6 * step / n
        );
    }
    Ok(())
}

/// A constant, and a row of first-order lags behind it.
fn parts(number: usize) -> String {
    let (mut parts, mut wires) = (String::new(), String::from("\"S.y -> G0.u\","));
    for k in 0..number - 1 {
        let _ =
            write!(parts, "\"G{k}\": (model: \"basics.lag\", params: {{ \"time_constant\": 4 }}),");
        if k > 0 {
            let _ = write!(wires, "\"G{}.y -> G{k}.u\",", k - 1);
        }
    }
    format!(
        r#"Simulation(until: "1 s", parts: {{ {parts} "S": (model: "basics.constant", params: {{ "value": 1 }}) }}, wires: [{wires}])"#
    )
}

fn print_parts(numbers: &[usize]) -> Result<(), String> {
    println!("parts      loading ms  µs each     x  step µs   ns each     x");
    let mut growth = Growth::default();
    for number in numbers {
        let (text, n) = (parts(*number), *number as f64);
        let mut sim = None;
        let loading = least(if *number > 10_000 { 1 } else { 3 }, || {
            sim = Some(common::scene(&text, &[])?);
            Ok(())
        })?;
        let Some(mut sim) = sim else { continue };
        let chunk = (2_000_000 / number).clamp(10, 2000);
        let step = least(5, || steps(&mut sim, chunk))? / chunk as f64;
        let [a, b] = growth.ratios([loading / n, step / n]);
        println!(
            "{number:>6} {:>14.1} {:>8.2} {a:>5.2} {:>8.1} {:>9.2} {b:>5.2}",
            1e3 * loading,
            1e6 * loading / n,
            1e6 * step,
            1e9 * step / n
        );
    }
    Ok(())
}

/// Square height fields. Queries are along a line that crosses a node every 250 queries.
fn print_terrain(sides: &[usize]) -> Result<(), String> {
    const QUERIES: usize = 200_000;
    println!("terrain: nodes    build ms  ns a node     x  ns a query     x");
    let mut growth = Growth::default();
    for side in sides {
        let nodes = side * side;
        let heights: Vec<f32> = (0..nodes).map(|k| 0.3 * (1e-3 * k as f32).sin()).collect();
        let mut field = None;
        let build = least(3, || {
            let made = HeightField::new([0.0; 2], [0.05; 2], *side, *side, heights.clone());
            field = Some(made.map_err(|e| format!("{e:?}"))?);
            Ok(())
        })?;
        let Some(field) = field else { continue };
        let width = 0.05 * (side - 1) as f64;
        let query = least(5, || {
            let ground = |k: usize| {
                let x = (2e-4 * k as f64) % width;
                field.ground(x, 0.37 * width).map_or(0.0, |g| g.0)
            };
            black_box((0..QUERIES).map(ground).sum::<f64>());
            Ok(())
        })? / QUERIES as f64;
        let [a, b] = growth.ratios([build / nodes as f64, query]);
        println!(
            "{nodes:>14} {:>11.2} {:>10.2} {a:>5.2} {:>11.2} {b:>5.2}",
            1e3 * build,
            1e9 * build / nodes as f64,
            1e9 * query
        );
    }
    Ok(())
}

fn main() -> Result<(), String> {
    let given: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let numbers: Vec<usize> = given.iter().filter_map(|a| a.parse().ok()).collect();
    let named: Vec<&String> = given.iter().filter(|a| a.parse::<usize>().is_err()).collect();
    type Bench = fn(&[usize]) -> Result<(), String>;
    let all: [(&str, Bench, &[usize]); 3] = [
        ("rovers", print_rovers, &[1, 4, 16, 64]),
        ("parts", print_parts, &[1000, 10_000, 100_000]),
        ("terrain", print_terrain, &[251, 501, 1001, 2001, 4001]),
    ];
    if let Some(name) = named.iter().find(|n| !all.iter().any(|a| a.0 == n.as_str())) {
        return Err(format!("there is no bench `{name}`\n  help: rovers, parts, terrain"));
    }
    for (name, bench, usual) in all {
        if named.is_empty() || named.iter().any(|n| n.as_str() == name) {
            bench(if numbers.is_empty() { usual } else { &numbers })?;
        }
    }
    Ok(())
}
