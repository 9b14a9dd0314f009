//! `actuators.belt`: the speed of a belt or track, commanded by a port.
//! ```text
//! s = v d/|d|      s: velocity of the surface of the body over the body, axes of the body;  v: commanded speed, d: direction
//! ```
//! The contact model uses the velocity of the surface at each point at which a collider of the body touches something; only its tangential component
//! acts. The speed does not depend on the load. To model a motor with a limited torque, compute the
//! speed from this torque and `contact_force` of the body.

use linkwork_runtime::prelude::*;

/// Direction of motion of the surface.
#[derive(Params, Clone, Debug)]
pub struct BeltParams {
    /// Direction of the surface at a positive speed, axes of the body; its length does not matter.
    #[param(unit = "1")]
    pub direction: Vec3,
}

/// Command.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BeltIn {
    /// Speed of the surface.
    #[port("m/s")]
    pub speed: f64,
}

/// Motion of the surface.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BeltOut {
    /// Velocity of the surface relative to the body.
    #[port(bind = "belt")]
    pub surface: SurfaceVelocity,
}

/// A belt.
pub struct Belt {
    direction: Vec3,
}

/// Belt or track whose surface moves relative to its body at a commanded speed.
#[model("actuators.belt")]
impl Model for Belt {
    type Params = BeltParams;
    type FeedthroughInputs = BeltIn;
    type FeedthroughOutputs = BeltOut;
    fn build(p: BeltParams) -> Result<Self, BuildError> {
        match p.direction.try_normalize(0.0).filter(|d| d.iter().all(|x| x.is_finite())) {
            Some(direction) => Ok(Belt { direction }),
            None => Err(BuildError::new(format!(
                "`direction` is [{}, {}, {}], but it must be finite and not zero",
                p.direction.x, p.direction.y, p.direction.z
            ))
            .help("write the direction in which the surface moves, e.g. [1, 0, 0]")
            .at("direction")),
        }
    }
    fn feedthrough(&self, u: &BeltIn) -> BeltOut {
        BeltOut { surface: SurfaceVelocity { velocity: self.direction * u.speed } }
    }
}
