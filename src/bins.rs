//! Bins: which records touch which tile of a grid.
//!
//! Without them each tile looks at every record, if only to skip it. With them it looks at those whose triangles have no
//! edge that excludes it, which is decided exactly, at the tile's corners: a sliver across the frame touches the tiles along
//! it and not its whole bounding box. A triangle of which the bounding box, as far as it is seen, lies in one tile is not
//! tested further.
//!
//! The memory is the caller's, one slice of `u32` (compressed sparse rows, filled in two passes):
//!
//! ```text
//!   one number a tile: where its entries end    entries: numbers of records, tile by tile
//!   ┌────┬────┬────┬────┐┌────┬────┬────┬────┬────┬────┬────┬──────────────┐
//!   │  3 │  3 │  4 │  7 ││  0 │  2 │  5 │  5 │  1 │  2 │  5 │   not used   │
//!   └────┴────┴────┴────┘└────┴────┴────┴────┴────┴────┴────┴──────────────┘
//!                           tile 0         │ 2  │ tile 3
//! ```

use core::slice;

use crate::depth::DepthTest;
use crate::interpolate::Varyings;
use crate::prepared::Record;
use crate::project::Projector;
use crate::rasterizer::Rasterizer;
use crate::setup::Setup;
use crate::target::Rect;
use crate::tiles::{Grid, TileRange};

/// Records by tile: see [`Rasterizer::bin`].
#[derive(Clone, Copy, Debug)]
pub struct Bins<'r, 'm, V> {
    records: &'r [Record<V>],
    /// How many of the records are in the bins.
    len: usize,
    /// Where each tile's entries end.
    ends: &'m [u32],
    entries: &'m [u32],
}

/// Why records cannot be binned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum BinError {
    /// The memory might not take a single record.
    TooShort {
        /// How long the slice is.
        len: usize,
        /// How long it must be at least.
        needed: usize,
    },
}

impl core::fmt::Display for BinError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match *self {
            Self::TooShort { len, needed } => {
                write!(f, "bins need {needed} numbers of memory at least, not {len}")
            }
        }
    }
}

impl core::error::Error for BinError {}

impl Grid {
    /// How many `u32` of memory bins of so many tiles and entries take: `tiles + entries`.
    ///
    /// A record has one entry in each tile that it touches: of small triangles little more than one, of a triangle with
    /// a bounding box of w × h pixels at most ⌈w / tile width + 1⌉ · ⌈h / tile height + 1⌉. The least that
    /// [`Rasterizer::bin`] accepts is `bin_memory(tiles, tiles)`: then any single record fits.
    ///
    /// ```
    /// # use halfplane::Grid;
    /// static MEMORY: [u32; Grid::bin_memory(8 * 8, 1000)] = [0; 1064];
    /// # let _ = MEMORY;
    /// ```
    #[must_use]
    pub const fn bin_memory(tiles: usize, entries: usize) -> usize {
        tiles.saturating_add(entries)
    }
}

impl<'r, 'm, V> Bins<'r, 'm, V> {
    /// The records that touch tile `index` of the grid, in the order in which they were given. Empty when there is no
    /// such tile.
    #[inline]
    #[must_use]
    pub fn tile(&self, index: usize) -> Binned<'r, 'm, V> {
        let start = index.checked_sub(1).map_or(Some(&0), |before| self.ends.get(before));
        let entries = match (start, self.ends.get(index)) {
            (Some(&start), Some(&end)) => self.entries.get(start as usize..end as usize).unwrap_or_default(),
            _ => &[],
        };
        Binned { records: self.records, entries: entries.iter() }
    }

    /// How many of the records, from the first one on, are in the bins.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether none is.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The other records: those that the memory did not suffice for.
    #[must_use]
    pub fn rest(&self) -> &'r [Record<V>] {
        self.records.get(self.len..).unwrap_or_default()
    }

    /// How many entries all tiles have together: how often a record touches a tile.
    #[must_use]
    pub fn entries(&self) -> usize {
        self.entries.len()
    }
}

/// The records that touch a tile: see [`Bins::tile`].
#[derive(Clone, Debug)]
pub struct Binned<'r, 'm, V> {
    records: &'r [Record<V>],
    entries: slice::Iter<'m, u32>,
}

impl<'r, V> Iterator for Binned<'r, '_, V> {
    type Item = &'r Record<V>;

    #[inline(always)]
    fn next(&mut self) -> Option<&'r Record<V>> {
        self.records.get(*self.entries.next()? as usize)
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        self.entries.size_hint()
    }
}

impl<V> ExactSizeIterator for Binned<'_, '_, V> {}

/// Clipping leaves at most ten corners of a triangle, which are eight triangles.
const MAX_PIECES: usize = 8;

/// Calls `visit` with each tile that a record touches, until it says no. Whether it never did.
#[inline(always)]
fn touched<V: Copy>(
    record: &Record<V>,
    grid: &Grid,
    area: Rect,
    projector: Projector,
    mut visit: impl FnMut(usize) -> bool,
) -> bool {
    let Some(bounds) = record.bounds() else {
        return touched_by_pieces(record, grid, area, projector, &mut visit);
    };
    let area = area.borders();
    if !bounds.overlaps(area) {
        return true;
    }
    let range = grid.range(bounds.intersection(area));
    if range.is_one() {
        return visit(grid.index_at(range.left, range.top));
    }
    let Some(setup) = record.setup() else { return true };
    let edges = setup.edges();
    touched_of(range, grid, |tile| !edges.iter().any(|edge| edge.excludes(tile)), visit)
}

/// As [`touched`], of a triangle that is clipped into several.
#[cold]
#[inline(never)]
fn touched_by_pieces<V: Copy>(
    record: &Record<V>,
    grid: &Grid,
    area: Rect,
    projector: Projector,
    visit: &mut impl FnMut(usize) -> bool,
) -> bool {
    let mut pieces: [Option<Setup>; MAX_PIECES] = [None; MAX_PIECES];
    let (mut places, mut bounds) = (pieces.iter_mut(), None::<Rect>);
    record.for_each_setup(projector, |setup| {
        let of_piece = setup.bounds().intersection(area);
        if !of_piece.is_empty() {
            bounds = Some(bounds.map_or(of_piece, |bounds| bounds.union(of_piece)));
            if let Some(place) = places.next() {
                *place = Some(*setup);
            }
        }
    });
    let Some(bounds) = bounds else { return true };
    let range = grid.range(bounds.borders());
    let is_touched = |tile: Rect, piece: &Setup| {
        !tile.intersection(piece.bounds()).is_empty() && !piece.edges().iter().any(|edge| edge.excludes(tile))
    };
    touched_of(range, grid, |tile| pieces.iter().flatten().any(|piece| is_touched(tile, piece)), visit)
}

/// As [`touched`], of the tiles in some columns and rows, given which of them are.
#[inline(always)]
fn touched_of(
    range: TileRange,
    grid: &Grid,
    is_touched: impl Fn(Rect) -> bool,
    mut visit: impl FnMut(usize) -> bool,
) -> bool {
    for row in range.top..=range.bottom {
        for column in range.left..=range.right {
            if is_touched(grid.tile_at(column, row)) && !visit(grid.index_at(column, row)) {
                return false;
            }
        }
    }
    true
}

impl<V: Varyings, T: DepthTest> Rasterizer<V, T> {
    /// Finds out which records touch which tile, so that a tile draws only what it shows: a triangle touches a tile of which
    /// no edge excludes every sample, and the one tile that its bounding box lies in, as far as it is seen.
    ///
    /// `memory` must be [`Grid::bin_memory`] long. When it is too short for all records, as many of the first ones as
    /// fit are in the bins, and [`Bins::rest`] are the others: draw the tiles, and go on with those. Each tile has its
    /// records in the order given, so that the picture is the same in one go or many.
    ///
    /// The records are those of this rasterizer. Several threads can each bin records of their own; a tile then draws
    /// from all bins, in order. Where nobody wants to go on later, each tile may look at all that are left instead:
    /// `bins.tile(index).chain(bins.rest())` is always the right picture, and only slower when the memory is too short.
    ///
    /// # Errors
    /// When `memory` has fewer than twice as many numbers as the grid has tiles.
    ///
    /// # Examples
    /// ```
    /// use halfplane::{Grid, Primitives, Rasterizer, Record, Rect, Surface, Viewport, glam::Vec4};
    /// # let positions = [(-1.0, -1.0), (1.0, -1.0), (0.0, 1.0)].map(|(x, y)| Vec4::new(x, y, 0.5, 1.0)).repeat(9);
    /// let frame = Rect::of_size(64, 64);
    /// let grid = Grid::new(frame, 16, 16)?;
    /// let rasterizer = Rasterizer::<()>::new(Viewport::of_size(64, 64)?);
    /// let (mut tiles, mut depth) = ([0u32; 64 * 64], [1.0f32; 64 * 64]);
    /// let mut surfaces: Vec<_> = grid.surfaces(&mut tiles[..], &mut depth[..])?.collect();
    ///
    /// let mut records = [Record::default(); 8];
    /// let mut memory = [0; Grid::bin_memory(16, 50)];
    /// let mut preparation = rasterizer.prepare(frame, Primitives::list(), &positions[..], ())?;
    /// while let Some(mut batch) = preparation.fill(&mut records)? {
    ///     while !batch.is_empty() {
    ///         let bins = rasterizer.bin(&grid, batch, &mut memory)?;
    ///         for (index, tile) in surfaces.iter_mut().enumerate() {
    ///             rasterizer.draw_prepared(tile, bins.tile(index), |fragment| fragment.primitive_index());
    ///         }
    ///         batch = bins.rest();
    ///     }
    /// }
    /// # let drawn = depth.iter().filter(|&&depth| depth == 0.5).count();
    /// # assert_eq!(drawn, 64 * 64 / 2);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[inline(never)]
    pub fn bin<'r, 'm>(
        &self,
        grid: &Grid,
        records: &'r [Record<V>],
        memory: &'m mut [u32],
    ) -> Result<Bins<'r, 'm, V>, BinError> {
        let needed = Grid::bin_memory(grid.len(), grid.len());
        let error = BinError::TooShort { len: memory.len(), needed };
        if memory.len() < needed {
            return Err(error);
        }
        let (ends, entries) = memory.split_at_mut_checked(grid.len()).ok_or(error)?;
        let (projector, area) = (self.projector(), self.viewport.pixels().intersection(grid.area()));
        // Numbers are 32 bits.
        let room = entries.len().min(u32::MAX as usize);
        let countable = records.get(..u32::MAX as usize).unwrap_or(records);

        // Count.
        ends.fill(0);
        let (mut len, mut total) = (0, 0);
        for record in countable {
            let before = total;
            let fits = touched(record, grid, area, projector, |tile| {
                if total == room {
                    return false;
                }
                if let Some(count) = ends.get_mut(tile) {
                    *count += 1;
                }
                total += 1;
                true
            });
            if !fits {
                // Take back what was counted of this one.
                touched(record, grid, area, projector, |tile| {
                    if total == before {
                        return false;
                    }
                    if let Some(count) = ends.get_mut(tile) {
                        *count -= 1;
                    }
                    total -= 1;
                    true
                });
                break;
            }
            len += 1;
        }

        // Where each tile's entries start, and, when all are there, end.
        let mut sum = 0;
        for end in ends.iter_mut() {
            let count = *end;
            *end = sum;
            sum += count;
        }
        for (number, record) in (0u32..).zip(records.get(..len).unwrap_or_default()) {
            touched(record, grid, area, projector, |tile| {
                if let Some(end) = ends.get_mut(tile) {
                    if let Some(entry) = entries.get_mut(*end as usize) {
                        *entry = number;
                    }
                    *end += 1;
                }
                true
            });
        }
        let entries: &'m [u32] = entries;
        Ok(Bins { records, len, ends, entries: entries.get(..total).unwrap_or_default() })
    }
}
