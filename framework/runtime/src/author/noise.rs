//! Counter-based noise: a pure function of (key, counter, lane). There is no generator state.
//!
//! Philox 4×32-10 (Salmon et al., "Parallel random numbers: as easy as 1, 2, 3", SC 2011).

const M: [u32; 2] = [0xD251_1F53, 0xCD9E_8D57];
const W: [u32; 2] = [0x9E37_79B9, 0xBB67_AE85];

/// Ten rounds of Philox 4×32.
pub fn philox(mut counter: [u32; 4], mut key: [u32; 2]) -> [u32; 4] {
    for round in 0..10 {
        if round > 0 {
            key = [key[0].wrapping_add(W[0]), key[1].wrapping_add(W[1])];
        }
        let p0 = u64::from(M[0]) * u64::from(counter[0]);
        let p1 = u64::from(M[1]) * u64::from(counter[2]);
        counter = [
            (p1 >> 32) as u32 ^ counter[1] ^ key[0],
            p1 as u32,
            (p0 >> 32) as u32 ^ counter[3] ^ key[1],
            p0 as u32,
        ];
    }
    counter
}

fn block(key: u64, n: u64, lane: u32, stream: u32) -> [u32; 4] {
    philox([n as u32, (n >> 32) as u32, lane, stream], [key as u32, (key >> 32) as u32])
}

fn unit(high: u32, low: u32) -> f64 {
    let bits = (u64::from(high) << 32 | u64::from(low)) >> 11;
    bits as f64 * (1.0 / (1u64 << 53) as f64)
}

/// Uniform in [0, 1).
pub fn uniform(key: u64, n: u64, lane: u32) -> f64 {
    let b = block(key, n, lane, 0);
    unit(b[0], b[1])
}

/// Standard normal (Box–Muller).
pub fn normal(key: u64, n: u64, lane: u32) -> f64 {
    let b = block(key, n, lane, 1);
    let (u, v) = (1.0 - unit(b[0], b[1]), unit(b[2], b[3]));
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

/// The key of a part: FNV-1a of the seed and the path, mixed.
pub fn key(seed: u64, path: &str) -> u64 {
    hash(path.bytes().chain(seed.to_le_bytes()))
}

/// A 64-bit FNV-1a hash, finished with a mix; the same on every machine.
pub fn hash(bytes: impl IntoIterator<Item = u8>) -> u64 {
    let mut h = 0xcbf2_9ce4_8422_2325u64;
    for b in bytes {
        h = (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3);
    }
    h ^= h >> 33;
    h = h.wrapping_mul(0xff51_afd7_ed55_8ccd);
    h ^ h >> 33
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Known answers published with the Random123 library.
    #[test]
    fn known_answers() {
        assert_eq!(philox([0; 4], [0; 2]), [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]);
        assert_eq!(
            philox([u32::MAX; 4], [u32::MAX; 2]),
            [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]
        );
    }

    #[test]
    fn moments_and_independence_of_lanes() {
        let n = 100_000u64;
        let k = key(7, "imu");
        let (mut sum, mut square, mut cross) = (0.0, 0.0, 0.0);
        for i in 0..n {
            let (a, b) = (normal(k, i, 0), normal(k, i, 1));
            sum += a;
            square += a * a;
            cross += a * b;
        }
        let n = n as f64;
        // The bounds are three standard errors.
        assert!((sum / n).abs() < 3.0 / n.sqrt(), "mean {}", sum / n);
        assert!((square / n - 1.0).abs() < 3.0 * (2.0 / n).sqrt(), "variance {}", square / n);
        assert!((cross / n).abs() < 3.0 / n.sqrt(), "covariance {}", cross / n);
    }
}
