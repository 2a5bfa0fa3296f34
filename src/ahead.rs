//! Memory ahead: pixels that are about to be drawn to are fetched together, before the first of them is needed.
//!
//! A small triangle touches a new cache line in each of its few rows, every row on another page: nothing that a processor's
//! own prefetching would see coming. One triangle after the other, the draw waits for each of these lines. The triangles of a
//! batch are neighbours, most often; so a pixel of each line that they lie in is read at once, and a dozen lines come in the
//! time of one.

use core::hint::black_box;

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
