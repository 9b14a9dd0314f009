//! Subgraphs: some of the bodies of a mechanism as a mechanism of its own.
//!
//! The bodies chosen must hang on one common frame: the world, or one body that is not chosen (the
//! *base*). In the new mechanism that frame is `world`. Names stay; bodies outboard of the chosen
//! ones that were not chosen are left out, with their mass; so are constraints with an end outside.

use crate::{BodyId, Builder, Multibody};
use thiserror::Error;

/// Why bodies do not make a subgraph.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SubgraphError {
    /// No body was chosen.
    #[error("a subgraph of no bodies\n  help: name at least one")]
    Empty,
    /// The chosen bodies hang on more than one frame.
    #[error(
        "the bodies hang on different frames: {}\n  help: add the bodies between them, or take \
         several subgraphs",
        bases.join(", ")
    )]
    SeveralBases {
        /// The frames, `world` or names of bodies, each once.
        bases: Vec<String>,
    },
}

/// Some bodies of a mechanism as a mechanism of its own, and how the two correspond.
#[derive(Clone, Debug, PartialEq)]
pub struct Subgraph {
    /// The mechanism of the chosen bodies; its `world` is the frame of `base`.
    pub multibody: Multibody,
    /// The body of the whole that carries them; `None` for the world.
    pub base: Option<BodyId>,
    /// For each body of the part: that of the whole.
    pub bodies: Vec<BodyId>,
    /// For each number of the part's q: its place in the whole's.
    pub q: Vec<usize>,
    /// For each number of the part's β: its place in the whole's.
    pub v: Vec<usize>,
}

impl Subgraph {
    /// The part's numbers out of the whole's: `places` is [`Subgraph::q`] or [`Subgraph::v`].
    #[must_use]
    pub fn gather(places: &[usize], whole: &[f64]) -> Vec<f64> {
        places.iter().map(|i| whole[*i]).collect()
    }

    /// The part's numbers back into the whole's.
    pub fn scatter(places: &[usize], part: &[f64], whole: &mut [f64]) {
        for (i, x) in places.iter().zip(part) {
            whole[*i] = *x;
        }
    }
}

impl Multibody {
    /// The chosen bodies as a mechanism of their own (any order, repeats do no harm).
    ///
    /// # Errors
    /// [`SubgraphError`] if there are none, or if they hang on more than one frame.
    pub fn subgraph(&self, bodies: &[BodyId]) -> Result<Subgraph, SubgraphError> {
        let mut chosen: Vec<BodyId> = bodies.to_vec();
        chosen.sort();
        chosen.dedup();
        let is_chosen = |b: BodyId| chosen.binary_search(&b).is_ok();
        let mut bases: Vec<Option<BodyId>> = (chosen.iter())
            .map(|b| self.get(*b).parent())
            .filter(|p| p.is_none_or(|p| !is_chosen(p)))
            .collect();
        bases.sort();
        bases.dedup();
        let name = |b: &Option<BodyId>| b.map_or("world", |b| self.get(b).name()).to_owned();
        let base = match bases[..] {
            [] => return Err(SubgraphError::Empty),
            [base] => base,
            _ => {
                return Err(SubgraphError::SeveralBases {
                    bases: bases.iter().map(name).collect(),
                });
            }
        };
        let mut part = Builder::new();
        for b in &chosen {
            let mut spec = self.spec(*b);
            if self.get(*b).parent() == base {
                "world".clone_into(&mut spec.parent);
            }
            part.body(spec);
        }
        for n in self.nodes().iter().filter(|n| is_chosen(n.body())) {
            part.node(n.name(), self.get(n.body()).name(), n.pose());
        }
        for l in self.loops() {
            let inside = |a: Option<BodyId>| a.is_some_and(&is_chosen);
            let end = |a: Option<BodyId>| inside(a) || a == base;
            if end(l.a.body) && end(l.b.body) && (inside(l.a.body) || inside(l.b.body)) {
                let mut closure = l.closure.clone();
                for (name, at) in [(&mut closure.body_a, l.a.body), (&mut closure.body_b, l.b.body)]
                {
                    if at == base {
                        "world".clone_into(name);
                    }
                }
                part.loop_closure(closure);
            }
        }
        for c in self.couplings().iter().filter(|c| c.bodies.iter().all(|b| is_chosen(*b))) {
            part.coupling(c.coupling.clone());
        }
        let Ok(multibody) = part.build() else { unreachable!("parts of a whole are sound") };
        let (mut order, mut q, mut v) = (Vec::new(), Vec::new(), Vec::new());
        for b in multibody.bodies() {
            let Some(id) = self.body(b.name()) else { unreachable!("names are kept") };
            order.push(id);
            let whole = self.get(id);
            q.extend(whole.q().chain(whole.modes_q()));
            v.extend(whole.v().chain(whole.modes_v()));
        }
        Ok(Subgraph { multibody, base, bodies: order, q, v })
    }

    /// A body and everything outboard of it as a mechanism of its own.
    #[must_use]
    pub fn subtree_graph(&self, body: BodyId) -> Subgraph {
        let bodies: Vec<BodyId> = self.subtree(body).collect();
        let Ok(part) = self.subgraph(&bodies) else { unreachable!("a subtree has one base") };
        part
    }

    /// The bodies on the way from a body to the world, the body itself included: a single chain.
    #[must_use]
    pub fn path_graph(&self, body: BodyId) -> Subgraph {
        let bodies: Vec<BodyId> = self.ancestors(body).collect();
        let Ok(part) = self.subgraph(&bodies) else { unreachable!("a path has one base") };
        part
    }
}
