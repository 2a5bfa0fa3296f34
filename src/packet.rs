//! Packets: fragments of one triangle on their way to the closure, as arrays of the numbers that shading starts from.

#![expect(clippy::cast_possible_truncation, reason = "offsets in a packet are under 2⁹")]

use core::sync::atomic::{Ordering, compiler_fence};

use glam::{Mat4, Vec4};

use crate::depth::{DepthFormat, DepthTest, passes};
use crate::fragment::{Shading, WeightParts};
use crate::interpolate::Varyings;
use crate::plane::{LanePlane, RowPlane};
use crate::tiny::{SIDE, Tiny};
use crate::traverse::HAS_FLOAT_LANES;

/// How many fragments are in flight: enough for SIMD to be worth its overhead, and little enough for the first-level
/// cache. Where fragments are drawn one by one there is no packet.
pub(crate) const PACKET: usize = if HAS_FLOAT_LANES { 256 } else { 1 };

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
    /// Its pixels, until all are shaded and written: of several rows, of a tiny triangle, or for a closure that may read
    /// memory.
    pub(crate) colors: &'a mut [C; PACKET],
    pub(crate) depths: &'a mut [D; PACKET],
    /// Which of them were discarded: not 0. All are 0 between packets.
    pub(crate) discarded: &'a mut [u32; PACKET],
    /// A packet of a tiny triangle remembers where in its windows each fragment belongs: see [`place_of`].
    pub(crate) places: &'a mut [u8; PLACES],
}

/// Memory that begins where a cache line does: no SIMD register of it reaches over two.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Aligned<T>(pub(crate) T);

/// Pixels in a window of a row.
pub(crate) const WINDOW: usize = 8;

/// Column and row of a place in a tiny triangle's windows: places are numbered row by row, 16 in each.
#[inline(always)]
pub(crate) fn place_of(place: u8) -> (i32, i32) {
    (i32::from(place) & 15, i32::from(place) >> 4)
}

/// Room for the fragments of a tiny triangle. They are at most some 150, of which four at a time are added: all of its bounds
/// are more than enough.
pub(crate) const PLACES: usize = (SIDE * SIDE) as usize;

/// The places of the lanes of a word, in rows of `lanes`; and of none.
const fn places(lanes: usize) -> [u8; 65] {
    let (mut places, mut lane) = ([0; 65], 0);
    while lane < 64 {
        places[lane] = (16 * (lane / lanes) + lane % lanes) as u8;
        lane += 1;
    }
    places
}

/// Their columns and rows. (Four numbers: so they are loaded at once.)
const fn offsets(lanes: usize) -> [Vec4; 65] {
    let (mut offsets, mut lane) = ([Vec4::ZERO; 65], 0);
    while lane < 64 {
        offsets[lane] = Vec4::new((lane % lanes) as f32, (lane / lanes) as f32, 0.0, 0.0);
        lane += 1;
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

/// Rows up to this width share packets.
pub(crate) const NARROW: usize = 64;

impl<C, D> Packet<'_, C, D> {
    /// Sets one fragment.
    #[inline(always)]
    pub(crate) fn put(&mut self, at: usize, (x, y): (i32, i32), parts: WeightParts, z: f32, place: u8) {
        let at = at & (PACKET - 1);
        let WeightParts { p, q, sum, l, m } = parts;
        (self.p[at], self.q[at], self.sum[at], self.l[at], self.m[at]) = (p, q, sum, l, m);
        (self.z[at], self.x[at], self.y[at]) = (z, x, y);
        if let Some(to) = self.places.get_mut(at) {
            *to = place;
        }
    }

    /// Adds those lanes of a tiny triangle's windows, a word in rows of `N` from row `first` on, to `filled` fragments. Gives
    /// how many there are then. Four at a time are worked out, so what follows is overwritten.
    #[inline(always)]
    pub(crate) fn put_lanes<V: Varyings, const N: usize>(
        &mut self,
        filled: usize,
        (mut lanes, first): (u64, usize),
        tiny: &Tiny,
        shading: &Shading<'_, V>,
        plane: &LanePlane,
    ) -> usize {
        if lanes == 0 {
            return filled;
        }
        let (places_of, offsets_of) = const { (&places(N), &offsets(N)) };
        let (mut at, end) = (filled, filled + lanes.count_ones() as usize);
        while at < end {
            let (Some(places), Some(x), Some(y)) =
                (self.places.get_mut(at..at + 4), self.x.get_mut(at..at + 4), self.y.get_mut(at..at + 4))
            else {
                return at;
            };
            let mut offsets = [Vec4::ZERO; 4];
            for i in 0..4 {
                // Which lanes they are, no predictor can tell: the next one is found without a branch.
                let lane = lanes.trailing_zeros() as usize;
                lanes &= lanes.wrapping_sub(1);
                offsets[i] = offsets_of[lane];
                places[i] = places_of[lane].wrapping_add(16 * first as u8);
                let place = place_of(places[i]);
                (x[i], y[i]) = (tiny.x.wrapping_add(place.0), tiny.y.wrapping_add(place.1));
            }
            let [a, b, c, d] = offsets;
            let offsets = Mat4::from_cols(a, b, c, d).transpose();
            let offset = (offsets.x_axis, offsets.y_axis + first as f32);
            let ([p, q, sum, l, m], z) = tiny.parts_of_four(offset, shading, plane);
            put_four(self.p, at, p);
            put_four(self.q, at, q);
            put_four(self.sum, at, sum);
            put_four(self.l, at, l);
            put_four(self.m, at, m);
            put_four(self.z, at, z);
            at += 4;
        }
        end
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
        let p = self.p.get_mut(place.clone())?.chunks_exact_mut(WINDOW);
        let q = self.q.get_mut(place.clone())?.chunks_exact_mut(WINDOW);
        let sum = self.sum.get_mut(place.clone())?.chunks_exact_mut(WINDOW);
        let l = self.l.get_mut(place.clone())?.chunks_exact_mut(WINDOW);
        let m = self.m.get_mut(place.clone())?.chunks_exact_mut(WINDOW);
        let z = self.z.get_mut(place.clone())?.chunks_exact_mut(WINDOW);
        let weights = p.zip(q).zip(sum).zip(l).zip(m);
        let (mut passing, mut column) = ([0u32; WINDOW], [0.0; WINDOW]);
        for i in 0..WINDOW {
            column[i] = dx + RAMP[i];
        }
        let colors =
            self.colors.get_mut(place.clone())?.chunks_exact_mut(WINDOW).zip(old_colors.chunks_exact(WINDOW));
        let depths = z.zip(old.chunks_exact(WINDOW));
        for (((((p, q), sum), l), m), ((z, old), (color, old_color))) in weights.zip(depths.zip(colors)) {
            if BLENDED {
                // No instruction, and not needed to be right: it keeps LLVM from making one call of the whole row's copies.
                compiler_fence(Ordering::AcqRel);
                color.copy_from_slice(old_color);
            }
            // One step at a time for all lanes: each loop becomes one operation or two.
            let ramp = |to: &mut [f32], first: f32, step: f32| {
                let Some(to) = to.first_chunk_mut::<WINDOW>() else { return };
                let mut new = [0.0; WINDOW];
                for i in 0..WINDOW {
                    new[i] = first + column[i] * step;
                }
                *to = new;
            };
            ramp(p, base.p, step.p);
            ramp(q, base.q, step.q);
            ramp(sum, base.sum, step.sum);
            ramp(l, base.l, step.l);
            ramp(m, base.m, step.m);
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

    /// Sets as many fragments as there are `old` depths, from a pixel to the right; weights change by `step` from one to the
    /// next. Gives how many pass the depth test.
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
        let (Some(p), Some(q), Some(sum), Some(l), Some(m), Some(z), Some(xs), Some(ys)) = (
            self.p.get_mut(..len),
            self.q.get_mut(..len),
            self.sum.get_mut(..len),
            self.l.get_mut(..len),
            self.m.get_mut(..len),
            self.z.get_mut(..len),
            self.x.get_mut(..len),
            self.y.get_mut(..len),
        ) else {
            return 0;
        };
        let mut passing = 0;
        for i in 0..len.min(PACKET) {
            let dx = dx + RAMP[i];
            let at = base.moved(step, dx);
            (p[i], q[i], sum[i], l[i], m[i]) = (at.p, at.q, at.sum, at.l, at.m);
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
fn put_four(numbers: &mut [f32], at: usize, four: Vec4) {
    if let Some(to) = numbers.get_mut(at..at + 4) {
        to.copy_from_slice(&four.to_array());
    }
}
