//! Projection: clip space to the subpixel grid, once for each vertex.
//!
//! A position is divided by w, mapped to the viewport and rounded to 1/256 pixel. From there on the triangle *is* the
//! one with the rounded corners: coverage is decided in integers, and every float is derived from them.

use core::array;

use glam::{Mat4, Vec4};

use crate::clip::{ClipVolume, DepthClip, GUARD_BAND, INVALID, W_MIN};
use crate::depth::clamp;
use crate::vertex::Attributes;
use crate::viewport::{ClipDepth, Viewport, ViewportTransform};

/// Subpixels in a pixel, along each axis: 24.8 fixed point.
pub const SUBPIXELS: i32 = 256;

/// A vertex in framebuffer coordinates: what [`Rasterizer::project`](crate::Rasterizer::project) makes of a clip-space
/// position. 16 bytes.
///
/// A vertex that lies outside of the guard band, before the near plane or behind the far one, or behind the eye has no
/// place on the subpixel grid. It remembers which, and triangles that use it are clipped first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ProjectedVertex {
    /// In subpixels; [`OUTSIDE`] for a vertex that has to be clipped away.
    x: i32,
    /// In subpixels, or the outcode.
    y: i32,
    /// Framebuffer depth.
    z: f32,
    /// 1/w.
    inv_w: f32,
}

const OUTSIDE: i32 = i32::MIN;

/// No depth is larger, so that no sum of depths overflows: 2⁴⁰, about 10¹².
pub(crate) const DEPTH_MAX: f32 = f32::from_bits((127 + 40) << 23);

impl ProjectedVertex {
    /// What to fill memory with before there is anything else. Its value does not matter.
    ///
    /// ```
    /// use halfplane::ProjectedVertex;
    /// static ROOM: [ProjectedVertex; 64] = [ProjectedVertex::BLANK; 64];
    /// # assert_eq!(ROOM[0], ProjectedVertex::default());
    /// ```
    pub const BLANK: Self = Self { x: 0, y: 0, z: 0.0, inv_w: 0.0 };

    /// A vertex at (x, y) in subpixels, with depth and 1/w, for those who project themselves.
    ///
    /// `None` when a coordinate lies outside of −16384 ..= 16384 pixels, `depth` outside of ±2⁴⁰ or `inv_w` outside of
    /// 2⁻¹²⁶ ..= 2⁶⁴.
    ///
    /// ```
    /// use halfplane::{ProjectedVertex, SUBPIXELS};
    /// let centre_of_pixel_3_2 = ProjectedVertex::new(7 * SUBPIXELS / 2, 5 * SUBPIXELS / 2, 0.5, 1.0);
    /// assert!(centre_of_pixel_3_2.is_some());
    /// ```
    #[must_use]
    pub fn new(x: i32, y: i32, depth: f32, inv_w: f32) -> Option<Self> {
        let limit = crate::target::EXTENT * SUBPIXELS;
        let is_valid = (-limit..=limit).contains(&x)
            && (-limit..=limit).contains(&y)
            && (-DEPTH_MAX..=DEPTH_MAX).contains(&depth)
            && (f32::MIN_POSITIVE..=1.0 / W_MIN).contains(&inv_w);
        is_valid.then_some(Self { x, y, z: depth, inv_w })
    }

    /// Where it is, in subpixels (1/256 pixel, y down); `None` when it has to be clipped.
    #[must_use]
    pub fn position_subpixel(self) -> Option<[i32; 2]> {
        (!self.is_outside()).then_some([self.x, self.y])
    }

    /// Its framebuffer depth. Means nothing when it has to be clipped.
    #[must_use]
    pub fn depth(self) -> f32 {
        self.z
    }

    /// 1 / w. Means nothing when it has to be clipped.
    #[must_use]
    pub fn inv_w(self) -> f32 {
        self.inv_w
    }

    /// Its bits, for records that hold either this or something else of 16 bytes.
    #[inline(always)]
    pub(crate) fn to_words(self) -> [u32; 4] {
        [self.x as u32, self.y as u32, self.z.to_bits(), self.inv_w.to_bits()]
    }

    #[inline(always)]
    pub(crate) fn from_words([x, y, z, inv_w]: [u32; 4]) -> Self {
        Self { x: x as i32, y: y as i32, z: f32::from_bits(z), inv_w: f32::from_bits(inv_w) }
    }

    #[inline(always)]
    pub(crate) fn is_outside(self) -> bool {
        self.x == OUTSIDE
    }

    #[inline(always)]
    pub(crate) fn x(self) -> i32 {
        self.x
    }

    #[inline(always)]
    pub(crate) fn y(self) -> i32 {
        self.y
    }

    /// x and y; [`OUTSIDE`] and the outcode of a vertex that has to be clipped away.
    #[inline(always)]
    pub(crate) fn xy(self) -> [i32; 2] {
        [self.x, self.y]
    }

    /// The planes that it lies outside of.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it was put there as a u8")]
    pub(crate) fn outcode(self) -> u8 {
        if self.is_outside() { self.y as u8 } else { 0 }
    }
}

/// 1.5 · 2²³: added to a number of at most 2²², it leaves the number's nearest integer in the low bits of the sum.
pub(crate) const ROUNDING: f32 = 12_582_912.0;

/// The nearest subpixel, to even in ties, of a coordinate in ±2¹⁴ pixels.
#[inline(always)]
pub(crate) fn snap(pixels: f32) -> i32 {
    round(pixels * SUBPIXELS as f32)
}

/// The nearest integer, to even in ties, of a number in ±2²². `as i32` would cost a range check a lane.
#[inline(always)]
pub(crate) fn round(x: f32) -> i32 {
    rounded_to(x + ROUNDING)
}

/// Which integer adding [`ROUNDING`] has rounded to.
#[inline(always)]
fn rounded_to(sum: f32) -> i32 {
    sum.to_bits().wrapping_sub(ROUNDING.to_bits()) as i32
}

/// The first components of four vectors, the second ones, and so on.
#[inline(always)]
fn transpose([a, b, c, d]: [Vec4; 4]) -> [Vec4; 4] {
    let Mat4 { x_axis, y_axis, z_axis, w_axis } = Mat4::from_cols(a, b, c, d).transpose();
    [x_axis, y_axis, z_axis, w_axis]
}

/// How many vertices are divided by w before the first of them is placed. From a position to the decision whether it lies
/// inside, each step waits for the one before: some eighty cycles, and a processor has room for three or four such chains. Cut
/// after the division they are shorter, and more of them fit. (16 or 32 at once gained less.)
const AT_ONCE: usize = 64;

/// Four positions in clip space, one in each lane, and 1/w.
#[derive(Clone, Copy, Debug)]
struct Four {
    x: Vec4,
    y: Vec4,
    z: Vec4,
    w: Vec4,
    inv_w: Vec4,
}

impl Four {
    const BLANK: Self =
        Self { x: Vec4::ZERO, y: Vec4::ZERO, z: Vec4::ZERO, w: Vec4::ZERO, inv_w: Vec4::ZERO };

    #[inline(always)]
    fn new(positions: [Vec4; 4]) -> Self {
        let [x, y, z, w] = transpose(positions);
        Self { x, y, z, w, inv_w: Vec4::ONE / w }
    }

    #[inline(always)]
    fn positions(self) -> [Vec4; 4] {
        transpose([self.x, self.y, self.z, self.w])
    }
}

/// Everything that projection needs, worked out once a draw.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Projector {
    pub(crate) volume: ClipVolume,
    clip_depth: ClipDepth,
}

impl Projector {
    pub(crate) fn new(viewport: &Viewport, clip_depth: ClipDepth, depth_clip: DepthClip) -> Self {
        Self { volume: ClipVolume::new(viewport, depth_clip), clip_depth }
    }

    /// Framebuffer coordinates, before rounding, and 1/w.
    #[inline(always)]
    fn to_framebuffer(self, p: Vec4) -> ([f32; 3], f32) {
        let ViewportTransform { scale, offset } = self.volume.transform;
        let inv_w = 1.0 / p.w;
        // A depth may be anything when it is clamped: keep it from overflowing.
        let z = clamp(p.z * inv_w, -1e12, 1e12);
        let place = |ndc: f32, i: usize| ndc * scale[i] + offset[i];
        ([place(p.x * inv_w, 0), place(p.y * inv_w, 1), place(z, 2)], inv_w)
    }

    /// A clip-space position on the subpixel grid.
    #[inline(always)]
    pub(crate) fn project(&self, position: Vec4) -> ProjectedVertex {
        let position = self.clip_depth.to_zero_to_one(position);
        let ([x, y, z], inv_w) = self.to_framebuffer(position);
        if self.volume.contains(position, x, y) {
            return ProjectedVertex { x: snap(x), y: snap(y), z, inv_w };
        }
        self.outside(position)
    }

    /// Projects as many positions as there are vertices, four in a step, but for up to three at the end. Gives how many.
    ///
    /// Those that are left over from [`AT_ONCE`] have a loop of their own: one for both took W4 1 % more instructions and time.
    #[inline(always)]
    pub(crate) fn project_fours(
        &self,
        positions: &impl Attributes<Value = Vec4>,
        vertices: &mut [ProjectedVertex],
    ) -> usize {
        let four_at = |index: usize| {
            // There are as many positions as vertices.
            Four::new(array::from_fn(|i| positions.fetch(index + i).unwrap_or(Vec4::W)))
        };
        let (mut fours, mut index) = ([Four::BLANK; AT_ONCE / 4], 0);
        while let Some(block) = vertices.get_mut(index..).and_then(|rest| rest.first_chunk_mut::<AT_ONCE>()) {
            for (four, index) in fours.iter_mut().zip((index..).step_by(4)) {
                *four = four_at(index);
            }
            for (four, to) in fours.iter().zip(block.chunks_exact_mut(4)) {
                if let Some(to) = to.first_chunk_mut() {
                    self.project_four(*four, to);
                }
            }
            index += AT_ONCE;
        }
        while let Some(to) = vertices.get_mut(index..).and_then(|rest| rest.first_chunk_mut()) {
            self.project_four(four_at(index), to);
            index += 4;
        }
        index
    }

    /// Four positions in a step, [divided](Four::new) already. The steps are those of [`project`](Self::project).
    ///
    /// Results are written where they belong: returned, they would be stored, and then copied by loads that are wider than these
    /// stores, and have to wait for them.
    #[inline(always)]
    fn project_four(&self, four: Four, to: &mut [ProjectedVertex; 4]) {
        let ViewportTransform { scale, offset } = self.volume.transform;
        let Four { x, y, z, w, inv_w } = four;
        let z = self.clip_depth.four_to_zero_to_one(z, w);
        let place = |ndc: Vec4, i: usize| ndc * scale[i] + Vec4::splat(offset[i]);
        let (x, y) = (place(x * inv_w, 0), place(y * inv_w, 1));
        if !self.volume.contains_four([x, y, z, w]) {
            let [a, b, c, d] = four.positions();
            *to = self.project_apart(a, b, c, d);
            return;
        }
        let depth = (z * inv_w).max(Vec4::splat(-1e12)).min(Vec4::splat(1e12));
        let rounded = |pixels: Vec4| pixels * SUBPIXELS as f32 + ROUNDING;
        // Integers in ±2²², as floats for as long as they are moved: some are no numbers, but quiet ones, so no move changes a bit.
        let bits =
            |sum: Vec4| Vec4::from_array(sum.to_array().map(|sum| f32::from_bits(rounded_to(sum) as u32)));
        let vertices = transpose([bits(rounded(x)), bits(rounded(y)), place(depth, 2), inv_w]);
        for (to, vertex) in to.iter_mut().zip(vertices) {
            *to = ProjectedVertex::from_words(vertex.to_array().map(f32::to_bits));
        }
    }

    /// Four positions, some of which have to be clipped away. (Four arguments: an array would be stored before that is known.)
    #[cold]
    #[inline(never)]
    fn project_apart(&self, a: Vec4, b: Vec4, c: Vec4, d: Vec4) -> [ProjectedVertex; 4] {
        [a, b, c, d].map(|position| self.project(position))
    }

    #[cold]
    #[inline(never)]
    fn outside(&self, position: Vec4) -> ProjectedVertex {
        match self.volume.outcode(position) {
            // Outside after rounding, inside before: it lies on the border.
            0 => self.project_clipped(&position.to_array()),
            outcode => ProjectedVertex { x: OUTSIDE, y: i32::from(outcode), z: 0.0, inv_w: 0.0 },
        }
    }

    /// A position that clipping has left, whose depth is already 0 ≤ z ≤ w.
    #[inline(never)]
    pub(crate) fn project_clipped(&self, position: &[f32; 4]) -> ProjectedVertex {
        let ([x, y, z], inv_w) = self.to_framebuffer(Vec4::from_array(*position));
        let snap = |x: f32| snap(clamp(x, -GUARD_BAND, GUARD_BAND));
        ProjectedVertex { x: snap(x), y: snap(y), z, inv_w }
    }

    /// A position with depth in 0 ≤ z ≤ w.
    #[inline(always)]
    pub(crate) fn to_clip(self, position: Vec4) -> Vec4 {
        self.clip_depth.to_zero_to_one(position)
    }
}

/// Whether any of three vertices is no point at all.
#[inline(always)]
pub(crate) fn is_invalid(outcodes: u8) -> bool {
    outcodes & INVALID != 0
}

/// Where a draw takes its positions from: [`Attributes`] of clip-space `Vec4`, projected when they are needed, or
/// [`Projected`], which were projected before.
///
/// The trait is sealed: what was found out about projected vertices is relied on when they are looked up again, so they have to be
/// the same then, of which no other type could be trusted. To bring positions of one's own, implement [`Attributes`].
///
/// ```compile_fail
/// use halfplane::{ProjectedVertex, glam::Vec4};
/// struct Mine;
///
/// impl halfplane::Positions for Mine {
///     const ARE_PROJECTED: bool = true;
///
///     fn count(&self) -> usize {
///         0
///     }
///
///     fn clip(&self, _: usize) -> Option<Vec4> {
///         None
///     }
///
///     fn projected(&self) -> &[ProjectedVertex] {
///         &[]
///     }
/// }
/// ```
pub trait Positions: sealed::Sealed {
    /// Whether the vertices were projected before.
    const ARE_PROJECTED: bool;

    /// How many vertices there are.
    fn count(&self) -> usize;

    /// The clip-space position of a vertex.
    fn clip(&self, index: usize) -> Option<Vec4>;

    /// The vertices on the subpixel grid, if they were put there before; else none.
    fn projected(&self) -> &[ProjectedVertex];
}

mod sealed {
    pub trait Sealed {}
}

impl<A: Attributes<Value = Vec4>> sealed::Sealed for A {}

impl<A: Attributes<Value = Vec4>> Positions for A {
    const ARE_PROJECTED: bool = false;

    #[inline(always)]
    fn count(&self) -> usize {
        self.len()
    }

    #[inline(always)]
    fn clip(&self, index: usize) -> Option<Vec4> {
        self.fetch(index)
    }

    #[inline(always)]
    fn projected(&self) -> &[ProjectedVertex] {
        &[]
    }
}

/// Vertices that were projected once each: see [`Rasterizer::project`](crate::Rasterizer::project).
#[derive(Clone, Copy, Debug)]
pub struct Projected<'a, A> {
    pub(crate) vertices: &'a [ProjectedVertex],
    pub(crate) positions: A,
}

impl<A> Projected<'_, A> {
    /// The vertices, one for each position.
    #[must_use]
    pub fn vertices(&self) -> &[ProjectedVertex] {
        self.vertices
    }
}

impl<A: Attributes<Value = Vec4>> sealed::Sealed for Projected<'_, A> {}

impl<A: Attributes<Value = Vec4>> Positions for Projected<'_, A> {
    const ARE_PROJECTED: bool = true;

    #[inline(always)]
    fn count(&self) -> usize {
        self.vertices.len()
    }

    #[inline(always)]
    fn clip(&self, index: usize) -> Option<Vec4> {
        self.positions.fetch(index)
    }

    #[inline(always)]
    fn projected(&self) -> &[ProjectedVertex] {
        self.vertices
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn projector() -> Projector {
        let viewport = Viewport::of_size(64, 64).expect("valid");
        Projector::new(&viewport, ClipDepth::ZeroToOne, DepthClip::Clip)
    }

    #[test]
    fn snapping_rounds_to_the_nearest_subpixel() {
        for (pixels, subpixels) in
            [(0.0, 0), (1.0, 256), (-0.5, -128), (1.0 / 512.0, 0), (3.0 / 512.0, 2), (-16_384.0, -4_194_304)]
        {
            assert_eq!(snap(pixels), subpixels, "{pixels}");
        }
        assert_eq!(snap(16_384.0), 4_194_304, "the other end of the range");
    }

    #[test]
    fn four_at_a_time_are_as_each_alone() {
        let mut random = 1u32;
        let mut next = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 8) as f32 / 8_388_608.0 - 1.0
        };
        let viewport =
            Viewport::new(3.0, 5.0, 300.0, 200.0).and_then(|viewport| viewport.with_depth_range(0.75, 0.25));
        let viewport = viewport.expect("valid");
        let mut inside = 0;
        for clip_depth in [ClipDepth::ZeroToOne, ClipDepth::NegativeOneToOne] {
            for depth_clip in [DepthClip::Clip, DepthClip::Clamp] {
                let projector = Projector::new(&viewport, clip_depth, depth_clip);
                for i in 0..4000 {
                    // Most of them inside, all four of many; some far outside of one plane or another.
                    let size = |axis: i32| if i % 16 == axis { 1e4 } else { 1.0 };
                    let far = if i % 16 == 8 { 1e28 } else { size(2) };
                    let mut position = || {
                        let w = if i % 16 == 9 { 1e-20 } else { size(3) } * (1.5 + next());
                        Vec4::new(
                            size(0) * next() * w,
                            size(1) * next() * w,
                            far * (0.5 + 0.5 * next()) * w,
                            w,
                        )
                    };
                    let positions = [position(), position(), position(), position()];
                    let each = positions.map(|position| projector.project(position));
                    inside += u32::from(!each.iter().any(|vertex| vertex.is_outside()));
                    let words = |vertices: [ProjectedVertex; 4]| vertices.map(ProjectedVertex::to_words);
                    let mut found = [ProjectedVertex::default(); 4];
                    projector.project_four(Four::new(positions), &mut found);
                    assert_eq!(words(found), words(each), "{positions:?}");
                }
            }
        }
        assert!(inside > 8000, "four at a time were needed: {inside}");
    }

    #[test]
    fn any_number_of_vertices_is_projected() {
        let mut positions = [Vec4::W; 200];
        for (i, position) in (0u8..).zip(&mut positions) {
            // Some of them outside.
            let x = f32::from(i) / 100.0 - 1.0;
            *position = Vec4::new(x, -x, if i % 7 == 0 { -0.1 } else { 0.5 }, 1.0 + x * x);
        }
        let each = positions.map(|position| projector().project(position).to_words());
        for count in (0..10).chain(60..70).chain(124..136).chain([200]) {
            let mut vertices = [ProjectedVertex::default(); 200];
            let done = projector().project_fours(&&positions[..count], &mut vertices[..count]);
            assert_eq!(done, count - count % 4, "fours");
            for (i, vertex) in vertices.into_iter().enumerate() {
                let expected = if i < done { each[i] } else { ProjectedVertex::default().to_words() };
                assert_eq!(vertex.to_words(), expected, "{i} of {count}");
            }
        }
    }

    #[test]
    fn ndc_corners_are_frame_corners() {
        let at = |x, y| projector().project(Vec4::new(x, y, 0.5, 1.0) * 3.0).position_subpixel();
        assert_eq!(at(-1.0, 1.0), Some([0, 0]), "top left");
        assert_eq!(at(1.0, -1.0), Some([64 * 256, 64 * 256]), "bottom right");
    }

    #[test]
    fn what_cannot_be_projected_says_why() {
        let outcode = |x, y, z, w| projector().project(Vec4::new(x, y, z, w)).outcode();
        assert_eq!(outcode(0.0, 0.0, -0.1, 1.0), 1 << 1, "before the near plane");
        assert_eq!(outcode(0.0, 0.0, 1.1, 1.0), 1 << 2, "behind the far plane");
        assert_eq!(outcode(-1e4, 0.0, 0.5, 1.0), 1 << 3, "left of the guard band");
        assert_eq!(outcode(0.0, 0.0, 0.0, 0.0) & 1, 1, "w = 0");
        assert_eq!(outcode(0.0, 0.0, f32::NAN, 1.0), INVALID, "NaN");
        assert_eq!(outcode(1.0, 1.0, 0.5, f32::INFINITY), INVALID, "w = ∞");
        assert_eq!(outcode(0.1, 0.2, 0.5, 1.0), 0, "inside");
    }
}
