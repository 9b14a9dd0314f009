//! Initial state of a body: `initial: (angle: "5 deg", rate: 0)`, or poses and velocities.
use crate::body::hinge::slides;
use crate::schema::describe::Schema;
use crate::schema::kind::{At, Kind, drive_number, flag, list_of, number, text, vector, word};
use crate::schema::pose::rotation;
use crate::schema::record::{Presence, Record, of, record};
use crate::text::report::Cx;
use crate::text::value::Text;
use linkwork_multibody::{Hinge, Subhinge, SubhingeKind};
use linkwork_runtime::{Located, Value};
use linkwork_spatial::{Quat, Vec3};
use linkwork_surroundings::{Anomaly, Start, StartFrame, TwoLineSource};
use std::f64::consts::FRAC_PI_2;

record! {
    struct Floating: "start of a free body" {
        /// Origin in the parent's frame of the hinge.
        position: Vec3 = vector("m").or(Vec3::zeros()),
        /// Rotation in the parent's frame of the hinge.
        rotation: Quat = rotation().or(Quat::identity()),
        /// Velocity of the origin, axes of the parent's frame.
        velocity: Vec3 = vector("m/s").or(Vec3::zeros()),
        /// Angular velocity, body axes.
        angular: Vec3 = vector("rad/s").or(Vec3::zeros()),
        /// The values are approximate: closing loops and couplings at the start may change them. Otherwise they are kept.
        approximate: bool = flag().or(false),
        /// Instead of position and velocity: orbital elements about the body of the world.
        elements: Option<OrbitForm> = of::<OrbitForm>().maybe(),
        /// Instead of position and velocity: a state in named axes about the body of the world.
        state: Option<StateForm> = of::<StateForm>().maybe(),
        /// Instead of position and velocity: geodetic coordinates on the ellipsoid of the world.
        geodetic: Option<GeodeticForm> = of::<GeodeticForm>().maybe(),
        /// Instead of position and velocity: two-line elements of an Earth satellite.
        tle: Option<TwoLineForm> = of::<TwoLineForm>().maybe(),
        /// Instead of position and velocity: an orbit ephemeris message.
        oem: Option<EphemerisForm> = of::<EphemerisForm>().maybe(),
    }
}
record! {
    struct OrbitForm: "osculating elements of an orbit" {
        /// Axes of the angles: equator (of the body of the world, x through its prime meridian at t = 0), inertial, icrf, eme2000, teme. Default: inertial; required if the pole of the body is more than 1 degree from z of the inertial axes.
        frame: Option<StartFrame> = word(ORBIT_FRAMES).maybe(),
        /// Semi-major axis; negative for a hyperbola.
        semi_major_axis: f64 = number("m").need("write `semi_major_axis: \"7000 km\"`"),
        /// Eccentricity.
        eccentricity: f64 = number("").at_least(0.0).or(0.0),
        /// Inclination relative to the x–y plane of these axes.
        inclination: f64 = number("rad").turn().or(0.0),
        /// Right ascension of the ascending node.
        ascending_node: f64 = number("rad").turn().or(0.0),
        /// Argument of the pericentre.
        pericentre: f64 = number("rad").turn().or(0.0),
        /// True anomaly (default, without `mean_anomaly`: 0, the pericentre).
        anomaly: Option<f64> = number("rad").turn().maybe(),
        /// Mean anomaly, instead of `anomaly`.
        mean_anomaly: Option<f64> = number("rad").maybe(),
    }
}
/// Names of the axes of elements in files.
const ORBIT_FRAMES: &[(&str, StartFrame)] = &[
    ("equator", StartFrame::Equator),
    ("inertial", StartFrame::Inertial),
    ("icrf", StartFrame::Icrf),
    ("eme2000", StartFrame::Eme2000),
    ("teme", StartFrame::Teme),
];
/// Names of the axes of a state in files.
const FRAMES: &[(&str, StartFrame)] = &[
    ("inertial", StartFrame::Inertial),
    ("equator", StartFrame::Equator),
    ("icrf", StartFrame::Icrf),
    ("eme2000", StartFrame::Eme2000),
    ("fixed", StartFrame::Fixed),
    ("itrf", StartFrame::Itrf),
    ("teme", StartFrame::Teme),
];
record! {
    struct StateForm: "state in named axes" {
        /// Axes: inertial, equator (inertial axes that coincide with the axes of the body of the world at t = 0), icrf, eme2000, fixed (rotating with the body), itrf, teme; the origin is the centre of the body.
        frame: StartFrame = word(FRAMES).need("write `frame: inertial`, fixed or teme"),
        /// Position.
        position: Vec3 = vector("m").need("write `position: [.., .., ..]`"),
        /// Velocity in these axes.
        velocity: Vec3 = vector("m/s").or(Vec3::zeros()),
    }
}
record! {
    struct GeodeticForm: "position above the ellipsoid" {
        /// Geodetic latitude, north positive.
        latitude: f64 = number("rad").within(-FRAC_PI_2, FRAC_PI_2).need("write `latitude: ..`"),
        /// East longitude.
        longitude: f64 = number("rad").turn().need("write `longitude: ..`"),
        /// Height above the ellipsoid.
        height: f64 = number("m").or(0.0),
        /// Velocity relative to the ground: east, north, up.
        velocity: Vec3 = vector("m/s").or(Vec3::zeros()),
    }
}
record! {
    struct TwoLineForm: "two-line elements, at the epoch of the world by SGP4" {
        /// File with two or three lines for each satellite.
        file: Option<Text> = text().maybe(),
        /// The two lines, instead of `file`.
        lines: Option<Vec<Text>> = list_of(text()).maybe(),
        /// Name or catalogue number of the satellite, if the file contains several.
        satellite: Option<Text> = text().maybe(),
    }
}
record! {
    struct EphemerisForm: "orbit ephemeris message (CCSDS OEM), at the epoch of the world" {
        /// File in key-value notation.
        file: Text = text().need("write `file: \"orbit.oem\"`"),
        /// `OBJECT_NAME`, if the file contains several.
        object: Option<Text> = text().maybe(),
    }
}

/// Returns the orbital or geodetic start of a free body; `None` if position and velocity are written.
fn started(cx: &mut Cx, v: &Located, x: &Floating, at: &At<'_>) -> Option<Start> {
    let ways = [
        x.elements.is_some(),
        x.state.is_some(),
        x.geodetic.is_some(),
        x.tle.is_some(),
        x.oem.is_some(),
    ];
    let count = ways.iter().filter(|w| **w).count();
    let written = v.get("position").is_some() || v.get("velocity").is_some();
    if count > 1 || (count == 1 && written) {
        let fact = format!("{}: position and velocity are specified twice", at.what);
        let help = "write `position` and `velocity`, or one of `elements`, `state`, `geodetic`, `tle`, `oem`";
        cx.fault(v.origin, fact, help);
        return None;
    }
    if let Some(e) = &x.elements {
        let anomaly = match (e.anomaly, e.mean_anomaly) {
            (Some(_), Some(_)) => {
                let fact = format!("{}: `anomaly` and `mean_anomaly` are both written", at.what);
                cx.fault(v.origin, fact, "write one of them");
                return None;
            }
            (None, Some(mean)) => Anomaly::Mean(mean),
            (true_one, None) => Anomaly::True(true_one.unwrap_or(0.0)),
        };
        return Some(Start::Elements {
            frame: e.frame,
            semi_major_axis: e.semi_major_axis,
            eccentricity: e.eccentricity,
            inclination: e.inclination,
            ascending_node: e.ascending_node,
            pericentre: e.pericentre,
            anomaly,
        });
    }
    if let Some(s) = &x.state {
        return Some(Start::State { frame: s.frame, position: s.position, velocity: s.velocity });
    }
    if let Some(t) = &x.tle {
        let from = match (&t.file, &t.lines) {
            (Some(file), None) => TwoLineSource::File(file.text.clone()),
            (None, Some(lines)) => {
                TwoLineSource::Lines(lines.iter().map(|l| l.text.clone()).collect())
            }
            _ => {
                let fact = format!("{}: `tle` needs either `file` or `lines`", at.what);
                cx.fault(v.origin, fact, "write `tle: (file: \"satellite.tle\")`");
                return None;
            }
        };
        return Some(Start::TwoLine {
            from,
            satellite: t.satellite.as_ref().map(|s| s.text.clone()),
        });
    }
    if let Some(e) = &x.oem {
        let object = e.object.as_ref().map(|o| o.text.clone());
        return Some(Start::Ephemeris { file: e.file.text.clone(), object });
    }
    x.geodetic.as_ref().map(|g| Start::Geodetic {
        latitude: g.latitude,
        longitude: g.longitude,
        height: g.height,
        velocity: g.velocity,
    })
}
record! {
    struct Turning: "start of a ball" {
        /// Rotation in the parent's frame of the hinge.
        rotation: Quat = rotation().or(Quat::identity()),
        /// Angular velocity, body axes.
        angular: Vec3 = vector("rad/s").or(Vec3::zeros()),
        /// The values are approximate: closing loops and couplings at the start may change them. Otherwise they are kept.
        approximate: bool = flag().or(false),
    }
}
record! {
    struct Pinned: "start of a pin or screw" {
        /// Angle.
        angle: f64 = number("rad").or(0.0),
        /// Rate of the angle.
        rate: f64 = number("rad/s").or(0.0),
        /// The values are approximate: closing loops and couplings at the start may change them. Otherwise they are kept.
        approximate: bool = flag().or(false),
    }
}
record! {
    struct Sliding: "start of a slider" {
        /// Position along the axis.
        position: f64 = number("m").or(0.0),
        /// Rate of the position.
        rate: f64 = number("m/s").or(0.0),
        /// The values are approximate: closing loops and couplings at the start may change them. Otherwise they are kept.
        approximate: bool = flag().or(false),
    }
}
record! {
    struct Chained: "start of a chain" {
        /// One number per subhinge, beginning at the parent; with a ball in the chain all numbers, in SI.
        coordinates: Option<Located> = crate::schema::kind::raw(|| list_of(drive_number("rad", "m")).describe()).maybe(),
        /// Their rates.
        rates: Option<Located> = crate::schema::kind::raw(|| list_of(drive_number("rad/s", "m/s")).describe()).maybe(),
        /// The values are approximate: closing loops and couplings at the start may change them. Otherwise they are kept.
        approximate: bool = flag().or(false),
    }
}

/// Returns the schema of `initial`; the hinge determines which alternative applies.
pub(crate) fn schema() -> Schema {
    Schema::Any(vec![
        Floating::describe(),
        Turning::describe(),
        Pinned::describe(),
        Sliding::describe(),
        Chained::describe(),
    ])
}

/// Returns which coordinates, and which rates, of one hinge are specified and not approximate, by their indices among its rates.
pub(crate) fn kept(v: Option<&Located>, hinge: &Hinge) -> [Vec<bool>; 2] {
    let is = |field: &str| v.is_some_and(|v| v.get(field).is_some_and(|v| v.value != Value::Null));
    let approximate = v.and_then(|v| v.get("approximate")).map(|v| &v.value);
    let nv = hinge.subhinges.iter().map(|s| s.kind.nv()).sum();
    if approximate == Some(&Value::Bool(true)) {
        return [vec![false; nv], vec![false; nv]];
    }
    match hinge.subhinges.as_slice() {
        // A free body's rates are its angular velocity, then its linear velocity.
        [s] if matches!(s.kind, SubhingeKind::Free) => {
            let of = |turn: &str, way: &str| [[is(turn); 3], [is(way); 3]].concat();
            [of("rotation", "position"), of("angular", "velocity")]
        }
        [s] if matches!(s.kind, SubhingeKind::Ball) => {
            [vec![is("rotation"); nv], vec![is("angular"); nv]]
        }
        [s] if s.kind.nv() == 1 => [vec![is("angle") || is("position"); nv], vec![is("rate"); nv]],
        _ => [vec![is("coordinates"); nv], vec![is("rates"); nv]],
    }
}

/// Reads coordinates and rates of one hinge (default: neutral and at rest), and the orbital or geodetic start of a free body.
pub(crate) fn read(
    cx: &mut Cx,
    v: Option<&Located>,
    hinge: &Hinge,
    at: &At<'_>,
) -> (Vec<f64>, Vec<f64>, Option<Start>) {
    let mut start = None;
    let (mut q, mut rates) = (Vec::new(), Vec::new());
    for s in &hinge.subhinges {
        match s.kind {
            SubhingeKind::Free => q.extend([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
            SubhingeKind::Ball => q.extend([0.0, 0.0, 0.0, 1.0]),
            _ => q.extend(vec![0.0; s.kind.nq()]),
        }
        rates.extend(vec![0.0; s.kind.nv()]);
    }
    let Some(v) = v.filter(|v| v.value != Value::Null) else { return (q, rates, None) };
    match hinge.subhinges.as_slice() {
        [s] if matches!(s.kind, SubhingeKind::Free) => {
            if let Some(x) = Floating::read(cx, v, at) {
                start = started(cx, v, &x, at);
                let (p, R) = (x.position, x.rotation);
                q.copy_from_slice(&[p.x, p.y, p.z, R.i, R.j, R.k, R.w]);
                rates[..3].copy_from_slice(x.angular.as_slice());
                // β contains the velocity in child axes.
                rates[3..].copy_from_slice((R.inverse() * x.velocity).as_slice());
            }
        }
        [s] if matches!(s.kind, SubhingeKind::Ball) => {
            if let Some(x) = Turning::read(cx, v, at) {
                let R = x.rotation;
                q.copy_from_slice(&[R.i, R.j, R.k, R.w]);
                rates.copy_from_slice(x.angular.as_slice());
            }
        }
        [s] if slides(&s.kind) => {
            let x = Sliding::read(cx, v, at);
            (q[0], rates[0]) = x.map_or((0.0, 0.0), |x| (x.position, x.rate));
        }
        [s] if s.kind.nv() == 1 => {
            let x = Pinned::read(cx, v, at);
            (q[0], rates[0]) = x.map_or((0.0, 0.0), |x| (x.angle, x.rate));
        }
        [] => {
            let help = "a locked hinge does not have a coordinate: remove `initial` or choose another hinge";
            cx.fault(v.origin, format!("{} cannot be set for this hinge", at.what), help);
        }
        chain => {
            let whole = chain.iter().any(|s| s.kind.nv() > 1);
            let Some(x) = Chained::read(cx, v, at) else { return (q, rates, None) };
            let (turns, ways) = (["rad", "rad/s"], ["m", "m/s"]);
            for (k, written, field, out) in
                [(0, x.coordinates, "coordinates", &mut q), (1, x.rates, "rates", &mut rates)]
            {
                let Some(written) = written else { continue };
                let at = at.field(field);
                if !whole {
                    let unit = drive_number(turns[k], ways[k]);
                    numbers(cx, &written, &at, out, |j| slides(&chain[j].kind), &unit);
                } else {
                    numbers(cx, &written, &at, out, |_| false, &number(""));
                }
            }
            if whole {
                unit_quaternions(cx, v, at, chain, &q);
            }
        }
    }
    (q, rates, start)
}

/// Reads one number per subhinge, each in the unit of its subhinge.
fn numbers(
    cx: &mut Cx,
    v: &Located,
    at: &At<'_>,
    out: &mut [f64],
    slides: impl Fn(usize) -> bool,
    kind: &impl Kind<Of = f64>,
) {
    let items = crate::schema::read::list(cx, v, &at.what);
    if items.len() != out.len() {
        let message =
            format!("{} has {} numbers, the hinge has {}", at.what, items.len(), out.len());
        let help = "one for each subhinge, beginning at the parent; a chain with a ball needs all its \
                    numbers, a quaternion as x, y, z, w";
        cx.fault(v.origin, message, help);
        return;
    }
    for (j, (item, x)) in items.iter().zip(out).enumerate() {
        *x = kind.read(cx, item, &at.clone().sliding(slides(j))).unwrap_or(0.0);
    }
}

fn unit_quaternions(cx: &mut Cx, v: &Located, at: &At<'_>, chain: &[Subhinge], q: &[f64]) {
    let mut start = 0;
    for s in chain {
        let end = start + s.kind.nq();
        let turn = &q[end.saturating_sub(4).max(start)..end];
        let length = turn.iter().map(|x| x * x).sum::<f64>().sqrt();
        if s.kind.nv() > 1 && !((length - 1.0).abs() < 1e-6) {
            let message = format!("{}: a quaternion has length {length}, not 1", at.what);
            cx.fault(v.origin, message, "the order is x, y, z, w; divide by the length");
        }
        start = end;
    }
}

/// Returns a hinge's part of q in the form of the file; `approximate` if loops and couplings may change it.
pub(crate) fn value(h: &Hinge, q: &[f64], approximate: bool) -> Value {
    let quat = |q: &[f64]| {
        Quat::new_unchecked(linkwork_spatial::nalgebra::Quaternion::new(q[3], q[0], q[1], q[2]))
    };
    let (zero, first) = (Vec3::zeros(), q.first().copied().unwrap_or(0.0));
    match &h.subhinges[..] {
        [] => Value::Null,
        [s] if s.kind == SubhingeKind::Free && q.len() == 7 => {
            let position = Vec3::new(q[0], q[1], q[2]);
            let rotation = quat(&q[3..]);
            Floating {
                position,
                rotation,
                velocity: zero,
                angular: zero,
                approximate,
                elements: None,
                state: None,
                geodetic: None,
                tle: None,
                oem: None,
            }
            .write()
        }
        [s] if s.kind == SubhingeKind::Ball && q.len() == 4 => {
            Turning { rotation: quat(q), angular: zero, approximate }.write()
        }
        [s] if slides(&s.kind) => Sliding { position: first, rate: 0.0, approximate }.write(),
        [s] if s.kind.nv() == 1 => Pinned { angle: first, rate: 0.0, approximate }.write(),
        _ => {
            let all = crate::text::value::list(q.iter().copied());
            Chained { coordinates: Some(all.into()), rates: None, approximate }.write()
        }
    }
}
