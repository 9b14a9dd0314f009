//! The shared library inside exported units: FMI 3.0 co-simulation over every model of the component
//! libraries. `linkwork export` copies it into the archive.
//!
//! A library of models of your own gets its own shared library in the same way: a crate with
//! `crate-type = ["cdylib"]`, a function like `library` with its catalogue, and `export_unit!`.
use linkwork_runner::Library;

linkwork_fmi::export_unit!(crate::library);

fn library() -> Library {
    linkwork_assemblies::library().with(linkwork_fmi::catalogue())
}
