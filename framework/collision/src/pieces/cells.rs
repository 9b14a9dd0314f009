//! Cells of a grid, occupied or free, with one bit each in blocks of 4 × 4 × 4.

use super::Piece;
use crate::core::{Core, Poly};
use crate::error::ShapeFault;
use crate::shape::Occupancy;
use linkwork_multibody::spatial::Vec3;
use std::ops::{ControlFlow, Range};

/// Maximum number of cells.
pub(crate) const MOST: usize = 1 << 31;
/// Cells along an edge of a block.
const SIDE: usize = 4;
/// Round-off of a position divided by the edge, in cells.
const SLACK: f64 = 1e-6;

/// A voxel grid; the cell with the lowest indices has a corner at the origin.
#[derive(Clone, Debug)]
pub(crate) struct Cells {
    n: [usize; 3],
    edge: f64,
    blocks: [usize; 3],
    bits: Vec<u64>,
    count: usize,
    core: Core,
}

impl Cells {
    /// Creates a grid with `n` cells along x, y, z, of which the listed ones are occupied.
    pub fn new(n: [usize; 3], edge: f64, occupied: &[[u32; 3]]) -> Result<Self, Vec<ShapeFault>> {
        let mut faults = Vec::new();
        if !(edge > 0.0 && edge.is_finite()) {
            faults.push(ShapeFault::Size { what: "edge of a cell", value: edge });
        }
        let all = n.iter().try_fold(1usize, |all, n| all.checked_mul(*n));
        if !all.is_some_and(|all| (1..=MOST).contains(&all)) {
            faults.push(ShapeFault::Voxels { cells: n, most: MOST });
        }
        if !faults.is_empty() {
            return Err(faults);
        }
        let blocks = n.map(|n| n.div_ceil(SIDE));
        let bits = vec![0; blocks.iter().product()];
        let core = Core::Poly(Poly::cuboid(Vec3::repeat(0.5 * edge)));
        let mut new = Self { n, edge, blocks, bits, count: 0, core };
        new.set(occupied, Occupancy::Occupied).map_err(|f| vec![f])?;
        Ok(new)
    }

    /// Sets cells to occupied or free; after an error nothing has changed. O(cells), no allocation.
    pub fn set(&mut self, cells: &[[u32; 3]], to: Occupancy) -> Result<(), ShapeFault> {
        if let Some(index) = cells.iter().position(|c| self.place(*c).is_none()) {
            return Err(ShapeFault::Outside { index, cell: cells[index], cells: self.n });
        }
        let occupied = to == Occupancy::Occupied;
        for cell in cells {
            let Some((word, bit)) = self.place(*cell) else { continue };
            let was = self.bits[word] >> bit & 1 == 1;
            if was != occupied {
                self.bits[word] ^= 1 << bit;
                self.count = if occupied { self.count + 1 } else { self.count - 1 };
            }
        }
        Ok(())
    }

    /// Sets all cells to free.
    pub fn clear(&mut self) {
        self.bits.fill(0);
        self.count = 0;
    }

    /// Returns the state of a cell; `None` for one outside.
    pub fn get(&self, cell: [u32; 3]) -> Option<Occupancy> {
        let (word, bit) = self.place(cell)?;
        let occupied = self.bits[word] >> bit & 1 == 1;
        Some(if occupied { Occupancy::Occupied } else { Occupancy::Free })
    }

    /// Returns the number of cells along x, y, z.
    pub fn n(&self) -> [usize; 3] {
        self.n
    }

    fn place(&self, cell: [u32; 3]) -> Option<(usize, usize)> {
        let c = cell.map(|c| c as usize);
        if (0..3).any(|k| c[k] >= self.n[k]) {
            return None;
        }
        let (b, i) = (c.map(|c| c / SIDE), c.map(|c| c % SIDE));
        let word = (b[2] * self.blocks[1] + b[1]) * self.blocks[0] + b[0];
        Some((word, (i[2] * SIDE + i[1]) * SIDE + i[0]))
    }

    pub fn edge(&self) -> f64 {
        self.edge
    }

    pub fn count(&self) -> usize {
        self.count
    }

    pub fn core(&self) -> &Core {
        &self.core
    }

    pub fn bounds(&self) -> (Vec3, Vec3) {
        (Vec3::zeros(), Vec3::from(self.n.map(|n| n as f64 * self.edge)))
    }

    /// Returns the indices of cells that an interval overlaps or touches along one axis.
    fn range(&self, axis: usize, lo: f64, hi: f64) -> Range<usize> {
        let n = self.n[axis] as f64;
        // Casts saturate, and NaN becomes 0.
        let first = (lo / self.edge - SLACK).floor().clamp(0.0, n) as usize;
        let end = ((hi / self.edge + SLACK).floor() + 1.0).clamp(0.0, n) as usize;
        first..end
    }

    pub fn visit(
        &self,
        lo: &Vec3,
        hi: &Vec3,
        far: &mut impl FnMut(&Vec3, &Vec3) -> bool,
        each: &mut impl FnMut(&Piece) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let [x, y, z] = [0, 1, 2].map(|k| self.range(k, lo[k], hi[k]));
        if self.count == 0 || x.is_empty() || y.is_empty() || z.is_empty() {
            return ControlFlow::Continue(());
        }
        let of = |r: &Range<usize>| r.start / SIDE..r.end.div_ceil(SIDE);
        let side = SIDE as f64 * self.edge;
        for k in of(&z) {
            for j in of(&y) {
                let row = (k * self.blocks[1] + j) * self.blocks[0];
                for i in of(&x) {
                    let mut bits = self.bits[row + i];
                    if bits == 0 {
                        continue;
                    }
                    let low = Vec3::new(i as f64, j as f64, k as f64) * side;
                    if far(&low, &low.add_scalar(side)) {
                        continue;
                    }
                    while bits != 0 {
                        let bit = bits.trailing_zeros() as usize;
                        bits &= bits - 1;
                        let at = [
                            SIDE * i + bit % SIDE,
                            SIDE * j + bit / SIDE % SIDE,
                            SIDE * k + bit / (SIDE * SIDE),
                        ];
                        if !(x.contains(&at[0]) && y.contains(&at[1]) && z.contains(&at[2])) {
                            continue;
                        }
                        let centre = Vec3::from(at.map(|i| (i as f64 + 0.5) * self.edge));
                        let name = (at[2] * self.n[1] + at[1]) * self.n[0] + at[0];
                        each(&Piece { centre, round: 0.0, name: name as u64 })?;
                    }
                }
            }
        }
        ControlFlow::Continue(())
    }
}
