//! The fragment half of a draw that writes depth alone, where there is SIMD: no packets and no closure, and so no need to
//! know which fragments passed. Each window of eight pixels is tested and written where it lies, and each sample of a minute
//! triangle alone.

#![expect(clippy::cast_possible_truncation, reason = "lanes are under 2⁴")]
#![expect(clippy::needless_range_loop, reason = "arrays in step, lane by lane, are what becomes SIMD")]

use crate::coarse::{Coarse, DepthRow, Hidden};
use crate::depth::{DepthFormat, DepthTest, passes};
use crate::minute::Minute;
use crate::packet::{WINDOW, copy, store};
use crate::plane::{DepthPlane, LanePlane, RowPlane};
use crate::project::ProjectedVertex;
use crate::setup::Setup;
use crate::target::{Block, Borders, Framebuffer};
use crate::tiny::{Outline, Row, Tiny};
use crate::traverse::{HAS_WIDE_LANES, LANES, Solver};

/// What a draw without a closure works with: depth is tested and written where it lies, eight pixels at a time.
#[derive(Debug)]
pub(crate) struct DepthPass<'a, F, T> {
    pub(crate) target: &'a mut F,
    /// What the framebuffer has, and which of it may be drawn to.
    pub(crate) target_area: Borders,
    pub(crate) render_area: Borders,
    pub(crate) test: T,
    pub(crate) coarse: Coarse,
}

/// How many fragments passed, in windows, lane by lane, and outside of them.
#[derive(Debug, Default)]
struct Passed {
    windows: [u32; WINDOW],
    alone: [u32; 1],
}

impl<F: Framebuffer, T: DepthTest> DepthPass<'_, F, T> {
    /// Draws a triangle, of which these samples are [`covered`](crate::fan::Piece), or which lies within this outline. Gives how many
    /// fragments passed.
    #[inline(always)]
    pub(crate) fn draw(
        &mut self,
        (setup, covered): (&Setup, u32),
        outline: impl FnOnce() -> Outline,
        plane: &DepthPlane,
    ) -> u64 {
        if covered != 0 {
            return self.draw_minute(setup.corners(), covered, *plane);
        }
        let Outline { bounds, is_tiny } = outline();
        if is_tiny {
            let tiny = Tiny::new(setup, bounds, self.target_area, self.render_area);
            let is_cut = tiny.is_cut(bounds);
            return match tiny.lanes {
                4 => self.draw_tiny::<4>(&tiny, is_cut, plane),
                8 => self.draw_tiny::<8>(&tiny, is_cut, plane),
                12 => self.draw_tiny::<12>(&tiny, is_cut, plane),
                _ => self.draw_tiny::<16>(&tiny, is_cut, plane),
            };
        }
        let (area, solver) = (self.render_area, Solver::new(setup));
        let plane = RowPlane::new(plane, plane.step_x(setup));
        let (left, right) = (area.left, area.right);
        let (mut top, bottom) = (area.top.max(bounds.top), area.bottom.min(bounds.bottom));
        let mut passed = Passed::default();
        while top < bottom {
            let rows = solver.solve(top);
            let mut z = [0.0; LANES];
            for row in 0..LANES {
                z[row] = plane.at_edges(rows.edges[0][row], rows.edges[1][row]);
            }
            for row in 0..LANES.min((bottom - top) as usize) {
                let (start, end) = (rows.start[row].max(left), rows.end[row].min(right));
                let depth = DepthRow { plane, y: top + row as i32, z: z[row], anchor: rows.anchor[row] };
                let (mut x, mut is_covered) = (start, start < end);
                let mut hidden = Hidden::default();
                while x < end {
                    if x == start || x >= hidden.right() {
                        hidden = self.coarse.hidden(self.target, depth, (x, end));
                    }
                    let (len, is_hidden) = self.coarse.stretch(hidden, (x, end), i32::MAX);
                    is_covered &= is_hidden || self.draw_stretch(depth, (x, x + len), &mut passed);
                    x += len;
                }
                if is_covered && self.coarse.learns {
                    self.coarse.learn(self.target, depth, (start, end));
                }
            }
            top += LANES as i32;
        }
        passed.windows.iter().chain(&passed.alone).map(|&lane| u64::from(lane)).sum()
    }

    /// Draws columns `x .. end` of a row. Whether the framebuffer lends all of them.
    #[inline(always)]
    fn draw_stretch(&mut self, row: DepthRow<'_>, (mut x, end): (i32, i32), passed: &mut Passed) -> bool {
        let mut has_windows = true;
        while x < end {
            let z = (row.z, (x - row.anchor) as f32);
            // A window may reach over the row's end, but not over the framebuffer's border.
            if has_windows && x + WINDOW as i32 <= self.target_area.right {
                let run = self.target.run(x, row.y, WINDOW);
                let Some(depths) = run.depth.first_chunk_mut() else {
                    // A framebuffer that lends less is drawn as far as it goes.
                    has_windows = false;
                    continue;
                };
                test_window(self.test, depths, end - x, row.plane, z, &mut passed.windows);
                x += WINDOW as i32;
            } else {
                let run = self.target.run(x, row.y, 1);
                let Some(depth) = run.depth.first_mut() else { return false };
                let depth = core::array::from_mut(depth);
                test_window(self.test, depth, 1, row.plane, z, &mut passed.alone);
                x += 1;
            }
        }
        true
    }

    /// Draws a minute triangle. Gives how many fragments passed.
    ///
    /// A call, and by value: inlined, it would take registers from the loops over larger ones' rows.
    #[inline(never)]
    fn draw_minute(&mut self, corners: [ProjectedVertex; 3], covered: u32, plane: DepthPlane) -> u64 {
        // Its samples are found from corners and area, whatever the order of the caller's vertices was: so the loop over triangles
        // need not keep that.
        let (mut passed, setup) = (0, Setup::of_corners(corners, 0));
        for sample in Minute::new(&setup, covered) {
            let z = plane.at_sample(sample.edges);
            let Some(depth) = self.target.run(sample.x, sample.y, 1).depth.first_mut() else { continue };
            if passes(self.test, z, *depth) {
                passed += 1;
                if self.test.writes() {
                    *depth = F::Depth::from_depth(z);
                }
            }
        }
        passed
    }

    /// Draws a tiny triangle. Gives how many fragments passed.
    #[inline(always)]
    fn draw_tiny<const N: usize>(&mut self, tiny: &Tiny, is_cut: bool, plane: &DepthPlane) -> u64 {
        if tiny.is_empty() {
            return 0;
        }
        let (width, height) = (tiny.width(self.target_area), tiny.rows as usize);
        let (depth, stride) = match self.target.block(tiny.x, tiny.y, width, height) {
            Some(Block { depth, stride, .. })
                if !is_cut && depth.len() >= (height - 1).wrapping_mul(stride).wrapping_add(N) =>
            {
                (depth, stride)
            }
            _ => return draw_by_runs::<_, N>(self.target, self.test, *tiny, width, *plane),
        };
        let (mut passed, mut at) = ([0; 8], 0usize);
        if N == 8 && HAS_WIDE_LANES {
            // In one register. (Vec4 is four lanes, whatever there is.)
            let mut row = tiny.first_eight();
            for _ in 0..height {
                let Some(window) = depth.get_mut(at..at.wrapping_add(8)).and_then(<[_]>::first_chunk_mut)
                else {
                    break;
                };
                test_lanes::<_, 8>(self.test, window, tiny.eight(&row, plane), 8, &mut passed);
                (row, at) = (tiny.next_eight(row), at.wrapping_add(stride));
            }
        } else {
            let (mut row, plane) = (tiny.first_row::<N>(), plane.in_lanes());
            for _ in 0..height {
                let Some(window) = depth.get_mut(at..at.wrapping_add(N)).and_then(<[_]>::first_chunk_mut)
                else {
                    break;
                };
                test_row::<_, N, false>(self.test, window, (tiny, row), &plane, N, &mut passed);
                (row, at) = (tiny.next_row(row), at.wrapping_add(stride));
            }
        }
        passed.iter().map(|&lane| u64::from(lane)).sum()
    }
}

/// Draws a tiny triangle into a framebuffer that lends no block, or one narrower than a window. Gives how many fragments
/// passed. (By value, so that nothing has to be in memory for the sake of this.)
#[inline(never)]
fn draw_by_runs<F: Framebuffer, const N: usize>(
    target: &mut F,
    test: impl DepthTest,
    tiny: Tiny,
    width: usize,
    plane: DepthPlane,
) -> u64 {
    let (mut passed, mut row, plane) = ([0; 8], tiny.first_row::<N>(), plane.in_lanes());
    for y in tiny.y..tiny.y + tiny.rows {
        let depths = target.run(tiny.x, y, width).depth;
        if let Some(window) = depths.first_chunk_mut() {
            test_row::<_, N, true>(test, window, (&tiny, row), &plane, N, &mut passed);
        } else {
            // Less than a window, of a narrow framebuffer or a miserly one, is drawn to through one of our own.
            let mut window = [F::Depth::from_depth(0.0); N];
            let lent = copy(&mut window, depths);
            test_row::<_, N, true>(test, &mut window, (&tiny, row), &plane, lent, &mut passed);
            copy(depths, &window);
        }
        row = tiny.next_row(row);
    }
    passed.iter().map(|&lane| u64::from(lane)).sum()
}

/// Tests and writes the depths of a tiny triangle's row, `lent` of which are there.
#[inline(always)]
fn test_row<D: DepthFormat, const N: usize, const IS_CUT: bool>(
    test: impl DepthTest,
    depths: &mut [D; N],
    (tiny, row): (&Tiny, Row),
    plane: &LanePlane,
    lent: usize,
    passed: &mut [u32; 8],
) {
    for quarter in 0..N / 4 {
        let Some(depths) = depths.get_mut(4 * quarter..).and_then(<[_]>::first_chunk_mut) else { return };
        let (inside, z) = tiny.quarter::<N>(row, quarter, plane);
        let inside = if IS_CUT { inside.min(tiny.may_draw_quarter(quarter)) } else { inside };
        test_lanes::<_, 4>(
            test,
            depths,
            (inside.to_array(), z.to_array()),
            lent.saturating_sub(4 * quarter),
            passed,
        );
    }
}

/// Tests and writes some of a window's depths. Their samples are covered where `inside` is not negative, and have depths `z`.
/// Counts in `passed`, lane by lane, as many as there are at a time.
#[inline(always)]
fn test_lanes<D: DepthFormat, const N: usize>(
    test: impl DepthTest,
    depths: &mut [D; N],
    (inside, z): ([f32; N], [f32; N]),
    lent: usize,
    passed: &mut [u32; 8],
) {
    let (mut pixels, mut is_drawn) = (*depths, [0; N]);
    for i in 0..N {
        let is_inside = (inside[i] >= 0.0) & (i < lent);
        is_drawn[i] = u32::from(is_inside & passes(test, z[i], pixels[i]));
    }
    for i in 0..N {
        passed[i] += is_drawn[i];
    }
    for i in 0..N {
        let is_written = (is_drawn[i] != 0) & test.writes();
        pixels[i] = if is_written { D::from_depth(z[i]) } else { pixels[i] };
    }
    store(depths, pixels);
}

/// Tests and writes the first `len` of some neighbouring depths, where the triangle's depth is `z` plus `dx` columns'
/// change. Counts in `passed`, lane by lane.
#[inline(always)]
fn test_window<D: DepthFormat, const N: usize>(
    test: impl DepthTest,
    depths: &mut [D; N],
    len: i32,
    plane: RowPlane<'_>,
    (z, dx): (f32, f32),
    passed: &mut [u32; N],
) {
    // One step at a time for all lanes: each loop becomes one operation or two.
    let (old, mut new, mut passes) = (*depths, *depths, [0; N]);
    for i in 0..N {
        new[i] = D::from_depth(plane.moved(z, dx + i as f32));
    }
    for i in 0..N {
        let is_first = (i as i32) < len;
        passes[i] = u32::from(is_first & (!D::IS_STORED || test.passes(new[i], old[i])));
    }
    for i in 0..N {
        passed[i] += passes[i];
    }
    for i in 0..N {
        new[i] = if (passes[i] != 0) & test.writes() { new[i] } else { old[i] };
    }
    store(depths, new);
}
