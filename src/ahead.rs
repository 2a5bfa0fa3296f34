//! Memory ahead: pixels that are about to be drawn to are fetched together, before the first of them is needed.
//!
//! A small triangle touches a new cache line in each of its few rows, every row on another page: nothing that a processor's
//! own prefetching would see coming. One triangle after the other, the draw waits for each of these lines. The triangles of a
//! batch are neighbours, most often; so a pixel of each line that they lie in is read at once, and a dozen lines come in the
//! time of one.
//!
//! Where triangles of any size are scattered over a tile, its author knows more than a batch does: [`Rasterizer::prefetch`].

use core::hint::black_box;

use crate::depth::DepthTest;
use crate::interpolate::Varyings;
use crate::rasterizer::Rasterizer;
use crate::target::{Block, Borders, Framebuffer};

/// What is wider or higher is no neighbourhood: most of it would be fetched in vain.
const WIDEST: i32 = 512;
const HIGHEST: i32 = 32;

/// Bytes that come at a time.
const LINE: usize = 64;

/// Reads a pixel of each cache line in these bounds, which lie in the framebuffer's area: of depths, and of colours if they are
/// going to be `DRAWN`.
#[inline(always)]
pub(crate) fn fetch<F: Framebuffer, const DRAWN: bool>(target: &mut F, bounds: Borders) {
    let Borders { left, top, right, bottom } = bounds;
    let (width, height) = (right.saturating_sub(left), bottom.saturating_sub(top));
    if !(1..=WIDEST).contains(&width) || !(1..=HIGHEST).contains(&height) {
        return;
    }
    let (width, height) = (width as usize, height as usize);
    let Some(Block { color: colors, depth: depths, stride }) = target.block(left, top, width, height) else {
        return;
    };
    let largest = size_of::<F::Depth>().max(if DRAWN { size_of::<F::Color>() } else { 0 }).max(1);
    for_each_place(width, height, stride, (LINE / largest).max(1), |at| {
        if let (true, Some(&color)) = (DRAWN, colors.get(at)) {
            black_box(color);
        }
        if let Some(&depth) = depths.get(at) {
            black_box(depth);
        }
    });
}

impl<V: Varyings, T: DepthTest> Rasterizer<V, T> {
    /// Brings the pixels that a draw may touch (viewport ∩ scissor ∩ the framebuffer's area) into the cache, before triangles are
    /// drawn that lie scattered over them: row by row, it reads a colour and a depth in every 64 bytes. It changes nothing.
    ///
    /// A processor fetches memory by itself that is read in order, and waits for each row of a triangle that lies anywhere. So
    /// prefetch a tile if triangles are scattered over it that leave little of it out, and if its colours and depths fit in the
    /// second-level cache: with tiles of 0.6 to 1 megabyte, 10 000 blended triangles take 0.92 to 0.94 of the time, and 200 triangles
    /// that cross the screen, half of them slivers, 0.92 to 1.00.
    ///
    /// It is wasted for a few triangles that cover the tile, since their rows are in order already: two that fill the screen take 1.2
    /// times as long. So it is where the tile was cleared just before, or on a processor without a cache. Before a depth-only draw,
    /// colours are read in vain. Whole rows are asked for by [`Framebuffer::run`], which some framebuffers may take for a draw.
    ///
    /// # Examples
    /// ```
    /// use glam::Vec4;
    /// use halfplane::{Grid, Primitives, Rasterizer, Record, Rect, Surface, Viewport};
    /// # let positions = [Vec4::new(-1.0, -1.0, 0.5, 1.0), Vec4::new(1.0, -1.0, 0.5, 1.0), Vec4::new(0.0, 1.0, 0.5, 1.0)];
    /// # let mut records = [Record::default(); 4];
    /// # let mut memory = [0; 64];
    /// # let (mut color, mut depth) = ([0u32; 64 * 64], [1.0f32; 64 * 64]);
    /// let frame = Rect::of_size(64, 64);
    /// let grid = Grid::new(frame, 32, 16)?;
    /// let mut target = Surface::new(&mut color, &mut depth, 64, 64)?;
    /// let mut rasterizer = Rasterizer::<()>::new(Viewport::of_size(64, 64)?);
    /// let mut preparation = rasterizer.prepare(frame, Primitives::list(), &positions, ())?;
    /// let batch = preparation.fill(&mut records)?.unwrap_or_default();
    /// // (One batch, and room for it in the bins: `bin` shows the loop around this.)
    /// let bins = rasterizer.bin(&grid, batch, &mut memory)?;
    /// for (index, tile) in grid.tiles().enumerate() {
    ///     rasterizer.scissor = Some(tile);
    ///     rasterizer.prefetch(&mut target);
    ///     rasterizer.draw_prepared(&mut target, bins.tile(index), |_| 0xFF33_CC99);
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn prefetch<F: Framebuffer>(&self, target: &mut F) {
        let area = self.render_area(target);
        if area.is_empty() {
            return;
        }
        for y in area.y..area.bottom() {
            let run = target.run(area.x, y, area.width as usize);
            for_each_line(run.color, |&color| {
                black_box(color);
            });
            for_each_line(run.depth, |&depth| {
                black_box(depth);
            });
        }
    }
}

/// Visits an element of each cache line, all of those that are longer.
#[inline(always)]
fn for_each_line<T>(elements: &[T], mut visit: impl FnMut(&T)) {
    if size_of::<T>() == 0 || elements.is_empty() {
        return;
    }
    for_each_place(elements.len(), 1, 0, (LINE / size_of::<T>()).max(1), |at| {
        if let Some(element) = elements.get(at) {
            visit(element);
        }
    });
}

/// Visits a place of each line of `line` pixels, wherever lines begin: of each row the first, one for each `line`, and the last.
#[inline(always)]
fn for_each_place(width: usize, height: usize, stride: usize, line: usize, mut visit: impl FnMut(usize)) {
    for row in 0..height {
        let first = row.wrapping_mul(stride);
        for column in (0..width).step_by(line) {
            visit(first.wrapping_add(column));
        }
        visit(first.wrapping_add(width - 1));
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::target::{Rect, Run, Surface};
    use std::vec::Vec;

    /// A surface that keeps which blocks it was asked for.
    struct Asked<'a>(Surface<&'a mut [u32], &'a mut [u16]>, Vec<(i32, i32, usize, usize)>);

    impl Framebuffer for Asked<'_> {
        type Color = u32;
        type Depth = u16;

        fn area(&self) -> Rect {
            self.0.area()
        }

        fn run(&mut self, x: i32, y: i32, len: usize) -> Run<'_, u32, u16> {
            self.0.run(x, y, len)
        }

        fn block(&mut self, x: i32, y: i32, width: usize, height: usize) -> Option<Block<'_, u32, u16>> {
            self.1.push((x, y, width, height));
            self.0.block(x, y, width, height)
        }
    }

    #[test]
    fn neighbours_are_fetched_and_what_is_far_apart_is_not() {
        let (mut color, mut depth) = (std::vec![7u32; 600 * 40], std::vec![8u16; 600 * 40]);
        let mut target = Asked(Surface::new(&mut color, &mut depth, 600, 40).expect("it fits"), Vec::new());
        let bounds = |left, top, right, bottom| Borders { left, top, right, bottom };
        for (bounds, asked) in [
            (bounds(3, 5, 103, 9), Some((3, 5, 100, 4))),
            (bounds(0, 0, 512, 32), Some((0, 0, 512, 32))),
            (bounds(599, 39, 600, 40), Some((599, 39, 1, 1))),
            (bounds(0, 0, 513, 1), None),
            (bounds(0, 0, 1, 33), None),
            (bounds(5, 5, 5, 9), None),
            (bounds(5, 9, 7, 5), None),
            (bounds(i32::MAX, 0, i32::MIN, 1), None),
        ] {
            target.1.clear();
            fetch::<_, true>(&mut target, bounds);
            assert_eq!(target.1.first().copied(), asked, "{bounds:?}");
        }
        assert!(color.iter().all(|&pixel| pixel == 7) && depth.iter().all(|&depth| depth == 8), "only read");
    }

    #[test]
    fn a_tile_is_prefetched_row_by_row_and_nothing_else() {
        use crate::{Rasterizer, Viewport};

        /// A framebuffer that keeps which runs it was asked for, and lends up to nine pixels of each.
        struct Runs(Vec<(i32, i32, usize)>, [u64; 9]);

        impl Framebuffer for Runs {
            type Color = u64;
            type Depth = ();

            fn area(&self) -> Rect {
                Rect { x: 3, y: -2, width: 40, height: 9 }
            }

            fn run(&mut self, x: i32, y: i32, len: usize) -> Run<'_, u64, ()> {
                self.0.push((x, y, len));
                Run { color: &mut self.1[..len.min(9)], depth: &mut [] }
            }
        }

        let rows = |scissor| {
            let mut target = Runs(Vec::new(), [0; 9]);
            let mut rasterizer = Rasterizer::<()>::new(Viewport::of_size(30, 30).expect("valid"));
            rasterizer.scissor = scissor;
            rasterizer.prefetch(&mut target);
            target.0
        };
        assert_eq!(rows(None), (0..7).map(|y| (3, y, 27)).collect::<Vec<_>>(), "viewport and area");
        let tile = Rect { x: 5, y: 4, width: 10, height: 100 };
        assert_eq!(rows(Some(tile)), (4..7).map(|y| (5, y, 10)).collect::<Vec<_>>(), "a tile of it");
        assert_eq!(rows(Some(Rect { x: 100, ..tile })), [], "one beside it");
        assert_eq!(rows(Some(Rect { width: 0, ..tile })), [], "one without pixels");
    }

    #[test]
    fn each_element_of_a_line_or_more_is_read() {
        fn check<T: Copy>(element: T, expected: &[usize]) {
            let elements = [element; 40];
            let mut visited = Vec::new();
            for_each_line(&elements, |element| {
                let offset = core::ptr::from_ref(element) as usize - elements.as_ptr() as usize;
                visited.push(offset / size_of::<T>().max(1));
            });
            assert_eq!(visited, expected, "of {} bytes", size_of::<T>());
        }
        check(0u8, &[0, 39]);
        check(0u16, &[0, 32, 39]);
        check(0u32, &[0, 16, 32, 39]);
        check([0u8; 24], &(0..40).step_by(2).chain([39]).collect::<Vec<_>>());
        let all: Vec<_> = (0..40).chain([39]).collect();
        check([0u64; 8], &all);
        check([0u64; 9], &all);
        check((), &[]);
    }

    #[test]
    fn no_line_is_left_out() {
        for (width, height, stride, line) in
            [(1, 1, 1, 16), (15, 3, 40, 16), (100, 4, 103, 16), (33, 2, 33, 4), (7, 2, 9, 1)]
        {
            for offset in 0..line {
                let mut lines = Vec::new();
                for_each_place(width, height, stride, line, |at| lines.push((offset + at) / line));
                let touched =
                    (0..height).flat_map(|row| (0..width).map(move |x| (offset + row * stride + x) / line));
                assert!(
                    touched.clone().all(|line| lines.contains(&line)),
                    "{width} by {height} from {offset}"
                );
                assert!(lines.iter().all(|&line| touched.clone().any(|other| other == line)), "and no other");
            }
        }
    }
}
