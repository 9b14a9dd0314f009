//! Planets on slowly changing ellipses: JPL's elements for 1800 to 2050.
//!
//! Standish, *Keplerian elements for approximate positions of the major planets*, Table 1; mean ecliptic
//! and equinox of J2000.

use super::Body;
use crate::ephemeris::{date, seconds};
use crate::error::WorldError;
use crate::planet::{AU, MU_SUN, PointMotion};
use linkwork_spatial::{Quat, Vec3, nalgebra};

/// a (AU), e, I, L, ϖ, Ω (degrees), and their rates per century.
type Elements = [[f64; 6]; 2];

const MERCURY: Elements = [
    [0.38709927, 0.20563593, 7.00497902, 252.25032350, 77.45779628, 48.33076593],
    [0.00000037, 0.00001906, -0.00594749, 149472.67411175, 0.16047689, -0.12534081],
];
const VENUS: Elements = [
    [0.72333566, 0.00677672, 3.39467605, 181.97909950, 131.60246718, 76.67984255],
    [0.00000390, -0.00004107, -0.00078890, 58517.81538729, 0.00268329, -0.27769418],
];
const MARS: Elements = [
    [1.52371034, 0.09339410, 1.84969142, -4.55343205, -23.94362959, 49.55953891],
    [0.00001847, 0.00007882, -0.00813131, 19140.30268499, 0.44441088, -0.29257343],
];
const JUPITER: Elements = [
    [5.20288700, 0.04838624, 1.30439695, 34.39644051, 14.72847983, 100.47390909],
    [-0.00011607, -0.00013253, -0.00183714, 3034.74612775, 0.21252668, 0.20469106],
];
const SATURN: Elements = [
    [9.53667594, 0.05386179, 2.48599187, 49.95424423, 92.59887831, 113.66242448],
    [-0.00125060, -0.00050991, 0.00193609, 1222.49362201, -0.41897216, -0.28867794],
];
const URANUS: Elements = [
    [19.18916464, 0.04725744, 0.77263783, 313.23810451, 170.95427630, 74.01692503],
    [-0.00196176, -0.00004397, -0.00242939, 428.48202785, 0.40805281, 0.04240589],
];
const NEPTUNE: Elements = [
    [30.06992276, 0.00859048, 1.77004347, -55.12002969, 44.96476227, 131.78422574],
    [0.00026291, 0.00005105, 0.00035372, 218.45945325, -0.32241464, -0.00508664],
];

/// TDB days past J2000 for which the elements are valid: 1800 to 2050.
pub(super) const DAYS: [f64; 2] = [-73_050.0, 18_262.5];

/// Obliquity of the ecliptic of J2000, rad: 84381.448″ (IAU 1976).
pub const OBLIQUITY_J2000: f64 = 84381.448 / 3600.0 * (std::f64::consts::PI / 180.0);

/// Returns the eccentric anomaly E of a mean anomaly M: M = E − e sin E, by Newton's method. e must be below 0.3.
fn eccentric(M: f64, e: f64) -> f64 {
    let mut E = M + e * M.sin();
    for _ in 0..10 {
        let step = (E - e * E.sin() - M) / (1.0 - e * E.cos());
        E -= step;
        if step.abs() < 1e-15 {
            break;
        }
    }
    E
}

/// Returns the position and velocity of a planet relative to the Sun, m and m/s. Mars deviates by 2–27″ from DE440, Saturn by up to 600″. The
/// velocity is that on the momentary ellipse, with a relative error of 5e-4.
///
/// # Errors
/// Sun, Earth and Moon, for which better series exist; a time outside 1800 to 2050, where the elements are not valid.
pub fn planet(body: Body, tdb: (f64, f64)) -> Result<PointMotion, WorldError> {
    let elements = match body {
        Body::Mercury => &MERCURY,
        Body::Venus => &VENUS,
        Body::Mars => &MARS,
        Body::Jupiter => &JUPITER,
        Body::Saturn => &SATURN,
        Body::Uranus => &URANUS,
        Body::Neptune => &NEPTUNE,
        Body::Sun | Body::Earth | Body::Moon => {
            let help = "ellipses are not available for the Sun, the Earth and the Moon: use `earth`, `moon`";
            let value = f64::from(body.naif());
            return Err(WorldError::Number { what: "planet, NAIF's number", value, help });
        }
    };
    let days = tdb.0 + tdb.1;
    if !(DAYS[0]..=DAYS[1]).contains(&days) {
        let fact = format!(
            "the elements of {body:?}'s ellipse are valid from 1800 to 2050, not at {}",
            date(seconds(tdb))
        );
        return Err(WorldError::Uncovered { fact, help: "use a kernel that covers it" });
    }
    let T = days / 36525.0;
    let [a, e, i, L, peri, node]: [f64; 6] =
        std::array::from_fn(|k| elements[0][k] + elements[1][k] * T);
    let a = a * AU;
    let M = ((L - peri) % 360.0).to_radians();
    let E = eccentric(M, e);
    let ((sin, cos), root) = (E.sin_cos(), (1.0 - e * e).sqrt());
    let rate = (MU_SUN / (a * a * a)).sqrt() / (1.0 - e * cos);
    let about =
        |axis: nalgebra::UnitVector3<f64>, deg: f64| Quat::from_axis_angle(&axis, deg.to_radians());
    let (x, z) = (nalgebra::Vector3::x_axis(), nalgebra::Vector3::z_axis());
    let tilt = Quat::from_axis_angle(&x, OBLIQUITY_J2000);
    let R = tilt * about(z, node) * about(x, i) * about(z, peri - node);
    Ok(PointMotion {
        position: R * Vec3::new(a * (cos - e), a * root * sin, 0.0),
        velocity: R * Vec3::new(-a * sin, a * root * cos, 0.0) * rate,
    })
}
