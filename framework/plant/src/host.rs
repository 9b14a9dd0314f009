//! The mechanism as the host of bindings: it converts bindings to ports and wires.
use crate::part::MechanismPart;
use crate::ports::MechanismPorts;
use crate::spec::{MechanismSpec, RollingOn};
use linkwork_collision::{ColliderSpec, Colliders, Material, Shape, TERRAIN, Varies};
use linkwork_dynamics::Tree;
use linkwork_multibody::{Body, BodyId, SubhingeKind};
use linkwork_runtime::doc::number;
use linkwork_runtime::{
    BindTarget, Bound, BuildError, Fault, Host, Lowering, Origin, PortKind, Prototype,
    ServiceObject, Services, Setting,
};
use linkwork_solvers::Rolling;
use linkwork_spatial::{Pose, Quat, Vec3, nalgebra};
use linkwork_surroundings::{Axes, BodyStart, Gravity, Start, Terrain, World};
use std::borrow::Cow;
use std::sync::Arc;

/// Converts a terrain to a collider of the world: triangles between the points of its grid, smooth for rolling bodies, with the friction of its soil
/// at each point; without a soil with `friction`.
fn ground(terrain: &Arc<dyn Terrain>, friction: Option<f64>) -> Result<ColliderSpec, BuildError> {
    if friction.is_none() {
        terrain.needs_soil().map_err(|e| {
            let help = e.help.clone().unwrap_or_default();
            e.help(format!(
                "{help}; or write `friction: 0.6` in `contact`, which then applies to the ground"
            ))
        })?;
    }
    let s = terrain.nodes()?;
    let middle = |axis: usize, n: usize| s.origin[axis] + 0.5 * (n as f64 - 1.0) * s.spacing[axis];
    let [x, y] = [middle(0, s.nx), middle(1, s.ny)];
    let (soils, known) = (terrain.clone(), terrain.has_soil());
    let varies = Varies(Arc::new(move |p| Material {
        friction: match friction {
            Some(friction) if !known => friction,
            _ => soils.soil(p.x + x, p.y + y).friction,
        },
        restitution: 0.0,
    }));
    let heights = s.heights.iter().map(|h| f64::from(*h)).collect();
    let shape = Shape::HeightField { x: s.nx, y: s.ny, spacing: s.spacing, heights };
    let spec = ColliderSpec::new(TERRAIN, "world", shape).at(Pose::translation(x, y, 0.0));
    let material_name = Some(TERRAIN.to_string());
    Ok(ColliderSpec { groups: u128::MAX, varies: Some(varies), material_name, ..spec })
}

impl Host for MechanismSpec {
    fn path(&self) -> &str {
        &self.path
    }
    fn kind(&self) -> &'static str {
        "mechanism"
    }
    fn origin(&self) -> Origin {
        self.origin
    }
    fn lower(
        &self,
        bound: &[Bound<'_>],
        services: &Services,
        out: &mut Lowering<'_>,
    ) -> Box<dyn Prototype> {
        self.find_massless(out);
        let gravity = self.find_gravity(services, out);
        let ports = crate::ports::lower(&self.multibody, bound, out);
        let mut spec = self.on_terrain(services, out);
        if !self.starts.is_empty() {
            spec.to_mut().begin(services, out);
        }
        spec.twice(bound, out);
        spec.touches(bound, out);
        spec.conveys(bound, out);
        spec.check_loads(bound, out);
        let rolling = self.rolling(services, &ports, out);
        Box::new(MechanismPart::new(&spec, (gravity, rolling), ports, out.warnings))
    }
    fn slides(&self, target: &BindTarget) -> Option<bool> {
        crate::ports::slides(&self.multibody, target)
    }
    fn settings(&self) -> Vec<Setting> {
        self.all_settings()
    }
    fn service(&self) -> Option<ServiceObject> {
        Some(ServiceObject::new(Arc::new(self.scenery.clone())))
    }
    fn boxed(&self) -> Box<dyn Host> {
        Box::new(self.clone())
    }
}

/// A warning for a start on an orbit that passes through the central body, or inside of it: lengths without a unit are metres, and
/// `semi_major_axis: 7000` is easily written for 7000 km. Starts in named axes or over the ground are not checked, because they may be an ascent or
/// an entry.
fn through_the_body(world: &dyn World, s: &BodyStart, (p, v): (Vec3, Vec3)) -> Option<Fault> {
    if let Axes::Level(_) = world.axes() {
        return None;
    }
    let r = world.relative_to_centre(&p);
    let v = world.axes().site().map_or(v, |site| v + site.omega().cross(&r));
    let polar = world.radius() * (1.0 - world.flattening());
    let body = &s.body;
    let fault = |fact: String| {
        let help = "lengths without a unit are metres: write `semi_major_axis: \"7000 km\"`; ignore this warning for an ascent or an entry";
        Some(Fault::new(s.origin, fact).help(help))
    };
    // The position is below the ground of any site.
    if r.norm() < 0.99 * polar {
        return fault(format!(
            "body `{body}` starts {} km from the centre of the central body, whose radius is {} km",
            number(1e-3 * r.norm()),
            number(1e-3 * polar)
        ));
    }
    if matches!(s.start, Start::State { .. } | Start::Geodetic { .. }) {
        return None;
    }
    let mu = world.mu()?;
    let (h, energy) = (r.cross(&v).norm_squared(), 0.5 * v.norm_squared() - mu / r.norm());
    let eccentricity = (1.0 + 2.0 * energy * h / (mu * mu)).max(0.0).sqrt();
    let pericentre = h / mu / (1.0 + eccentricity);
    if pericentre >= polar {
        return None;
    }
    fault(format!(
        "body `{body}` starts on an orbit whose pericentre is {} km from the centre of the central body, whose radius is {} km",
        number(1e-3 * pericentre),
        number(1e-3 * polar)
    ))
}

impl MechanismSpec {
    /// Sets bodies to the starts that the world computes.
    fn begin(&mut self, services: &Services, out: &mut Lowering<'_>) {
        let Some(world) = services.first::<dyn World>() else {
            for s in &self.starts {
                let fact = format!(
                    "body `{}` starts on an orbit or in named axes, but the simulation has no `world`",
                    s.body
                );
                let help = "write `world: (body: \"earth\")` in the simulation, or `position` and `velocity`";
                out.faults.push(Fault::new(s.origin, fact).help(help));
            }
            return;
        };
        for s in &self.starts {
            let (p, v) = match world.start(&s.start) {
                Ok(found) => found,
                Err(e) => {
                    let fact = format!("body `{}`: {}", s.body, e.message);
                    out.faults.push(Fault::new(s.origin, fact).help(e.help.unwrap_or_default()));
                    continue;
                }
            };
            if let Some(warning) = through_the_body(&*world, s, (p, v)) {
                out.warnings.push(warning);
            }
            let Some(body) = self.multibody.bodies().iter().find(|b| b.name() == s.body) else {
                continue;
            };
            let (q, rates) = (&mut self.q[body.q()], &mut self.v[body.v()]);
            let turn = Quat::new_unchecked(nalgebra::Quaternion::new(q[6], q[3], q[4], q[5]));
            q[..3].copy_from_slice(p.as_slice());
            // The rates of a free hinge are in the axes of the body.
            rates[3..].copy_from_slice((turn.inverse() * v).as_slice());
        }
    }

    /// Returns the colliders, for either kind of contact.
    pub(crate) fn colliders(&self) -> Option<&Colliders> {
        let impulses = self.contact.as_ref().map(|c| &c.colliders);
        impulses.or(self.compliant.as_ref().map(|c| &c.0)).map(|c| &**c)
    }

    /// Returns the machines that roll, with their ground.
    fn rolling(
        &self,
        services: &Services,
        ports: &MechanismPorts,
        out: &mut Lowering<'_>,
    ) -> Option<RollingOn> {
        self.tractions(ports, out);
        let spec = self.kinematic.as_ref()?;
        let rolling = Rolling::new(&Tree::new(&self.multibody), &spec.vehicles);
        let rolling = rolling.map_err(|e| out.faults.push(Fault::of(spec.origin, &e))).ok();
        match services.find::<dyn Terrain>(spec.terrain.as_deref(), &self.path) {
            Ok(terrain) => Some((rolling?, terrain.object().clone())),
            Err(None) => None,
            Err(Some((fact, help))) => {
                out.faults.push(Fault::new(spec.origin, format!("`place`: {fact}")).help(help));
                None
            }
        }
    }

    /// Checks that exactly the wheels of quasi-static machines have tractions.
    fn tractions(&self, ports: &MechanismPorts, out: &mut Lowering<'_>) {
        let (origin, wheels) = match &self.kinematic {
            Some(spec) if spec.quasi_static => {
                let wheels = spec.vehicles.iter().flat_map(|v| v.wheels.iter().map(|w| w.0));
                (spec.origin, wheels.collect::<Vec<_>>())
            }
            Some(spec) => (spec.origin, Vec::new()),
            None => (self.origin, Vec::new()),
        };
        let mut fault = |body: BodyId, fact: &str, help: &str| {
            let fact = format!("`{}` {fact}", self.multibody.get(body).name());
            out.faults.push(Fault::new(origin, fact).help(help));
        };
        for body in wheels.iter().filter(|b| !ports.tractions.contains(b)) {
            let help = "bind a model that computes its traction, such as `mobility.wheel_soil_quasi_static`";
            fault(
                *body,
                "is a wheel of a quasi-static machine, but no model computes its traction",
                help,
            );
        }
        for body in ports.tractions.iter().filter(|b| !wheels.contains(b)) {
            let help = "write `motion: \"quasi_static\"` in `place` with the wheel in its `wheels`, or bind a model of another kind";
            fault(
                *body,
                "has a model for wheels of quasi-static machines, but it is not such a wheel",
                help,
            );
        }
    }

    /// Returns the bodies with a collider, and those that roll, in their order.
    pub(crate) fn touched(&self) -> Vec<BodyId> {
        let Some(spec) = &self.kinematic else { return crate::touch::touched(self.colliders()) };
        let wheels = spec.vehicles.iter().flat_map(|v| v.wheels.iter().map(|w| w.0));
        let mut all: Vec<BodyId> = wheels.collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Reports parts that read the touch port of a body that cannot touch anything. A zone is a warning, because a file of a robot may contain touch
    /// sensors that a simulation without contact does not need.
    fn touches(&self, bound: &[Bound<'_>], out: &mut Lowering<'_>) {
        let touched = self.touched();
        for b in bound.iter().filter(|b| b.ports.iter().any(|(p, _)| reads_contact(p.kind))) {
            let Some(body) = crate::ports::body_of(&self.multibody, &b.spec.target) else {
                continue;
            };
            if touched.binary_search(&body).is_err() {
                let (part, bind) = (&b.spec.part, &b.spec.bind);
                let name = self.multibody.get(body).name();
                let fact = format!("`{part}`: binding `{bind}`: `{name}` cannot touch anything");
                let help = "give it a shape with `collide: true`, and write `contact` in the simulation; or list it in `wheels` of `place`, for a machine without inertia";
                if b.ports.iter().any(|(p, _)| p.kind == PortKind::ContactNormal) {
                    let fact = format!("{fact}, so the reading is always 0");
                    out.warnings.push(Fault::new(b.spec.origin, fact).help(help));
                } else {
                    out.faults.push(Fault::new(b.spec.origin, fact).help(help));
                }
            }
        }
    }

    /// Checks that a body whose surface a part moves can touch something, and that no other part moves this surface.
    fn conveys(&self, bound: &[Bound<'_>], out: &mut Lowering<'_>) {
        let moves =
            |b: &&Bound<'_>| b.ports.iter().any(|(p, _)| p.kind == PortKind::SurfaceVelocity);
        for b in bound.iter().filter(moves) {
            let Some(body) = crate::ports::body_of(&self.multibody, &b.spec.target) else {
                continue;
            };
            let (part, bind) = (&b.spec.part, &b.spec.bind);
            let name = self.multibody.get(body).name();
            let all = self.colliders();
            let mut own = all.iter().flat_map(|c| c.ids().map(move |id| (c, id)));
            let own: Vec<_> = own.by_ref().filter(|(c, id)| c.body(*id) == Some(body)).collect();
            if own.is_empty() {
                let fact = format!("`{part}`: binding `{bind}`: `{name}` has no collision shape");
                let help = "give it a shape with `collide: true`, and write `contact` in the simulation; a belt that is fixed to the ground is a body with a `Locked` hinge";
                out.faults.push(Fault::new(b.spec.origin, fact).help(help));
            }
            for (colliders, id) in own {
                let spec = colliders.spec(id);
                if spec.surface_velocity == Vec3::zeros() {
                    continue;
                }
                let fact = format!(
                    "`{part}`: binding `{bind}` moves the surface of `{name}`, but its shape `{}` has a constant `surface_velocity`",
                    spec.name
                );
                let help = "remove `surface_velocity` from the shape, or remove the binding";
                out.faults.push(Fault::new(b.spec.origin, fact).help(help));
            }
        }
    }

    /// Returns the specification with the terrain among the colliders, if contact uses a terrain.
    fn on_terrain(&self, services: &Services, out: &mut Lowering<'_>) -> Cow<'_, MechanismSpec> {
        let here = Cow::Borrowed(self);
        let named = self.terrain.as_deref();
        let Some(colliders) = self.colliders() else { return here };
        let any = services.iter().any(|(_, o)| o.get::<dyn Terrain>().is_some());
        let moves = colliders.ids().any(|c| colliders.body(c).is_some());
        if named == Some("none") || (named.is_none() && !(any && moves)) {
            let rules = colliders.rules();
            let mut pairs = rules.ignore.iter().chain(&rules.collide);
            if pairs.any(|pair| pair.iter().any(|name| name == TERRAIN)) {
                let fact = format!(
                    "`contact`: a pair names `{TERRAIN}`, but there is no terrain with which bodies collide"
                );
                let help = "add a terrain part, or remove the pair";
                out.warnings.push(Fault::new(self.origin, fact).help(help));
            }
            return here;
        }
        let mut fault = |fact: String, help: String| {
            out.faults.push(Fault::new(self.origin, format!("`contact`: {fact}")).help(help));
        };
        let terrain = match services.find::<dyn Terrain>(named, &self.path) {
            Ok(terrain) => terrain,
            Err(None) => return here,
            Err(Some((fact, help))) => {
                fault(
                    fact,
                    format!(
                        "{help}; write it in `contact`: `terrain: \"<path>\"` or `terrain: \"none\"`"
                    ),
                );
                return here;
            }
        };
        let ground = match ground(terrain.object(), self.ground_friction) {
            Ok(ground) => ground,
            Err(e) => {
                let help = e.help.unwrap_or_default();
                fault(format!("`{}`: {}", terrain.path(), e.message), help);
                return here;
            }
        };
        match colliders.with(ground, &self.multibody) {
            Ok(colliders) => {
                let (colliders, mut spec) = (Arc::new(colliders), self.clone());
                if let Some(contact) = &mut spec.contact {
                    contact.colliders = colliders.clone();
                }
                if let Some((of_compliant, _)) = &mut spec.compliant {
                    *of_compliant = colliders;
                }
                Cow::Owned(spec)
            }
            Err(e) => {
                let help =
                    "give the collider another name, or write `terrain: \"none\"` in `contact`";
                fault(e.to_string(), help.into());
                here
            }
        }
    }

    /// Warns of wheels that both their model and their shape support on the same ground.
    fn twice(&self, bound: &[Bound<'_>], out: &mut Lowering<'_>) {
        let Some(colliders) = self.colliders() else { return };
        let Some(terrain) = colliders.find(TERRAIN) else { return };
        for b in bound.iter().filter(|b| b.ports.iter().any(|(p, _)| p.axle.is_some())) {
            let Some(body) = crate::ports::body_of(&self.multibody, &b.spec.target) else {
                continue;
            };
            let meets = |c: &_| colliders.body(*c) == Some(body) && colliders.meet(*c, terrain);
            let Some(shape) = colliders.ids().find(meets) else { continue };
            let (part, name) = (&b.spec.part, &colliders.spec(shape).name);
            let fact = format!(
                "`{part}`: the shape `{name}` of its wheel also collides with the terrain, so the ground would support the wheel twice"
            );
            let help = "write `collide: (terrain: false)` in the shape, which then collides with bodies only";
            out.warnings.push(Fault::new(b.spec.origin, fact).help(help));
        }
    }

    /// Warns of free bodies without mass that carry others, because the mass was probably forgotten; bodies fixed to them count, too.
    fn find_massless(&self, out: &mut Lowering<'_>) {
        let bodies = self.multibody.bodies();
        for (id, body) in self.multibody.body_ids().zip(bodies).filter(|(_, b)| b.is_free()) {
            let of = |b: BodyId| self.multibody.get(b);
            let fixed = |b: &BodyId| {
                let mut way = self.multibody.ancestors(*b).take_while(|b| *b != id);
                way.all(|b| of(b).v().is_empty())
            };
            let mut with_it = self.multibody.subtree(id).filter(fixed);
            if with_it.all(|b| of(b).mass_properties().mass == 0.0) {
                let fact = format!("`{}` is free, but it has no mass", body.name());
                let help = "write its `mass` and `inertia`; without them only the bodies attached to it have mass";
                out.warnings.push(Fault::new(self.origin, fact).help(help));
            }
        }
    }

    /// Returns the named gravity field or the only one; `None` if there is none or `"none"` is written.
    fn find_gravity(
        &self,
        services: &Services,
        out: &mut Lowering<'_>,
    ) -> Option<Arc<dyn Gravity>> {
        if self.gravity.as_deref() == Some("none") {
            if let Some(site) = services.rotating() {
                let fact = format!(
                    "`gravity` is \"none\", but `{site}` treats W as a site of a rotating planet"
                );
                let help = "remove `gravity: \"none\"`: gravity includes the forces of the planet's rotation";
                out.faults.push(Fault::new(self.origin, fact).help(help));
            }
            return None;
        }
        let any = services.iter().any(|(_, o)| o.get::<dyn Gravity>().is_some());
        if self.gravity.is_none() && !any {
            let free = |b: &&Body| {
                b.parent().is_none()
                    && b.subhinges().iter().any(|s| s.subhinge.kind == SubhingeKind::Free)
            };
            if let Some(body) = self.multibody.bodies().iter().find(free) {
                let fact = format!("`{}` is free, but there is no gravity", body.name());
                let help = "add a gravity part, e.g. `environment.uniform_gravity`; for a flight without it write gravity: \"none\"";
                out.warnings.push(Fault::new(self.origin, fact).help(help));
            }
            return None;
        }
        match services.find::<dyn Gravity>(self.gravity.as_deref(), &self.path) {
            Ok(handle) => Some(handle.object().clone()),
            Err(missing) => {
                if let Some((message, help)) = missing {
                    let fact = format!("the mechanism: {message}");
                    out.faults.push(Fault::new(self.origin, fact).help(help));
                }
                None
            }
        }
    }
}

/// Returns whether a port reads the contacts of a body.
fn reads_contact(kind: PortKind) -> bool {
    matches!(kind, PortKind::ContactLoad | PortKind::ContactNormal)
}
