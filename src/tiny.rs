//! Triangles of up to 8 × 16 pixels: of a fine mesh, nearly all of them.
//!
//! Inside of such a triangle's bounds no edge function exceeds 2²³, width by height in subpixels, and no sum on the way to
//! it 2²⁴: `f32` holds all of them exactly. So nothing is solved, and a step is as good as a product. A row is one window
//! of eight samples, one in each SIMD lane, whose coverage and depth are worked out from its own edge functions. Those
//! that pass are bits, and the fragments of all rows are put one after the other into one packet.
//!
//! Rows are computed in glam's `Vec4`, which is SIMD on every target that has it: out of plain arrays of eight, compilers
//! made something else for odd lanes.

#![expect(clippy::cast_possible_truncation, reason = "a window is eight samples wide")]

use glam::Vec4;

use crate::depth::{DepthFormat, DepthTest, passes};
use crate::fragment::Shading;
use crate::interpolate::Varyings;
use crate::plane::LanePlane;
use crate::setup::Setup;
use crate::target::Borders;
use crate::triple::each;

/// Samples in a window.
pub(crate) const WINDOW: usize = 8;

/// The most rows of a tiny triangle.
pub(crate) const ROWS: usize = 16;

/// Half of them: the lanes of these windows are as many as a word has bits.
pub(crate) const HALF: usize = ROWS / 2;

/// Some of the lanes of a tiny triangle's windows, a bit each from the lowest on: of the first [`HALF`] rows, and of the
/// others.
pub(crate) type Lanes = [u64; 2];

/// Whether a triangle's fragments start from their own edge functions, and not from those at an anchor.
#[inline(always)]
pub(crate) fn is_tiny(setup: &Setup) -> bool {
    let [a, b, c] = setup.corners();
    let extent = |a: i32, b: i32, c: i32| a.max(b).max(c) - a.min(b).min(c);
    extent(a.x(), b.x(), c.x()) <= (WINDOW as i32) << 8 && extent(a.y(), b.y(), c.y()) <= (ROWS as i32) << 8
}

/// The edge functions at four samples of a tiny triangle's row; of the third, what it has more than the least that covers.
///
/// Exact inside of the bounds. Beside them they may exceed 2²⁴ and be rounded, but from row to row they change by no more
/// than 2²³ in all: one that was ever rounded keeps its sign.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row {
    edges: [Vec4; 3],
}

/// A tiny triangle and its window of a framebuffer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tiny {
    /// The window's leftmost pixel in the first row.
    pub(crate) x: i32,
    pub(crate) y: i32,
    /// How many rows there are: none, or fewer, of a triangle above or below the area.
    pub(crate) rows: i32,
    /// Whether the first half of the window's lanes holds all samples.
    pub(crate) is_narrow: bool,
    /// How far right of the leftmost sample of the triangle's bounds the window begins.
    dx: f32,
    /// Change of each edge function by a pixel right and down, its value at the leftmost sample of the bounds in the first
    /// row, and the least value that covers. The fourth of each is the third again: they are made four at a time.
    a: [f32; 4],
    b: [f32; 4],
    c: [f32; 4],
    least: [f32; 4],
    /// Negative in lanes that may not be drawn to.
    may_draw: [[f32; 4]; 2],
}

impl Tiny {
    /// A tiny triangle's window in a framebuffer that has `target`, of which `area` may be drawn to.
    #[inline(always)]
    pub(crate) fn new(setup: &Setup, target: Borders, area: Borders) -> Self {
        let bounds = setup.borders();
        let y = bounds.top.max(area.top);
        let rows = bounds.bottom.min(area.bottom) - y;
        // As far left as the framebuffer allows, if it ends too early on the right.
        let x = bounds.left.min(target.right - WINDOW as i32).max(target.left);
        let [p, q, r] = each(setup.corners(), |v| {
            [(v.x() - (bounds.left << 8) - 128) as f32, (v.y() - (y << 8) - 128) as f32]
        });
        let (from_x, to_x) = (Vec4::new(q[0], r[0], p[0], p[0]), Vec4::new(r[0], p[0], q[0], q[0]));
        let (from_y, to_y) = (Vec4::new(q[1], r[1], p[1], p[1]), Vec4::new(r[1], p[1], q[1], q[1]));
        let (a, b) = (from_y - to_y, to_x - from_x);
        // Not a negation: no sum of this and other whole numbers is −0.
        let c = Vec4::ZERO - (a * from_x + b * from_y);
        // A top or left edge has a > 0, or a = 0 and b > 0: as whole numbers of at most 2¹², 2¹³ a + b > 0.
        let is_top_left = (a * 8192.0 + b).cmpgt(Vec4::ZERO);
        let least = Vec4::select(is_top_left, Vec4::ZERO, Vec4::ONE).to_array();
        let (a, b, c) = ((a * 256.0).to_array(), (b * 256.0).to_array(), c.to_array());
        let (left, right) = ((area.left - x) as f32, (area.right - x - 1) as f32);
        let may_draw = |columns: Vec4| (columns - left).min(Vec4::splat(right) - columns).to_array();
        let is_narrow = bounds.right.min(area.right) - x <= 4;
        let (dx, may_draw) = ((x - bounds.left) as f32, [may_draw(COLUMNS), may_draw(COLUMNS + 4.0)]);
        Self { x, y, rows, is_narrow, dx, a, b, c, least, may_draw }
    }

    /// How wide the window is in a framebuffer that has `target`.
    #[inline(always)]
    pub(crate) fn width(&self, target: Borders) -> usize {
        WINDOW.min((target.right - self.x) as usize)
    }

    /// The first row.
    #[inline(always)]
    pub(crate) fn first_row(&self) -> Row {
        let dx = COLUMNS + self.dx;
        let edge = |i: usize| dx * self.a[i] + self.c[i];
        Row { edges: [edge(0), edge(1), edge(2) - self.least[2]] }
    }

    /// The row below.
    #[inline(always)]
    pub(crate) fn next_row(&self, Row { edges: [a, b, c] }: Row) -> Row {
        Row { edges: [a + self.b[0], b + self.b[1], c + self.b[2]] }
    }

    /// The same row four samples on.
    #[inline(always)]
    fn next_half(&self, Row { edges: [a, b, c] }: Row) -> Row {
        Row { edges: [a + 4.0 * self.a[0], b + 4.0 * self.a[1], c + 4.0 * self.a[2]] }
    }

    /// Four samples of a row, from its first or its fifth lane on: without a minus sign where they are covered and may be
    /// drawn to; and their depths.
    #[inline(always)]
    pub(crate) fn half(&self, row: Row, half: usize, plane: &LanePlane) -> ([f32; 4], [f32; 4]) {
        let row = if half == 0 { row } else { self.next_half(row) };
        let [a, b, c] = row.edges;
        // Edge 1 goes up, so it is a left one: 0 is enough.
        let inside = (a - self.least[0]).min(b).min(c).min(Vec4::from_array(self.may_draw[half]));
        (inside.to_array(), plane.at([a, b]).to_array())
    }

    /// The lanes of a row that are covered and pass the depth test against `old`, a bit each.
    #[inline(always)]
    pub(crate) fn chosen<D: DepthFormat, const N: usize>(
        &self,
        row: Row,
        plane: &LanePlane,
        test: impl DepthTest,
        old: &[D; WINDOW],
    ) -> u32 {
        let mut chosen = 0;
        for half in 0..N / 4 {
            let (mut inside, z) = self.half(row, half, plane);
            for i in 0..4 {
                inside[i] = if passes(test, z[i], old[4 * half + i]) { inside[i] } else { NEGATIVE };
            }
            chosen |= (!Vec4::from_array(inside).is_negative_bitmask() & 15) << (4 * half);
        }
        chosen
    }

    /// What weights of four samples are made of, and their depths, from their columns and rows in the window.
    #[inline(always)]
    pub(crate) fn samples<V: Varyings>(
        &self,
        (column, row): (Vec4, Vec4),
        shading: &Shading<'_, V>,
        plane: &LanePlane,
    ) -> ([Vec4; 5], Vec4) {
        let dx = column + self.dx;
        let edge = |i: usize| dx * self.a[i] + (row * self.b[i] + self.c[i]);
        let edges = [edge(0), edge(1), edge(2)];
        (shading.samples(edges), plane.at([edges[0], edges[1]]))
    }
}

/// A NaN with a minus sign and all bits set: to select between it and a number takes one operation less.
pub(crate) const NEGATIVE: f32 = f32::from_bits(u32::MAX);

/// The columns of the first four lanes.
pub(crate) const COLUMNS: Vec4 = Vec4::new(0.0, 1.0, 2.0, 3.0);

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::depth::{DepthBias, Less};
    use crate::plane::DepthPlane;
    use crate::project::ProjectedVertex;
    use crate::target::Rect;
    use std::vec::Vec;

    /// Tiny triangles of all sizes, some as large as can be, with corners on a grid of `step` subpixels.
    fn triangles(step: i32) -> Vec<Setup> {
        let mut random = 1u32;
        let mut below = |n: i32| {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((random >> 8) % n.cast_unsigned()).cast_signed()
        };
        let mut setups = Vec::new();
        while setups.len() < 2000 {
            let (width, height) = (1 + below(3000 / step), 1 + below(20_000 / step));
            let mut vertex = || {
                // On the border of the box as often as inside.
                let mut at = |size: i32| [0, below(size + 1), size][below(3).cast_unsigned() as usize];
                let (x, y) = (at(width) * step, at(height) * step);
                // On a grid of samples, but for edges that are not quite level.
                let y = y + i32::from(step > 1 && below(4) == 0);
                ProjectedVertex::new(x - 1024 - 128, y - 3072 - 128, 0.25, 1.0).expect("in range")
            };
            setups.extend(Setup::new([vertex(), vertex(), vertex()]).filter(is_tiny));
        }
        setups
    }

    #[test]
    fn lanes_are_what_the_edge_functions_cover_in_any_window() {
        let frames = [
            Rect { x: -64, y: -64, width: 128, height: 128 },
            Rect { x: -4, y: -9, width: 5, height: 7 },
            Rect { x: -2, y: -12, width: 70, height: 12 },
            Rect { x: -30, y: -20, width: 29, height: 30 },
        ];
        for setup in triangles(1).into_iter().chain(triangles(128)) {
            let edges = setup.edges();
            let plane = DepthPlane::new::<f32>(&setup, DepthBias::default(), (0.0, 1.0)).in_lanes();
            for frame in frames {
                let area = frame.intersection(Rect { x: -60, y: -11, width: 60, height: 9 });
                let tiny = Tiny::new(&setup, frame.borders(), area.borders());
                let (mut found, mut at) = (Vec::new(), tiny.first_row());
                for row in 0..tiny.rows {
                    let chosen = tiny.chosen::<_, WINDOW>(at, &plane, Less, &[1.0f32; WINDOW]);
                    let lanes = (0..8).filter(|lane| chosen >> lane & 1 == 1);
                    found.extend(lanes.map(|lane| (tiny.x + lane, tiny.y + row)));
                    at = tiny.next_row(at);
                }
                let covered: Vec<_> = (area.y..area.bottom())
                    .flat_map(|y| (area.x..area.right()).map(move |x| (x, y)))
                    .filter(|&(x, y)| edges.iter().all(|edge| edge.covers(x, y)))
                    .collect();
                assert_eq!(found, covered, "{setup:?} in {frame:?}");
                for (x, y) in covered {
                    let row = (tiny.y..y).fold(tiny.first_row(), |row, _| tiny.next_row(row));
                    let all = [row, tiny.next_half(row)].map(|row| row.edges);
                    let lane = (x - tiny.x).cast_unsigned() as usize;
                    for (i, edge) in edges.iter().enumerate() {
                        let value =
                            all[lane / 4][i].to_array()[lane % 4] + if i == 2 { tiny.least[2] } else { 0.0 };
                        assert_eq!(value.to_bits(), (edge.at(x, y) as f32).to_bits(), "{setup:?} at {x} {y}");
                        assert_eq!(value as i64, edge.at(x, y), "exact: {setup:?} at {x} {y}");
                    }
                }
            }
        }
    }
}
