//! Triangles of up to 16 × 16 pixels: of a fine mesh, nearly all of them.
//!
//! Inside of such a triangle's bounds no edge function exceeds 2²⁴, width by height in subpixels, nor does a product on the
//! way to it: `f32` holds all of them exactly. So nothing is solved, and a step is as good as a product. A row is one window
//! of 4, 8, 12 or 16 samples, one in each SIMD lane; lanes that are covered, or pass, are bits. There are two ways from there
//! to a packet, in which the fragments of all rows stand one after the other:
//!
//! * of narrow windows, of up to eight samples, those that are [covered](Tiny::covered) are found first, of all rows. Depth is
//!   worked out and tested where they are put into the packet. So no loop over rows or samples waits for depths to come from far
//!   away before it knows its end; and
//! * of wide ones, and where the framebuffer lends no block, coverage and depth of a row are worked out from its own edge
//!   functions and tested [at once](Tiny::chosen): what is hidden is done with. (Of narrow ones, coverage is known by then, and
//!   found out again.)
//!
//! Rows are computed in glam's `Vec4`, which is SIMD on every target that has it: out of plain arrays of lanes, compilers
//! made something else for odd lanes. Only depth passes have [eight](Tiny::eight) lanes, where there are registers for them.

use glam::Vec4;

use crate::depth::{DepthFormat, DepthTest, passes};
use crate::plane::{DepthPlane, LanePlane};
use crate::project::ProjectedVertex;
use crate::setup::Setup;
use crate::target::Borders;
use crate::triple::each;

/// The most columns and rows of a tiny triangle.
pub(crate) const SIDE: i32 = 16;

/// Some of the lanes of a tiny triangle's windows of any width, a bit each, row after row from the lowest bit on, 16 for each
/// row.
pub(crate) type Lanes = [u64; 4];

/// A window of up to so many lanes is narrow.
pub(crate) const NARROW_WINDOW: i32 = 8;

/// How many rows of narrow windows are worked out before it is asked whether there are more, which no predictor can tell. It
/// divides the eight rows of a word.
const ROWS: usize = 2;
const _: () = assert!(8 % ROWS == 0, "words begin where these rows do");

/// Some of the lanes of narrow windows: a byte for each row, eight rows a word.
pub(crate) type NarrowLanes = [u64; 2];

/// The largest extent of a tiny triangle, in subpixels.
pub(crate) const LARGEST: u32 = (SIDE << 8) as u32;

/// Whether a triangle's fragments start from their own edge functions, and not from those at an anchor.
#[inline(always)]
pub(crate) fn is_tiny(setup: &Setup) -> bool {
    setup.extent() <= LARGEST
}

/// Where a triangle lies: the [`borders`](Setup::borders) of its bounds, and whether it [is tiny](is_tiny).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Outline {
    pub(crate) bounds: Borders,
    pub(crate) is_tiny: bool,
}

impl Outline {
    #[inline(always)]
    pub(crate) fn new(setup: &Setup) -> Self {
        Self { bounds: setup.borders(), is_tiny: is_tiny(setup) }
    }
}

/// The edge functions that a row's samples start from: of a wide window (12 or 16 lanes) those at the leftmost sample of the
/// triangle's bounds, of a narrower one those at its first four samples. Edges 0 and 1 are as they are, for depth is made of
/// them. Edge 2 only decides on coverage: the least value that covers is taken off, so that its sign tells.
///
/// Inside of the bounds all are exact, and in narrow windows beside them, too: window and bounds together are less than 16
/// pixels wide. Wide ones may begin so far to the left that a step from there would be rounded.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row {
    edges: [Vec4; 3],
}

/// A tiny triangle and its windows of a framebuffer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tiny {
    /// The windows' leftmost pixel in the first row.
    pub(crate) x: i32,
    pub(crate) y: i32,
    /// How many rows there are: none, or fewer, of a triangle above or below the area.
    pub(crate) rows: i32,
    /// How many lanes a window has: 4, 8, 12 or 16.
    pub(crate) lanes: i32,
    /// Columns `left .. right` of the window may be drawn to; none, if these are not in order.
    left: i32,
    right: i32,
    /// How far right of the origin the window begins: 0 of a narrow one.
    pub(crate) dx: f32,
    /// Change of each edge function by a pixel right and down, its value at the origin, and the least value that covers: 0 on a
    /// top or left edge, else 1. The fourth of each is the third again: they are made four at a time.
    ///
    /// The origin is the leftmost sample, in the first row, of a narrow window, whose lanes need no offset then; or of the
    /// triangle's bounds, where a window may begin so far beside them that products would be rounded.
    a: [f32; 4],
    b: [f32; 4],
    c: [f32; 4],
    least: [f32; 4],
    /// Twice its area, at most 2²⁴: what all three edge functions add up to, everywhere.
    area2: f32,
}

impl Tiny {
    /// None at all.
    pub(crate) const BLANK: Self = Self {
        x: 0,
        y: 0,
        rows: 0,
        lanes: 4,
        left: 0,
        right: 0,
        dx: 0.0,
        a: [0.0; 4],
        b: [0.0; 4],
        c: [0.0; 4],
        least: [0.0; 4],
        area2: 0.0,
    };

    /// The windows of a tiny triangle with these bounds, in a framebuffer that has `target`, of which `area` may be drawn to.
    #[inline(always)]
    pub(crate) fn new(setup: &Setup, bounds: Borders, target: Borders, area: Borders) -> Self {
        let drawn = bounds.intersection(area);
        let (y, rows) = (drawn.top, drawn.bottom - drawn.top);
        let lanes = match bounds.right - bounds.left {
            ..=4 => 4,
            5..=8 => 8,
            9..=12 => 12,
            _ => SIDE,
        };
        // As far left as the framebuffer allows, if it ends too early on the right.
        let x = bounds.left.min(target.right - lanes).max(target.left);
        let origin = if lanes > NARROW_WINDOW { bounds.left } else { x };
        let (left, top) = ((origin << 8) + 128, (y << 8) + 128);
        // (Wrapping: positions that are others when asked again may be anywhere. Of such a triangle, nothing is drawn.)
        let from_origin = |v: ProjectedVertex| [v.x().wrapping_sub(left), v.y().wrapping_sub(top)];
        let [p, q, r] = each(setup.corners(), |v| from_origin(v).map(|at| at as f32));
        let (from_x, to_x) = (Vec4::new(q[0], r[0], p[0], p[0]), Vec4::new(r[0], p[0], q[0], q[0]));
        let (from_y, to_y) = (Vec4::new(q[1], r[1], p[1], p[1]), Vec4::new(r[1], p[1], q[1], q[1]));
        let (a, b) = (from_y - to_y, to_x - from_x);
        // Not a negation: no sum of this and other whole numbers is −0.
        let c = Vec4::ZERO - (a * from_x + b * from_y);
        // A top or left edge has a > 0, or a = 0 and b > 0: as whole numbers of at most 2¹², 2¹³ a + b > 0.
        let is_top_left = (a * 8192.0 + b).cmpgt(Vec4::ZERO);
        let least = Vec4::select(is_top_left, Vec4::ZERO, Vec4::ONE).to_array();
        let (a, b, c) = ((a * 256.0).to_array(), (b * 256.0).to_array(), c.to_array());
        let (left, right) = (drawn.left - x, drawn.right - x);
        Self {
            x,
            y,
            rows,
            lanes,
            left,
            right,
            dx: (x - origin) as f32,
            a,
            b,
            c,
            least,
            area2: setup.area2() as f32,
        }
    }

    /// Whether no pixel may be drawn to.
    #[inline(always)]
    pub(crate) fn is_empty(&self) -> bool {
        (self.rows <= 0) | (self.left >= self.right)
    }

    /// Whether some columns of the triangle's bounds may not be drawn to. Where not, no lane needs a mask: beside the bounds, none
    /// is covered. (Edge functions of wide windows may be rounded there, once, which keeps their sign.)
    #[inline(always)]
    pub(crate) fn is_cut(&self, bounds: Borders) -> bool {
        (self.left > bounds.left - self.x) | (self.right < bounds.right - self.x)
    }

    /// How wide the window is in a framebuffer that has `target`.
    #[inline(always)]
    pub(crate) fn width(&self, target: Borders) -> usize {
        self.lanes.min(target.right - self.x) as usize
    }

    /// The pixel in a column and row of the windows.
    #[inline(always)]
    pub(crate) fn pixel(&self, (column, row): (i32, i32)) -> (i32, i32) {
        (self.x.wrapping_add(column), self.y.wrapping_add(row))
    }

    /// The lanes of each row that may be drawn to, a bit each, unless it [is empty](Self::is_empty).
    #[inline(always)]
    pub(crate) fn may_draw(&self) -> u32 {
        (1u32.wrapping_shl((self.right - self.left) as u32) - 1).wrapping_shl(self.left as u32)
    }

    /// Not negative in those of four lanes that may be drawn to.
    #[inline(always)]
    pub(crate) fn may_draw_quarter(&self, quarter: usize) -> Vec4 {
        let columns = COLUMNS + (4 * quarter) as f32;
        (columns - self.left as f32).min(Vec4::splat((self.right - 1) as f32) - columns)
    }

    /// The columns of four lanes of a wide window, counted from the origin.
    #[inline(always)]
    fn columns(&self, quarter: usize) -> Vec4 {
        COLUMNS + (self.dx + (4 * quarter) as f32)
    }

    /// The first row of windows of so many lanes.
    #[inline(always)]
    pub(crate) fn first_row<const N: usize>(&self) -> Row {
        let edge = |i: usize| if N > 8 { Vec4::splat(self.c[i]) } else { COLUMNS * self.a[i] + self.c[i] };
        Row { edges: [edge(0), edge(1), edge(2) - self.least[2]] }
    }

    /// The row below.
    #[inline(always)]
    pub(crate) fn next_row(&self, Row { edges: [a, b, c] }: Row) -> Row {
        Row { edges: [a + self.b[0], b + self.b[1], c + self.b[2]] }
    }

    /// The edge functions at four samples of a row; edge 2 less the least value that covers.
    #[inline(always)]
    fn edges<const N: usize>(&self, row: Row, quarter: usize) -> [Vec4; 3] {
        let offset = if N > 8 { self.columns(quarter) } else { Vec4::splat((4 * quarter) as f32) };
        let edge =
            |i: usize| if N > 8 || quarter > 0 { row.edges[i] + offset * self.a[i] } else { row.edges[i] };
        [edge(0), edge(1), edge(2)]
    }

    /// Four samples of a row: without a minus sign where they are covered; and their depths.
    #[inline(always)]
    pub(crate) fn quarter<const N: usize>(
        &self,
        row: Row,
        quarter: usize,
        plane: &LanePlane,
    ) -> (Vec4, Vec4) {
        let [a, b, c] = self.edges::<N>(row, quarter);
        // Edge 1 goes up, so it is a left one: 0 is enough.
        ((a - self.least[0]).min(b).min(c), plane.at([a, b]))
    }

    /// [`first_row`](Self::first_row) of windows of eight lanes, where a register holds as many. (Its columns in two `Vec4`: of an
    /// array of constants, LLVM would make a step of its own for each.)
    #[inline(always)]
    pub(crate) fn first_eight(&self) -> [[f32; 8]; 3] {
        let mut row = [[0.0; 8]; 3];
        for (edge, (&a, &c)) in row.iter_mut().zip(self.a.iter().zip(&self.c)) {
            let (first, second) = (COLUMNS * a + c, (COLUMNS + 4.0) * a + c);
            let ([p, q, r, s], [t, u, v, w]) = (first.to_array(), second.to_array());
            *edge = [p, q, r, s, t, u, v, w];
        }
        row[2] = row[2].map(|c| c - self.least[2]);
        row
    }

    /// The row below.
    #[inline(always)]
    pub(crate) fn next_eight(&self, [a, b, c]: [[f32; 8]; 3]) -> [[f32; 8]; 3] {
        [a.map(|a| a + self.b[0]), b.map(|b| b + self.b[1]), c.map(|c| c + self.b[2])]
    }

    /// Eight samples of a row of a triangle that is not [cut](Self::is_cut): without a minus sign where they are covered; and their
    /// depths.
    #[inline(always)]
    pub(crate) fn eight(&self, [a, b, c]: &[[f32; 8]; 3], plane: &DepthPlane) -> ([f32; 8], [f32; 8]) {
        let (mut inside, mut z) = ([0.0; 8], [0.0; 8]);
        for i in 0..8 {
            z[i] = plane.clamp(plane.at_edges(a[i], b[i]));
        }
        for i in 0..8 {
            inside[i] = least(least(a[i] - self.least[0], b[i]), c[i]);
        }
        (inside, z)
    }

    /// The covered lanes of all rows of its windows, which must be narrow, unless it [is empty](Self::is_empty).
    #[inline(always)]
    pub(crate) fn covered_lanes(&self) -> NarrowLanes {
        if self.lanes > 4 { self.covered::<8>() } else { self.covered::<4>() }
    }

    /// The covered lanes of all rows of narrow windows, of `N` lanes, unless it [is empty](Self::is_empty).
    #[inline(always)]
    fn covered<const N: usize>(&self) -> NarrowLanes {
        let rows = self.rows as usize;
        let first = self.covered_word::<N>(self.first_row::<N>(), rows.min(8));
        [first, if rows > 8 { self.second_word::<N>(rows - 8) } else { 0 }]
    }

    /// The second word, in a function of its own: few triangles have more than eight rows. (From its own first row: one that is
    /// handed over would be put in memory for all triangles.)
    #[cold]
    #[inline(never)]
    fn second_word<const N: usize>(&self, rows: usize) -> u64 {
        let mut row = self.first_row::<N>();
        for (edge, step) in row.edges.iter_mut().zip(self.b) {
            *edge += 8.0 * step;
        }
        self.covered_word::<N>(row, rows.min(8))
    }

    /// The covered lanes of so many rows, 1 to 8, from this one on.
    #[inline(always)]
    fn covered_word<const N: usize>(&self, mut row: Row, rows: usize) -> u64 {
        debug_assert!((1..=8).contains(&rows), "{rows} rows in a word");
        // Depth is not made of these, so the least value that covers is taken off edge 0 as well. (Of edge 1, a left one, it is 0.)
        row.edges[0] -= self.least[0];
        let (mut outside, mut shift) = (0, 0);
        while shift < 8 * rows {
            // There may be one too many, whose numbers need not be exact.
            for _ in 0..ROWS {
                for quarter in 0..N / 4 {
                    let [a, b, c] = self.edges::<N>(row, quarter);
                    let others = a.min(b).min(c).is_negative_bitmask();
                    outside |= u64::from(others) << (shift + 4 * quarter);
                }
                (row, shift) = (self.next_row(row), shift + 8);
            }
        }
        let is_row = u64::MAX >> (64 - 8 * rows);
        is_row & (u64::from(self.may_draw()) * 0x0101_0101_0101_0101) & !outside
    }

    /// Those of some lanes of a row that are covered and pass the depth test against `old`, a bit each.
    #[inline(always)]
    pub(crate) fn chosen<D: DepthFormat, const N: usize>(
        &self,
        row: Row,
        plane: &LanePlane,
        test: impl DepthTest,
        old: &[D; N],
        lanes: u32,
    ) -> u32 {
        let mut others = 0;
        for quarter in 0..N / 4 {
            let (inside, z) = self.quarter::<N>(row, quarter, plane);
            let (mut inside, z) = (inside.to_array(), z.to_array());
            for i in 0..4 {
                inside[i] = if passes(test, z[i], old[4 * quarter + i]) { inside[i] } else { NEGATIVE };
            }
            others |= Vec4::from_array(inside).is_negative_bitmask() << (4 * quarter);
        }
        lanes & !others
    }

    /// The edge functions at some covered samples, from their columns and rows, counted from the origin. (Of others, the third may
    /// be rounded.)
    #[inline(always)]
    pub(crate) fn edges_at<const N: usize>(&self, columns: [f32; N], rows: [f32; N]) -> [[f32; N]; 3] {
        let mut edges = [[0.0; N]; 3];
        for (edge, ((a, b), c)) in edges.iter_mut().zip(self.a.iter().zip(&self.b).zip(&self.c)).take(2) {
            for i in 0..N {
                edge[i] = columns[i] * a + (rows[i] * b + c);
            }
        }
        // What these two leave of the area: fewer steps than for another product. At covered samples none is negative, so it is exact.
        let [p, q, r] = &mut edges;
        for i in 0..N {
            r[i] = (self.area2 - p[i]) - q[i];
        }
        edges
    }
}

/// The smaller of two numbers, in one instruction.
#[inline(always)]
fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// A NaN with a minus sign and all bits set: to select between it and a number takes one operation less.
pub(crate) const NEGATIVE: f32 = f32::from_bits(u32::MAX);

/// The columns of the first four lanes.
pub(crate) const COLUMNS: Vec4 = Vec4::new(0.0, 1.0, 2.0, 3.0);

#[cfg(test)]
mod tests {
    #![expect(
        clippy::cast_possible_truncation,
        reason = "lanes are under 2⁴, and edge functions whole numbers"
    )]

    extern crate std;
    use super::*;
    use crate::depth::Less;
    use crate::plane::DepthPlane;
    use crate::target::Rect;
    use crate::traverse::HAS_FLOAT_LANES;
    use std::vec::Vec;

    /// Tiny triangles of all sizes, some as large as can be, with corners on a grid of `step` subpixels.
    fn triangles(step: i32) -> Vec<Setup> {
        let mut random = 1u32;
        let mut below = |n: i32| {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((random >> 8) % n.cast_unsigned()).cast_signed()
        };
        // The largest of all, either way up; the others at random.
        let corner = |x: i32, y: i32| {
            ProjectedVertex::new((x << 12) - 1152, (y << 12) - 3200, 0.25, 1.0).expect("in range")
        };
        let largest =
            [[corner(0, 0), corner(1, 0), corner(0, 1)], [corner(1, 1), corner(1, 0), corner(0, 1)]];
        let mut setups: Vec<_> = largest.into_iter().filter_map(Setup::new).collect();
        assert!(setups.iter().all(|setup| setup.area2() == 1 << 24 && is_tiny(setup)), "{setups:?}");
        while setups.len() < 2000 {
            let mut size = || if below(3) == 0 { (SIDE << 8) / step } else { 1 + below((SIDE << 8) / step) };
            let (width, height) = (size(), size());
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
            Rect { x: 2, y: -64, width: 66, height: 128 },
            Rect { x: -2, y: -12, width: 70, height: 12 },
            Rect { x: -30, y: -20, width: 29, height: 30 },
        ];
        for setup in triangles(1).into_iter().chain(triangles(128)) {
            let edges = setup.edges();
            let plane = DepthPlane::new::<f32>(&setup, None, (0.0, 1.0)).in_lanes();
            let areas = [(-60, 60), (-60, 63), (1, 2)].map(|(x, width)| Rect { x, y: -11, width, height: 9 });
            for (frame, area) in frames.into_iter().flat_map(|frame| areas.map(|area| (frame, area))) {
                let area = frame.intersection(area);
                let tiny = Tiny::new(&setup, setup.borders(), frame.borders(), area.borders());
                let found = match tiny.lanes {
                    4 => samples::<4>(&setup, &tiny, &plane),
                    8 => samples::<8>(&setup, &tiny, &plane),
                    12 => samples::<12>(&setup, &tiny, &plane),
                    _ => samples::<16>(&setup, &tiny, &plane),
                };
                let covered: Vec<_> = (area.y..area.bottom())
                    .flat_map(|y| (area.x..area.right()).map(move |x| (x, y)))
                    .filter(|&(x, y)| edges.iter().all(|edge| edge.covers(x, y)))
                    .collect();
                assert_eq!(found, covered, "{setup:?} in {frame:?}");
                for &(x, y) in &covered {
                    let column = (x - tiny.x) as f32 + tiny.dx;
                    let at = tiny.edges_at([column], [(y - tiny.y) as f32]);
                    let exact = edges.map(|edge| [(edge.at(x, y) as f32).to_bits()]);
                    assert_eq!(at.map(|edge| edge.map(f32::to_bits)), exact, "alone: {setup:?} at {x} {y}");
                }
                if HAS_FLOAT_LANES && tiny.lanes <= NARROW_WINDOW && !tiny.is_empty() {
                    let lanes = tiny.covered_lanes();
                    let is_covered = |lane: &usize| lanes[lane / 64] >> (lane % 64) & 1 == 1;
                    let found: Vec<_> = (0..128)
                        .filter(is_covered)
                        .map(|lane| tiny.pixel((lane as i32 % 8, lane as i32 / 8)))
                        .collect();
                    assert_eq!(found, covered, "without rows: {setup:?} in {frame:?}");
                    let depth = DepthPlane::new::<f32>(&setup, None, (0.0, 1.0));
                    let (mut row, mut found) = (tiny.first_eight(), Vec::new());
                    for y in 0..tiny.rows {
                        let (inside, _) = tiny.eight(&row, &depth);
                        let is_drawn = |x: i32| inside[x as usize] >= 0.0 && tiny.may_draw() >> x & 1 == 1;
                        found.extend((0..8).filter(|&x| is_drawn(x)).map(|x| tiny.pixel((x, y))));
                        row = tiny.next_eight(row);
                    }
                    assert_eq!(found, covered, "eight at a time: {setup:?} in {frame:?}");
                }
            }
        }
    }

    /// The samples of a triangle's windows that are found to be covered. Their edge functions are seen to be exact.
    fn samples<const N: usize>(setup: &Setup, tiny: &Tiny, plane: &LanePlane) -> Vec<(i32, i32)> {
        let (mut samples, mut row) = (Vec::new(), tiny.first_row::<N>());
        for y in tiny.y..tiny.y + tiny.rows {
            let may_draw = match tiny {
                _ if tiny.is_empty() => 0,
                _ if tiny.is_cut(setup.borders()) => tiny.may_draw(),
                // Lanes beside the bounds are not covered, wherever the window begins.
                _ => u32::MAX >> (32 - N),
            };
            let chosen = tiny.chosen(row, plane, Less, &[1.0f32; N], may_draw);
            for lane in (0..N).filter(|lane| chosen >> lane & 1 == 1) {
                let x = tiny.x + lane as i32;
                let values = tiny.edges::<N>(row, lane / 4).map(|edge| edge.to_array()[lane % 4]);
                for (i, edge) in setup.edges().iter().enumerate() {
                    let value = values[i] + if i == 2 { tiny.least[2] } else { 0.0 };
                    assert_eq!(value.to_bits(), (edge.at(x, y) as f32).to_bits(), "{setup:?} at {x} {y}");
                    assert_eq!(value as i64, edge.at(x, y), "exact: {setup:?} at {x} {y}");
                }
                samples.push((x, y));
            }
            row = tiny.next_row(row);
        }
        samples
    }
}
