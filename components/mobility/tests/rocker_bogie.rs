//! Statics of a planar rocker-bogie, written out by hand: an oracle for whole-rover tests.
//! ```text
//! Σ N = W cos α        Σ x_i N_i = W (x_c cos α − h_c sin α)        x forward, uphill positive
//! bogie about its pivot, traction in proportion (T_i = N_i tan α):
//!     N_m (x_m − x_b + h_b tan α) + N_r (x_r − x_b + h_b tan α) = 0
//! bogie, equal traction:  N_m (x_m − x_b) + N_r (x_r − x_b) = −h_b ⅔ W sin α
//! ```
//! Both sides alike, so the differential locks rockers and chassis together.

/// Geometry of the public Curiosity model: wheels, bogie pivot, centre of mass; m.
struct RockerBogie {
    x: [f64; 3],
    pivot: [f64; 2],
    mass_centre: [f64; 2],
}

enum Traction {
    Proportional,
    Equal,
}

impl RockerBogie {
    /// Loads of front, middle and rear wheels over the weight on a slope `a` (rad, uphill).
    fn loads(&self, a: f64, traction: Traction) -> [f64; 3] {
        let [xf, xm, xr] = self.x;
        let [xb, hb] = self.pivot;
        let [xc, hc] = self.mass_centre;
        let (sin, cos) = a.sin_cos();
        let (lever, right) = match traction {
            Traction::Proportional => (hb * a.tan(), 0.0),
            Traction::Equal => (0.0, -hb * 2.0 / 3.0 * sin),
        };
        // N_m and N_r are unknown; N_f follows from the sum of forces.
        let moment = xc * cos - hc * sin;
        let (a11, a12, b1) = (xm - xf, xr - xf, moment - xf * cos);
        let (a21, a22, b2) = (xm - xb + lever, xr - xb + lever, right);
        let det = a11 * a22 - a12 * a21;
        let middle = (b1 * a22 - a12 * b2) / det;
        let rear = (a11 * b2 - a21 * b1) / det;
        [cos - middle - rear, middle, rear]
    }
}

fn curiosity(xc: f64) -> RockerBogie {
    // Heights are above the ground; the pivot is 0.6443 m high.
    RockerBogie { x: [1.095, -0.089, -1.163], pivot: [-0.54, 0.6443], mass_centre: [xc, 0.75] }
}

fn close(got: [f64; 3], want: [f64; 3]) {
    for k in 0..3 {
        assert!((got[k] - want[k]).abs() < 6e-5, "{got:?} {want:?}");
    }
}

#[test]
fn loads_are_those_of_the_balance_of_forces() {
    let deg = f64::to_radians;
    let at = |a: f64, t| curiosity(0.0).loads(deg(a), t);
    close(at(0.0, Traction::Proportional), [0.3303, 0.3885, 0.2812]);
    close(at(10.0, Traction::Proportional), [0.2936, 0.3278, 0.3634]);
    close(at(20.0, Traction::Proportional), [0.2521, 0.2487, 0.4389]);
    close(at(30.0, Traction::Proportional), [0.2067, 0.1541, 0.5052]);
    close(at(10.0, Traction::Equal), [0.2912, 0.3329, 0.3607]);
    close(at(20.0, Traction::Equal), [0.2433, 0.2672, 0.4292]);
    close(at(30.0, Traction::Equal), [0.1880, 0.1933, 0.4847]);
    close(at(-10.0, Traction::Proportional), [0.3616, 0.4274, 0.1958]);
    close(at(-20.0, Traction::Proportional), [0.3881, 0.4404, 0.1112]);
    close(at(-30.0, Traction::Proportional), [0.4121, 0.4205, 0.0334]);
    close(curiosity(-0.1).loads(0.0, Traction::Equal), [0.2691, 0.4240, 0.3069]);
}

#[test]
fn bogie_wheels_lift_at_the_slopes_of_the_closed_form() {
    // Uphill, the load of the middle wheel vanishes at tan α = (x_b − x_r)/h_b; downhill, the load of
    // the rear wheel vanishes at (x_m − x_b)/h_b.
    let g = curiosity(0.0);
    let up = ((g.pivot[0] - g.x[2]) / g.pivot[1]).atan();
    let down = ((g.x[1] - g.pivot[0]) / g.pivot[1]).atan();
    assert!((up.to_degrees() - 44.0).abs() < 0.1 && (down.to_degrees() - 35.0).abs() < 0.1);
    assert!(g.loads(up, Traction::Proportional)[1].abs() < 1e-12);
    assert!(g.loads(-down, Traction::Proportional)[2].abs() < 1e-12);
}

#[test]
fn a_textbook_rover_loads_its_wheels_alike() {
    let g = RockerBogie { x: [1.0, 0.0, -1.0], pivot: [-0.5, 0.5], mass_centre: [0.0, 0.7] };
    close(g.loads(0.0, Traction::Proportional), [1.0 / 3.0; 3]);
}
