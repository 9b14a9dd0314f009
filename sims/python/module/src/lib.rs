//! The compiled module of the Python package `linkwork`: all classes of `linkwork_python`, with all models of the
//! component libraries.
// `cargo test --workspace NAME` builds a test of this library although its manifest disables tests. It would not
// link without a Python interpreter, so the crate is empty then.
#![cfg(not(test))]

linkwork_python::module!(linkwork_python::library);
