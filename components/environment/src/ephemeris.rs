//! Positions of the Sun, the Moon and the planets relative to the centre of a simulation, from built-in series or from the SPK kernel that `kernel`
//! of the world names.
//! ```text
//! s(t) = r_body − r_centre at TDB(epoch) + t, ICRF, geometric          within `span` by a table, beyond it by the source itself
//! ```
//! Outside the time span of the source the position is NaN, and `failure` of the service returns an error that stops the run.

use crate::world::{WorldParams, fault};
use linkwork_surroundings::prelude::*;
use linkwork_world::WorldError;
use linkwork_world::ephemeris::{Analytic, Body, Ephemeris, Sampled, Spk, date};
use linkwork_world::planet::{Epoch, PointMotion};
use std::sync::Arc;

/// Margin by which both ends of a source's span are moved inwards, s. It exceeds the round-off of a date in seconds past J2000.
const ROUNDING: f64 = 1e-6;

/// Ephemeris that positions are read from.
enum Source {
    /// Built-in series and Keplerian elements.
    Analytic(Analytic),
    /// SPK kernel, and the name of its file for messages.
    Kernel(Spk, String),
}

impl Source {
    fn name(&self) -> String {
        match self {
            Source::Analytic(_) => "the built-in ephemeris".to_string(),
            Source::Kernel(_, file) => format!("the kernel `{file}`"),
        }
    }
}

impl Ephemeris for Source {
    fn state(
        &self,
        target: Body,
        origin: Body,
        tdb: (f64, f64),
    ) -> Result<PointMotion, WorldError> {
        match self {
            Source::Analytic(source) => source.state(target, origin, tdb),
            Source::Kernel(source, _) => source.state(target, origin, tdb),
        }
    }
    fn span(&self, target: Body, origin: Body, tdb: (f64, f64)) -> Result<[f64; 2], WorldError> {
        match self {
            Source::Analytic(source) => source.span(target, origin, tdb),
            Source::Kernel(source, _) => Ephemeris::span(source, target, origin, tdb),
        }
    }
}

/// Ephemeris of the bodies around the centre of a simulation.
#[derive(Clone)]
pub(crate) struct Heavens {
    source: Arc<Source>,
    /// Centre that positions are relative to; `None` for a body that is not in any ephemeris.
    centre: Option<Body>,
    epoch: Epoch,
    /// Length of the interpolation tables, s.
    span: f64,
}

impl Heavens {
    /// Creates the ephemeris around the body of a world.
    ///
    /// # Errors
    /// The world has no epoch, or its kernel cannot be read.
    pub fn around(world: &WorldParams, files: &Files) -> Result<Heavens, BuildError> {
        let epoch = world.epoch("an ephemeris")?;
        let source = match &world.kernel {
            None => Source::Analytic(Analytic),
            Some(file) => {
                let path = files.resolve(file).map_err(|e| e.at("kernel"))?;
                let bytes = std::fs::read(&path).map_err(|e| {
                    let help = "`kernel` must be an SPK file (.bsp), such as de440.bsp of NAIF";
                    BuildError::new(format!("`{file}` cannot be read: {e}")).help(help).at("kernel")
                })?;
                let spk = Spk::parse(file, &bytes).map_err(|e| fault(&e, "kernel"))?;
                Source::Kernel(spk, file.clone())
            }
        };
        let (centre, span) = (world.body.body(), world.span);
        Ok(Heavens { source: Arc::new(source), centre, epoch, span })
    }

    /// Returns a copy with positions relative to another centre.
    pub fn from(&self, centre: Body) -> Heavens {
        Heavens { centre: Some(centre), ..self.clone() }
    }

    /// The date of t = 0.
    pub fn epoch(&self) -> Epoch {
        self.epoch
    }

    /// Returns the trajectory of one body; `param` is the parameter that error messages name.
    pub fn course(&self, body: Body, param: &str) -> Result<Course, BuildError> {
        let Some(origin) = self.centre else {
            let fact = "the position of the body of `world` relative to the Sun and the planets is not known";
            let help = "write `orbit`, the elements of its orbit about the Sun, in `environment.polyhedral_gravity`; or choose `body: earth`, `mars` or `moon`";
            return Err(BuildError::new(fact).help(help).at(param));
        };
        let source = self.source.clone();
        let start = self.epoch.tdb_days();
        let named = |e: &WorldError| {
            let mut e = fault(e, param);
            e.message = format!("{} at the epoch {}: {}", source.name(), self.epoch, e.message);
            e
        };
        let ends = source.span(body, origin, start).map_err(|e| named(&e))?;
        let begin = start.0 * 86_400.0 + start.1 * 86_400.0;
        let [first, last] = [ends[0] - begin + ROUNDING, ends[1] - begin - ROUNDING];
        let length = self.span.min(last).max(ROUNDING);
        let table = Sampled::new(&*source, body, origin, &self.epoch, length);
        let table = table.map_err(|e| named(&e))?;
        let epoch = self.epoch;
        Ok(Course { source, body, origin, epoch, start, table, range: [first, last], ends })
    }
}

/// Trajectory of one body relative to the centre: an interpolation table, and the source itself for times outside the table.
pub(crate) struct Course {
    source: Arc<Source>,
    body: Body,
    origin: Body,
    /// The date of t = 0.
    epoch: Epoch,
    /// Date of t = 0 as TDB days past J2000, in two parts.
    start: (f64, f64),
    table: Sampled,
    /// First and last t that the source covers, s.
    range: [f64; 2],
    /// First and last date that the source covers, TDB seconds past J2000.
    ends: [f64; 2],
}

impl Course {
    /// Returns the vector from the centre to the body at t (s), m, ICRF; NaN outside the span of the source.
    pub fn at(&self, t: f64) -> Vec3 {
        if self.is_beyond(t) {
            return Vec3::repeat(f64::NAN);
        }
        let t = t.clamp(self.range[0], self.range[1]);
        let beyond = |_| {
            let now = (self.start.0, self.start.1 + t / 86_400.0);
            self.source.state(self.body, self.origin, now)
        };
        self.table.at(t).or_else(beyond).map_or(Vec3::repeat(f64::NAN), |s| s.position)
    }

    fn is_beyond(&self, t: f64) -> bool {
        let [first, last] = self.range;
        !(first - 2.0 * ROUNDING..=last + 2.0 * ROUNDING).contains(&t)
    }

    /// Returns an error if the source does not cover t (s).
    pub fn failure(&self, t: f64) -> Option<BuildError> {
        self.is_beyond(t).then(|| self.told(t))
    }

    #[cold]
    fn told(&self, t: f64) -> BuildError {
        let [first, last] = self.ends.map(date);
        let fact = format!(
            "{} covers the {:?} relative to the {:?} from {first} to {last}, but not {}, t = {t} s after the epoch {}",
            self.source.name(),
            self.body,
            self.origin,
            self.epoch.plus(t),
            self.epoch,
        );
        let help = format!(
            "end the run before t = {:.0} s, choose another epoch, or set `kernel` of `world` to an SPK file that covers this date",
            self.range[1].floor()
        );
        BuildError::new(fact).help(help)
    }
}
