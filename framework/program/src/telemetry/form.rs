//! The telemetry file: RON text → the meaning of columns. All mistakes are reported at once.
use linkwork_assembly::{Failure, read_value};
use linkwork_runtime::{Fault, Located, Origin, Sources, Unit, Value, remedy, split_quantity};
use linkwork_spatial::{Quat, Vec3};
use std::path::{Path, PathBuf};

/// A column of the table, with its conversion to SI.
#[derive(Clone, Debug)]
pub struct Column {
    pub title: String,
    pub unit: Unit,
    /// The unit as in the file; empty if it is not defined.
    pub text: String,
    pub origin: Origin,
}

/// Axes in which a table contains components.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axes {
    World,
    Planet,
    Inertial,
    NorthEastDown,
    EastNorthUp,
}

const AXES: [(&str, Axes); 5] = [
    ("world", Axes::World),
    ("planet", Axes::Planet),
    ("inertial", Axes::Inertial),
    ("north_east_down", Axes::NorthEastDown),
    ("east_north_up", Axes::EastNorthUp),
];

/// Position of a body: three columns.
#[derive(Clone, Debug)]
pub enum Position {
    Cartesian(Axes, [Column; 3]),
    /// Latitude, longitude, height over the ellipsoid.
    Geodetic([Column; 3]),
}

/// Attitude of a body.
#[derive(Clone, Debug)]
pub enum Turn {
    /// w, x, y, z.
    Quaternion([Column; 4]),
    /// Yaw, pitch, roll: about z, then the new y, then the new x.
    Angles([Column; 3]),
}

#[derive(Clone, Debug)]
pub struct Attitude {
    pub axes: Axes,
    pub turn: Turn,
    /// The rotation maps components from the axes to the body, instead of the opposite.
    pub to_body: bool,
}

/// A body of the simulation that the table contains.
#[derive(Clone, Debug)]
pub struct BodyForm {
    pub name: String,
    pub position: Position,
    pub attitude: Option<Attitude>,
    /// R_BT: rotation from the body axes of the table to those of the simulation.
    pub turned: Quat,
    /// The point whose position the table contains, relative to the origin of the body, body axes (m).
    pub point: Vec3,
    pub origin: Origin,
}

/// A curve.
#[derive(Clone, Debug)]
pub struct CurveForm {
    pub title: String,
    pub column: Column,
    /// The corresponding variable of the simulation.
    pub variable: Option<String>,
    pub origin: Origin,
}

/// The planet of the table.
#[derive(Clone, Copy, Debug, Default)]
pub struct PlanetForm {
    /// Equatorial radius (m), flattening.
    pub ellipsoid: Option<(f64, f64)>,
    /// Rate (rad/s) and angle at time 0 (rad) about z, if W does not define them.
    pub turn: Option<(f64, f64)>,
    pub origin: Option<Origin>,
}

/// A parsed telemetry file.
#[derive(Clone, Debug)]
pub struct Telemetry {
    /// The simulation whose view is shown, if the file defines one.
    pub simulation: Option<PathBuf>,
    pub table: PathBuf,
    pub time: Column,
    /// Time of the table at which the simulation begins (s).
    pub zero: f64,
    pub planet: PlanetForm,
    pub bodies: Vec<BodyForm>,
    pub curves: Vec<CurveForm>,
    pub sources: Sources,
    /// The whole file.
    pub origin: Origin,
}

struct Reader {
    faults: Vec<Fault>,
}

impl Telemetry {
    /// Reads a file.
    ///
    /// # Errors
    /// All mistakes.
    pub fn read(path: &Path) -> Result<Telemetry, Failure> {
        let name = path.display().to_string();
        let text = linkwork_formats::whole_text(path).map_err(|e| {
            let fault = Fault::new(Origin::NONE, format!("`{name}` cannot be read: {e}"))
                .help("give a telemetry file, which begins with `Telemetry(`");
            Failure { faults: vec![fault], sources: Sources::default() }
        })?;
        Telemetry::text(&name, &text, path.parent().unwrap_or(Path::new("")))
    }

    /// Reads a text. Paths in it are relative to `folder`.
    ///
    /// # Errors
    /// All mistakes.
    pub fn text(name: &str, text: &str, folder: &Path) -> Result<Telemetry, Failure> {
        let (value, sources) = read_value(name, text)?;
        let mut r = Reader { faults: Vec::new() };
        match r.form(&value, folder) {
            Some(form) if r.faults.is_empty() => Ok(Telemetry { sources, ..form }),
            _ => Err(Failure { faults: r.faults, sources }),
        }
    }
}

impl Reader {
    fn fault(&mut self, origin: Origin, message: impl Into<String>, help: impl Into<String>) {
        self.faults.push(Fault::new(origin, message).help(help));
    }

    /// Returns the entries of a map, with a fault for unknown ones.
    fn fields(&mut self, v: &Located, what: &str, known: &[&str]) -> bool {
        let Value::Map(entries) = &v.value else {
            let help = format!("write ({}: ..)", known.join(": .., "));
            self.fault(v.origin, format!("{what} is {}", v.value.what()), help);
            return false;
        };
        for (name, field) in entries.iter().filter(|(n, _)| !known.contains(&n.as_str())) {
            let message = format!("{what} has no field `{name}`");
            self.fault(field.origin, message, remedy(name, "fields", known));
        }
        true
    }

    fn need<'v>(
        &mut self,
        v: &'v Located,
        what: &str,
        field: &str,
        like: &str,
    ) -> Option<&'v Located> {
        let found = v.get(field);
        if found.is_none() {
            self.fault(
                v.origin,
                format!("{what} lacks `{field}`"),
                format!("write {field}: {like}"),
            );
        }
        found
    }

    fn text(&mut self, v: &Located, what: &str) -> Option<String> {
        if let Value::Text(t) = &v.value {
            return Some(t.clone());
        }
        self.fault(
            v.origin,
            format!("{what} must be a text, but it is {}", v.value.what()),
            "write it in quotes",
        );
        None
    }

    fn unit(&mut self, text: &str, origin: Origin, what: &str) -> Option<Unit> {
        match Unit::parse(text) {
            Ok(unit) => Some(unit),
            Err(e) => {
                self.fault(origin, format!("{what}: {e}"), "write a unit such as ft, deg or km/s");
                None
            }
        }
    }

    /// Reads a number or a quantity, in SI.
    fn number(&mut self, v: &Located, what: &str, unit: &str) -> Option<f64> {
        let wanted = Unit::parse(unit).unwrap_or(Unit::ONE);
        let read = match &v.value {
            Value::Number(x) => Some(*x),
            Value::Text(t) => split_quantity(t).and_then(|(x, u)| {
                let own = Unit::parse(u).ok()?;
                own.same_quantity(&wanted).then(|| own.to_si(x))
            }),
            _ => None,
        };
        if read.is_none_or(|x| !x.is_finite()) {
            let help = format!("write a number in {unit}, or a quantity in quotes");
            self.fault(v.origin, format!("{what} is {}", v.value), help);
            return None;
        }
        read
    }

    fn column(&mut self, v: &Located, what: &str, like: &str) -> Option<Column> {
        let (title, unit) = match &v.value {
            Value::Text(title) => (title.clone(), bracketed(title).map(str::to_owned)),
            Value::List(items) => match &items[..] {
                [
                    Located { value: Value::Text(title), .. },
                    Located { value: Value::Text(u), .. },
                ] => (title.clone(), Some(u.clone())),
                _ => (String::new(), None),
            },
            _ => (String::new(), None),
        };
        if title.is_empty() {
            let help = format!("write [\"its title in the table\", \"{like}\"]");
            self.fault(v.origin, format!("{what} must be a column, but it is {}", v.value), help);
            return None;
        }
        let wanted = Unit::parse(like).unwrap_or(Unit::ANY);
        let text = unit.clone().unwrap_or_default();
        let unit = match unit {
            Some(u) => self.unit(&u, v.origin, what)?,
            None => wanted_si(&wanted),
        };
        if !unit.same_quantity(&wanted) {
            let message =
                format!("{what}: the unit of column `{title}` is not compatible with {like}");
            self.fault(v.origin, message, format!("write a unit such as {like}"));
            return None;
        }
        Some(Column { title, unit, text, origin: v.origin })
    }

    /// Reads the columns of several fields of a map.
    fn columns<const N: usize>(
        &mut self,
        v: &Located,
        what: &str,
        fields: [(&str, &str); N],
    ) -> Option<[Column; N]> {
        let read = fields.map(|(field, like)| {
            let column = format!("[\"title\", \"{like}\"]");
            let at = self.need(v, what, field, &column)?;
            self.column(at, &format!("{what}: `{field}`"), like)
        });
        let all: Option<Vec<Column>> = read.into_iter().collect();
        all.and_then(|c| c.try_into().ok())
    }

    fn axes(&mut self, v: &Located, what: &str, known: &[(&str, Axes)]) -> Option<Axes> {
        let names: Vec<&str> = known.iter().map(|k| k.0).collect();
        let at = self.need(v, what, "axes", &format!("\"{}\"", names.join("\" or \"")))?;
        let text = self.text(at, &format!("{what}: `axes`"))?;
        let found = known.iter().find(|k| k.0 == text).map(|k| k.1);
        if found.is_none() {
            let message = format!("{what}: there are no axes `{text}`");
            self.fault(at.origin, message, remedy(&text, "axes", &names));
        }
        found
    }

    fn form(&mut self, v: &Located, folder: &Path) -> Option<Telemetry> {
        let inner = match &v.value {
            Value::Variant(name, inner) if name == "Telemetry" => &**inner,
            other => {
                let what = if let Value::Variant(name, _) = other { name } else { other.what() };
                self.fault(v.origin, format!("the file contains {what}"), "write Telemetry(..)");
                return None;
            }
        };
        let known = ["doc", "simulation", "table", "time", "planet", "bodies", "curves"];
        if !self.fields(inner, "the telemetry", &known) {
            return None;
        }
        inner.get("doc").and_then(|v| self.text(v, "`doc`"));
        let simulation = inner.get("simulation").map(|v| self.text(v, "`simulation`"));
        let table = self.need(inner, "the telemetry", "table", "\"flown.csv\"");
        let table = table.and_then(|v| self.text(v, "`table`"));
        let time = self.need(inner, "the telemetry", "time", "(column: [\"time\", \"s\"])");
        let time = time.and_then(|v| self.time(v));
        let planet = inner.get("planet").map_or(Some(PlanetForm::default()), |v| self.planet(v));
        let bodies = self.table(inner, "bodies", Self::body);
        let curves = self.table(inner, "curves", Self::curve);
        if bodies.is_empty() && curves.is_empty() && self.faults.is_empty() {
            let help = "write bodies: { \"a body of the simulation\": (position: ..) }";
            self.fault(v.origin, "the telemetry has neither bodies nor curves", help);
        }
        let (time, zero) = time?;
        Some(Telemetry {
            simulation: simulation.flatten().map(|s| folder.join(s)),
            table: folder.join(table?),
            time,
            zero,
            planet: planet?,
            bodies,
            curves,
            sources: Sources::default(),
            origin: v.origin,
        })
    }

    fn table<T>(
        &mut self,
        v: &Located,
        field: &str,
        one: fn(&mut Self, &str, &Located) -> Option<T>,
    ) -> Vec<T> {
        match v.get(field).map(|v| (&v.value, v.origin)) {
            None => Vec::new(),
            Some((Value::Map(entries), _)) => {
                entries.iter().filter_map(|(name, v)| one(self, name, v)).collect()
            }
            Some((other, origin)) => {
                let help = format!("write {field}: {{ \"name\": (..) }}");
                self.fault(origin, format!("`{field}` is {}", other.what()), help);
                Vec::new()
            }
        }
    }

    fn time(&mut self, v: &Located) -> Option<(Column, f64)> {
        let what = "`time`";
        if !self.fields(v, what, &["column", "zero"]) {
            return None;
        }
        let [column] = self.columns(v, what, [("column", "s")])?;
        let zero = v.get("zero").map_or(Some(0.0), |v| self.number(v, "`time`: `zero`", "s"))?;
        Some((column, zero))
    }

    fn planet(&mut self, v: &Located) -> Option<PlanetForm> {
        let what = "`planet`";
        if !self.fields(v, what, &["radius", "flattening", "rate", "angle"]) {
            return None;
        }
        let mut number = |field: &str, unit: &str| {
            v.get(field).map(|v| self.number(v, &format!("{what}: `{field}`"), unit))
        };
        let (radius, flattening) = (number("radius", "m"), number("flattening", "1"));
        let (rate, angle) = (number("rate", "rad/s"), number("angle", "rad"));
        for (a, b) in
            [(("flattening", flattening), ("radius", radius)), (("angle", angle), ("rate", rate))]
        {
            if a.1.is_some() && b.1.is_none() {
                let message = format!("{what} has `{}`, but lacks `{}`", a.0, b.0);
                self.fault(v.origin, message, format!("add {}: ..", b.0));
            }
        }
        let ellipsoid = match radius {
            Some(radius) => Some((radius?, flattening.unwrap_or(Some(0.0))?)),
            None => None,
        };
        if let Some((radius, flattening)) = ellipsoid
            && let Err(e) = linkwork_world::planet::Ellipsoid::new(radius, flattening)
        {
            self.faults.push(Fault::of(v.origin, &e));
        }
        let turn = match rate {
            Some(rate) => Some((rate?, angle.unwrap_or(Some(0.0))?)),
            None => None,
        };
        Some(PlanetForm { ellipsoid, turn, origin: Some(v.origin) })
    }

    fn body(&mut self, name: &str, v: &Located) -> Option<BodyForm> {
        let what = format!("body `{name}`");
        if !self.fields(v, &what, &["position", "attitude", "turned", "point"]) {
            return None;
        }
        let position = self.need(v, &what, "position", "(axes: \"world\", x: .., y: .., z: ..)");
        let position = position.and_then(|v| self.position(v, &format!("{what}: `position`")));
        let attitude = v.get("attitude").map(|v| self.attitude(v, &format!("{what}: `attitude`")));
        let three = |r: &mut Self, field: &str, unit: &str| {
            let Some(v) = v.get(field) else { return Some(Vec3::zeros()) };
            let what = format!("{what}: `{field}`");
            if let Value::List(items) = &v.value
                && let [x, y, z] = &items[..]
            {
                let [x, y, z] = [x, y, z].map(|n| r.number(n, &what, unit));
                return Some(Vec3::new(x?, y?, z?));
            }
            r.fault(
                v.origin,
                format!("{what} is {}", v.value),
                format!("write [.., .., ..] in {unit}"),
            );
            None
        };
        let (turned, point) = (three(self, "turned", "rad")?, three(self, "point", "m")?);
        if attitude.is_none() && (turned.norm() > 0.0 || point.norm() > 0.0) {
            let help = "write its `attitude`, or remove `turned` and `point`";
            self.fault(
                v.origin,
                format!("{what} has `turned` or `point`, but lacks an attitude"),
                help,
            );
        }
        let attitude = match attitude {
            Some(read) => Some(read?),
            None => None,
        };
        let turned = Quat::from_euler_angles(turned.x, turned.y, turned.z);
        let (name, position) = (name.to_owned(), position?);
        Some(BodyForm { name, position, attitude, turned, point, origin: v.origin })
    }

    fn position(&mut self, v: &Located, what: &str) -> Option<Position> {
        if v.get("latitude").is_some() {
            self.fields(v, what, &["latitude", "longitude", "height"]);
            let fields = [("latitude", "deg"), ("longitude", "deg"), ("height", "m")];
            return self.columns(v, what, fields).map(Position::Geodetic);
        }
        if !self.fields(v, what, &["axes", "x", "y", "z"]) {
            return None;
        }
        let axes = self.axes(v, what, &AXES[..3]);
        let columns = self.columns(v, what, [("x", "m"), ("y", "m"), ("z", "m")]);
        Some(Position::Cartesian(axes?, columns?))
    }

    fn attitude(&mut self, v: &Located, what: &str) -> Option<Attitude> {
        let angles = v.get("yaw").is_some();
        let own: &[&str] = if angles { &["yaw", "pitch", "roll"] } else { &["w", "x", "y", "z"] };
        if !self.fields(v, what, &[&["axes", "sense"], own].concat()) {
            return None;
        }
        let axes = self.axes(v, what, &AXES);
        let turn = if angles {
            let fields = [("yaw", "deg"), ("pitch", "deg"), ("roll", "deg")];
            self.columns(v, what, fields).map(Turn::Angles)
        } else {
            let fields = [("w", "1"), ("x", "1"), ("y", "1"), ("z", "1")];
            self.columns(v, what, fields).map(Turn::Quaternion)
        };
        let words = ["body_to_axes", "axes_to_body"];
        let sense = v.get("sense").map_or(Some(words[0].to_owned()), |at| {
            let text = self.text(at, &format!("{what}: `sense`"))?;
            if !words.contains(&text.as_str()) {
                let message = format!("{what}: there is no sense `{text}`");
                self.fault(at.origin, message, remedy(&text, "words", &words));
            }
            Some(text)
        });
        Some(Attitude { axes: axes?, turn: turn?, to_body: sense? == words[1] })
    }

    fn curve(&mut self, title: &str, v: &Located) -> Option<CurveForm> {
        let what = format!("curve `{title}`");
        if !self.fields(v, &what, &["column", "variable"]) {
            return None;
        }
        let [column] = self.columns(v, &what, [("column", "*")])?;
        let variable = match v.get("variable") {
            Some(v) => Some(self.text(v, &format!("{what}: `variable`"))?),
            None => None,
        };
        Some(CurveForm { title: title.to_owned(), column, variable, origin: v.origin })
    }
}

/// Returns the unit in brackets at the end of a title.
fn bracketed(title: &str) -> Option<&str> {
    title.trim_end().strip_suffix(']')?.rsplit_once('[').map(|(_, unit)| unit)
}

/// Returns the SI unit of a quantity, for columns without a unit.
fn wanted_si(of: &Unit) -> Unit {
    if *of == Unit::ANY { Unit::ONE } else { Unit { scale: 1.0, offset: 0.0, ..*of } }
}
