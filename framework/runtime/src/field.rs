//! Fields: shared worlds that change (ruts, dust, a temperature field).
//!
//! A field is a part with data of its own. Other parts *read* it as it was after the last row, through a
//! [`View`] in their store, and *write* to it by outputs, their imprints. At its own ticks, after every
//! other update of the row, the field takes all imprints in path order and changes its data. So no order
//! of parts matters, and the data are saved, forked and replayed as any other state.
use crate::block::{Block, Now, Outcome, Prototype, Wiring, copy_into};
use crate::model::{BuildError, Description, Functions, Store};
use crate::params::Params;
use crate::ports::{Lanes, PortSpec};
use crate::time::Clock;
use crate::value::Value;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::any::Any;
use std::sync::Arc;

/// The binding by which a part names the field that it reads and writes; its imprint's ports name it.
pub(crate) const BINDING: &str = "field";

/// A shared world that changes (complete it with `#[field("library.name")]`).
///
/// A part that writes to it has an output for each port of [`Field::Imprint`], of the same name and
/// marked `bind = "field"`. A part that reads it has a [`View`] in its [`Store`].
pub trait Field: Sized + Send + Sync + 'static {
    /// Name in the catalogue.
    const NAME: &'static str;
    /// Documentation.
    const DOC: &'static str;
    /// Parameters; constant during a run.
    type Params: Params;
    /// What changes: saved with the state. A fork copies it when one of the two writes, so large data
    /// should share what does not change (tiles behind `Arc`).
    type Data: Serialize + DeserializeOwned + Clone + Send + Sync + 'static;
    /// What one part does to it.
    type Imprint: Lanes;

    /// Makes the field.
    ///
    /// # Errors
    /// Why these parameters make none.
    fn build(p: Self::Params) -> Result<Self, BuildError>;
    /// The data at the start.
    fn start(&self) -> Self::Data;
    /// Takes what the parts did, in path order.
    fn update(&self, c: &Clock, data: &mut Self::Data, imprints: &[Self::Imprint]);
}

/// A field as its readers see it, of any type.
pub type Shown = Arc<dyn Any + Send + Sync>;

/// The field with its data at one time.
struct Seen<F: Field> {
    field: Arc<F>,
    data: F::Data,
}

impl<F: Field> Clone for Seen<F> {
    fn clone(&self) -> Self {
        Seen { field: self.field.clone(), data: self.data.clone() }
    }
}

/// What a part sees of a field: nothing when the simulation has none. It belongs to a store, and is not
/// saved with it: the field itself is.
pub struct View<F: Field>(Option<Arc<Seen<F>>>);

impl<F: Field> View<F> {
    /// A view of a field with these data, for tests.
    pub fn of(field: F, data: F::Data) -> Self {
        View(Some(Arc::new(Seen { field: Arc::new(field), data })))
    }
    /// The field and its data.
    #[inline]
    pub fn get(&self) -> Option<(&F, &F::Data)> {
        self.0.as_ref().map(|seen| (&*seen.field, &seen.data))
    }
    /// Takes what is shown, or lets go of it; what is no such field is not taken.
    pub fn see(&mut self, shown: Option<&Shown>) {
        self.0 = shown.and_then(|shown| shown.clone().downcast::<Seen<F>>().ok());
    }
}

impl<F: Field> Default for View<F> {
    fn default() -> Self {
        View(None)
    }
}
impl<F: Field> Clone for View<F> {
    fn clone(&self) -> Self {
        View(self.0.clone())
    }
}
impl<F: Field> Serialize for View<F> {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        s.serialize_unit()
    }
}
impl<'de, F: Field> Deserialize<'de> for View<F> {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        <()>::deserialize(d).map(|()| View(None))
    }
}
impl<F: Field> Store for View<F> {
    const READS: Option<&'static str> = Some(F::NAME);
    fn see(&mut self, shown: Option<&Shown>) {
        View::see(self, shown);
    }
}

/// What is known of a field before it has writers.
pub(crate) fn describe<F: Field>() -> Description {
    Description {
        name: F::NAME.into(),
        doc: F::DOC.into(),
        functions: Functions { update: true, ..Functions::default() },
        params: F::Params::specs(),
        field: true,
        imprint: F::Imprint::specs(),
        inertial: false,
        ..Description::default()
    }
}

/// [`Prototype`] of a field.
pub(crate) struct BuiltField<F: Field> {
    pub field: Arc<F>,
    pub params: Value,
    pub description: Description,
}

impl<F: Field> Prototype for BuiltField<F> {
    fn description(&self) -> &Description {
        &self.description
    }
    fn params(&self) -> &Value {
        &self.params
    }
    fn initial(&self, _: &mut [f64], _: &mut [f64]) {}
    fn stored(&self) -> bool {
        true
    }
    fn written_by(&mut self, writers: &[&str]) {
        self.description.inputs.clear();
        for (k, path) in writers.iter().enumerate() {
            self.description.inputs.extend(F::Imprint::specs().into_iter().map(|port| PortSpec {
                name: imprint_port(k, &port.name).into(),
                doc: format!("{} (from {path})", port.doc).into(),
                bind: None,
                ..port
            }));
        }
    }
    fn block(&self, w: Wiring) -> Box<dyn Block> {
        let seen = Arc::new(Seen { field: self.field.clone(), data: self.field.start() });
        let n = w.u.len().checked_div(F::Imprint::N).unwrap_or(0);
        Box::new(WiredField { w, seen, imprints: Vec::with_capacity(n) })
    }
}

/// Name of the field's port that takes a port of the k-th writer.
pub(crate) fn imprint_port(k: usize, port: &str) -> String {
    format!("imprints[{k}].{port}")
}

struct WiredField<F: Field> {
    w: Wiring,
    seen: Arc<Seen<F>>,
    /// Work space.
    imprints: Vec<F::Imprint>,
}

impl<F: Field> Block for WiredField<F> {
    fn moore(&mut self, _: &Now, _: &[f64], _: &[f64], _: &mut [f64]) -> Outcome {
        Ok(())
    }
    fn direct(&mut self, _: &Now, _: &[f64], _: &[f64], _: &mut [f64]) -> Outcome {
        Ok(())
    }
    fn deriv(&mut self, _: &Now, _: &[f64], _: &[f64], _: &[f64], _: &mut [f64]) -> Outcome {
        Ok(())
    }
    fn update(&mut self, now: &Now, _: &[f64], _: &mut [f64], sig: &[f64]) -> Outcome {
        self.imprints.clear();
        let each = self.w.u.chunks_exact(F::Imprint::N.max(1));
        self.imprints.extend(each.map(|lanes| F::Imprint::gather(sig, lanes)));
        // Readers have let go: this copies only what a fork or a snapshot holds too.
        let Seen { field, data } = Arc::make_mut(&mut self.seen);
        field.update(&self.w.clock(now), data, &self.imprints);
        Ok(())
    }
    fn shown(&self) -> Option<Shown> {
        Some(self.seen.clone())
    }
    fn save_store(&self) -> Result<Vec<u8>, String> {
        rmp_serde::to_vec_named(&self.seen.data).map_err(|e| e.to_string())
    }
    fn load_store(&mut self, bytes: &[u8]) -> Result<(), String> {
        let data = rmp_serde::from_slice(bytes).map_err(|e| e.to_string())?;
        self.seen = Arc::new(Seen { field: self.seen.field.clone(), data });
        Ok(())
    }
    fn copy_store(&self, into: &mut Option<Box<dyn Any + Send>>) {
        copy_into(&self.seen, into);
    }
    fn take_store(&mut self, from: &dyn Any) {
        if let Some(seen) = from.downcast_ref::<Arc<Seen<F>>>() {
            // The parameters stay those of this plan: only the data go over.
            self.seen = match Arc::ptr_eq(&seen.field, &self.seen.field) {
                true => seen.clone(),
                false => Arc::new(Seen { field: self.seen.field.clone(), data: seen.data.clone() }),
            };
        }
    }
    fn fork(&self) -> Box<dyn Block> {
        Box::new(WiredField::<F> {
            w: self.w.clone(),
            seen: self.seen.clone(),
            imprints: Vec::with_capacity(self.imprints.capacity()),
        })
    }
}
