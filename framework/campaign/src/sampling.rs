//! Uniform numbers of a run, as pure functions of the campaign's seed, the run and the name of the value.
//!
//! | method | number of run r | dependence on other runs |
//! |---|---|---|
//! | `Random` | Philox 4×32 of (key of the name, r) | none |
//! | `LatinHypercube` | (π(r) + v)/N, π a permutation of 0 … N−1 keyed by the name, v uniform | only their number N |
//! | `Sobol` | Owen-scrambled Sobol sequence (Burley, JCGT 2020), the name's place in the alphabet is the dimension | none |
//!
//! The Sobol numbers have a resolution of 2⁻²⁴; within a step a number is uniform, from the same key.
use linkwork_runtime::noise;

/// Sampling method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampling {
    /// Independent random numbers.
    Random,
    /// Latin hypercube: one run in each of N intervals of equal probability, for every value.
    LatinHypercube,
    /// Sobol: a low-discrepancy sequence.
    Sobol,
}

impl Sampling {
    /// Returns its description in words.
    pub fn words(self) -> &'static str {
        match self {
            Sampling::Random => "random sampling",
            Sampling::LatinHypercube => "a Latin hypercube",
            Sampling::Sobol => "a Sobol sequence",
        }
    }
}

/// Largest number of runs of the Sobol sequence.
pub const SOBOL_RUNS: u64 = 1 << 16;

/// Largest number of values of the Sobol sequence.
pub const SOBOL_VALUES: usize = sobol_burley::NUM_DIMENSIONS as usize;

/// The numbers in (0, 1) of one value.
#[derive(Clone, Debug)]
pub struct Stream {
    key: u64,
    spread: Spread,
}

#[derive(Clone, Debug)]
enum Spread {
    Random,
    /// The permutation.
    Strata(Vec<u32>),
    /// Dimension and seed of the scrambling.
    Sobol(u32, u32),
}

impl Stream {
    /// Creates the numbers of the value `name`, the `k`-th in alphabetical order, in a campaign of `runs` runs with this seed. Cost: linear in `runs`
    /// for a Latin hypercube, else constant.
    pub fn new(how: Sampling, seed: u64, name: &str, k: usize, runs: u64) -> Stream {
        let key = noise::key(seed, &format!("value {name}"));
        let spread = match how {
            Sampling::Random => Spread::Random,
            Sampling::LatinHypercube => Spread::Strata(permutation(key, runs)),
            Sampling::Sobol => {
                let scramble = noise::key(seed, "sobol");
                Spread::Sobol(k as u32, (scramble ^ scramble >> 32) as u32)
            }
        };
        Stream { key, spread }
    }

    /// Returns the number of a run, in (0, 1).
    pub fn at(&self, run: u64) -> f64 {
        let within = noise::uniform(self.key, run, 0);
        let u = match &self.spread {
            Spread::Random => within,
            Spread::Strata(order) => (f64::from(order[run as usize]) + within) / order.len() as f64,
            Spread::Sobol(dimension, seed) => {
                let steps = f64::from(1u32 << 24);
                let x = sobol_burley::sample(run as u32, *dimension, *seed);
                ((f64::from(x) * steps).floor() + within) / steps
            }
        };
        u.clamp(f64::MIN_POSITIVE, 1.0 - f64::EPSILON / 2.0)
    }
}

/// Fisher–Yates shuffle with counter-based random numbers of a key.
fn permutation(key: u64, n: u64) -> Vec<u32> {
    let mut order: Vec<u32> = (0..n as u32).collect();
    for k in (1..order.len()).rev() {
        let j = (noise::uniform(key, k as u64, 1) * (k + 1) as f64) as usize;
        order.swap(k, j.min(k));
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(how: Sampling, name: &str, n: u64) -> Vec<f64> {
        let stream = Stream::new(how, 7, name, 0, n);
        (0..n).map(|r| stream.at(r)).collect()
    }

    #[test]
    fn every_stratum_of_a_hypercube_has_one_run_and_names_are_independent() {
        let n = 500;
        for name in ["a", "b"] {
            let mut strata: Vec<usize> = numbers(Sampling::LatinHypercube, name, n)
                .into_iter()
                .map(|u| (u * n as f64) as usize)
                .collect();
            assert!(strata.windows(2).any(|w| w[0] > w[1]), "in order");
            strata.sort_unstable();
            assert!(strata.into_iter().eq(0..n as usize));
        }
        let (a, b) =
            (numbers(Sampling::LatinHypercube, "a", n), numbers(Sampling::LatinHypercube, "b", n));
        let r: f64 =
            a.iter().zip(&b).map(|(x, y)| 12.0 * (x - 0.5) * (y - 0.5)).sum::<f64>() / n as f64;
        assert!(r.abs() < 3.0 / (n as f64).sqrt(), "correlation {r}");
    }

    /// The mean of f = Π 2 u over two values, whose exact value is 1: errors decrease as 1/√N for random numbers and faster for the others.
    #[test]
    fn sobol_integrates_better_than_random() {
        let n = 4096;
        let error = |how| {
            let (a, b) = (Stream::new(how, 3, "a", 0, n), Stream::new(how, 3, "b", 1, n));
            let sum: f64 = (0..n).map(|r| 4.0 * a.at(r) * b.at(r)).sum();
            (sum / n as f64 - 1.0).abs()
        };
        // The deviation of the product is 0.88, so the standard error is 0.0138.
        assert!(error(Sampling::Random) < 3.0 * 0.0138);
        assert!(error(Sampling::Sobol) < 1e-3, "{}", error(Sampling::Sobol));
    }

    #[test]
    fn sobol_fills_each_dyadic_interval_once() {
        let n = 256u64;
        let stream = Stream::new(Sampling::Sobol, 11, "x", 5, n);
        let mut cells: Vec<usize> = (0..n).map(|r| (stream.at(r) * n as f64) as usize).collect();
        cells.sort_unstable();
        assert!(cells.into_iter().eq(0..n as usize));
    }

    #[test]
    fn a_number_depends_on_seed_name_and_run_alone() {
        let few = numbers(Sampling::Random, "a", 10);
        let many = numbers(Sampling::Random, "a", 1000);
        assert_eq!(few[..], many[..10]);
        let other = Stream::new(Sampling::Random, 8, "a", 0, 10);
        assert!(few.iter().enumerate().all(|(r, u)| *u != other.at(r as u64)));
        assert!(few.iter().zip(numbers(Sampling::Random, "b", 10)).all(|(a, b)| *a != b));
        assert!(many.iter().all(|u| *u > 0.0 && *u < 1.0));
    }
}
