//! Gauss-Legendre rule with 8 nodes on −1 to 1 (exact for polynomials of degree 15).

/// Nodes, rising.
pub const NODES: [f64; 8] = [
    -0.9602898564975363,
    -0.7966664774136268,
    -0.525532409916329,
    -0.1834346424956498,
    0.1834346424956498,
    0.525532409916329,
    0.7966664774136268,
    0.9602898564975363,
];
/// Weights; they sum to 2.
pub const WEIGHTS: [f64; 8] = [
    0.10122853629037618,
    0.22238103445337445,
    0.3137066458778874,
    0.362683783378362,
    0.362683783378362,
    0.3137066458778874,
    0.22238103445337445,
    0.10122853629037618,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrates_degree_fifteen_exactly() {
        for k in 0..16 {
            let sum: f64 = NODES.iter().zip(WEIGHTS).map(|(x, w)| w * x.powi(k)).sum();
            let exact = if k % 2 == 0 { 2.0 / f64::from(k + 1) } else { 0.0 };
            assert!((sum - exact).abs() < 4e-15, "degree {k}: {sum} {exact}");
        }
    }
}
