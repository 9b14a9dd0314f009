//! A small generator with a seed for terrain (SplitMix64): equal seeds give the same terrain on every machine.

/// A stream of random numbers.
#[derive(Clone, Copy, Debug)]
pub struct Random(u64);

impl Random {
    /// Creates the stream of a seed; streams of different `purpose` do not overlap in practice.
    pub fn new(seed: u64, purpose: u64) -> Random {
        let mut r = Random(seed ^ purpose.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        r.bits();
        r
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix(self.0)
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in [low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }
}

/// Finalizer of SplitMix64: a hash of 64 bits.
pub fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniform_has_the_right_mean_and_spread_and_repeats() {
        let mut r = Random::new(7, 1);
        let v: Vec<f64> = (0..100_000).map(|_| r.uniform()).collect();
        let mean = v.iter().sum::<f64>() / 1e5;
        let var = v.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 1e5;
        assert!((mean - 0.5).abs() < 3e-3 && (var - 1.0 / 12.0).abs() < 1e-3);
        assert_eq!(Random::new(7, 1).uniform(), v[0]);
        assert_ne!(Random::new(7, 2).uniform(), v[0]);
    }
}
