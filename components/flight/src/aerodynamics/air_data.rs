//! Motion of a body relative to the air: airspeed, flow angles, dynamic pressure, Mach number.
//! ```text
//! v_B = R_WBᵀ (v − wind) = (u, v, w)      V = |v_B|      q = ½ ρ V²      M = V/a
//! α = atan2(w, u)      β = asin(v/V)      α_t = acos(u/V)      all zero at rest; found when they are asked for
//! Re = ρ V l/μ
//! ω_B = R_WBᵀ (ω − ω_air)                 ω_air: how the air turns with its planet; zero: inertial rates
//! ```

use linkwork_surroundings::prelude::*;

/// Motion relative to the air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AirData {
    /// Velocity through the air, body axes, m/s.
    pub velocity: Vec3,
    /// Angular velocity relative to the air, body axes, rad/s.
    pub angular: Vec3,
    /// Speed through the air, m/s.
    pub speed: f64,
    /// Mach number.
    pub mach: f64,
    /// Dynamic pressure, Pa.
    pub pressure: f64,
    /// Density, kg/m³.
    pub density: f64,
    /// Temperature of the air, K.
    pub temperature: f64,
}

impl AirData {
    /// Computes the air data of a node at time `t` (s) in `atmosphere` with a `gust` (m/s, W) added to the wind; the air rotates at `air_rate`
    /// (rad/s, W).
    pub fn met(
        atmosphere: &Handle<dyn Atmosphere>,
        t: f64,
        node: &NodeState,
        air_rate: &Vec3,
        gust: &Vec3,
    ) -> AirData {
        AirData::of(node, &gusty(atmosphere, t, &node.position, gust), air_rate)
    }

    /// Computes the air data of a node in `air` that rotates at `air_rate` (rad/s, W).
    pub fn of(node: &NodeState, air: &Air, air_rate: &Vec3) -> AirData {
        let velocity = node.rotation.inverse() * (node.velocity - air.wind);
        let speed = velocity.norm();
        AirData {
            velocity,
            angular: node.rotation.inverse() * (node.angular - air_rate),
            speed,
            mach: speed / air.speed_of_sound.max(1e-9),
            pressure: 0.5 * air.density * speed * speed,
            density: air.density,
            temperature: air.temperature,
        }
    }

    /// Returns the angle of attack α, rad.
    pub fn alpha(&self) -> f64 {
        self.angle(self.velocity.z, self.velocity.x)
    }

    /// Returns the angle of sideslip β, rad.
    pub fn beta(&self) -> f64 {
        self.angle(self.velocity.y, self.velocity.x.hypot(self.velocity.z))
    }

    /// Returns the total angle of attack α_t, the angle between x and the velocity, rad.
    pub fn alpha_total(&self) -> f64 {
        // acos would lose half of the significant digits at small angles.
        self.angle(self.velocity.y.hypot(self.velocity.z), self.velocity.x)
    }

    /// Returns the angle of (x, y), rad; zero at rest, where atan2 would depend on the signs of zeros.
    fn angle(&self, y: f64, x: f64) -> f64 {
        if self.speed > 0.0 { y.atan2(x) } else { 0.0 }
    }

    /// Returns ρ V/μ, 1/m, the Reynolds number per metre of length at the dynamic viscosity μ (Pa s).
    pub fn unit_reynolds(&self, viscosity: f64) -> f64 {
        self.density * self.speed / viscosity
    }

    /// Returns the heat flux at the stagnation point of a nose of `radius` m, W/m². In continuum flow it is q_c = k √(ρ/r_n) V³ (Sutton and Graves).
    /// In free molecular flow it is the energy flux of the gas, q_f = ρ V³/2. Between both it is q = q_c/√(1 + (q_c/q_f)²), which differs from q_c by
    /// less than 1 % if q_f is more than 7.1 times as large. Returns 0 in a vacuum.
    pub fn heating(&self, constant: f64, radius: f64) -> f64 {
        if self.density == 0.0 {
            return 0.0;
        }
        let continuous = constant * (self.density / radius).sqrt() * self.speed.powi(3);
        // The heating follows from (q_c/q_f)² = 4 k²/(ρ r_n).
        let over = 4.0 * constant * constant / (self.density * radius);
        continuous / (1.0 + over).sqrt()
    }

    /// Returns the unit vector of the velocity component perpendicular to x, body axes: (0, v, w)/√(v² + w²); zero if that component vanishes.
    pub fn lean(&self) -> Vec3 {
        let across = self.velocity.y.hypot(self.velocity.z);
        if across > 0.0 {
            Vec3::new(0.0, self.velocity.y / across, self.velocity.z / across)
        } else {
            Vec3::zeros()
        }
    }
}

/// Returns the air at `p` (m, W) with a `gust` (m/s, W) added to its wind.
pub fn gusty(atmosphere: &Handle<dyn Atmosphere>, t: f64, p: &Vec3, gust: &Vec3) -> Air {
    let air = atmosphere.air(t, *p);
    Air { wind: air.wind + gust, ..air }
}

/// Returns gravity (m/s², W) minus the acceleration of air that rotates with its planet, at p (m, W). It gives the weight of displaced air
/// (buoyancy), and the reduction for the apparent mass in m_a (a − a_air). At a site, gravity already includes the centrifugal part.
pub fn gravity_in_air(
    gravity: &Handle<dyn Gravity>,
    world: Option<&Handle<dyn World>>,
    t: f64,
    p: &Vec3,
) -> Vec3 {
    let turns = world.map_or_else(Vec3::zeros, |w| w.planet_rate(t));
    gravity.acceleration(t, *p) - turns.cross(&turns.cross(p))
}

/// Checks a rotation rate of the air (rad/s, W) from the file against the rate of the world's body. Zero means that body rates are relative to W, and
/// is always accepted. `param` names the parameter.
///
/// # Errors
/// The rate differs from the rate of the world's body; the message contains both rates.
pub(super) fn check_air_rate(
    written: &Vec3,
    world: Option<&Handle<dyn World>>,
    param: &str,
) -> Result<(), BuildError> {
    let Some(world) = world.filter(|_| *written != Vec3::zeros()) else { return Ok(()) };
    let turns = world.planet_rate(0.0);
    if (written - turns).norm() <= 1e-6 * turns.norm() {
        return Ok(());
    }
    let show = |v: &Vec3| format!("[{:e}, {:e}, {:e}]", v.x, v.y, v.z);
    let fact = format!(
        "the air rotates at {} rad/s in W here, but at {} rad/s by the `world`",
        show(written),
        show(&turns)
    );
    let help = "write the rate of the world, or leave it out to use body rates relative to W";
    Err(BuildError::new(fact).help(help).at(param))
}

/// Returns the Sutton-Graves constant (kg^½/m): the one in the file, or else the constant of the gas.
///
/// # Errors
/// Neither of the two values is given.
pub fn heating_constant(
    written: Option<f64>,
    atmosphere: &Handle<dyn Atmosphere>,
) -> Result<f64, BuildError> {
    written.or_else(|| atmosphere.heating_constant()).ok_or_else(|| {
        let fact = format!("`{}` has no Sutton-Graves constant for its gas, which heating needs", atmosphere.path());
        let help = "write `heating_constant` there or here: air 1.7415e-4, carbon dioxide 1.9027e-4; 0 where heating does not matter";
        BuildError::new(fact).help(help).at("heating_constant")
    })
}

/// Behaviour outside the range of a table.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outside {
    /// Hold the value at the end of the table. An event is logged, and the output `outside` stays set.
    Clamp,
    /// Stop the run at that instant with a message that names quantity and range; a run that begins outside is rejected.
    Stop,
}

impl Outside {
    /// Builds the message for a flow outside the table from the `fact`, the value that is `taken` there and the `remedy`; it stops the run for
    /// `Stop`.
    pub fn says(self, fact: String, taken: &str, remedy: &str) -> BuildError {
        let help = match self {
            Outside::Clamp => format!("{taken} used; {remedy}, or write `outside: stop`"),
            Outside::Stop => format!("{remedy}, or write `outside: clamp`: {taken} used then"),
        };
        BuildError::new(fact).help(help).at("outside").stopping(self == Outside::Stop)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(crate) fn air(density: f64, wind: Vec3) -> Air {
        Air { density, pressure: 1.0, temperature: 200.0, speed_of_sound: 250.0, wind }
    }

    #[test]
    fn angles_are_those_of_the_velocity_in_body_axes() {
        let (alpha, beta, speed) = (0.3_f64, -0.2_f64, 500.0);
        let v = Vec3::new(alpha.cos() * beta.cos(), beta.sin(), alpha.sin() * beta.cos()) * speed;
        let rotation = Quat::from_scaled_axis(Vec3::new(0.4, -1.1, 0.7));
        let wind = Vec3::new(10.0, -20.0, 5.0);
        let node = NodeState {
            rotation,
            velocity: rotation * v + wind,
            angular: Vec3::new(0.1, 0.2, 0.3),
            ..NodeState::identity()
        };
        let rate = Vec3::new(0.0, 0.0, 0.3);
        let a = AirData::of(&node, &air(0.02, wind), &rate);
        assert!((a.alpha() - alpha).abs() < 1e-14 && (a.beta() - beta).abs() < 1e-14);
        assert!((a.alpha_total().cos() - alpha.cos() * beta.cos()).abs() < 1e-14);
        assert!((a.speed - speed).abs() < 1e-11 && (a.mach - 2.0).abs() < 1e-13);
        assert!((a.pressure - 2500.0).abs() < 1e-9);
        assert!((rotation * a.angular - Vec3::new(0.1, 0.2, 0.0)).norm() < 1e-15);
        assert!((a.lean().norm() - 1.0).abs() < 1e-15 && a.lean().dot(&v) > 0.0);
        // In a vacuum the flux is zero; NaN is propagated.
        let heat =
            |density: f64| AirData::of(&node, &air(density, wind), &rate).heating(1.9e-4, 2.25);
        assert!(heat(0.0) == 0.0 && heat(f64::NAN).is_nan() && heat(1e-300) > 0.0);
        // For q_f = 7 q_c, 1/√(1 + 1/49) is 1.01 % below 1.
        let thin = 49.0 * 4.0 * 1.9e-4 * 1.9e-4 / 2.25;
        let continuous = 1.9e-4 * (thin / 2.25_f64).sqrt() * 500f64.powi(3);
        assert!((heat(thin) / continuous - 0.98995).abs() < 1e-5);
        let still = AirData::of(&NodeState::identity(), &air(0.02, Vec3::zeros()), &rate);
        assert_eq!(
            (still.alpha(), still.beta(), still.alpha_total(), still.lean()),
            (0.0, 0.0, 0.0, Vec3::zeros())
        );
    }
}
