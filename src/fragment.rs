//! Fragments: covered samples that passed the depth test, about to be shaded.
//!
//! Along a row, edge functions are E + a·dx with dx counted from the span's anchor, and everything a shader may ask is a
//! formula of them. A fragment only carries what these formulas start from; what is not asked for costs nothing.

use crate::interpolate::{Varyings, Weights};
use crate::setup::Setup;
use crate::traverse::Span;

/// What all fragments of a triangle share.
#[derive(Clone, Debug)]
pub(crate) struct Shading<V> {
    /// At the corners, in canonical order.
    varyings: [V; 3],
    inv_w: [f32; 3],
    /// Change of each edge function by a pixel right and down.
    step_x: [f32; 3],
    step_y: [f32; 3],
    inv_area2: f32,
    provoking: u8,
    is_front_facing: bool,
    primitive: u32,
    /// The weights of each corner over the caller's three vertices.
    corners: [[f32; 3]; 3],
    /// The w of the caller's vertices, if the triangle is a piece of a clipped one.
    clipped: Option<[f32; 3]>,
}

/// Who a triangle is, apart from its geometry.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Identity {
    /// Which of the vertices given to setup is the provoking one.
    pub(crate) provoking: u8,
    pub(crate) is_front_facing: bool,
    pub(crate) primitive: u32,
}

/// How the vertices given to setup came about by clipping.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pedigree {
    /// Their weights over the caller's three vertices.
    pub(crate) weights: [[f32; 3]; 3],
    /// The w of the caller's vertices.
    pub(crate) w: [f32; 3],
}

/// Element `order[i]` for each i.
#[inline(always)]
pub(crate) fn reorder<T: Copy>([a, b, c]: [T; 3], order: [u8; 3]) -> [T; 3] {
    order.map(|i| match i {
        0 => a,
        1 => b,
        _ => c,
    })
}

impl<V: Varyings> Shading<V> {
    #[inline(always)]
    pub(crate) fn new(
        setup: &Setup,
        varyings: [V; 3],
        identity: Identity,
        pedigree: Option<Pedigree>,
    ) -> Self {
        const VERTICES: [[f32; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let order = setup.order();
        let slopes = setup.edges().map(|edge| edge.slope());
        let provoking = match order {
            [p, _, _] if p == identity.provoking => 0,
            [_, p, _] if p == identity.provoking => 1,
            _ => 2,
        };
        Self {
            varyings: reorder(varyings, order),
            inv_w: setup.corners().map(|corner| corner.inv_w()),
            step_x: slopes.map(|[a, _]| a as f32 * 256.0),
            step_y: slopes.map(|[_, b]| b as f32 * 256.0),
            inv_area2: 1.0 / setup.area2() as f32,
            provoking,
            is_front_facing: identity.is_front_facing,
            primitive: identity.primitive,
            corners: reorder(pedigree.map_or(VERTICES, |pedigree| pedigree.weights), order),
            clipped: pedigree.map(|pedigree| pedigree.w),
        }
    }

    /// Weights over the caller's vertices of a point with these weights over the corners.
    #[inline(always)]
    fn over_vertices(&self, [a, b, c]: [f32; 3]) -> [f32; 3] {
        // Unless the triangle was clipped this is a permutation, and exact.
        let [p, q, r] = self.corners;
        [0, 1, 2].map(|i| a * p[i] + b * q[i] + c * r[i])
    }
}

/// A covered sample that passed the depth test: what the fragment closure gets.
///
/// Everything is computed when it is asked for. Numbers are the same bits however the frame is cut into tiles, and on
/// every target.
///
/// # Examples
/// ```
/// use glam::{Vec3, Vec4};
/// use halfplane::{Primitives, Rasterizer, Surface, Viewport, pack_rgba8};
/// # let mut pixels = [0u32; 64 * 64];
/// # let mut target = Surface::color_only(&mut pixels, 64, 64)?;
/// # let positions = [Vec4::new(-1.0, -1.0, 0.5, 1.0), Vec4::new(1.0, -1.0, 0.5, 1.0), Vec4::new(0.0, 1.0, 0.5, 1.0)];
/// let rasterizer = Rasterizer::<Vec3>::new(Viewport::of_size(64, 64)?);
/// let colors = [Vec3::X, Vec3::Y, Vec3::Z];
/// rasterizer.draw(&mut target, Primitives::list(), &positions, &colors, |fragment| {
///     assert!((fragment.weights().iter().sum::<f32>() - 1.0).abs() < 1e-6);
///     pack_rgba8(fragment.varyings().extend(1.0))
/// })?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Fragment<'a, V> {
    triangle: &'a Shading<V>,
    edges: [f32; 3],
    dx: f32,
    x: i32,
    y: i32,
    depth: f32,
}

impl<'a, V: Varyings> Fragment<'a, V> {
    /// The fragment `offset` columns right of the span's anchor.
    #[inline(always)]
    pub(crate) fn new(triangle: &'a Shading<V>, span: &Span, offset: i32, depth: f32) -> Self {
        let x = span.anchor().wrapping_add(offset);
        Self { triangle, edges: span.edges(), dx: offset as f32, x, y: span.y(), depth }
    }

    /// Its column. The sample lies at x + ½.
    #[inline(always)]
    #[must_use]
    pub fn x(&self) -> i32 {
        self.x
    }

    /// Its row, counted downwards. The sample lies at y + ½.
    #[inline(always)]
    #[must_use]
    pub fn y(&self) -> i32 {
        self.y
    }

    /// Its depth, biased and clamped to the viewport's depth range, before it is converted to the depth format.
    #[inline(always)]
    #[must_use]
    pub fn depth(&self) -> f32 {
        self.depth
    }

    /// Whether the triangle shows its front: see [`FrontFace`](crate::FrontFace).
    #[inline(always)]
    #[must_use]
    pub fn is_front_facing(&self) -> bool {
        self.triangle.is_front_facing
    }

    /// The number of its triangle in the draw, counted from 0. Triangles that were culled or skipped count too.
    #[inline(always)]
    #[must_use]
    pub fn primitive_index(&self) -> u32 {
        self.triangle.primitive
    }

    /// E · 1/w of corners 0 and 1, and the sum of all three: perspective weights before the division.
    #[inline(always)]
    fn homogeneous(&self) -> ([f32; 2], f32) {
        let Shading { inv_w, step_x, .. } = *self.triangle;
        let [p, q, r] = [0, 1, 2].map(|i| self.edges[i] * inv_w[i]);
        let [dp, dq, dr] = [0, 1, 2].map(|i| step_x[i] * inv_w[i]);
        ([p + dp * self.dx, q + dq * self.dx], (p + q + r) + (dp + dq + dr) * self.dx)
    }

    /// Perspective weights of corners 0 and 1.
    #[inline(always)]
    fn perspective(&self) -> [f32; 2] {
        let ([p, q], sum) = self.homogeneous();
        let inv_sum = 1.0 / sum;
        [p * inv_sum, q * inv_sum]
    }

    /// Screen-linear weights of corners 0 and 1.
    #[inline(always)]
    fn linear(&self) -> [f32; 2] {
        let Shading { step_x, inv_area2, .. } = *self.triangle;
        [0, 1].map(|i| self.edges[i] * inv_area2 + step_x[i] * inv_area2 * self.dx)
    }

    /// 1/w here, linear on the screen.
    #[inline(always)]
    #[must_use]
    pub fn inv_w(&self) -> f32 {
        self.homogeneous().1 * self.triangle.inv_area2
    }

    /// Perspective-correct weights α, β, γ of the triangle's three vertices, in the caller's order.
    ///
    /// α = (α'/w_a) / (α'/w_a + β'/w_b + γ'/w_c). They sum to 1 and lie in 0 ..= 1, both to within 2⁻²⁰, for any
    /// triangle and any w. Of a clipped triangle they are those of the whole.
    #[inline(always)]
    #[must_use]
    pub fn weights(&self) -> [f32; 3] {
        let [a, b] = self.perspective();
        self.triangle.over_vertices([a, b, 1.0 - a - b])
    }

    /// Barycentrics α', β', γ', linear on the screen, of the triangle's three vertices, in the caller's order.
    ///
    /// They sum to 1 and lie in 0 ..= 1, both to within 2⁻²⁰, unless a vertex lies behind the eye (w < 0): then they are
    /// those of the whole triangle's plane, and anything.
    #[inline(always)]
    #[must_use]
    pub fn barycentrics(&self) -> [f32; 3] {
        match self.triangle.clipped {
            None => {
                let [a, b] = self.linear();
                self.triangle.over_vertices([a, b, 1.0 - a - b])
            }
            Some(w) => {
                // α' = α w_a / w: the weights' formula, solved for α'.
                let (weights, inv_w) = (self.weights(), self.inv_w());
                [0, 1, 2].map(|i| weights[i] * w[i] * inv_w)
            }
        }
    }

    /// The interpolated value.
    #[inline(always)]
    #[must_use]
    pub fn varyings(&self) -> V {
        let weights = Weights::with_sum(self.perspective(), self.linear(), 1.0, self.triangle.provoking);
        V::interpolate(&self.triangle.varyings, &weights)
    }

    /// The value's change from here to the right, a pixel: ∂/∂x of every smooth and noperspective part, exact at this
    /// sample and not a difference of neighbours. [`Flat`](crate::Flat) parts keep their value.
    ///
    /// ```text
    ///   ∂α/∂x = (∂p/∂x − α ∂s/∂x) / s      p = α'/w_a,  s = p + q + r
    /// ```
    #[inline(always)]
    #[must_use]
    pub fn varyings_dx(&self) -> V {
        self.derivative(self.triangle.step_x)
    }

    /// The value's change downwards, a pixel: ∂/∂y. See [`varyings_dx`](Self::varyings_dx).
    #[inline(always)]
    #[must_use]
    pub fn varyings_dy(&self) -> V {
        self.derivative(self.triangle.step_y)
    }

    #[inline(always)]
    fn derivative(&self, step: [f32; 3]) -> V {
        let Shading { inv_w, inv_area2, provoking, .. } = *self.triangle;
        let ([p, q], sum) = self.homogeneous();
        let inv_sum = 1.0 / sum;
        let [dp, dq, dr] = [0, 1, 2].map(|i| step[i] * inv_w[i]);
        let dsum = dp + dq + dr;
        let perspective = [(dp - p * inv_sum * dsum) * inv_sum, (dq - q * inv_sum * dsum) * inv_sum];
        let linear = [step[0] * inv_area2, step[1] * inv_area2];
        V::interpolate(&self.triangle.varyings, &Weights::with_sum(perspective, linear, 0.0, provoking))
    }
}
