//! Data of the contact problem: groups of rows with their cones, the factor of the compliance, and the input checks.
//!
//! ```text
//! rows of a group touch few degrees of freedom:   E_g (rows × entries)
//! y = Eᵀ λ                                        one number for each degree of freedom
//! v_g = E_g y + b_g + R_g λ_g                     velocity after, targets folded into b
//! ```

use super::error::ContactError;

/// The possible impulses of a group of rows, and the required velocities. v is the velocity after the impulses minus its target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cone {
    /// Bilateral rows: v = 0, impulses of any sign.
    Equality {
        /// 1 to 4 rows.
        rows: usize,
    },
    /// One row: 0 ≤ λ ⊥ v ≥ 0. Used for joint limits and contacts without friction.
    Unilateral,
    /// One row: |λ| ≤ bound, and λ = −bound sign(v) if v ≠ 0. Dry friction of a hinge.
    Dry {
        /// Largest impulse of the row (N s or N m s), not negative.
        bound: f64,
    },
    /// Three rows (normal, two tangents), exact isotropic Coulomb friction: 0 ≤ λn ⊥ vn ≥ 0, |λt| ≤ μ λn, and λt = −μ λn vt/|vt| if vt ≠ 0.
    Coulomb {
        /// μ, not negative.
        friction: f64,
    },
    /// Four rows: the rows of `Coulomb`, and the spin about the normal: |λs| ≤ μs λn, and λs = −μs λn sign(vs) if vs ≠ 0.
    Spinning {
        /// μ, not negative.
        friction: f64,
        /// μs (m): torque about the normal per newton of normal force, not negative.
        spin: f64,
    },
}

impl Cone {
    /// Returns the number of rows, 1 to 4.
    #[inline]
    pub fn rows(&self) -> usize {
        match *self {
            Cone::Equality { rows } => rows,
            Cone::Unilateral | Cone::Dry { .. } => 1,
            Cone::Coulomb { .. } => 3,
            Cone::Spinning { .. } => 4,
        }
    }

    /// Returns the parameters that must be finite and not negative, with their names.
    fn numbers(&self) -> [(&'static str, f64); 2] {
        match *self {
            Cone::Equality { .. } | Cone::Unilateral => [("", 0.0); 2],
            Cone::Dry { bound } => [("bound", bound), ("", 0.0)],
            Cone::Coulomb { friction } => [("friction", friction), ("", 0.0)],
            Cone::Spinning { friction, spin } => [("friction", friction), ("spin", spin)],
        }
    }
}

/// The factor of the compliance of the rows: W = E Eᵀ. Group g has the entries `start[g]..start[g + 1]` of `dof` and `e`.
#[derive(Clone, Copy, Debug)]
pub struct Factor<'a> {
    /// First entry of each group; groups + 1 numbers, the first 0.
    pub start: &'a [u32],
    /// Degree of freedom of each entry, ascending within a group.
    pub dof: &'a [u32],
    /// One number for each row of the group, for each entry; unused lanes are 0.
    pub e: &'a [[f64; 4]],
    /// Number of degrees of freedom.
    pub dofs: usize,
}

/// A checked problem: all numbers finite, all indices in range.
#[derive(Clone, Copy, Debug)]
pub struct Problem<'a> {
    pub(crate) factor: Factor<'a>,
    pub(crate) cones: &'a [Cone],
    pub(crate) b: &'a [[f64; 4]],
    pub(crate) r: &'a [[f64; 4]],
    pub(crate) scale: f64,
}

impl<'a> Problem<'a> {
    /// Creates and checks a problem. `b`: free velocities minus their targets (m/s or rad/s), four numbers per group; unused lanes are ignored. `r`:
    /// compliance of the rows (velocity per unit of impulse), not negative; empty if all rows are rigid. O(entries).
    ///
    /// # Errors
    /// The first wrong length or index; otherwise the first number that is not finite, or is negative where that is not allowed.
    pub fn new(
        factor: Factor<'a>,
        cones: &'a [Cone],
        b: &'a [[f64; 4]],
        r: &'a [[f64; 4]],
    ) -> Result<Self, ContactError> {
        let groups = cones.len();
        same("b", groups, b.len())?;
        if !r.is_empty() {
            same("r", groups, r.len())?;
        }
        shape(&factor, groups)?;
        let mut scale = 0.0f64;
        for (g, cone) in cones.iter().enumerate() {
            let rows = cone.rows();
            if !(1..=4).contains(&rows) {
                return Err(ContactError::Rows { group: g, rows });
            }
            for (what, value) in cone.numbers() {
                if !(value >= 0.0 && value.is_finite()) {
                    return Err(ContactError::Negative { group: g, what, value });
                }
            }
            for k in 0..rows {
                if !b[g][k].is_finite() {
                    let (what, value) = ("free velocity", b[g][k]);
                    return Err(ContactError::NotFinite { group: g, row: k, what, value });
                }
                scale = scale.max(b[g][k].abs());
                let value = r.get(g).map_or(0.0, |r| r[k]);
                if !(value >= 0.0 && value.is_finite()) {
                    let what = "compliance";
                    return Err(ContactError::Negative { group: g, what, value });
                }
            }
            entries(&factor, g, rows)?;
        }
        let scale = if scale > 0.0 { scale } else { 1.0 };
        Ok(Problem { factor, cones, b, r, scale })
    }

    /// Creates an unchecked problem with rigid rows. The unit of residuals is 1 until it is [`scaled`](Problem::scaled). NaN is detected when the
    /// compliances are computed.
    pub(crate) fn trusted(factor: Factor<'a>, cones: &'a [Cone], b: &'a [[f64; 4]]) -> Self {
        Problem { factor, cones, b, r: &[], scale: 1.0 }
    }

    /// Sets the unit of residuals to this velocity (m/s or rad/s) instead of the largest |b|. Use it if b contains targets that do not indicate how
    /// fast things move, such as gaps that are far from closing. A value that is not finite or not above 0 is ignored.
    #[must_use]
    pub fn scaled(mut self, velocity: f64) -> Self {
        if velocity > 0.0 && velocity.is_finite() {
            self.scale = velocity;
        }
        self
    }

    /// Returns the number of groups.
    pub fn groups(&self) -> usize {
        self.cones.len()
    }

    /// Returns the number of rows of all groups.
    pub fn rows(&self) -> usize {
        self.cones.iter().map(Cone::rows).sum()
    }

    /// Returns the degrees of freedom and factor of a group.
    #[inline(always)]
    pub(crate) fn entries(&self, g: usize) -> (&'a [u32], &'a [[f64; 4]]) {
        let (first, last) = (self.factor.start[g] as usize, self.factor.start[g + 1] as usize);
        (&self.factor.dof[first..last], &self.factor.e[first..last])
    }

    /// Returns the compliance of the rows of a group; unused lanes are 0.
    #[inline(always)]
    pub(crate) fn soft(&self, g: usize) -> [f64; 4] {
        if self.r.is_empty() { [0.0; 4] } else { masked(self.r[g], self.cones[g].rows()) }
    }

    /// Computes E_g y.
    #[inline(always)]
    pub(crate) fn gathered(&self, g: usize, y: &[f64]) -> [f64; 4] {
        let (dof, e) = self.entries(g);
        let mut sum = [[0.0; 4]; 4];
        let (mut ds, mut es) = (dof.chunks_exact(4), e.chunks_exact(4));
        for (d, e) in ds.by_ref().zip(es.by_ref()) {
            for j in 0..4 {
                sum[j] = axpy4(y[d[j] as usize], &e[j], sum[j]);
            }
        }
        for (&d, e) in ds.remainder().iter().zip(es.remainder()) {
            sum[0] = axpy4(y[d as usize], e, sum[0]);
        }
        std::array::from_fn(|k| (sum[0][k] + sum[1][k]) + (sum[2][k] + sum[3][k]))
    }

    /// Computes y += E_gᵀ λ.
    #[inline(always)]
    pub(crate) fn scatter(&self, g: usize, impulse: &[f64; 4], y: &mut [f64]) {
        let (dof, e) = self.entries(g);
        for (&d, e) in dof.iter().zip(e) {
            y[d as usize] += dot4(e, impulse);
        }
    }
}

fn same(what: &'static str, expected: usize, found: usize) -> Result<(), ContactError> {
    if expected == found { Ok(()) } else { Err(ContactError::Length { what, expected, found }) }
}

fn shape(factor: &Factor, groups: usize) -> Result<(), ContactError> {
    same("start", groups + 1, factor.start.len())?;
    same("e", factor.dof.len(), factor.e.len())?;
    if factor.start[0] != 0 {
        return Err(ContactError::Start { group: 0 });
    }
    if let Some(g) = (0..groups).find(|&g| factor.start[g] > factor.start[g + 1]) {
        return Err(ContactError::Start { group: g });
    }
    same("dof", factor.start[groups] as usize, factor.dof.len())
}

/// Checks that indices ascend and are in range, and that numbers are finite, and 0 in unused lanes.
fn entries(factor: &Factor, g: usize, rows: usize) -> Result<(), ContactError> {
    let range = factor.start[g] as usize..factor.start[g + 1] as usize;
    let (dof, e) = (&factor.dof[range.clone()], &factor.e[range]);
    let rising = dof.windows(2).all(|d| d[0] < d[1]);
    if !rising || dof.last().is_some_and(|&d| d as usize >= factor.dofs) {
        return Err(ContactError::Dof { group: g, dofs: factor.dofs });
    }
    let sum = e.iter().fold([0.0; 4], |s: [f64; 4], e| std::array::from_fn(|k| s[k] + e[k].abs()));
    for k in 0..4 {
        if k >= rows && sum[k] > 0.0 {
            return Err(ContactError::Lanes { group: g, rows });
        }
        // A sum may overflow although all numbers are finite.
        let bad = || e.iter().map(|e| e[k]).find(|x| !x.is_finite());
        if !sum[k].is_finite()
            && let Some(value) = bad()
        {
            return Err(ContactError::NotFinite { group: g, row: k, what: "factor", value });
        }
    }
    Ok(())
}

/// Returns the first `rows` lanes, and 0 in the others.
#[inline(always)]
pub(crate) fn masked(x: [f64; 4], rows: usize) -> [f64; 4] {
    std::array::from_fn(|k| if k < rows { x[k] } else { 0.0 })
}

/// Computes a b + c, with one rounding if the processor supports it.
#[inline(always)]
pub(crate) fn fma(a: f64, b: f64, c: f64) -> f64 {
    if cfg!(target_feature = "fma") { a.mul_add(b, c) } else { a * b + c }
}

/// Computes a x + y in four lanes.
#[inline(always)]
pub(crate) fn axpy4(a: f64, x: &[f64; 4], y: [f64; 4]) -> [f64; 4] {
    std::array::from_fn(|k| fma(a, x[k], y[k]))
}

/// Computes x · y in four lanes.
#[inline(always)]
pub(crate) fn dot4(x: &[f64; 4], y: &[f64; 4]) -> f64 {
    fma(x[0], y[0], x[2] * y[2]) + fma(x[1], y[1], x[3] * y[3])
}
