//! The compiled part of the Python package `@name@`.
// A test of it would not link without an interpreter.
#![cfg(not(test))]

linkwork_python::module!(@name@::library);
