//! The fragment half of a draw: depth test, closure, and the caller's memory.
//!
//! Where there is SIMD, fragments of one triangle are collected into *packets*: arrays of the numbers that shading starts
//! from. Filling them and shading are separate loops without branches, and there is one shading loop only, so the
//! compiler inlines the closure into it and makes SIMD of the whole. A packet is either
//!
//! * a stretch of one row: depth is tested for all of it at once. If all fragments pass, as most often, they are shaded,
//!   straight into the framebuffer where that is safe; if none, the stretch is done; if some, each run of fragments that
//!   pass is shaded;
//! * up to eight rows of at most [`NARROW`] pixels, in windows of eight, if all fragments of them pass: shaded
//!   as one packet and then written row by row. A row at a time, such triangles would cost more in loops than in shading; or
//! * all fragments that pass of a [tiny](crate::tiny) triangle, whose rows are windows of 4 to 16 samples, or of a
//!   [minute](crate::minute) one, whose samples are known.
//!
//! Which samples a triangle up to eight pixels wide covers is found out while the one before it still waits to be drawn: see
//! [`upcoming`](crate::upcoming).
//! With registers of eight lanes, packets of the last two kinds are filled up to a multiple of eight, but for one or two fragments, so
//! that none is left over after SIMD.
//!
//! Elsewhere, `one_by_one.rs` tests and shades one fragment after the other: less memory, less code, and the same results.

#![expect(clippy::cast_possible_truncation, reason = "offsets in a packet and rows of a band are under 2⁹")]

use core::hint::black_box;
use core::num::NonZeroUsize;
use core::ops::Range;

use crate::band::Band;
use crate::closure::{Closure, Shade};
use crate::coarse::{Coarse, Hidden};
use crate::depth::{DepthFormat, DepthTest, passes};
use crate::fan::Piece;
use crate::fragment::Shading;
use crate::interpolate::Varyings;
use crate::minute::Minute;
use crate::packet::{
    NARROW, PACKET, Packet, Places, RAMP, ROW, Samples, Start, Triangle, WINDOW, copy, place_of,
};
use crate::plane::{DepthPlane, LanePlane, RowPlane};
use crate::state::Statistics;
use crate::target::{Block, Borders, Framebuffer, lend};
use crate::tiny::{self, Lanes, NarrowLanes, Tiny};
use crate::traverse::{LANES, Solver};
use crate::upcoming::Known;

/// What a draw's shading works with. The closure reads the colour already there if it `BLENDS`.
#[derive(Debug)]
pub(crate) struct Shader<'a, F, T, S, const BLENDS: bool> {
    pub(crate) target: &'a mut F,
    /// What the framebuffer has, and which of it may be drawn to.
    pub(crate) target_area: Borders,
    pub(crate) render_area: Borders,
    pub(crate) test: T,
    pub(crate) closure: S,
    /// Whether all fragments of the last stretch passed: most likely those of the next will.
    pub(crate) expects_all: bool,
    pub(crate) coarse: Coarse,
    /// Where samples stand, for the stride last used.
    pub(crate) places: &'a mut Places,
}

/// What is left of a triangle to be shaded: all of a tiny or minute one, which is in the packet already, so many fragments; or
/// row after row.
#[expect(clippy::large_enum_variant, reason = "it never moves")]
enum Work {
    Tiny(Patch, usize),
    Rows(Solver, Band, Progress),
}

/// Where fragments of a tiny or minute triangle go. Their places are counted from pixel (x, y), in a block, or 16 a row where
/// the framebuffer lends none.
#[derive(Clone, Copy)]
struct Patch {
    x: i32,
    y: i32,
    block: Option<Dimensions>,
}

/// Of a block of pixels.
#[derive(Clone, Copy)]
struct Dimensions {
    width: usize,
    height: usize,
    stride: usize,
}

impl<F: Framebuffer, T: DepthTest, S: Closure, const BLENDS: bool> Shader<'_, F, T, S, BLENDS> {
    /// Draws a piece, of which this is known.
    #[inline(always)]
    pub(crate) fn draw<V>(
        &mut self,
        (piece, known): (&Piece, &Known),
        shading: &Shading<'_, V>,
        plane: &DepthPlane,
        packet: &mut Packet<'_, F::Color, F::Depth>,
        statistics: &mut Statistics,
    ) where
        V: Varyings,
        S: Shade<V, F::Color>,
    {
        let triangle = Triangle { shading, plane };
        let Piece { setup, covered, .. } = piece;
        let mut work = if *covered != 0 {
            let minute = Minute::new(setup, *covered);
            let patch = Patch { x: minute.x, y: minute.y, block: None };
            let len = self.fill_minute(minute, triangle, packet);
            if len == 0 {
                return;
            }
            Work::Tiny(patch, len)
        } else if known.is_tiny {
            let Known { tiny, covered_lanes, .. } = known;
            let (len, block) = self.fill_tiny(tiny, *covered_lanes, triangle, packet);
            if len == 0 {
                return;
            }
            Work::Tiny(Patch { x: tiny.x, y: tiny.y, block }, len)
        } else {
            let band = Band::new(setup, triangle, self.render_area);
            Work::Rows(Solver::new(setup), band, Progress::default())
        };
        loop {
            // What to shade: fragments `begin .. end` of the packet.
            let (begin, end) = match &mut work {
                Work::Tiny(_, len) => (0, *len),
                Work::Rows(solver, band, at) => {
                    if let Some(range) = self.next_fragments(triangle, band, at, packet) {
                        range
                    } else {
                        if !band.solve(solver, triangle, self.render_area) {
                            return;
                        }
                        at.begin();
                        continue;
                    }
                }
            };
            let asked = end - begin;
            // How many fragments there are, and how many lanes.
            let mut count = asked;
            let mut len = S::PADDING.lanes(begin, count);
            let samples = Samples {
                alpha: packet.alpha,
                beta: packet.beta,
                sum: packet.sum,
                inv_sum: packet.inv_sum,
                l: packet.l,
                m: packet.m,
                z: packet.z,
                x: packet.x,
                y: packet.y,
            };
            // And where it goes: into the framebuffer, or into the packet's own pixels. (All is cut in each arm, not once behind the
            // `match`: where it is known which arrays these are, one check of their lengths is enough. And not by a function:
            // what LLVM learns from its arguments does loops no good.)
            let (colors, depths, discarded, samples) = match &work {
                Work::Rows(_, band, at) if at.gathered.is_empty() => {
                    let run = self.target.run(at.x + begin as i32, band.y + at.row as i32, asked);
                    // Fewer if the framebuffer lends fewer.
                    count = count.min(run.color.len()).min(run.depth.len());
                    let (colors, depths) = if S::MAY_READ {
                        len = S::PADDING.lanes(begin, count);
                        if BLENDS {
                            copy(packet.colors, run.color.get(..count).unwrap_or_default());
                        }
                        (&mut packet.colors[..], &mut packet.depths[..])
                    } else {
                        // No padding: the pixels behind it are others'. (Said here, not once behind the `match`: with AVX2, some
                        // loops would load masked lanes then.)
                        len = count;
                        (run.color, run.depth)
                    };
                    let (Some(colors), Some(depths), Some(discarded), Some(samples)) = (
                        colors.get_mut(..len),
                        depths.get_mut(..len),
                        packet.discarded.get_mut(..len),
                        samples.part(begin..begin + len),
                    ) else {
                        return;
                    };
                    (colors, depths, discarded, samples)
                }
                _ => {
                    debug_assert_eq!(begin, 0, "it is all of the packet");
                    let (Some(colors), Some(depths), Some(discarded), Some(samples)) = (
                        packet.colors.get_mut(..len),
                        packet.depths.get_mut(..len),
                        packet.discarded.get_mut(..len),
                        samples.part(0..len),
                    ) else {
                        return;
                    };
                    (colors, depths, discarded, samples)
                }
            };

            // A copy that nobody else can see: else each store to the framebuffer might change it, and the loop would load it
            // again and again.
            let varyings = *shading.varyings();
            let shading = shading.with_varyings(&varyings);
            let lost =
                self.closure.shade_packet(self.test, &shading, samples, count, colors, depths, discarded);
            statistics.fragments += count as u64;
            statistics.samples_passed += count as u64 - u64::from(lost);
            if lost > 0 {
                self.restore(&work, (begin, count, asked), packet);
            }
            let (band, at) = match &mut work {
                Work::Tiny(patch, len) => return self.write_tiny(*patch, *len, packet),
                Work::Rows(_, band, at) => (band, at),
            };
            at.is_shaded = true;
            at.has_gaps |= lost > 0 || count < asked;
            if !at.gathered.is_empty() {
                self.write_rows(band, at, packet);
            } else if S::MAY_READ {
                let run = self.target.run(at.x + begin as i32, band.y + at.row as i32, asked);
                // An empty slice for what is not there, and LLVM would no longer know that a texture is not the packet's pixels:
                // loops that read both would stay scalar.
                let (Some(colors), Some(depths)) = (packet.colors.get(..count), packet.depths.get(..count))
                else {
                    return;
                };
                copy(run.color, colors);
                if self.test.writes() {
                    copy(run.depth, depths);
                }
            }
        }
    }

    /// Gives discarded fragments of the packet the pixels that are there: they are about to be written with the others.
    #[inline(always)]
    fn restore(
        &mut self,
        work: &Work,
        (begin, count, asked): (usize, usize, usize),
        packet: &mut Packet<'_, F::Color, F::Depth>,
    ) {
        let Packet { colors, depths, discarded, places, .. } = packet;
        // By what lends them when they are written: of what is lent for another, nothing is known.
        match work {
            &Work::Tiny(patch, len) => {
                let Some(places) = places.get(..len) else { return };
                let pixels = discarded.iter().zip(colors.iter_mut().zip(depths.iter_mut()));
                self.for_each_place(patch, places, pixels, |(discarded, pixel), &mut color, &mut depth| {
                    if *discarded == 1 {
                        (*pixel.0, *pixel.1) = (color, depth);
                    }
                });
            }
            Work::Rows(_, band, at) => {
                let mut restore = |begin: usize, len: usize, (x, y): (i32, i32), asked: usize| {
                    let run = self.target.run(x, y, asked);
                    for (at, (&color, &depth)) in (begin..begin + len).zip(run.color.iter().zip(&*run.depth))
                    {
                        if discarded.get(at) == Some(&1) {
                            (colors[at], depths[at]) = (color, depth);
                        }
                    }
                };
                if at.gathered.is_empty() && S::MAY_READ {
                    restore(0, count, (at.x + begin as i32, band.y + at.row as i32), asked);
                }
                let mut begin = 0;
                for row in at.gathered.clone() {
                    let Some(&end) = at.ends.get(row) else { break };
                    let (len, x) = (end - begin, band.start[row]);
                    // An empty row may lie beside the area.
                    if len > 0 {
                        restore(begin, len, (x, band.y + row as i32), len);
                    }
                    begin = end;
                }
            }
        }
        discarded.fill(0);
    }

    /// Fills a packet with the fragments of a minute triangle that pass the depth test. Gives how many.
    #[inline(always)]
    fn fill_minute<V: Varyings>(
        &mut self,
        minute: Minute<'_>,
        Triangle { shading, plane }: Triangle<'_, V>,
        packet: &mut Packet<'_, F::Color, F::Depth>,
    ) -> usize {
        let mut filled = 0;
        for sample in minute {
            let z = plane.at_sample(sample.edges);
            let run = self.target.run(sample.x, sample.y, 1);
            let (Some(&color), Some(&depth)) = (run.color.first(), run.depth.first()) else { continue };
            if passes(self.test, z, depth) {
                let weights = shading.scales.parts(sample.edges).divided();
                packet.put(filled, (sample.x, sample.y), weights, z, sample.place);
                if BLENDS {
                    packet.colors[filled] = color;
                }
                filled += 1;
            }
        }
        filled
    }

    /// Fills a packet with the fragments of a tiny triangle that pass the depth test, of which this is
    /// [known](Known::covered_lanes). Gives how many, and the block that they are in.
    #[inline(always)]
    fn fill_tiny<V: Varyings>(
        &mut self,
        tiny: &Tiny,
        covered_lanes: NarrowLanes,
        triangle: Triangle<'_, V>,
        packet: &mut Packet<'_, F::Color, F::Depth>,
    ) -> (usize, Option<Dimensions>) {
        let is_narrow = tiny.lanes <= tiny::NARROW_WINDOW;
        // (Of a narrow one, its lanes alone tell that nothing may be drawn to, or that nothing is covered.)
        let is_empty = if is_narrow { covered_lanes == [0; 2] } else { tiny.is_empty() };
        if is_empty {
            return (0, None);
        }
        debug_assert!(!tiny.is_empty(), "of {tiny:?}");
        let (width, height) = (tiny.width(self.target_area), tiny.rows as usize);
        let lent = if is_narrow { lend(self.target, (tiny.x, tiny.y), (width, height)) } else { None };
        let mut filled = 0;
        let dimensions;
        if let Some(Block { depth, stride, .. }) = lent {
            // How many samples are covered is known without a look at the memory: a loop's end that is guessed wrong does not
            // have to wait for it.
            dimensions = Some(Dimensions { width, height, stride });
            let depth = &*depth;
            let read = |place: u32| depth.get(place as usize).copied();
            let places = self.places.narrow.with_stride(stride);
            // (`for` would have to keep both in memory. Few triangles have a second one.)
            let [first, second] = covered_lanes;
            let (mut word, mut lanes) = (0, first);
            loop {
                filled = packet.put_lanes::<_, 8, 2, true>(
                    filled,
                    (lanes, word),
                    tiny,
                    triangle,
                    places,
                    (self.test, read),
                );
                if word == 1 || second == 0 {
                    break;
                }
                (word, lanes) = (1, second);
            }
        } else {
            // Rows are so long, or so slow to get, that they are tested as a whole.
            let (test, plane) = (self.test, &triangle.plane.in_lanes());
            let passing;
            (passing, dimensions) = match tiny.lanes {
                ..=4 => (test_by_runs::<_, 4>(self.target, test, *tiny, width, *plane), None),
                5..=8 => (test_by_runs::<_, 8>(self.target, test, *tiny, width, *plane), None),
                9..=12 => self.test_tiny::<12>(tiny, plane),
                _ => self.test_tiny::<16>(tiny, plane),
            };
            let places = self.places.wide.with_stride(dimensions.map_or(ROW, |block| block.stride));
            for (word, lanes) in passing.into_iter().enumerate() {
                let read = |_| None;
                filled = packet.put_lanes::<_, 16, 4, false>(
                    filled,
                    (lanes, word),
                    tiny,
                    triangle,
                    places,
                    (self.test, read),
                );
            }
        }
        if BLENDS {
            self.read_tiny(Patch { x: tiny.x, y: tiny.y, block: dimensions }, filled, packet);
        }
        (filled, dimensions)
    }

    /// The lanes of a tiny triangle's wide windows, of `N` lanes, that are covered and pass the depth test, and the block that
    /// they are in.
    #[inline(always)]
    fn test_tiny<const N: usize>(&mut self, tiny: &Tiny, plane: &LanePlane) -> (Lanes, Option<Dimensions>) {
        let (mut found, mut row, mut number, mut at) = ([0; 4], tiny.first_row::<N>(), 0, 0usize);
        let (width, height) = (tiny.width(self.target_area), tiny.rows as usize);
        let Some(Block { color, depth, stride }) = lend(self.target, (tiny.x, tiny.y), (width, height))
        else {
            return (test_by_runs::<_, N>(self.target, self.test, *tiny, width, *plane), None);
        };
        let may_draw = tiny.may_draw();
        for (word, lanes) in found.iter_mut().enumerate() {
            let mut shift = 0;
            while number < (4 * (word + 1)).min(height) {
                let (Some(colors), Some(depths)) = (
                    color.get(at..at.wrapping_add(N)),
                    depth.get(at..at.wrapping_add(N)).and_then(<[_]>::first_chunk),
                ) else {
                    return (test_by_runs::<_, N>(self.target, self.test, *tiny, width, *plane), None);
                };
                if !BLENDS {
                    // Its cache line, which is about to be written, comes while depth is tested.
                    black_box(colors[0]);
                }
                *lanes |= u64::from(tiny.chosen::<_, N>(row, plane, self.test, depths, may_draw)) << shift;
                (row, at) = (tiny.next_row(row), at.wrapping_add(stride));
                (number, shift) = (number + 1, shift + 16);
            }
        }
        (found, Some(Dimensions { width, height, stride }))
    }

    /// Visits the framebuffer's pixels at some places of a patch, each with one of the packet's.
    #[inline(always)]
    fn for_each_place<P>(
        &mut self,
        Patch { x, y, block }: Patch,
        places: &[u32],
        pixels: impl Iterator<Item = P>,
        mut visit: impl FnMut(P, &mut F::Color, &mut F::Depth),
    ) {
        if let Some(Dimensions { width, height, stride }) = block {
            // One that is not lent as it was before is left alone. (As it was, all places are in it.)
            let Some(block) = lend(self.target, (x, y), (width, height)) else { return };
            if block.stride != stride {
                return;
            }
            for (&place, pixel) in places.iter().zip(pixels) {
                let at = place as usize;
                let (Some(color), Some(depth)) = (block.color.get_mut(at), block.depth.get_mut(at)) else {
                    return;
                };
                visit(pixel, color, depth);
            }
        } else {
            for (&place, pixel) in places.iter().zip(pixels) {
                let (dx, dy) = place_of(place);
                let run = self.target.run(x + dx, y + dy, 1);
                if let (Some(color), Some(depth)) = (run.color.first_mut(), run.depth.first_mut()) {
                    visit(pixel, color, depth);
                }
            }
        }
    }

    /// Reads the colours that a tiny triangle is blended with.
    #[inline(always)]
    fn read_tiny(&mut self, patch: Patch, len: usize, packet: &mut Packet<'_, F::Color, F::Depth>) {
        let (Some(places), Some(colors)) = (packet.places.get(..len), packet.colors.get_mut(..len)) else {
            return;
        };
        self.for_each_place(patch, places, colors.iter_mut(), |to, color, _| *to = *color);
    }

    /// Writes the pixels of a tiny triangle.
    #[inline(always)]
    fn write_tiny(&mut self, patch: Patch, len: usize, packet: &Packet<'_, F::Color, F::Depth>) {
        let (Some(places), Some(colors), Some(depths)) =
            (packet.places.get(..len), packet.colors.get(..len), packet.depths.get(..len))
        else {
            return;
        };
        let writes = self.test.writes();
        self.for_each_place(
            patch,
            places,
            colors.iter().zip(depths),
            |(color, depth), to_color, to_depth| {
                *to_color = *color;
                if writes {
                    *to_depth = *depth;
                }
            },
        );
    }

    /// Finds the next fragments to shade and fills the packet with them. Gives where in the packet they stand.
    #[inline(always)]
    fn next_fragments<V: Varyings>(
        &mut self,
        triangle: Triangle<'_, V>,
        band: &Band,
        at: &mut Progress,
        packet: &mut Packet<'_, F::Color, F::Depth>,
    ) -> Option<(usize, usize)> {
        loop {
            if at.done < at.lent {
                // The next that pass, of a stretch in which some do.
                let run = self.target.run(at.x, band.y + at.row as i32, at.lent);
                let (z, old) = (packet.z.get(..at.lent)?, run.depth.get(..at.lent)?);
                let begin = skip::<_, false>(self.test, z, old, at.done);
                at.done = skip::<_, true>(self.test, z, old, begin);
                if begin < at.done {
                    return Some((begin, at.done));
                }
            }
            let is_between_rows = at.len == 0 || at.x + at.len as i32 >= *band.end.get(at.row)?;
            if is_between_rows {
                if at.len > 0 {
                    if self.coarse.learns && at.is_shaded && !at.has_gaps {
                        let columns = (*band.start.get(at.row)?, *band.end.get(at.row)?);
                        self.coarse.learn(self.target, band.depth(triangle.plane, at.row), columns);
                    }
                    at.row += 1;
                }
                (at.is_shaded, at.has_gaps) = (false, false);
                (at.len, at.lent, at.done) = (0, 0, 0);
                let filled = self.gather_rows(triangle, band, at, packet);
                if filled > 0 {
                    return Some((0, filled));
                }
                if at.row >= band.count {
                    return None;
                }
            }
            // The next stretch.
            at.x = if is_between_rows { *band.start.get(at.row)? } else { at.x + at.len as i32 };
            at.done = 0;
            let row = at.row;
            let (x, y) = (at.x, band.y + row as i32);
            let columns = (x, band.end[row]);
            if is_between_rows || x >= at.hidden.right() {
                at.hidden = self.coarse.hidden(self.target, band.depth(triangle.plane, row), columns);
            }
            let (len, is_hidden) = self.coarse.stretch(at.hidden, columns, PACKET as i32);
            let len = len as usize;
            if is_hidden {
                (at.len, at.lent) = (len, 0);
                continue;
            }
            let (z, dx) = (band.z[row], (x - band.anchor[row]) as f32);
            let run = self.target.run(x, y, len);
            // A framebuffer that lends less than it was asked for gets no more than that.
            let lent = len.min(run.color.len()).min(run.depth.len());
            (at.len, at.lent) = (len, lent);
            at.has_gaps |= lent < len;
            let len = lent;
            let old = run.depth.get(..len)?;
            let (plane, last) = (band.plane(triangle.plane), dx + len as f32 - 1.0);
            let needs_clamp = !(plane.contains(z, dx) && plane.contains(z, last));
            if !self.expects_all {
                let passing = if needs_clamp {
                    count_passing::<_, true>(self.test, plane, (z, dx), old)
                } else {
                    count_passing::<_, false>(self.test, plane, (z, dx), old)
                };
                if passing == 0 {
                    at.done = lent;
                    continue;
                }
            }
            let start = Start { x, y, dx, base: band.base(row), z };
            let passing = if needs_clamp {
                packet.set::<true>(start, band.step, plane, self.test, old)
            } else {
                packet.set::<false>(start, band.step, plane, self.test, old)
            };
            self.expects_all = passing as usize == len;
            if passing as usize == len {
                at.done = lent;
                return Some((0, len));
            }
        }
    }

    /// Fills a packet with whole rows, from `at.row` on, up to the first that does not suit: one that is wide, that fails
    /// the depth test in part, that no longer fits, or that has no room for windows. Gives how many fragments.
    #[inline(always)]
    fn gather_rows<V: Varyings>(
        &mut self,
        triangle: Triangle<'_, V>,
        band: &Band,
        at: &mut Progress,
        packet: &mut Packet<'_, F::Color, F::Depth>,
    ) -> usize {
        let (first, count, mut row, mut filled) = (at.row, band.count.min(LANES), at.row, 0);
        while row < count {
            // Negative, perhaps, of a row beside the area.
            let len = band.end[row] - band.start[row];
            if len > 0 {
                let len = len as usize;
                if len > NARROW || !self.expects_all {
                    break;
                }
                // Said like this, LLVM sees how many windows there are at most, and makes no loop of them.
                let room = (len + WINDOW - 1) & !(WINDOW - 1);
                let Some(gathered) = self.gather_row(triangle, band, row, room, filled, packet) else {
                    break;
                };
                filled += gathered;
            }
            at.ends[row] = filled;
            row += 1;
        }
        at.row = row;
        at.gathered = if filled > 0 { first..row } else { 0..0 };
        filled
    }

    /// Fills a packet from `filled` on with a row, in windows of eight pixels, together `room`. The last one reaches over
    /// the row's end. Gives how many fragments: all of them or none.
    #[inline(always)]
    fn gather_row<V: Varyings>(
        &mut self,
        triangle: Triangle<'_, V>,
        band: &Band,
        row: usize,
        room: usize,
        filled: usize,
        packet: &mut Packet<'_, F::Color, F::Depth>,
    ) -> Option<usize> {
        let (x, y) = (band.start[row], band.y + row as i32);
        if filled + room > PACKET || x + room as i32 > self.target_area.right {
            return None;
        }
        let (len, dx) = (band.end[row] - x, band.dx[row]);
        let run = self.target.run(x, y, room);
        let old = (run.color.get(..room)?, run.depth.get(..room)?);
        if !BLENDS {
            // Its first cache line, which is about to be written, comes while depth is tested.
            if let Some(&color) = old.0.first() {
                black_box(color);
            }
        }
        let start = Start { x, y, dx, base: band.base(row), z: band.z[row] };
        let plane = band.plane(triangle.plane);
        let passing = packet.set_windows::<BLENDS>(filled, len, start, band.step, plane, self.test, old)?;
        self.expects_all = passing == len.unsigned_abs();
        if !self.expects_all {
            return if passing == 0 { Some(0) } else { None };
        }
        Some(len as usize)
    }

    /// Writes the pixels of gathered rows.
    #[inline(always)]
    fn write_rows(&mut self, band: &Band, at: &mut Progress, packet: &Packet<'_, F::Color, F::Depth>) {
        let mut begin = 0;
        for row in core::mem::take(&mut at.gathered) {
            let Some(&end) = at.ends.get(row) else { return };
            let Some(len) = end.checked_sub(begin) else { return };
            // (A number of which LLVM knows that it is not 0: a run that is not there is too short for it, which is asked once then.)
            if let Some(len) = NonZeroUsize::new(len) {
                if self.write_row(band, row, (begin..end, len), packet).is_none() {
                    return;
                }
            }
            begin = end;
        }
    }

    /// Writes the pixels of a row that stands there in the packet, so many.
    #[inline(always)]
    fn write_row(
        &mut self,
        band: &Band,
        row: usize,
        (place, len): (Range<usize>, NonZeroUsize),
        packet: &Packet<'_, F::Color, F::Depth>,
    ) -> Option<()> {
        let len = len.get();
        let run = self.target.run(band.start[row], band.y + row as i32, len);
        let (to_colors, to_depths) = (run.color.get_mut(..len)?, run.depth.get_mut(..len)?);
        let (colors, depths) = (packet.colors.get(place.clone())?, packet.depths.get(place)?);
        write_both((to_colors, colors), (to_depths, depths), self.test.writes());
        Some(())
    }
}

/// The lanes of a tiny triangle's windows that are covered and pass the depth test, in a framebuffer that lends no block, or
/// one narrower than a window. (By value, so that nothing has to be in memory for the sake of this.)
#[inline(never)]
fn test_by_runs<F: Framebuffer, const N: usize>(
    target: &mut F,
    test: impl DepthTest,
    tiny: Tiny,
    width: usize,
    plane: LanePlane,
) -> Lanes {
    let (mut found, mut row, mut y) = ([0; 4], tiny.first_row::<N>(), tiny.y);
    for lanes in &mut found {
        for shift in (0..64).step_by(16) {
            if y < tiny.y + tiny.rows {
                // Less than a window, of a narrow framebuffer or a miserly one, is tested in one of our own.
                let run = target.run(tiny.x, y, width);
                let mut depths = [F::Depth::from_depth(0.0); N];
                let lent = copy(&mut depths, run.depth).min(run.color.len());
                let may_draw = tiny.may_draw() & ((1 << lent) - 1);
                *lanes |= u64::from(tiny.chosen::<_, N>(row, &plane, test, &depths, may_draw)) << shift;
            }
            (row, y) = (tiny.next_row(row), y + 1);
        }
    }
    found
}

/// How many of some neighbouring fragments pass the depth test. Their depths are clamped only if they have to be.
#[inline(always)]
fn count_passing<D: DepthFormat, const CLAMPS: bool>(
    test: impl DepthTest,
    plane: RowPlane<'_>,
    (z, dx): (f32, f32),
    old: &[D],
) -> u32 {
    let mut passing = 0;
    for (&old, &column) in old.iter().zip(&RAMP) {
        passing += u32::from(passes(test, plane.moved_within::<CLAMPS>(z, dx + column), old));
    }
    passing
}

/// Where neighbouring fragments, from one on, that all pass the depth test end; or that all fail.
#[inline(always)]
fn skip<D: DepthFormat, const PASSING: bool>(
    test: impl DepthTest,
    z: &[f32],
    old: &[D],
    mut from: usize,
) -> usize {
    let is_skipped = |z: f32, old: D| passes(test, z, old) == PASSING;
    // Eight at a time as long as there are eight. (Not summed up: with AVX-512, a mask would be taken apart bit by bit.)
    while let (Some(z), Some(old)) = (
        z.get(from..).and_then(<[_]>::first_chunk::<WINDOW>),
        old.get(from..).and_then(<[_]>::first_chunk::<WINDOW>),
    ) {
        let mut others = [0u32; WINDOW];
        for i in 0..WINDOW {
            others[i] = u32::from(!is_skipped(z[i], old[i]));
        }
        if others.iter().fold(0, |any, &other| any | other) != 0 {
            break;
        }
        from += WINDOW;
    }
    let rest = z.iter().zip(old).skip(from);
    from + rest.take_while(|&(&z, &old)| is_skipped(z, old)).count()
}

/// Copies a row of at most [`NARROW`] colours, and as many depths.
///
/// Windows of a fixed size, the last of which ends where the row does and so overlaps the one before it: no pixel has to be
/// chosen, or copied alone. It comes first; the one before it then writes some of it again.
#[inline(always)]
fn write_both<C: Copy, D: Copy>(colors: (&mut [C], &[C]), depths: (&mut [D], &[D]), writes_depth: bool) {
    debug_assert!(colors.1.len() <= NARROW, "a row of {}", colors.1.len());
    match colors.1.len() {
        8.. => write_windows::<_, _, 8>(colors, depths, writes_depth),
        4.. => write_windows::<_, _, 4>(colors, depths, writes_depth),
        2.. => write_windows::<_, _, 2>(colors, depths, writes_depth),
        _ => write_windows::<_, _, 1>(colors, depths, writes_depth),
    }
}

#[inline(always)]
fn write_windows<C: Copy, D: Copy, const N: usize>(
    (to_colors, colors): (&mut [C], &[C]),
    (to_depths, depths): (&mut [D], &[D]),
    writes_depth: bool,
) {
    let last = to_colors.last_chunk_mut::<N>().zip(colors.last_chunk::<N>());
    if let Some((to, from)) = last {
        *to = *from;
    }
    let last = to_depths.last_chunk_mut::<N>().zip(depths.last_chunk::<N>());
    if let (Some((to, from)), true) = (last, writes_depth) {
        *to = *from;
    }
    let colors = to_colors.chunks_exact_mut(N).zip(colors.chunks_exact(N));
    let depths = to_depths.chunks_exact_mut(N).zip(depths.chunks_exact(N));
    // (No row has more. Where that is known, LLVM makes no loop of them.)
    for ((to_colors, colors), (to_depths, depths)) in colors.zip(depths).take(NARROW / WINDOW) {
        to_colors.copy_from_slice(colors);
        if writes_depth {
            to_depths.copy_from_slice(depths);
        }
    }
}

/// How far the shading of a band has come.
#[derive(Clone, Debug, Default)]
struct Progress {
    /// The row.
    row: usize,
    /// The stretch of it that the packet holds: its first column and its length, and how much of it is done.
    x: i32,
    len: usize,
    done: usize,
    /// How much of it the framebuffer lends.
    lent: usize,
    /// Which segments of the row are known to be hidden.
    hidden: Hidden,
    /// Whether any fragment of the row passed so far; and whether any of those was discarded, or any of the row not lent: what
    /// has gaps hides nothing.
    is_shaded: bool,
    has_gaps: bool,
    /// The rows that the packet holds instead, and where each ends.
    gathered: Range<usize>,
    ends: [usize; LANES],
}

impl Progress {
    /// Before the first row. (Field by field: a whole new one would be put together and then copied.)
    #[inline(always)]
    fn begin(&mut self) {
        (self.row, self.len, self.done, self.lent) = (0, 0, 0, 0);
        (self.is_shaded, self.has_gaps) = (false, false);
        self.gathered = 0..0;
    }
}
