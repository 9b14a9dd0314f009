//! `@library@.@model@`: an output that follows its input with a first-order lag. Replace it by your own equations.
//! ```text
//! ẏ = (u − y)/τ          u: input, y: output, τ: time constant
//! ```
use @prelude@;

/// The lag.
#[derive(Params, Clone, Debug)]
pub struct @Model@Params {
    /// Time constant.
    #[param(unit = "s", default = 0.2, range = 1e-3..)]
    pub time: f64,
}

/// Inputs. Each number needs a unit: `#[port("m/s")]`, `#[port("N m")]`; `"1"` for dimensionless numbers.
#[derive(Ports, Clone, Copy, Debug)]
pub struct @Model@In {
    /// The input.
    #[port("1")]
    pub wanted: f64,
}

/// Outputs.
#[derive(Ports, Clone, Copy, Debug)]
pub struct @Model@Out {
    /// The output.
    #[port("1")]
    pub value: f64,
}

/// State.
#[derive(State, Clone, Copy, Debug)]
pub struct @Model@State {
    /// Present value.
    #[port("1")]
    pub value: f64,
}

/// A model contains its parameters; everything that changes is state.
pub struct @Model@ {
    p: @Model@Params,
}

/// An output that follows its input with a first-order lag.
#[model("@library@.@model@")]
impl Model for @Model@ {
    type Params = @Model@Params;
    type Inputs = @Model@In;
    type Outputs = @Model@Out;
    type State = @Model@State;

    /// Computes the outputs, which depend only on the state.
    fn outputs(&self, x: &@Model@State) -> @Model@Out {
        @Model@Out { value: x.value }
    }

    /// Computes the rate of the state, at every stage of the integrator. Each function names the arguments that it reads.
    fn derivatives(&self, x: &@Model@State, u: &@Model@In) -> @Model@State {
        @Model@State { value: (u.wanted - x.value) / self.p.time }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_follows_with_its_time_constant() {
        let model = @Model@ { p: @Model@Params { time: 0.5 } };
        let u = @Model@In { wanted: 3.0 };
        let (step, mut x) = (1e-4, @Model@State { value: 0.0 });
        for _ in 0..10_000 {
            let rate = model.derivatives(&x, &u);
            x.value += step * rate.value;
        }
        // One second is two time constants. The remaining difference is the error of Euler's
        // method.
        let expected = 3.0 * (1.0 - (-2.0f64).exp());
        assert!((x.value - expected).abs() < 1e-4, "{x:?}");
        let out = model.outputs(&x);
        assert_eq!(out.value, x.value);
    }
}
