//! This crate is the shared library inside exported units. It supports FMI 3.0 co-simulation with every model of the component
//! libraries. `linkwork export` copies it into the archive.
//!
//! A shared library for your own models needs a crate with `crate-type = ["cdylib"]`, a function like
//! `library` with its catalogue, and `export_unit!`.
use linkwork_runner::Library;

linkwork_fmi::export_unit!(crate::library);

fn library() -> Library {
    linkwork_assemblies::library().with(linkwork_fmi::catalogue())
}
