//! Mass properties of an SDF link: as written, or from its collisions (`<inertial auto="true">`).
//!
//! ```text
//! m = Σ density · volume of the collisions; an explicit <mass> scales mass and inertia
//! ```

use super::frames::plain_pose;
use super::link::{number, solid};
use crate::mesh::solid::{Filling, Properties, properties};
use crate::mjcf::solid as solid_of;
use crate::read::Cx;
use crate::urdf::turned;
use crate::xml::Element;
use crate::{Geometry, mesh_corners};
use linkwork_spatial::{InertiaCheck, MassProperties, Mat3, Pose, RigidInertia, Vec3};

/// Default density of a collision, kg/m³: the density of water.
const DENSITY: f64 = 1000.0;

/// Reads mass properties. Defaults are 1 kg and 1 kg m², as in the format's specification; a note lists where they are used.
pub(super) fn inertial(cx: &mut Cx<'_>, link: &Element, body: &str) -> MassProperties {
    let what = format!("link `{body}`");
    let Some(e) = link.child("inertial") else {
        let note = "no <inertial>: the format's default of 1 kg and 1 kg m² is used";
        cx.ignored.push(link.ignored(format!("sdf/{}", link.label()), note));
        return MassProperties::new(1.0, Vec3::zeros(), Mat3::identity());
    };
    let what = format!("{what}: <inertial>");
    if matches!(e.attr("auto"), Some("true" | "1")) {
        return automatic(cx, link, e, &what);
    }
    let X_BC = e.child("pose").map_or(Pose::identity(), |p| plain_pose(cx, p, &what));
    let mass = number(cx, e, "mass", &what).unwrap_or(1.0);
    let mut entry = |name: &str, default: f64| {
        e.child("inertia").and_then(|i| number(cx, i, name, &what)).unwrap_or(default)
    };
    let [xx, yy, zz] = ["ixx", "iyy", "izz"].map(|n| entry(n, 1.0));
    let [xy, xz, yz] = ["ixy", "ixz", "iyz"].map(|n| entry(n, 0.0));
    if e.child("inertia").is_none() || e.child("mass").is_none() {
        let note = "without <mass> or <inertia>: the format's default of 1 is used";
        cx.ignored.push(e.ignored(&what, note));
    }
    let J = Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    cx.checked(e, what, MassProperties::new(mass, X_BC.position, turned(&J, &X_BC)))
}

/// Returns the mass properties from the collisions of a link.
fn automatic(cx: &mut Cx<'_>, link: &Element, e: &Element, what: &str) -> MassProperties {
    let usual = number(cx, e, "density", what).unwrap_or(DENSITY);
    let mut sum = RigidInertia::zero();
    for c in link.all("collision") {
        let what = format!("{what}: <{}>", c.label());
        let density = number(cx, c, "density", &what).unwrap_or(usual);
        let X = c.child("pose").map_or(Pose::identity(), |p| plain_pose(cx, p, &what));
        let Some((turn, geometry)) = c.child("geometry").and_then(|g| solid(cx, g, &what)) else {
            continue; // reported with the shapes
        };
        let solid = match filled(&geometry) {
            Ok(solid) => solid,
            Err(why) => {
                cx.ignored.push(c.ignored(&what, format!("adds no mass: {why}")));
                continue;
            }
        };
        let X = X * Pose::rotation(turn);
        let (mass, J) = (density * solid.volume, solid.inertia * density);
        let own = MassProperties::new(mass, solid.centre, J);
        match own.with_check(InertiaCheck::PositiveMoments).validate() {
            Ok(m) => sum += m.rotate(&X.rotation).shift_to_parent(&X.position),
            Err(error) => cx.ignored.push(c.ignored(&what, format!("adds no mass: {error}"))),
        }
    }
    if !(sum.mass() > 0.0) {
        let help = "add a collision with a volume to the link, or write <mass> and <inertia>";
        cx.missing(e, what, "a collision with a volume, which `auto` requires", help);
        return MassProperties::massless();
    }
    let mass = number(cx, e, "mass", what).unwrap_or(sum.mass());
    let J = sum.inertia_com() * (mass / sum.mass());
    cx.checked(e, what.into(), MassProperties::new(mass, sum.com(), (J + J.transpose()) * 0.5))
}

/// Returns volume and inertia for unit density, or the reason why there are none.
fn filled(geometry: &Geometry) -> Result<Properties, String> {
    if let Geometry::Mesh { path, scale, file } = geometry {
        let path = path.as_deref().ok_or(format!("there is no file `{file}`"))?;
        let scale = Vec3::from(*scale);
        let corners: Vec<Vec3> =
            mesh_corners(path)?.iter().map(|p| p.component_mul(&scale)).collect();
        let found = properties(&corners, Filling::Exact);
        return found
            .ok_or("its mesh does not have a volume, or its triangles point inwards".into());
    }
    let (volume, moments) = solid_of(geometry).ok_or("it does not have a volume")?;
    let inertia = Mat3::from_diagonal(&(moments * volume));
    Ok(Properties { volume, centre: Vec3::zeros(), inertia })
}
