//! SPK segments of modified difference lines, as in JPL's small-body integrations: types 1 and 21.
//!
//! NAIF, *SPK Required Reading*; F. T. Krogh, *Changing Stepsize in the Integration of Differential Equations Using Modified Divided Differences*, 1974:
//! ```text
//! record    reference epoch, D stepsizes, position and velocity there (x, ẋ, y, ẏ, z, ż), 3 · D differences, greatest order + 1, three orders
//! segment   N records, N last epochs, a directory of every hundredth epoch, [type 21: D,] N        type 1: D = 15
//! ```

use linkwork_spatial::Vec3;

/// Maximum number of differences per axis.
const ORDER_MAX: usize = 25;

/// Difference lines with increasing last epochs.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Differences {
    /// Last epoch of each record, TDB seconds past J2000.
    ends: Vec<f64>,
    records: Vec<f64>,
    /// Number of differences per axis, D.
    order: usize,
}

impl Differences {
    /// Reads the words of a segment. The error is the fact.
    pub(super) fn read(words: Vec<f64>, kind: i32) -> Result<Differences, String> {
        let n = words.len();
        let count = words[n - 1] as usize;
        let (order, tail) = if kind == 1 { (15, 1) } else { (words[n - 2] as usize, 2) };
        if !(1..=ORDER_MAX).contains(&order) {
            return Err(format!("{order} differences per axis"));
        }
        let size = 4 * order + 11;
        let rest = count.saturating_add(count / 100 + tail);
        if count == 0 || count.checked_mul(size).and_then(|n| n.checked_add(rest)) != Some(n) {
            return Err(format!("{count} records of {size} numbers do not match its length"));
        }
        let whole = |x: f64, low: usize, high: usize| {
            x.fract() == 0.0 && (low as f64..=high as f64).contains(&x)
        };
        for r in words[..count * size].chunks_exact(size) {
            let orders = &r[size - 4..];
            if !whole(orders[0], 2, order + 1) || !orders[1..].iter().all(|q| whole(*q, 0, order)) {
                return Err(format!("invalid orders of differences {orders:?}"));
            }
        }
        let ends = words[count * size..][..count].to_vec();
        let mut records = words;
        records.truncate(count * size);
        Ok(Differences { ends, records, order })
    }

    /// Returns position (km) and velocity (km/s).
    pub(super) fn at(&self, et: f64) -> [Vec3; 2] {
        let d = self.order;
        let size = 4 * d + 11;
        let k = self.ends.partition_point(|end| *end < et).min(self.ends.len() - 1);
        let r = &self.records[k * size..][..size];
        let (steps, reference) = (&r[1..=d], &r[d + 1..d + 7]);
        let differences = |axis: usize| &r[d + 7 + axis * d..][..d];
        let top = r[size - 4] as usize;
        let orders = [1, 2, 3].map(|k| r[size - 4 + k] as usize);
        let h = et - r[0];
        // These are the coefficients of the interpolating polynomial, and their integrals w.
        let (mut f, mut g) = ([1.0; ORDER_MAX + 2], [0.0; ORDER_MAX + 2]);
        let mut ahead = h;
        for j in 0..top - 2 {
            f[j + 1] = ahead / steps[j];
            g[j] = h / steps[j];
            ahead = h + steps[j];
        }
        let mut w = [0.0; 2 * ORDER_MAX + 4];
        for (j, w) in w.iter_mut().enumerate().take(top + 1).skip(1) {
            *w = 1.0 / j as f64;
        }
        let (mut ks, mut jx) = (top - 1, 0);
        while ks >= 2 {
            jx += 1;
            for j in 1..=jx {
                w[j + ks] = f[j] * w[j + ks - 1] - g[j - 1] * w[j + ks];
            }
            ks -= 1;
        }
        let sum = |axis: usize, w: &[f64], ks: usize| -> f64 {
            (1..=orders[axis]).rev().map(|j| differences(axis)[j - 1] * w[j + ks]).sum()
        };
        let (mut p, mut v) = (Vec3::zeros(), Vec3::zeros());
        for axis in 0..3 {
            let [x, rate] = [reference[2 * axis], reference[2 * axis + 1]];
            p[axis] = x + h * (rate + h * sum(axis, &w, ks));
        }
        for j in 1..=jx {
            w[j + ks] = f[j] * w[j + ks - 1] - g[j - 1] * w[j + ks];
        }
        ks -= 1;
        for axis in 0..3 {
            v[axis] = reference[2 * axis + 1] + h * sum(axis, &w, ks);
        }
        [p, v]
    }
}
