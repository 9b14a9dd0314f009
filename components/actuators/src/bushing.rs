//! `actuators.bushing`: a spring and a damper in all six directions between a frame on one body and a frame on another.
//! ```text
//! d = R_aᵀ (p_b − p_a) − d₀      r: rotation vector of R_aᵀ R_b      v, ω: their rates seen from a, axes of a
//! f = −K_t d − C_t v                               on b at p_b, against it on a at the same point
//! m = −J(r)⁻ᵀ K_r r − C_r ω                        on b, against it on a
//! J(r)⁻¹ = 1 − [r]×/2 + (1 − (θ/2) cot(θ/2)) [r]×²/θ²,  θ = |r|          ṙ = J(r)⁻¹ ω
//! ```
//! With J the springs have the potential ½ d·K_t d + ½ r·K_r r for rotations of any size below π, so that without damping energy is
//! kept. K and C are diagonal in the axes of a.

use linkwork_runtime::prelude::*;
use linkwork_spatial::moment_of_gradient;

/// A bushing: stiffness and damping along and about the axes of a.
#[derive(Params, Clone, Debug)]
pub struct BushingParams {
    /// Stiffness along x, y, z.
    #[param(unit = "N/m", default = Vec3::zeros())]
    pub stiffness: Vec3,
    /// Damping along x, y, z.
    #[param(unit = "N s/m", default = Vec3::zeros())]
    pub damping: Vec3,
    /// Stiffness about x, y, z.
    #[param(unit = "N m/rad", default = Vec3::zeros())]
    pub angular_stiffness: Vec3,
    /// Damping about x, y, z.
    #[param(unit = "N m s/rad", default = Vec3::zeros())]
    pub angular_damping: Vec3,
    /// Position of b without force, axes of a.
    #[param(unit = "m", default = Vec3::zeros())]
    pub rest: Vec3,
}

/// Its frames.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BushingIn {
    /// The frame whose axes are used.
    #[port(bind = "a")]
    pub a: NodeState,
    /// The other frame.
    #[port(bind = "b")]
    pub b: NodeState,
}

/// Forces and displacement.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BushingOut {
    /// Load on a.
    #[port(bind = "a")]
    pub on_a: Wrench,
    /// Load on b.
    #[port(bind = "b")]
    pub on_b: Wrench,
    /// Force on b, axes of a.
    #[port("N")]
    pub force: Vec3,
    /// Moment on b, axes of a.
    #[port("N m")]
    pub moment: Vec3,
    /// Displacement of b from its rest position, axes of a.
    #[port("m")]
    pub displacement: Vec3,
    /// Rotation vector of b seen from a, axes of a.
    #[port("rad")]
    pub rotation: Vec3,
}

/// A bushing.
pub struct Bushing {
    p: BushingParams,
}

/// Linear springs and dampers between two frames of two bodies, along and about three axes.
#[model("actuators.bushing")]
impl Model for Bushing {
    type Params = BushingParams;
    type FeedthroughInputs = BushingIn;
    type FeedthroughOutputs = BushingOut;
    fn build(p: BushingParams) -> Result<Self, BuildError> {
        let all = [
            ("stiffness", p.stiffness),
            ("damping", p.damping),
            ("angular_stiffness", p.angular_stiffness),
            ("angular_damping", p.angular_damping),
        ];
        for (name, x) in all {
            if let Some(x) = x.iter().find(|x| !(**x >= 0.0)) {
                let fact = format!(
                    "`{name}` contains {x}, but its values must not be negative, because the bushing would create energy"
                );
                return Err(BuildError::new(fact).help("write values of 0 or more").at(name));
            }
        }
        Ok(Bushing { p })
    }
    fn feedthrough(&self, u: &BushingIn) -> BushingOut {
        let (p, a, b) = (&self.p, &u.a, &u.b);
        let to_a = a.rotation.inverse();
        let apart = b.position - a.position;
        let displacement = to_a * apart - p.rest;
        let rate = to_a * (b.velocity - a.velocity - a.angular.cross(&apart));
        let rotation = (to_a * b.rotation).scaled_axis();
        let spin = to_a * (b.angular - a.angular);
        let times = |k: &Vec3, x: &Vec3| k.component_mul(x);
        let force = -times(&p.stiffness, &displacement) - times(&p.damping, &rate);
        let spring = moment_of_gradient(&rotation, &times(&p.angular_stiffness, &rotation));
        let moment = -spring - times(&p.angular_damping, &spin);
        let (f, m) = (a.rotation * force, a.rotation * moment);
        BushingOut {
            on_a: Wrench { moment: -m - apart.cross(&f), force: -f },
            on_b: Wrench { moment: m, force: f },
            force,
            moment,
            displacement,
            rotation,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bushing() -> Bushing {
        let p = BushingParams {
            stiffness: Vec3::new(100.0, 200.0, 300.0),
            damping: Vec3::new(1.0, 2.0, 3.0),
            angular_stiffness: Vec3::new(10.0, 20.0, 30.0),
            angular_damping: Vec3::new(0.1, 0.2, 0.3),
            rest: Vec3::new(0.01, 0.0, -0.02),
        };
        Bushing::build(p).unwrap()
    }

    fn node(k: f64) -> NodeState {
        let v = |x: f64| Vec3::new((k + x).sin(), (2.0 * k + x).cos(), (k - x).sin());
        NodeState {
            position: v(0.3),
            rotation: Quat::from_scaled_axis(v(1.1)),
            angular: v(2.2),
            velocity: v(0.7),
        }
    }

    fn energy(b: &Bushing, u: &BushingIn) -> f64 {
        let y = b.feedthrough(u);
        let half = |k: &Vec3, x: &Vec3| 0.5 * k.component_mul(x).dot(x);
        half(&b.p.stiffness, &y.displacement) + half(&b.p.angular_stiffness, &y.rotation)
    }

    /// The power of both wrenches is the loss of the dampers less the rate of the energy of the springs, at large rotations too; forces
    /// and moments sum to zero.
    #[test]
    fn the_springs_have_a_potential() {
        let b = bushing();
        for k in 0..40 {
            let u = BushingIn { a: node(f64::from(k)), b: node(0.7 * f64::from(k) + 0.4) };
            let y = b.feedthrough(&u);
            if y.rotation.norm() > 2.9 {
                continue;
            }
            let h = 1e-6;
            let moved = |n: &NodeState, h: f64| NodeState {
                position: n.position + n.velocity * h,
                rotation: Quat::from_scaled_axis(n.angular * h) * n.rotation,
                ..*n
            };
            let at = |h: f64| energy(&b, &BushingIn { a: moved(&u.a, h), b: moved(&u.b, h) });
            let rate = (at(h) - at(-h)) / (2.0 * h);
            let power =
                |w: &Wrench, n: &NodeState| w.force.dot(&n.velocity) + w.moment.dot(&n.angular);
            let apart = u.b.position - u.a.position;
            let to_a = u.a.rotation.inverse();
            let v = to_a * (u.b.velocity - u.a.velocity - u.a.angular.cross(&apart));
            let w = to_a * (u.b.angular - u.a.angular);
            let lost = b.p.damping.component_mul(&v).dot(&v)
                + b.p.angular_damping.component_mul(&w).dot(&w);
            let all = power(&y.on_a, &u.a) + power(&y.on_b, &u.b);
            assert!(
                (all + rate + lost).abs() < 1e-5 * (1.0 + all.abs()),
                "{k}: {all} {rate} {lost}"
            );
            assert_eq!(y.on_a.force + y.on_b.force, Vec3::zeros());
            let sum = y.on_a.moment + y.on_b.moment + apart.cross(&y.on_b.force);
            assert!(sum.norm() < 1e-12 * (1.0 + y.on_b.moment.norm()) * 100.0);
        }
    }

    #[test]
    fn what_makes_energy_is_refused() {
        let p = BushingParams { damping: Vec3::new(1.0, -1.0, 0.0), ..bushing().p };
        assert!(Bushing::build(p).is_err());
    }
}
