//! Depth over the screen: a plane through a triangle's three corners.

use glam::Vec4;

use crate::depth::{DepthBias, DepthFormat, clamp};
use crate::fragment::to_f32;
use crate::project::DEPTH_MAX;
use crate::setup::Setup;
use crate::traverse::HAS_FLOAT_LANES;
use crate::triple::each;

/// A triangle's depth: linear on the screen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DepthPlane {
    /// At corner 2; and what corners 0 and 1 have more, each divided by twice the area.
    z: f32,
    more: [f32; 2],
    low: f32,
    high: f32,
}

impl DepthPlane {
    #[inline(always)]
    pub(crate) fn new<D: DepthFormat>(
        setup: &Setup,
        bias: Option<DepthBias>,
        (low, high): (f32, f32),
    ) -> Self {
        let [p, q, r] = each(setup.corners(), |corner| corner.depth());
        let inv_area2 = 1.0 / to_f32(setup.area2());
        let more = [(p - r) * inv_area2, (q - r) * inv_area2];
        let mut z = r;
        if let Some(bias) = bias {
            let (dx, dy) = (step(setup, more, |[a, _]| a).abs(), step(setup, more, |[_, b]| b).abs());
            let larger = |a: f32, b: f32| if a > b { a } else { b };
            z += bias.of(larger(dx, dy), D::resolution(larger(larger(p, q), r)));
            // A bias may be infinite or no number. Without this, so would be depths, which not all SIMD clamps alike.
            z = clamp(z, -DEPTH_MAX, DEPTH_MAX);
        }
        // Nor do they agree on −0: neither this nor a sum that starts with it is.
        z += 0.0;
        Self { z, more, low, high }
    }

    /// What depths are made of mapped, number by number. Its limits stay.
    #[inline(always)]
    pub(crate) fn map(self, f: fn(f32) -> f32) -> Self {
        Self { z: f(self.z), more: self.more.map(f), ..self }
    }

    /// Where the first two edge functions are these.
    #[inline(always)]
    pub(crate) fn at_edges(&self, e0: f32, e1: f32) -> f32 {
        self.z + e0 * self.more[0] + e1 * self.more[1]
    }

    /// At a sample where the edge functions are these, inside the depth range.
    #[inline(always)]
    pub(crate) fn at_sample(&self, [e0, e1, _]: [f32; 3]) -> f32 {
        self.clamp(self.at_edges(e0, e1))
    }

    /// Change by a pixel to the right. Only triangles that are drawn in rows need it.
    #[inline(always)]
    pub(crate) fn step_x(&self, setup: &Setup) -> f32 {
        step(setup, self.more, |[a, _]| a)
    }

    /// The same for four samples at a time.
    #[inline(always)]
    pub(crate) fn in_lanes(&self) -> LanePlane {
        let [more_0, more_1] = self.more;
        LanePlane {
            z: Vec4::splat(self.z),
            more: [Vec4::splat(more_0), Vec4::splat(more_1)],
            low: Vec4::splat(self.low),
            high: Vec4::splat(self.high),
        }
    }

    /// Inside the depth range.
    #[inline(always)]
    pub(crate) fn clamp(&self, z: f32) -> f32 {
        // A comparison of integers is a third of two of floats where there is no SIMD.
        if !HAS_FLOAT_LANES && self.holds(z) { z } else { clamp(z, self.low, self.high) }
    }

    /// [`clamp`](Self::clamp) for four.
    #[inline(always)]
    fn clamp_four(&self, z: Vec4) -> Vec4 {
        z.max(Vec4::splat(self.low)).min(Vec4::splat(self.high))
    }

    /// Whether it is inside the depth range, whose limits are in order and neither is −0: see `Viewport::depth_limits`.
    ///
    /// Bits of floats from 0 on, as integers, are in the order of the floats; those of −0, of negative ones and of NaN come
    /// after.
    #[inline(always)]
    fn holds(&self, z: f32) -> bool {
        let low = self.low.to_bits();
        z.to_bits().wrapping_sub(low) <= self.high.to_bits().wrapping_sub(low)
    }
}

/// A depth that no sample of a triangle with these depths at its corners is nearer than, where nearer is less or where it is
/// greater: that of the nearest corner, and a margin.
///
/// All roundings on the way to a sample's depth, by steps along a row or not, add up to less than 20 · 2⁻²⁴ of the numbers that it
/// is made of: of the depth at one corner, and of two differences from there. Whichever that corner is, they are no more than
/// three times as large as from `a`; with the roundings here, less than the 64 · 2⁻²⁴ that are taken. Where these underflow, their errors of 2⁻¹⁵⁰ are multiplied by edge functions
/// of up to 2²⁷, a few times: less than 2⁻¹²⁰ for triangles up to 32 pixels large.
#[inline(always)]
pub(crate) fn nearest([a, b, c]: [f32; 3], is_less: bool, (low, high): (f32, f32)) -> f32 {
    let (b, c) = (b - a, c - a);
    let margin = (a.abs() + b.abs() + c.abs()) * (1.0 / (1 << 18) as f32) + 64.0 * f32::MIN_POSITIVE;
    let least = |a: f32, b: f32| if a < b { a } else { b };
    let z =
        if is_less { a + least(least(b, c), 0.0) - margin } else { a - least(least(-b, -c), 0.0) + margin };
    clamp(z, low, high)
}

/// A triangle's depth at four samples at a time. (Made once for each triangle: from a plane in memory, which the depths that
/// are written might be part of for all that a compiler knows, it would be made again for each row.)
#[derive(Clone, Copy, Debug)]
pub(crate) struct LanePlane {
    z: Vec4,
    more: [Vec4; 2],
    low: Vec4,
    high: Vec4,
}

impl LanePlane {
    /// Where the first two edge functions are these, inside the depth range.
    #[inline(always)]
    pub(crate) fn at(&self, [e0, e1]: [Vec4; 2]) -> Vec4 {
        (self.z + e0 * self.more[0] + e1 * self.more[1]).max(self.low).min(self.high)
    }
}

/// Change of depth by a pixel to the right, or down, of a triangle where it changes by this with edges 0 and 1. (An axis by
/// its number would be an index, and might panic: not all opt-levels see that it does not.)
#[inline(always)]
fn step(setup: &Setup, more: [f32; 2], along: impl Fn([i32; 2]) -> i32) -> f32 {
    let [e0, e1, _] = each(setup.edges(), |edge| along(edge.slope()) as f32 * 256.0);
    e0 * more[0] + e1 * more[1]
}

/// The depth of a triangle that is drawn in rows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RowPlane<'a> {
    plane: &'a DepthPlane,
    step_x: f32,
}

impl<'a> RowPlane<'a> {
    /// A plane, and its [change](DepthPlane::step_x) along a row.
    #[inline(always)]
    pub(crate) fn new(plane: &'a DepthPlane, step_x: f32) -> Self {
        Self { plane, step_x }
    }

    /// Where the first two edge functions are these.
    #[inline(always)]
    pub(crate) fn at_edges(self, e0: f32, e1: f32) -> f32 {
        self.plane.at_edges(e0, e1)
    }

    /// At a sample where the edge functions are these, inside the depth range.
    #[inline(always)]
    pub(crate) fn at_sample(self, edges: [f32; 3]) -> f32 {
        self.plane.at_sample(edges)
    }

    /// Change by a pixel to the right.
    #[inline(always)]
    pub(crate) fn step_x(self) -> f32 {
        self.step_x
    }

    /// Whether it is inside the depth range `dx` columns right of where it is `z`. Depth is monotonic along a row,
    /// roundings and all: where both ends are inside, all between them are.
    #[inline(always)]
    pub(crate) fn contains(self, z: f32, dx: f32) -> bool {
        self.plane.holds(z + self.step_x * dx)
    }

    /// `dx` columns right of where it is `z`, inside the depth range.
    #[inline(always)]
    pub(crate) fn moved(self, z: f32, dx: f32) -> f32 {
        self.plane.clamp(z + self.step_x * dx)
    }

    /// [`moved`](Self::moved), or without a clamp where none is needed: see [`contains`](Self::contains).
    #[inline(always)]
    pub(crate) fn moved_within<const CLAMPS: bool>(self, z: f32, dx: f32) -> f32 {
        let z = z + self.step_x * dx;
        if CLAMPS { self.plane.clamp(z) } else { z }
    }

    /// [`moved`](Self::moved) for four.
    #[inline(always)]
    pub(crate) fn moved_four(self, z: f32, dx: Vec4) -> Vec4 {
        self.plane.clamp_four(Vec4::splat(z) + dx * self.step_x)
    }
}
