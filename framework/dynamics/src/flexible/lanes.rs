//! Batches of a tree with flexible bodies: one workspace for each state, computed one after another.
//!
//! This is correct but not fast, because the kernels of modes are not vectorized.

use crate::error::DynamicsError;
use crate::lane::Lane;
use crate::tree::Tree;
use crate::work::Workspace;

/// The states of a batch.
#[derive(Clone, Debug)]
pub(crate) struct Lanes {
    pub each: Vec<Workspace>,
    inputs: [Vec<f64>; 3],
    outputs: [Vec<f64>; 2],
}

impl Lanes {
    /// Creates the workspaces; `None` for a rigid tree.
    pub fn new<L: Lane>(tree: &Tree) -> Option<Box<Self>> {
        tree.is_flexible().then(|| {
            let each = vec![Workspace::new(tree); L::WIDTH];
            Box::new(Self { each, inputs: Default::default(), outputs: Default::default() })
        })
    }

    /// Runs one algorithm on each state; outputs are also read. Stops at the first error.
    pub fn run<L: Lane, const I: usize, const O: usize>(
        &mut self,
        inputs: [&[L]; I],
        mut outputs: [&mut [L]; O],
        mut f: impl FnMut(&mut Workspace, [&[f64]; I], [&mut [f64]; O]) -> Result<(), DynamicsError>,
    ) -> Result<(), DynamicsError> {
        for (lane, ws) in self.each.iter_mut().enumerate() {
            let read = |to: &mut Vec<f64>, from: &[L]| {
                to.clear();
                to.extend(from.iter().map(|x| x.state(lane)));
            };
            self.inputs.iter_mut().zip(inputs).for_each(|(to, from)| read(to, from));
            self.outputs.iter_mut().zip(&outputs).for_each(|(to, from)| read(to, from));
            let given = std::array::from_fn(|i| &*self.inputs[i]);
            let mut rest = self.outputs.iter_mut();
            let found = std::array::from_fn(|_| rest.next().map_or(&mut [][..], |v| &mut v[..]));
            f(ws, given, found)?;
            for (to, from) in outputs.iter_mut().zip(&self.outputs) {
                for (to, from) in to.iter_mut().zip(from) {
                    *to = L::gather(|l| if l == lane { *from } else { to.state(l) });
                }
            }
        }
        Ok(())
    }

    /// Like [`run`](Self::run), for algorithms that cannot fail.
    pub fn always<L: Lane, const I: usize, const O: usize>(
        &mut self,
        inputs: [&[L]; I],
        outputs: [&mut [L]; O],
        mut f: impl FnMut(&mut Workspace, [&[f64]; I], [&mut [f64]; O]),
    ) {
        let done = self.run(inputs, outputs, |ws, i, o| {
            f(ws, i, o);
            Ok(())
        });
        debug_assert!(done.is_ok());
    }

    /// Returns three numbers of each state.
    pub fn three<L: Lane>(&self, f: impl Fn(&Workspace) -> linkwork_spatial::Vec3) -> [L; 3] {
        std::array::from_fn(|i| L::gather(|l| f(&self.each[l])[i]))
    }
}
