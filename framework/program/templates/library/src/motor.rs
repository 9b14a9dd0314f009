//! `@library@.@model@`: a torque that follows a command with a first-order lag.
//! ```text
//! Ṫ = (u − T)/τ          u: commanded torque, T: torque on the shaft, τ: time constant
//! ```
use @prelude@;

/// The lag.
#[derive(Params, Clone, Debug)]
pub struct @Model@Params {
    /// Time constant.
    #[param(unit = "s", default = 0.2, range = 1e-3..)]
    pub time: f64,
}

/// Inputs.
#[derive(Ports, Clone, Copy, Debug)]
pub struct @Model@In {
    /// Wanted torque.
    #[port("N m")]
    pub wanted: f64,
}

/// Outputs: a torque on the hinge to which `shaft` is bound.
#[derive(Ports, Clone, Copy, Debug)]
pub struct @Model@Out {
    /// Torque on the shaft.
    #[port(bind = "shaft")]
    pub torque: HingeTorque,
}

/// State.
#[derive(State, Clone, Copy, Debug)]
pub struct @Model@State {
    /// Present torque.
    #[port("N m")]
    pub torque: f64,
}

/// A model contains its parameters; everything that changes is state.
pub struct @Model@ {
    p: @Model@Params,
}

/// A torque on a shaft that follows a command with a first-order lag.
#[model("@library@.@model@")]
impl Model for @Model@ {
    type Params = @Model@Params;
    type Inputs = @Model@In;
    type Outputs = @Model@Out;
    type State = @Model@State;
    fn outputs(&self, x: &@Model@State) -> @Model@Out {
        @Model@Out { torque: HingeTorque(x.torque) }
    }
    fn derivatives(&self, x: &@Model@State, u: &@Model@In) -> @Model@State {
        @Model@State { torque: (u.wanted - x.torque) / self.p.time }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_follows_with_its_time_constant() {
        let model = @Model@ { p: @Model@Params { time: 0.5 } };
        let u = @Model@In { wanted: 3.0 };
        let (step, mut x) = (1e-4, @Model@State { torque: 0.0 });
        for _ in 0..10_000 {
            let rate = model.derivatives(&x, &u);
            x.torque += step * rate.torque;
        }
        // One second is two time constants. The remaining difference is the error of Euler's
        // method.
        let expected = 3.0 * (1.0 - (-2.0f64).exp());
        assert!((x.torque - expected).abs() < 1e-4, "{x:?}");
        let out = model.outputs(&x);
        assert_eq!(out.torque.0, x.torque);
    }
}
