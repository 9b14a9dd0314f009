//! The ports of a mechanism: only those that bindings request.
use crate::frame::Frame;
use crate::zone::Zone;
use linkwork_multibody::{BodyId, Coordinate, Multibody, Subhinge, SubhingeKind};
use linkwork_runtime::{
    BindTarget, Bound, Description, Fault, HostWire, Lane, Lowering, PortKind, PortSpec, Traction,
    VehicleMass, remedy,
};
use std::collections::BTreeSet;

/// Inputs and outputs of the mechanism, each list in the order of its signals.
#[derive(Clone, Debug, Default)]
pub struct MechanismPorts {
    /// Frames whose pose and velocity are read (13 lanes each).
    pub states: Vec<Frame>,
    /// Hinge coordinates that are read: index in q, index in v (2 lanes each).
    pub hinges: Vec<(u32, u32)>,
    /// Loop motions that are read (2 lanes each).
    pub loop_states: Vec<u32>,
    /// Frames from which the mass of their bodies is read (10 lanes each).
    pub bodies: Vec<Frame>,
    /// Frames whose acceleration is read (6 lanes each).
    pub accels: Vec<Frame>,
    /// Bodies whose contact is read (6 lanes each).
    pub contacts: Vec<BodyId>,
    /// Bodies whose hinge load is read (6 lanes each).
    pub loads: Vec<BodyId>,
    /// Frames of which the mass of the vehicle is read (10 lanes each).
    pub vehicles: Vec<Frame>,
    /// Frames about which mass is added to their bodies (10 lanes each).
    pub masses: Vec<Frame>,
    /// Frames on which wrenches act (6 lanes each).
    pub wrenches: Vec<Frame>,
    /// Balls that are read: indices of their rotation in q and of their rate in v (7 lanes each).
    pub balls: Vec<(u32, u32)>,
    /// Indices in v on which torques act.
    pub torques: Vec<u32>,
    /// First indices in v of balls on which torques act (3 lanes each).
    pub ball_torques: Vec<u32>,
    /// Bodies whose surface moves relative to them (3 lanes each).
    pub surfaces: Vec<BodyId>,
    /// Indices in v whose acceleration is prescribed.
    pub motions: Vec<u32>,
    /// Loop motions whose acceleration is prescribed.
    pub loop_motions: Vec<u32>,
    /// Wheels whose traction is known (11 lanes each).
    pub tractions: Vec<BodyId>,
    /// Zones of bodies in which normal forces are summed (1 lane each).
    pub zones: Vec<Zone>,
}

/// A binding target, found.
enum Target {
    Node(Frame),
    Hinge { q: u32, v: u32, kind: SubhingeKind },
    Ball { q: u32, v: u32 },
    Loop(u32),
}

/// Names of the existing ports.
type PortNames = BTreeSet<String>;

/// Adds an entry to a list if the port of that name does not exist yet.
fn add<T>(known: &mut PortNames, list: &mut Vec<T>, item: T, name: String) -> String {
    if !known.contains(&name) {
        known.insert(name.clone());
        list.push(item);
    }
    name
}

/// Creates ports and wires for bindings.
pub(crate) fn lower(mb: &Multibody, bound: &[Bound<'_>], out: &mut Lowering<'_>) -> MechanismPorts {
    let prescribed = mb.prescribed();
    let (mut ports, mut known) = (MechanismPorts::default(), PortNames::new());
    for b in bound {
        let (part, bind, origin) = (&b.spec.part, &b.spec.bind, b.spec.origin);
        let ball = |p: &PortSpec| matches!(p.kind, PortKind::BallState | PortKind::BallTorque);
        let wants = if b.ports.iter().any(|(p, _)| ball(p)) { Wants::Ball } else { Wants::Any };
        let target = match resolve(mb, &b.spec.target, wants) {
            Ok(target) => target,
            Err((fact, help)) => {
                let fact = format!("`{part}`: binding `{bind}`: {fact}");
                out.faults.push(Fault::new(origin, fact).help(help));
                continue;
            }
        };
        let label = match &b.spec.target {
            BindTarget::Node(n) => format!("node {n}"),
            BindTarget::Hinge { body, .. } => format!("hinge {body}"),
            BindTarget::Loop { name, .. } => format!("loop {name}"),
            BindTarget::Field(path) => format!("field {path}"),
        };
        for (port, end) in &b.ports {
            if let Target::Hinge { v, .. } | Target::Ball { v, .. } = &target {
                constraint_method(b, (port, prescribed[*v as usize]), &label, out);
            }
            quantity(mb, b, (port, &target), out);
            if let (Some(axle), Target::Node(frame)) = (port.axle, &target) {
                crate::axle::check(mb, b, (axle, *frame), &label, out);
            }
            match ports.serve(mb, port, &target, &mut known) {
                Ok(host_port) => out.wires.push(HostWire {
                    host_port,
                    end: *end,
                    part: part.clone(),
                    port: port.name.to_string(),
                    label: label.clone(),
                    origin,
                }),
                Err(wants) => {
                    out.faults.push(
                        Fault::new(
                            origin,
                            format!("`{part}`: binding `{bind}` is served by a {wants}, but `{label}` is not one"),
                        )
                        .help(format!("write `\"{bind}\": \"{wants}:…\"`")),
                    );
                    break;
                }
            }
        }
    }
    ports
}

/// Reports a torque on a prescribed coordinate and an acceleration of a free one, because neither has an effect.
fn constraint_method(
    b: &Bound<'_>,
    (port, prescribed): (&PortSpec, bool),
    label: &str,
    out: &mut Lowering<'_>,
) {
    let (part, bind, origin) = (&b.spec.part, &b.spec.bind, b.spec.origin);
    match port.kind {
        PortKind::HingeTorque | PortKind::BallTorque if prescribed => {
            let fact = format!(
                "`{part}`: binding `{bind}`: `{label}` is prescribed, so the torque has no effect"
            );
            let help =
                "remove `prescribed` from the hinge, or bind a part that prescribes its motion";
            out.warnings.push(Fault::new(origin, fact).help(help));
        }
        PortKind::HingeAccel if !prescribed => {
            let fact = format!(
                "`{part}`: binding `{bind}`: it prescribes the motion of `{label}`, which is free"
            );
            out.faults.push(Fault::new(origin, fact).help("write `prescribed: true` in its hinge"));
        }
        _ => {}
    }
}

/// Returns the kind of the coordinate, for targets that are one coordinate.
fn kind_of(mb: &Multibody, at: &Target) -> Option<SubhingeKind> {
    match at {
        Target::Hinge { kind, .. } => Some(*kind),
        Target::Loop(i) => {
            mb.loops().iter().find(|l| l.motions.contains(&(*i as usize))).and_then(|l| {
                let given = |s: &&Subhinge| s.coordinate == Coordinate::Prescribed;
                let which = *i as usize - l.motions.start;
                l.closure.hinge.subhinges.iter().filter(given).nth(which).map(|s| s.kind)
            })
        }
        Target::Node(_) | Target::Ball { .. } => None,
    }
}

/// Returns whether a target is a coordinate that is a length; `None` if it is not one coordinate.
pub(crate) fn slides(mb: &Multibody, target: &BindTarget) -> Option<bool> {
    let at = resolve(mb, target, Wants::Any).ok()?;
    kind_of(mb, &at).map(|kind| matches!(kind, SubhingeKind::Slider { .. }))
}

/// Checks that a hinge has the unit that the part declares, because the part would otherwise read an angle as metres.
fn quantity(
    mb: &Multibody,
    b: &Bound<'_>,
    (port, at): (&PortSpec, &Target),
    out: &mut Lowering<'_>,
) {
    if port.kind != PortKind::HingeState || port.unit.is_empty() {
        return;
    }
    let Some(kind) = kind_of(mb, at) else { return };
    let (is, moves) = match kind {
        SubhingeKind::Slider { .. } => ("a slider", "m"),
        _ => ("a pin or screw", "rad"),
    };
    if port.unit != moves {
        let (part, bind) = (&b.spec.part, &b.spec.bind);
        let fact = format!(
            "`{part}`: binding `{bind}` is for coordinates in {}, but this is {is}",
            port.unit
        );
        let help = format!("use a model for coordinates in {moves}");
        out.faults.push(Fault::new(b.spec.origin, fact).help(help));
    }
}

impl MechanismPorts {
    /// Returns the name of the port that serves this one; the error names the kind of target that is required.
    fn serve(
        &mut self,
        mb: &Multibody,
        port: &PortSpec,
        at: &Target,
        known: &mut PortNames,
    ) -> Result<String, &'static str> {
        Ok(match (port.kind, at) {
            (PortKind::NodeState, Target::Node(f)) => {
                add(known, &mut self.states, *f, name("state", *f))
            }
            (PortKind::NodeAccel, Target::Node(f)) => {
                add(known, &mut self.accels, *f, name("accel", *f))
            }
            (PortKind::BodyMass, Target::Node(f)) => {
                add(known, &mut self.bodies, *f, name("body", *f))
            }
            (PortKind::ContactLoad, Target::Node(f)) => {
                let body = f.body(mb);
                add(known, &mut self.contacts, body, format!("contact:body:{}", body.index()))
            }
            (PortKind::ContactNormal, Target::Node(f)) => {
                let (zone, name) = Zone::of(port, *f).ok_or("node with a zone")?;
                add(known, &mut self.zones, zone, name)
            }
            (PortKind::HingeLoad, Target::Node(f)) => {
                let body = f.body(mb);
                add(known, &mut self.loads, body, format!("load:body:{}", body.index()))
            }
            (PortKind::VehicleMass, Target::Node(f)) => {
                add(known, &mut self.vehicles, *f, name("vehicle", *f))
            }
            (PortKind::Traction, Target::Node(f)) => {
                let body = f.body(mb);
                add(known, &mut self.tractions, body, format!("traction:body:{}", body.index()))
            }
            (PortKind::AddedMass, Target::Node(f)) => {
                add(known, &mut self.masses, *f, name("mass", *f))
            }
            (PortKind::Wrench, Target::Node(f)) => {
                add(known, &mut self.wrenches, *f, name("wrench", *f))
            }
            (PortKind::HingeState, Target::Hinge { q, v, .. }) => {
                add(known, &mut self.hinges, (*q, *v), format!("hinge:{v}"))
            }
            (PortKind::HingeTorque, Target::Hinge { v, .. }) => {
                add(known, &mut self.torques, *v, format!("torque:{v}"))
            }
            (PortKind::BallState, Target::Ball { q, v }) => {
                add(known, &mut self.balls, (*q, *v), format!("ball:{v}"))
            }
            (PortKind::BallTorque, Target::Ball { v, .. }) => {
                add(known, &mut self.ball_torques, *v, format!("ball_torque:{v}"))
            }
            (PortKind::SurfaceVelocity, Target::Node(f)) => {
                let body = f.body(mb);
                add(known, &mut self.surfaces, body, format!("surface:body:{}", body.index()))
            }
            (PortKind::HingeAccel, Target::Hinge { v, .. }) => {
                add(known, &mut self.motions, *v, format!("motion:{v}"))
            }
            (PortKind::HingeAccel, Target::Loop(i)) => {
                add(known, &mut self.loop_motions, *i, format!("loop_motion:{i}"))
            }
            (PortKind::HingeState, Target::Loop(i)) => {
                add(known, &mut self.loop_states, *i, format!("loop:{i}"))
            }
            (
                PortKind::NodeState
                | PortKind::NodeAccel
                | PortKind::Wrench
                | PortKind::AddedMass
                | PortKind::BodyMass
                | PortKind::Traction
                | PortKind::ContactLoad
                | PortKind::ContactNormal
                | PortKind::SurfaceVelocity
                | PortKind::HingeLoad
                | PortKind::VehicleMass,
                _,
            ) => {
                return Err("node");
            }
            _ => return Err("hinge"),
        })
    }

    /// Adds the ports to a description, in the order of their lanes.
    pub(crate) fn describe(&self, d: &mut Description) {
        let outputs = &mut d.outputs;
        outputs.extend(self.states.iter().map(|f| port("state", *f, PortKind::NodeState, 13)));
        outputs.extend(self.hinges.iter().map(|(_, v)| hinge_state(format!("hinge:{v}"))));
        outputs.extend(self.loop_states.iter().map(|i| hinge_state(format!("loop:{i}"))));
        let ball = |v: &u32| PortSpec::named(format!("ball:{v}"), PortKind::BallState, 7);
        outputs.extend(self.balls.iter().map(|(_, v)| ball(v)));
        outputs.extend(self.bodies.iter().map(|f| port("body", *f, PortKind::BodyMass, 10)));
        let inputs = &mut d.feedthrough_inputs;
        let mass = |f: &Frame| port("mass", *f, PortKind::AddedMass, 10).summed();
        inputs.extend(self.masses.iter().map(mass));
        let wrench = |f: &Frame| port("wrench", *f, PortKind::Wrench, 6).summed();
        inputs.extend(self.wrenches.iter().map(wrench));
        let torque =
            |v: &u32| PortSpec::named(format!("torque:{v}"), PortKind::HingeTorque, 1).summed();
        inputs.extend(self.torques.iter().map(torque));
        let torque =
            |v: &u32| PortSpec::named(format!("ball_torque:{v}"), PortKind::BallTorque, 3).summed();
        inputs.extend(self.ball_torques.iter().map(torque));
        let surface = |b: &BodyId| {
            PortSpec::named(format!("surface:body:{}", b.index()), PortKind::SurfaceVelocity, 3)
        };
        inputs.extend(self.surfaces.iter().map(surface));
        let motion = |name: String| PortSpec::named(name, PortKind::HingeAccel, 1);
        inputs.extend(self.motions.iter().map(|v| motion(format!("motion:{v}"))));
        inputs.extend(self.loop_motions.iter().map(|i| motion(format!("loop_motion:{i}"))));
        let traction = |b: &BodyId| {
            PortSpec::named(format!("traction:body:{}", b.index()), PortKind::Traction, Traction::N)
        };
        inputs.extend(self.tractions.iter().map(traction));
        let accels = self.accels.iter().map(|f| port("accel", *f, PortKind::NodeAccel, 6));
        d.feedthrough_outputs.extend(accels);
        let contacts = self.contacts.iter();
        let contact = |b: &BodyId| {
            let name = format!("contact:body:{}", b.index());
            PortSpec::named(name, PortKind::ContactLoad, 6)
        };
        d.feedthrough_outputs.extend(contacts.map(contact));
        let load = |b: &BodyId| {
            PortSpec::named(format!("load:body:{}", b.index()), PortKind::HingeLoad, 6)
        };
        d.feedthrough_outputs.extend(self.loads.iter().map(load));
        let vehicle = |f: &Frame| port("vehicle", *f, PortKind::VehicleMass, VehicleMass::N);
        d.feedthrough_outputs.extend(self.vehicles.iter().map(vehicle));
        let zone = |z: &Zone| PortSpec::named(z.name.clone(), PortKind::ContactNormal, 1);
        d.feedthrough_outputs.extend(self.zones.iter().map(zone));
    }
}

fn name(what: &str, frame: Frame) -> String {
    match frame {
        Frame::Node(n) => format!("{what}:node:{}", n.index()),
        Frame::Body(b) => format!("{what}:body:{}", b.index()),
    }
}

fn port(what: &str, frame: Frame, kind: PortKind, lanes: usize) -> PortSpec {
    PortSpec::named(name(what, frame), kind, lanes)
}

fn hinge_state(name: String) -> PortSpec {
    PortSpec::named(name, PortKind::HingeState, 2)
}

/// Returns the body of a target that is a node.
pub(crate) fn body_of(mb: &Multibody, target: &BindTarget) -> Option<BodyId> {
    match resolve(mb, target, Wants::Any) {
        Ok(Target::Node(frame)) => Some(frame.body(mb)),
        _ => None,
    }
}

/// Coordinates of a hinge to which a binding refers.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Wants {
    /// Coordinates of hinges with one degree of freedom.
    Any,
    /// The ball of the hinge.
    Ball,
}

fn resolve(mb: &Multibody, target: &BindTarget, wants: Wants) -> Result<Target, (String, String)> {
    match target {
        BindTarget::Node(name) => mb
            .node(name)
            .map(Frame::Node)
            .or_else(|| mb.body(name).map(Frame::Body))
            .map(Target::Node)
            .ok_or_else(|| {
                let nodes = mb.nodes().iter().map(|n| n.name());
                let known: Vec<&str> = nodes.chain(mb.bodies().iter().map(|b| b.name())).collect();
                (format!("there is no node `{name}`"), remedy(name, "nodes and bodies", &known))
            }),
        BindTarget::Loop { name, index } => {
            let Some(l) = mb.loops().iter().find(|l| l.closure.name == *name) else {
                let known: Vec<&str> = mb.loops().iter().map(|l| l.closure.name.as_str()).collect();
                return Err((format!("there is no loop `{name}`"), remedy(name, "loops", &known)));
            };
            let given = l.motions.len();
            if *index < given {
                return Ok(Target::Loop((l.motions.start + index) as u32));
            }
            let fact = format!("loop `{name}` has {given} prescribed subhinges, not {}", index + 1);
            Err((fact, "write `prescribed: true` in a slider or pin of its hinge".into()))
        }
        BindTarget::Field(path) => {
            let help = "a field is bound by `field: \"field:…\"`; bind this to a node or a hinge";
            Err((format!("`{path}` is named as a field"), help.into()))
        }
        BindTarget::Hinge { body, index } => {
            let Some(id) = mb.body(body) else {
                let known: Vec<&str> = mb.bodies().iter().map(|b| b.name()).collect();
                return Err((format!("there is no body `{body}`"), remedy(body, "bodies", &known)));
            };
            let b = &mb.bodies()[id.index()];
            let balls = b.subhinges().iter().filter(|s| s.subhinge.kind == SubhingeKind::Ball);
            let balls: Vec<Target> =
                balls.map(|s| Target::Ball { q: s.q.start as u32, v: s.v.start as u32 }).collect();
            let has_ball = !balls.is_empty();
            if wants == Wants::Ball {
                let found = balls.len();
                return balls.into_iter().nth(*index).ok_or_else(|| {
                    let fact =
                        format!("the hinge of `{body}` has {found} balls, not {}", index + 1);
                    (fact, "bind to a `Ball` hinge".into())
                });
            }
            let one_dof: Vec<_> =
                b.subhinges().iter().filter(|s| s.q.len() == 1 && s.v.len() == 1).collect();
            match one_dof.get(*index) {
                Some(s) => Ok(Target::Hinge {
                    q: s.q.start as u32,
                    v: s.v.start as u32,
                    kind: s.subhinge.kind,
                }),
                None => Err((
                    format!(
                        "the hinge of `{body}` has {} one-dof coordinates, not {}",
                        one_dof.len(),
                        index + 1
                    ),
                    match has_ball {
                        true => "bind to a pin, slider or screw; for its ball, use a model for balls such as `actuators.ball_drive`".into(),
                        false => "bind to a pin, slider or screw".into(),
                    },
                )),
            }
        }
    }
}
