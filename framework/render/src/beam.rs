//! Bounds of the rays of neighbouring pixels, so that geometry that none of them can hit is excluded once for all of them.
//! ```text
//! a ray of the beam is at o + t d,  o_lo ≤ o ≤ o_hi,  d_lo ≤ d ≤ d_hi by components, t ≥ 0
//! a box may be hit when for some t on every axis   o_lo + t d_lo ≤ b_hi  and  o_hi + t d_hi ≥ b_lo
//! ```

use linkwork_spatial::Vec3;

/// Componentwise bounds of origins and directions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beam {
    o: [Vec3; 2],
    d: [Vec3; 2],
}

impl Beam {
    /// Returns the bounds of rays; `None` without any.
    pub(crate) fn around(rays: impl Iterator<Item = (Vec3, Vec3)>) -> Option<Beam> {
        rays.fold(None, |beam: Option<Beam>, (o, d)| {
            let b = beam.unwrap_or(Beam { o: [o, o], d: [d, d] });
            let join = |[lo, hi]: [Vec3; 2], v: &Vec3| [lo.inf(v), hi.sup(v)];
            Some(Beam { o: join(b.o, &o), d: join(b.d, &d) })
        })
    }

    /// Returns the corner of a horizontal square that each ray reaches first: bit 0 in x, bit 1 in y; `None` when rays differ.
    pub(crate) fn near(&self) -> Option<usize> {
        let sign = |k: usize| match (self.d[0][k] < 0.0, self.d[1][k] < 0.0) {
            (a, b) if a == b => Some(usize::from(a)),
            _ => None,
        };
        Some(sign(0)? | sign(1)? << 1)
    }

    /// Returns true if some ray of the beam may hit a box. The result is conservative.
    pub(crate) fn meets(&self, lo: &Vec3, hi: &Vec3) -> bool {
        let (mut from, mut to) = (0.0f64, f64::INFINITY);
        // c ≤ w, with a margin for round-off.
        let mut limit = |c: f64, w: f64| {
            let w = w + 1e-9 * (1.0 + w.abs());
            if c > 0.0 {
                to = to.min(w / c);
            } else if c < 0.0 {
                from = from.max(w / c);
            } else if w < 0.0 {
                to = -1.0;
            }
        };
        for k in 0..3 {
            limit(self.d[0][k], hi[k] - self.o[0][k]);
            limit(-self.d[1][k], self.o[1][k] - lo[k]);
        }
        from <= to * (1.0 + 1e-12)
    }
}
