//! Coordinates that linear couplings determine, such as mimic joints, and the forces that they hand over to the coordinates that they follow.
//!
//! ```text
//! Σ cᵢ qᵢ = c₀        q̇_d = Σ fᵢ q̇ᵢ,  fᵢ = −cᵢ / c_d        virtual work: τᵢ += fᵢ τ_d, τ_d = 0
//! ```
//! The first term of a coupling follows the others; a mimic joint is the first term of its coupling.

use linkwork_multibody::Multibody;

/// A coordinate that follows others.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Follower {
    /// Its index in β.
    own: usize,
    /// Indices in β of the coordinates that it follows, none of which is a follower, and ∂q_d/∂qᵢ.
    leaders: Vec<(usize, f64)>,
}

impl Follower {
    /// Moves its generalized force to the coordinates that it follows.
    pub(super) fn hand_over(&self, forces: &mut [f64]) {
        let own = std::mem::take(&mut forces[self.own]);
        for (leader, factor) in &self.leaders {
            forces[*leader] += factor * own;
        }
    }
}

/// Factor below which a coordinate cancels, relative to the largest factor of its coupling.
const CANCELS: f64 = 1e-12;

/// Returns the followers of all linear couplings. Couplings that repeat others add none.
pub(super) fn of(multibody: &Multibody) -> Vec<Follower> {
    let mut out: Vec<Follower> = Vec::new();
    for c in multibody.couplings().iter().filter(|c| c.is_linear()) {
        let scale = c.terms.iter().fold(0.0_f64, |m, t| m.max(t.2.abs()));
        let mut row: Vec<(usize, f64)> = Vec::new();
        for (_, v, factor) in &c.terms {
            match out.iter().find(|f| f.own == *v) {
                Some(f) => f.leaders.iter().for_each(|(l, x)| add(&mut row, *l, factor * x)),
                None => add(&mut row, *v, *factor),
            }
        }
        row.retain(|(_, factor)| factor.abs() > CANCELS * scale);
        // The terms of the mechanism are sorted; the description has the order of the file.
        let first = c.coupling.terms.first().and_then(|t| {
            let body = multibody.get(multibody.body(&t.coordinate.body)?);
            Some(body.subhinges().get(t.coordinate.subhinge)?.v.start)
        });
        let chosen = row.iter().find(|r| Some(r.0) == first).or(row.first()).copied();
        let Some((own, pivot)) = chosen else { continue };
        row.retain(|(v, _)| *v != own);
        let leaders: Vec<(usize, f64)> = row.iter().map(|(v, x)| (*v, -x / pivot)).collect();
        for f in &mut out {
            let Some(at) = f.leaders.iter().position(|(l, _)| *l == own) else { continue };
            let (_, factor) = f.leaders.swap_remove(at);
            leaders.iter().for_each(|(l, x)| add(&mut f.leaders, *l, factor * x));
        }
        out.push(Follower { own, leaders });
    }
    out
}

fn add(row: &mut Vec<(usize, f64)>, at: usize, factor: f64) {
    match row.iter_mut().find(|(v, _)| *v == at) {
        Some((_, sum)) => *sum += factor,
        None => row.push((at, factor)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_multibody::{BodySpec, Builder, Coupling, Hinge, HingeCoordinate, Term};
    use linkwork_spatial::Vec3;

    /// The power of forces is the same for every motion that satisfies the couplings, whatever their order.
    #[test]
    fn handed_over_forces_have_the_same_power() {
        let names = ["a", "b", "c", "d", "e"];
        let mut m = Builder::new();
        for name in names {
            m.body(BodySpec::new(name, "world").hinge(Hinge::slider(Vec3::x())));
        }
        let at = |body: &str| HingeCoordinate { body: body.into(), subhinge: 0 };
        let term = |body: &str, factor| Term { coordinate: at(body), factor };
        // c follows b, b follows a, and d − 2 e + a = 1; the last one repeats the first two.
        m.coupling(Coupling::mimic("1", at("c"), at("b"), 0.5, 0.1));
        m.coupling(Coupling::mimic("2", at("b"), at("a"), -3.0, 0.2));
        m.coupling(Coupling::linear(
            "3",
            vec![term("e", -2.0), term("d", 1.0), term("a", 1.0)],
            1.0,
        ));
        m.coupling(Coupling::linear("4", vec![term("c", 2.0), term("a", 3.0)], 0.4));
        let multibody = m.build().unwrap();
        let followers = of(&multibody);
        let index = |body: &str| multibody.get(multibody.body(body).unwrap()).v().start;
        let own: Vec<usize> = followers.iter().map(|f| f.own).collect();
        assert_eq!(own, [index("c"), index("b"), index("e")]);
        let forces = [0.7, -1.3, 2.1, 0.4, -0.9];
        let (a, d) = (0.6, -1.7);
        let mut rates = vec![0.0; 5];
        for (body, x) in
            [("a", a), ("b", -3.0 * a), ("c", -1.5 * a), ("d", d), ("e", 0.5 * (d + a))]
        {
            rates[index(body)] = x;
        }
        let power = |tau: &[f64]| tau.iter().zip(&rates).map(|(t, v)| t * v).sum::<f64>();
        let mut reduced = forces.to_vec();
        followers.iter().for_each(|f| f.hand_over(&mut reduced));
        assert!((power(&reduced) - power(&forces)).abs() < 1e-14);
        assert!(own.iter().all(|v| reduced[*v] == 0.0), "{reduced:?}");
    }
}
