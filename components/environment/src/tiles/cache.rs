//! Tiles in memory: the most recently used ones.

/// A tile's heights in memory.
struct Slot {
    tile: usize,
    /// Counter value at its last use.
    used: u64,
    heights: Vec<f32>,
}

/// A limited number of tiles; a new tile replaces the least recently used one. Its content affects how long a query takes, but not
/// the result.
pub(super) struct Cache {
    slots: Vec<Slot>,
    most: usize,
    /// Slot of each tile, by number; the largest number: the tile is not in memory.
    places: Vec<u32>,
    now: u64,
    last: usize,
}

const NOWHERE: u32 = u32::MAX;

impl Cache {
    /// Creates a cache of at most this many of `tiles` tiles, at least one.
    pub fn new(most: usize, tiles: usize) -> Cache {
        let most = most.clamp(1, NOWHERE as usize - 1);
        Cache { slots: Vec::new(), most, places: vec![NOWHERE; tiles], now: 0, last: 0 }
    }

    /// Returns the heights of a tile; `fill` reads them if they are not in memory.
    pub fn tile<E>(
        &mut self,
        tile: usize,
        fill: impl FnOnce(&mut Vec<f32>) -> Result<(), E>,
    ) -> Result<&[f32], E> {
        self.now += 1;
        if let Some(slot) = self.slots.get(self.last)
            && slot.tile == tile
        {
            // Most queries are for the same tile as the previous one.
            self.slots[self.last].used = self.now;
            return Ok(&self.slots[self.last].heights);
        }
        let at = match self.places[tile] {
            NOWHERE => self.read(tile, fill)?,
            at => at as usize,
        };
        self.slots[at].used = self.now;
        self.last = at;
        Ok(&self.slots[at].heights)
    }

    fn read<E>(
        &mut self,
        tile: usize,
        fill: impl FnOnce(&mut Vec<f32>) -> Result<(), E>,
    ) -> Result<usize, E> {
        let oldest = || self.slots.iter().enumerate().min_by_key(|(_, s)| s.used).map(|(k, _)| k);
        let (at, mut heights) = match oldest() {
            Some(at) if self.slots.len() >= self.most => {
                // The previous tile of the slot is lost even if the new one cannot be read.
                let slot = &mut self.slots[at];
                // The slot does not have a tile if its last tile could not be read.
                if let Some(place) = self.places.get_mut(slot.tile) {
                    *place = NOWHERE;
                }
                slot.tile = usize::MAX;
                (at, std::mem::take(&mut slot.heights))
            }
            _ => (self.slots.len(), Vec::new()),
        };
        let read = fill(&mut heights);
        let slot = Slot { tile, used: self.now, heights };
        match read {
            Ok(()) if at < self.slots.len() => self.slots[at] = slot,
            Ok(()) => self.slots.push(slot),
            Err(e) => {
                if let Some(free) = self.slots.get_mut(at) {
                    (free.heights, free.used) = (slot.heights, 0);
                }
                return Err(e);
            }
        }
        self.places[tile] = at as u32;
        Ok(at)
    }

    /// Returns the number of tiles in memory.
    pub fn len(&self) -> usize {
        self.slots.iter().filter(|s| s.tile != usize::MAX).count()
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.slots.clear();
        self.places.fill(NOWHERE);
        self.last = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_one_asked_for_longest_ago_gives_way_and_failures_leave_nothing() {
        let mut cache = Cache::new(2, 5);
        let mut reads = Vec::new();
        let mut ask = |cache: &mut Cache, tile: usize| {
            let read = cache.tile(tile, |heights| {
                reads.push(tile);
                heights.clear();
                heights.push(tile as f32);
                if tile == 4 { Err("none") } else { Ok(()) }
            });
            read.map(|h| h[0])
        };
        for tile in [0, 1, 0, 0, 2, 0, 1] {
            assert_eq!(ask(&mut cache, tile), Ok(tile as f32));
        }
        assert_eq!(ask(&mut cache, 4), Err("none"));
        assert_eq!(cache.len(), 1);
        for tile in [1, 4, 3, 1] {
            assert_eq!(ask(&mut cache, tile).is_ok(), tile != 4);
        }
        // Tile 2 replaces 1, tile 1 replaces 2, and the failed read of 4 discards 0. Then 1 is in the cache, and
        // reading 4 fails in the free slot.
        assert_eq!(reads, [0, 1, 2, 1, 4, 4, 3]);
    }
}
