//! Two-line elements of Earth satellites, propagated with SGP4. The only module that depends on `sgp4`.

use crate::error::{WorldError, plain};
use crate::planet::{Epoch, PointMotion};
use linkwork_spatial::Vec3;
use sgp4::{Constants, Elements, MinutesSinceEpoch, Orbit, WGS72, iau_epoch_to_sidereal_time};

/// Elements with the mean motion of SGP4; they are not valid for any other theory.
pub struct TwoLine {
    /// Name from the line before the elements, if there is one.
    pub name: Option<String>,
    /// Number in the catalogue.
    pub number: u64,
    /// Epoch of the elements.
    pub epoch: Epoch,
    constants: Constants,
}

/// Radius of the Earth of WGS 72, km. Below it, a satellite has decayed: SGP4 computes a path through the Earth without an error.
const RADIUS: f64 = 6378.135;

/// Maximum number of days from their epoch within which elements are used. After a month, the error for a low satellite is hundreds of kilometres.
const LIMIT: f64 = 30.0;

const HELP: &str = "give the two lines of 69 characters that begin with 1 and 2, and before them the name or nothing";

const DAY: &str = "correct the day of the year in columns 21 to 32, from 1 to 365, or 366 in a leap year, or use other elements";

/// Returns what is wrong with the day of the epoch of a first line: the day 366 of a common year would be read as the first day of the next year.
/// `None` for a day of its year, and if the columns contain no number, which is another mistake.
fn no_such_day(line: &str) -> Option<String> {
    let number = |from: usize, to: usize| line.get(from..to)?.trim().parse::<f64>().ok();
    let (short, day) = (number(18, 20)?, number(20, 32)?);
    let year = if short < 57.0 { 2000.0 + short } else { 1900.0 + short };
    // No year between 1957 and 2056 is divisible by 4 and not a leap year.
    let days = if year % 4.0 == 0.0 { 366.0 } else { 365.0 };
    let fact = || format!("the epoch is day {day} of the year {year}, which has {days} days");
    (!(1.0..days + 1.0).contains(&day)).then(fact)
}

impl TwoLine {
    /// Reads all elements of a text: two lines each, or three with a name. `file` is its name in messages.
    ///
    /// # Errors
    /// An invalid line, a wrong checksum, or elements that do not give an orbit; the error names the line.
    pub fn read(file: &str, text: &str) -> Result<Vec<TwoLine>, WorldError> {
        let (mut all, mut name, mut first) = (Vec::new(), None, None);
        let at = |line: usize, fact: String, help: &'static str| WorldError::Line {
            file: file.to_string(),
            line,
            fact,
            help,
        };
        for (k, line) in plain(text).lines().enumerate() {
            let line = line.trim_end();
            let wrong = |fact: String| at(k + 1, fact, HELP);
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            match (first, line.as_bytes()) {
                (None, [b'1', b' ', ..]) => {
                    if let Some(fact) = no_such_day(line) {
                        return Err(at(k + 1, fact, DAY));
                    }
                    first = Some(line);
                }
                (None, _) if name.is_none() => {
                    // Three-line files may start the name with `0 `.
                    name = Some(line.strip_prefix("0 ").unwrap_or(line).trim().to_string());
                }
                (None, _) => return Err(wrong("a first line of elements was expected".into())),
                (Some(one), _) => {
                    all.push(Self::of(name.take(), one, line).map_err(wrong)?);
                    first = None;
                }
            }
        }
        let ends = match (all.is_empty(), first.is_some() || name.is_some()) {
            (_, true) => "the text ends within a set of elements",
            (true, false) => "there are no elements",
            (false, false) => return Ok(all),
        };
        let (file, fact) = (file.to_string(), ends.to_string());
        Err(WorldError::Line { file, line: text.lines().count(), fact, help: HELP })
    }

    fn of(name: Option<String>, one: &str, two: &str) -> Result<TwoLine, String> {
        let e =
            Elements::from_tle(name, one.as_bytes(), two.as_bytes()).map_err(|e| e.to_string())?;
        let epoch = Epoch::parse(&format!("{} UTC", e.datetime)).map_err(|e| e.to_string())?;
        let [i, node, pericentre, mean] =
            [e.inclination, e.right_ascension, e.argument_of_perigee, e.mean_anomaly]
                .map(f64::to_radians);
        // Convert revolutions per day to rad/min.
        let motion = e.mean_motion * (std::f64::consts::PI / 720.0);
        // Two-line elements are fitted with the constants of WGS 72.
        let orbit =
            Orbit::from_kozai_elements(&WGS72, i, node, e.eccentricity, pericentre, mean, motion)
                .map_err(|e| e.to_string())?;
        let constants =
            Constants::new(WGS72, iau_epoch_to_sidereal_time, e.epoch(), e.drag_term, orbit)
                .map_err(|e| e.to_string())?;
        Ok(TwoLine { name: e.object_name, number: e.norad_id, epoch, constants })
    }

    /// Returns position (m) and velocity (m/s) at a time, true equator and mean equinox of date (TEME).
    ///
    /// # Errors
    /// The time is more than 30 days from the epoch of the elements, or the satellite has decayed.
    pub fn state(&self, at: &Epoch) -> Result<PointMotion, WorldError> {
        let after = at.since(&self.epoch);
        if after.abs() > LIMIT * 86_400.0 {
            let fact = format!(
                "the epoch of the elements of {} is {}, {:.1} days away",
                self.called(),
                self.epoch,
                after.abs() / 86_400.0
            );
            let help = "use elements whose epoch is within 30 days of the epoch of the world: errors of SGP4 grow by kilometres a day";
            return Err(WorldError::Uncovered { fact, help });
        }
        let state = self.constants.propagate(MinutesSinceEpoch(after / 60.0)).map_err(|e| {
            let fact = format!("SGP4 cannot compute the position of {}: {e}", self.called());
            WorldError::Uncovered { fact, help: "use elements closer to the epoch of the world" }
        })?;
        if Vec3::from(state.position).norm() < RADIUS {
            let fact = format!("{} is inside the Earth at {at}", self.called());
            let help = "the elements are wrong, or the satellite has decayed: use elements closer to the epoch of the world";
            return Err(WorldError::Uncovered { fact, help });
        }
        Ok(PointMotion {
            position: Vec3::from(state.position) * 1e3,
            velocity: Vec3::from(state.velocity) * 1e3,
        })
    }

    /// Returns its name, or its number if it does not have one.
    #[must_use]
    pub fn called(&self) -> String {
        self.name.clone().unwrap_or_else(|| format!("satellite {}", self.number))
    }
}
