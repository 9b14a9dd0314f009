//! The compiled part of the Python package `linkwork`: everything of `linkwork_python`, with every model of the
//! component libraries.
// `cargo test --workspace NAME` builds a test of this library although its manifest says it has
// none, and an extension module does not link without an interpreter: then it is empty.
#![cfg(not(test))]

linkwork_python::module!(linkwork_python::library);
