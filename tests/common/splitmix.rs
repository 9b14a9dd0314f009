//! The generator of tests: the numbers of a counter, mixed (SplitMix64; Steele, Lea & Flood 2014). Supports of tests take it in by
//! `#[path]` and make of its bits the numbers that they want.

/// The next 64 bits.
pub fn splitmix(counter: &mut u64) -> u64 {
    *counter = counter.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *counter;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
