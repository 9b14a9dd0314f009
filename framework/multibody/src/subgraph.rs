//! Subgraphs: a subset of the bodies of a mechanism as a separate mechanism.
//!
//! The chosen bodies must be attached to one common frame: the world, or one body that is not chosen (the *base*). In the new mechanism this frame is
//! `world`. Names are kept. Bodies that were not chosen are omitted, with their mass, even if they are outboard of a chosen body; constraints with an
//! end on such a body are omitted, too.

use crate::{BodyId, Builder, Multibody};
use thiserror::Error;

/// Reason why bodies do not make a subgraph.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SubgraphError {
    /// No body was chosen.
    #[error("the subgraph has no bodies\n  help: name at least one")]
    Empty,
    /// The chosen bodies are attached to more than one frame.
    #[error(
        "the bodies are attached to different frames: {}\n  help: add the bodies between them, or use several \
        subgraphs",
        bases.join(", ")
    )]
    SeveralBases {
        /// The frames: `world` or names of bodies, each once.
        bases: Vec<String>,
    },
}

/// A subset of the bodies of a mechanism as a separate mechanism, and the mapping between the two.
#[derive(Clone, Debug, PartialEq)]
pub struct Subgraph {
    /// The mechanism of the chosen bodies. Its `world` is the frame of `base`.
    pub multibody: Multibody,
    /// The body of the original mechanism that carries them; `None` for the world.
    pub base: Option<BodyId>,
    /// Original body of each body of the subgraph.
    pub bodies: Vec<BodyId>,
    /// Index in the original q of each element of the subgraph's q.
    pub q: Vec<usize>,
    /// Index in the original β of each element of the subgraph's β.
    pub v: Vec<usize>,
}

impl Subgraph {
    /// Picks the subgraph's elements out of the original ones: `places` is [`Subgraph::q`] or [`Subgraph::v`].
    #[must_use]
    pub fn gather(places: &[usize], whole: &[f64]) -> Vec<f64> {
        places.iter().map(|i| whole[*i]).collect()
    }

    /// Writes the subgraph's elements back into the original ones.
    pub fn scatter(places: &[usize], part: &[f64], whole: &mut [f64]) {
        for (i, x) in places.iter().zip(part) {
            whole[*i] = *x;
        }
    }
}

impl Multibody {
    /// Returns the chosen bodies as a separate mechanism. Order and repeats do not matter.
    ///
    /// # Errors
    /// [`SubgraphError`] if there are none, or if they are attached to more than one frame.
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

    /// Returns a body and all bodies outboard of it as a separate mechanism.
    #[must_use]
    pub fn subtree_graph(&self, body: BodyId) -> Subgraph {
        let bodies: Vec<BodyId> = self.subtree(body).collect();
        let Ok(part) = self.subgraph(&bodies) else { unreachable!("a subtree has one base") };
        part
    }

    /// Returns the bodies on the path from a body to the world, including the body itself: a single chain.
    #[must_use]
    pub fn path_graph(&self, body: BodyId) -> Subgraph {
        let bodies: Vec<BodyId> = self.ancestors(body).collect();
        let Ok(part) = self.subgraph(&bodies) else { unreachable!("a path has one base") };
        part
    }
}
