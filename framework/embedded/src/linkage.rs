//! Bodies that hang on objects by hinges, the constant part. Each object with such bodies has its own tree. Its root is the object on a free hinge
//! that stays at zero, and the base of the tree is placed at the object.

use crate::error::{ModelError, ModelFault};
use crate::model::{ModelSpec, ObjectSpec};
use linkwork_collision::{groups, neighbours};
use linkwork_dynamics::Tree;
use linkwork_multibody::{BodyId, BodySpec, Builder, Hinge, Multibody};
use linkwork_names::suggest;

/// Degrees of freedom, and number of coordinates, of the root.
pub(crate) const ROOT_V: usize = 6;
pub(crate) const ROOT_Q: usize = 7;

/// The bodies of one object.
#[derive(Debug)]
pub(crate) struct Linkage {
    pub tree: Tree,
    /// Connection of each body to the object.
    pub links: Vec<Link>,
    /// For each body the first body of the group that is welded to it, and pairs of such groups that a hinge joins.
    pub group: Vec<usize>,
    pub joined: Vec<(usize, usize)>,
}

/// Connection of a body to its object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Link {
    /// The body is the object itself, or is welded to it.
    Welded,
    /// The body is connected to the object's rigid group by one hinge.
    Joined,
    /// The body is connected by more than one hinge.
    Beyond,
}

impl Linkage {
    pub fn multibody(&self) -> &Multibody {
        self.tree.multibody()
    }

    fn new(multibody: &Multibody) -> Self {
        let mut links: Vec<Link> = Vec::new();
        for b in multibody.bodies() {
            let link = match (b.parent().map(BodyId::index), b.v().is_empty()) {
                (None, _) => Link::Welded,
                (Some(p), true) => links[p],
                (Some(p), false) if links[p] == Link::Welded => Link::Joined,
                _ => Link::Beyond,
            };
            links.push(link); // parents are added first
        }
        let (group, joined) = (groups(multibody), neighbours(multibody));
        Self { tree: Tree::new(multibody), links, group, joined }
    }
}

/// Adds objects as free bodies, with the bodies that hang on them, to a builder.
pub(crate) fn objects(mut builder: Builder, spec: &ModelSpec) -> Builder {
    for o in &spec.objects {
        builder.body(BodySpec::new(&o.name, "world").hinge(Hinge::free()).mass(o.mass));
    }
    for b in spec.linkages.bodies() {
        builder.body(b.clone());
    }
    builder
}

/// Builds the linkage of each object that has one.
pub(crate) fn linkages(spec: &ModelSpec) -> Result<Vec<Option<Linkage>>, ModelError> {
    let mut faults = Vec::new();
    let help = "remove it: an object is a tree of rigid bodies";
    let loops = spec.linkages.loops().iter().map(|l| format!("loop `{}`", l.name));
    let couplings = spec.linkages.couplings().iter().map(|c| format!("coupling `{}`", c.name));
    let bent = spec.linkages.bodies().iter().filter(|b| b.modes.is_some());
    let bent = bent.map(|b| format!("the flexibility of body `{}`", b.name));
    let all = loops.chain(couplings).chain(bent);
    faults.extend(all.map(|what| ModelFault::Refused { what, help }));
    // Map from each body to the object that contains it.
    let mut owner: Vec<Option<usize>> = vec![None; spec.linkages.bodies().len()];
    for (k, b) in spec.linkages.bodies().iter().enumerate() {
        let mut at = b.parent.as_str();
        for _ in 0..=spec.linkages.bodies().len() {
            if let Some(o) = spec.objects.iter().position(|o| o.name == at) {
                owner[k] = Some(o);
                break;
            }
            match spec.linkages.bodies().iter().find(|b| b.name == at) {
                Some(b) => at = &b.parent,
                None => break,
            }
        }
        if owner[k].is_none() {
            let names = spec.objects.iter().map(|o| o.name.as_str());
            faults.push(ModelFault::Unknown {
                place: format!("body `{}` of the linkages", b.name),
                kind: "object",
                name: b.parent.clone(),
                help: suggest(&b.parent, "object", names),
            });
        }
    }
    if !faults.is_empty() {
        return Err(ModelError { faults });
    }
    let one = |(o, object): (usize, &ObjectSpec)| {
        let own = || spec.linkages.bodies().iter().zip(&owner).filter(|b| *b.1 == Some(o));
        if own().next().is_none() {
            return Ok(None);
        }
        let mut builder = Builder::new();
        let root = BodySpec::new(&object.name, "world").hinge(Hinge::free());
        builder.body(root.mass(object.mass));
        own().for_each(|(b, _)| {
            builder.body(b.clone());
        });
        match builder.build() {
            Ok(multibody) => Ok(Some(Linkage::new(&multibody))),
            Err(e) => {
                let text = format!("object `{}`: {e}", object.name);
                Err(ModelError { faults: vec![ModelFault::Mechanism { text }] })
            }
        }
    };
    spec.objects.iter().enumerate().map(one).collect()
}
