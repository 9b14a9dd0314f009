//! The loader of RON assemblies must not panic, and what it accepts must load again when resolved.
#![no_main]

use libfuzzer_sys::fuzz_target;
use linkwork_assembly::{Options, load_text};
use linkwork_runtime::Catalogue;

fuzz_target!(|text: &str| {
    let catalogue = Catalogue::default();
    let _ = load_text("fuzz.ron", text, &Options::new(&catalogue));
});
