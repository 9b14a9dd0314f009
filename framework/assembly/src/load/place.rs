//! `place`: placement of a compiled machine on its ground.
use crate::form::settings::{PlaceMotion, PlacementForm};
use crate::text::patterns::path_matches;
use crate::text::value::Text;
use linkwork_multibody::Multibody;
use linkwork_plant::{KinematicSpec, Placed, Placement, PlanExt, place_on_terrain, settle_placed};
use linkwork_runtime::{Fault, Handle, Plan, remedy};
use linkwork_solvers::Vehicle;
use linkwork_surroundings::Terrain;

/// Places machines on their ground: first until their wheels just touch, then until they rest. Names may contain `*`.
///
/// # Errors
/// The first mistake in the names, or the reason why a machine cannot be placed.
pub fn place_machines(plan: &mut Plan, places: &[PlacementForm]) -> Result<(), Fault> {
    let mut put = Vec::new();
    for place in places {
        let placed = touching(plan, place)?;
        if place.motion == PlaceMotion::Dynamics {
            put.push((place.origin, placed));
        }
    }
    if !put.is_empty() {
        settle_placed(plan, &put);
    }
    Ok(())
}

/// Returns the names of the bodies that patterns match.
fn expand(mb: &Multibody, patterns: &[Text]) -> Result<Vec<String>, Fault> {
    let names: Vec<&str> = mb.bodies().iter().map(|b| b.name()).collect();
    let mut out = Vec::new();
    for p in patterns {
        let matches = |n: &&&str| path_matches(&dotted(&p.text), &dotted(n));
        let before = out.len();
        out.extend(names.iter().filter(matches).map(|n| (*n).to_string()));
        if out.len() == before {
            let message = format!("`place`: `{}` matches no body", p.text);
            return Err(Fault::new(p.origin, message).help(remedy(&p.text, "bodies", &names)));
        }
    }
    Ok(out)
}

/// Returns the wheels of a machine with their radii (m).
///
/// # Errors
/// A pattern without a match, a number of radii that is neither one nor the number of patterns, a wheel with two radii.
fn wheels_of(mb: &Multibody, place: &PlacementForm) -> Result<Vec<(String, f64)>, Fault> {
    let (patterns, radii) = (&place.wheels, &place.radius);
    if radii.len() != 1 && radii.len() != patterns.len() {
        let (found, expected) = (radii.len(), patterns.len());
        let message =
            format!("`place`: `radius` has {found} values, but `wheels` has {expected} entries");
        let help = "write one radius for all wheels, or one for each entry of `wheels`";
        return Err(Fault::new(place.origin, message).help(help));
    }
    let mut wheels: Vec<(String, f64)> = Vec::new();
    for (k, pattern) in patterns.iter().enumerate() {
        let radius = if radii.len() == 1 { radii[0] } else { radii[k] };
        for name in expand(mb, std::slice::from_ref(pattern))? {
            match wheels.iter().find(|(known, _)| *known == name) {
                Some((_, other)) if *other != radius => {
                    let message = format!(
                        "`place`: two entries of `wheels` match `{name}`, with the radii {other} m and {radius} m"
                    );
                    let help = "write patterns that match each wheel once";
                    return Err(Fault::new(pattern.origin, message).help(help));
                }
                Some(_) => {}
                None => wheels.push((name, radius)),
            }
        }
    }
    Ok(wheels)
}

/// Returns the machines that move without inertia according to `place`: kinematic or quasi-static.
///
/// # Errors
/// Names without a match, machines of both kinds, several terrains.
pub(super) fn kinematic(
    places: &[PlacementForm],
    mb: &Multibody,
) -> Result<Option<KinematicSpec>, Fault> {
    let Some(first) = places.iter().find(|p| p.motion != PlaceMotion::Dynamics) else {
        return Ok(None);
    };
    if let Some(other) = places.iter().find(|p| p.motion != first.motion) {
        let [one, this] = [first, other].map(|p| p.motion.words());
        let message = format!("`place`: one machine moves {one}, but this one {this}");
        let help = "write the same `motion` for all machines of a simulation";
        return Err(Fault::new(other.origin, message).help(help));
    }
    let mut vehicles = Vec::new();
    for place in places {
        if place.terrain != first.terrain {
            let message =
                "`place`: machines that move without inertia must drive on the same terrain";
            return Err(Fault::new(place.origin, message).help("write the same `terrain` for all"));
        }
        let find = |name: &str| mb.body(name);
        let Some(root) = find(&place.body.text) else {
            let names: Vec<&str> = mb.bodies().iter().map(|b| b.name()).collect();
            let (name, origin) = (&place.body.text, place.body.origin);
            let message = format!("`place`: there is no body `{name}`");
            return Err(Fault::new(origin, message).help(remedy(name, "bodies", &names)));
        };
        let wheels = wheels_of(mb, place)?;
        let joints = expand(mb, &place.joints)?;
        vehicles.push(Vehicle {
            root,
            wheels: wheels.iter().filter_map(|(w, r)| Some((find(w)?, *r))).collect(),
            joints: joints.iter().filter_map(|j| find(j)).collect(),
        });
    }
    let terrain = first.terrain.as_ref().map(|t| t.text.clone());
    let quasi_static = first.motion == PlaceMotion::QuasiStatic;
    Ok(Some(KinematicSpec { vehicles, quasi_static, terrain, origin: first.origin }))
}

fn touching(plan: &mut Plan, place: &PlacementForm) -> Result<Placed, Fault> {
    let mb = plan.mechanism().map(|m| m.multibody.clone()).ok_or_else(|| {
        Fault::new(place.origin, "`place`: there are no bodies")
            .help("remove `place`, or add a machine to the simulation")
    })?;
    let terrain = place.terrain.as_ref();
    let handle: Handle<dyn Terrain> =
        plan.services.find(terrain.map(|t| t.text.as_str()), "").map_err(|missing| {
            let (m, h) = missing.unwrap_or_default();
            let origin = terrain.map_or(place.origin, |t| t.origin);
            Fault::new(origin, format!("`place`: {m}")).help(h)
        })?;
    let p = Placement {
        body: place.body.text.clone(),
        at: place.at,
        heading: place.heading,
        wheels: wheels_of(&mb, place)?,
        joints: expand(&mb, &place.joints)?,
    };
    place_on_terrain(plan, &*handle, &p)
        .map_err(|e| Fault::new(place.origin, format!("`place`: {}", e.message)).help(e.help))
}

/// Returns `Rover.Wheels.Wheel1/wheel` with a dot in place of the slash, for patterns.
pub fn dotted(path: &str) -> String {
    path.replace('/', ".")
}
