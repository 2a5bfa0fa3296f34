//! Tiles: a frame cut into equal rectangles, and memory in which each tile has a piece of its own.
//!
//! Rows of a frame in ordinary memory lie side by side, so tiles of it interleave and cannot be lent to several threads.
//! *Tile-linear* memory has one tile after the other:
//!
//! ```text
//!   frame of 7 × 5, tiles of 4 × 3              memory: 4 · 3 pixels a tile
//!   ┌───────┬─────┐
//!   │   0   │  1  │        tile 0          tile 1          tile 2          tile 3
//!   ├───────┼─────┤        ████████████    ███·███·███·    ████████····    ███·███·····
//!   │   2   │  3  │
//!   └───────┴─────┘        pixel (x, y) of tile t: t · 12 + (y mod 3) · 4 + x mod 4
//! ```

use core::num::NonZeroU32;

use crate::depth::DepthFormat;
use crate::target::{Borders, DOMAIN, Plane, Rect, Surface, SurfaceError};

/// A rectangle cut into tiles of one size, those at the right and at the bottom perhaps smaller; numbered row by row.
///
/// # Examples
/// ```
/// use halfplane::{Grid, Rect};
/// let grid = Grid::new(Rect::of_size(7, 5), 4, 3)?;
/// assert_eq!((grid.columns(), grid.rows(), grid.len()), (2, 2, 4));
/// assert_eq!(grid.tile(3), Some(Rect { x: 4, y: 3, width: 3, height: 2 }));
/// assert_eq!(grid.tile(4), None);
/// # Ok::<(), halfplane::GridError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    area: Rect,
    /// Not 0, which is said by their types: so nothing here can divide by zero, and no code is there for it.
    tile_width: NonZeroU32,
    tile_height: NonZeroU32,
    columns: u32,
    rows: u32,
}

/// Why a [`Grid`] cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum GridError {
    /// Tiles without pixels.
    EmptyTile {
        /// The width of a tile.
        width: u32,
        /// The height of a tile.
        height: u32,
    },
    /// The rectangle reaches out of −16384 .. 16384, where no sample is ever covered.
    OutOfRange {
        /// The rectangle.
        area: Rect,
    },
}

impl core::fmt::Display for GridError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match *self {
            Self::EmptyTile { width, height } => {
                write!(f, "a tile must have pixels, but one of {width}x{height} has none")
            }
            Self::OutOfRange { area } => SurfaceError::OutOfRange { area }.fmt(f),
        }
    }
}

impl core::error::Error for GridError {}

/// The tiles in columns `left ..= right` of rows `top ..= bottom`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TileRange {
    pub(crate) left: u32,
    pub(crate) top: u32,
    pub(crate) right: u32,
    pub(crate) bottom: u32,
}

impl TileRange {
    /// Whether it is a single tile.
    #[inline(always)]
    pub(crate) fn is_one(&self) -> bool {
        self.left == self.right && self.top == self.bottom
    }
}

impl Grid {
    /// Cuts `area` into tiles. A tile larger than `area` is as large as it.
    ///
    /// # Errors
    /// When a tile has no pixels, or `area` reaches out of −16384 .. 16384.
    pub fn new(area: Rect, tile_width: u32, tile_height: u32) -> Result<Self, GridError> {
        let (Some(width), Some(height)) = (NonZeroU32::new(tile_width), NonZeroU32::new(tile_height)) else {
            return Err(GridError::EmptyTile { width: tile_width, height: tile_height });
        };
        if area.intersection(DOMAIN) != area && !area.is_empty() {
            return Err(GridError::OutOfRange { area });
        }
        let area = if area.is_empty() { Rect::default() } else { area };
        let up_to = |tile: NonZeroU32, side| tile.min(NonZeroU32::new(side).unwrap_or(NonZeroU32::MIN));
        let (tile_width, tile_height) = (up_to(width, area.width), up_to(height, area.height));
        let (columns, rows) =
            (area.width.div_ceil(tile_width.get()), area.height.div_ceil(tile_height.get()));
        Ok(Self { area, tile_width, tile_height, columns, rows })
    }

    /// What is cut.
    #[must_use]
    pub const fn area(&self) -> Rect {
        self.area
    }

    /// How many tiles lie side by side.
    #[must_use]
    pub const fn columns(&self) -> u32 {
        self.columns
    }

    /// How many rows of tiles there are.
    #[must_use]
    pub const fn rows(&self) -> u32 {
        self.rows
    }

    /// How many tiles there are.
    #[must_use]
    pub const fn len(&self) -> usize {
        (self.columns as usize).saturating_mul(self.rows as usize)
    }

    /// Whether there are none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// How many pixels a whole tile has: what each takes in tile-linear memory, smaller ones too.
    #[must_use]
    pub const fn tile_len(&self) -> usize {
        (self.tile_width.get() as usize).saturating_mul(self.tile_height.get() as usize)
    }

    /// The pixels of tile `index`, row by row from the top left; `None` when there are fewer tiles.
    #[must_use]
    pub fn tile(&self, index: usize) -> Option<Rect> {
        let index = u32::try_from(index).ok().filter(|_| index < self.len())?;
        Some(self.tile_at(index.checked_rem(self.columns)?, index.checked_div(self.columns)?))
    }

    /// The pixels of every tile.
    pub fn tiles(&self) -> impl Iterator<Item = Rect> + use<> {
        let grid = *self;
        (0..grid.rows).flat_map(move |row| (0..grid.columns).map(move |column| grid.tile_at(column, row)))
    }

    /// The tile in this column and row, which exist.
    #[inline(always)]
    pub(crate) fn tile_at(&self, column: u32, row: u32) -> Rect {
        // Both products are at most the area's size.
        let (left, top) =
            (column.wrapping_mul(self.tile_width.get()), row.wrapping_mul(self.tile_height.get()));
        Rect {
            x: self.area.x.wrapping_add_unsigned(left),
            y: self.area.y.wrapping_add_unsigned(top),
            width: self.tile_width.get().min(self.area.width.saturating_sub(left)),
            height: self.tile_height.get().min(self.area.height.saturating_sub(top)),
        }
    }

    /// The index of the tile in this column and row.
    #[inline(always)]
    pub(crate) fn index_at(&self, column: u32, row: u32) -> usize {
        row as usize * self.columns as usize + column as usize
    }

    /// The tiles that share pixels with a rectangle, which lies in [`area`](Self::area) and is not empty.
    #[inline(always)]
    pub(crate) fn range(&self, Borders { left, top, right, bottom }: Borders) -> TileRange {
        let column = |x: i32| x.abs_diff(self.area.x) / self.tile_width;
        let row = |y: i32| y.abs_diff(self.area.y) / self.tile_height;
        TileRange { left: column(left), top: row(top), right: column(right - 1), bottom: row(bottom - 1) }
    }

    /// Tile-linear memory as one [`Surface`] for each tile. They share nothing and keep the frame's coordinates.
    ///
    /// # Errors
    /// When a plane has fewer than [`len`](Self::len) · [`tile_len`](Self::tile_len) elements.
    ///
    /// # Examples
    /// ```
    /// use halfplane::{Absent, Grid, Primitives, Rasterizer, Rect, Viewport, glam::Vec4};
    /// let grid = Grid::new(Rect::of_size(64, 64), 16, 16)?;
    /// let mut tiles = [0u8; 64 * 64];
    /// let rasterizer = Rasterizer::<()>::new(Viewport::of_size(64, 64)?);
    /// let positions = [Vec4::new(-1.0, -1.0, 0.5, 1.0), Vec4::new(1.0, -1.0, 0.5, 1.0), Vec4::new(0.0, 1.0, 0.5, 1.0)];
    /// for mut tile in grid.surfaces(&mut tiles[..], Absent::default())? {
    ///     rasterizer.draw(&mut tile, Primitives::list(), &positions, (), |_| 1)?; // or prepared triangles, in threads
    /// }
    /// let mut frame = [0u8; 64 * 64];
    /// grid.copy_to_rows(&tiles, &mut frame, 64)?;
    /// assert_eq!((frame[63 * 64], frame[63 * 64 + 63], frame[0]), (1, 1, 0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn surfaces<C: Plane, D: Plane<Item: DepthFormat>>(
        &self,
        color: C,
        depth: D,
    ) -> Result<TileSurfaces<C, D>, SurfaceError> {
        let needed = self.len().saturating_mul(self.tile_len());
        for (plane, len) in [("color", color.len()), ("depth", depth.len())] {
            if len < needed {
                return Err(SurfaceError::TooShort { plane, len, needed });
            }
        }
        Ok(TileSurfaces { grid: *self, next: 0, rest: Some((color, depth)) })
    }

    /// Copies tile-linear pixels to where they belong in rows of `stride` pixels, the first at the top left of
    /// [`area`](Self::area).
    ///
    /// # Errors
    /// When a slice is too short, or the stride is less than the width.
    pub fn copy_to_rows<C: Copy>(
        &self,
        tiles: &[C],
        frame: &mut [C],
        stride: usize,
    ) -> Result<(), SurfaceError> {
        let needed = self.len().saturating_mul(self.tile_len());
        if tiles.len() < needed {
            return Err(SurfaceError::TooShort { plane: "color", len: tiles.len(), needed });
        }
        // Only to have the frame checked.
        Surface::with_planes(&mut *frame, crate::target::Absent::default(), self.area, stride)?;
        for (tile, pixels) in self.tiles().zip(tiles.chunks(self.tile_len().max(1))) {
            let (left, top) = (tile.x.abs_diff(self.area.x) as usize, tile.y.abs_diff(self.area.y) as usize);
            let width = tile.width as usize;
            let rows = frame.chunks_mut(stride.max(1)).skip(top).take(tile.height as usize);
            for (to, from) in rows.zip(pixels.chunks(self.tile_width.get() as usize)) {
                if let (Some(to), Some(from)) = (to.get_mut(left..left + width), from.get(..width)) {
                    to.copy_from_slice(from);
                }
            }
        }
        Ok(())
    }
}

/// The tiles of tile-linear memory, in order: see [`Grid::surfaces`].
#[derive(Debug)]
pub struct TileSurfaces<C, D> {
    grid: Grid,
    next: usize,
    rest: Option<(C, D)>,
}

impl<C: Plane, D: Plane<Item: DepthFormat>> Iterator for TileSurfaces<C, D> {
    type Item = Surface<C, D>;

    fn next(&mut self) -> Option<Self::Item> {
        let area = self.grid.tile(self.next)?;
        self.next += 1;
        let (color, depth) = self.rest.take()?;
        let ((color, rest_color), (depth, rest_depth)) =
            (color.split(self.grid.tile_len()), depth.split(self.grid.tile_len()));
        self.rest = Some((rest_color, rest_depth));
        Surface::with_planes(color, depth, area, self.grid.tile_width.get() as usize).ok()
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.grid.len().saturating_sub(self.next);
        (left, Some(left))
    }
}

impl<C: Plane, D: Plane<Item: DepthFormat>> ExactSizeIterator for TileSurfaces<C, D> {}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::target::{Absent, Framebuffer};
    use std::vec::Vec;

    #[test]
    fn tiles_cover_every_pixel_once() {
        for (area, width, height) in [
            (Rect { x: -3, y: 5, width: 7, height: 5 }, 4, 3),
            (Rect::of_size(8, 8), 1, 8),
            (Rect::of_size(8, 8), u32::MAX, 3),
            (Rect::of_size(0, 8), 2, 2),
            (Rect { x: i32::MAX, y: 0, width: 0, height: u32::MAX }, 2, 2),
        ] {
            let grid = Grid::new(area, width, height).expect("legal");
            let mut tiles = std::vec![0u8; grid.len() * grid.tile_len()];
            let mut counts = std::vec![0u8; area.width as usize * 8];
            for mut tile in grid.surfaces(&mut tiles[..], Absent::default()).expect("it fits") {
                for (y, x) in
                    (area.y..area.bottom()).flat_map(|y| (area.x..area.right()).map(move |x| (y, x)))
                {
                    if tile.area().contains(x, y) {
                        tile.run(x, y, 1).color[0] += 1;
                        counts[(y - area.y) as usize * area.width as usize + (x - area.x) as usize] += 1;
                    }
                }
            }
            let used = counts.len().min((area.width * area.height.min(8)) as usize);
            assert!(counts[..used].iter().all(|&count| count == 1), "{grid:?} {counts:?}");
            let mut frame = std::vec![7u8; used];
            grid.copy_to_rows(&tiles, &mut frame, area.width as usize).expect("it fits");
            assert_eq!(frame, counts[..used], "{grid:?}");
            let listed: Vec<Rect> = (0..grid.len()).filter_map(|i| grid.tile(i)).collect();
            assert_eq!(listed, grid.tiles().collect::<Vec<_>>(), "{grid:?}");
        }
    }

    #[test]
    fn what_is_wrong_is_told() {
        let area = Rect::of_size(20_000, 1);
        assert_eq!(Grid::new(area, 8, 8), Err(GridError::OutOfRange { area }), "too far");
        let error = Grid::new(Rect::of_size(8, 8), 8, 0).expect_err("no pixels");
        assert_eq!(std::format!("{error}"), "a tile must have pixels, but one of 8x0 has none", "told");
        let grid = Grid::new(Rect::of_size(8, 8), 5, 5).expect("legal");
        let mut short = [0u8; 99];
        let error = grid.surfaces(&mut short[..], Absent::default()).expect_err("4 tiles of 25");
        assert_eq!(error, SurfaceError::TooShort { plane: "color", len: 99, needed: 100 }, "tile memory");
        let tiles = [0u8; 100];
        let error = grid.copy_to_rows(&tiles, &mut short, 7).expect_err("7 < 8");
        assert_eq!(error, SurfaceError::StrideTooSmall { stride: 7, width: 8 }, "stride");
        let error = grid.copy_to_rows(&tiles, &mut short[..63], 8).expect_err("63 < 64");
        assert_eq!(error, SurfaceError::TooShort { plane: "color", len: 63, needed: 64 }, "frame");
        assert!(grid.copy_to_rows(&short, &mut [0; 64], 8).is_err(), "tiles");
    }

    #[test]
    fn surfaces_can_be_sent_to_threads() {
        fn is_send<T: Send>(_: &T) {}
        let mut tiles = [0u8; 4];
        is_send(&Surface::color_only(&mut tiles, 2, 2).expect("it fits"));
    }
}
