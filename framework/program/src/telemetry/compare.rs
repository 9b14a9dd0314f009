//! Differences between the flight data and the simulation, at the instants that both have.
use std::fmt;

/// Differences of one quantity: magnitudes.
#[derive(Clone, Debug, Default)]
pub struct DifferenceStatistics {
    /// Instants.
    pub count: u64,
    /// Number of differences at rows of the table.
    pub rows: u64,
    most: (f64, f64),
    squares: f64,
    last: (f64, f64),
}

impl DifferenceStatistics {
    /// Adds a magnitude at a time (s), in increasing order.
    pub fn take(&mut self, t: f64, size: f64, row: bool) {
        self.count += 1;
        self.rows += u64::from(row);
        // NaN counts as the largest value.
        if self.count == 1 || size.is_nan() || size > self.most.0 {
            self.most = (size, t);
        }
        self.squares += size * size;
        self.last = (size, t);
    }
}

/// Differences for printing: name, unit, and the SI value of the unit.
pub struct PrintedDifference<'a>(pub &'a str, pub &'a str, pub f64, pub &'a DifferenceStatistics);

impl fmt::Display for PrintedDifference<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let PrintedDifference(what, unit, scale, a) = *self;
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        let rms = (a.squares / a.count as f64).sqrt();
        write!(
            f,
            "{what}: at most {:.4e}{unit} apart at {} s, rms {:.4e}{unit}, {:.4e}{unit} at {} s",
            a.most.0 / scale,
            told(a.most.1),
            rms / scale,
            a.last.0 / scale,
            told(a.last.1)
        )
    }
}

/// Rounds a time (s) to nanoseconds, to remove binary fractions.
fn told(t: f64) -> f64 {
    (t * 1e9).round() / 1e9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn most_rms_and_last_are_those_of_the_sizes() {
        let mut a = DifferenceStatistics::default();
        for (t, x) in [(0.0, 3.0), (1.0, 4.0), (2.0, 0.0), (3.0, 12.0), (4.0, 0.0)] {
            a.take(t, x, t > 2.5);
        }
        assert_eq!((a.count, a.rows, a.most, a.last), (5, 2, (12.0, 3.0), (0.0, 4.0)));
        let text = PrintedDifference("x", "ft", 0.5, &a).to_string();
        let wanted = "x: at most 2.4000e1 ft apart at 3 s, rms 1.1628e1 ft, 0.0000e0 ft at 4 s";
        assert_eq!(text, wanted);
        let mut late = DifferenceStatistics::default();
        late.take(30.000_000_000_000_004, 1.0, true);
        assert!(PrintedDifference("x", "", 1.0, &late).to_string().ends_with("at 30 s"));
        a.take(5.0, f64::NAN, false);
        assert!(
            PrintedDifference("x", "", 1.0, &a).to_string().contains("at most NaN apart at 5 s")
        );
    }
}
