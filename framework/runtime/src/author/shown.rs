//! Fields as their readers see them.
use std::any::Any;
use std::sync::Arc;

/// The binding by which a part names the field that it reads and writes; its imprint's ports name it.
pub(crate) const BINDING: &str = "field";

/// A field as its readers see it, of any type: downcast to [`FieldSample`](crate::FieldSample).
pub type SharedField = Arc<dyn Any + Send + Sync>;
