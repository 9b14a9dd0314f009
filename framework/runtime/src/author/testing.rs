//! A random generator with a seed, for tests of models.
//!
//! ```
//! let mut random = linkwork_runtime::testing::Random::new(7);
//! assert!((-1.0..1.0).contains(&random.next()));
//! ```
use linkwork_spatial::Vec3;

/// A random generator with a seed (SplitMix64, Steele and others, OOPSLA 2014): equal seeds give equal numbers on every machine.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// Creates the generator for a seed.
    #[must_use]
    pub fn new(seed: u64) -> Random {
        Random(seed)
    }

    /// Returns the next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns the next number, uniform in [−1, 1).
    #[allow(clippy::should_implement_trait)] // An endless sequence has no use for adapters here.
    pub fn next(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// Returns the next number, uniform from `low` to `high`.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * 0.5 * (self.next() + 1.0)
    }

    /// Returns the next vector, each component uniform in [−1, 1).
    pub fn vector(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first numbers with seed 1234567, as published at Rosetta Code (Pseudo-random numbers/Splitmix64).
    #[test]
    fn the_generator_is_splitmix64() {
        let mut random = Random::new(1_234_567);
        let first =
            [6_457_827_717_110_365_317u64, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423];
        assert_eq!([random.bits(), random.bits(), random.bits()], first);
        let (mut sum, mut square) = (0.0, 0.0);
        for _ in 0..10_000 {
            let x = random.next();
            assert!((-1.0..1.0).contains(&x));
            (sum, square) = (sum + x, square + x * x);
        }
        // The mean is 0 and the variance 1/3, within four standard deviations.
        assert!(f64::abs(sum / 1e4) < 4.0 * (1.0f64 / 3e4).sqrt());
        assert!(f64::abs(square / 1e4 - 1.0 / 3.0) < 4.0 * (4.0f64 / 45e4).sqrt());
    }
}
