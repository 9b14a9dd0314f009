//! Hinges as written in a file: chains of subhinges with their drives and limits.
use crate::schema::describe::Schema;
use crate::schema::kind::{
    At, Kind, direction, drive_number, flag, list_of, mapped, number, short,
};
use crate::schema::read::fields;
use crate::schema::record::{Presence, Record, argument, of, record, variant_name, variant_of};
use crate::text::report::Cx;
use crate::text::value::variant;
use linkwork_multibody::{
    BallLimits, Coordinate, Friction, Hinge, Limits, Spring, Stop, Subhinge, SubhingeKind,
};
use linkwork_runtime::{Located, Value};
use linkwork_spatial::Vec3;

const HINGES: [&str; 11] = [
    "Pin",
    "Slider",
    "Screw",
    "Ball",
    "Free",
    "Locked",
    "Universal",
    "Cylindrical",
    "Gimbal",
    "Planar",
    "Chain",
];

record! {
    struct Axis: "axis" {
        /// Axis, in the frames of the hinge.
        axis: Vec3 = direction().need("write for example Pin([0, 0, 1])"),
    }
}
record! {
    struct Thread: "thread" {
        /// Axis, in the frames of the hinge.
        axis: Vec3 = direction().need("write Screw(axis: [0, 0, 1], pitch: \"1 mm/rev\")"),
        /// Advance along the axis per angle about it.
        pitch: f64 = number("m/rad").need("write Screw(axis: [0, 0, 1], pitch: \"1 mm/rev\")"),
    }
}
record! {
    struct Axes: "axes" {
        /// The two axes, beginning at the parent.
        axes: Vec<Vec3> = list_of(direction()).need("write Universal([1, 0, 0], [0, 1, 0])"),
    }
}
record! {
    struct Bare: "hinge without axes" {}
}

record! {
    /// Properties of a subhinge in addition to its kind; in a body, of its whole hinge.
    pub(crate) struct Drive: "drive" {
        /// The coordinate follows a command instead of forces.
        prescribed: Option<bool> = flag().maybe(),
        /// Inertia of a rotor, before the gear.
        armature: Option<f64> = drive_number("kg m^2", "kg").maybe(),
        /// Gear ratio: revolutions of the rotor per revolution of the coordinate.
        gear: Option<f64> = number("").maybe(),
        /// Limits of the coordinate.
        limits: Option<LimitsForm> = of::<LimitsForm>().maybe(),
        /// Stop at the limits: `true`, `false`, or a spring with a damper.
        stop: Option<Stop> = stop().maybe(),
        /// Spring: its stiffness, and its rest position.
        spring: Option<Spring> = of::<Spring>().maybe(),
        /// Viscous damping.
        damping: Option<f64> = drive_number("N m s/rad", "N s/m").maybe(),
        /// Dry friction, and the rate at which its smooth form saturates.
        friction: Option<Friction> = friction().maybe(),
    }
}

record! {
    /// Limits of a coordinate, or of a ball.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub(crate) struct LimitsForm: "limits" {
        /// Lower limit of the coordinate; 0 for a ball.
        lower: f64 = drive_number("rad", "m").or(f64::NEG_INFINITY),
        /// Upper limit of the coordinate; for a ball, the largest angle of its whole rotation.
        upper: f64 = drive_number("rad", "m").or(f64::INFINITY),
        /// Largest rate, in both directions.
        rate: f64 = drive_number("rad/s", "m/s").or(f64::INFINITY),
        /// Largest force or torque of the actuator, in both directions.
        effort: f64 = drive_number("N m", "N").or(f64::INFINITY),
        /// Largest angle between the z axes of the two sides of a ball hinge.
        cone: f64 = number("rad").or(f64::INFINITY),
        /// Largest rotation of a ball hinge about z, in both directions.
        twist: f64 = number("rad").or(f64::INFINITY),
        /// Coefficient of restitution at the limits.
        restitution: Option<f64> = number("").within(0.0, 1.0).maybe(),
    }
}
record! {
    for Spring: "spring" {
        /// Stiffness.
        stiffness: drive_number("N m/rad", "N/m").at_least(0.0).need("write `spring: (stiffness: ..)`"),
        /// Coordinate without force.
        rest: drive_number("rad", "m").or(0.0),
    }
}
record! {
    for Friction: "friction" {
        /// Force or torque.
        force: drive_number("N m", "N").or(0.0),
        /// Rate at which the smooth form reaches 3/4 of it; 0: the default.
        rate: drive_number("rad/s", "m/s").or(0.0),
    }
}
record! {
    struct Soft: "stop" {
        /// Stiffness beyond the limit.
        stiffness: f64 = drive_number("N m/rad", "N/m")
            .need("write `stop: (stiffness: ..)`, or `false` if the coordinate may pass its limits"),
        /// Damping beyond the limit, as a fraction of the stiffness.
        damping: f64 = drive_number("s/rad", "s/m").or(0.0),
    }
}

fn friction() -> impl Kind<Of = Friction> {
    let force = mapped(drive_number("N m", "N"), |force| Friction { force, rate: 0.0 }, |_| None);
    short(force, of::<Friction>())
}

fn stop() -> impl Kind<Of = Stop> {
    let usual = mapped(
        flag(),
        |on| if on { Stop::Usual } else { Stop::Off },
        |s| match s {
            Stop::Usual => Some(true),
            Stop::Off => Some(false),
            Stop::Soft { .. } => None,
        },
    );
    let soft = mapped(
        of::<Soft>(),
        |Soft { stiffness, damping }| Stop::Soft { stiffness, damping },
        |s| match *s {
            Stop::Soft { stiffness, damping } => Some(Soft { stiffness, damping }),
            _ => None,
        },
    );
    short(usual, soft)
}

/// A hinge: `Pin([0, 1, 0])`, `Chain(Slider(..), Pin(..))`.
pub(crate) struct HingeKind;

pub(crate) fn hinge() -> HingeKind {
    HingeKind
}

impl Kind for HingeKind {
    type Of = Hinge;
    fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<Hinge> {
        let (kind, inner) = variant_name(cx, v, &at.what, ("hinge", "hinges", &HINGES))?;
        if kind == "Chain" {
            let mut chain = Vec::new();
            // A chain of one hinge is parsed as that hinge.
            let one = std::slice::from_ref(inner);
            let items = if let Value::List(items) = &inner.value { items.as_slice() } else { one };
            for item in items {
                chain.extend(link(cx, item, at)?);
            }
            return Some(Hinge { subhinges: chain });
        }
        let at = at.field(kind);
        let mut hinge = match kind {
            "Pin" => Hinge::pin(driven::<Axis>(cx, inner, &at, "axis")?.axis),
            "Slider" => Hinge::slider(driven::<Axis>(cx, inner, &at, "axis")?.axis),
            "Cylindrical" => Hinge::cylindrical(driven::<Axis>(cx, inner, &at, "axis")?.axis),
            "Screw" => {
                let Thread { axis, pitch } = driven(cx, inner, &at, "axis")?;
                Hinge::screw(axis, pitch)
            }
            "Universal" => {
                let Axes { axes } = driven(cx, inner, &at, "axes")?;
                let [first, second] = axes[..] else {
                    let help = "write Universal([1, 0, 0], [0, 1, 0])";
                    cx.fault(inner.origin, format!("{} has two axes", at.what), help);
                    return None;
                };
                Hinge::universal(first, second)
            }
            _ => {
                driven::<Bare>(cx, inner, &at, "")?;
                match kind {
                    "Ball" => Hinge::ball(),
                    "Free" => Hinge::free(),
                    "Gimbal" => Hinge::gimbal(),
                    "Planar" => Hinge::planar(),
                    _ => Hinge::locked(),
                }
            }
        };
        options(cx, inner, &at, &mut hinge.subhinges);
        Some(hinge)
    }
    fn write(&self, h: &Hinge) -> Value {
        match &h.subhinges[..] {
            [] => Value::Null,
            [one] if one.kind != SubhingeKind::Locked => subhinge(one),
            many => {
                let links = many.iter().map(|s| subhinge(s).into()).collect();
                Value::Variant("Chain".into(), Box::new(Value::List(links).into()))
            }
        }
    }
    fn describe(&self) -> Schema {
        Schema::Named("hinge", || {
            let axis = |name| variant_of::<(Axis, Drive)>(name, "axis");
            let bare = |name| variant_of::<Driven>(name, "");
            let mut all = vec![axis("Pin"), axis("Slider"), axis("Cylindrical")];
            all.push(variant_of::<(Thread, Drive)>("Screw", ""));
            all.push(variant_of::<(Axes, Drive)>("Universal", "axes"));
            all.extend(["Ball", "Free", "Gimbal", "Planar", "Locked"].map(bare));
            let chain = Schema::List(Box::new(hinge().describe()), None);
            all.push(Schema::Variant(
                "Chain",
                Box::new(Schema::Any(vec![chain, hinge().describe()])),
            ));
            Schema::Any(all)
        })
    }
}

type Driven = (Bare, Drive);

/// Reads the contents of the brackets without the fields of the drive, and rejects unknown fields.
fn driven<T: Record>(cx: &mut Cx, inner: &Located, at: &At<'_>, short: &str) -> Option<T> {
    if matches!(inner.value, Value::Map(_)) {
        fields(cx, inner, &at.what, &[T::names(), Drive::names()].concat());
        return T::read_fields(cx, inner, at);
    }
    argument(cx, inner, at, short)
}

/// Returns the subhinges of one item of a chain; `Locked` is a subhinge there.
fn link(cx: &mut Cx, item: &Located, at: &At<'_>) -> Option<Vec<Subhinge>> {
    match &item.value {
        Value::Variant(kind, inner) if kind == "Locked" => {
            let (mut locked, at) = ([SubhingeKind::Locked.into()], at.field("Locked"));
            driven::<Bare>(cx, inner, &at, "")?;
            options(cx, inner, &at, &mut locked);
            Some(locked.into())
        }
        _ => Some(hinge().read(cx, item, at)?.subhinges),
    }
}

/// Returns whether a coordinate is a length.
pub(crate) fn slides(kind: &SubhingeKind) -> bool {
    matches!(kind, SubhingeKind::Slider { .. })
}

/// Applies the [`Drive`] of a body to its whole hinge, or that of one hinge of a chain.
pub(crate) fn options(cx: &mut Cx, v: &Located, at: &At<'_>, chain: &mut [Subhinge]) {
    for s in chain {
        let at = at.clone().sliding(slides(&s.kind));
        let Some(drive) = Drive::read_fields(cx, v, &at) else { continue };
        if drive.prescribed == Some(true) {
            s.coordinate = Coordinate::Prescribed;
        }
        s.armature = drive.armature.unwrap_or(s.armature);
        s.gear = drive.gear.unwrap_or(s.gear);
        if let Some(l) = drive.limits {
            take_limits(cx, v, &at, &l, s);
        }
        s.spring = drive.spring.unwrap_or(s.spring);
        s.damping = drive.damping.unwrap_or(s.damping);
        s.friction = drive.friction.unwrap_or(s.friction);
        s.stop = drive.stop.unwrap_or(s.stop);
    }
}

/// Applies limits of a coordinate or a ball.
fn take_limits(cx: &mut Cx, v: &Located, at: &At<'_>, l: &LimitsForm, s: &mut Subhinge) {
    let origin = v.get("limits").map_or(v.origin, |l| l.origin);
    s.restitution = l.restitution;
    if s.kind == SubhingeKind::Ball {
        if l.lower > 0.0 || (l.lower.is_finite() && l.lower != 0.0) {
            let fact =
                format!("{}: `lower` of a ball is 0, because its angle has no sign", at.what);
            cx.fault(origin, fact, "write `upper`, `cone` or `twist`");
        }
        if l.rate.is_finite() || l.effort.is_finite() {
            let fact = format!("{}: a ball does not support limits of rate and effort", at.what);
            cx.fault(origin, fact, "write `upper`, `cone` or `twist`");
        }
        s.ball = BallLimits { angle: l.upper, cone: l.cone, twist: l.twist };
        return;
    }
    if l.cone.is_finite() || l.twist.is_finite() {
        let fact = format!("{}: only balls support `cone` and `twist`", at.what);
        cx.fault(origin, fact, "write `lower` and `upper`");
    }
    s.limits = Limits { lower: l.lower, upper: l.upper, rate: l.rate, effort: l.effort };
}

/// Returns the limits of a subhinge in the form of the file; `None` without limits.
fn written_limits(s: &Subhinge) -> Option<LimitsForm> {
    let Limits { lower, upper, rate, effort } = s.limits;
    let BallLimits { angle, cone, twist } = s.ball;
    let upper = if s.kind == SubhingeKind::Ball { angle } else { upper };
    let any = s.limits != Limits::NONE || s.ball != BallLimits::NONE || s.restitution.is_some();
    let restitution = s.restitution;
    any.then_some(LimitsForm { lower, upper, rate, effort, cone, twist, restitution })
}

fn subhinge(s: &Subhinge) -> Value {
    let mut out = Vec::new();
    let name = match s.kind {
        SubhingeKind::Screw { axis, pitch } => {
            Thread { axis, pitch }.write_fields(&mut out);
            "Screw"
        }
        SubhingeKind::Pin { axis } => {
            Axis { axis }.write_fields(&mut out);
            "Pin"
        }
        SubhingeKind::Slider { axis } => {
            Axis { axis }.write_fields(&mut out);
            "Slider"
        }
        SubhingeKind::Ball => "Ball",
        SubhingeKind::Free => "Free",
        SubhingeKind::Locked => "Locked",
    };
    let drive = Drive {
        prescribed: (s.coordinate == Coordinate::Prescribed).then_some(true),
        armature: Some(s.armature).filter(|x| *x != 0.0),
        gear: Some(s.gear).filter(|x| *x != 1.0),
        limits: written_limits(s),
        spring: Some(s.spring).filter(|s| *s != Spring::NONE),
        stop: Some(s.stop).filter(|s| *s != Stop::Usual),
        damping: Some(s.damping).filter(|x| *x != 0.0),
        friction: Some(s.friction).filter(|f| *f != Friction::NONE),
    };
    drive.write_fields(&mut out);
    if out.is_empty() { variant(name, Value::Null) } else { variant(name, Value::Map(out)) }
}
