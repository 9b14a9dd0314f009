//! Commanded acceleration of a frame: tracking of its reference, or compliance like a spring.
//! ```text
//! e = [log(R_r Rᵀ); p_r − p],  ė = V_r − V                                base axes; r: the reference
//! tracking     a = A_r + 2 ω ė + ω² e + Λ⁻¹ f
//! compliant    a = A_r + Λ⁻¹ (K e + D ė + f),    D_ii = 2 √(K_ii/(Λ⁻¹)_ii)
//! ```
//! A feed motion has no spring along its direction: e is measured perpendicular to it.

use crate::moves::{Path, Reference, short};
use linkwork_spatial::{Motion, Pose, Vec3};

/// Wanted and measured, at one sample: angular part first.
#[derive(Clone, Copy, Debug)]
pub struct TrackingSample {
    /// The reference.
    pub wanted: Reference,
    /// e.
    pub e: [f64; 6],
    /// ė.
    pub de: [f64; 6],
}

/// Angular, then linear part.
#[must_use]
pub fn six(m: &Motion) -> [f64; 6] {
    let (w, v) = (m.angular, m.linear);
    [w.x, w.y, w.z, v.x, v.y, v.z]
}

/// Length of a part of six numbers.
#[must_use]
pub fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

impl TrackingSample {
    /// Returns the errors of a frame at `X` with velocity `V`.
    #[must_use]
    pub fn new(wanted: Reference, X: &Pose, V: &[f64; 6]) -> Self {
        let turn = short(wanted.X.rotation * X.rotation.inverse());
        let e = six(&Motion::new(turn, wanted.X.position - X.position));
        let mut de = six(&wanted.V);
        de.iter_mut().zip(V).for_each(|(de, v)| *de -= v);
        Self { wanted, e, de }
    }

    /// Vector from where the frame is to where it is to be, m.
    #[must_use]
    pub fn way(&self) -> Vec3 {
        Vec3::new(self.e[3], self.e[4], self.e[5])
    }

    /// Spring, damper and the move's own push, f with K e + D ė: [moment; force] on what is around, base axes. `mobility` is
    /// the diagonal of Λ⁻¹.
    #[must_use]
    pub fn push(
        &self,
        path: &Path,
        stiffness: Option<[f64; 2]>,
        mobility: impl Fn(usize) -> f64,
    ) -> [f64; 6] {
        let [moment, force] = path.push;
        let mut f = six(&Motion::new(moment, force));
        if let Some([line, turn]) = stiffness {
            let mut e = self.e;
            if let Some(n) = path.feed {
                let along = n.dot(&self.way());
                (0..3).for_each(|k| e[3 + k] -= along * n[k]);
            }
            for (k, f) in f.iter_mut().enumerate() {
                let stiffness = if k < 3 { turn } else { line };
                let damping = 2.0 * (stiffness / mobility(k)).sqrt();
                *f += stiffness * e[k] + damping * self.de[k];
            }
        }
        f
    }

    /// a without what the push gives: A_r, and with a `bandwidth` ω what tracks.
    #[must_use]
    pub fn acceleration(&self, bandwidth: Option<f64>) -> [f64; 6] {
        let mut a = six(&self.wanted.A);
        if let Some(w) = bandwidth {
            for (k, a) in a.iter_mut().enumerate() {
                *a += 2.0 * w * self.de[k] + w * w * self.e[k];
            }
        }
        a
    }
}

impl Reference {
    /// Returns the state at rest at a pose.
    #[must_use]
    pub fn still(X: Pose) -> Self {
        Self { X, V: Motion::zero(), A: Motion::zero() }
    }
}
