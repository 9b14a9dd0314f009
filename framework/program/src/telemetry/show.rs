//! A table in the view of a simulation: alone, or together with a log.
use super::compare::{DifferenceStatistics, PrintedDifference};
use super::form::Telemetry;
use super::track::{Curve, Track, Tracks};
use crate::load::{self, Ready};
use crate::run::{self, Looked};
use linkwork_assembly::Failure;
use linkwork_dynamics::{Workspace, kinematics};
use linkwork_multibody::Multibody;
use linkwork_plant::PlanExt;
use linkwork_runtime::{Fault, Plan, Program, Seconds, Unit, remedy};
use linkwork_spatial::{Pose, Quat};
use linkwork_surroundings::{Site, site_of};
use linkwork_viz::{ExternalData, InUnit, Panel, Player, Scene, Shape, View, VizError};
use std::collections::BTreeMap;
use std::path::Path;

/// Tint of the flight data.
const TINT: [u8; 3] = [255, 60, 200];

/// Initial poses of the bodies of a simulation, and the flight body that carries each.
struct Start {
    /// X_WB by name.
    poses: BTreeMap<String, Pose>,
    /// The flight body of each body that one carries, and X_TB.
    carried: BTreeMap<String, (String, Pose)>,
}

/// Returns the nearest body inboard of a body, including itself, that the table contains.
fn carrier<'a>(m: &'a Multibody, name: &'a str, told: &[&str]) -> Option<&'a str> {
    let mut at = m.get(m.body(name)?);
    loop {
        if told.contains(&at.name()) {
            return Some(at.name());
        }
        at = m.get(at.parent()?);
    }
}

impl Start {
    fn of(plan: &Plan, told: &[&str]) -> Start {
        let mut start = Start { poses: BTreeMap::new(), carried: BTreeMap::new() };
        let Some(m) = plan.mechanism() else { return start };
        let mut ws = Workspace::new(&m.tree);
        kinematics(&m.tree, &mut ws, &m.q, &m.v);
        for id in m.multibody.body_ids() {
            let name = m.multibody.get(id).name();
            start.poses.insert(name.to_owned(), ws.body_pose(&m.tree, id));
        }
        for name in start.poses.keys() {
            let Some(by) = carrier(&m.multibody, name, told) else { continue };
            let pose = start.poses[by].inverse() * start.poses[name];
            start.carried.insert(name.clone(), (by.to_owned(), pose));
        }
        start
    }
}

fn site(plan: &Plan) -> Option<Site> {
    site_of(&plan.services)
}

/// Reads the table for a program, and looks up in the program what the file names.
fn read(telemetry: &Telemetry, program: &Program) -> Result<Tracks, Failure> {
    let plan = &*program.phases[0].plan;
    let tracks = Tracks::read(telemetry, site(plan))?;
    let mut faults = Vec::new();
    let mut known: Vec<&str> = (program.phases.iter())
        .filter_map(|p| p.plan.mechanism())
        .flat_map(|m| m.multibody.bodies().iter().map(|b| b.name()))
        .collect();
    known.sort_unstable();
    known.dedup();
    for body in telemetry.bodies.iter().filter(|b| !known.contains(&b.name.as_str())) {
        let message = format!("the simulation does not have a body `{}`", body.name);
        faults.push(Fault::new(body.origin, message).help(remedy(&body.name, "bodies", &known)));
    }
    for curve in &tracks.curves {
        let Some(name) = &curve.variable else { continue };
        match plan.variable(name) {
            Err(e) => faults.push(Fault::new(curve.origin, e.message).help(e.help)),
            Ok(variable) => {
                let unit = Unit::parse(&variable.unit).unwrap_or(Unit::ANY);
                if !unit.same_quantity(&curve.unit) {
                    let message = format!(
                        "curve `{}`: `{name}` is in {}, but its column is another quantity",
                        curve.title,
                        if variable.unit.is_empty() { "1" } else { &variable.unit }
                    );
                    let help = "write the unit of the column: [\"title\", \"unit\"]";
                    faults.push(Fault::new(curve.origin, message).help(help));
                }
            }
        }
    }
    if faults.is_empty() {
        Ok(tracks)
    } else {
        Err(Failure { faults, sources: telemetry.sources.clone() })
    }
}

fn in_unit(unit: &Unit) -> InUnit {
    InUnit { offset: unit.offset, factor: 1.0 / unit.scale }
}

/// Returns the unit of a difference, which does not have an offset.
fn difference(unit: &Unit) -> InUnit {
    InUnit { offset: 0.0, factor: 1.0 / unit.scale }
}

fn ns(t: f64) -> Option<u64> {
    let ns = (t * 1e9).round();
    (0.0..9.2e18).contains(&ns).then_some(ns as u64)
}

/// Prefix of the names of flight bodies and numbers.
pub const FLOWN: &str = "flown/";

/// Returns the entity and the prefix of the numbers of a flight body or curve.
fn flown(name: &str) -> String {
    format!("{FLOWN}{name}")
}

const METRE: InUnit = InUnit { offset: 0.0, factor: 1.0 };
const DEGREE: InUnit = InUnit { offset: 0.0, factor: 180.0 / std::f64::consts::PI };

/// Flight data together with a run.
pub struct Beside {
    tracks: Tracks,
    /// Additional bodies and panels of the view.
    pub told: ExternalData,
    /// For each body and each curve, whether the log has instants at rows of the table. Differences are then computed only at rows, because values
    /// between rows are interpolated.
    at_rows: [Vec<bool>; 2],
    /// Differences for each body (position and attitude) and each curve, at all instants and at rows.
    bodies: Vec<[DifferenceStatistics; 2]>,
    curves: Vec<[DifferenceStatistics; 2]>,
}

/// Adds flight data to the view of a log with poses at `instants` (ns). The scene gets their shapes.
///
/// # Errors
/// All mistakes of the telemetry.
pub fn beside(
    telemetry: &Telemetry,
    program: &Program,
    (scene, instants): (&mut Scene, &[u64]),
) -> Result<Beside, Failure> {
    let tracks = read(telemetry, program)?;
    let names: Vec<&str> = tracks.bodies.iter().map(|b| b.body.as_str()).collect();
    let start = Start::of(&program.phases[0].plan, &names);
    let mut told = ExternalData::default();
    for track in &tracks.bodies {
        let name = flown(&track.body);
        scene.shapes.extend(ghosts(scene, &start, &track.body));
        told.bodies.push(name.clone());
        let one = |label: &str, shown: InUnit| (label.to_owned(), format!("{name}.{label}"), shown);
        told.panels.push(Panel {
            title: format!("{}: flown minus simulated, m", track.body),
            series: ["x", "y", "z", "distance"].map(|label| one(label, METRE)).to_vec(),
        });
        if track.at(track.times()[0]).is_some_and(|s| s.rotation.is_some()) {
            told.panels.push(Panel {
                title: format!("{}: angle between flown and simulated, deg", track.body),
                series: vec![one("angle", DEGREE)],
            });
        }
    }
    for curve in &tracks.curves {
        told.panels.extend(panels(curve, true));
    }
    let (bodies, curves) = (
        vec![Default::default(); tracks.bodies.len()],
        vec![Default::default(); tracks.curves.len()],
    );
    let row_of_body = |b: &Track, t: f64| b.at(t).is_some_and(|s| s.row);
    let at_rows = [
        tracks.bodies.iter().map(|b| common(instants, |t| row_of_body(b, t))).collect(),
        tracks.curves.iter().map(|c| common(instants, |t| c.has_row(t))).collect(),
    ];
    Ok(Beside { tracks, told, at_rows, bodies, curves })
}

/// Returns whether at least two of the instants of a log (ns, increasing) are rows.
fn common(instants: &[u64], row: impl Fn(f64) -> bool) -> bool {
    instants.iter().filter(|ns| row(**ns as f64 / 1e9)).nth(1).is_some()
}

/// Returns the tinted shapes of a body and of the bodies that it carries, on the flight body.
fn ghosts(scene: &Scene, start: &Start, body: &str) -> Vec<Shape> {
    let own = |s: &Shape| {
        let pose = match start.carried.get(&s.body) {
            Some((by, pose)) if by == body => *pose,
            None if s.body == body => Pose::identity(),
            _ => return None,
        };
        let tinted = |k: usize| ((u16::from(s.color[k]) + u16::from(TINT[k])) / 2) as u8;
        let name = format!("{}/{}", s.body, s.name);
        let color = [tinted(0), tinted(1), tinted(2), s.color[3]];
        Some(Shape { body: flown(body), name, pose: pose * s.pose, color, ..s.clone() })
    };
    scene.shapes.iter().filter_map(own).collect()
}

/// Returns the panel of a curve; with a run also that of the simulation, and one of the difference.
fn panels(curve: &Curve, run: bool) -> Vec<Panel> {
    let name = flown(&curve.title);
    let shown = in_unit(&curve.unit);
    let mut series = vec![("flown".to_owned(), name.clone(), shown)];
    let Some(variable) = curve.variable.as_ref().filter(|_| run) else {
        return vec![Panel { title: curve.title.clone(), series }];
    };
    series.push(("simulated".to_owned(), variable.clone(), shown));
    let apart = (String::from("difference"), format!("{name}.difference"), difference(&curve.unit));
    vec![
        Panel { title: curve.title.clone(), series },
        Panel { title: format!("{}: flown minus simulated", curve.title), series: vec![apart] },
    ]
}

impl Beside {
    /// Adds flight poses at an instant of the log (ns), after those of the simulation, and the differences.
    ///
    /// # Errors
    /// The recording cannot be written.
    pub fn poses(
        &mut self,
        ns: u64,
        bodies: &[(String, Pose)],
        player: &mut Player,
    ) -> Result<(), VizError> {
        let t = ns as f64 / 1e9;
        let mut all = bodies.to_vec();
        let mut told: Vec<(String, f64)> = Vec::new();
        let at_rows = self.at_rows[0].iter();
        for ((track, apart), at_rows) in
            self.tracks.bodies.iter().zip(&mut self.bodies).zip(at_rows)
        {
            let Some(sample) = track.at(t) else { continue };
            let name = flown(&track.body);
            let simulated = bodies.iter().find(|(n, _)| *n == track.body).map(|(_, pose)| pose);
            let rotation = sample.rotation.or(simulated.map(|s| s.rotation));
            all.push((
                name.clone(),
                Pose::new(rotation.unwrap_or_else(Quat::identity), sample.position),
            ));
            let Some(simulated) = simulated.filter(|_| sample.row || !at_rows) else { continue };
            let d = sample.position - simulated.position;
            apart[0].take(t, d.norm(), sample.row);
            let numbers = [("x", d.x), ("y", d.y), ("z", d.z), ("distance", d.norm())];
            told.extend(numbers.map(|(label, x)| (format!("{name}.{label}"), x)));
            if let Some(rotation) = sample.rotation {
                // The angle is computed by the sine, because the cosine of a small angle loses precision.
                let angle =
                    2.0 * (simulated.rotation.inverse() * rotation).imag().norm().min(1.0).asin();
                apart[1].take(t, angle, sample.row);
                told.push((format!("{name}.angle"), angle));
            }
        }
        let curves = self.tracks.curves.iter();
        told.extend(curves.filter_map(|c| Some((flown(&c.title), c.at(t)?))));
        player.poses(ns, &all)?;
        told.iter().try_for_each(|(name, x)| player.value(ns, name, *x))
    }

    /// Adds a number of the log: a variable at an instant (ns), SI.
    ///
    /// # Errors
    /// The recording cannot be written.
    pub fn value(
        &mut self,
        ns: u64,
        variable: &str,
        x: f64,
        player: &mut Player,
    ) -> Result<(), VizError> {
        let t = ns as f64 / 1e9;
        let at_rows = self.at_rows[1].iter();
        for ((curve, apart), at_rows) in
            self.tracks.curves.iter().zip(&mut self.curves).zip(at_rows)
        {
            if curve.variable.as_deref() != Some(variable) {
                continue;
            }
            let Some(y) = curve.at(t) else { continue };
            let row = curve.has_row(t);
            apart[0].take(t, (y - x).abs(), row);
            if row {
                apart[1].take(t, (y - x).abs(), row);
            } else if *at_rows {
                continue;
            }
            player.value(ns, &format!("{}.difference", flown(&curve.title)), y - x)?;
        }
        Ok(())
    }

    /// Prints the differences, and what could not be compared.
    pub fn tell(&self) {
        for (track, [position, attitude]) in self.tracks.bodies.iter().zip(&self.bodies) {
            if position.count == 0 {
                let (first, last) = (track.times()[0], track.times()[track.times().len() - 1]);
                tell!(
                    "warning: body `{}`: the table extends from {first} to {last} s of the simulation, where the log has no \
                     pose of it\n  help: write the time of the table at which the simulation begins: time: (.., zero: ..)",
                    track.body
                );
                continue;
            }
            let (n, rows) = (position.count, position.rows);
            let how = if rows == n {
                "rows of the table"
            } else {
                "instants of the log, with the table interpolated"
            };
            say!("{}: {n} {how}", track.body);
            say!("    {}", PrintedDifference("position", "m", 1.0, position));
            if attitude.count > 0 {
                say!(
                    "    {}",
                    PrintedDifference("attitude", "deg", 1.0_f64.to_radians(), attitude)
                );
            }
        }
        for (curve, [all, rows]) in self.tracks.curves.iter().zip(&self.curves) {
            let Some(variable) = &curve.variable else { continue };
            let apart = if rows.count > 1 { rows } else { all };
            if apart.count == 0 {
                tell!(
                    "warning: curve `{}`: the log has no samples of `{variable}` at times of the table\n  help: add it to `log` \
                     of the simulation",
                    curve.title
                );
            } else {
                say!("{}", PrintedDifference(&curve.title, &curve.text, curve.unit.scale, apart));
            }
        }
    }
}

/// Returns the instants of a table, and what is drawn at each.
fn instants(tracks: &Tracks) -> Vec<u64> {
    let bodies = tracks.bodies.iter().flat_map(|b| b.times());
    let curves = tracks.curves.iter().flat_map(|c| c.times());
    let mut all: Vec<u64> = bodies.chain(curves).filter_map(|t| ns(*t)).collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// Draws a table alone, in the view of the simulation that its file defines. Returns the number of instants.
///
/// # Errors
/// An exit code; the error has been printed.
pub fn alone(telemetry: &Telemetry, out: &Path) -> Result<u64, u8> {
    let Some(simulation) = &telemetry.simulation else {
        let fault = Fault::new(telemetry.origin, "the telemetry does not define a simulation in whose view it is shown")
            .help("write simulation: \"sim.ron\", or give a log of the run with it: view run.mcap --flown FILE");
        let failure = Failure { faults: vec![fault], sources: telemetry.sources.clone() };
        return Err(crate::voice::report(&failure));
    };
    let ready: Ready = load::ready(simulation, &[], None)?;
    let Looked { scene: (scene, period), .. } = run::prepare(&ready)?;
    let tracks = read(telemetry, &ready.program).map_err(|f| crate::voice::report(&f))?;
    let all = instants(&tracks);
    if all.is_empty() {
        tell!(
            "error: all rows of `{}` are before the simulation begins\n  help: write the time of the table at which it \
             begins: time: (.., zero: ..)",
            telemetry.table.display()
        );
        return Err(crate::exit::INPUT);
    }
    let drawn = draw(&tracks, &all, &ready.program, (&scene, period), out);
    drawn.map_err(|e| {
        let _ = std::fs::remove_file(out);
        tell!("error: {e}\n  help: choose another file with --out, or free disk space");
        crate::exit::FAILED
    })?;
    Ok(all.len() as u64)
}

fn draw(
    tracks: &Tracks,
    all: &[u64],
    program: &Program,
    (scene, period): (&Scene, Seconds),
    out: &Path,
) -> Result<(), VizError> {
    let names: Vec<&str> = tracks.bodies.iter().map(|b| b.body.as_str()).collect();
    let start = Start::of(&program.phases[0].plan, &names);
    let told = ExternalData {
        panels: tracks.curves.iter().flat_map(|c| panels(c, false)).collect(),
        ..ExternalData::default()
    };
    let (view, _) = View::new(program, scene, period)?;
    let mut player = Player::open(view.with(&told), out)?;
    let mut last: BTreeMap<&str, Pose> = BTreeMap::new();
    for ns in all {
        let t = *ns as f64 / 1e9;
        for track in &tracks.bodies {
            if let Some(pose) = pose(track, t, &start) {
                last.insert(&track.body, pose);
            }
        }
        player.poses(*ns, &poses(&last, &start))?;
        for curve in &tracks.curves {
            let Some(y) = curve.at(t) else { continue };
            player.value(*ns, &flown(&curve.title), y)?;
            if let Some(variable) = &curve.variable {
                player.value(*ns, variable, y)?;
            }
        }
    }
    let missing = player.finish()?;
    if !missing.variables.is_empty() {
        tell!(
            "warning: {} curves, arrows, lines or jets of the view are not shown, because the table does not contain them: \
             {}\n  help: add their variables to `curves`, if the table has such columns",
            missing.variables.len(),
            missing.variables[..missing.variables.len().min(5)].join(", ")
        );
    }
    Ok(())
}

/// Returns the pose of a flight body; without attitudes, its attitude is that of the start.
fn pose(track: &Track, t: f64, start: &Start) -> Option<Pose> {
    let sample = track.at(t)?;
    let stood = || start.poses.get(&track.body).map_or_else(Quat::identity, |p| p.rotation);
    Some(Pose::new(sample.rotation.unwrap_or_else(stood), sample.position))
}

/// Returns the poses of all bodies: flight bodies, bodies that they carry in the relative pose of the start, and the others at their start.
fn poses(told: &BTreeMap<&str, Pose>, start: &Start) -> Vec<(String, Pose)> {
    let mut all = Vec::new();
    for (name, begin) in &start.poses {
        let carried = start.carried.get(name);
        let carried = carried.and_then(|(by, pose)| Some(*told.get(by.as_str())? * *pose));
        all.push((name.clone(), carried.unwrap_or(*begin)));
    }
    // Add the bodies of later phases.
    let later = told.iter().filter(|(name, _)| !start.poses.contains_key(**name));
    all.extend(later.map(|(name, pose)| ((*name).to_owned(), *pose)));
    all
}
