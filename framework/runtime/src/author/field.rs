//! Fields: shared worlds that change (ruts, dust, a temperature field), and large data that one part produces and others read (pictures of a camera).
//!
//! A field is a part that owns data. Other parts *read* the data as of the last row through a [`View`] in their store, and *write* by outputs, their
//! imprints. At its own ticks, after all other updates of the row, the field reads its inputs and all imprints in path order and updates its data.
//! Therefore the result does not depend on the order of parts, and the data are saved, forked and replayed like any other state.
use crate::author::block::{Block, EvalTime, Outcome, Prototype, Wiring, copy_store};
use crate::author::error::BuildError;
use crate::author::model::{Description, Functions, Store, lanes};
use crate::author::overlay::SharedOverlay;
use crate::author::params::Params;
use crate::author::ports::{Lanes, PortSpec};
use crate::author::shown::SharedField;
use crate::author::time::Clock;
use crate::author::value::Value;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::any::Any;
use std::sync::Arc;

/// Data of a field. A reader accepts any field with data of this type.
pub trait Shows: Serialize + DeserializeOwned + Clone + Send + Sync + 'static {
    /// Name of their kind: `ruts`, `picture`.
    const KIND: &'static str;
}

/// A shared world that changes (complete it with `#[field("library.name")]`).
///
/// A part that writes to it has an output for each port of [`Field::Imprint`], of the same name and
/// marked `bind = "field"`. A part that reads it has a [`View`] of its data in its [`Store`].
pub trait Field: Sized + Send + Sync + 'static {
    /// Name in the catalogue.
    const NAME: &'static str;
    /// Documentation.
    const DOC: &'static str;
    /// Whether the field has a ground overlay (`fn overlay`).
    const OVERLAY: bool = false;
    /// Parameters; constant during a run.
    type Params: Params;
    /// Variable data: saved with the state. A fork copies them when one of the two writes, so large data should share unchanged parts (tiles behind
    /// `Arc`).
    type Data: Shows;
    /// Imprint of one part.
    type Imprint: Lanes;

    /// Creates the field.
    ///
    /// # Errors
    /// Returns an error for invalid parameters.
    fn build(p: Self::Params) -> Result<Self, BuildError>;
    /// Returns the data at the start.
    fn start(&self) -> Self::Data;
    /// Returns the field's own inputs. `None` requests the inputs that all fields of this type have, before one is created.
    fn inputs(_built: Option<&Self>) -> Vec<PortSpec> {
        Vec::new()
    }
    /// Updates the data from the imprints of the parts, in path order, and the values `u` of the field's own inputs.
    fn update(&self, c: &Clock, data: &mut Self::Data, imprints: &[Self::Imprint], u: &[f64]);
    /// Returns the ground overlay for viewers and logs: a copy of the data to draw. It must be cheap, because the run waits for it.
    fn overlay(&self, _data: &Self::Data) -> Option<SharedOverlay> {
        None
    }
}

/// A field with its data at one instant.
#[derive(Clone)]
pub struct FieldSample<D> {
    field: SharedField,
    /// The data.
    pub data: D,
}

/// Read access of a part to the data of a field; empty if the simulation has no such field. It is part of a store but is not saved with it, because
/// the field itself is saved.
pub struct View<D: Shows>(Option<Arc<FieldSample<D>>>);

impl<D: Shows> View<D> {
    /// Creates a view of a field with given data, for tests.
    pub fn of<F: Field<Data = D>>(field: F, data: D) -> Self {
        View(Some(Arc::new(FieldSample { field: Arc::new(field), data })))
    }
    /// The data.
    #[inline]
    pub fn get(&self) -> Option<&D> {
        self.0.as_ref().map(|seen| &seen.data)
    }
    /// Returns the field and its data, if the field has this type.
    #[inline]
    pub fn with<F: Field<Data = D>>(&self) -> Option<(&F, &D)> {
        self.0.as_ref().and_then(|seen| Some((seen.field.downcast_ref::<F>()?, &seen.data)))
    }
    /// Sets or releases the viewed data; data of another type are ignored.
    pub fn see(&mut self, shown: Option<&SharedField>) {
        self.0 = shown.and_then(|shown| shown.clone().downcast::<FieldSample<D>>().ok());
    }
}

impl<D: Shows> Default for View<D> {
    fn default() -> Self {
        View(None)
    }
}
impl<D: Shows> Clone for View<D> {
    fn clone(&self) -> Self {
        View(self.0.clone())
    }
}
impl<D: Shows> Serialize for View<D> {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        s.serialize_unit()
    }
}
impl<'de, D: Shows> Deserialize<'de> for View<D> {
    fn deserialize<R: Deserializer<'de>>(d: R) -> Result<Self, R::Error> {
        <()>::deserialize(d).map(|()| View(None))
    }
}
impl<D: Shows> Store for View<D> {
    const READS: Option<&'static str> = Some(D::KIND);
    fn see(&mut self, shown: Option<&SharedField>) {
        View::see(self, shown);
    }
}

/// Returns the description of a field without writers.
pub(crate) fn describe<F: Field>() -> Description {
    Description {
        name: F::NAME.into(),
        doc: F::DOC.into(),
        functions: Functions { update: true, overlay: F::OVERLAY, ..Functions::default() },
        params: F::Params::specs(),
        inputs: F::inputs(None),
        shows: Some(F::Data::KIND.into()),
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
        self.description.inputs = F::inputs(Some(&self.field));
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
        let seen = Arc::new(FieldSample { field: self.field.clone(), data: self.field.start() });
        let own = lanes(&F::inputs(Some(&self.field)));
        let n = (w.u.len() - own).checked_div(F::Imprint::N).unwrap_or(0);
        Box::new(WiredField::<F> {
            w,
            field: self.field.clone(),
            seen,
            imprints: Vec::with_capacity(n),
            own: vec![0.0; own],
        })
    }
}

/// Returns the name of the field's port that receives a port of the k-th writer.
pub(crate) fn imprint_port(k: usize, port: &str) -> String {
    format!("imprints[{k}].{port}")
}

struct WiredField<F: Field> {
    w: Wiring,
    field: Arc<F>,
    seen: Arc<FieldSample<F::Data>>,
    /// Work space.
    imprints: Vec<F::Imprint>,
    /// Values of the field's own inputs.
    own: Vec<f64>,
}

impl<F: Field> Block for WiredField<F> {
    fn outputs(&mut self, _: &EvalTime, _: &[f64], _: &[f64], _: &mut [f64]) -> Outcome {
        Ok(())
    }
    fn feedthrough(&mut self, _: &EvalTime, _: &[f64], _: &[f64], _: &mut [f64]) -> Outcome {
        Ok(())
    }
    fn derivatives(
        &mut self,
        _: &EvalTime,
        _: &[f64],
        _: &[f64],
        _: &[f64],
        _: &mut [f64],
    ) -> Outcome {
        Ok(())
    }
    fn update(&mut self, now: &EvalTime, _: &[f64], _: &mut [f64], sig: &[f64]) -> Outcome {
        let (own, written) = self.w.u.split_at(self.own.len());
        self.own.iter_mut().zip(own).for_each(|(u, lane)| *u = sig[*lane as usize]);
        self.imprints.clear();
        let each = written.chunks_exact(F::Imprint::N.max(1));
        self.imprints.extend(each.map(|lanes| F::Imprint::gather(sig, lanes)));
        // Readers have released the data, so this copies only if a fork, snapshot or recorder still holds them.
        let data = &mut Arc::make_mut(&mut self.seen).data;
        self.field.update(&self.w.clock(now), data, &self.imprints, &self.own);
        Ok(())
    }
    fn shown(&self) -> Option<SharedField> {
        Some(self.seen.clone())
    }
    fn overlay(&self) -> Option<SharedOverlay> {
        self.field.overlay(&self.seen.data)
    }
    fn save_store(&self) -> Result<Vec<u8>, String> {
        rmp_serde::to_vec_named(&self.seen.data).map_err(|e| e.to_string())
    }
    fn load_store(&mut self, bytes: &[u8]) -> Result<(), String> {
        let data = rmp_serde::from_slice(bytes).map_err(|e| e.to_string())?;
        self.seen = Arc::new(FieldSample { field: self.field.clone(), data });
        Ok(())
    }
    fn copy_store(&self, into: &mut Option<Box<dyn Any + Send>>) {
        copy_store(&self.seen, into);
    }
    fn take_store(&mut self, from: &dyn Any) {
        if let Some(seen) = from.downcast_ref::<Arc<FieldSample<F::Data>>>() {
            // The field keeps the parameters of this plan; only the data are carried over.
            self.seen = match Arc::ptr_eq(&seen.field, &self.seen.field) {
                true => seen.clone(),
                false => {
                    Arc::new(FieldSample { field: self.field.clone(), data: seen.data.clone() })
                }
            };
        }
    }
    fn fork(&self) -> Box<dyn Block> {
        Box::new(WiredField::<F> {
            w: self.w.clone(),
            field: self.field.clone(),
            seen: self.seen.clone(),
            imprints: Vec::with_capacity(self.imprints.capacity()),
            own: self.own.clone(),
        })
    }
}
