//! The reader of campaign files must not panic; what it refuses has a fault.
#![no_main]

use libfuzzer_sys::fuzz_target;
use linkwork_campaign::Form;
use std::path::Path;

fuzz_target!(|text: &str| {
    if let Err(failure) = Form::text("c.ron", text, Path::new("")) {
        assert!(!failure.faults.is_empty() && !failure.to_string().is_empty());
    }
});
