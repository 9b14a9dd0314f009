//! Heaps of displaced soil.

/// Settings of heaps of displaced soil.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heaps {
    /// Fraction of the displaced soil that is heaped.
    pub share: f64,
    /// Slope at which soil slides, rise over run.
    pub slope: f64,
}

/// The loaded nodes: first and last column and row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heap {
    pub(super) from: [i32; 2],
    pub(super) to: [i32; 2],
}

impl Heap {
    /// Creates the range with one node.
    pub fn at(i: i32, j: i32) -> Heap {
        Heap { from: [i, j], to: [i, j] }
    }

    /// Returns the range extended by a node.
    pub fn with(self, i: i32, j: i32) -> Heap {
        let ([x0, y0], [x1, y1]) = (self.from, self.to);
        Heap { from: [x0.min(i), y0.min(j)], to: [x1.max(i), y1.max(j)] }
    }
}
