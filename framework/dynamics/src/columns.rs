//! Spatial columns of a matrix in SIMD blocks, and the products of rows with them.
//!
//! A [`Columns`] holds one spatial vector for each degree of freedom, all about one point (the origin of the root link) and in world axes, so that no
//! vector has to be shifted for a product with a row. They are stored by component in blocks of [`Lane::PACK`]: a product of a row with a block takes
//! six multiply-adds for any block width.

use crate::dofs::Dofs;
use crate::lane::Lane;
use crate::linear::{V3, V6};
use std::ops::Range;

#[derive(Clone, Debug, Default)]
pub(crate) struct Columns<L: Lane> {
    pub blocks: Vec<V6<L::Block>>,
}

/// Returns the blocks that contain the columns of a range, with whole blocks at both ends.
#[inline(always)]
pub(crate) fn blocks<L: Lane>(columns: &Range<usize>) -> Range<usize> {
    columns.start / L::PACK..columns.end.div_ceil(L::PACK)
}

impl<L: Lane> Columns<L> {
    pub fn new(n: usize) -> Self {
        Self { blocks: vec![V6::default(); n.div_ceil(L::PACK)] }
    }

    #[inline(always)]
    pub fn get(&self, j: usize) -> V6<L> {
        let (b, i) = (&self.blocks[j / L::PACK], j % L::PACK);
        let v = |v: &V3<L::Block>| V3::new(L::get(&v.x, i), L::get(&v.y, i), L::get(&v.z, i));
        V6 { n: v(&b.n), f: v(&b.f) }
    }

    pub fn clear(&mut self) {
        self.blocks.fill(V6::default());
    }
}

impl<L: Lane> V3<L> {
    /// Returns the vector repeated for each number of a block.
    #[inline(always)]
    pub fn block(&self) -> V3<L::Block> {
        V3::new(self.x.block(), self.y.block(), self.z.block())
    }
}

impl<L: Lane> V6<L> {
    /// Returns the pair repeated for each number of a block.
    #[inline(always)]
    pub fn block(&self) -> V6<L::Block> {
        V6 { n: self.n.block(), f: self.f.block() }
    }

    /// Returns n · n' + f · f', computed as two independent sums, so that the dependency chain has three products instead of six.
    #[inline(always)]
    pub fn dot(&self, b: &Self) -> L {
        let angular = self.n.x.fma(b.n.x, self.n.y.fma(b.n.y, self.n.z * b.n.z));
        let linear = self.f.x.fma(b.f.x, self.f.y.fma(b.f.y, self.f.z * b.f.z));
        angular + linear
    }

    /// Returns `x − self · b`, with the same dependency chain as [`V6::dot`].
    #[inline(always)]
    pub fn dot_from(&self, b: &Self, x: L) -> L {
        let angular = self.n.x.fnma(b.n.x, self.n.y.fnma(b.n.y, self.n.z.fnma(b.n.z, x)));
        let linear = self.f.x.fma(b.f.x, self.f.y.fma(b.f.y, self.f.z * b.f.z));
        angular - linear
    }

    /// Returns `self * s`.
    #[inline(always)]
    pub fn scaled(self, s: L) -> Self {
        Self { n: self.n.scale(s), f: self.f.scale(s) }
    }

    /// Returns `self * s + b`.
    #[inline(always)]
    pub fn scale_add(self, s: L, b: Self) -> Self {
        Self { n: self.n.scale_add(s, b.n), f: self.f.scale_add(s, b.f) }
    }
}

impl<B: Lane> V6<B> {
    /// Returns number `i` of a block.
    #[inline(always)]
    pub fn lane<L: Lane<Block = B>>(&self, i: usize) -> V6<L> {
        let v = |v: &V3<B>| V3::new(L::get(&v.x, i), L::get(&v.y, i), L::get(&v.z, i));
        V6 { n: v(&self.n), f: v(&self.f) }
    }
}

/// A quantity by block of dofs that is summed inward, as N numbers.
pub(crate) trait Summed<B, const N: usize> {
    fn numbers(&self) -> [&B; N];
    fn numbers_mut(&mut self) -> [&mut B; N];
}

/// Adds the value of each dof to that of its parent, from tips to base. Within a link the value is copied, because only the last dof of a link has
/// its own value.
#[inline(always)]
pub(crate) fn sum_inward<L: Lane, T: Summed<L::Block, N>, const N: usize>(
    dofs: &Dofs,
    all: &mut [T],
    nv: usize,
) {
    for (j, parent) in dofs.parent[..nv].iter().enumerate().rev() {
        let Some(p) = parent.checked_sub(1).map(|p| p as usize) else { continue };
        let same_link = dofs.link[j] == dofs.link[p];
        let x = all[j / L::PACK].numbers().map(|x| L::get(x, j % L::PACK));
        let i = p % L::PACK;
        for (to, x) in all[p / L::PACK].numbers_mut().into_iter().zip(x) {
            let sum = if same_link { x } else { L::get(to, i) + x };
            L::set(to, i, sum);
        }
    }
}

/// Writes a block into a dense row at block `b`; positions beyond the row's end are dropped.
#[inline(always)]
pub(crate) fn store<L: Lane>(row: &mut [L], b: usize, x: L::Block) {
    let at = b * L::PACK;
    if at + L::PACK <= row.len() {
        L::store(x, &mut row[at..]);
    } else {
        for (i, to) in row[at..].iter_mut().enumerate() {
            *to = L::get(&x, i);
        }
    }
}

/// Reads a block of a dense row; positions beyond the row's end are zero.
#[inline(always)]
pub(crate) fn load<L: Lane>(row: &[L], b: usize) -> L::Block {
    let at = b * L::PACK;
    if at + L::PACK <= row.len() {
        L::load(&row[at..])
    } else {
        let mut x = L::Block::default();
        for (i, from) in row[at..].iter().enumerate() {
            L::set(&mut x, i, *from);
        }
        x
    }
}
