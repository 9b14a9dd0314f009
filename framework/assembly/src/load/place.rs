//! `place`: putting a compiled machine on its ground.
use crate::form::settings::PlaceForm;
use crate::text::patterns::path_matches;
use crate::text::value::Text;
use linkwork_runtime::{Fault, Handle, Placed, Placement, Plan, Terrain, place_on_terrain, remedy};

/// Puts machines on their ground: all until their wheels just touch, then each until it rests. Names may hold `*`.
///
/// # Errors
/// The first mistake in the names, or why a machine cannot be put down.
pub fn put_down(plan: &mut Plan, places: &[PlaceForm]) -> Result<(), Fault> {
    let mut put = Vec::new();
    for place in places {
        put.push((place.origin, touching(plan, place)?));
    }
    for (origin, placed) in put {
        let told = plan.warnings.len();
        placed.settle(plan);
        for warning in &mut plan.warnings[told..] {
            warning.origin = origin;
        }
    }
    Ok(())
}

fn touching(plan: &mut Plan, place: &PlaceForm) -> Result<Placed, Fault> {
    let mb = plan.mechanism().map(|m| m.multibody.clone()).ok_or_else(|| {
        Fault::new(place.origin, "`place`: there are no bodies")
            .help("take `place` out, or give the simulation a machine")
    })?;
    let names: Vec<&str> = mb.bodies().iter().map(|b| b.name()).collect();
    let expand = |patterns: &[Text]| -> Result<Vec<String>, Fault> {
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
    };
    let terrain = place.terrain.as_ref();
    let handle: Handle<dyn Terrain> =
        plan.services.find(terrain.map(|t| t.text.as_str()), "").map_err(|(m, h)| {
            let origin = terrain.map_or(place.origin, |t| t.origin);
            Fault::new(origin, format!("`place`: {m}")).help(h)
        })?;
    let p = Placement {
        body: place.body.text.clone(),
        at: place.at,
        heading: place.heading,
        wheels: expand(&place.wheels)?.into_iter().map(|w| (w, place.radius)).collect(),
        joints: expand(&place.joints)?,
    };
    place_on_terrain(plan, &*handle, &p)
        .map_err(|e| Fault::new(place.origin, format!("`place`: {}", e.message)).help(e.help))
}

/// `Rover.Wheels.Wheel1/wheel` with the slash as one more dot, for patterns.
pub fn dotted(path: &str) -> String {
    path.replace('/', ".")
}
