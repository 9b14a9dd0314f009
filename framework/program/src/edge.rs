//! Detection of machines that have left the ground of their map. Beyond its edge, and where it does not have data, no ground supports them. The run
//! continues, and a warning is printed once per body.
use linkwork_plant::PlanExt;
use linkwork_runtime::{Place, Plan, Simulation};
use linkwork_spatial::Vec3;
use linkwork_surroundings::{Terrain, site_of};

/// Fall below the last ground under a body, m, after which the warning is printed.
const BELOW: f64 = 10.0;

/// The free bodies of a run.
pub struct Edges(Vec<Watched>);

struct Watched {
    body: String,
    /// x, y, z in W.
    place: [Place; 3],
    /// Height of the ground that was last below it, m.
    ground: Option<f64>,
    told: bool,
}

impl Edges {
    /// Creates the check for the bodies of all phases. `plan` is that of any phase, because all plans have the variables of the program.
    pub fn new(plan: &Plan) -> Edges {
        let paths = plan.variables.keys().filter_map(|path| path.strip_suffix(".position.x"));
        let watched = paths.filter_map(|body| {
            let place = crate::scene::position(plan, body)?;
            Some(Watched { body: body.to_string(), place, ground: None, told: false })
        });
        Edges(watched.collect())
    }

    /// Returns a line for each body that has fallen off the map since the last call.
    pub fn fallen(&mut self, sim: &Simulation) -> Vec<String> {
        let mut lines = Vec::new();
        let plan = sim.plan();
        let free = |name: &str| {
            let bodies = &plan.mechanism()?.multibody;
            let body = bodies.get(bodies.body(name)?);
            Some(body.parent().is_none() && body.is_free())
        };
        let maps = || {
            let all = plan.services.iter();
            all.filter_map(|(path, object)| Some((path, object.get::<dyn Terrain>()?)))
        };
        // The ground at a site curves down with the planet.
        let site = site_of(&plan.services);
        let height = |p: &Vec3| {
            let far = |s: linkwork_surroundings::Site| {
                s.relative_to_centre(p).norm() - s.relative_to_centre(&Vec3::zeros()).norm()
            };
            site.map_or(p.z, far)
        };
        for w in self.0.iter_mut().filter(|w| !w.told && free(&w.body) == Some(true)) {
            let [x, y, z] = w.place.map(|place| sim.value(place));
            let under =
                maps().filter_map(|(_, t)| t.ground(x, y)).map(|g| g.height).reduce(f64::max);
            if under.is_some() {
                w.ground = under;
                continue;
            }
            // A body that was never above a map is ignored until it is lower than all known ground.
            let known = w.ground.or_else(|| {
                maps().find_map(|(_, t)| {
                    let [x0, y0, x1, y1] = t.bounds();
                    t.ground(0.5 * (x0 + x1), 0.5 * (y0 + y1)).map(|g| g.height)
                })
            });
            if let (Some(ground), Some((path, map))) = (known, maps().next())
                && height(&Vec3::new(x, y, z)) < ground - BELOW
            {
                w.told = true;
                let [x0, y0, x1, y1] = map.bounds();
                lines.push(format!(
                    "warning: `{}` is at ({x:.1}, {y:.1}, {z:.1}) m at t = {:.3} s, where no ground supports it: `{path}` extends from ({x0:.1}, {y0:.1}) to ({x1:.1}, {y1:.1}) m, and may have holes\n  help: make the map larger, end the run before (`stop_when`), or keep the machine on it",
                    w.body,
                    sim.time()
                ));
            }
        }
        lines
    }
}
