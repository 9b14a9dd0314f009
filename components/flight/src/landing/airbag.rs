//! `flight.airbag`: a ball of gas between a lander and flat ground, with a vent.
//! ```text
//! s = R − z: how far it is pressed in (z: height of its centre over the ground)
//! V = V₀ − π s² (3R − s)/3      A = π (2 R s − s²)      V₀ = 4/3 π R³
//! closed: p = p₀ (m/m₀)^γ (V₀/V)^γ       F = (p − p_a) A upwards at the centre, where p > p_a
//! vent    opens where p − p_a rises through `vent`; choked or not: ṁ = −C_d A_v p √(γ/(R_s T)) ψ(p_a/p)
//! ψ = (2/(γ+1))^((γ+1)/(2(γ−1))) when p_a/p is below the critical ratio, else √(2/(γ−1) (r^(2/γ) − r^((γ+1)/γ)))
//! T = T₀ (p/p₀)^((γ−1)/γ)
//! ```
//! The bag keeps its shape except for the flattened cap; this is valid while s is well below R. At s = 1.8 R, a tenth of its height, it counts as
//! pressed flat: its volume no longer decreases, and a warning is given, because the model does not know whether the hull of the lander touches the
//! ground. Gas that has escaped does not return, so after venting a second bounce is softer.

use linkwork_surroundings::needs_level_ground;
use linkwork_surroundings::prelude::*;

/// A bag.
#[derive(Params, Clone, Debug)]
pub struct AirbagParams {
    /// Radius R.
    #[param(unit = "m", range = 1e-3..)]
    pub radius: f64,
    /// Pressure p₀ of the undeformed bag.
    #[param(unit = "Pa", range = 1e-3..)]
    pub pressure: f64,
    /// Ambient pressure p_a.
    #[param(unit = "Pa", default = 0.0, range = 0.0..)]
    pub ambient: f64,
    /// Overpressure at which the vent opens and then stays open; default: no vent.
    #[param(unit = "Pa", range = 0.0..)]
    pub vent: Option<f64>,
    /// Area of the vent times its discharge coefficient.
    #[param(unit = "m^2", default = 0.0, range = 0.0.., needs = "vent")]
    pub vent_area: f64,
    /// Ratio of heats γ.
    #[param(default = 1.4, range = 1.01..=1.67)]
    pub heat_ratio: f64,
    /// Specific gas constant.
    #[param(unit = "J/(kg K)", default = 296.8, range = 1.0.., needs = "vent")]
    pub gas_constant: f64,
    /// Temperature at the start.
    #[param(unit = "K", default = 280.0, range = 1.0.., needs = "vent")]
    pub temperature: f64,
    /// Height of the ground, W.
    #[param(unit = "m", default = 0.0)]
    pub ground: f64,
    /// The world; z of W must be up.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
}

/// The centre.
#[derive(Ports, Clone, Copy, Debug)]
pub struct AirbagIn {
    /// Node at the centre of the bag.
    #[port(bind = "centre")]
    pub centre: NodeState,
}

/// Load and gas.
#[derive(Ports, Clone, Copy, Debug)]
pub struct AirbagOut {
    /// Load on the lander at the centre of the bag.
    #[port(bind = "centre")]
    pub load: Wrench,
    /// Upward force of the ground.
    #[port("N")]
    pub force: f64,
    /// Pressure of the gas.
    #[port("Pa")]
    pub pressure: f64,
    /// Gas that goes out.
    #[port("kg/s")]
    pub flow: f64,
}

/// Gas in it.
#[derive(State, Clone, Copy, Debug)]
pub struct Gas {
    /// Ratio of the gas mass to that at the start.
    #[port("1")]
    pub share: f64,
}

/// The vent.
#[derive(State, Clone, Copy, Debug)]
pub struct Vent {
    /// The vent has opened.
    #[port]
    pub open: bool,
}

/// Guards of the vent and of the flat bag.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Opening {
    /// Pressure minus the pressure at which the vent opens.
    #[port("Pa", rising)]
    pub over: f64,
    /// Depth by which the ball is pressed in.
    #[port("m")]
    pub touches: f64,
    /// Depth minus the depth at which the bag counts as pressed flat.
    #[port("m", rising)]
    pub flat: f64,
}

/// Index in [`Opening`] of the guard for a bag that is pressed flat.
const FLAT: usize = 2;

/// Ratio of depth to radius at which the bag counts as pressed flat; at 2 its volume would be 0.
const PRESSED: f64 = 1.8;

/// An airbag.
pub struct Airbag {
    p: AirbagParams,
}

impl Airbag {
    /// Depth, pressure and contact area.
    fn pressed(&self, share: f64, centre: &NodeState) -> (f64, f64, f64) {
        let p = &self.p;
        let pi = std::f64::consts::PI;
        let depth = (p.radius - (centre.position.z - p.ground)).clamp(0.0, PRESSED * p.radius);
        let whole = 4.0 / 3.0 * pi * p.radius.powi(3);
        let cap = pi * depth * depth * (3.0 * p.radius - depth) / 3.0;
        let ratio = share.max(0.0) * whole / (whole - cap);
        let area = pi * (2.0 * p.radius * depth - depth * depth);
        (depth, p.pressure * ratio.powf(p.heat_ratio), area)
    }
}

impl Airbag {
    /// Warning for a bag that is pressed flat.
    fn flat(&self, centre: &NodeState) -> BuildError {
        let fact = format!(
            "the bag is pressed flat, to a tenth of its height, at {:.3} m/s downwards",
            -centre.velocity.z
        );
        let help = "check that the lander's hull is on the ground; else use a larger `radius` or more `pressure`";
        BuildError::new(fact).help(help).at("radius")
    }
}

/// Flow function ψ of a nozzle at a ratio of outside to inside pressure.
pub fn flow_function(ratio: f64, gamma: f64) -> f64 {
    let critical = (2.0 / (gamma + 1.0)).powf(gamma / (gamma - 1.0));
    let r = ratio.clamp(critical, 1.0);
    // At the critical ratio both forms are one.
    (2.0 / (gamma - 1.0) * (r.powf(2.0 / gamma) - r.powf((gamma + 1.0) / gamma))).max(0.0).sqrt()
}

/// A ball of gas on flat ground, with a vent that opens once.
#[model("flight.airbag")]
impl Model for Airbag {
    type Params = AirbagParams;
    type FeedthroughInputs = AirbagIn;
    type FeedthroughOutputs = AirbagOut;
    type State = Gas;
    type DiscreteState = Vent;
    type Guards = Opening;
    fn build(p: AirbagParams) -> Result<Self, BuildError> {
        needs_level_ground(p.world.as_ref())?;
        if p.pressure < p.ambient {
            let fact = format!(
                "the bag has {} Pa inside and {} Pa outside: it would collapse",
                p.pressure, p.ambient
            );
            let help = "write `pressure` at or above `ambient`: it is absolute";
            return Err(BuildError::new(fact).help(help).at("pressure"));
        }
        Ok(Airbag { p })
    }
    fn init_x(&self) -> Gas {
        Gas { share: 1.0 }
    }
    fn feedthrough(&self, x: &Gas, d: &Vent, u: &AirbagIn) -> AirbagOut {
        let p = &self.p;
        let (_, pressure, area) = self.pressed(x.share, &u.centre);
        let force = ((pressure - p.ambient) * area).max(0.0);
        let mut flow = 0.0;
        if d.open && pressure > p.ambient {
            let g = p.heat_ratio;
            let temperature = p.temperature * (pressure / p.pressure).powf((g - 1.0) / g);
            let root = (g / (p.gas_constant * temperature)).sqrt();
            flow = p.vent_area * pressure * root * flow_function(p.ambient / pressure, g);
        }
        let load = Wrench { moment: Vec3::zeros(), force: Vec3::z() * force };
        AirbagOut { load, force, pressure, flow }
    }
    fn derivatives(&self, y: &AirbagOut) -> Gas {
        let p = &self.p;
        let whole = 4.0 / 3.0 * std::f64::consts::PI * p.radius.powi(3);
        let mass = p.pressure * whole / (p.gas_constant * p.temperature);
        Gas { share: -y.flow / mass }
    }
    fn guards(&self, x: &Gas, u: &AirbagIn) -> Opening {
        let p = &self.p;
        let (_, pressure, _) = self.pressed(x.share, &u.centre);
        let touches = p.radius - (u.centre.position.z - p.ground);
        let over = p.vent.map_or(-1.0, |v| pressure - p.ambient - v);
        Opening { over, touches, flat: touches - PRESSED * p.radius }
    }
    fn runtime_warning(&self, fired: Fired<'_>, u: &AirbagIn) -> Option<BuildError> {
        fired.rose(FLAT).then(|| self.flat(&u.centre))
    }
    fn startup_warnings(&self, u: &AirbagIn) -> Vec<BuildError> {
        let p = &self.p;
        if u.centre.position.z - p.ground <= (1.0 - PRESSED) * p.radius {
            return vec![self.flat(&u.centre)];
        }
        let Some(vent) = p.vent else { return Vec::new() };
        let fact = match () {
            () if p.pressure - p.ambient >= vent => {
                "the initial pressure is above the opening pressure of the vent: the vent opens at once"
            }
            () if p.vent_area <= 0.0 => "the vent has no area, so no gas leaves when it opens",
            () => return Vec::new(),
        };
        let help = "write a `vent` greater than `pressure` minus `ambient` and a `vent_area`, or remove `vent`";
        vec![BuildError::new(fact).help(help).at("vent")]
    }
    fn handle_event(&self, fired: Fired<'_>, x: &Gas, d: &Vent) -> (Gas, Vent) {
        (*x, Vent { open: d.open || fired.rose(0) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bag(vent: Option<f64>) -> Airbag {
        Airbag {
            p: AirbagParams {
                radius: 1.2,
                pressure: 6000.0,
                ambient: 600.0,
                vent,
                vent_area: 0.05,
                heat_ratio: 1.4,
                gas_constant: 296.8,
                temperature: 280.0,
                ground: 0.0,
                world: None,
            },
        }
    }

    fn fall(m: &Airbag, mass: f64, speed: f64, until: f64) -> (f64, f64, f64) {
        let (mut z, mut v, mut x, mut d) = (1.2, -speed, m.init_x(), Vent { open: false });
        let h = 1e-5;
        let mut most = 0.0_f64;
        for _ in 0..(until / h) as usize {
            let node = |z: f64| {
                let position = Vec3::z() * z;
                AirbagIn { centre: NodeState { position, ..NodeState::identity() } }
            };
            if m.guards(&x, &node(z)).over > 0.0 {
                d = m.handle_event(Fired::rising(0), &x, &d).1;
            }
            let y = m.feedthrough(&x, &d, &node(z + 0.5 * h * v));
            x.share += h * m.derivatives(&y).share;
            let a = y.force / mass - 3.71;
            z += h * (v + 0.5 * h * a);
            v += h * a;
            most = most.max(y.force);
            if z > 1.2 && v > 0.0 {
                break;
            }
        }
        (v, most, x.share)
    }

    #[test]
    fn a_bag_below_the_ambient_pressure_is_refused() {
        let p = |pressure| AirbagParams { pressure, ambient: 700.0, ..bag(None).p };
        let e = Airbag::build(p(100.0)).err().unwrap();
        assert!(e.param.as_deref() == Some("pressure") && e.message.contains("100 Pa"));
        assert!(Airbag::build(p(700.0)).is_ok());
    }

    #[test]
    fn a_closed_bag_gives_all_energy_back_and_a_vent_takes_it() {
        let (back, peak, share) = fall(&bag(None), 400.0, 12.0, 2.0);
        assert!((back - 12.0).abs() < 1e-3 && share == 1.0, "{back}");
        let (slow, softer, left) = fall(&bag(Some(2000.0)), 400.0, 12.0, 2.0);
        assert!(slow < 9.0 && softer < peak && left < 0.95, "{slow} {softer} {peak} {left}");
    }

    #[test]
    fn the_flow_is_choked_below_the_critical_ratio() {
        let g: f64 = 1.4;
        let choked = (2.0 / (g + 1.0)).powf((g + 1.0) / (2.0 * (g - 1.0)));
        assert!((flow_function(0.0, g) - choked).abs() < 1e-12);
        assert!((flow_function(0.528, g) - choked).abs() < 1e-5);
        assert!(flow_function(0.9, g) < choked && flow_function(1.0, g) == 0.0);
    }
}
