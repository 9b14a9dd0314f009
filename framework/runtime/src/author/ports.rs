//! Ports: plain structs seen as flat lanes of `f64`, with names, units, bindings and documentation.
use crate::author::account::Account;
use crate::author::units::Unit;
use linkwork_spatial::nalgebra::{Quaternion, UnitQuaternion};
use linkwork_spatial::{Quat, Vec3};
use std::borrow::Cow;

pub use linkwork_integrate::events::Direction;

/// A name, unit or doc string of a description: written in a Rust type, or made when a part is built.
pub type Text = Cow<'static, str>;

/// Kind of the values of a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PortKind {
    /// One or more numbers in one unit.
    Numbers,
    /// True or false.
    Bool,
    /// A vector of three numbers.
    Vector,
    /// A unit quaternion [x, y, z, w].
    Quaternion,
    /// Pose and velocity of a node in W.
    NodeState,
    /// Acceleration of a node in W.
    NodeAccel,
    /// Moment and force at a node in W.
    Wrench,
    /// Mass, first moment and inertia that are added to a body, about a node.
    AddedMass,
    /// Mass, centre of mass and inertia of a body, seen from a node.
    BodyMass,
    /// Mass, centre of mass and inertia of a vehicle, seen from a node.
    VehicleMass,
    /// Contact force on a body, and the point at which it acts.
    ContactLoad,
    /// Sum of the normal forces of the contacts of a body in a zone at a node; the port has the zone ([`PortSpec::zone`]).
    ContactNormal,
    /// Force and moment that a hinge transmits to its body.
    HingeLoad,
    /// Traction of the ground on a slowly slipping wheel.
    Traction,
    /// Angle and rate of a hinge coordinate.
    HingeState,
    /// Generalised force on a hinge coordinate.
    HingeTorque,
    /// Prescribed acceleration of a hinge coordinate.
    HingeAccel,
    /// Rotation and angular velocity of a ball hinge.
    BallState,
    /// Torque on a ball hinge.
    BallTorque,
    /// Velocity of the surface of a body relative to the body.
    SurfaceVelocity,
}

/// A solid at the origin of a node, in the axes of the node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ContactZone {
    /// Half axes, m.
    Ellipsoid([f64; 3]),
    /// Half edges, m.
    Box([f64; 3]),
    /// Around z: radius, and half of the length, m.
    Cylinder([f64; 2]),
    /// Around z: radius, and half of the length between the centres of its ends, m.
    Capsule([f64; 2]),
}

/// Description of a port or of a state field.
#[derive(Clone, Debug)]
pub struct PortSpec {
    /// Name.
    pub name: Text,
    /// Kind of its values.
    pub kind: PortKind,
    /// Number of lanes.
    pub lanes: usize,
    /// Unit as written; empty for composite kinds.
    pub unit: Text,
    /// Unit that replaces `unit` if the part acts on a slider: coordinates are lengths there, and torques are forces.
    pub slider: Option<Text>,
    /// The part acts on a slider, so the lanes of hinge states, torques and accelerations have units of lengths and forces.
    pub slides: bool,
    /// Meaning.
    pub doc: Text,
    /// Value without a wire; `None`: a wire is required.
    pub default: Option<Vec<f64>>,
    /// Several wires may end here; their values are summed in path order.
    pub sum: bool,
    /// Name of the binding (node or hinge) that serves this port.
    pub bind: Option<Text>,
    /// Frame tag; it must equal the tag of the other end if both are given.
    pub frame: Option<Text>,
    /// The side from which a guard must reach zero for an event.
    pub direction: Direction,
    /// For a node of a wheel or rotor: its axis of rotation, in the node's axes.
    pub axle: Option<[f64; 3]>,
    /// The zone at the node, which a port of the kind [`PortKind::ContactNormal`] has.
    pub zone: Option<ContactZone>,
    /// The connector that the port belongs to: `supply` for `supply.voltage` and `supply.current`.
    pub connector: Option<Text>,
    /// Role of the port in the balances of its part.
    pub account: Option<Account>,
}

impl PortSpec {
    /// Constructor for the derive macro.
    pub fn new<T: Lane>(
        name: &'static str,
        unit: Option<&'static str>,
        doc: &'static str,
        default: Option<Vec<f64>>,
        sum: bool,
        bind: Option<&'static str>,
        frame: Option<&'static str>,
    ) -> Self {
        PortSpec {
            name: name.into(),
            kind: T::KIND,
            lanes: T::N,
            unit: unit.unwrap_or(T::UNIT).into(),
            slider: None,
            slides: false,
            doc: doc.into(),
            default,
            sum,
            bind: bind.map(Text::from),
            frame: frame.map(Text::from),
            direction: Direction::Either,
            axle: None,
            zone: None,
            connector: None,
            account: None,
        }
    }

    /// Creates a port whose name is chosen when its part is built; it is required and not bound.
    pub fn named(name: impl Into<Text>, kind: PortKind, lanes: usize) -> Self {
        PortSpec {
            name: name.into(),
            kind,
            lanes,
            unit: Text::Borrowed(""),
            slider: None,
            slides: false,
            doc: Text::Borrowed(""),
            default: None,
            sum: false,
            bind: None,
            frame: None,
            direction: Direction::Either,
            axle: None,
            zone: None,
            connector: None,
            account: None,
        }
    }

    /// Returns the ports of a struct under a group name: `wheels[2].rate` for `rate` under `wheels[2]`. One wire joins
    /// all of them. `doc` describes the struct as a whole.
    pub fn group<T: Lanes>(name: impl Into<Text>, doc: &str) -> Vec<PortSpec> {
        let name = name.into();
        let doc = doc.trim_end_matches('.');
        let mut specs = T::specs();
        for spec in &mut specs {
            spec.name = below(&name, &spec.name);
            spec.doc = format!("{doc}: {}", spec.doc).into();
        }
        specs
    }

    /// The ports of one direction of a connector. A connector is a group of inputs and outputs that belong together: a model names it in both its
    /// input struct and its output struct. One `connect` statement joins all of its ports (`framework/runtime/src/compile/connectors.rs`).
    pub fn connector<T: Lanes>(name: impl Into<Text>, doc: &str) -> Vec<PortSpec> {
        let name = name.into();
        let mut specs = PortSpec::group::<T>(name.clone(), doc);
        specs.iter_mut().for_each(|spec| spec.connector = Some(name.clone()));
        specs
    }

    /// Sets the unit.
    #[must_use]
    pub fn unit_of(mut self, unit: impl Into<Text>) -> Self {
        self.unit = unit.into();
        self
    }

    /// Sets the documentation.
    #[must_use]
    pub fn doc_of(mut self, doc: impl Into<Text>) -> Self {
        self.doc = doc.into();
        self
    }

    /// Permits several wires, whose values are summed.
    #[must_use]
    pub fn summed(mut self) -> Self {
        self.sum = true;
        self
    }

    /// Sets a default, the same for every value, for an input without a wire.
    #[must_use]
    pub fn or(mut self, value: f64) -> Self {
        self.default = Some(vec![value; self.lanes]);
        self
    }

    /// Sets the direction of a guard.
    #[must_use]
    pub fn when(mut self, direction: Direction) -> Self {
        self.direction = direction;
        self
    }

    /// Sets the axis of rotation of a node.
    #[must_use]
    pub fn about(mut self, axle: [f64; 3]) -> Self {
        self.axle = Some(axle);
        self
    }

    /// Counted in the balances of the part: an amount that it stores (J, kg, C), or a rate at which it gains or loses (W, kg/s, A).
    #[must_use]
    pub fn counted(mut self, account: Account) -> Self {
        self.account = Some(account);
        self
    }

    /// Sets the unit that applies if the part acts on a slider.
    #[must_use]
    pub fn on_slider(mut self, unit: &'static str) -> Self {
        self.slider = Some(unit.into());
        self
    }

    /// Changes the units to the units of a part on a slider.
    pub(crate) fn slide(&mut self) {
        self.slides = true;
        if let Some(unit) = self.slider.take() {
            self.unit = unit;
        }
    }

    /// Returns the parsed unit; composite kinds have none.
    pub fn unit(&self) -> Unit {
        Unit::parse(&self.unit).unwrap_or(Unit::ONE)
    }

    /// Returns name and unit of each lane, relative to the port: `("", "V")`, `(".x", "m")`.
    pub fn lane_names(&self) -> Vec<(String, Text)> {
        let none = Text::Borrowed("");
        let xyz = |stem: &str, unit: &'static str| {
            ["x", "y", "z"].map(|c| (format!("{stem}.{c}"), Text::from(unit)))
        };
        let quat = |stem: &str| ["x", "y", "z", "w"].map(|c| (format!("{stem}.{c}"), none.clone()));
        let unit = || self.unit.clone();
        match self.kind {
            PortKind::Bool => vec![(String::new(), none)],
            PortKind::Numbers if self.lanes == 1 => vec![(String::new(), unit())],
            PortKind::Numbers => (0..self.lanes).map(|k| (format!("[{k}]"), unit())).collect(),
            PortKind::Vector => ["x", "y", "z"].map(|c| (format!(".{c}"), unit())).to_vec(),
            PortKind::Quaternion => quat("").to_vec(),
            PortKind::NodeState => {
                let mut v = xyz(".position", "m").to_vec();
                v.extend(quat(".rotation"));
                v.extend(xyz(".angular", "rad/s"));
                v.extend(xyz(".velocity", "m/s"));
                v
            }
            PortKind::NodeAccel => {
                let mut v = xyz(".angular", "rad/s^2").to_vec();
                v.extend(xyz(".linear", "m/s^2"));
                v
            }
            PortKind::Wrench => {
                let mut v = xyz(".moment", "N m").to_vec();
                v.extend(xyz(".force", "N"));
                v
            }
            PortKind::ContactLoad => {
                let mut v = xyz(".force", "N").to_vec();
                v.extend(xyz(".point", "m"));
                v
            }
            PortKind::ContactNormal => vec![(String::new(), Text::from("N"))],
            PortKind::HingeLoad => {
                let mut v = xyz(".force", "N").to_vec();
                v.extend(xyz(".moment", "N m"));
                v
            }
            PortKind::Traction => {
                let mut v = xyz(".force", "N").to_vec();
                v.extend(xyz(".moment", "N m"));
                let names = ["ahead", "side"];
                v.extend(names.map(|c| (format!(".resistance.{c}"), "N s/m".into())));
                v.extend(names.map(|c| (format!(".limit.{c}"), "N".into())));
                v.push((".sinkage".into(), "m".into()));
                v
            }
            PortKind::AddedMass => {
                let mut v = vec![(".mass".into(), Text::from("kg"))];
                v.extend(xyz(".first_moment", "kg m"));
                let names = ["xx", "yy", "zz", "xy", "xz", "yz"];
                v.extend(names.map(|c| (format!(".inertia.{c}"), "kg m^2".into())));
                v
            }
            PortKind::BodyMass | PortKind::VehicleMass => {
                let mut v = vec![(".mass".into(), Text::from("kg"))];
                v.extend(xyz(".com", "m"));
                let names = ["xx", "yy", "zz", "xy", "xz", "yz"];
                v.extend(names.map(|c| (format!(".inertia.{c}"), "kg m^2".into())));
                v
            }
            PortKind::HingeState if self.slides => {
                vec![(".angle".into(), "m".into()), (".rate".into(), "m/s".into())]
            }
            PortKind::HingeTorque if self.slides => vec![(String::new(), "N".into())],
            PortKind::HingeAccel if self.slides => vec![(String::new(), "m/s^2".into())],
            PortKind::HingeState => {
                vec![(".angle".into(), "rad".into()), (".rate".into(), "rad/s".into())]
            }
            PortKind::HingeTorque => vec![(String::new(), "N m".into())],
            PortKind::HingeAccel => vec![(String::new(), "rad/s^2".into())],
            PortKind::BallState => {
                let mut v = quat(".rotation").to_vec();
                v.extend(xyz(".rate", "rad/s"));
                v
            }
            PortKind::BallTorque => xyz("", "N m").to_vec(),
            PortKind::SurfaceVelocity => xyz("", "m/s").to_vec(),
        }
    }
}

/// Joins `wheels[2]` and `rate`, or `wheels` and `[2].rate`, into one name.
fn below(outer: &str, inner: &str) -> Text {
    let dot = if inner.starts_with('[') { "" } else { "." };
    format!("{outer}{dot}{inner}").into()
}

/// A field type: a fixed number of lanes.
pub trait Lane: Copy {
    /// Number of lanes.
    const N: usize;
    /// Kind of its values.
    const KIND: PortKind;
    /// Unit of ports without a declared unit.
    const UNIT: &'static str = "";
    /// Reads the value from contiguous lanes.
    fn get(s: &[f64]) -> Self;
    /// Into contiguous lanes.
    fn put(&self, s: &mut [f64]);
    /// Reads the value from scattered lanes.
    fn gather(sig: &[f64], idx: &[u32]) -> Self;
    /// Returns the lanes as a vector, for defaults.
    fn lanes_of(v: &Self) -> Vec<f64> {
        let mut out = vec![0.0; Self::N];
        v.put(&mut out);
        out
    }
}

/// A struct of lanes (derive it with `Ports` or `State`).
pub trait Lanes: Sized + Send + Sync + 'static {
    /// Number of lanes.
    const N: usize;
    /// The fields.
    fn specs() -> Vec<PortSpec>;
    /// Reads the value from contiguous lanes.
    fn get(s: &[f64]) -> Self;
    /// Into contiguous lanes.
    fn put(&self, s: &mut [f64]);
    /// Reads the value from scattered lanes.
    fn gather(sig: &[f64], idx: &[u32]) -> Self;
    /// All lanes zero (quaternions: unit).
    fn zero() -> Self {
        let mut lanes = vec![0.0; Self::N];
        let mut o = 0;
        for spec in Self::specs() {
            if let Some(w) = match spec.kind {
                PortKind::Quaternion | PortKind::BallState => Some(o + 3),
                PortKind::NodeState => Some(o + 6),
                _ => None,
            } {
                lanes[w] = 1.0;
            }
            o += spec.lanes;
        }
        Self::get(&lanes)
    }
}

impl Lanes for () {
    const N: usize = 0;
    fn specs() -> Vec<PortSpec> {
        Vec::new()
    }
    #[inline(always)]
    fn get(_: &[f64]) {}
    #[inline(always)]
    fn put(&self, _: &mut [f64]) {}
    #[inline(always)]
    fn gather(_: &[f64], _: &[u32]) {}
}

/// `[0].rate`, `[1].rate`, …
impl<T: Lanes, const M: usize> Lanes for [T; M] {
    const N: usize = M * T::N;
    fn specs() -> Vec<PortSpec> {
        let element = |k: usize| {
            let mut specs = T::specs();
            specs.iter_mut().for_each(|spec| spec.name = below(&format!("[{k}]"), &spec.name));
            specs
        };
        (0..M).flat_map(element).collect()
    }
    #[inline(always)]
    fn get(s: &[f64]) -> Self {
        std::array::from_fn(|k| T::get(&s[k * T::N..][..T::N]))
    }
    #[inline(always)]
    fn put(&self, s: &mut [f64]) {
        for (k, element) in self.iter().enumerate() {
            element.put(&mut s[k * T::N..][..T::N]);
        }
    }
    #[inline(always)]
    fn gather(sig: &[f64], idx: &[u32]) -> Self {
        std::array::from_fn(|k| T::gather(sig, &idx[k * T::N..][..T::N]))
    }
}

impl Lane for f64 {
    const N: usize = 1;
    const KIND: PortKind = PortKind::Numbers;
    #[inline(always)]
    fn get(s: &[f64]) -> f64 {
        s[0]
    }
    #[inline(always)]
    fn put(&self, s: &mut [f64]) {
        s[0] = *self;
    }
    #[inline(always)]
    fn gather(sig: &[f64], idx: &[u32]) -> f64 {
        sig[idx[0] as usize]
    }
}

impl Lane for bool {
    const N: usize = 1;
    const KIND: PortKind = PortKind::Bool;
    #[inline(always)]
    fn get(s: &[f64]) -> bool {
        s[0] > 0.5
    }
    #[inline(always)]
    fn put(&self, s: &mut [f64]) {
        s[0] = f64::from(u8::from(*self));
    }
    #[inline(always)]
    fn gather(sig: &[f64], idx: &[u32]) -> bool {
        sig[idx[0] as usize] > 0.5
    }
}

impl<const M: usize> Lane for [f64; M] {
    const N: usize = M;
    const KIND: PortKind = PortKind::Numbers;
    #[inline(always)]
    fn get(s: &[f64]) -> Self {
        std::array::from_fn(|k| s[k])
    }
    #[inline(always)]
    fn put(&self, s: &mut [f64]) {
        s[..M].copy_from_slice(self);
    }
    #[inline(always)]
    fn gather(sig: &[f64], idx: &[u32]) -> Self {
        let idx = &idx[..M];
        std::array::from_fn(|k| sig[idx[k] as usize])
    }
}

impl Lane for Vec3 {
    const N: usize = 3;
    const KIND: PortKind = PortKind::Vector;
    #[inline(always)]
    fn get(s: &[f64]) -> Self {
        <[f64; 3]>::get(s).into()
    }
    #[inline(always)]
    fn put(&self, s: &mut [f64]) {
        [self.x, self.y, self.z].put(s);
    }
    #[inline(always)]
    fn gather(sig: &[f64], idx: &[u32]) -> Self {
        <[f64; 3]>::gather(sig, idx).into()
    }
}

impl Lane for Quat {
    const N: usize = 4;
    const KIND: PortKind = PortKind::Quaternion;
    #[inline(always)]
    fn get(s: &[f64]) -> Self {
        UnitQuaternion::new_unchecked(Quaternion::new(s[3], s[0], s[1], s[2]))
    }
    #[inline(always)]
    fn put(&self, s: &mut [f64]) {
        [self.i, self.j, self.k, self.w].put(s);
    }
    #[inline(always)]
    fn gather(sig: &[f64], idx: &[u32]) -> Self {
        Self::get(&<[f64; 4]>::gather(sig, idx))
    }
}

/// A composite port type: fields that are lanes themselves.
macro_rules! composite {
    ($(#[$doc:meta])* $name:ident, $kind:ident, $n:expr, { $($(#[$fdoc:meta])* $field:ident : $ty:ty = $at:expr),* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $name { $($(#[$fdoc])* pub $field: $ty),* }
        impl Lane for $name {
            const N: usize = $n;
            const KIND: PortKind = PortKind::$kind;
            #[inline(always)]
            fn get(s: &[f64]) -> Self {
                let s = &s[..$n];
                Self { $($field: <$ty as Lane>::get(&s[$at..$at + <$ty as Lane>::N])),* }
            }
            #[inline(always)]
            fn put(&self, s: &mut [f64]) {
                let s = &mut s[..$n];
                $(self.$field.put(&mut s[$at..$at + <$ty as Lane>::N]);)*
            }
            #[inline(always)]
            fn gather(sig: &[f64], idx: &[u32]) -> Self {
                let idx = &idx[..$n];
                Self { $($field: <$ty as Lane>::gather(sig, &idx[$at..$at + <$ty as Lane>::N])),* }
            }
        }
    };
}

composite!(
    /// Pose and velocity of a node N in W.
    NodeState, NodeState, 13, {
        /// Position of the node's origin, W (m).
        position: Vec3 = 0,
        /// Rotation R_WN.
        rotation: Quat = 3,
        /// Angular velocity, W axes (rad/s).
        angular: Vec3 = 7,
        /// Velocity of the node's origin, W axes (m/s).
        velocity: Vec3 = 10
    }
);
composite!(
    /// Acceleration of a node in W, without subtraction of gravity.
    NodeAccel, NodeAccel, 6, {
        /// Angular acceleration, W axes (rad/s²).
        angular: Vec3 = 0,
        /// Acceleration of the node's origin, W axes (m/s²).
        linear: Vec3 = 3
    }
);
composite!(
    /// Moment and force on a body at a node, W axes.
    Wrench, Wrench, 6, {
        /// Moment about the node's origin (N m).
        moment: Vec3 = 0,
        /// Force (N).
        force: Vec3 = 3
    }
);
composite!(
    /// Contact load of a body: from the ground and other bodies, by contact or, for a machine with prescribed kinematics, under its wheels. W axes.
    ContactLoad, ContactLoad, 6, {
        /// Sum of the forces on the body (N).
        force: Vec3 = 0,
        /// Point at which the force acts, weighted by normal forces, W (m); without contact the origin of the body.
        point: Vec3 = 3
    }
);
composite!(
    /// Force and moment on a body through its hinge, about the origin and in the axes of the hinge's frame on the body.
    HingeLoad, HingeLoad, 6, {
        /// Force (N).
        force: Vec3 = 0,
        /// Moment (N m).
        moment: Vec3 = 3
    }
);
composite!(
    /// Traction of the ground on a wheel of a quasi-static machine, linearized at the current slip. One model gives it for each wheel.
    Traction, Traction, 11, {
        /// Force on the wheel without sliding of its rim, minus the normal force, W axes (N).
        force: Vec3 = 0,
        /// Moment in addition to the moment of the forces at its contact point, W axes (N m).
        moment: Vec3 = 3,
        /// Resistance against sliding of its rim: force per sliding speed, forward and sideways along the ground (N s/m).
        resistance: [f64; 2] = 6,
        /// Greatest such force forward and sideways, as half axes of an ellipse (N).
        limit: [f64; 2] = 8,
        /// Depth of the wheel in the ground, along the ground normal (m).
        sinkage: f64 = 10
    }
);
composite!(
    /// Mass that is added to a body during the run (propellant, cargo): its moments about a node N of the body, N axes. All masses that are added to
    /// one body are summed.
    ///
    /// At each instant the mechanism moves like a body with these moments: mass that leaves it has the velocity of its last position, and so exerts
    /// no force. A part through which mass flows must apply the force and moment of the flow as a wrench (thrust, jet damping).
    AddedMass, AddedMass, 10, {
        /// Mass (kg).
        mass: f64 = 0,
        /// First moment: mass times position of its centre relative to N (kg m).
        first_moment: Vec3 = 1,
        /// Inertia about N: xx, yy, zz, xy, xz, yz, with −∫ x y dm off the diagonal (kg m²).
        inertia: [f64; 6] = 4
    }
);
composite!(
    /// Mass properties of the body of a node N as specified, without mass that is added during the run; N axes.
    BodyMass, BodyMass, 10, {
        /// Mass (kg).
        mass: f64 = 0,
        /// Centre of mass, from N (m).
        com: Vec3 = 1,
        /// Inertia about the centre of mass: xx, yy, zz, xy, xz, yz, with −∫ x y dm off the diagonal (kg m²).
        inertia: [f64; 6] = 4
    }
);
composite!(
    /// The vehicle of a node N at this instant: all bodies of its tree, up to the root body that is attached to the world, with mass that wires add;
    /// N axes.
    VehicleMass, VehicleMass, 10, {
        /// Mass (kg).
        mass: f64 = 0,
        /// Centre of mass, from N (m).
        com: Vec3 = 1,
        /// Inertia about the centre of mass: xx, yy, zz, xy, xz, yz, with −∫ x y dm off the diagonal (kg m²).
        inertia: [f64; 6] = 4
    }
);
composite!(
    /// A one-dof hinge coordinate (sliders: m and m/s).
    HingeState, HingeState, 2, {
        /// Angle (rad).
        angle: f64 = 0,
        /// Rate (rad/s).
        rate: f64 = 1
    }
);

composite!(
    /// A ball hinge.
    BallState, BallState, 7, {
        /// Rotation of the hinge's frame on the body in its frame on the parent.
        rotation: Quat = 0,
        /// Angular velocity of the body in its parent, axes of the hinge's frame on the body (rad/s).
        rate: Vec3 = 4
    }
);
composite!(
    /// The torque on a body at its ball hinge, axes of the hinge's frame on the body; the opposite acts on the parent.
    BallTorque, BallTorque, 3, {
        /// Torque (N m).
        torque: Vec3 = 0
    }
);
composite!(
    /// The velocity of the surface of a body relative to the body, axes of the body. It acts along the surface wherever colliders of the body touch
    /// others.
    SurfaceVelocity, SurfaceVelocity, 3, {
        /// Velocity (m/s).
        velocity: Vec3 = 0
    }
);

/// A generalised force on a hinge coordinate (N m) (sliders: N).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HingeTorque(pub f64);
/// The acceleration that a prescribed hinge coordinate follows (rad/s²) (sliders: m/s²).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HingeAccel(pub f64);

macro_rules! newtype {
    ($name:ident, $kind:ident, $unit:literal) => {
        impl Lane for $name {
            const N: usize = 1;
            const KIND: PortKind = PortKind::$kind;
            const UNIT: &'static str = $unit;
            #[inline(always)]
            fn get(s: &[f64]) -> Self {
                $name(s[0])
            }
            #[inline(always)]
            fn put(&self, s: &mut [f64]) {
                s[0] = self.0;
            }
            #[inline(always)]
            fn gather(sig: &[f64], idx: &[u32]) -> Self {
                $name(sig[idx[0] as usize])
            }
        }
    };
}
newtype!(HingeTorque, HingeTorque, "N m");
newtype!(HingeAccel, HingeAccel, "rad/s^2");
