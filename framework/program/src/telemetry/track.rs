//! The track of a body, and the values of a curve: rows of a table in W, and interpolation between them.
use super::form::{BodyForm, Column, CurveForm, Position, Telemetry, Turn};
use super::frames::Frames;
use linkwork_assembly::Failure;
use linkwork_record::Table;
use linkwork_runtime::{Fault, Origin};
use linkwork_spatial::nalgebra::Quaternion;
use linkwork_spatial::{Quat, Vec3};
use linkwork_surroundings::Site;

/// Rows closer in time than this are at the same instant (s), because times in logs are rounded to nanoseconds.
const INSTANT: f64 = 1.5e-9;

/// Largest deviation of the length of a quaternion in a table from 1.
const LENGTH: f64 = 1e-3;

/// Times of rows, strictly increasing, since the beginning of the simulation (s).
#[derive(Clone, Debug, Default)]
struct Times(Vec<f64>);

/// Position of a time among rows.
enum Among {
    Outside,
    /// On a row.
    On(usize),
    /// After this row and before the next.
    After(usize),
}

impl Times {
    fn find(&self, t: f64) -> Among {
        let next = self.0.partition_point(|row| *row < t - INSTANT);
        match self.0.get(next) {
            Some(row) if (row - t).abs() <= INSTANT => Among::On(next),
            Some(_) if next > 0 => Among::After(next - 1),
            _ => Among::Outside,
        }
    }

    /// Returns the weights of up to four rows around `t`, which is after row `k`, for polynomial interpolation.
    fn weights(&self, k: usize, t: f64) -> (usize, Vec<f64>) {
        let first = k.saturating_sub(1).min(self.0.len().saturating_sub(4));
        let rows = &self.0[first..(first + 4).min(self.0.len())];
        let one = |i: usize| {
            let others = (0..rows.len()).filter(|j| *j != i);
            others.map(|j| (t - rows[j]) / (rows[i] - rows[j])).product()
        };
        (first, (0..rows.len()).map(one).collect())
    }
}

/// A body in the table.
#[derive(Clone, Debug)]
pub struct Track {
    /// Name of the body in the simulation.
    pub body: String,
    times: Times,
    positions: Vec<Vec3>,
    /// R_WB; empty if the table does not contain attitudes.
    rotations: Vec<Quat>,
}

/// A position and an attitude in W.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    pub position: Vec3,
    pub rotation: Option<Quat>,
    /// It is a row of the table, not an interpolated value.
    pub row: bool,
}

impl Track {
    /// Returns the times of its rows (s).
    pub fn times(&self) -> &[f64] {
        &self.times.0
    }

    /// Returns the pose of the body at a time (s): a row unchanged; between rows cubic interpolation of the position through the four nearest rows,
    /// and the shortest rotation between two rows; `None` before the first and after the last row.
    pub fn at(&self, t: f64) -> Option<Sample> {
        match self.times.find(t) {
            Among::Outside => None,
            Among::On(k) => {
                let rotation = self.rotations.get(k).copied();
                Some(Sample { position: self.positions[k], rotation, row: true })
            }
            Among::After(k) => {
                let (first, weights) = self.times.weights(k, t);
                let rows = &self.positions[first..];
                let position = weights.iter().zip(rows).map(|(w, p)| p * *w).sum();
                let share = (t - self.times.0[k]) / (self.times.0[k + 1] - self.times.0[k]);
                let between = |k: usize| {
                    let (a, b) = (self.rotations.get(k)?, self.rotations.get(k + 1)?);
                    Some(a * Quat::from_scaled_axis((a.inverse() * b).scaled_axis() * share))
                };
                Some(Sample { position, rotation: between(k), row: false })
            }
        }
    }
}

/// A curve in the table.
#[derive(Clone, Debug)]
pub struct Curve {
    pub title: String,
    pub variable: Option<String>,
    pub unit: linkwork_runtime::Unit,
    /// The unit as in the file.
    pub text: String,
    pub origin: Origin,
    times: Times,
    values: Vec<f64>,
}

impl Curve {
    /// Returns the times of its rows (s).
    pub fn times(&self) -> &[f64] {
        &self.times.0
    }

    /// Returns whether the table has a row with this value at a time (s).
    pub fn has_row(&self, t: f64) -> bool {
        matches!(self.times.find(t), Among::On(_))
    }

    /// Returns the value at a time (s), SI: a row unchanged, linear interpolation between two rows.
    pub fn at(&self, t: f64) -> Option<f64> {
        match self.times.find(t) {
            Among::Outside => None,
            Among::On(k) => Some(self.values[k]),
            Among::After(k) => {
                let share = (t - self.times.0[k]) / (self.times.0[k + 1] - self.times.0[k]);
                Some(self.values[k] + share * (self.values[k + 1] - self.values[k]))
            }
        }
    }
}

/// All tracks and curves of a table.
#[derive(Clone, Debug)]
pub struct Tracks {
    pub bodies: Vec<Track>,
    pub curves: Vec<Curve>,
}

/// Reads columns in SI.
struct Reader<'a> {
    table: Table,
    faults: Vec<Fault>,
    times: Vec<f64>,
    frames: &'a Frames,
}

impl Tracks {
    /// Reads the table of a telemetry file, for a simulation whose W is at `site`.
    ///
    /// # Errors
    /// All mistakes: the table cannot be read, lacks columns of the file, or its times are not increasing.
    pub fn read(telemetry: &Telemetry, site: Option<Site>) -> Result<Tracks, Failure> {
        let fail = |faults| Failure { faults, sources: telemetry.sources.clone() };
        let frames = Frames::new(telemetry, site).map_err(fail)?;
        let table = Table::read(&telemetry.table);
        let table = table.map_err(|e| fail(vec![Fault::of(telemetry.time.origin, &e)]))?;
        let mut r = Reader { table, faults: Vec::new(), times: Vec::new(), frames: &frames };
        if let Some(times) = r.column(&telemetry.time) {
            r.times = times.iter().map(|t| t - telemetry.zero).collect();
            r.check_times(&telemetry.time);
        }
        let bodies = telemetry.bodies.iter().filter_map(|b| r.body(b)).collect();
        let curves = telemetry.curves.iter().filter_map(|c| r.curve(c)).collect();
        if r.faults.is_empty() { Ok(Tracks { bodies, curves }) } else { Err(fail(r.faults)) }
    }
}

impl Reader<'_> {
    fn fault(&mut self, origin: Origin, message: String, help: &str) {
        self.faults.push(Fault::new(origin, message).help(help));
    }

    fn column(&mut self, of: &Column) -> Option<Vec<f64>> {
        match self.table.numbers(&of.title) {
            Ok(numbers) => Some(numbers.iter().map(|x| of.unit.to_si(*x)).collect()),
            Err(e) => {
                self.faults.push(Fault::of(of.origin, &e));
                None
            }
        }
    }

    fn columns<const N: usize>(&mut self, of: &[Column; N]) -> Option<[Vec<f64>; N]> {
        let all: Vec<Option<Vec<f64>>> = of.iter().map(|c| self.column(c)).collect();
        let all: Option<Vec<Vec<f64>>> = all.into_iter().collect();
        all.and_then(|c| c.try_into().ok())
    }

    fn check_times(&mut self, of: &Column) {
        // The first line contains the titles.
        let fact = if self.times.is_empty() {
            Some("does not have rows".to_owned())
        } else if let Some(k) = self.times.iter().position(|t| !t.is_finite()) {
            Some(format!("lacks a number in row {}", k + 1))
        } else {
            let back = self.times.windows(2).position(|t| t[1] <= t[0] + INSTANT);
            back.map(|k| format!("does not increase from row {} to row {}", k + 1, k + 2))
        };
        if let Some(fact) = fact {
            let message = format!("the time of the table, its column `{}`, {fact}", of.title);
            self.fault(of.origin, message, "give every row a unique time, in increasing order");
        }
    }

    fn body(&mut self, of: &BodyForm) -> Option<Track> {
        let (Position::Cartesian(_, columns) | Position::Geodetic(columns)) = &of.position;
        let position = self.columns(columns);
        let turn: Option<Vec<Vec<f64>>> = match of.attitude.as_ref().map(|a| &a.turn) {
            None => Some(Vec::new()),
            Some(Turn::Quaternion(c)) => self.columns(c).map(Vec::from),
            Some(Turn::Angles(c)) => self.columns(c).map(Vec::from),
        };
        let (position, turn) = (position?, turn?);
        if !self.faults.is_empty() {
            return None;
        }
        let mut track = Track {
            body: of.name.clone(),
            times: Times::default(),
            positions: Vec::new(),
            rotations: Vec::new(),
        };
        for k in 0..self.times.len() {
            let row = [position[0][k], position[1][k], position[2][k]];
            let angles: Vec<f64> = turn.iter().map(|column| column[k]).collect();
            if row.iter().chain(&angles).any(|x| x.is_nan()) {
                continue;
            }
            let t = self.times[k];
            let mut p = self.frames.position(&of.position, t, row);
            if let Some(attitude) = &of.attitude {
                let rotation =
                    rotation(&angles).and_then(|r| self.frames.attitude(of, attitude, (t, &p, r)));
                match rotation {
                    Ok(rotation) => {
                        p -= rotation * of.point;
                        track.rotations.push(rotation);
                    }
                    Err(e) => {
                        let message = format!("body `{}`: row {}: {e}", of.name, k + 1);
                        self.fault(
                            of.origin,
                            message,
                            "correct that row, or leave its cells empty",
                        );
                        return None;
                    }
                }
            }
            track.times.0.push(t);
            track.positions.push(p);
        }
        if track.times.0.is_empty() {
            let message = format!("body `{}`: no row of the table has all of its columns", of.name);
            self.fault(of.origin, message, "use columns with data");
            return None;
        }
        Some(track)
    }

    fn curve(&mut self, of: &CurveForm) -> Option<Curve> {
        let values = self.column(&of.column)?;
        if !self.faults.is_empty() {
            return None;
        }
        let rows = self.times.iter().zip(&values).filter(|(_, y)| !y.is_nan());
        let (times, values): (Vec<f64>, Vec<f64>) = rows.unzip();
        Some(Curve {
            title: of.title.clone(),
            variable: of.variable.clone(),
            unit: of.column.unit,
            text: of.column.text.clone(),
            origin: of.origin,
            times: Times(times),
            values,
        })
    }
}

/// Returns R_AT of a row: yaw, pitch, roll or w, x, y, z.
fn rotation(row: &[f64]) -> Result<Quat, String> {
    match *row {
        [yaw, pitch, roll] => Ok(Quat::from_euler_angles(roll, pitch, yaw)),
        [w, x, y, z] => {
            let q = Quaternion::new(w, x, y, z);
            if (q.norm() - 1.0).abs() > LENGTH {
                return Err(format!("its quaternion has the length {}, not 1", q.norm()));
            }
            Ok(Quat::new_normalize(q))
        }
        _ => Ok(Quat::identity()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(times: Vec<f64>, of: impl Fn(f64) -> (Vec3, Quat)) -> Track {
        let (positions, rotations) = times.iter().map(|t| of(*t)).unzip();
        Track { body: "b".into(), times: Times(times), positions, rotations }
    }

    #[test]
    fn between_rows_it_is_a_cubic_and_a_steady_turn() {
        let cubic = |t: f64| {
            let p = Vec3::new(1.0 + 2.0 * t - t * t * t, t * t, -3.0 * t + 0.5 * t.powi(3));
            (p, Quat::from_scaled_axis(Vec3::new(0.1, -0.4, 0.3) * t))
        };
        let track = track(vec![0.0, 0.4, 1.0, 1.3, 2.0, 2.9], cubic);
        for k in 0..=29 {
            let t = 0.1 * f64::from(k);
            let at = track.at(t).unwrap();
            let (p, r) = cubic(t);
            assert!((at.position - p).norm() < 1e-13, "{t}: {}", at.position - p);
            assert!(at.rotation.unwrap().angle_to(&r) < 1e-7, "{t}");
            assert_eq!(at.row, track.times().contains(&t) || [4, 10, 13, 20, 29].contains(&k));
        }
        assert!(track.at(-0.01).is_none() && track.at(2.91).is_none());
        assert!(track.at(f64::NAN).is_none());
    }

    #[test]
    fn few_rows_and_one_are_tracks_too() {
        let line = |t: f64| (Vec3::new(t, 2.0 * t, 0.0), Quat::identity());
        let two = track(vec![1.0, 3.0], line);
        assert!((two.at(1.5).unwrap().position - line(1.5).0).norm() < 1e-15);
        let one = track(vec![1.0], line);
        assert!(one.at(1.0).unwrap().row && one.at(1.1).is_none() && one.at(0.9).is_none());
    }
}
