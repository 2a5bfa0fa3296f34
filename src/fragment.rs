//! Fragments: covered samples that passed the depth test, about to be shaded.
//!
//! Everything that a shader may ask is a formula of the edge functions at the sample. A fragment carries what these formulas
//! start from, and the one step that they share, the perspective division. What is not asked for costs nothing once the closure
//! is inlined. Where there is SIMD, the division is done where packets are filled: in the shading loop all else would wait for
//! it, and fill the room that a processor has for waiting steps.

use core::hint::black_box;

use crate::edge::EdgeFunction;
use crate::interpolate::{Varyings, Weights};
use crate::setup::Setup;
use crate::traverse::HAS_FLOAT_LANES;
use crate::triple::each;

/// What all fragments of a triangle share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shading<'a, V> {
    /// At the corners, in canonical order.
    varyings: &'a [V; 3],
    /// Where the corners are.
    corners: [[i32; 2]; 3],
    pub(crate) scales: Scales,
    /// Which corner is the provoking one.
    provoking: u8,
    /// Which of the vertices given to setup each corner is.
    order: [u8; 3],
    is_front_facing: bool,
    primitive: u32,
    /// How these vertices came about, if the triangle is a piece of a clipped one.
    pedigree: Option<&'a Pedigree>,
}

/// What edge functions are multiplied by to become parts of weights.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scales {
    /// Of the corners.
    inv_w: [f32; 3],
    inv_area2: f32,
}

/// Who a triangle is, apart from its geometry.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Identity {
    /// Which of the vertices given to setup is the provoking one.
    pub(crate) provoking: u8,
    pub(crate) is_front_facing: bool,
    pub(crate) primitive: u32,
}

/// How the vertices given to setup came about by clipping: each one's weights over the caller's vertices.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pedigree {
    pub(crate) weights: [[f32; 3]; 3],
    pub(crate) barycentrics: [[f32; 3]; 3],
}

impl Pedigree {
    /// Of a triangle that was not clipped.
    const IDENTITY: Self = {
        let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        Self { weights: identity, barycentrics: identity }
    };
}

/// a p + b q + c r.
#[inline(always)]
fn mix([a, b, c]: [f32; 3], [p, q, r]: [[f32; 3]; 3]) -> [f32; 3] {
    [
        a * p[0] + b * q[0] + c * r[0], //
        a * p[1] + b * q[1] + c * r[1],
        a * p[2] + b * q[2] + c * r[2],
    ]
}

/// Element `order[i]` for each i.
#[inline(always)]
pub(crate) fn reorder<T: Copy>([a, b, c]: [T; 3], order: [u8; 3]) -> [T; 3] {
    each(order, |i| match i {
        0 => a,
        1 => b,
        _ => c,
    })
}

/// What weights are made of, at a sample. All are linear on the screen.
///
/// ```text
///   p = E0 / w0        sum = E0 / w0 + E1 / w1 + E2 / w2 = area2 / w        α = p / sum        l = E0 / area2
///   q = E1 / w1                                                           β = q / sum        m = E1 / area2
/// ```
/// with the edge functions E and w at the corners. (What [`Fragment::varyings_dx`] calls p, q and s are these, divided by `area2`.)
#[derive(Clone, Copy, Debug)]
pub(crate) struct WeightParts {
    /// E · 1/w of corners 0 and 1, and the sum of all three: perspective weights before the division.
    pub(crate) p: f32,
    pub(crate) q: f32,
    pub(crate) sum: f32,
    /// E / area of corners 0 and 1: screen-linear weights.
    pub(crate) l: f32,
    pub(crate) m: f32,
}

/// A sample's weights: [`WeightParts`], [divided](WeightParts::divided).
#[derive(Clone, Copy, Debug)]
pub(crate) struct SampleWeights {
    /// Perspective weights of corners 0 and 1.
    pub(crate) alpha: f32,
    pub(crate) beta: f32,
    /// What they were divided by, 1/w here times twice the area, and 1 / `sum`.
    pub(crate) sum: f32,
    pub(crate) inv_sum: f32,
    /// Screen-linear weights of corners 0 and 1.
    pub(crate) l: f32,
    pub(crate) m: f32,
}

/// `x as f32`, in a few instructions instead of forty where `i64` is emulated and `x` is small.
#[inline(always)]
pub(crate) fn to_f32(x: i64) -> f32 {
    match i32::try_from(x) {
        Ok(x) if !HAS_FLOAT_LANES => x as f32,
        _ => x as f32,
    }
}

/// Component by component.
#[inline(always)]
fn product(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] * b[0], a[1] * b[1], a[2] * b[2]]
}

impl WeightParts {
    /// Where nobody asks.
    pub(crate) const ZERO: Self = Self { p: 0.0, q: 0.0, sum: 0.0, l: 0.0, m: 0.0 };

    /// `dx` columns right of here.
    #[inline(always)]
    pub(crate) fn moved(self, step: Self, dx: f32) -> Self {
        Self {
            p: self.p + step.p * dx,
            q: self.q + step.q * dx,
            sum: self.sum + step.sum * dx,
            l: self.l + step.l * dx,
            m: self.m + step.m * dx,
        }
    }

    /// The weights that they make.
    #[inline(always)]
    pub(crate) fn divided(self) -> SampleWeights {
        let Self { p, q, sum, l, m } = self;
        let inv_sum = 1.0 / sum;
        SampleWeights { alpha: p * inv_sum, beta: q * inv_sum, sum, inv_sum, l, m }
    }
}

/// [`WeightParts::divided`] for several samples: α, β and 1 / sum, of p, q and sum.
#[inline(always)]
pub(crate) fn divided_lanes<const N: usize>([mut p, mut q, sum]: [[f32; N]; 3]) -> [[f32; N]; 3] {
    // One step at a time for all lanes.
    let inv_sum = sum.map(|sum| 1.0 / sum);
    for i in 0..N {
        p[i] *= inv_sum[i];
    }
    for i in 0..N {
        q[i] *= inv_sum[i];
    }
    [p, q, inv_sum]
}

impl Scales {
    /// Each number mapped.
    #[inline(always)]
    pub(crate) fn map(self, f: fn(f32) -> f32) -> Self {
        Self { inv_w: self.inv_w.map(f), inv_area2: f(self.inv_area2) }
    }

    /// What weights are made of where the edge functions are these; and, of their steps, its step.
    #[inline(always)]
    pub(crate) fn parts(&self, edges: [f32; 3]) -> WeightParts {
        let [p, q, r] = product(edges, self.inv_w);
        WeightParts { p, q, sum: p + q + r, l: edges[0] * self.inv_area2, m: edges[1] * self.inv_area2 }
    }

    /// [`parts`](Self::parts), [divided](WeightParts::divided), of several samples: α, β, sum, 1 / sum, l, m.
    #[inline(always)]
    pub(crate) fn weights_of<const N: usize>(&self, [a, b, c]: [[f32; N]; 3]) -> [[f32; N]; 6] {
        // One step at a time for all lanes: each becomes one operation or two.
        let times = |edge: [f32; N], factor: f32| edge.map(|value| value * factor);
        let [u, v, w] = self.inv_w;
        // Hidden from LLVM, which otherwise adds q + p in every second lane, not p + q (the same bits), and works edges 0 and 1 out
        // a second time for that.
        let b = black_box(b);
        let (p, q, mut sum) = (times(a, u), times(b, v), times(c, w));
        for i in 0..N {
            sum[i] += p[i] + q[i];
        }
        let [alpha, beta, inv_sum] = divided_lanes([p, q, sum]);
        [alpha, beta, sum, inv_sum, times(a, self.inv_area2), times(b, self.inv_area2)]
    }
}

impl<'a, V: Varyings> Shading<'a, V> {
    #[inline(always)]
    pub(crate) fn new(
        setup: &Setup,
        varyings: &'a [V; 3],
        identity: Identity,
        pedigree: Option<&'a Pedigree>,
    ) -> Self {
        let order = setup.order();
        let provoking = match order {
            [p, _, _] if p == identity.provoking => 0,
            [_, p, _] if p == identity.provoking => 1,
            _ => 2,
        };
        Self {
            varyings,
            corners: each(setup.corners(), |corner| [corner.x(), corner.y()]),
            scales: Scales {
                inv_w: each(setup.corners(), |corner| corner.inv_w()),
                inv_area2: 1.0 / to_f32(setup.area2()),
            },
            provoking,
            order,
            is_front_facing: identity.is_front_facing,
            primitive: identity.primitive,
            pedigree,
        }
    }

    /// The values at the corners.
    #[inline(always)]
    pub(crate) fn varyings(&self) -> &[V; 3] {
        self.varyings
    }

    /// The same with the values somewhere else.
    #[inline(always)]
    pub(crate) fn with_varyings<'b>(self, varyings: &'b [V; 3]) -> Shading<'b, V>
    where
        'a: 'b,
    {
        Shading { varyings, ..self }
    }

    /// Weights over the vertices given to setup, from those over the corners.
    #[inline(always)]
    fn over_vertices(&self, corners: [f32; 3]) -> [f32; 3] {
        // Each corner's number names its vertex; turn that around. By masks, not by branches: they become SIMD.
        let chosen = |vertex: u8| {
            let bits = |i: usize| if self.order[i] == vertex { corners[i].to_bits() } else { 0 };
            f32::from_bits(bits(0) | bits(1) | bits(2))
        };
        [chosen(0), chosen(1), chosen(2)]
    }

    /// Weights over the caller's vertices, from those over the corners.
    ///
    /// Where there is SIMD, those of a triangle that was not clipped are multiplied by 1 and 0, too: a branch in the
    /// shading loop would keep it from becoming SIMD. Elsewhere they are spared that, but for the sign of a zero.
    #[inline(always)]
    fn over_whole(&self, corners: [f32; 3], of: impl FnOnce(&Pedigree) -> &[[f32; 3]; 3]) -> [f32; 3] {
        let weights = self.over_vertices(corners);
        match self.pedigree {
            None if !HAS_FLOAT_LANES => each(weights, |weight| weight + 0.0),
            pedigree => mix(weights, *of(pedigree.unwrap_or(&Pedigree::IDENTITY))),
        }
    }

    /// The change of what weights are made of by a pixel to the right.
    #[inline(always)]
    pub(crate) fn step_x(&self) -> WeightParts {
        self.scales.parts(self.step(|[a, _]| a))
    }

    /// Change of each edge function by a pixel right, or down, of whose slopes that takes these. (Where nobody asks for it, it
    /// is not worked out.)
    #[inline(always)]
    fn step(&self, along: impl Fn([i32; 2]) -> i32) -> [f32; 3] {
        each(EdgeFunction::of_corners(self.corners), |edge| along(edge.slope()) as f32 * 256.0)
    }
}

/// A covered sample that passed the depth test: what the fragment closure gets.
///
/// Only what is asked for is computed, once the closure is inlined. Numbers are the same bits however the frame is cut into
/// tiles, and on every target. A function that takes one is written `fn shade(fragment: Fragment<'_, MyVaryings>) -> Color`.
/// Mark it `#[inline(always)]`: a function that is called can become no SIMD, and nothing can be left out for it.
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
    pub(crate) triangle: &'a Shading<'a, V>,
    pub(crate) at: SampleWeights,
    pub(crate) x: i32,
    pub(crate) y: i32,
    pub(crate) depth: f32,
}

impl<V: Varyings> Fragment<'_, V> {
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

    /// The number of its triangle in the draw, counted from 0 (modulo 2³²). Triangles that were culled or skipped count
    /// too. A mesh that is drawn in several draws starts at 0 in each: add what came before.
    #[inline(always)]
    #[must_use]
    pub fn primitive_index(&self) -> u32 {
        self.triangle.primitive
    }

    /// This one, or another of its triangle. Both are there, and a number that nobody asks for is not chosen.
    #[inline(always)]
    pub(crate) fn or(self, other: &Self, is_other: bool) -> Self {
        let either = |this: f32, other: f32| if is_other { other } else { this };
        let (this, that) = (self.at, other.at);
        let at = SampleWeights {
            alpha: either(this.alpha, that.alpha),
            beta: either(this.beta, that.beta),
            sum: either(this.sum, that.sum),
            inv_sum: either(this.inv_sum, that.inv_sum),
            l: either(this.l, that.l),
            m: either(this.m, that.m),
        };
        let (x, y) = if is_other { (other.x, other.y) } else { (self.x, self.y) };
        Self { at, x, y, depth: either(self.depth, other.depth), ..self }
    }

    /// Perspective weights of corners 0 and 1.
    #[inline(always)]
    fn perspective(&self) -> [f32; 2] {
        [self.at.alpha, self.at.beta]
    }

    /// Screen-linear weights of corners 0 and 1.
    #[inline(always)]
    fn linear(&self) -> [f32; 2] {
        [self.at.l, self.at.m]
    }

    /// 1/w here, linear on the screen.
    #[inline(always)]
    #[must_use]
    pub fn inv_w(&self) -> f32 {
        self.at.sum * self.triangle.scales.inv_area2
    }

    /// Perspective-correct weights α, β, γ of the triangle's three vertices, in the caller's order.
    ///
    /// `α = (α'/w_a) / (α'/w_a + β'/w_b + γ'/w_c)`. They sum to 1 and lie in 0 ..= 1, both to within 2⁻²⁰, for any
    /// triangle and any w. Of a clipped triangle they are those of the whole.
    #[inline(always)]
    #[must_use]
    pub fn weights(&self) -> [f32; 3] {
        let [a, b] = self.perspective();
        self.triangle.over_whole([a, b, 1.0 - a - b], |pedigree| &pedigree.weights)
    }

    /// Barycentrics α', β', γ', linear on the screen, of the triangle's three vertices, in the caller's order.
    ///
    /// They sum to 1 and lie in 0 ..= 1, both to within 2⁻²⁰, unless a vertex lies behind the eye (w < 0): then they are
    /// those of the whole triangle's plane, and anything.
    #[inline(always)]
    #[must_use]
    pub fn barycentrics(&self) -> [f32; 3] {
        let [a, b] = self.linear();
        self.triangle.over_whole([a, b, 1.0 - a - b], |pedigree| &pedigree.barycentrics)
    }

    /// The interpolated value.
    #[inline(always)]
    #[must_use]
    pub fn varyings(&self) -> V {
        let weights = Weights::of_value(self.perspective(), self.linear(), self.triangle.provoking);
        V::interpolate(self.triangle.varyings, &weights)
    }

    /// The value's change from here to the right, a pixel: ∂/∂x of every smooth and noperspective part, exact at this
    /// sample and not a difference of neighbours. [`Flat`](crate::Flat) parts keep their value. (Where w is 10³⁰, changes of less than
    /// 10⁻⁴ over a triangle underflow.)
    ///
    /// ```text
    ///   ∂v/∂x = ∂α/∂x v_a + ∂β/∂x v_b + ∂γ/∂x v_c      ∂α/∂x = (∂p/∂x − α ∂s/∂x) / s
    ///         = (∂n/∂x − v ∂s/∂x) / s                 n = p v_a + q v_b + r v_c
    ///
    ///   p = α'/w_a,  q = β'/w_b,  r = γ'/w_c  and their sum s, which is 1/w, are linear on the screen
    /// ```
    #[inline(always)]
    #[must_use]
    pub fn varyings_dx(&self) -> V {
        self.derivative(self.triangle.step(|[a, _]| a))
    }

    /// The value's change downwards, a pixel: ∂/∂y. See [`varyings_dx`](Self::varyings_dx).
    #[inline(always)]
    #[must_use]
    pub fn varyings_dy(&self) -> V {
        self.derivative(self.triangle.step(|[_, b]| b))
    }

    /// By the second form: n and s change by the same from pixel to pixel, all over the triangle.
    #[inline(always)]
    fn derivative(&self, step: [f32; 3]) -> V {
        let Shading { scales: Scales { inv_w, inv_area2 }, provoking, varyings, .. } = *self.triangle;
        // Over the area: else changes of values of 10³² would overflow.
        let step = each(step, |step| step * inv_area2);
        let [dp, dq, dr] = product(step, inv_w);
        let here = (self.perspective(), self.at.inv_sum * (1.0 / inv_area2));
        let weights = Weights::of_change(([dp, dq], dp + dq + dr), here, [step[0], step[1]], provoking);
        V::interpolate(varyings, &weights)
    }
}
