//! The compiled part of the Python package `@name@`.
// A test of this crate would not link without a Python interpreter.
#![cfg(not(test))]

linkwork_python::module!(@name@::library);
