//! Simulates files that contain units, and prints values of variables as JSON, for the comparison with FMPy in `tests/differential`.
//!
//! Each line of the standard input is a JSON object `{"file": "..", "times": [..], "names": ["Part.output", ..]}`; the line of the output that
//! corresponds to it contains the values of these variables at each time. Files may use `script.number` and `script.truth`, which are signals
//! through rows (time, value).
#![allow(clippy::unwrap_used)]

use linkwork_assembly::{Failure, Options, load_file};
use linkwork_runtime::prelude::*;
use linkwork_runtime::{Catalogue, Files, Seconds, Simulation};
use serde_json::{Value, json};
use std::io::BufRead;
use std::sync::Arc;

/// Rows of a signal.
#[derive(Params, Clone, Debug)]
pub struct Script {
    /// Rows (time in s, value); the signal has the value of the last row that is not later.
    pub rows: Vec<[f64; 2]>,
    /// Whether the signal is straight between rows.
    #[param(default = false)]
    pub straight: bool,
}

/// The number of rows that are not later than now.
#[derive(State, Clone, Copy, Debug)]
pub struct Row {
    /// Their number.
    #[port]
    pub begun: f64,
}

/// The time of the next row.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Next {
    /// Time since then.
    #[port("s", rising)]
    pub since: f64,
}

/// A number.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Number {
    /// Output.
    #[port("*")]
    pub y: f64,
}

/// A truth value.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Truth {
    /// Output.
    #[port("1")]
    pub y: bool,
}

impl Script {
    /// Returns the row that holds. An event is located to within 1 ps, so a row may begin a little later than its event.
    fn begun(&self, t: f64) -> Row {
        Row { begun: self.rows.partition_point(|r| r[0] <= t + 1e-9) as f64 }
    }
    fn next(&self, t: f64, row: &Row) -> Next {
        Next { since: self.rows.get(row.begun as usize).map_or(-1.0, |r| t - r[0]) }
    }
    fn value(&self, t: f64, row: &Row) -> f64 {
        let k = (row.begun as usize).max(1) - 1;
        let here = self.rows[k];
        match self.rows.get(k + 1) {
            Some(next) if self.straight => {
                here[1] + (next[1] - here[1]) * (t - here[0]) / (next[0] - here[0])
            }
            _ => here[1],
        }
    }
}

/// A scripted number.
pub struct Numbers {
    p: Script,
}

/// A number through rows of time and value. Jumps and corners are events.
#[model("script.number")]
impl Model for Numbers {
    const MODES: bool = true;
    type Params = Script;
    type FeedthroughOutputs = Number;
    type DiscreteState = Row;
    type Guards = Next;
    fn feedthrough(&self, clock: &Clock, d: &Row) -> Number {
        Number { y: self.p.value(clock.t, d) }
    }
    fn mode(&self, clock: &Clock) -> Row {
        self.p.begun(clock.t)
    }
    fn guards(&self, clock: &Clock, d: &Row) -> Next {
        self.p.next(clock.t, d)
    }
    fn handle_event(&self, clock: &Clock) -> ((), Row) {
        ((), self.p.begun(clock.t))
    }
}

/// A scripted truth value.
pub struct Truths {
    p: Script,
}

/// A truth value through rows of time and 0 or 1. Jumps are events.
#[model("script.truth")]
impl Model for Truths {
    const MODES: bool = true;
    type Params = Script;
    type FeedthroughOutputs = Truth;
    type DiscreteState = Row;
    type Guards = Next;
    fn feedthrough(&self, clock: &Clock, d: &Row) -> Truth {
        Truth { y: self.p.value(clock.t, d) > 0.5 }
    }
    fn mode(&self, clock: &Clock) -> Row {
        self.p.begun(clock.t)
    }
    fn guards(&self, clock: &Clock, d: &Row) -> Next {
        self.p.next(clock.t, d)
    }
    fn handle_event(&self, clock: &Clock) -> ((), Row) {
        ((), self.p.begun(clock.t))
    }
}

fn simulation(file: &str, catalogue: &Catalogue) -> Result<Simulation, String> {
    let loaded = load_file(file, &Options::new(catalogue)).map_err(|f| f.render(false))?;
    let program = loaded
        .compile(catalogue, &Files::default())
        .map_err(|f| Failure { faults: f.0, sources: loaded.sources.clone() }.render(false))?;
    Ok(Simulation::of(Arc::new(program)))
}

fn answered(request: &Value, catalogue: &Catalogue) -> Result<Value, String> {
    let mut sim = simulation(request["file"].as_str().unwrap(), catalogue)?;
    let names: Vec<&str> =
        request["names"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    let mut samples = Vec::new();
    for time in request["times"].as_array().unwrap() {
        let time = Seconds::from_decimal(time.as_f64().unwrap()).unwrap();
        sim.run_until(time).map_err(|e| e.to_string())?;
        let values: Result<Vec<f64>, _> = names.iter().map(|n| sim.get(n)).collect();
        samples.push(values.map_err(|e| e.to_string())?);
    }
    Ok(json!({ "samples": samples }))
}

fn main() {
    let scripts = vec![Entry::model::<Numbers>(), Entry::model::<Truths>()];
    let catalogue = Catalogue::new([scripts, linkwork_fmi::catalogue()]);
    for line in std::io::stdin().lock().lines() {
        let request: Value = serde_json::from_str(&line.unwrap()).unwrap();
        let answer = answered(&request, &catalogue).unwrap_or_else(|e| json!({ "error": e }));
        println!("{answer}");
    }
}
