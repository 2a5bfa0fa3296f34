//! Edge functions and the fill rule.
//!
//! An edge function is zero on the line through two vertices, positive on the triangle's side of it and negative on the
//! other (Pineda 1988). Three of them decide which samples a triangle covers; the same three integers, divided by twice
//! the area, are its barycentric coordinates.

use crate::project::SUBPIXELS;
use crate::target::Rect;

/// Signed area of the parallelogram spanned by an edge and a sample, in squared subpixels.
///
/// ```text
///   p ──────► q        E(s) = (q.x − p.x)(s.y − p.y) − (q.y − p.y)(s.x − p.x)
///       + inside       E > 0 to the right of p → q, because y points down
/// ```
///
/// * **Space**: framebuffer, y down; 24.8 fixed point; the sample of pixel (x, y) sits at (x + ½, y + ½).
/// * **Range**: |coordinate| ≤ 2²², so |E| ≤ 2⁴⁷ inside ±2¹⁴ pixels: exact in `i64`, never rounded.
/// * **Ties**: E = 0 is covered on top and left edges and not on others (Direct3D 11.3 functional specification
///   §3.4.2.1). A left edge goes up; a top edge goes exactly right.
///
/// # Examples
/// ```
/// use halfplane::{EdgeFunction, SUBPIXELS};
/// // Down the column of samples of pixel 1: a right edge, so the samples on it are outside.
/// let x = SUBPIXELS + SUBPIXELS / 2;
/// let edge = EdgeFunction::new([x, 0], [x, 10 * SUBPIXELS]);
/// assert_eq!(edge.at(1, 4), 0);
/// assert!(edge.covers(0, 4) && !edge.covers(1, 4));
/// // The neighbour's edge is the same line upwards: a left edge, and it takes them.
/// assert!(EdgeFunction::new([x, 10 * SUBPIXELS], [x, 0]).covers(1, 4));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EdgeFunction {
    /// Change of E by one subpixel to the right: p.y − q.y.
    a: i32,
    /// Change of E by one subpixel down: q.x − p.x.
    b: i32,
    /// E at the sample of pixel (0, 0).
    c: i64,
}

impl EdgeFunction {
    /// The edge from `p` to `q`, both in subpixels of at most 2²² in magnitude.
    #[inline(always)]
    #[must_use]
    pub const fn new(p: [i32; 2], q: [i32; 2]) -> Self {
        let (a, b) = (p[1].wrapping_sub(q[1]), q[0].wrapping_sub(p[0]));
        let half = SUBPIXELS as i64 / 2;
        let c = (a as i64) * (half - p[0] as i64) + (b as i64) * (half - p[1] as i64);
        Self { a, b, c }
    }

    /// Those of a triangle with these corners; edge `i` lies opposite corner `i`.
    #[inline(always)]
    pub(crate) const fn of_corners([a, b, c]: [[i32; 2]; 3]) -> [Self; 3] {
        [Self::new(b, c), Self::new(c, a), Self::new(a, b)]
    }

    /// Change of E from a sample to its right neighbour.
    #[inline(always)]
    #[must_use]
    pub const fn step_x(self) -> i64 {
        self.a as i64 * SUBPIXELS as i64
    }

    /// Change of E from a sample to the one below.
    #[inline(always)]
    #[must_use]
    pub const fn step_y(self) -> i64 {
        self.b as i64 * SUBPIXELS as i64
    }

    /// Change of E by one *subpixel* to the right and down.
    #[inline(always)]
    #[must_use]
    pub const fn slope(self) -> [i32; 2] {
        [self.a, self.b]
    }

    /// E at the sample of pixel (x, y).
    #[inline(always)]
    #[must_use]
    pub const fn at(self, x: i32, y: i32) -> i64 {
        self.c + self.step_x() * x as i64 + self.step_y() * y as i64
    }

    /// Whether it is a top or a left edge, whose own samples are covered.
    #[inline(always)]
    #[must_use]
    pub const fn is_top_left(self) -> bool {
        self.a > 0 || (self.a == 0 && self.b > 0)
    }

    /// What to add to E so that "covered" is E ≥ 0 for every edge: −1 turns it into E > 0, because E is an integer.
    #[inline(always)]
    #[must_use]
    pub const fn bias(self) -> i64 {
        if self.is_top_left() { 0 } else { -1 }
    }

    /// Whether the sample of pixel (x, y) lies on the triangle's side.
    #[inline(always)]
    #[must_use]
    pub const fn covers(self, x: i32, y: i32) -> bool {
        self.at(x, y) + self.bias() >= 0
    }

    /// Whether no sample of a rectangle, which is not empty, is covered. E is linear, so it is enough to ask the corner sample where it
    /// is largest.
    #[inline(always)]
    pub(crate) fn excludes(self, rect: Rect) -> bool {
        let x = if self.a >= 0 { rect.right() - 1 } else { rect.x };
        let y = if self.b >= 0 { rect.bottom() - 1 } else { rect.y };
        !self.covers(x, y)
    }

    /// Whether they all lie on the triangle's side.
    pub(crate) fn includes(self, rect: Rect) -> bool {
        let x = if self.a >= 0 { rect.x } else { rect.right() - 1 };
        let y = if self.b >= 0 { rect.y } else { rect.bottom() - 1 };
        self.covers(x, y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_two_sides_of_an_edge_share_out_its_samples() {
        for q in [[2048, 0], [0, 2048], [2048, 2048], [2048, -2048], [-2048, 256], [512, -2048]] {
            let p = [128, 128];
            let q = [p[0] + q[0], p[1] + q[1]];
            let (one, other) = (EdgeFunction::new(p, q), EdgeFunction::new(q, p));
            for y in -10..10 {
                for x in -10..10 {
                    assert_eq!(one.at(x, y), -other.at(x, y), "{q:?} at {x} {y}");
                    assert_ne!(one.covers(x, y), other.covers(x, y), "{q:?} at {x} {y}");
                }
            }
        }
    }

    #[test]
    fn the_largest_edge_does_not_overflow() {
        let m = 1 << 22;
        let edge = EdgeFunction::new([-m, m], [m, -m]);
        assert_eq!(edge.at(1 << 14, 1 << 14) - edge.at(-(1 << 14), 1 << 14), edge.step_x() << 15, "linear");
    }
}
