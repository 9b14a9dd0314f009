//! Lookup tables with linear interpolation, clamped at their ends.
//! ```text
//! curve   y(x)       surface   z(x, y)      inside: share of the width to the nearest end, < 0 outside
//! ```

use linkwork_surroundings::prelude::BuildError;

/// Table over one variable.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    x: Vec<f64>,
    y: Vec<f64>,
}

/// Returns the index of the cell that contains `x` and the fraction within the cell, clamped.
fn cell(points: &[f64], x: f64) -> (usize, f64) {
    let n = points.len();
    if n == 1 {
        return (0, 0.0);
    }
    let k = points.partition_point(|p| *p <= x).clamp(1, n - 1) - 1;
    let f = (x - points[k]) / (points[k + 1] - points[k]);
    // NaN is propagated.
    (k, f.clamp(0.0, 1.0))
}

/// Returns the distance of `x` to the nearer end, relative to the width; 1 for a single point.
fn inside(points: &[f64], x: f64) -> f64 {
    let (first, last) = (points[0], points[points.len() - 1]);
    if points.len() == 1 { 1.0 } else { (x - first).min(last - x) / (last - first) }
}

fn rising(points: &[f64], param: &str) -> Result<(), BuildError> {
    if points.is_empty() {
        return Err(BuildError::new("the table is empty").help("write at least one row").at(param));
    }
    if let Some(k) = points.windows(2).position(|w| !(w[1] > w[0])) {
        let fact = format!("{} is not greater than the preceding {}", points[k + 1], points[k]);
        return Err(BuildError::new(fact)
            .help("write each value once, in ascending order")
            .at(param));
    }
    Ok(())
}

impl Curve {
    /// Creates a table from rows (x, y); `param` is the parameter that messages name.
    ///
    /// # Errors
    /// There are no rows, or x is not strictly increasing.
    pub fn new(rows: &[[f64; 2]], param: &str) -> Result<Curve, BuildError> {
        let x: Vec<f64> = rows.iter().map(|r| r[0]).collect();
        rising(&x, param)?;
        Ok(Curve { x, y: rows.iter().map(|r| r[1]).collect() })
    }

    /// Checks that no value is negative or NaN; `what` names the quantity in the message.
    ///
    /// # Errors
    /// A value is negative or NaN; the message contains the first one and its x.
    pub fn not_negative(self, what: &str, param: &str) -> Result<Curve, BuildError> {
        let Some(k) = self.y.iter().position(|y| !(*y >= 0.0)) else { return Ok(self) };
        let fact = format!("{what} is {} at {}, but it must not be negative", self.y[k], self.x[k]);
        Err(BuildError::new(fact)
            .help("a negative value would accelerate the body; write 0 or more")
            .at(param))
    }

    /// Returns the interpolated value; beyond the ends the value at the end.
    pub fn at(&self, x: f64) -> f64 {
        let (k, f) = cell(&self.x, x);
        if self.x.len() == 1 { self.y[0] } else { self.y[k] + f * (self.y[k + 1] - self.y[k]) }
    }

    /// Returns the distance of `x` to the nearer end, relative to the width; negative outside.
    pub fn inside(&self, x: f64) -> f64 {
        inside(&self.x, x)
    }

    /// Returns the first and the last x.
    pub fn ends(&self) -> [f64; 2] {
        [self.x[0], self.x[self.x.len() - 1]]
    }

    /// Returns ∫ y dx from the first row to `x`; y is constant beyond the ends.
    pub fn integral(&self, x: f64) -> f64 {
        let n = self.x.len();
        let mut sum = self.y[0] * (x - self.x[0]).min(0.0);
        for k in 1..n {
            let end = x.clamp(self.x[k - 1], self.x[k]);
            sum += 0.5 * (self.y[k - 1] + self.at(end)) * (end - self.x[k - 1]);
        }
        sum + self.y[n - 1] * (x - self.x[n - 1]).max(0.0)
    }

    /// Returns the x at which the integral reaches `sum`, for a curve without negative values; the last x if it is never reached.
    pub fn reaches(&self, sum: f64) -> f64 {
        let (mut low, mut high) = (self.x[0], self.x[self.x.len() - 1]);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if self.integral(middle) < sum { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }
}

/// Table over two variables.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    x: Vec<f64>,
    y: Vec<f64>,
    z: Vec<f64>,
}

impl Surface {
    /// Creates a table with the value `rows[i][j]` at `x[i]`, `y[j]`. With an empty `y` the single column is used for every y.
    ///
    /// # Errors
    /// The points are not strictly increasing, or the size of the rows does not match them.
    pub fn new(
        (x, x_name): (&[f64], &str),
        (y, y_name): (&[f64], &str),
        (rows, name): (&[Vec<f64>], &str),
    ) -> Result<Surface, BuildError> {
        rising(x, x_name)?;
        let y = if y.is_empty() { &[0.0] } else { y };
        rising(y, y_name)?;
        let wrong = |fact: String, help: String| Err(BuildError::new(fact).help(help).at(name));
        if rows.len() != x.len() {
            let fact = format!("{} rows for {} values of `{x_name}`", rows.len(), x.len());
            return wrong(fact, format!("write one row for each value of `{x_name}`"));
        }
        if let Some(k) = rows.iter().position(|r| r.len() != y.len()) {
            let (found, wanted) = (rows[k].len(), y.len());
            let fact = format!("row {} has {found} numbers, not {wanted}", k + 1);
            return wrong(fact, format!("write one number for each value of `{y_name}`"));
        }
        Ok(Surface { x: x.to_vec(), y: y.to_vec(), z: rows.concat() })
    }

    /// Returns the interpolated value; beyond the ends the value at the end.
    pub fn at(&self, x: f64, y: f64) -> f64 {
        let ((i, f), (j, g)) = (cell(&self.x, x), cell(&self.y, y));
        let n = self.y.len();
        let (i1, j1) = ((i + 1).min(self.x.len() - 1), (j + 1).min(n - 1));
        let row = |i: usize| self.z[i * n + j] * (1.0 - g) + self.z[i * n + j1] * g;
        row(i) * (1.0 - f) + row(i1) * f
    }

    /// Returns the least distance of the point to an end, relative to the widths; negative outside.
    pub fn inside(&self, x: f64, y: f64) -> f64 {
        inside(&self.x, x).min(inside(&self.y, y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_below_zero_are_refused_where_they_would_push() {
        let curve = |y: f64| Curve::new(&[[0.5, 1.0], [2.0, y]], "drag").unwrap();
        assert!(curve(0.0).not_negative("C_D", "drag").is_ok());
        for y in [-0.1, f64::NAN] {
            let e = curve(y).not_negative("C_D", "drag").err().unwrap();
            assert!(e.message.contains("at 2") && e.param.as_deref() == Some("drag"));
        }
    }

    #[test]
    fn a_curve_is_linear_between_rows_and_level_beyond() {
        let c = Curve::new(&[[1.0, 2.0], [3.0, 6.0], [4.0, 0.0]], "rows").unwrap();
        for (x, y) in [(0.0, 2.0), (1.0, 2.0), (2.0, 4.0), (3.0, 6.0), (3.25, 4.5), (9.0, 0.0)] {
            assert_eq!(c.at(x), y, "{x}");
        }
        assert!((c.inside(2.0) - 1.0 / 3.0).abs() < 1e-15 && (c.inside(4.6) + 0.2).abs() < 1e-15);
        assert_eq!(c.ends(), [1.0, 4.0]);
        assert!(c.at(f64::NAN).is_nan());
        // The integral is 8 up to x = 3, and 3 more up to x = 4.
        assert!((c.integral(3.0) - 8.0).abs() < 1e-15 && (c.integral(5.0) - 11.0).abs() < 1e-15);
        assert!((c.integral(0.0) + 2.0).abs() < 1e-15);
        assert!((c.integral(c.reaches(5.0)) - 5.0).abs() < 1e-12);
    }

    #[test]
    fn a_surface_is_linear_in_each_variable() {
        let rows = [vec![1.0, 2.0, 4.0], vec![3.0, 5.0, 9.0]];
        let make = |x: &[f64], y: &[f64], z: &[Vec<f64>]| {
            Surface::new((x, "alpha"), (y, "mach"), (z, "table"))
        };
        let s = make(&[0.0, 2.0], &[0.0, 1.0, 3.0], &rows).unwrap();
        for (x, y, z) in
            [(0.0, 0.0, 1.0), (2.0, 3.0, 9.0), (1.0, 0.5, 2.75), (1.0, 2.0, 5.0), (-1.0, 9.0, 4.0)]
        {
            assert!((s.at(x, y) - z).abs() < 1e-15, "{x} {y}: {}", s.at(x, y));
        }
        let column = make(&[0.0, 2.0], &[], &[vec![1.0], vec![2.0]]).unwrap();
        assert_eq!((column.at(1.0, 77.0), column.inside(1.0, 77.0)), (1.5, 0.5));
        for (e, param, phrase) in [
            (make(&[0.0, 0.0], &[], &rows), "alpha", "is not greater than"),
            (make(&[0.0], &[0.0, 1.0, 3.0], &rows), "table", "2 rows for 1"),
            (make(&[0.0, 1.0], &[0.0, 1.0], &rows), "table", "row 1 has 3 numbers"),
        ] {
            let e = e.unwrap_err();
            assert!(e.message.contains(phrase) && e.help.is_some(), "{}", e.message);
            assert_eq!(e.param.as_deref(), Some(param));
        }
    }
}
