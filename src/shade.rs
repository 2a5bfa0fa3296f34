//! The fragment half of a draw: depth test, closure, and the caller's memory.
//!
//! Where there is SIMD, fragments of one triangle are collected into *packets*: arrays of the numbers that shading starts
//! from. Filling them, testing depth and shading are three separate loops without branches, and there is one shading loop
//! only, so the compiler inlines the closure into it and makes SIMD of the whole. A packet is either
//!
//! * a stretch of one row: depth is tested for all of it at once. If all fragments pass, as most often, they are shaded
//!   straight into the framebuffer; if none, the stretch is done; if some, each run of fragments that pass is shaded; or
//! * up to eight rows of a triangle no wider than eight pixels, one window of eight pixels a row, shaded as one packet and
//!   then written through the windows. A row at a time, such triangles would cost more in loops than in shading.
//!
//! Elsewhere, `one_by_one.rs` tests and shades one fragment after the other: less memory, less code, and the same results.

#![expect(clippy::cast_possible_truncation, reason = "offsets in a packet and lanes of a band are under 2⁹")]
#![expect(clippy::needless_range_loop, reason = "arrays in step, lane by lane, are what becomes SIMD")]

use core::hint::black_box;
use core::ops::Range;

use crate::depth::{DepthBias, DepthFormat, DepthTest, clamp};
use crate::fragment::{Fragment, Sample, Shading, to_f32};
use crate::interpolate::Varyings;
use crate::setup::Setup;
use crate::state::Statistics;
use crate::target::{Framebuffer, Rect};
use crate::traverse::{HAS_FLOAT_LANES, LANES, Rows, Solver, Tiny, anchors_at_end};
use crate::triple::each;

/// How many fragments are in flight: enough for SIMD to be worth its overhead, and little enough for the first-level
/// cache. Where fragments are drawn one by one there is no packet.
pub(crate) const PACKET: usize = if HAS_FLOAT_LANES { 256 } else { 1 };

/// A triangle's depth: linear on the screen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DepthPlane {
    /// At corner 2; and what corners 0 and 1 have more.
    z: f32,
    more: [f32; 2],
    inv_area2: f32,
    /// Change by a pixel to the right.
    step_x: f32,
    low: f32,
    high: f32,
}

impl DepthPlane {
    #[inline(always)]
    pub(crate) fn new<D: DepthFormat>(setup: &Setup, bias: DepthBias, (low, high): (f32, f32)) -> Self {
        let [p, q, r] = each(setup.corners(), |corner| corner.depth());
        let more = [p - r, q - r];
        let inv_area2 = 1.0 / to_f32(setup.area2());
        let [edge_0, edge_1, _] = each(setup.edges(), |edge| edge.slope());
        let step =
            |i: usize| (edge_0[i] as f32 * 256.0 * more[0] + edge_1[i] as f32 * 256.0 * more[1]) * inv_area2;
        let mut z = r;
        if bias != DepthBias::default() {
            let (dx, dy) = (step(0).abs(), step(1).abs());
            let larger = |a: f32, b: f32| if a > b { a } else { b };
            z += bias.of(larger(dx, dy), D::resolution(larger(larger(p, q), r)));
        }
        Self { z, more, inv_area2, step_x: step(0), low, high }
    }

    /// Where the first two edge functions are these.
    #[inline(always)]
    pub(crate) fn at_edges(&self, e0: f32, e1: f32) -> f32 {
        self.z + (e0 * self.inv_area2) * self.more[0] + (e1 * self.inv_area2) * self.more[1]
    }

    /// Change by a pixel to the right.
    #[inline(always)]
    pub(crate) fn step_x(&self) -> f32 {
        self.step_x
    }

    /// Whether it is inside the depth range `dx` columns right of where it is `z`.
    ///
    /// Bits of floats from 0 on, as integers, are in the order of the floats; those of −0, of negative ones and of NaN come
    /// after.
    #[inline(always)]
    pub(crate) fn contains(&self, z: f32, dx: f32) -> bool {
        let low = self.low.to_bits();
        (z + self.step_x * dx).to_bits().wrapping_sub(low) <= self.high.to_bits().wrapping_sub(low)
    }

    /// `dx` columns right of where it is `z`, inside the depth range.
    #[inline(always)]
    pub(crate) fn moved(&self, z: f32, dx: f32) -> f32 {
        clamp(z + self.step_x * dx, self.low, self.high)
    }
}

/// What a draw without a closure works with: depth is tested and written where it lies, eight pixels at a time.
#[derive(Debug)]
pub(crate) struct DepthPass<'a, F, T> {
    pub(crate) target: &'a mut F,
    /// What the framebuffer has, and which of it may be drawn to.
    pub(crate) target_area: Rect,
    pub(crate) render_area: Rect,
    pub(crate) test: T,
}

impl<F: Framebuffer, T: DepthTest> DepthPass<'_, F, T> {
    /// Draws a triangle. Gives how many fragments passed.
    #[inline(always)]
    pub(crate) fn draw(&mut self, setup: &Setup, plane: &DepthPlane) -> u64 {
        let (area, bounds, solver) = (self.render_area, setup.bounds(), Solver::new(setup));
        let (left, right) = (area.x, area.right());
        let (mut top, bottom) = (area.y.max(bounds.y), area.bottom().min(bounds.bottom()));
        let (mut passed, mut passed_alone) = ([0; LANES], [0]);
        while top < bottom {
            let rows = solver.solve(top, bottom);
            let mut z = [0.0; LANES];
            for lane in 0..LANES {
                z[lane] = plane.at_edges(rows.edges[0][lane], rows.edges[1][lane]);
            }
            for lane in 0..LANES.min((bottom - top) as usize) {
                let (start, end) = (rows.start[lane].max(left), rows.end[lane].min(right));
                let (mut x, y, mut has_windows) = (start, top + lane as i32, HAS_FLOAT_LANES);
                while x < end {
                    let z = (z[lane], (x - rows.anchor[lane]) as f32);
                    // A window may reach over the row's end, but not over the framebuffer's border.
                    if has_windows && x + LANES as i32 <= self.target_area.right() {
                        let run = self.target.run(x, y, LANES);
                        let Some(depths) = run.depth.first_chunk_mut() else {
                            // A framebuffer that lends less is drawn as far as it goes.
                            has_windows = false;
                            continue;
                        };
                        test_window(self.test, depths, end - x, plane, z, &mut passed);
                        x += LANES as i32;
                    } else {
                        let run = self.target.run(x, y, 1);
                        let Some(depth) = run.depth.first_mut() else { break };
                        test_window(self.test, core::array::from_mut(depth), 1, plane, z, &mut passed_alone);
                        x += 1;
                    }
                }
            }
            top += LANES as i32;
        }
        passed.iter().chain(&passed_alone).map(|&lane| u64::from(lane)).sum()
    }
}

/// Tests and writes the first `len` of some neighbouring depths, where the triangle's depth is `z` plus `dx` columns' change.
/// Counts in `passed`, lane by lane.
#[inline(always)]
fn test_window<D: DepthFormat, const N: usize>(
    test: impl DepthTest,
    depths: &mut [D; N],
    len: i32,
    plane: &DepthPlane,
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
    *depths = new;
}

/// The arrays of a packet: what shading starts from. References to separate arrays, so that one that nobody reads
/// disappears.
#[derive(Debug)]
pub(crate) struct Packet<'a, C, D> {
    pub(crate) p: &'a mut [f32; PACKET],
    pub(crate) q: &'a mut [f32; PACKET],
    pub(crate) sum: &'a mut [f32; PACKET],
    pub(crate) l: &'a mut [f32; PACKET],
    pub(crate) m: &'a mut [f32; PACKET],
    pub(crate) z: &'a mut [f32; PACKET],
    pub(crate) x: &'a mut [i32; PACKET],
    pub(crate) y: &'a mut [i32; PACKET],
    /// A packet of several rows has its pixels here until all are shaded.
    pub(crate) colors: &'a mut [C; WINDOWS],
    pub(crate) depths: &'a mut [D; WINDOWS],
    /// A packet of single fragments also remembers where each belongs.
    pub(crate) places: &'a mut [(i32, i32); LIST],
}

/// Fragments in a packet of a tiny triangle, and room for one that fails.
pub(crate) const LIST: usize = if HAS_FLOAT_LANES { (Tiny::SIZE * Tiny::SIZE) as usize + 1 } else { 1 };

/// Pixels in a packet of several rows.
pub(crate) const WINDOWS: usize = if HAS_FLOAT_LANES { PACKET } else { 1 };

/// Rows up to this width share packets.
const NARROW: usize = 64;

impl<C, D> Packet<'_, C, D> {
    /// Sets one fragment, its pixel and where that is.
    #[inline(always)]
    fn put(&mut self, i: usize, at: Sample, z: f32, place: (i32, i32), (color, depth): (C, D)) {
        if i >= LIST.min(PACKET).min(WINDOWS) {
            return;
        }
        (self.p[i], self.q[i], self.sum[i], self.l[i], self.m[i]) = (at.p, at.q, at.sum, at.l, at.m);
        (self.z[i], self.x[i], self.y[i]) = (z, place.0, place.1);
        (self.colors[i], self.depths[i], self.places[i]) = (color, depth, place);
    }

    /// [`set`](Self::set) for eight fragments, one array after the other: as one loop over all, the columns were put
    /// together anew for each array.
    #[inline(always)]
    fn set_window(&mut self, at: usize, (base, step): (Sample, Sample), dx: i32, (x, y): (i32, i32)) {
        let (first, mut dx) = (dx as f32, [0.0; LANES]);
        for i in 0..LANES {
            dx[i] = first + i as i32 as f32;
        }
        ramp(self.p, at, base.p, step.p, &dx);
        ramp(self.q, at, base.q, step.q, &dx);
        ramp(self.sum, at, base.sum, step.sum, &dx);
        ramp(self.l, at, base.l, step.l, &dx);
        ramp(self.m, at, base.m, step.m, &dx);
        if let (Some(xs), Some(ys)) = (self.x.get_mut(at..at + LANES), self.y.get_mut(at..at + LANES)) {
            for i in 0..LANES {
                (xs[i], ys[i]) = (x.wrapping_add(i as i32), y);
            }
        }
    }

    /// Sets fragments `start .. start + len` to the neighbours of the sample `base`, the first of them `dx` columns from
    /// it and in column `x`.
    #[inline(always)]
    fn set(&mut self, start: usize, len: usize, (base, step): (Sample, Sample), dx: i32, (x, y): (i32, i32)) {
        let Some(end) = start.checked_add(len) else { return };
        let (Some(p), Some(q), Some(sum), Some(l), Some(m), Some(xs), Some(ys)) = (
            self.p.get_mut(start..end),
            self.q.get_mut(start..end),
            self.sum.get_mut(start..end),
            self.l.get_mut(start..end),
            self.m.get_mut(start..end),
            self.x.get_mut(start..end),
            self.y.get_mut(start..end),
        ) else {
            return;
        };
        let dx = dx as f32;
        for i in 0..len {
            // Two whole numbers under 2²⁴: as exact as the sum of integers, and less work.
            let at = base.moved(step, dx + i as i32 as f32);
            (p[i], q[i], sum[i], l[i], m[i]) = (at.p, at.q, at.sum, at.l, at.m);
            (xs[i], ys[i]) = (x.wrapping_add(i as i32), y);
        }
    }
}

/// What a draw's shading works with.
#[derive(Debug)]
pub(crate) struct Shader<'a, F, T, S> {
    pub(crate) target: &'a mut F,
    /// What the framebuffer has, and which of it may be drawn to.
    pub(crate) target_area: Rect,
    pub(crate) render_area: Rect,
    pub(crate) test: T,
    pub(crate) shade: S,
}

/// Some rows of a triangle, ready to be shaded.
struct Band<'a, V> {
    shading: &'a Shading<'a, V>,
    plane: &'a DepthPlane,
    step: Sample,
    rows: Rows,
    /// Depth at the anchors.
    z: [f32; LANES],
    /// The topmost row, and how many there are.
    y: i32,
    count: usize,
}

impl<V: Varyings> Band<'_, V> {
    /// Solves the next rows, from `top`, and cuts them to the area.
    #[inline(always)]
    fn solve(&mut self, solver: &Solver, (top, bottom): (i32, i32), area: Rect) {
        self.rows = solver.solve(top, bottom);
        (self.y, self.count) = (top, LANES.min((bottom - top) as usize));
        let (left, right) = (area.x, area.right());
        for lane in 0..LANES {
            self.rows.start[lane] = self.rows.start[lane].max(left);
            self.rows.end[lane] = self.rows.end[lane].min(right);
            self.z[lane] = self.plane.at_edges(self.rows.edges[0][lane], self.rows.edges[1][lane]);
        }
    }

    /// How many samples of a row are covered.
    #[inline(always)]
    fn len(&self, lane: usize) -> usize {
        (self.rows.end[lane] - self.rows.start[lane]).max(0) as usize
    }

    /// What weights are made of at a row's anchor.
    #[inline(always)]
    fn base(&self, lane: usize) -> Sample {
        let [a, b, c] = &self.rows.edges;
        self.shading.sample([a[lane], b[lane], c[lane]])
    }
}

impl<F: Framebuffer, T: DepthTest, S> Shader<'_, F, T, S> {
    /// Draws a triangle.
    #[inline(always)]
    pub(crate) fn draw<V, R>(
        &mut self,
        setup: &Setup,
        shading: &Shading<'_, V>,
        plane: &DepthPlane,
        packet: &mut Packet<'_, F::Color, F::Depth>,
        statistics: &mut Statistics,
    ) where
        V: Varyings,
        S: FnMut(Fragment<'_, V>, F::Color) -> R,
        R: Into<Option<F::Color>>,
    {
        let (area, bounds) = (self.render_area, setup.bounds());
        let rows = (area.y.max(bounds.y), area.bottom().min(bounds.bottom()));
        let band = Band {
            shading,
            plane,
            step: shading.step_x(),
            rows: Rows::EMPTY,
            z: [0.0; LANES],
            y: rows.0,
            count: 0,
        };
        self.draw_packets(setup, rows, band, packet, statistics);
    }

    /// Draws a triangle packet by packet.
    #[inline(always)]
    fn draw_packets<V, R>(
        &mut self,
        setup: &Setup,
        (mut top, bottom): (i32, i32),
        mut band: Band<'_, V>,
        packet: &mut Packet<'_, F::Color, F::Depth>,
        statistics: &mut Statistics,
    ) where
        V: Varyings,
        S: FnMut(Fragment<'_, V>, F::Color) -> R,
        R: Into<Option<F::Color>>,
    {
        let bounds = setup.bounds();
        let is_tiny = bounds.width <= Tiny::SIZE && bounds.height <= Tiny::SIZE;
        let mut listed = 0;
        if is_tiny {
            listed = self.fill_list(setup, (top, bottom), &band, packet);
            if listed == 0 {
                return;
            }
        }
        let solver = if is_tiny { None } else { Some(Solver::new(setup)) };
        let mut at = Progress::default();
        loop {
            // What to shade: fragments `begin .. end` of the packet.
            let (begin, end) = if listed > 0 {
                (0, listed)
            } else {
                match self.next_fragments(&band, &mut at, packet) {
                    Some(range) => range,
                    None => {
                        let Some(solver) = &solver else { return };
                        if top >= bottom {
                            return;
                        }
                        band.solve(solver, (top, bottom), self.render_area);
                        top += LANES as i32;
                        at = Progress::default();
                        if bounds.width > LANES as u32 {
                            self.touch(&band);
                        }
                        continue;
                    }
                }
            };
            let len = end - begin;
            // Where it goes: into the framebuffer, or into the packet's own pixels.
            let (colors, depths) = if listed == 0 && at.gathered.is_empty() {
                let run = self.target.run(at.x + begin as i32, band.y + at.lane as i32, len);
                (run.color, run.depth)
            } else {
                (&mut packet.colors[..], &mut packet.depths[..])
            };
            let (Some(colors), Some(depths)) = (colors.get_mut(..len), depths.get_mut(..len)) else { return };
            let (Some(p), Some(q), Some(sum), Some(l), Some(m), Some(z), Some(xs), Some(ys)) = (
                packet.p.get(begin..end),
                packet.q.get(begin..end),
                packet.sum.get(begin..end),
                packet.l.get(begin..end),
                packet.m.get(begin..end),
                packet.z.get(begin..end),
                packet.x.get(begin..end),
                packet.y.get(begin..end),
            ) else {
                return;
            };

            // Shade. Both results are selected, not branched on, so that a discard vectorises too.
            let mut kept = 0u32;
            for i in 0..len {
                let at = Sample { p: p[i], q: q[i], sum: sum[i], l: l[i], m: m[i] };
                let fragment = Fragment { triangle: band.shading, at, x: xs[i], y: ys[i], depth: z[i] };
                let shaded = (self.shade)(fragment, colors[i]).into();
                let is_kept = shaded.is_some();
                colors[i] = shaded.unwrap_or(colors[i]);
                depths[i] = if is_kept & self.test.writes() { F::Depth::from_depth(z[i]) } else { depths[i] };
                kept += u32::from(is_kept);
            }
            statistics.fragments += len as u64;
            statistics.samples_passed += u64::from(kept);

            if listed > 0 {
                return self.write_list(listed, packet);
            }
            self.write_rows(&band, &mut at, packet);
        }
    }

    /// Fills a packet with the fragments of a tiny triangle that pass the depth test. Gives how many.
    #[inline(always)]
    fn fill_list<V: Varyings>(
        &mut self,
        setup: &Setup,
        (top, bottom): (i32, i32),
        band: &Band<'_, V>,
        packet: &mut Packet<'_, F::Color, F::Depth>,
    ) -> usize {
        let bounds = setup.bounds();
        let tiny = Tiny::new(setup.corners(), bounds.x, bounds.y, bounds.width as i32);
        let anchors_at_end = anchors_at_end(setup);
        let (left, right) = (self.render_area.x, self.render_area.right());
        let mut filled = 0;
        for y in top..bottom {
            let Some(span) = tiny.span(y, left, right, anchors_at_end) else { continue };
            let [e0, e1, _] = span.edges();
            let (base, z) = (band.shading.sample(span.edges()), band.plane.at_edges(e0, e1));
            let run = self.target.run(span.start(), y, (span.end() - span.start()) as usize);
            let pixels = run.color.iter().zip(run.depth.iter());
            for (x, (&color, &depth)) in (span.start()..).zip(pixels) {
                let dx = (x - span.anchor()) as f32;
                let z = band.plane.moved(z, dx);
                let at = base.moved(band.step, dx);
                let passes = !F::Depth::IS_STORED || self.test.passes(F::Depth::from_depth(z), depth);
                // Always put there; counted, or overwritten by the next.
                packet.put(filled, at, z, (x, y), (color, depth));
                filled += usize::from(passes & (x < span.end()));
            }
        }
        filled
    }

    /// Writes the pixels of a packet of single fragments.
    #[inline(always)]
    fn write_list(&mut self, len: usize, packet: &Packet<'_, F::Color, F::Depth>) {
        let places = packet.places.iter().zip(packet.colors.iter()).zip(packet.depths.iter());
        for ((&(x, y), &color), &depth) in places.take(len) {
            let run = self.target.run(x, y, 1);
            if let (Some(to_color), Some(to_depth)) = (run.color.first_mut(), run.depth.first_mut()) {
                (*to_color, *to_depth) = (color, depth);
            }
        }
    }

    /// Reads a pixel of each cache line of a band's narrow rows, all at once: where the framebuffer is larger than the
    /// cache, what is not there comes while the rest is asked for, and not a row after the other.
    #[inline(always)]
    fn touch<V: Varyings>(&mut self, band: &Band<'_, V>) {
        for lane in 0..band.count {
            let len = band.len(lane);
            if len == 0 || len > NARROW {
                continue;
            }
            let run = self.target.run(band.rows.start[lane], band.y + lane as i32, len);
            let mut i = 0;
            while let (Some(&color), Some(&depth)) = (run.color.get(i), run.depth.get(i)) {
                black_box((color, depth));
                i += 16;
            }
        }
    }

    /// Finds the next fragments to shade and fills the packet with them. Gives where in the packet they stand.
    #[inline(always)]
    fn next_fragments<V: Varyings>(
        &mut self,
        band: &Band<'_, V>,
        at: &mut Progress,
        packet: &mut Packet<'_, F::Color, F::Depth>,
    ) -> Option<(usize, usize)> {
        loop {
            if at.end < at.len {
                // The next that pass, of a stretch in which some do.
                let run = self.target.run(at.x, band.y + at.lane as i32, at.len);
                let (z, old) = (packet.z.get(..at.len)?, run.depth.get(..at.len)?);
                let passes = |i: usize| self.test.passes(F::Depth::from_depth(z[i]), old[i]);
                let begin = (at.end..at.len).find(|&i| passes(i));
                let Some(begin) = begin else {
                    at.end = at.len;
                    continue;
                };
                at.end = (begin..at.len).find(|&i| !passes(i)).unwrap_or(at.len);
                return Some((begin, at.end));
            }
            let is_between_rows = at.len == 0 || at.x + at.len as i32 >= *band.rows.end.get(at.lane)?;
            if is_between_rows {
                at.lane += usize::from(at.len > 0);
                at.len = 0;
                at.end = 0;
                let filled = self.gather_rows(band, at, packet);
                if filled > 0 {
                    return Some((0, filled));
                }
                if at.lane >= band.count {
                    return None;
                }
            }
            // The next stretch.
            at.x = if is_between_rows { *band.rows.start.get(at.lane)? } else { at.x + at.len as i32 };
            at.end = 0;
            let lane = at.lane;
            let len = PACKET.min((band.rows.end[lane] - at.x) as usize);
            let (x, y) = (at.x, band.y + lane as i32);
            let dx = x - band.rows.anchor[lane];
            let run = self.target.run(x, y, len);
            // A framebuffer that lends less than it was asked for gets no more than that.
            let lent = len.min(run.color.len()).min(run.depth.len());
            at.len = len;
            let len = lent;
            let (z, old) = (packet.z.get_mut(..len)?, run.depth.get(..len)?);
            let mut passing = 0u32;
            for i in 0..len {
                z[i] = band.plane.moved(band.z[lane], dx.wrapping_add(i as i32) as f32);
                passing +=
                    u32::from(!F::Depth::IS_STORED || self.test.passes(F::Depth::from_depth(z[i]), old[i]));
            }
            if passing == 0 {
                at.end = at.len;
                continue;
            }
            packet.set(0, len, (band.base(lane), band.step), dx, (x, y));
            if passing as usize == len {
                at.end = at.len;
                return Some((0, len));
            }
        }
    }

    /// Fills a packet with whole rows, from `at.lane` on, up to the first that does not suit: one that is wide, that fails
    /// the depth test in part, that no longer fits, or that has no room for windows. Gives how many fragments.
    #[inline(always)]
    fn gather_rows<V: Varyings>(
        &mut self,
        band: &Band<'_, V>,
        at: &mut Progress,
        packet: &mut Packet<'_, F::Color, F::Depth>,
    ) -> usize {
        let (first, mut filled) = (at.lane, 0);
        while at.lane < band.count.min(LANES) {
            let (lane, len) = (at.lane, band.len(at.lane));
            if len > NARROW {
                break;
            }
            // Most rows of small triangles are one window: code of its own for them takes W3 from 222 to 213 M
            // instructions a frame with AVX2.
            let gathered = match len {
                0 => Some(0),
                1..=LANES => self.gather_row(band, lane, LANES, filled, packet),
                _ => self.gather_row(band, lane, len.next_multiple_of(LANES), filled, packet),
            };
            let Some(gathered) = gathered else { break };
            filled += gathered;
            at.ends[lane] = filled;
            at.lane += 1;
        }
        at.gathered = if filled > 0 { first..at.lane } else { 0..0 };
        filled
    }

    /// Fills a packet from `filled` on with a row, in windows of eight pixels, together `room`. The last one reaches over
    /// the row's end. Gives how many fragments: all of them or none.
    #[inline(always)]
    fn gather_row<V: Varyings>(
        &mut self,
        band: &Band<'_, V>,
        lane: usize,
        room: usize,
        filled: usize,
        packet: &mut Packet<'_, F::Color, F::Depth>,
    ) -> Option<usize> {
        let (x, y) = (band.rows.start[lane], band.y + lane as i32);
        if filled + room > PACKET || x + room as i32 > self.target_area.right() {
            return None;
        }
        let (len, dx) = (band.rows.end[lane] - x, x - band.rows.anchor[lane]);
        let run = self.target.run(x, y, room);
        let (old_colors, old_depths) = (run.color.get(..room)?, run.depth.get(..room)?);
        let mut passing = [0; LANES];
        let mut start = 0;
        while start < room {
            let z = packet.z.get_mut(filled + start..filled + start + LANES)?;
            let old = old_depths.get(start..start + LANES)?;
            let (left, dx) = (len - start as i32, (dx + start as i32) as f32);
            for i in 0..LANES {
                z[i] = band.plane.moved(band.z[lane], dx + i as i32 as f32);
            }
            for i in 0..LANES {
                let passes = !F::Depth::IS_STORED || self.test.passes(F::Depth::from_depth(z[i]), old[i]);
                passing[i] += i32::from(passes & ((i as i32) < left));
            }
            start += LANES;
        }
        let passing = passing.iter().sum::<i32>();
        if passing != len {
            return if passing == 0 { Some(0) } else { None };
        }
        let base = (band.base(lane), band.step);
        let mut start = 0;
        while start < room {
            let offset = start as i32;
            copy_window(packet.colors, filled + start, old_colors, start);
            copy_window(packet.depths, filled + start, old_depths, start);
            packet.set_window(filled + start, base, dx + offset, (x + offset, y));
            start += LANES;
        }
        Some(len as usize)
    }

    /// Writes the pixels of gathered rows.
    #[inline(always)]
    fn write_rows<V: Varyings>(
        &mut self,
        band: &Band<'_, V>,
        at: &mut Progress,
        packet: &Packet<'_, F::Color, F::Depth>,
    ) {
        let mut begin = 0;
        for lane in core::mem::take(&mut at.gathered) {
            let Some(&end) = at.ends.get(lane) else { return };
            let written = match end - begin {
                0 => Some(()),
                1..=LANES => self.write_row(band, lane, LANES, begin, packet),
                len => self.write_row(band, lane, len.next_multiple_of(LANES), begin, packet),
            };
            if written.is_none() {
                return;
            }
            begin = end;
        }
    }

    /// Writes the pixels of a row that stands in the packet from `begin` on.
    #[inline(always)]
    fn write_row<V: Varyings>(
        &mut self,
        band: &Band<'_, V>,
        lane: usize,
        room: usize,
        begin: usize,
        packet: &Packet<'_, F::Color, F::Depth>,
    ) -> Option<()> {
        let x = band.rows.start[lane];
        let len = band.rows.end[lane] - x;
        let run = self.target.run(x, band.y + lane as i32, room);
        let (to_colors, to_depths) = (run.color.get_mut(..room)?, run.depth.get_mut(..room)?);
        let mut start = 0;
        while start < room {
            let (from, to) = (begin + start..begin + start + LANES, start..start + LANES);
            write_window(
                to_colors.get_mut(to.clone())?,
                packet.colors.get(from.clone())?,
                len - start as i32,
            );
            write_window(to_depths.get_mut(to)?, packet.depths.get(from)?, len - start as i32);
            start += LANES;
        }
        Some(())
    }
}

/// Copies eight pixels.
#[inline(always)]
fn copy_window<T: Copy>(to: &mut [T], at: usize, from: &[T], start: usize) {
    if let (Some(to), Some(from)) = (to.get_mut(at..at + LANES), from.get(start..start + LANES)) {
        to.copy_from_slice(from);
    }
}

/// Sets eight numbers to `first + step · dx`.
#[inline(always)]
fn ramp(numbers: &mut [f32], at: usize, first: f32, step: f32, dx: &[f32; LANES]) {
    if let Some(window) = numbers.get_mut(at..at + LANES) {
        for i in 0..LANES {
            window[i] = first + step * dx[i];
        }
    }
}

/// Writes the first `len` of eight pixels.
///
/// Selected in a local array: where the choice is between storing and not, the compiler branches, once a pixel.
#[inline(always)]
fn write_window<T: Copy>(to: &mut [T], from: &[T], len: i32) {
    if let (Some(to), Some(from)) = (to.first_chunk_mut::<LANES>(), from.first_chunk::<LANES>()) {
        let (mut pixels, new) = (*to, *from);
        for i in 0..LANES {
            pixels[i] = if (i as i32) < len { new[i] } else { pixels[i] };
        }
        *to = pixels;
    }
}

/// How far the shading of a band has come.
#[derive(Clone, Debug, Default)]
struct Progress {
    /// The row.
    lane: usize,
    /// The stretch of it that the packet holds: its first column and its length, and how much of it is done.
    x: i32,
    len: usize,
    end: usize,
    /// The rows that the packet holds instead, and where each ends.
    gathered: Range<usize>,
    ends: [usize; LANES],
}
