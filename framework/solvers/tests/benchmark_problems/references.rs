//! Results of others for the IFToMM problems, with their sources.
//!
//! *Published* numbers are from Exudyn's public repository, from the test models named below. The others were computed with Exudyn 1.13 by
//! `tests/benches/peers/exudyn_references.py`, which models each problem independently, and prints values at three steps h, h/2, h/4 and their limit
//! (4 x(h/2) − x(h))/3 for second order. The difference of the last two limits is stated for each, and tests do not require more precision.

/// Steps of `FOUR_BARS_PUBLISHED`, s.
pub const FOUR_BARS_STEPS: [f64; 4] = [1e-3, 5e-4, 2.5e-4, 1.25e-4];

/// A02 with two windows at 10 s: B0 as [x, y, ẋ, ẏ]. Published in `fourBarMechanismIftomm`: generalised
/// alpha, spectral radius 0.95.
pub const FOUR_BARS_PUBLISHED: [[f64; 4]; 4] = [
    [0.328_411_237_2, 0.944_534_837_5, 1.422_958_522, -0.494_756_589_4],
    [0.328_446_511_4, 0.944_522_572_1, 1.423_028_497, -0.494_841_072],
    [0.328_455_211_3, 0.944_519_546_7, 1.423_045_728, -0.494_861_902_1],
    [0.328_457_376_8, 0.944_518_793_7, 1.423_050_003, -0.494_867_082_7],
];

/// A02: windows, time (s), B0 as above, and its uncertainty. Exudyn 1.13, generalised alpha with spectral radius 0.95 (two windows) or 0.9, limit of
/// 1, 0.5 and 0.25 ms.
pub const FOUR_BARS: [(usize, f64, [f64; 4], f64); 3] = [
    (2, 10.0, [0.328_458_111_773, 0.944_518_538_116, 1.423_051_470_806, -0.494_868_845_99], 3e-9),
    (10, 10.0, [0.204_353_520_183, 0.978_897_154_359, 1.186_679_946_215, -0.247_730_032_94], 1e-7),
    (40, 1.5, [-0.622_202_100_651, 0.782_856_657_345, 1.885_826_715_78, 1.498_825_274_078], 8e-9),
];

/// A04 at 1 s: the norm of all coordinates of five bodies, each with the displacement of its first pin and the change of its Euler parameters.
/// Published in `bricardMechanism` at steps of 1 ms as 4.172 189 649 307 425, which is the sum of this norm, one degree of freedom, one redundant row
/// and a zero eigenvalue.
pub const BRICARD_NORM_PUBLISHED: f64 = 4.172_189_649_307_425 - 2.0;

/// The same norm from Exudyn 1.13, without numerical damping and with Newton's method to round-off: at steps of 1 ms, and the limit of 1, 0.5 and
/// 0.25 ms, which has an uncertainty of 1e-11.
pub const BRICARD_NORM: [f64; 2] = [2.172_189_603_046, 2.172_190_977_588];

/// Uncertainty of `BRICARD`, m: the difference of the last two limits at 10 s.
pub const BRICARD_SURE: f64 = 2e-8;

/// A04: P3 (m) at 1, 2 … 10 s. Exudyn 1.13, generalised alpha without damping, limit of 0.5, 0.25 and
/// 0.125 ms.
pub const BRICARD: [[f64; 3]; 10] = [
    [0.510_501_461_181, -1.649_167_599_397, 0.140_123_114_55],
    [-0.969_340_344_779, -1.221_246_894_951, 0.754_278_010_786],
    [-0.967_199_800_047, -1.228_020_214_678, 0.745_983_176_171],
    [0.524_899_593_398, -1.643_876_001_334, 0.148_835_846_12],
    [0.999_999_997_738, -1.000_067_257_7, 0.999_932_740_038],
    [0.495_873_449_941, -1.654_324_512_274, 0.131_605_204_044],
    [-0.971_373_849_243, -1.214_541_874_858, 0.762_444_017_108],
    [-0.964_948_571_67, -1.234_859_545_231, 0.737_560_951_776],
    [0.539_064_288_477, -1.638_453_308_247, 0.157_735_378_347],
    [0.999_999_963_806, -1.000_269_012_72, 0.999_730_951_096],
];

/// A05 with K = 8e5 N/m, C = 4e4 N s/m, 2π rad/s: time (s), then s (m), the rod's angle from straight down (rad) and the shaft's rate (rad/s). From
/// Exudyn 1.13's kinematic tree with its RK44; steps of 80, 40 and 20 µs agree to 2e-12 except for the last row (1.2e-10). Four free bodies with
/// joints and generalised alpha (limit of 100, 50 and 25 µs) agree to 1.1e-9, so two of Exudyn's models confirm it.
pub const GOVERNOR: [(f64, [f64; 3]); 8] = [
    (0.1, [0.523_836_475_57, 1.074_622_457_719, 6.103_717_808_831]),
    (0.2, [0.585_079_811_821, 1.143_075_858_469, 5.722_380_645_6]),
    (0.3, [0.658_632_348_78, 1.222_572_849_243, 5.380_424_812_79]),
    (0.5, [0.743_249_424_786, 1.311_304_945_251, 5.103_415_421_971]),
    (1.0, [0.501_420_922_38, 1.048_963_025_169, 6.271_125_741_876]),
    (2.0, [0.505_909_294_297, 1.054_132_529_43, 6.236_223_614_436]),
    (5.0, [0.535_563_103_722, 1.087_921_750_208, 6.022_496_499_758]),
    (10.0, [0.619_622_917_062, 1.180_722_624_95, 5.548_203_622_653]),
];

/// Returns the limit of values at a step and at half of it, if the error is of second order.
pub fn limit(coarse: f64, fine: f64) -> f64 {
    fine + (fine - coarse) / 3.0
}

/// Returns the largest difference of two rows of numbers; NaN if any is NaN.
pub fn apart(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let worse = |w: f64, d: f64| if d.is_nan() || d > w { d } else { w };
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, worse)
}
