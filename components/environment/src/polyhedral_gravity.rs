//! `environment.polyhedral_gravity`: a body of uniform density whose surface is a mesh, turning at the origin of W.
//! ```text
//! a = R_IP ∇U(R_IPᵀ p)      R_IP = R_z(angle + rate t)      U: Werner and Scheeres 1997, exact outside and inside
//! ```
//! W is inertial. Cost: proportional to the number of faces and edges.

use crate::planet::fault;
use linkwork_runtime::prelude::*;
use linkwork_world::gravity::polyhedron::{Polyhedron, from_obj};
use linkwork_world::planet::Rotation;
use linkwork_world::planet::rotation::FixedRate;

/// Constant of gravitation, m³/(kg s²): CODATA 2018.
const G: f64 = 6.674_30e-11;

/// A mesh with a density or a gravitational parameter.
#[derive(Params, Clone, Debug)]
pub struct PolyhedralParams {
    /// Wavefront OBJ file: a closed surface whose faces look outwards.
    pub file: String,
    /// Metres for a unit of the file: 1000 for the usual shape models in km.
    #[param(unit = "m", default = 1.0, range = 1e-9..)]
    pub scale: f64,
    /// Density; instead of `mu`.
    #[param(unit = "kg/m^3", range = 1e-9..)]
    pub density: Option<f64>,
    /// Gravitational parameter; instead of `density`.
    #[param(unit = "m^3/s^2", range = 1e-12..)]
    pub mu: Option<f64>,
    /// Rate about z of W.
    #[param(unit = "rad/s", default = 0.0)]
    pub rate: f64,
    /// Angle from x of W to x of the file at t = 0.
    #[param(unit = "rad", default = 0.0)]
    pub angle: f64,
}

/// Gravity of a mesh.
pub struct PolyhedralGravity {
    body: Polyhedron,
    rotation: Rotation,
}

impl Gravity for PolyhedralGravity {
    fn acceleration(&self, t: f64, p: Vec3) -> Vec3 {
        let R_IP = self.rotation.at(t).R_IP;
        R_IP * self.body.gravity(&(R_IP.inverse() * p)).acceleration
    }
    fn axes(&self) -> Axes {
        Axes::Inertial
    }
}

/// Gravity of an asteroid or comet from its shape: uniform density, turning about z at the origin of W.
#[service("environment.polyhedral_gravity", Gravity)]
impl Service for PolyhedralGravity {
    type Params = PolyhedralParams;
    fn build(p: PolyhedralParams, files: &Files) -> Result<Self, BuildError> {
        let path = files.resolve(&p.file).map_err(|e| e.at("file"))?;
        let text = linkwork_formats::whole_text(&path).map_err(|e| {
            let help = "the text of a Wavefront OBJ file is wanted";
            BuildError::new(format!("`{}`: {e}", p.file)).help(help).at("file")
        })?;
        let read = |g_rho| from_obj(&p.file, &text, p.scale, g_rho).map_err(|e| fault(&e, "file"));
        let body = match (p.density, p.mu) {
            (Some(density), None) => read(G * density)?,
            (None, Some(mu)) => read(mu / read(1.0)?.volume())?,
            (None, None) | (Some(_), Some(_)) => {
                let fact = match p.mu {
                    None => "neither `density` nor `mu` is written",
                    Some(_) => "both `density` and `mu` are written",
                };
                return Err(BuildError::new(fact).help("write one of them").at("density"));
            }
        };
        let rotation = FixedRate::about_z(p.angle, p.rate).map_err(|e| fault(&e, "rate"))?;
        Ok(PolyhedralGravity { body, rotation: Rotation::Fixed(rotation) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two metres along each edge, its middle at the origin.
    const CUBE: &str = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n\
        f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

    fn params() -> PolyhedralParams {
        let file = "cube.obj".to_string();
        PolyhedralParams {
            file,
            scale: 100.0,
            density: Some(2000.0),
            mu: None,
            rate: 1e-3,
            angle: 0.4,
        }
    }

    fn built(p: PolyhedralParams, text: &str) -> Result<PolyhedralGravity, BuildError> {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("cube.obj"), text).unwrap();
        PolyhedralGravity::build(p, &Files::of(vec![dir.path().to_path_buf()]))
    }

    #[test]
    fn from_afar_it_is_a_point_and_near_by_it_turns() {
        let body = built(params(), CUBE).unwrap();
        let mu = G * 2000.0 * 200.0_f64.powi(3);
        let far = Vec3::new(3e4, -2e4, 1e4);
        let want = -far * (mu / far.norm().powi(3));
        // A cube differs from a point by the fourth power of size over distance.
        assert!((body.acceleration(0.0, far) - want).norm() < 1e-8 * want.norm());
        // A quarter of a turn takes a cube into itself, an eighth does not.
        let (near, quarter) = (Vec3::new(150.0, 20.0, 30.0), std::f64::consts::FRAC_PI_2 / 1e-3);
        let now = body.acceleration(0.0, near);
        assert!((body.acceleration(quarter, near) - now).norm() < 1e-12 * now.norm());
        assert!((body.acceleration(0.5 * quarter, near) - now).norm() > 1e-2 * now.norm());
        // By its parameter instead of its density: the same.
        let by_mu = PolyhedralParams { density: None, mu: Some(mu), ..params() };
        let same = built(by_mu, CUBE).unwrap().acceleration(7.0, near);
        assert!((same - body.acceleration(7.0, near)).norm() < 1e-12 * now.norm());
    }

    #[test]
    fn what_is_no_body_is_refused() {
        let fact = |p, text| built(p, text).err().map(|e| (e.message, e.help)).unwrap();
        let both = PolyhedralParams { mu: Some(1.0), ..params() };
        assert!(fact(both, CUBE).0.contains("both"));
        let neither = PolyhedralParams { density: None, ..params() };
        assert!(fact(neither, CUBE).0.contains("neither"));
        let open = CUBE.replace("f 4 1 5 8\n", "");
        for text in [open.as_str(), "", "v 1 2\n", "f 1 2 3\n"] {
            let (message, help) = fact(params(), text);
            assert!(!message.is_empty() && help.is_some(), "{text}: {message}");
        }
        let gone = PolyhedralParams { file: "other.obj".into(), ..params() };
        assert!(fact(gone, CUBE).0.contains("other.obj"));
    }
}
