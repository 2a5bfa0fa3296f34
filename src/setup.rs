//! Triangle setup: three vertices on the subpixel grid become a record that can be traversed any number of times.
//!
//! The record keeps its corners in one *canonical* order: clockwise as displayed, the topmost first (of two at the same
//! height the left one). So every number derived from it is the same whichever vertex the caller named first, and the
//! traversal knows each edge's kind without asking. Edge i lies opposite to corner i: edge 2, 0 → 1, runs down the right side or along
//! a flat top; edge 1, 2 → 0, up the left side; and edge 0, 1 → 2, closes the triangle on either side or below.
//!
//! ```text
//!        0                 0 ───── 1            0
//!       ╱ ╲                 ╲     ╱             │╲
//!      ╱   1                 ╲   ╱              │ ╲
//!     2 ──╱                    2                2 ─ 1
//! ```

use crate::edge::EdgeFunction;
use crate::project::{ProjectedVertex, SUBPIXELS};
use crate::target::{Borders, Rect};
use crate::triple::each;

/// A triangle on the subpixel grid, ready to be traversed: plain data, `Copy`, independent of any framebuffer.
///
/// # Examples
/// Which pixels does a triangle cover?
/// ```
/// use halfplane::{ProjectedVertex, Rect, Setup};
/// let vertex = |x, y| ProjectedVertex::new(x * 256, y * 256, 0.5, 1.0).unwrap();
/// let triangle = Setup::new([vertex(0, 0), vertex(0, 4), vertex(4, 0)]).expect("it has an area");
/// assert!(triangle.is_counter_clockwise());
///
/// let mut spans = Vec::new();
/// triangle.for_each_span(Rect::of_size(8, 8), |span| spans.push((span.y(), span.start(), span.end())));
/// assert_eq!(spans, [(0, 0, 3), (1, 0, 2), (2, 0, 1)]); // the samples on the slanted right edge are out
/// ```
#[derive(Clone, Copy, Debug)]
#[repr(C)] // So that the place comes first: see there.
pub struct Setup {
    /// Which of the caller's vertices each corner is: a place in [`ORDERS`].
    ///
    /// (At the end, LLVM would gather it and the three vertex numbers that follow in a `Piece` in one register, to store them at once,
    /// which takes longer. As large as these, so that no padding is copied.)
    place: usize,
    corners: [ProjectedVertex; 3],
    area2: i64,
}

/// How much of a rectangle a triangle covers, as far as its edges tell: see [`Setup::coverage`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Coverage {
    /// No sample.
    None,
    /// Perhaps some samples: no single edge excludes all, and not every edge includes all.
    Partial,
    /// Every sample.
    Full,
}

/// From this place in [`ORDERS`] on, vertices turn counter-clockwise as displayed.
pub(crate) const COUNTER_CLOCKWISE: u8 = 3;

/// Orders of a triangle's vertices as corners: of one that turns clockwise, starting with vertex 0, 1 or 2, and of one that
/// turns counter-clockwise, starting with vertex 0, 1 or 2.
pub(crate) const ORDERS: [[u8; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [1, 0, 2], [2, 1, 0]];

/// Twice the signed area, in squared subpixels: positive when the vertices turn clockwise as displayed, y down.
#[inline(always)]
pub(crate) fn signed_area2(a: ProjectedVertex, b: ProjectedVertex, c: ProjectedVertex) -> i64 {
    let from_a =
        |v: ProjectedVertex| (i64::from(v.x().wrapping_sub(a.x())), i64::from(v.y().wrapping_sub(a.y())));
    let ((bx, by), (cx, cy)) = (from_a(b), from_a(c));
    bx * cy - by * cx
}

/// The first pixel whose sample lies at or after a coordinate in subpixels.
#[inline(always)]
pub(crate) fn first_sample(subpixel: i32) -> i32 {
    (subpixel + (SUBPIXELS / 2 - 1)) >> 8
}

/// The pixels whose samples lie inside the bounding box of three vertices, right and bottom borders excluded: there the
/// fill rule covers nothing.
#[inline(always)]
pub(crate) fn sample_bounds(a: ProjectedVertex, b: ProjectedVertex, c: ProjectedVertex) -> Borders {
    let min = |a: i32, b: i32, c: i32| first_sample(a.min(b).min(c));
    let max = |a: i32, b: i32, c: i32| first_sample(a.max(b).max(c));
    Borders {
        left: min(a.x(), b.x(), c.x()),
        top: min(a.y(), b.y(), c.y()),
        right: max(a.x(), b.x(), c.x()),
        bottom: max(a.y(), b.y(), c.y()),
    }
}

impl Setup {
    /// None at all.
    pub(crate) const BLANK: Self = Self { place: 0, corners: [ProjectedVertex::BLANK; 3], area2: 1 };

    /// Sets up a triangle. `None` when it has no area on the subpixel grid, or when a vertex has to be clipped first.
    #[must_use]
    pub fn new(vertices: [ProjectedVertex; 3]) -> Option<Self> {
        let [a, b, c] = vertices;
        if vertices.iter().any(|vertex| vertex.is_outside()) {
            return None;
        }
        let area2 = signed_area2(a, b, c);
        (area2 != 0).then(|| Self::with_area2(vertices, area2))
    }

    /// Sets up a triangle whose area is known and not zero.
    #[inline(always)]
    pub(crate) fn with_area2([a, b, c]: [ProjectedVertex; 3], area2: i64) -> Self {
        // Vertices in clockwise order, each with the place of the order that starts with it.
        let [(a, from_a), (b, from_b), (c, from_c)] =
            if area2 < 0 { [(a, 3), (c, 5), (b, 4)] } else { [(a, 0), (b, 1), (c, 2)] };
        // Higher, or as high and farther left.
        let rank = |v: ProjectedVertex| (i64::from(v.y()) << 32) + i64::from(v.x());
        let (ra, rb, rc) = (rank(a), rank(b), rank(c));
        let (place, corners) = if ra <= rb && ra <= rc {
            (from_a, [a, b, c])
        } else if rb < rc {
            (from_b, [b, c, a])
        } else {
            (from_c, [c, a, b])
        };
        Self { place, corners, area2: area2.abs() }
    }

    /// The setup whose [`corners`](Self::corners) these are, the caller's vertices in the order of this place in
    /// [`ORDERS`].
    #[inline(always)]
    pub(crate) fn of_corners(corners: [ProjectedVertex; 3], place: u8) -> Self {
        let [a, b, c] = corners;
        Self { place: usize::from(place), corners, area2: signed_area2(a, b, c) }
    }

    /// The place in [`ORDERS`] of its order.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "0 to 5")]
    pub(crate) fn place(&self) -> u8 {
        self.place as u8
    }

    /// Its vertices in canonical order: clockwise as displayed, the topmost first.
    #[inline(always)]
    #[must_use]
    pub fn corners(&self) -> [ProjectedVertex; 3] {
        self.corners
    }

    /// Which of the three vertices given to [`Setup::new`] each corner is.
    #[inline(always)]
    #[must_use]
    pub fn order(&self) -> [u8; 3] {
        ORDERS.get(self.place).copied().unwrap_or_default()
    }

    /// Twice its area in squared subpixels, at least 1.
    #[inline(always)]
    #[must_use]
    pub fn area2(&self) -> i64 {
        self.area2
    }

    /// Whether its vertices, in the order given, turn counter-clockwise as displayed.
    #[inline(always)]
    #[must_use]
    pub fn is_counter_clockwise(&self) -> bool {
        self.place >= usize::from(COUNTER_CLOCKWISE)
    }

    /// The pixels that it may cover: those whose samples lie in its bounding box.
    #[inline(always)]
    #[must_use]
    pub fn bounds(&self) -> Rect {
        let [a, b, c] = self.corners;
        let Borders { left, top, right, bottom } = sample_bounds(a, b, c);
        Rect::from_edges(left, top, right, bottom)
    }

    /// The same by their borders. The first corner is the topmost.
    #[inline(always)]
    pub(crate) fn borders(&self) -> Borders {
        let [a, b, c] = self.corners;
        Borders { top: first_sample(a.y()), ..sample_bounds(a, b, c) }
    }

    /// The larger of its width and height, in subpixels.
    #[inline(always)]
    pub(crate) fn extent(&self) -> u32 {
        let [a, b, c] = each(self.corners, |v| [v.x(), v.y()]);
        let size = |low: i32, high: i32| high.wrapping_sub(low) as u32;
        let width = size(a[0].min(b[0]).min(c[0]), a[0].max(b[0]).max(c[0]));
        // The first corner is the topmost. (Of positions that are asked for again and are others, it need not be. Then the height is
        // too little, or wraps to a huge one; what is drawn is not specified, but stays within the area.)
        width.max(size(a[1], b[1].max(c[1])))
    }

    /// Its edge functions; edge `i` lies opposite corner `i`, so that barycentric `i` is `edges[i] / area2`.
    #[inline(always)]
    #[must_use]
    pub fn edges(&self) -> [EdgeFunction; 3] {
        EdgeFunction::of_corners(each(self.corners, |v| [v.x(), v.y()]))
    }

    /// How much of `rect` it covers, decided exactly by its edges at the corner samples.
    ///
    /// `None` and `Full` are certain. `Partial` may be wrong in one way: a rectangle beside a sharp corner may hold no covered
    /// sample. (Pixels beyond [`EXTENT`](crate::EXTENT) are never covered.)
    ///
    /// ```
    /// # use halfplane::{Coverage, ProjectedVertex, Rect, Setup};
    /// # let vertex = |x, y| ProjectedVertex::new(x * 256, y * 256, 0.5, 1.0).unwrap();
    /// let triangle = Setup::new([vertex(0, 0), vertex(0, 64), vertex(64, 0)]).unwrap();
    /// let block = |x, y| triangle.coverage(Rect { x, y, width: 8, height: 8 });
    /// assert_eq!((block(0, 0), block(32, 24), block(40, 40)), (Coverage::Full, Coverage::Partial, Coverage::None));
    /// ```
    #[must_use]
    pub fn coverage(&self, rect: Rect) -> Coverage {
        let (whole, rect) = (rect, rect.intersection(crate::target::DOMAIN));
        if rect.is_empty() || rect.intersection(self.bounds()).is_empty() {
            return Coverage::None;
        }
        let edges = self.edges();
        if edges.iter().any(|edge| edge.excludes(rect)) {
            Coverage::None
        } else if rect == whole && edges.iter().all(|edge| edge.includes(rect)) {
            Coverage::Full
        } else {
            Coverage::Partial
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vertex(x: i32, y: i32) -> ProjectedVertex {
        ProjectedVertex::new(x, y, 0.5, 1.0).expect("in range")
    }

    #[test]
    fn what_lies_beyond_the_domain_is_not_covered() {
        let [low, high] = [-16_384, 16_384].map(|pixel| pixel * 256);
        let setup = Setup::new([vertex(low, low), vertex(high, low), vertex(low, high)]).expect("an area");
        let of = |x, width| setup.coverage(Rect { x, y: -16_384, width, height: 10 });
        assert_eq!(
            [of(-16_384, 20), of(-16_394, 20), of(-16_394, 10)],
            [Coverage::Full, Coverage::Partial, Coverage::None],
            "within, half, outside"
        );
    }

    #[test]
    fn every_order_of_vertices_has_the_same_corners() {
        let triangles =
            [[[0, 0], [500, 100], [200, 700]], [[0, 0], [256, 0], [0, 256]], [[9, 9], [0, 9], [5, -9]]];
        for points in triangles {
            let [a, b, c] = points.map(|[x, y]| vertex(x, y));
            let expected = Setup::new([a, b, c]).expect("it has an area");
            for (permuted, flips) in [
                ([b, c, a], false),
                ([c, a, b], false),
                ([a, c, b], true),
                ([c, b, a], true),
                ([b, a, c], true),
            ] {
                let setup = Setup::new(permuted).expect("it has an area");
                assert_eq!(setup.corners(), expected.corners(), "{points:?}");
                assert_eq!(
                    setup.is_counter_clockwise() != expected.is_counter_clockwise(),
                    flips,
                    "{points:?}"
                );
                let again = Setup::of_corners(setup.corners(), setup.place());
                let all = |setup: Setup| (setup.order(), setup.area2(), setup.is_counter_clockwise());
                assert_eq!(all(again), all(setup), "from corners");
                let named = setup.order().map(|i| permuted[usize::from(i)]);
                assert_eq!(named, setup.corners(), "order names the caller's vertices");
            }
        }
    }

    #[test]
    fn canonical_edges_have_known_sides() {
        for points in
            [[[0, 0], [500, 100], [200, 700]], [[0, 0], [256, 0], [0, 256]], [[3, 0], [0, 9], [-7, 9]]]
        {
            let setup = Setup::new(points.map(|[x, y]| vertex(x, y))).expect("it has an area");
            let [_, left, right] = setup.edges();
            assert!(left.slope()[0] > 0, "2 → 0 goes up: {points:?}");
            assert!(right.slope()[0] <= 0, "0 → 1 goes down or exactly right: {points:?}");
        }
    }

    #[test]
    fn no_area_is_no_triangle() {
        assert!(Setup::new([vertex(0, 0), vertex(10, 10), vertex(20, 20)]).is_none(), "a line");
        assert!(Setup::new([vertex(5, 5); 3]).is_none(), "a point");
    }
}
