//! The generated part of the book (`framework/book`): a page for every model of the catalogue, from its documentation.
//!
//! The pages that are written by hand are in `framework/book/src`. Their Rust examples are doctests of this crate, their
//! shell and RON examples are run by `sims/cli/tests/book.rs`, their Python examples by `sims/python/tests/test_readme.py`.
pub mod headers;
pub mod models;
pub mod summary;

use linkwork::runtime::Catalogue;
use std::path::{Path, PathBuf};

/// Where the sources of models are, from the top of the repository.
pub const SOURCES: [&str; 2] = ["components", "framework/fmi/src"];

/// The top of the repository.
#[must_use]
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Every model that Linkwork ships.
#[must_use]
pub fn catalogue() -> Catalogue {
    let libraries = linkwork_assemblies::libraries().into_iter();
    Catalogue::new(libraries.chain([linkwork_fmi::catalogue()]))
}

/// The pages with Rust examples.
#[cfg(doctest)]
#[allow(rustdoc::invalid_codeblock_attributes)] // Another test reads `ron,file=PATH`.
mod pages {
    #[doc = include_str!("../../../framework/book/src/rust.md")]
    mod rust {}
    #[doc = include_str!("../../../framework/book/src/writing_a_model.md")]
    mod writing_a_model {}
    #[doc = include_str!("../../../framework/book/src/events.md")]
    mod events {}
}
