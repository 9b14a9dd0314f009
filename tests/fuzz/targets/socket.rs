//! The reader of a connection's messages must not panic; what it reads can be said again.
#![no_main]

use libfuzzer_sys::fuzz_target;
use linkwork_live::{LONGEST_REQUEST, Request, read_frame, write_frame};

fuzz_target!(|bytes: &[u8]| {
    let mut from = bytes;
    while let Ok(request) = read_frame::<Request>(&mut from, LONGEST_REQUEST) {
        let mut again = Vec::new();
        assert!(write_frame(&mut again, &request, 2 * LONGEST_REQUEST).is_ok());
    }
});
