//! The geometry half of a draw: from vertices to pieces of triangles that may be seen.
//!
//! A triangle is projected, clipped if it must be, culled by the sign of its exact area, and dropped when its bounding box
//! holds no sample, or up to two by two none of which it covers. All of that comes before the first division: of a fine
//! mesh, most triangles end here. With those that are left goes what was found out about them.

#![expect(clippy::cast_possible_truncation, reason = "places in a batch are under 2⁶")]

use crate::behind::{Sight, keep_seen};
use crate::fan::{Fan, Piece};
use crate::fragment::Identity;
use crate::primitive::{Group, Index, Triangle, Triangles};
use crate::project::{Positions, ProjectedVertex, Projector, ROUNDING, is_invalid};
use crate::queue::Queue;
use crate::setup::{ORDERS, Setup, sample_bounds, signed_area2};
use crate::state::{CullMode, FrontFace, ProvokingVertex, Statistics};
use crate::target::{Borders, Rect};
use crate::tiny::{self, Outline};
use crate::traverse::HAS_FLOAT_LANES;
use crate::triple::each;

/// Which sides of triangles are drawn, what they are called, and which vertex flat varyings come from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facing {
    pub(crate) cull_mode: CullMode,
    pub(crate) front_face: FrontFace,
    pub(crate) provoking_vertex: ProvokingVertex,
}

impl Facing {
    #[inline(always)]
    fn is_front(self, is_counter_clockwise: bool) -> bool {
        is_counter_clockwise == (self.front_face == FrontFace::CounterClockwise)
    }

    #[inline(always)]
    pub(crate) fn culls(self, area2: i64) -> bool {
        let is_front = self.is_front(area2 < 0);
        ((self.cull_mode == CullMode::Front) & is_front) | ((self.cull_mode == CullMode::Back) & !is_front)
    }

    #[inline(always)]
    pub(crate) fn identity(self, last_provoking: u8, is_counter_clockwise: bool, primitive: u32) -> Identity {
        let provoking = match self.provoking_vertex {
            ProvokingVertex::First => 0,
            ProvokingVertex::Last => last_provoking,
        };
        Identity { provoking, is_front_facing: self.is_front(is_counter_clockwise), primitive }
    }
}

/// How many triangles are looked at before the first of them is drawn.
pub(crate) const BATCH: usize = if HAS_FLOAT_LANES { 64 } else { 1 };

/// Up to so many triangles, not all of the sieve's lanes are worked out.
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

/// The borders of one triangle's bounds, from a [batch's corners](Batch::corners).
#[inline(always)]
fn borders_of([first, last, _]: &[[[i32; 2]; BATCH]; 3], lane: usize) -> Borders {
    let ([left, top], [right, bottom]) = (first[lane], last[lane]);
    Borders { left, top, right, bottom }
}

/// The corners of a triangle that is one point. (A call: so LLVM leaves the way to it as a branch that is never taken, instead of
/// choosing between each vertex and none.)
#[cold]
#[inline(never)]
fn no_corners() -> [[i32; 2]; 3] {
    [[0; 2]; 3]
}

/// Some triangles of a draw, and what was found out about them.
#[derive(Debug)]
struct Batch<'a, I> {
    triangles: Group<'a, I, BATCH>,
    /// x and y of the first vertices, the second and the third ones, in subpixels, side by side as they are fetched. Those of
    /// a vertex outside are no place, and far to the left: see [`ProjectedVertex::xy`].
    ///
    /// Once these are split, and if [outlines](Geometry::KNOWS_OUTLINES) are known, the top left and the bottom right corners of
    /// bounds, in pixels: [`borders_of`]. (In the same place: what a draw keeps is cleared first.) Of a clipped triangle, of the piece
    /// that came last.
    corners: [[[i32; 2]; BATCH]; 3],
    /// The same numbers as the sieve needs them.
    x: [[f32; BATCH]; 3],
    y: [[f32; BATCH]; 3],
    verdicts: [u32; BATCH],
    /// Which of them may be seen, and were not drawn or left out yet.
    queue: Queue,
    /// How many triangles there are in all.
    count: usize,
    /// The number of the first triangle.
    primitive: u32,
    /// How many of those that may be seen were minute.
    minute: u32,
}

impl<I: Index> Batch<'_, I> {
    /// None yet, the first of which will have this number. (A function: a constant is written to the stack, and then copied.)
    #[inline(always)]
    fn before(primitive: u32) -> Self {
        Self {
            triangles: Group::new(),
            corners: [[[0; 2]; BATCH]; 3],
            x: [[0.0; BATCH]; 3],
            y: [[0.0; BATCH]; 3],
            verdicts: [0; BATCH],
            queue: Queue::EMPTY,
            count: 0,
            primitive,
            minute: 0,
        }
    }

    /// About where the triangles of the queue lie: the bounds of some.
    #[inline(always)]
    fn neighbourhood(&self) -> Borders {
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
mod verdict {
    pub(super) const ORDER: u32 = 0b111;
    /// Added to the place of the first vertex.
    pub(super) const COUNTER_CLOCKWISE: u32 = crate::setup::COUNTER_CLOCKWISE as u32;
    pub(super) const UNDECIDED: u32 = 1 << 4;
    pub(super) const TINY: u32 = 1 << 5;
    pub(super) const COVERED_SHIFT: u32 = 8;
    /// Of those four bits, shifted down.
    pub(super) const COVERED: u32 = 0b1111;
    pub(super) const DROPPED: u32 = 1 << 31;
}

/// Where vertices come from.
#[derive(Debug)]
struct Vertices<P> {
    positions: P,
    projector: Projector,
    /// Strips, fans and tidy meshes name a vertex again at once: the triangle before is all the cache they need.
    before: [(usize, ProjectedVertex); 3],
}

impl<P: Positions> Vertices<P> {
    /// A triangle's vertices on the subpixel grid.
    #[inline(always)]
    fn corners(&mut self, vertices: [usize; 3]) -> [ProjectedVertex; 3] {
        if P::ARE_PROJECTED {
            let projected = self.positions.projected();
            return each(vertices, |index| *projected.get(index).unwrap_or(&ProjectedVertex::BLANK));
        }
        let corners = each(
            vertices,
            #[cfg_attr(feature = "dispatch", inline(always))]
            |index| {
                for (i, vertex) in self.before {
                    if i == index {
                        return vertex;
                    }
                }
                let Some(position) = self.positions.clip(index) else { return ProjectedVertex::default() };
                self.projector.project(position)
            },
        );
        let ([i, j, k], [a, b, c]) = (vertices, corners);
        self.before = [(i, a), (j, b), (k, c)];
        corners
    }
}

/// Iterates over the pieces of a draw.
///
/// Triangles come in batches, which go through a sieve: loops without a branch that find out which of them have to be
/// drawn. Then those are. Whether a triangle is culled is a coin toss that no branch predictor wins.
#[derive(Debug)]
pub(crate) struct Geometry<'a, I, P> {
    triangles: Triangles<'a, I>,
    vertices: Vertices<P>,
    facing: Facing,
    /// The render area.
    area: Borders,
    batch: Batch<'a, I>,
    /// Where what is rare leaves its result. If it returned that, the usual result would have to go through memory, too.
    aside: Piece,
    /// Where in the batch the piece that came last stands.
    lane: usize,
    pub(crate) statistics: Statistics,
}

impl<'a, I: Index, P: Positions> Geometry<'a, I, P> {
    /// Whether the sieve finds out where triangles lie, which then need not be worked out when they are drawn, where the first
    /// branches wait for it. Not where there is no SIMD, and so no sieve; nor of positions that are computed when asked for: they may
    /// be others then, and the bounds must be those of what is drawn.
    const KNOWS_OUTLINES: bool = HAS_FLOAT_LANES && P::ARE_PROJECTED;

    /// (A call: what it gives is large, and is made where it will stay. Inlined, it changes the loops behind it, for the worse.)
    #[inline(never)]
    pub(crate) fn new(
        triangles: Triangles<'a, I>,
        positions: P,
        projector: Projector,
        facing: Facing,
        area: Rect,
    ) -> Self {
        Self {
            batch: Batch::before(triangles.first_number()),
            triangles,
            vertices: Vertices {
                positions,
                projector,
                before: [(usize::MAX, ProjectedVertex::default()); 3],
            },
            facing,
            area: area.borders(),
            aside: Piece::BLANK,
            lane: 0,
            statistics: Statistics::default(),
        }
    }

    /// Takes in the next batch. False when there are no more triangles.
    #[inline(always)]
    pub(crate) fn refill(&mut self) -> bool {
        self.batch.primitive = self.batch.primitive.wrapping_add(self.batch.count as u32);
        let Self { triangles, vertices, batch, .. } = self;
        let [a, b, c] = &mut batch.corners;
        let slots = a.iter_mut().zip(b).zip(c);
        let count = if P::ARE_PROJECTED {
            let projected = vertices.positions.projected();
            triangles.take_group(&mut batch.triangles, slots, |((a, b), c), [i, j, k]| {
                // Indices were checked before. If one is out of range all the same, the triangle is one point, and is dropped.
                let mut point = || [*a, *b, *c] = no_corners();
                let Some(i) = projected.get(i) else { return point() };
                let Some(j) = projected.get(j) else { return point() };
                let Some(k) = projected.get(k) else { return point() };
                (*a, *b, *c) = (i.xy(), j.xy(), k.xy());
            })
        } else {
            triangles.take_group(
                &mut batch.triangles,
                slots,
                #[cfg_attr(feature = "dispatch", inline(always))]
                |((a, b), c), triangle| {
                    [*a, *b, *c] = each(vertices.corners(triangle), ProjectedVertex::xy);
                },
            )
        };
        batch.count = count;
        if count == 0 {
            return false;
        }
        self.statistics.primitives += count as u64;
        if HAS_FLOAT_LANES {
            if count <= FEW { self.sift_few() } else { self.sift::<BATCH>() }
        } else {
            // Integers are as fast, and where floats are emulated much faster.
            self.batch.verdicts = [verdict::UNDECIDED; BATCH];
            self.batch.queue = Queue::below(count);
        }
        true
    }

    /// [`sift`](Self::sift) for a few triangles: a draw of two should not pay for 64.
    #[inline(never)]
    fn sift_few(&mut self) {
        self.sift::<FEW>();
    }

    /// Finds out which of the batch's triangles have to be drawn, which are up to `LANES`.
    #[inline(always)]
    fn sift<const LANES: usize>(&mut self) {
        let count = self.batch.count;
        (self.batch.queue, self.batch.minute) = (Queue::EMPTY, 0);
        if count < LANES {
            for corners in &mut self.batch.corners {
                corners.get_mut(count..LANES).unwrap_or_default().fill([0; 2]);
            }
        }
        self.batch.split_corners::<LANES>();
        // Meshes turn their backs in long stretches: whole batches end here.
        if self.sift_by_facing::<LANES>() == 0 {
            return;
        }
        let minute = self.sift_by_bounds::<LANES>();
        if minute > MANY {
            self.sift_minute::<LANES>();
        }
        let verdicts = self.batch.verdicts.get(..LANES).unwrap_or_default();
        // Where the batch has no triangle, there is one without an area.
        self.batch.queue = Queue::of_clear_signs(verdicts);
        self.batch.minute = minute;
    }

    /// Drops triangles that are culled. Gives how many are left.
    ///
    /// All in `f32`, where differences of coordinates are exact: they have 24 bits. Products of them may be rounded, but
    /// rounding is monotonic: the difference of two has the sign of the area, or is zero.
    #[inline(always)]
    fn sift_by_facing<const LANES: usize>(&mut self) -> u32 {
        let count = self.batch.count;
        // Times this, areas of triangles that are culled are positive.
        let culls = f32::from(i8::from(self.facing.culls(1)) - i8::from(self.facing.culls(-1)));
        if count < LANES {
            return self.sift_unclear::<LANES>(culls);
        }
        let Batch { x: [ax, bx, cx], y: [ay, by, cy], verdicts, .. } = &mut self.batch;
        let (mut culled, mut unclear) = (0, 0);
        for i in 0..LANES {
            let ([ax, bx, cx], [ay, by, cy]) = ([ax[i], bx[i], cx[i]], [ay[i], by[i], cy[i]]);
            let area2 = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
            let is_culled = area2 * culls > 0.0;
            unclear |= u32::from((area2 == 0.0) | (min(min(ax, bx), cx) < OUTERMOST));
            culled += u32::from(is_culled);
            verdicts[i] = if area2 < 0.0 { verdict::COUNTER_CLOCKWISE } else { 0 }
                | if is_culled { verdict::DROPPED } else { 0 };
        }
        if unclear != 0 {
            return self.sift_unclear::<LANES>(culls);
        }
        self.statistics.culled += u64::from(culled);
        count as u32 - culled
    }

    /// The same of a batch in which an area is zero, or a vertex outside of the clip volume, or that is not full. Which zeros
    /// are lines and which are needles is left to integers, unless both products are exact.
    #[inline(never)]
    fn sift_unclear<const LANES: usize>(&mut self, culls: f32) -> u32 {
        let count = self.batch.count;
        let Batch { x: [ax, bx, cx], y: [ay, by, cy], verdicts, .. } = &mut self.batch;
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
            verdicts[i] = if area2 < 0.0 { verdict::COUNTER_CLOCKWISE } else { 0 }
                | if is_degenerate | is_culled { verdict::DROPPED } else { 0 }
                | if is_undecided { verdict::UNDECIDED } else { 0 };
        }
        // Where the batch has no triangle, all three vertices are the same point.
        degenerate -= (LANES - count) as u32;
        self.statistics.culled += u64::from(culled);
        self.statistics.degenerate += u64::from(degenerate);
        count as u32 - culled - degenerate
    }

    /// Drops triangles whose bounds hold no sample of the area, and finds the canonical order of the others' vertices, and where
    /// they lie. Gives how many of those are minute.
    #[inline(always)]
    fn sift_by_bounds<const LANES: usize>(&mut self) -> u32 {
        let Batch { x: [ax, bx, cx], y: [ay, by, cy], verdicts, corners: [first, last, _], .. } =
            &mut self.batch;
        let area = PixelBorders::new(self.area);
        let mut minute = 0;
        for i in 0..LANES {
            let ([ax, bx, cx], [ay, by, cy]) = ([ax[i], bx[i], cx[i]], [ay[i], by[i], cy[i]]);
            let bounds = PixelBorders::of_triangle([ax, bx, cx], [ay, by, cy]);
            if Self::KNOWS_OUTLINES {
                let Borders { left, top, right, bottom } = bounds.borders();
                (first[i], last[i]) = ([left, top], [right, bottom]);
                let extent = max(extent([ax, bx, cx]), extent([ay, by, cy]));
                verdicts[i] |= if extent <= tiny::LARGEST as f32 { verdict::TINY } else { 0 };
            }
            let is_seen = (max(bounds.left, area.left) < min(bounds.right, area.right))
                & (max(bounds.top, area.top) < min(bounds.bottom, area.bottom));
            let is_higher = |ax: f32, ay: f32, bx: f32, by: f32| (ay < by) | ((ay == by) & (ax < bx));
            let b_first = is_higher(bx, by, ax, ay);
            let c_first = is_higher(cx, cy, ax, ay) & is_higher(cx, cy, bx, by);
            minute += u32::from(bounds.are_minute() & is_seen & (verdicts[i] & verdict::DROPPED == 0));
            let is_hidden = !is_seen & (verdicts[i] & verdict::UNDECIDED == 0);
            verdicts[i] += if c_first { 2 } else { u32::from(b_first) };
            verdicts[i] |= if is_hidden { verdict::DROPPED } else { 0 };
        }
        minute
    }

    /// Finds out which samples are covered by triangles whose bounds hold one or two, or two by two. Half of the triangles
    /// in the size of a pixel lie between samples: they are hidden.
    #[inline(always)]
    fn sift_minute<const LANES: usize>(&mut self) {
        let Batch { x: [ax, bx, cx], y: [ay, by, cy], verdicts, .. } = &mut self.batch;
        let area = PixelBorders::new(self.area);
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
            let clockwise =
                if verdicts[i] & verdict::ORDER >= verdict::COUNTER_CLOCKWISE { -1.0 } else { 1.0 };
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
            let bit = |least: f32, bit: u32| if least > 0.0 { bit << verdict::COVERED_SHIFT } else { 0 };
            let covered = bit(least(0.0, 0.0), 1)
                | bit(least(1.0, 0.0), 2)
                | bit(least(0.0, 1.0), 4)
                | bit(least(1.0, 1.0), 8);
            let found = if covered == 0 { verdict::DROPPED } else { covered };
            let is_decided = verdicts[i] & verdict::UNDECIDED == 0;
            // Of one that reaches out of the area, it is left open.
            verdicts[i] |=
                if is_decided & bounds.are_minute() & (is_inside | (covered == 0)) { found } else { 0 };
        }
    }

    /// About where those triangles of the batch lie that may be seen, if it is worth fetching their pixels together.
    #[inline(always)]
    pub(crate) fn neighbourhood(&self) -> Option<Borders> {
        let (len, minute) = (self.batch.queue.len(), self.batch.minute);
        // Minute triangles are so many to a cache line that hardly one of them needs a new one.
        let is_worth_it = (len >= SOME) & (2 * minute as usize <= len);
        is_worth_it.then(|| self.batch.neighbourhood().intersection(self.area))
    }

    /// Leaves out triangles of the batch, none of which was drawn yet, that are behind what is there: see [`keep_seen`].
    #[inline(always)]
    pub(crate) fn leave_out(&mut self, mut look: impl FnMut([ProjectedVertex; 3], Borders) -> Sight) {
        let Batch { triangles, verdicts, corners: bounds, queue, .. } = &mut self.batch;
        keep_seen(
            queue,
            #[cfg_attr(feature = "dispatch", inline(always))]
            |lane| {
                let lane = lane & (BATCH - 1);
                if verdicts[lane] & verdict::UNDECIDED != 0 {
                    return Sight::Unknown;
                }
                let corners @ [a, b, c] = self.vertices.corners(triangles.in_order(lane, &[0, 1, 2]));
                let bounds =
                    if Self::KNOWS_OUTLINES { borders_of(bounds, lane) } else { sample_bounds(a, b, c) };
                look(corners, bounds)
            },
        );
    }

    /// The batch's next piece. `fan` is where it keeps what is left of a clipped triangle; it starts empty.
    #[inline(always)]
    pub(crate) fn next(&mut self, fan: &mut Option<Fan>) -> Option<Piece> {
        loop {
            if fan.is_some() {
                if self.next_of_fan(fan) {
                    return Some(self.aside);
                }
                continue;
            }
            let lane = self.batch.queue.pop()? & (BATCH - 1);
            self.lane = lane;
            let verdict = self.batch.verdicts[lane];
            let number = self.batch.primitive.wrapping_add(lane as u32);
            let (setup, vertices) = if verdict & verdict::UNDECIDED == 0 {
                let place = verdict & verdict::ORDER;
                let order = ORDERS.get(place as usize)?;
                let vertices = self.batch.triangles.in_order(lane, order);
                (Setup::of_corners(self.vertices.corners(vertices), place as u8), vertices)
            } else {
                let triangle = self.batch.triangles.triangle(lane);
                if !self.look_closer(triangle, number, fan) {
                    continue;
                }
                let setup = self.aside.setup;
                (setup, self.batch.triangles.in_order(lane, &setup.order()))
            };
            let covered = self.within(&setup, verdict >> verdict::COVERED_SHIFT & verdict::COVERED);
            return Some(Piece { setup, vertices, primitive: number, in_fan: 0, covered });
        }
    }

    /// Who a piece is, which has to be of this batch. (No part of the piece: few closures ask.)
    #[inline(always)]
    pub(crate) fn identity(&self, piece: &Piece) -> Identity {
        let lane = piece.primitive.wrapping_sub(self.batch.primitive) as usize;
        debug_assert!(lane < self.batch.count, "{piece:?} is not of the {} in the batch", self.batch.count);
        let last_provoking = self.batch.triangles.last_provoking(lane);
        self.facing.identity(last_provoking, piece.setup.is_counter_clockwise(), piece.primitive)
    }

    /// Where the piece lies, which has to be the one that came last.
    #[inline(always)]
    pub(crate) fn outline(&self, piece: &Piece) -> Outline {
        if !Self::KNOWS_OUTLINES {
            return Outline::new(&piece.setup);
        }
        let (Batch { verdicts, corners, .. }, lane) = (&self.batch, self.lane & (BATCH - 1));
        let outline =
            Outline { bounds: borders_of(corners, lane), is_tiny: verdicts[lane] & verdict::TINY != 0 };
        debug_assert_eq!(outline, Outline::new(&piece.setup), "of another piece");
        outline
    }

    /// Finds out where the piece of a clipped triangle lies that was put aside.
    #[cold]
    #[inline(never)]
    fn outline_aside(&mut self) {
        let (lane, Outline { bounds, is_tiny }) = (self.lane & (BATCH - 1), Outline::new(&self.aside.setup));
        let [first, last, _] = &mut self.batch.corners;
        (first[lane], last[lane]) = ([bounds.left, bounds.top], [bounds.right, bounds.bottom]);
        self.batch.verdicts[lane] &= !verdict::TINY;
        self.batch.verdicts[lane] |= if is_tiny { verdict::TINY } else { 0 };
    }

    /// Which samples are [`covered`](crate::fan::Piece::covered), or that it is not known if any of the four lies outside of
    /// the area. The sieve has seen to that; but who computes positions may give others when asked again, and must not be drawn
    /// there.
    #[inline(always)]
    fn within(&self, setup: &Setup, covered: u32) -> u32 {
        let (Borders { left, top, .. }, area) = (setup.borders(), self.area);
        let is_inside =
            (left >= area.left) & (top >= area.top) & (left < area.right - 1) & (top < area.bottom - 1);
        if P::ARE_PROJECTED || is_inside { covered } else { 0 }
    }

    /// Whether the bounding box holds a sample of the area.
    #[inline(always)]
    fn may_cover(&self, [a, b, c]: [ProjectedVertex; 3]) -> bool {
        sample_bounds(a, b, c).overlaps(self.area)
    }

    /// Puts the next piece of a clipped triangle aside. False when there is none.
    #[cold]
    #[inline(never)]
    fn next_of_fan(&mut self, fan: &mut Option<Fan>) -> bool {
        while let Some(piece) = fan.as_mut().and_then(|fan| fan.next(&self.vertices.projector)) {
            if self.may_cover(piece.setup.corners()) {
                self.aside = piece;
                if Self::KNOWS_OUTLINES {
                    self.outline_aside();
                }
                return true;
            }
        }
        *fan = None;
        false
    }

    /// Decides on a triangle by integers: if it may be seen, its setup is put aside. Or clips it: then `fan` has what is
    /// left.
    #[cold]
    #[inline(never)]
    fn look_closer(&mut self, triangle: Triangle, number: u32, fan: &mut Option<Fan>) -> bool {
        let corners @ [a, b, c] = self.vertices.corners(triangle.vertices());
        if a.is_outside() | b.is_outside() | c.is_outside() {
            *fan = self.clip(triangle, corners, number);
            return false;
        }
        let area2 = signed_area2(a, b, c);
        if area2 == 0 {
            self.statistics.degenerate += 1;
        } else if self.facing.culls(area2) {
            self.statistics.culled += 1;
        } else if self.may_cover(corners) {
            self.aside.setup = Setup::with_area2(corners, area2);
            return true;
        }
        false
    }

    /// Clips and culls a triangle with a vertex outside of the clip volume.
    #[cold]
    #[inline(never)]
    fn clip(&mut self, triangle: Triangle, corners: [ProjectedVertex; 3], primitive: u32) -> Option<Fan> {
        let outcodes = each(corners, ProjectedVertex::outcode);
        let union = outcodes[0] | outcodes[1] | outcodes[2];
        let positions = each(triangle.vertices(), |index| self.vertices.positions.clip(index));
        let [Some(a), Some(b), Some(c)] = positions else { return None };
        if is_invalid(union) {
            self.statistics.invalid += 1;
            return None;
        }
        if outcodes[0] & outcodes[1] & outcodes[2] != 0 {
            self.statistics.outside += 1;
            return None;
        }
        let positions = each([a, b, c], |position| self.vertices.projector.to_clip(position));
        let fan = Fan::new(triangle.vertices(), positions, union, primitive, &self.vertices.projector);
        if fan.is_empty() {
            self.statistics.outside += 1;
            return None;
        }
        self.statistics.clipped += 1;
        if fan.area2() == 0 || self.facing.culls(fan.area2()) {
            let is_degenerate = fan.area2() == 0;
            let count =
                if is_degenerate { &mut self.statistics.degenerate } else { &mut self.statistics.culled };
            *count += 1;
            return None;
        }
        Some(fan)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::clip::DepthClip;
    use crate::primitive::Primitives;
    use crate::project::Projected;
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
