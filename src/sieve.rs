//! The sieve: which triangles of a batch have to be drawn.
//!
//! Corners of up to 64 triangles are put into its [slots](Sieve::slots). Then [passes](Sieve::sift) go over them, loops without a
//! branch in `f32` lanes: which are culled, which miss the area or hold no sample, which minute ones cover none. What they find out
//! about a triangle is a [`Verdict`]; those that may be seen stand in a [`Queue`]. Whether a triangle is culled is a coin toss that
//! no branch predictor wins; after the sieve, nobody has to toss.
//!
//! Where there is no SIMD, there is one triangle at a time, no pass, and each is undecided: integers decide.

#![expect(clippy::cast_possible_truncation, reason = "places in a batch are under 2⁶")]

use crate::facing::Facing;
use crate::project::{Positions, ROUNDING};
use crate::queue::Queue;
use crate::setup;
use crate::state::Statistics;
use crate::target::Borders;
use crate::tiny::{self, Outline};
use crate::traverse::HAS_FLOAT_LANES;

/// How many triangles are looked at before the first of them is drawn.
pub(crate) const BATCH: usize = if HAS_FLOAT_LANES { 64 } else { 1 };

/// Up to so many triangles, not all lanes are worked out.
const FEW: usize = if HAS_FLOAT_LANES { 16 } else { 1 };
const _: () =
    assert!(!HAS_FLOAT_LANES || (BATCH <= 64 && BATCH % 4 == 0 && FEW % 4 == 0), "as a queue needs them");

/// A *minute* triangle is one whose bounds hold at most two by two samples. With more of them in a batch than this, it is
/// worth finding out which samples they cover. In other batches those that cover none become pieces, and records, that draw
/// nothing: the picture is the same.
const MANY: u32 = 4;

/// From so many triangles of a batch on, it is worth fetching their pixels together.
const SOME: usize = 8;

/// No coordinate of a vertex that need not be clipped is less, in subpixels.
const OUTERMOST: f32 = -8_388_608.0;

#[inline(always)]
fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// [`first_sample`](crate::setup::first_sample) plus [`ROUNDING`]: the nearest integer of (v − ½) / 256, which is never a
/// tie, left where the addition puts it.
#[inline(always)]
fn pixel(v: f32) -> f32 {
    (v - 0.5) * (1.0 / 256.0) + ROUNDING
}

/// How far three numbers lie apart.
#[inline(always)]
fn extent([a, b, c]: [f32; 3]) -> f32 {
    max(max(a, b), c) - min(min(a, b), c)
}

/// Borders in pixels, as [`pixel`] leaves them.
struct PixelBorders {
    left: f32,
    top: f32,
    right: f32,
    bottom: f32,
}

impl PixelBorders {
    #[inline(always)]
    fn new(Borders { left, top, right, bottom }: Borders) -> Self {
        let [left, top, right, bottom] = [left, top, right, bottom].map(|border| border as f32 + ROUNDING);
        Self { left, top, right, bottom }
    }

    /// The bounds of a triangle.
    #[inline(always)]
    fn of_triangle([ax, bx, cx]: [f32; 3], [ay, by, cy]: [f32; 3]) -> Self {
        Self {
            left: pixel(min(min(ax, bx), cx)),
            top: pixel(min(min(ay, by), cy)),
            right: pixel(max(max(ax, bx), cx)),
            bottom: pixel(max(max(ay, by), cy)),
        }
    }

    /// As integers.
    #[inline(always)]
    fn borders(&self) -> Borders {
        let border = |at: f32| at.to_bits().wrapping_sub(ROUNDING.to_bits()) as i32;
        let [left, top, right, bottom] = [self.left, self.top, self.right, self.bottom].map(border);
        Borders { left, top, right, bottom }
    }

    /// Whether those of a triangle hold at most two by two samples.
    #[inline(always)]
    fn are_minute(&self) -> bool {
        (self.right - self.left <= 2.0) & (self.bottom - self.top <= 2.0)
    }
}

/// What the sieve knows of a triangle, in one word.
///
/// ```text
///   bits 0–2   ORDER      a place in ORDERS, by which its vertices come into canonical order
///   bit 4      UNDECIDED  it has to be clipped, or its area is zero in f32: look closer
///   bit 5      TINY       Outline::is_tiny; of a clipped triangle, of the piece that came last
///   bits 8–11             Piece::covered, the samples that it covers, or 0 if that is not known
///   bit 31     DROPPED    it is not drawn: a sign, as a Queue needs it
/// ```
#[derive(Clone, Copy, Debug)]
pub(crate) struct Verdict(u32);

const ORDER: u32 = 0b111;
/// Added to the place of the first vertex.
const COUNTER_CLOCKWISE: u32 = setup::COUNTER_CLOCKWISE as u32;
const UNDECIDED: u32 = 1 << 4;
const TINY: u32 = 1 << 5;
const COVERED_SHIFT: u32 = 8;
/// Of those four bits, shifted down.
const COVERED: u32 = 0b1111;
const DROPPED: u32 = 1 << 31;

impl Verdict {
    /// Whether the triangle has to be looked at more closely. If so, neither its order nor its samples are known.
    #[inline(always)]
    pub(crate) fn is_undecided(self) -> bool {
        self.0 & UNDECIDED != 0
    }

    /// A place in [`ORDERS`](setup::ORDERS), by which its vertices come into canonical order.
    #[inline(always)]
    pub(crate) fn order(self) -> usize {
        (self.0 & ORDER) as usize
    }

    /// Which samples it [covers](crate::fan::Piece::covered), or 0 if that is not known.
    #[inline(always)]
    pub(crate) fn covered(self) -> u32 {
        self.0 >> COVERED_SHIFT & COVERED
    }
}

/// Whether the sieve finds out where triangles lie, which then need not be worked out when they are drawn, where the first
/// branches wait for it. Not where there is no SIMD, and so no sieve; nor of positions that are computed when asked for: they may
/// be others then, and the bounds must be those of what is drawn.
pub(crate) const fn knows_outlines<P: Positions>() -> bool {
    HAS_FLOAT_LANES && P::ARE_PROJECTED
}

/// Some triangles' corners, and what was found out about them.
#[derive(Debug)]
pub(crate) struct Sieve {
    /// x and y of the first vertices, the second and the third ones, in subpixels, side by side as they are fetched. Those of
    /// a vertex outside are no place, and far to the left: see [`ProjectedVertex::xy`](crate::project::ProjectedVertex::xy).
    ///
    /// Once these are split, and if [outlines are known](knows_outlines), the top left and the bottom right corners of bounds, in
    /// pixels. (In the same place: what a draw keeps is cleared first.) Of a clipped triangle, of the piece that came last.
    corners: [[[i32; 2]; BATCH]; 3],
    /// The same numbers as the passes need them.
    x: [[f32; BATCH]; 3],
    y: [[f32; BATCH]; 3],
    /// A [`Verdict`] each; bare words here, so that the passes become SIMD.
    verdicts: [u32; BATCH],
    /// Which of them may be seen, and were not drawn or left out yet.
    pub(crate) queue: Queue,
    /// How many triangles there are in all.
    count: usize,
    /// How many of those that may be seen were minute.
    minute: u32,
}

impl Sieve {
    /// With nothing in it. (A function: a constant is written to the stack, and then copied.)
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self {
            corners: [[[0; 2]; BATCH]; 3],
            x: [[0.0; BATCH]; 3],
            y: [[0.0; BATCH]; 3],
            verdicts: [0; BATCH],
            queue: Queue::EMPTY,
            count: 0,
            minute: 0,
        }
    }

    /// How many triangles went through it last.
    #[inline(always)]
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Where the corners of the next triangles are to be put.
    #[inline(always)]
    pub(crate) fn slots(
        &mut self,
    ) -> impl ExactSizeIterator<Item = ((&mut [i32; 2], &mut [i32; 2]), &mut [i32; 2])> {
        let [a, b, c] = &mut self.corners;
        a.iter_mut().zip(b).zip(c)
    }

    /// Finds out which of the triangles, so many of whose corners are in the [slots](Self::slots), have to be drawn to an area, and
    /// [perhaps](knows_outlines) where they lie. Counts those that are culled or have no area.
    #[inline(always)]
    pub(crate) fn sift<P: Positions>(
        &mut self,
        count: usize,
        facing: Facing,
        area: Borders,
        statistics: &mut Statistics,
    ) {
        self.count = count;
        if count == 0 {
            self.queue = Queue::EMPTY;
        } else if !HAS_FLOAT_LANES {
            // Integers are as fast, and where floats are emulated much faster.
            self.verdicts = [UNDECIDED; BATCH];
            self.queue = Queue::below(count);
        } else if count <= FEW {
            self.sift_few::<P>(facing, area, statistics);
        } else {
            self.sift_lanes::<P, BATCH>(facing, area, statistics);
        }
    }

    /// What is known of a triangle.
    #[inline(always)]
    pub(crate) fn verdict(&self, lane: usize) -> Verdict {
        Verdict(self.verdicts[lane & (BATCH - 1)])
    }

    /// Where a triangle lies, if [that is known](knows_outlines).
    #[inline(always)]
    pub(crate) fn outline(&self, lane: usize) -> Outline {
        let lane = lane & (BATCH - 1);
        Outline { bounds: self.bounds(lane), is_tiny: self.verdicts[lane] & TINY != 0 }
    }

    /// Its bounds alone.
    #[inline(always)]
    pub(crate) fn bounds(&self, lane: usize) -> Borders {
        let ([first, last, _], lane) = (&self.corners, lane & (BATCH - 1));
        let ([left, top], [right, bottom]) = (first[lane], last[lane]);
        Borders { left, top, right, bottom }
    }

    /// Says where the piece lies that is left of a clipped triangle.
    #[inline(always)]
    pub(crate) fn set_outline(&mut self, lane: usize, Outline { bounds, is_tiny }: Outline) {
        let ([first, last, _], lane) = (&mut self.corners, lane & (BATCH - 1));
        (first[lane], last[lane]) = ([bounds.left, bounds.top], [bounds.right, bounds.bottom]);
        self.verdicts[lane] &= !TINY;
        self.verdicts[lane] |= if is_tiny { TINY } else { 0 };
    }

    /// About where the triangles of the queue lie, if it is worth fetching their pixels together.
    #[inline(always)]
    pub(crate) fn neighbourhood(&self) -> Option<Borders> {
        let len = self.queue.len();
        // Minute triangles are so many to a cache line that hardly one of them needs a new one.
        let is_worth_it = (len >= SOME) & (2 * self.minute as usize <= len);
        is_worth_it.then(|| self.bounds_of_some())
    }

    /// The bounds of some triangles of the queue.
    #[inline(always)]
    fn bounds_of_some(&self) -> Borders {
        let (mut least, mut most) = ([f32::MAX; 2], [f32::MIN; 2]);
        for i in self.queue.spread() {
            for (axis, [a, b, c]) in [&self.x, &self.y].into_iter().enumerate() {
                let [a, b, c] = [a, b, c].map(|corner| corner[i & (BATCH - 1)]);
                least[axis] = min(least[axis], min(min(a, b), c));
                most[axis] = max(most[axis], max(max(a, b), c));
            }
        }
        let ([left, top], [right, bottom]) = (least.map(pixel), most.map(pixel));
        PixelBorders { left, top, right, bottom }.borders()
    }

    /// [`sift_lanes`](Self::sift_lanes) for a few triangles: a draw of two should not pay for 64.
    #[inline(never)]
    fn sift_few<P: Positions>(&mut self, facing: Facing, area: Borders, statistics: &mut Statistics) {
        self.sift_lanes::<P, FEW>(facing, area, statistics);
    }

    /// [`sift`](Self::sift) for up to `LANES` triangles.
    #[inline(always)]
    fn sift_lanes<P: Positions, const LANES: usize>(
        &mut self,
        facing: Facing,
        area: Borders,
        statistics: &mut Statistics,
    ) {
        let count = self.count;
        (self.queue, self.minute) = (Queue::EMPTY, 0);
        if count < LANES {
            for corners in &mut self.corners {
                corners.get_mut(count..LANES).unwrap_or_default().fill([0; 2]);
            }
        }
        self.split_corners::<LANES>();
        // Meshes turn their backs in long stretches: whole batches end here.
        if self.sift_by_facing::<LANES>(facing, statistics) == 0 {
            return;
        }
        let minute = self.sift_by_bounds::<P, LANES>(area);
        if minute > MANY {
            self.sift_minute::<LANES>(area);
        }
        let verdicts = self.verdicts.get(..LANES).unwrap_or_default();
        // Where the batch has no triangle, there is one without an area.
        self.queue = Queue::of_clear_signs(verdicts);
        self.minute = minute;
    }

    /// Fills `x` and `y` from `corners`.
    #[inline(always)]
    fn split_corners<const LANES: usize>(&mut self) {
        let Self { corners, x, y, .. } = self;
        for (corners, (x, y)) in corners.iter().zip(x.iter_mut().zip(y)) {
            for i in 0..LANES {
                (x[i], y[i]) = (corners[i][0] as f32, corners[i][1] as f32);
            }
        }
    }

    /// Drops triangles that are culled. Gives how many are left.
    ///
    /// All in `f32`, where differences of coordinates are exact: they have 24 bits. Products of them may be rounded, but
    /// rounding is monotonic: the difference of two has the sign of the area, or is zero.
    #[inline(always)]
    fn sift_by_facing<const LANES: usize>(&mut self, facing: Facing, statistics: &mut Statistics) -> u32 {
        let count = self.count;
        // Times this, areas of triangles that are culled are positive.
        let culls = f32::from(i8::from(facing.culls(1)) - i8::from(facing.culls(-1)));
        if count < LANES {
            return self.sift_unclear::<LANES>(culls, statistics);
        }
        let Self { x: [ax, bx, cx], y: [ay, by, cy], verdicts, .. } = self;
        let (mut culled, mut unclear) = (0, 0);
        for i in 0..LANES {
            let ([ax, bx, cx], [ay, by, cy]) = ([ax[i], bx[i], cx[i]], [ay[i], by[i], cy[i]]);
            let area2 = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
            let is_culled = area2 * culls > 0.0;
            unclear |= u32::from((area2 == 0.0) | (min(min(ax, bx), cx) < OUTERMOST));
            culled += u32::from(is_culled);
            verdicts[i] =
                if area2 < 0.0 { COUNTER_CLOCKWISE } else { 0 } | if is_culled { DROPPED } else { 0 };
        }
        if unclear != 0 {
            return self.sift_unclear::<LANES>(culls, statistics);
        }
        statistics.culled += u64::from(culled);
        count as u32 - culled
    }

    /// The same of a batch in which an area is zero, or a vertex outside of the clip volume, or that is not full. Which zeros
    /// are lines and which are needles is left to integers, unless both products are exact.
    #[inline(never)]
    fn sift_unclear<const LANES: usize>(&mut self, culls: f32, statistics: &mut Statistics) -> u32 {
        let count = self.count;
        let Self { x: [ax, bx, cx], y: [ay, by, cy], verdicts, .. } = self;
        let (mut culled, mut degenerate) = (0, 0);
        for i in 0..LANES {
            let ([ax, bx, cx], [ay, by, cy]) = ([ax[i], bx[i], cx[i]], [ay[i], by[i], cy[i]]);
            let (p, q) = ((bx - ax) * (cy - ay), (by - ay) * (cx - ax));
            let (area2, is_exact) = (p - q, p.abs() + q.abs() < 16_777_216.0);
            let is_inside = min(min(ax, bx), cx) >= OUTERMOST;
            let is_degenerate = (area2 == 0.0) & is_exact & is_inside;
            let is_culled = (area2 * culls > 0.0) & is_inside;
            let is_undecided = !is_inside | ((area2 == 0.0) & !is_exact);
            degenerate += u32::from(is_degenerate);
            culled += u32::from(is_culled);
            verdicts[i] = if area2 < 0.0 { COUNTER_CLOCKWISE } else { 0 }
                | if is_degenerate | is_culled { DROPPED } else { 0 }
                | if is_undecided { UNDECIDED } else { 0 };
        }
        // Where the batch has no triangle, all three vertices are the same point.
        degenerate -= (LANES - count) as u32;
        statistics.culled += u64::from(culled);
        statistics.degenerate += u64::from(degenerate);
        count as u32 - culled - degenerate
    }

    /// Drops triangles whose bounds hold no sample of the area, and finds the canonical order of the others' vertices, and where
    /// they lie. Gives how many of those are minute.
    #[inline(always)]
    fn sift_by_bounds<P: Positions, const LANES: usize>(&mut self, area: Borders) -> u32 {
        let Self { x: [ax, bx, cx], y: [ay, by, cy], verdicts, corners: [first, last, _], .. } = self;
        let area = PixelBorders::new(area);
        let mut minute = 0;
        for i in 0..LANES {
            let ([ax, bx, cx], [ay, by, cy]) = ([ax[i], bx[i], cx[i]], [ay[i], by[i], cy[i]]);
            let bounds = PixelBorders::of_triangle([ax, bx, cx], [ay, by, cy]);
            if const { knows_outlines::<P>() } {
                let Borders { left, top, right, bottom } = bounds.borders();
                (first[i], last[i]) = ([left, top], [right, bottom]);
                let extent = max(extent([ax, bx, cx]), extent([ay, by, cy]));
                verdicts[i] |= if extent <= tiny::LARGEST as f32 { TINY } else { 0 };
            }
            let is_seen = (max(bounds.left, area.left) < min(bounds.right, area.right))
                & (max(bounds.top, area.top) < min(bounds.bottom, area.bottom));
            let is_higher = |ax: f32, ay: f32, bx: f32, by: f32| (ay < by) | ((ay == by) & (ax < bx));
            let b_first = is_higher(bx, by, ax, ay);
            let c_first = is_higher(cx, cy, ax, ay) & is_higher(cx, cy, bx, by);
            minute += u32::from(bounds.are_minute() & is_seen & (verdicts[i] & DROPPED == 0));
            let is_hidden = !is_seen & (verdicts[i] & UNDECIDED == 0);
            verdicts[i] += if c_first { 2 } else { u32::from(b_first) };
            verdicts[i] |= if is_hidden { DROPPED } else { 0 };
        }
        minute
    }

    /// Finds out which samples are covered by triangles whose bounds hold one or two, or two by two. Half of the triangles
    /// in the size of a pixel lie between samples: they are hidden.
    #[inline(always)]
    fn sift_minute<const LANES: usize>(&mut self, area: Borders) {
        let Self { x: [ax, bx, cx], y: [ay, by, cy], verdicts, .. } = self;
        let area = PixelBorders::new(area);
        for i in 0..LANES {
            let ([ax, bx, cx], [ay, by, cy]) = ([ax[i], bx[i], cx[i]], [ay[i], by[i], cy[i]]);
            let bounds = PixelBorders::of_triangle([ax, bx, cx], [ay, by, cy]);
            let is_inside = (bounds.left >= area.left)
                & (bounds.right <= area.right)
                & (bounds.top >= area.top)
                & (bounds.bottom <= area.bottom);
            let sample = |pixel: f32| (pixel - ROUNDING) * 256.0 + 128.0;
            let (x, y) = (sample(bounds.left), sample(bounds.top));
            // Exact: bounds of two samples are under 768 subpixels wide and high, so that no term here exceeds 2²², and
            // the bias adds one more bit.
            let clockwise = if verdicts[i] & ORDER >= COUNTER_CLOCKWISE { -1.0 } else { 1.0 };
            let edge = |px: f32, py: f32, qx: f32, qy: f32| {
                let (a, b) = ((py - qy) * clockwise, (qx - px) * clockwise);
                // A top or left edge has a > 0, or a = 0 and b > 0.
                let bias = 0.5f32.copysign(a * 4096.0 + b);
                (a * (x - px) + b * (y - py) + bias, a * 256.0, b * 256.0)
            };
            let (e0, e1, e2) = (edge(bx, by, cx, cy), edge(cx, cy, ax, ay), edge(ax, ay, bx, by));
            // What lies outside of the bounds is never covered, and need not be told apart.
            let least = |right: f32, down: f32| {
                let at = |(e, a, b): (f32, f32, f32)| e + a * right + b * down;
                min(min(at(e0), at(e1)), at(e2))
            };
            let bit = |least: f32, bit: u32| if least > 0.0 { bit << COVERED_SHIFT } else { 0 };
            let covered = bit(least(0.0, 0.0), 1)
                | bit(least(1.0, 0.0), 2)
                | bit(least(0.0, 1.0), 4)
                | bit(least(1.0, 1.0), 8);
            let found = if covered == 0 { DROPPED } else { covered };
            let is_decided = verdicts[i] & UNDECIDED == 0;
            // Of one that reaches out of the area, it is left open.
            verdicts[i] |=
                if is_decided & bounds.are_minute() & (is_inside | (covered == 0)) { found } else { 0 };
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::clip::DepthClip;
    use crate::fan::{Fan, Piece};
    use crate::geometry::Geometry;
    use crate::primitive::{Index, Primitives};
    use crate::project::{Positions, Projected, ProjectedVertex, Projector};
    use crate::setup::{Setup, signed_area2};
    use crate::state::{CullMode, FrontFace, ProvokingVertex};
    use crate::target::Rect;
    use crate::viewport::{ClipDepth, Viewport};
    use glam::Vec4;
    use std::vec::Vec;

    /// Every kind of triangle: of a few subpixels up to all of the guard band, needles whose area is next to nothing
    /// beside their length, and some that have none.
    fn vertices(count: usize) -> Vec<ProjectedVertex> {
        let mut random = 7u32;
        let mut next = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            random >> 8
        };
        let mut vertices = Vec::new();
        while vertices.len() < count {
            let size = [300, 600, 900, 300, 600, 900, 20_000, 8_000_000][next() as usize % 8];
            let choices = (next(), next());
            let mut at = || (next() % size).cast_signed() - (size / 2).cast_signed();
            let ([a, b, c], m) = ([[at(), at()], [at(), at()], [at(), at()]], at() / 2);
            let bend = (choices.1 % 3).cast_signed() - 1;
            // A needle from a along (m, m + 1) and (m + 1, m + 2) has an area of ½ at any length.
            let triangle = match choices.0 % 8 {
                0 | 1 => [
                    [a[0] / 2, a[1] / 2],
                    [a[0] / 2 + m, a[1] / 2 + m + 1],
                    [a[0] / 2 + m + 1, a[1] / 2 + m + 2],
                ],
                2 => [a, b, [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2 + bend]],
                3 => [a, a, b],
                _ => [a, b, c],
            };
            // Some on a grid of samples and pixels' corners.
            let triangle =
                if choices.1 % 5 == 0 { triangle.map(|p| p.map(|at| at & !127)) } else { triangle };
            vertices.extend(triangle.map(|[x, y]| ProjectedVertex::new(x, y, 0.5, 1.0).expect("in range")));
        }
        vertices
    }

    /// The next piece of all batches.
    fn next<I: Index, P: Positions>(
        geometry: &mut Geometry<'_, I, P>,
        fan: &mut Option<Fan>,
    ) -> Option<Piece> {
        loop {
            let piece = geometry.next(fan);
            if piece.is_some() || !geometry.refill() {
                return piece;
            }
        }
    }

    /// Compares what the sieve finds out about all of these triangles with what integers say. Gives of how many it is known which
    /// samples they cover.
    fn check_sieve(vertices: &[ProjectedVertex], cull_mode: CullMode) -> usize {
        let area = Rect { x: -9, y: -7, width: 18, height: 16 };
        let projector =
            Projector::new(&Viewport::of_size(64, 64).expect("valid"), ClipDepth::ZeroToOne, DepthClip::Clip);
        let facing = Facing {
            cull_mode,
            front_face: FrontFace::CounterClockwise,
            provoking_vertex: ProvokingVertex::First,
        };
        let positions = std::vec![Vec4::ZERO; vertices.len()];
        let projected = Projected::new(vertices, &positions[..]).expect("as many");
        let triangles = Primitives::list().triangles(vertices.len());
        let mut geometry = Geometry::new(triangles, projected, projector, facing, area);
        let (mut pieces, mut fan) = (Vec::new(), None);
        while let Some(piece) = next(&mut geometry, &mut fan) {
            let first = 3 * piece.primitive as usize;
            let named = piece.setup.order().map(|i| first + usize::from(i));
            assert_eq!(piece.vertices, named, "in the order of the corners: {:?}", piece.setup);
            assert_eq!(geometry.outline(&piece), Outline::new(&piece.setup), "{:?}", piece.setup);
            pieces.push((piece.primitive, (piece.setup, piece.covered)));
        }
        let mut minute = 0;
        let (mut culled, mut degenerate, mut pieces) = (0, 0, pieces.into_iter().peekable());
        for (number, triangle) in (0u32..).zip(vertices.chunks_exact(3)) {
            let corners = [triangle[0], triangle[1], triangle[2]];
            let [a, b, c] = corners;
            let area2 = signed_area2(a, b, c);
            let drawn = pieces.next_if(|&(drawn, _)| drawn == number).map(|(_, setup)| setup);
            if area2 == 0 {
                degenerate += 1;
            } else if facing.culls(area2) {
                culled += 1;
            } else {
                let setup = Setup::with_area2(corners, area2);
                let rect = area.intersection(setup.bounds());
                let is_covered = |(x, y)| setup.edges().iter().all(|edge| edge.covers(x, y));
                let mut samples =
                    (rect.y..rect.bottom()).flat_map(|y| (rect.x..rect.right()).map(move |x| (x, y)));
                let covers_any = samples.any(is_covered);
                assert!(drawn.is_some() || !covers_any, "lost: {number} {corners:?}");
                assert!(drawn.is_none() || !rect.is_empty(), "misses the area: {number} {corners:?}");
                if let Some((drawn, covered)) = drawn {
                    if covered != 0 {
                        let Rect { x, y, .. } = setup.bounds();
                        let samples = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
                        let bits = (0..4).filter(|&bit| covered >> bit & 1 == 1);
                        let found: Vec<_> = bits.map(|bit: usize| samples[bit]).collect();
                        let inside = |&(x, y): &(i32, i32)| {
                            !area.intersection(Rect { x, y, width: 1, height: 1 }).is_empty()
                        };
                        let expected: Vec<_> = samples.into_iter().filter(|&at| is_covered(at)).collect();
                        assert_eq!(found, expected, "{number} {corners:?}");
                        assert!(found.iter().all(inside), "of the area: {number} {corners:?}");
                        minute += 1;
                    }
                    let same = (drawn.corners(), drawn.order(), drawn.area2());
                    assert_eq!(same, (setup.corners(), setup.order(), setup.area2()), "{number}");
                    assert_eq!(drawn.is_counter_clockwise(), setup.is_counter_clockwise(), "{number}");
                }
                continue;
            }
            assert!(drawn.is_none(), "{number} is not to be seen: {corners:?}");
        }
        assert!(pieces.next().is_none(), "all are accounted for");
        let statistics = geometry.statistics;
        assert_eq!((statistics.culled, statistics.degenerate), (culled, degenerate), "{cull_mode:?}");
        assert_eq!(statistics.primitives, vertices.len() as u64 / 3, "all were looked at");
        minute
    }

    #[test]
    fn the_outline_is_that_of_the_piece_that_came_last() {
        let mut sieve = Sieve::new();
        for (is_tiny, right) in [(true, 9), (false, 90), (true, 8)] {
            let outline = Outline { bounds: Borders { left: 1, top: 2, right, bottom: 7 }, is_tiny };
            sieve.set_outline(3, outline);
            assert_eq!(sieve.outline(3), outline);
        }
    }

    #[test]
    fn the_sieve_decides_as_the_integers_do() {
        let vertices = vertices(30_000);
        for cull_mode in [CullMode::None, CullMode::Back, CullMode::Front] {
            let minute = check_sieve(&vertices, cull_mode);
            assert!(minute > 100 || !HAS_FLOAT_LANES, "many are minute: {minute}");
            let counts = [1, 2, 7, FEW - 1, FEW, FEW + 1, BATCH - 1, BATCH, BATCH + 1, BATCH + FEW];
            for count in counts.into_iter().filter(|&count| count > 0) {
                for draw in vertices.chunks(3 * count).take(100) {
                    check_sieve(draw, cull_mode);
                }
            }
        }
    }

    /// What is told of a batch of triangles of this many pixels, each two pixels right of the one before, but for one that lies
    /// ten rows further down.
    fn neighbourhood(count: usize, size: i32, outlier: usize, area: Rect) -> Option<Borders> {
        let at = |x: i32, y: i32| ProjectedVertex::new(x * 256, y * 256, 0.5, 1.0).expect("in range");
        let corners = |(i, x)| {
            let y = if i == outlier { 17 } else { 7 };
            [at(x, y), at(x, y + size), at(x + size, y)]
        };
        let vertices: Vec<_> = (0..count).zip((5..).step_by(2)).flat_map(corners).collect();
        let positions = [Vec4::ZERO; 3 * BATCH];
        let projector =
            Projector::new(&Viewport::of_size(64, 64).expect("valid"), ClipDepth::ZeroToOne, DepthClip::Clip);
        let facing = Facing {
            cull_mode: CullMode::None,
            front_face: FrontFace::CounterClockwise,
            provoking_vertex: ProvokingVertex::First,
        };
        let projected = Projected::new(&vertices, &positions[..vertices.len()]).expect("as many");
        let triangles = Primitives::list().triangles(vertices.len());
        let mut geometry = Geometry::new(triangles, projected, projector, facing, area);
        assert!(geometry.neighbourhood().is_none(), "nothing is known before the first");
        assert!(geometry.refill(), "there are some");
        geometry.neighbourhood()
    }

    #[test]
    #[cfg_attr(not(target_arch = "x86_64"), ignore = "nothing is fetched ahead where there is no SIMD")]
    fn the_neighbourhood_of_a_batch_is_told() {
        let area = Rect::of_size(200, 100);
        let borders = |left, top, right, bottom| Rect::from_edges(left, top, right, bottom).borders();
        let told = |bounds: Option<Borders>| bounds.map(|b| [b.left, b.top, b.right, b.bottom]);
        let same = |bounds: Option<Borders>, expected: Option<Borders>| {
            assert_eq!(told(bounds), told(expected));
        };
        same(neighbourhood(20, 6, 20, area), Some(borders(5, 7, 5 + 19 * 2 + 6, 13)));
        same(neighbourhood(20, 6, 8, area), Some(borders(5, 7, 5 + 19 * 2 + 6, 23)));
        same(neighbourhood(20, 6, 9, area), Some(borders(5, 7, 5 + 19 * 2 + 6, 13)));
        same(neighbourhood(SOME, 6, 20, area), Some(borders(5, 7, 5 + 7 * 2 + 6, 13)));
        same(neighbourhood(SOME - 1, 6, 20, area), None);
        same(neighbourhood(20, 2, 20, area), None);
        same(
            neighbourhood(20, 6, 20, Rect { x: 10, y: 8, width: 20, height: 2 }),
            Some(borders(10, 8, 30, 10)),
        );
    }
}
