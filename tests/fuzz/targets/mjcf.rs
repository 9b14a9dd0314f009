//! The mjcf reader must not panic; what it accepts must build, and what can be exported must be read again.
#![no_main]

use libfuzzer_sys::fuzz_target;
use linkwork_formats::{ReadOptions, read_mjcf, read_urdf as again, write_urdf};

fuzz_target!(|text: &str| {
    if let Ok(d) = read_mjcf(text, &ReadOptions::default()) {
        assert!(d.builder.build().is_ok());
        if let Ok(urdf) = write_urdf(&d) {
            assert!(again(&urdf.text, &ReadOptions::default()).is_ok());
        }
    }
});
