//! Traversal: which samples of a row lie inside, found from the edge functions without testing each of them.
//!
//! A triangle is convex, so on a row it covers one span. Where an edge function crosses zero is estimated with one
//! multiplication and then *decided* by evaluating the edge function, in integers, at the estimate: the spans are exactly
//! the samples that [`EdgeFunction::covers`] accepts, for any triangle.
//!
//! Where there is SIMD, eight rows are solved at a time, one a lane: those of triangles up to 181 pixels wide and high in
//! `f32`, of larger ones in `f64`. Every number that decides is an integer that the type holds exactly ([`Lines`]).
//! Elsewhere triangles up to 1023 pixels are solved in `i32` ([`Compact`]), and larger ones in `i64` ([`solve_alone`]),
//! row by row. All find the same spans.

#![expect(clippy::cast_possible_truncation, reason = "lanes are under 2⁴")]
#![expect(clippy::needless_range_loop, reason = "arrays in step, lane by lane, are what becomes SIMD")]

use core::num::NonZeroU32;
use core::ops::{Add, Mul, Neg, Sub};

use crate::edge::EdgeFunction;
use crate::project::{ProjectedVertex, ROUNDING, round};
use crate::setup::Setup;
use crate::target::{Borders, DOMAIN, EXTENT, Rect};
use crate::triple::each;

/// How many rows are solved at a time: a SIMD register of `f32`, and one where there is none.
pub(crate) const LANES: usize = if HAS_FLOAT_LANES { 8 } else { 1 };

/// The largest extent, in subpixels, of a triangle that is solved in `f32`: its square is under 2³¹.
const SMALL: u32 = 181 << 8;

/// The largest size, in pixels, of one that is solved in `i32`.
const COMPACT: i32 = 1023;

/// Whether the target works on several `f32` at once. Elsewhere integers are as fast, and where floats are emulated
/// they are much faster. Both ways find the same spans.
pub(crate) const HAS_FLOAT_LANES: bool =
    cfg!(any(target_arch = "x86_64", target_arch = "x86", target_arch = "aarch64", target_arch = "wasm32"));

/// Whether draws are compiled for registers of eight `f32`: because the crate is, or on x86, because the feature `dispatch` says
/// so. Both ways draw the same bits.
pub(crate) const HAS_WIDE_LANES: bool = cfg!(any(
    target_feature = "avx",
    all(feature = "dispatch", any(target_arch = "x86_64", target_arch = "x86")),
));

/// Whether floats are not emulated, as far as that is told while compiling. (Of RISC-V's extensions only newer compilers tell:
/// with an operating system, there is an FPU.) A wrong guess costs time or flash; the bits are the same.
pub(crate) const HAS_FPU: bool = cfg!(not(any(
    all(target_arch = "arm", not(any(target_abi = "eabihf", target_os = "android", target_vendor = "apple"))),
    all(any(target_arch = "riscv32", target_arch = "riscv64"), target_os = "none"),
    target_abi = "softfloat",
)));

/// The samples that a triangle covers on one row of an area.
///
/// The edge functions are known exactly at one of the samples that the triangle covers on this row, whether it lies in
/// the area or not: the *anchor*. Everything else on the row is measured from there; in triangles of up to 16 × 16 pixels,
/// where `f32` holds the edge functions exactly at every sample, from each sample itself. So a number at (x, y) depends
/// on the triangle and on (x, y) alone, and it never extrapolates from outside the triangle, however thin that is.
///
/// # Examples
/// Barycentrics of every sample, and with them anything that is linear on the screen:
/// ```
/// use halfplane::{ProjectedVertex, Rect, Setup};
/// # let vertex = |x, y| ProjectedVertex::new(x * 256, y * 256, 0.5, 1.0).unwrap();
/// let triangle = Setup::new([vertex(0, 0), vertex(0, 64), vertex(64, 0)]).expect("it has an area");
/// let inv_area2 = 1.0 / triangle.area2() as f32;
/// triangle.for_each_span(Rect::of_size(64, 64), |span| {
///     for x in span.start()..span.end() {
///         let mut barycentrics = [0.0; 3]; // of the vertices in the order given to `Setup::new`
///         for i in 0..3 {
///             let edge = span.edges()[i] + triangle.edges()[i].step_x() as f32 * (x - span.anchor()) as f32;
///             barycentrics[usize::from(triangle.order()[i])] = edge * inv_area2;
///         }
///         // The second vertex is at (0, 64): its barycentric is how far down the sample lies, from 0 to 1.
///         assert_eq!(barycentrics[1], (span.y() as f32 + 0.5) / 64.0);
///         assert!((barycentrics.iter().sum::<f32>() - 1.0).abs() < 1e-6);
///     }
/// });
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Span {
    y: i32,
    start: i32,
    end: i32,
    anchor: i32,
    edges: [f32; 3],
}

impl Span {
    /// The row.
    #[inline(always)]
    #[must_use]
    pub fn y(&self) -> i32 {
        self.y
    }

    /// The first column.
    #[inline(always)]
    #[must_use]
    pub fn start(&self) -> i32 {
        self.start
    }

    /// One past the last column; always after [`start`](Self::start).
    #[inline(always)]
    #[must_use]
    pub fn end(&self) -> i32 {
        self.end
    }

    /// The column of the anchor. Of the two ends of the row's whole span, the one with the larger w.
    #[inline(always)]
    #[must_use]
    pub fn anchor(&self) -> i32 {
        self.anchor
    }

    /// The three edge functions at the anchor, in the order of [`Setup::edges`], each rounded once to `f32`.
    #[inline(always)]
    #[must_use]
    pub fn edges(&self) -> [f32; 3] {
        self.edges
    }
}

/// Some neighbouring rows, solved: columns `start .. end`, an anchor, and the edge functions there.
#[derive(Clone, Debug)]
pub(crate) struct Rows {
    pub(crate) start: [i32; LANES],
    pub(crate) end: [i32; LANES],
    pub(crate) anchor: [i32; LANES],
    pub(crate) edges: [[f32; LANES]; 3],
}

impl Setup {
    /// Calls `visit` for each row of `area` on which the triangle covers samples, from the top.
    ///
    /// # Examples
    /// See [`Setup`] for which pixels these are, and [`Span`] for barycentrics there.
    #[inline(always)]
    pub fn for_each_span(&self, area: Rect, mut visit: impl FnMut(Span)) {
        let area = area.intersection(DOMAIN);
        let bounds = self.bounds();
        let (left, right) = (area.x, area.right());
        let (top, bottom) = (area.y.max(bounds.y), area.bottom().min(bounds.bottom()));
        let solver = Solver::new(self);
        let mut first = top;
        while first < bottom {
            let rows = solver.solve(first);
            let count = (bottom - first) as usize;
            for lane in 0..count.min(LANES) {
                let (start, end) = (rows.start[lane].max(left), rows.end[lane].min(right));
                if start < end {
                    visit(Span {
                        y: first + lane as i32,
                        start,
                        end,
                        anchor: rows.anchor[lane],
                        edges: [rows.edges[0][lane], rows.edges[1][lane], rows.edges[2][lane]],
                    });
                }
            }
            first += LANES as i32;
        }
    }
}

/// A triangle's edges in the form that its rows are solved from.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Solver {
    Small(Lines<f32>),
    Large(Lines<f64>),
    Compact(Compact),
    Alone(Setup),
}

impl Solver {
    #[inline(always)]
    pub(crate) fn new(setup: &Setup) -> Self {
        if HAS_FLOAT_LANES {
            if is_small(setup) { Self::Small(Lines::small(setup)) } else { Self::Large(Lines::large(setup)) }
        } else {
            Compact::new(setup, setup.borders()).map_or(Self::Alone(*setup), Self::Compact)
        }
    }

    #[inline(always)]
    pub(crate) fn solve(&self, first: i32) -> Rows {
        match self {
            Self::Small(small) => small.solve(first),
            Self::Large(large) => large.solve(first),
            Self::Compact(compact) => compact.solve(first),
            Self::Alone(setup) => solve_alone(setup, first),
        }
    }
}

/// Whether no edge function of a triangle exceeds 2³¹ at its bounds' samples.
#[inline(always)]
fn is_small(setup: &Setup) -> bool {
    setup.extent() <= SMALL
}

/// At which end of a row 1/w is smaller. From there it grows along the row, so that no rounding error can exceed it.
#[inline(always)]
fn anchors_at_end(setup: &Setup) -> bool {
    let corners = setup.corners();
    let edges = setup.edges();
    let [p, q, r] = each(edges, |edge| edge.slope()[0] as f32);
    let [u, v, w] = each(corners, ProjectedVertex::inv_w);
    p * u + q * v + r * w < 0.0
}

/// What rows are solved in: `f32` for small triangles, `f64` for those of any size.
pub(crate) trait Real:
    Copy + PartialOrd + Neg<Output = Self> + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
{
    /// What edge functions are divided by, rounded down, before rows are solved from them: 1, or 256, by which E changes
    /// from sample to sample. So E mod 256 is the same at every sample, and floor(E / 256) keeps the sign.
    const UNIT: i64;

    /// More columns than the widest triangle has.
    const BEYOND: Self;

    /// So large that its last bit is worth 1: adding it rounds to an integer. See [`round`].
    const ROUNDING: Self;

    /// Of an integer that it holds exactly.
    fn of(x: i64) -> Self;

    /// Of an integer in ± `BEYOND`.
    fn to_i32(self) -> i32;

    /// Rounded, if need be.
    fn to_f32(self) -> f32;
}

impl Real for f32 {
    const UNIT: i64 = 256;
    const BEYOND: Self = 182.0;
    const ROUNDING: Self = ROUNDING;

    #[inline(always)]
    fn of(x: i64) -> Self {
        x as i32 as Self
    }

    #[inline(always)]
    fn to_i32(self) -> i32 {
        round(self)
    }

    #[inline(always)]
    fn to_f32(self) -> f32 {
        self
    }
}

impl Real for f64 {
    const UNIT: i64 = 1;
    const BEYOND: Self = (2 * EXTENT + 1) as Self;
    const ROUNDING: Self = 1.5 * (1u64 << 52) as Self;

    #[inline(always)]
    fn of(x: i64) -> Self {
        x as Self
    }

    #[inline(always)]
    fn to_i32(self) -> i32 {
        (self + Self::ROUNDING).to_bits() as i32
    }

    #[inline(always)]
    fn to_f32(self) -> f32 {
        self as f32
    }
}

/// A triangle's edges, relative to the top left pixel of its bounds. What is called E here is floor((E + bias) / UNIT), of
/// which the sign decides: in a triangle of at most [`SMALL`] subpixels an integer of at most 2²³, in any other under 2⁴⁸.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lines<T> {
    x: i32,
    y: i32,
    /// Steps of E by a pixel right and down, and its value at the top left sample.
    a: [T; 4],
    b: [T; 4],
    c: [T; 4],
    /// What gives the edge function back: UNIT · E + rest.
    rest: [T; 4],
    /// −1 / a; anything where a = 0.
    minus_inv_a: [T; 4],
    anchors_at_end: bool,
}

impl Lines<f32> {
    #[inline(always)]
    fn small(setup: &Setup) -> Self {
        let bounds = setup.bounds();
        let (x, y) = (bounds.x, bounds.y);
        let [p, q, r] = setup.corners();
        // Four of everything, the last one again: the compiler makes one SIMD operation of each line.
        let along = |p: i32, q: i32, r: i32, origin: i32| {
            let relative = |v: i32| v - (origin << 8) - 128;
            let (p, q, r) = (relative(p), relative(q), relative(r));
            ([q, r, p, p], [r, p, q, q])
        };
        let (from_x, to_x) = along(p.x(), q.x(), r.x(), x);
        let (from_y, to_y) = along(p.y(), q.y(), r.y(), y);
        let mut lines = Self {
            x,
            y,
            a: [0.0; 4],
            b: [0.0; 4],
            c: [0.0; 4],
            rest: [0.0; 4],
            minus_inv_a: [0.0; 4],
            anchors_at_end: anchors_at_end(setup),
        };
        for i in 0..4 {
            let (a, b) = (from_y[i] - to_y[i], to_x[i] - from_x[i]);
            let value = -(a * from_x[i] + b * from_y[i]);
            let is_top_left = (a > 0) | ((a == 0) & (b > 0));
            let folded = (value - i32::from(!is_top_left)) >> 8;
            lines.a[i] = a as f32;
            lines.b[i] = b as f32;
            lines.c[i] = folded as f32;
            lines.rest[i] = (value - (folded << 8)) as f32;
            lines.minus_inv_a[i] = -1.0 / if a == 0 { 1.0 } else { a as f32 };
        }
        lines
    }
}

impl Lines<f64> {
    #[inline(always)]
    fn large(setup: &Setup) -> Self {
        let bounds = setup.bounds();
        let (x, y) = (bounds.x, bounds.y);
        let [p, q, r] = setup.edges();
        let edges = [p, q, r, r];
        let each = |of: fn(&EdgeFunction) -> i64| edges.map(|edge| of(&edge) as f64);
        Self {
            x,
            y,
            a: each(|edge| edge.step_x()),
            b: each(|edge| edge.step_y()),
            c: edges.map(|edge| (edge.at(x, y) + edge.bias()) as f64),
            rest: each(|edge| -edge.bias()),
            minus_inv_a: each(|edge| edge.step_x()).map(|a| -1.0 / if a == 0.0 { 1.0 } else { a }),
            anchors_at_end: anchors_at_end(setup),
        }
    }
}

impl<T: Real> Lines<T> {
    #[inline(always)]
    fn solve(&self, first: i32) -> Rows {
        let (zero, one, beyond) = (T::of(0), T::of(1), T::BEYOND);
        let mut row = [zero; LANES];
        for (lane, row) in row.iter_mut().enumerate() {
            *row = T::of(i64::from(first - self.y + lane as i32));
        }
        // Each edge along each row, at column 0; and the first column at which its sign has changed. (One after the other, and not
        // in a loop: with AVX-512, that would be what becomes SIMD, with a scatter for each row.)
        let ((e0, c0), (e1, c1), (e2, c2)) = (self.along(0, row), self.along(1, row), self.along(2, row));
        let (at_zero, crossing) = ([e0, e1, e2], [c0, c1, c2]);
        // Edge 1 is the left side and edge 2 the right side, unless it is exactly on top. Edge 0 may be either or below.
        let none = beyond + one + one;
        let mut rows = Rows::EMPTY;
        let edge_0_is_left = self.a[0] > zero;
        let edge_0_is_right = self.a[0] < zero;
        let edge_2_is_right = self.a[2] < zero;
        for lane in 0..LANES {
            let (c0, c1, c2) = (crossing[0][lane], crossing[1][lane], crossing[2][lane]);
            let other = if edge_0_is_left { c0 } else { -none };
            let start = if c1 > other { c1 } else { other };
            let (right, other) =
                (if edge_2_is_right { c2 } else { none }, if edge_0_is_right { c0 } else { none });
            let end = if right < other { right } else { other };
            let anchor = if self.anchors_at_end { end - one } else { start };
            rows.start[lane] = self.x + start.to_i32();
            rows.end[lane] = self.x + end.to_i32();
            rows.anchor[lane] = self.x + anchor.to_i32();
            for i in 0..3 {
                let e = self.a[i] * anchor + at_zero[i][lane];
                rows.edges[i][lane] = (e * T::of(T::UNIT) + self.rest[i]).to_f32();
            }
        }
        rows
    }

    /// Edge `i` along some rows, at column 0; and the first column at which its sign has changed.
    #[inline(always)]
    fn along(&self, i: usize, row: [T; LANES]) -> ([T; LANES], [T; LANES]) {
        let (zero, one, beyond) = (T::of(0), T::of(1), T::BEYOND);
        let rises = self.a[i] > zero;
        let (mut at_zero, mut crossing) = ([zero; LANES], [zero; LANES]);
        for lane in 0..LANES {
            let e = self.b[i] * row[lane] + self.c[i];
            let t = e * self.minus_inv_a[i];
            let t = if t > -one { t } else { -one };
            let t = if t < beyond { t } else { beyond };
            let estimate = (t + T::ROUNDING) - T::ROUNDING;
            // The estimate is off by at most ½ and a little, so the crossing is there or one column on.
            let is_inside = self.a[i] * estimate + e >= zero;
            at_zero[lane] = e;
            crossing[lane] = estimate + if is_inside == rises { zero } else { one };
        }
        (at_zero, crossing)
    }
}

/// Edges of a triangle of at most [`COMPACT`] pixels and 2³¹ squared subpixels, relative to the top left pixel of its
/// bounds, all in integers of 32 bits: for targets without several `f32` at a time.
///
/// As in [`Lines`], floor((E + bias) / 256) keeps the sign test: its magnitude is at most 2 · 1024² · 256 = 2²⁹.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Compact {
    x: i32,
    y: i32,
    left: Side,
    right: Side,
    /// The third edge, which may be either or, where it is level, nothing.
    other: Side,
    other_is_left: bool,
    /// Edges 0 and 1, and what all three sum up to.
    edges: [Plane; 2],
    area2: u32,
    anchors_at_end: bool,
}

/// Where a row crosses an edge: in column max(0, first + row · step) / divisor, rounded down.
#[derive(Clone, Copy, Debug)]
struct Side {
    first: i32,
    step: i32,
    divisor: NonZeroU32,
}

/// The low 32 bits of an edge function at the first sample, and its change by a pixel right and down, divided by 256.
#[derive(Clone, Copy, Debug)]
struct Plane {
    first: u32,
    a: i32,
    b: i32,
}

/// The edge from `p` to `q`, relative to the first sample, and floor((E + bias) / 256) there.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "low bits, and at most 2²⁹")]
fn plane(p: [i32; 2], q: [i32; 2], is_top_left: impl FnOnce(i32) -> bool) -> (Plane, i32) {
    let (a, b) = (p[1] - q[1], q[0] - p[0]);
    let first = i64::from(q[1] - p[1]) * i64::from(p[0]) + i64::from(p[0] - q[0]) * i64::from(p[1]);
    let folded = (first - i64::from(!is_top_left(a))) >> 8;
    (Plane { first: first as u32, a, b }, folded as i32)
}

impl Side {
    /// Of an edge that rises to the right: the smallest x with e + x·a ≥ 0, which is ⌊(a − 1 − e) / a⌋, or the first column.
    #[inline(always)]
    fn left((edge, folded): (Plane, i32)) -> Self {
        Self { first: edge.a - 1 - folded, step: -edge.b, divisor: divisor(edge.a) }
    }

    /// Of one that falls: the smallest x with e − x·|a| < 0, which is ⌊(e + |a|) / |a|⌋, or the first column. Of one that is
    /// level, beyond the last.
    #[inline(always)]
    fn right((edge, folded): (Plane, i32)) -> Self {
        if edge.a == 0 {
            return Self { first: i32::MAX, step: 0, divisor: NonZeroU32::MIN };
        }
        Self { first: folded - edge.a, step: edge.b, divisor: divisor(-edge.a) }
    }

    /// A row's column.
    #[inline(always)]
    fn crossing(self, row: i32) -> i32 {
        let numerator = self.first.wrapping_add(self.step.wrapping_mul(row)).max(0);
        (numerator as u32 / self.divisor) as i32
    }
}

#[inline(always)]
fn divisor(a: i32) -> NonZeroU32 {
    NonZeroU32::new(a as u32).unwrap_or(NonZeroU32::MIN)
}

impl Plane {
    /// At a covered sample, where no bits are higher.
    #[inline(always)]
    fn at(self, column: i32, row: i32) -> u32 {
        let moved = self.a.wrapping_mul(column).wrapping_add(self.b.wrapping_mul(row));
        self.first.wrapping_add((moved as u32) << 8)
    }
}

impl Compact {
    /// The edges of a triangle whose samples lie in these bounds. None of one too large.
    #[inline(always)]
    pub(crate) fn new(setup: &Setup, bounds: Borders) -> Option<Self> {
        let Borders { left: x, top: y, right, bottom } = bounds;
        let area2 = u32::try_from(setup.area2()).ok()?;
        if right - x > COMPACT || bottom - y > COMPACT {
            return None;
        }
        let [p, q, r] = each(setup.corners(), |v| [v.x() - (x << 8) - 128, v.y() - (y << 8) - 128]);
        // Of a triangle in canonical order, the left side goes up, the right side down unless it is the top, and the third
        // is never the top.
        let (other, left, right) = (plane(q, r, |a| a > 0), plane(r, p, |_| true), plane(p, q, |a| a == 0));
        let other_is_left = other.0.a > 0;
        Some(Self {
            x,
            y,
            left: Side::left(left),
            right: Side::right(right),
            other: if other_is_left { Side::left(other) } else { Side::right(other) },
            other_is_left,
            edges: [other.0, left.0],
            area2,
            anchors_at_end: anchors_at_end(setup),
        })
    }

    /// The row at `y`; others stay empty.
    #[inline(always)]
    pub(crate) fn solve(&self, y: i32) -> Rows {
        let row = y - self.y;
        let (left, right, other) =
            (self.left.crossing(row), self.right.crossing(row), self.other.crossing(row));
        let (start, end) =
            if self.other_is_left { (left.max(other), right) } else { (left, right.min(other)) };
        let anchor = if self.anchors_at_end { end.wrapping_sub(1) } else { start };
        let [e0, e1] = [self.edges[0].at(anchor, row), self.edges[1].at(anchor, row)];
        let e2 = self.area2.wrapping_sub(e0).wrapping_sub(e1);
        let mut rows = Rows::EMPTY;
        rows.start[0] = self.x + start;
        rows.end[0] = self.x.wrapping_add(end);
        rows.anchor[0] = self.x.wrapping_add(anchor);
        (rows.edges[0][0], rows.edges[1][0], rows.edges[2][0]) = (e0 as f32, e1 as f32, e2 as f32);
        rows
    }
}

/// One row of a triangle of any size, in integers of 64 bits. What its rows have in common is worked out for each of them:
/// rows this long can bear it, and the stack need not hold it.
#[cold]
#[inline(never)]
pub(crate) fn solve_alone(setup: &Setup, y: i32) -> Rows {
    let edges = setup.edges();
    let (mut start, mut end) = (-EXTENT, EXTENT);
    for edge in &edges {
        let step = edge.step_x();
        if step != 0 {
            let crossing = crossing(edge, 1.0 / step as f32, y);
            (start, end) = if step > 0 { (start.max(crossing), end) } else { (start, end.min(crossing)) };
        }
    }
    let anchor = if anchors_at_end(setup) { end - 1 } else { start };
    Rows {
        start: [start; LANES],
        end: [end; LANES],
        anchor: [anchor; LANES],
        edges: each(edges, |edge| [edge.at(anchor, y) as f32; LANES]),
    }
}

/// The first column at which an edge that is not level has changed its mind about row `y`; at most one past the domain.
fn crossing(edge: &EdgeFunction, inv_step: f32, y: i32) -> i32 {
    const BEYOND: f32 = (EXTENT + 1) as f32;
    let at_zero = edge.at(0, y) + edge.bias();
    // Three roundings of 2⁻²⁴ each: within 2⁻⁸ of the crossing wherever that matters.
    let t = crate::depth::clamp(-(at_zero as f32) * inv_step, -BEYOND, BEYOND);
    let estimate = round(t);
    let is_inside = at_zero + edge.step_x() * i64::from(estimate) >= 0;
    estimate + i32::from(is_inside != (edge.step_x() > 0))
}

impl Rows {
    pub(crate) const EMPTY: Self =
        Self { start: [0; LANES], end: [0; LANES], anchor: [0; LANES], edges: [[0.0; LANES]; 3] };
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::project::ProjectedVertex;
    use std::vec::Vec;

    /// A linear congruential generator: Knuth's MMIX constants.
    struct Random(u64);

    impl Random {
        fn below(&mut self, n: i32) -> i32 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            i32::try_from((self.0 >> 33) % u64::from(n.cast_unsigned())).expect("below n")
        }
    }

    /// Random triangles with corners on a grid of `step` subpixels, in a square of `size` pixels.
    fn triangles(size: i32, step: i32, count: usize) -> Vec<Setup> {
        let mut random = Random(1);
        let mut setups = Vec::new();
        while setups.len() < count {
            let mut vertex = || {
                let mut at = || random.below(size * 256 / step) * step - size * 128;
                let (x, y) = (at(), at());
                let inv_w = 1.0 / (1.0 + random.below(1000) as f32);
                ProjectedVertex::new(x, y, 0.5, inv_w).expect("in range")
            };
            setups.extend(Setup::new([vertex(), vertex(), vertex()]));
        }
        setups
    }

    /// The rows that the specification's formula covers, sample by sample.
    fn spans_by_definition(setup: &Setup, area: Rect) -> Vec<(i32, i32, i32)> {
        let area = setup.bounds().intersection(area);
        let mut spans = Vec::new();
        for y in area.y..area.bottom() {
            let covered: Vec<i32> =
                (area.x..area.right()).filter(|&x| setup.edges().iter().all(|e| e.covers(x, y))).collect();
            if let (Some(&first), Some(&last)) = (covered.first(), covered.last()) {
                assert_eq!(covered.len(), (last - first + 1).cast_unsigned() as usize, "convex");
                spans.push((y, first, last + 1));
            }
        }
        spans
    }

    #[test]
    fn spans_are_the_covered_samples() {
        let area = Rect { x: -100, y: -90, width: 190, height: 170 };
        for (size, step) in [(6, 1), (6, 128), (40, 1), (63, 64), (70, 1), (300, 128), (30_000, 1)] {
            for setup in triangles(size, step, 300) {
                let mut spans = Vec::new();
                setup.for_each_span(area, |span| spans.push((span.y(), span.start(), span.end())));
                assert_eq!(spans, spans_by_definition(&setup, area), "{setup:?}");
            }
        }
    }

    #[test]
    fn all_ways_to_solve_a_row_are_the_same() {
        let sizes = [
            (3, 1),
            (20, 1),
            (62, 1),
            (62, 128),
            (181, 1),
            (182, 256),
            (300, 1),
            (1023, 1),
            (1023, 128),
            (32_000, 1),
        ];
        for (size, step) in sizes {
            for setup in triangles(size, step, if size < 200 { 1000 } else { 100 }) {
                let bounds = setup.bounds();
                let (large, compact) = (Lines::large(&setup), Compact::new(&setup, bounds.borders()));
                let small = is_small(&setup).then(|| Lines::small(&setup));
                let is_too_large = size > COMPACT || setup.area2() > i64::from(u32::MAX);
                assert!(compact.is_some() || is_too_large, "{setup:?}");
                for first in (bounds.y..bounds.bottom()).step_by(LANES) {
                    let (small, large) = (small.map(|small| small.solve(first)), large.solve(first));
                    for lane in 0..LANES.min((bounds.bottom() - first).cast_unsigned() as usize) {
                        let row = |r: &Rows, lane: usize| {
                            let edges = r.edges.map(|e| e[lane].to_bits());
                            let is_empty = r.start[lane] >= r.end[lane];
                            (!is_empty).then_some((r.start[lane], r.end[lane], r.anchor[lane], edges))
                        };
                        let y = first + lane as i32;
                        let expected = row(&solve_alone(&setup, y), 0);
                        assert_eq!(row(&large, lane), expected, "in f64: {setup:?} row {y}");
                        if let Some(small) = &small {
                            assert_eq!(row(small, lane), expected, "in f32: {setup:?} row {y}");
                        }
                        if let Some(compact) = &compact {
                            assert_eq!(row(&compact.solve(y), 0), expected, "in i32: {setup:?} row {y}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn an_anchor_is_covered_and_does_not_depend_on_the_area() {
        for setup in triangles(50, 1, 300) {
            let mut anchors = Vec::new();
            setup.for_each_span(DOMAIN, |span| {
                assert!((span.start()..span.end()).contains(&span.anchor()), "{span:?}");
                anchors.push((span.y(), span.anchor()));
            });
            let area = Rect { x: -3, y: -7, width: 9, height: 13 };
            setup.for_each_span(area, |span| {
                assert!(anchors.contains(&(span.y(), span.anchor())), "{span:?}");
            });
        }
    }
}
