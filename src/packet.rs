//! Packets: fragments of one triangle on their way to the closure, as arrays of the numbers that shading starts from.

#![expect(
    clippy::cast_possible_truncation,
    reason = "offsets in a packet are under 2⁹, and places under 2³²"
)]

use core::ops::Range;
use core::sync::atomic::{Ordering, compiler_fence};

use glam::{Vec2, Vec4};

use crate::depth::{DepthFormat, DepthTest, passes};
use crate::fragment::{Fragment, SampleWeights, Shading, WeightParts, divided_lanes};
use crate::interpolate::Varyings;
use crate::plane::{DepthPlane, RowPlane};
use crate::tiny::{NEGATIVE, SIDE, Tiny};
use crate::traverse::{HAS_FLOAT_LANES, HAS_WIDE_LANES};

/// How many fragments are in flight: enough for SIMD to be worth its overhead, and little enough for the first-level
/// cache. Where fragments are drawn one by one there is no packet.
pub(crate) const PACKET: usize = if HAS_FLOAT_LANES { 256 } else { 1 };

/// The arrays of a packet: what shading starts from. References to separate arrays, so that one that nobody reads
/// disappears.
#[derive(Debug)]
pub(crate) struct Packet<'a, C, D> {
    pub(crate) alpha: &'a mut [f32; PACKET],
    pub(crate) beta: &'a mut [f32; PACKET],
    pub(crate) sum: &'a mut [f32; PACKET],
    pub(crate) inv_sum: &'a mut [f32; PACKET],
    pub(crate) l: &'a mut [f32; PACKET],
    pub(crate) m: &'a mut [f32; PACKET],
    pub(crate) z: &'a mut [f32; PACKET],
    pub(crate) x: &'a mut [i32; PACKET],
    pub(crate) y: &'a mut [i32; PACKET],
    /// Its pixels, until all are shaded and written: of several rows, of a tiny triangle, or for a closure that may read
    /// memory.
    pub(crate) colors: &'a mut [C; PACKET],
    pub(crate) depths: &'a mut [D; PACKET],
    /// Which of them were discarded: not 0. All are 0 between packets.
    pub(crate) discarded: &'a mut [u32; PACKET],
    /// A packet of a tiny triangle remembers where in its block each fragment belongs: see [`Places`].
    pub(crate) places: &'a mut [u32; PLACES],
}

/// Some samples of a packet, to be read: lane by lane what their fragments are made of.
#[derive(Clone, Copy)]
pub(crate) struct Samples<'a> {
    pub(crate) alpha: &'a [f32],
    pub(crate) beta: &'a [f32],
    pub(crate) sum: &'a [f32],
    pub(crate) inv_sum: &'a [f32],
    pub(crate) l: &'a [f32],
    pub(crate) m: &'a [f32],
    pub(crate) z: &'a [f32],
    pub(crate) x: &'a [i32],
    pub(crate) y: &'a [i32],
}

impl Samples<'_> {
    /// Some of them, if there are as many.
    #[inline(always)]
    pub(crate) fn part(self, lanes: Range<usize>) -> Option<Self> {
        let Self { alpha, beta, sum, inv_sum, l, m, z, x, y } = self;
        let [alpha, beta, sum, inv_sum, l, m, z] = cut([alpha, beta, sum, inv_sum, l, m, z], lanes.clone())?;
        let [x, y] = cut([x, y], lanes)?;
        Some(Self { alpha, beta, sum, inv_sum, l, m, z, x, y })
    }

    /// One of them as a fragment.
    #[inline(always)]
    pub(crate) fn fragment<'a, V>(self, i: usize, triangle: &'a Shading<'a, V>) -> Fragment<'a, V> {
        let at = SampleWeights {
            alpha: self.alpha[i],
            beta: self.beta[i],
            sum: self.sum[i],
            inv_sum: self.inv_sum[i],
            l: self.l[i],
            m: self.m[i],
        };
        Fragment { triangle, at, x: self.x[i], y: self.y[i], depth: self.z[i] }
    }
}

/// Memory that begins where a cache line does: no SIMD register of it reaches over two.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Aligned<T>(pub(crate) T);

/// Pixels in a window of a row.
pub(crate) const WINDOW: usize = 8;

/// What all fragments of a triangle are made of. (Nothing that lives in memory should hold this: what is referred to from there
/// cannot stay in registers.)
#[derive(Clone, Copy)]
pub(crate) struct Triangle<'a, V> {
    pub(crate) shading: &'a Shading<'a, V>,
    pub(crate) plane: &'a DepthPlane,
}

/// How many fragments of a tiny triangle are worked out at a time: as many as the shading loop will load at once. A load of what
/// two stores have left has to wait until both have reached the cache.
pub(crate) const GROUP: usize = if HAS_WIDE_LANES { 8 } else { 4 };

/// Room for the fragments of a tiny triangle. They are at most some 150, of which a group at a time is added: all of its bounds
/// are more than enough.
pub(crate) const PLACES: usize = (SIDE * SIDE) as usize;

/// Where the samples of a tiny triangle's windows stand in a block of pixels, lane by lane; and a place for no lane, that of
/// the word's first. Worked out for each fragment, that would be a multiplication and more; all blocks of a framebuffer have
/// the same stride.
#[derive(Debug)]
pub(crate) struct Places {
    /// Words of eight rows of eight lanes.
    pub(crate) narrow: Words<2, 8>,
    /// Words of four rows of sixteen lanes.
    pub(crate) wide: Words<4, 16>,
}

/// Places of 16 rows of `LANES` lanes, a word's after the other, in blocks of the stride last used.
#[derive(Debug)]
pub(crate) struct Words<const COUNT: usize, const LANES: usize> {
    stride: usize,
    words: [[u32; 65]; COUNT],
}

/// The stride of places where the framebuffer lends no block.
pub(crate) const ROW: usize = SIDE as usize;

/// Column and row of a place where the framebuffer lends no block: 16 a row.
#[inline(always)]
pub(crate) fn place_of(place: u32) -> (i32, i32) {
    ((place & 15) as i32, (place >> 4) as i32)
}

impl Places {
    /// None yet.
    pub(crate) const fn new() -> Self {
        Self { narrow: Words::NONE, wide: Words::NONE }
    }
}

impl<const COUNT: usize, const LANES: usize> Words<COUNT, LANES> {
    const NONE: Self = Self { stride: usize::MAX, words: [[0; 65]; COUNT] };

    /// Places in blocks of this stride, for which 16 rows are less than 2³² pixels.
    #[inline(always)]
    pub(crate) fn with_stride(&mut self, stride: usize) -> &[[u32; 65]; COUNT] {
        if self.stride != stride {
            self.set_stride(stride);
        }
        &self.words
    }

    #[inline(never)]
    fn set_stride(&mut self, stride: usize) {
        self.stride = stride;
        let mut row_at = 0u32;
        for word in &mut self.words {
            word[64] = row_at;
            for row in word.chunks_exact_mut(LANES) {
                for (column, place) in (0..).zip(row) {
                    *place = row_at.wrapping_add(column);
                }
                row_at = row_at.wrapping_add(stride as u32);
            }
        }
    }
}

/// The columns and rows of the same lanes, and of no lane. (In pairs: each is one load, and four of them come apart in six steps.)
const fn offsets<const COUNT: usize>(lanes: usize) -> [[Vec2; 65]; COUNT] {
    let (mut offsets, mut at) = ([[Vec2::ZERO; 65]; COUNT], 0);
    while at < 64 * COUNT {
        offsets[at / 64][at % 64] = Vec2::new((at % lanes) as f32, (at / lanes) as f32);
        at += 1;
    }
    offsets
}

/// What a row's fragments start from: a pixel, and what weights are made of and depth at the row's anchor, which lies `dx`
/// columns left of that pixel.
#[derive(Clone, Copy)]
pub(crate) struct Start {
    pub(crate) x: i32,
    pub(crate) y: i32,
    pub(crate) dx: f32,
    pub(crate) base: WeightParts,
    pub(crate) z: f32,
}

/// Rows up to this width share packets: as many windows as LLVM makes no loop of. Where a register has four lanes, each window
/// takes twice the instructions.
pub(crate) const NARROW: usize = WINDOW * if HAS_WIDE_LANES { 8 } else { 5 };

impl<C, D> Packet<'_, C, D> {
    /// Sets one fragment.
    #[inline(always)]
    pub(crate) fn put(&mut self, at: usize, (x, y): (i32, i32), weights: SampleWeights, z: f32, place: u32) {
        let at = at & (PACKET - 1);
        let SampleWeights { alpha, beta, sum, inv_sum, l, m } = weights;
        (self.alpha[at], self.beta[at], self.sum[at], self.inv_sum[at]) = (alpha, beta, sum, inv_sum);
        (self.l[at], self.m[at]) = (l, m);
        (self.z[at], self.x[at], self.y[at]) = (z, x, y);
        if let Some(to) = self.places.get_mut(at) {
            *to = place;
        }
    }

    /// Adds those of some lanes of a tiny triangle's windows, of one word in rows of `N`, that pass the depth test against what is
    /// `read` at their places, or all of them without. Gives how many fragments there are then. A group is worked out at a time,
    /// so what follows is overwritten.
    #[inline(always)]
    pub(crate) fn put_lanes<V: Varyings, const N: usize, const COUNT: usize, const TESTS: bool>(
        &mut self,
        mut filled: usize,
        (mut lanes, word): (u64, usize),
        tiny: &Tiny,
        Triangle { shading, plane }: Triangle<'_, V>,
        words: &[[u32; 65]; COUNT],
        (test, mut read): (impl DepthTest, impl FnMut(u32) -> Option<D>),
    ) -> usize
    where
        D: DepthFormat,
    {
        let first = word * (64 / N);
        let (Some(places_of), Some(offsets_of)) = (words.get(word), const { &offsets::<COUNT>(N) }.get(word))
        else {
            return filled;
        };
        let mut left = lanes.count_ones() as usize;
        while left > 0 {
            let (mut columns, mut rows, mut pixels) = ([0.0; GROUP], [0.0; GROUP], [(0, 0); GROUP]);
            let mut old = [D::from_depth(0.0); GROUP];
            // One by one where they belong: stored elsewhere and copied at once, they would have to be waited for.
            let Some(places) = self.places.get_mut(filled..).and_then(<[_]>::first_chunk_mut::<GROUP>) else {
                return filled;
            };
            for four in (0..GROUP).step_by(4) {
                if left <= four {
                    // The second half of the last group, if nothing is left for it: what is in its lanes stays out of `all`.
                    break;
                }
                let mut offsets = [Vec2::ZERO; 4];
                for (i, offset) in offsets.iter_mut().enumerate() {
                    // Which lanes they are, no predictor can tell: the next one is found without a branch.
                    let lane = lanes.trailing_zeros() as usize;
                    lanes &= lanes.wrapping_sub(1);
                    *offset = offsets_of[lane];
                    let i = four + i;
                    places[i] = places_of[lane];
                    pixels[i] = tiny.pixel(((lane % N) as i32, (first + lane / N) as i32));
                    if TESTS {
                        let Some(depth) = read(places[i]) else { return filled };
                        old[i] = depth;
                    }
                }
                let [a, b, c, d] = offsets;
                let (ab, cd) = (Vec4::from((a, b)), Vec4::from((c, d)));
                let (x, y) = ([ab.x, ab.z, cd.x, cd.z], [ab.y, ab.w, cd.y, cd.w]);
                for i in 0..4 {
                    (columns[four + i], rows[four + i]) = (x[i], y[i]);
                }
            }
            // (Words of narrow windows begin at the origin, and so do narrow windows in words of wide ones.)
            if N > 8 {
                columns = columns.map(|column| column + tiny.dx);
            }
            let edges = tiny.edges_at(columns, rows);
            let mut z = [0.0; GROUP];
            for i in 0..GROUP {
                z[i] = plane.clamp(plane.at_edges(edges[0][i], edges[1][i]));
            }
            let count = left.min(GROUP);
            left -= count;
            let all = (1u32 << count) - 1;
            let mut passing = all;
            if TESTS {
                for four in (0..GROUP).step_by(4) {
                    let mut others = [0.0; 4];
                    for i in 0..4 {
                        others[i] = if passes(test, z[four + i], old[four + i]) { 0.0 } else { NEGATIVE };
                    }
                    passing &= !(Vec4::from_array(others).is_negative_bitmask() << four);
                }
                if passing == 0 {
                    continue;
                }
            }
            let weights = shading.scales.weights_of(edges);
            if passing == all {
                self.put_group(filled, pixels, weights, z);
                filled += count;
                continue;
            }
            let ([alpha, beta, sum, inv_sum, l, m], begin) = (weights, filled);
            for i in (0..GROUP).filter(|i| passing >> i & 1 == 1) {
                let weights = SampleWeights {
                    alpha: alpha[i],
                    beta: beta[i],
                    sum: sum[i],
                    inv_sum: inv_sum[i],
                    l: l[i],
                    m: m[i],
                };
                // No place is overwritten before it is read: what passes moves down.
                let place = self.places[(begin + i) & (PLACES - 1)];
                self.put(filled, pixels[i], weights, z[i], place);
                filled += 1;
            }
        }
        filled
    }

    /// Sets a group of fragments, but for their places.
    #[inline(always)]
    fn put_group(
        &mut self,
        at: usize,
        pixels: [(i32, i32); GROUP],
        [alpha, beta, sum, inv_sum, l, m]: [[f32; GROUP]; 6],
        z: [f32; GROUP],
    ) {
        put_array(self.alpha, at, alpha);
        put_array(self.beta, at, beta);
        put_array(self.sum, at, sum);
        put_array(self.inv_sum, at, inv_sum);
        put_array(self.l, at, l);
        put_array(self.m, at, m);
        put_array(self.z, at, z);
        put_array(self.x, at, pixels.map(|(x, _)| x));
        put_array(self.y, at, pixels.map(|(_, y)| y));
    }

    /// [`set`](Self::set) from `at` on for a short row of `len`, in windows of eight: as many as the old pixels make, of which
    /// the last one reaches over the row's end. Gives how many of the row pass. The old colours come with them if they will be
    /// `BLENDED`.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "all that a row is made of")]
    pub(crate) fn set_windows<const BLENDED: bool>(
        &mut self,
        at: usize,
        len: i32,
        Start { x, y, dx, base, z: z_base }: Start,
        step: WeightParts,
        plane: RowPlane<'_>,
        test: impl DepthTest,
        (old_colors, old): (&[C], &[D]),
    ) -> Option<u32>
    where
        C: Copy,
        D: DepthFormat,
    {
        let place = at..at + old.len();
        let alpha = self.alpha.get_mut(place.clone())?.chunks_exact_mut(WINDOW);
        let beta = self.beta.get_mut(place.clone())?.chunks_exact_mut(WINDOW);
        let sum = self.sum.get_mut(place.clone())?.chunks_exact_mut(WINDOW);
        let inv_sum = self.inv_sum.get_mut(place.clone())?.chunks_exact_mut(WINDOW);
        let l = self.l.get_mut(place.clone())?.chunks_exact_mut(WINDOW);
        let m = self.m.get_mut(place.clone())?.chunks_exact_mut(WINDOW);
        let z = self.z.get_mut(place.clone())?.chunks_exact_mut(WINDOW);
        let weights = alpha.zip(beta).zip(sum).zip(inv_sum).zip(l).zip(m);
        let (mut passing, mut column) = ([0u32; WINDOW], [0.0; WINDOW]);
        for i in 0..WINDOW {
            column[i] = dx + RAMP[i];
        }
        let colors =
            self.colors.get_mut(place.clone())?.chunks_exact_mut(WINDOW).zip(old_colors.chunks_exact(WINDOW));
        let depths = z.zip(old.chunks_exact(WINDOW));
        for ((((((alpha, beta), sum), inv_sum), l), m), ((z, old), (color, old_color))) in
            weights.zip(depths.zip(colors))
        {
            if BLENDED {
                // No instruction, and not needed to be right: it keeps LLVM from making one call of the whole row's copies.
                compiler_fence(Ordering::AcqRel);
                color.copy_from_slice(old_color);
            }
            // One step at a time for all lanes: each becomes one operation or two.
            let ramp = |first: f32, step: f32| column.map(|column| first + column * step);
            let parts = [ramp(base.p, step.p), ramp(base.q, step.q), ramp(base.sum, step.sum)];
            let [new_alpha, new_beta, new_inv_sum] = divided_lanes(parts);
            put_array(alpha, 0, new_alpha);
            put_array(beta, 0, new_beta);
            put_array(sum, 0, parts[2]);
            put_array(inv_sum, 0, new_inv_sum);
            put_array(l, 0, ramp(base.l, step.l));
            put_array(m, 0, ramp(base.m, step.m));
            let (Some(z), Some(old)) = (z.first_chunk_mut::<WINDOW>(), old.first_chunk::<WINDOW>()) else {
                return None;
            };
            let mut new = [0.0; WINDOW];
            for i in 0..WINDOW {
                new[i] = plane.moved(z_base, column[i]);
            }
            *z = new;
            for i in 0..WINDOW {
                passing[i] += u32::from(passes(test, new[i], old[i]));
            }
            column = column.map(|column| column + WINDOW as f32);
        }
        let (xs, ys) = (self.x.get_mut(place.clone())?, self.y.get_mut(place)?);
        for (i, (to_x, to_y)) in xs.iter_mut().zip(ys).enumerate() {
            (*to_x, *to_y) = (x.wrapping_add(i as i32), y);
        }
        // Most often all pass, those beyond the row's end too. If not, those of the row are counted: all may pass even so.
        // (Compared lane by lane: arrays are compared in memory.)
        let windows = (old.len() / WINDOW) as u32;
        if passing.iter().fold(0, |differences, &passing| differences | (passing ^ windows)) == 0 {
            return Some(len.unsigned_abs());
        }
        let row = self.z.get(at..)?.iter().zip(old).take(len.unsigned_abs() as usize);
        Some(row.map(|(&z, &old)| u32::from(passes(test, z, old))).sum())
    }

    /// Sets as many fragments as there are `old` depths, from a pixel to the right; what weights are made of changes by `step`
    /// from one to the next. Gives how many pass the depth test.
    #[inline(always)]
    pub(crate) fn set<const CLAMPS: bool>(
        &mut self,
        Start { x, y, dx, base, z: z_base }: Start,
        step: WeightParts,
        plane: RowPlane<'_>,
        test: impl DepthTest,
        old: &[D],
    ) -> u32
    where
        D: DepthFormat,
    {
        let len = old.len();
        let (
            Some(alpha),
            Some(beta),
            Some(sum),
            Some(inv_sum),
            Some(l),
            Some(m),
            Some(z),
            Some(xs),
            Some(ys),
        ) = (
            self.alpha.get_mut(..len),
            self.beta.get_mut(..len),
            self.sum.get_mut(..len),
            self.inv_sum.get_mut(..len),
            self.l.get_mut(..len),
            self.m.get_mut(..len),
            self.z.get_mut(..len),
            self.x.get_mut(..len),
            self.y.get_mut(..len),
        )
        else {
            return 0;
        };
        let mut passing = 0;
        for i in 0..len.min(PACKET) {
            let dx = dx + RAMP[i];
            let at = base.moved(step, dx).divided();
            (alpha[i], beta[i], sum[i], inv_sum[i], l[i], m[i]) =
                (at.alpha, at.beta, at.sum, at.inv_sum, at.l, at.m);
            z[i] = plane.moved_within::<CLAMPS>(z_base, dx);
            passing += u32::from(passes(test, z[i], old[i]));
            (xs[i], ys[i]) = (x.wrapping_add(i as i32), y);
        }
        passing
    }
}

/// 0, 1, 2, … : added to a whole number under 2²⁴, as exact as a sum of integers, and less work than to convert that.
pub(crate) const RAMP: [f32; PACKET] = {
    let mut ramp = [0.0; PACKET];
    let mut i = 0;
    while i < PACKET {
        ramp[i] = i as f32;
        i += 1;
    }
    ramp
};

/// The same part of several arrays, if each is as long.
#[inline(always)]
pub(crate) fn cut<T, const N: usize>(mut arrays: [&[T]; N], part: Range<usize>) -> Option<[&[T]; N]> {
    for array in &mut arrays {
        *array = array.get(part.clone())?;
    }
    Some(arrays)
}

/// Copies as many items as there are on both sides, and says how many.
#[inline(always)]
pub(crate) fn copy<T: Copy>(to: &mut [T], from: &[T]) -> usize {
    let len = to.len().min(from.len());
    for (to, from) in to.iter_mut().zip(from) {
        *to = *from;
    }
    len
}

/// Stores pixels of which some are new and some are those that were there.
///
/// The fence is no instruction, and nothing here needs it to be right. It is seen to keep LLVM (22, of Rust 1.95) from
/// making one *masked* store of the choice and the store, where there is AVX: a single instruction too, but of some
/// eighteen steps on AMD's processors (uops.info, `VMASKMOVPS`), with which depth passes took a sixth longer.
/// `benches/asm/check` would see it fail.
#[inline(always)]
pub(crate) fn store<T: Copy, const N: usize>(to: &mut [T; N], pixels: [T; N]) {
    compiler_fence(Ordering::AcqRel);
    *to = pixels;
}

#[inline(always)]
fn put_array<T: Copy, const N: usize>(to: &mut [T], at: usize, items: [T; N]) {
    if let Some(to) = to.get_mut(at..).and_then(<[_]>::first_chunk_mut) {
        *to = items;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_columns_and_rows_of_the_stride_last_used() {
        let mut places = Places::new();
        for stride in [0, 16, 1920, 16, 1 << 27] {
            let (narrow, wide) = (places.narrow.with_stride(stride), places.wide.with_stride(stride));
            let is_place = |place: u32, column: usize, row: usize| place as usize == column + row * stride;
            for (lane, row) in (0..64).flat_map(|lane| (0..2).map(move |word| (lane, 8 * word + lane / 8))) {
                let place = narrow[row / 8][lane];
                assert!(is_place(place, lane % 8, row), "{stride} {row} {lane}: {place}");
            }
            for (lane, row) in (0..64).flat_map(|lane| (0..4).map(move |word| (lane, 4 * word + lane / 16))) {
                let place = wide[row / 4][lane];
                assert!(is_place(place, lane % 16, row), "{stride} {row} {lane}: {place}");
            }
            assert_eq!(wide.map(|word| word[64]), wide.map(|word| word[0]), "no lane");
            assert_eq!(narrow.map(|word| word[64]), narrow.map(|word| word[0]), "no lane");
        }
    }
}
