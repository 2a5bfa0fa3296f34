//! Shading in two stages: the draws of [`Rasterizer`], with two closures in place of one.

use core::fmt;

use crate::closure::InStages;
use crate::columns::Columns;
use crate::depth::DepthTest;
use crate::fragment::Fragment;
use crate::interpolate::Varyings;
use crate::packet::Aligned;
use crate::prepared::Record;
use crate::primitive::{Index, Primitives};
use crate::project::Positions;
use crate::rasterizer::{DrawError, Rasterizer};
use crate::state::Statistics;
use crate::target::Framebuffer;
use crate::vertex::Attributes;

impl<V: Varyings, T: DepthTest> Rasterizer<V, T> {
    /// Shading in two stages: the draws of what this returns take a second closure, which gets what the `first` one makes of each
    /// fragment. For textures: see [`Staged`].
    ///
    /// # Examples
    /// See [`Staged`].
    #[inline(always)]
    pub fn staged<M: Columns, A: Fn(Fragment<'_, V>) -> M>(&self, first: A) -> Staged<'_, V, T, A> {
        Staged { rasterizer: self, first }
    }
}

/// A [`Rasterizer`] that shades in two stages, which makes closures faster that fetch from memory: textures, tables, shadow maps.
///
/// In one closure that fetches, each step waits for the one before: derivatives, level, address, texels, mean, pixel. What waits
/// takes room in the processor, so the next fragments cannot begin. In two stages, the `first` closure is called for all fragments of
/// a packet (up to 256 of one triangle), and then the second. **Cut just before the fetch**: the first closure makes indices and
/// fractions, the second fetches and mixes. A bilinear, mip-mapped texture takes 0.6 of the time so, and a mesh with it 0.8 (measured
/// in [How fast, and why](crate::how_fast)). Closures that only compute gain nothing.
///
/// * **Both closures may be called again for a fragment**, so that none is left over after SIMD; the result is dropped then. So they
///   are `Fn`, and should do nothing but return. (One call for each fragment, in which order, is a promise of the draws with one
///   closure.) Pixels, depths and statistics are those of one closure that calls both.
/// * What the first returns must be [`Columns`]: numbers, vectors, arrays, tuples. Fewer are faster: each draw clears their memory.
/// * Both may borrow, as most textures are; nothing is gained by `move` here.
/// * A `Staged` that is used for two draws, or a closure in a variable that is, is called and not inlined into both: then nothing
///   becomes SIMD. `.staged(#[inline(always)] |fragment| …)` brings it into all of them.
/// * A second closure that is not written where it is an argument needs the type of its own: `|(x, y): (i32, i32)| …`.
///
/// On targets without SIMD the second closure is called after the first, for one fragment after the other.
///
/// # Examples
/// A texture of 64 × 64, looked up at its nearest texel. The index is masked, so it is never out of bounds, and not checked either:
/// ```
/// # use glam::{Vec2, Vec4};
/// # use halfplane::{Primitives, Rasterizer, Surface, Viewport, floor_to_i32};
/// # let positions = [Vec4::new(-1.0, -1.0, 0.5, 1.0), Vec4::new(1.0, -1.0, 0.5, 1.0), Vec4::new(0.0, 1.0, 0.5, 1.0)];
/// # let uvs = [Vec2::ZERO, Vec2::X, Vec2::ONE];
/// # let texels = [7u32; 64 * 64];
/// # let mut pixels = [0u32; 64 * 64];
/// # let mut target = Surface::color_only(&mut pixels, 64, 64)?;
/// let rasterizer = Rasterizer::<Vec2>::new(Viewport::of_size(64, 64)?);
/// rasterizer
///     .staged(|fragment| {
///         let texel = fragment.varyings() * 64.0;
///         (floor_to_i32(texel.x), floor_to_i32(texel.y))
///     })
///     .draw(&mut target, Primitives::list(), &positions, &uvs, |(x, y)| {
///         texels[((y & 63) * 64 + (x & 63)) as usize & (64 * 64 - 1)]
///     })?;
/// # assert_eq!(pixels.iter().filter(|&&pixel| pixel == 7).count(), 64 * 64 / 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// Two textures in one array, for meshes of several materials: one more number in the index, and still no branch.
/// ```
/// # use glam::{Vec2, Vec4};
/// # use halfplane::{Flat, Primitives, Rasterizer, Surface, Viewport, floor_to_i32};
/// # let positions = [Vec4::new(-1.0, -1.0, 0.5, 1.0), Vec4::new(1.0, -1.0, 0.5, 1.0), Vec4::new(0.0, 1.0, 0.5, 1.0)];
/// # let (uvs, materials) = ([Vec2::ZERO, Vec2::X, Vec2::ONE], [Flat(1); 3]);
/// # let mut texels = [7u32; 2 * 64 * 64];
/// # texels[64 * 64..].fill(8);
/// # let mut pixels = [0u32; 64 * 64];
/// # let mut target = Surface::color_only(&mut pixels, 64, 64)?;
/// let rasterizer = Rasterizer::<(Vec2, Flat<i32>)>::new(Viewport::of_size(64, 64)?);
/// rasterizer
///     .staged(|fragment| {
///         let (uv, Flat(material)) = fragment.varyings();
///         let (x, y) = (floor_to_i32(uv.x * 64.0), floor_to_i32(uv.y * 64.0));
///         material * (64 * 64) + (y & 63) * 64 + (x & 63)
///     })
///     .draw(&mut target, Primitives::list(), &positions, (&uvs, &materials), |texel| {
///         texels[texel as usize & (2 * 64 * 64 - 1)]
///     })?;
/// # assert_eq!(pixels.iter().filter(|&&pixel| pixel == 8).count(), 64 * 64 / 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy)]
#[must_use = "nothing is drawn before one of its draws is called"]
pub struct Staged<'a, V, T, A> {
    rasterizer: &'a Rasterizer<V, T>,
    first: A,
}

impl<V: fmt::Debug, T: fmt::Debug, A> fmt::Debug for Staged<'_, V, T, A> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Staged").field("rasterizer", self.rasterizer).finish_non_exhaustive()
    }
}

impl<V: Varyings, T: DepthTest, A> Staged<'_, V, T, A> {
    /// [`Rasterizer::draw`]. The `second` closure gives each fragment its colour, or an `Option` of it, from what the first has made
    /// of it.
    ///
    /// # Errors
    /// As [`Rasterizer::draw`].
    #[inline(always)]
    pub fn draw<F, I, P, B, M, S, R>(
        &self,
        target: &mut F,
        primitives: Primitives<'_, I>,
        positions: P,
        varyings: B,
        second: S,
    ) -> Result<Statistics, DrawError>
    where
        F: Framebuffer,
        I: Index,
        P: Positions,
        B: Attributes<Value = V>,
        M: Columns,
        A: Fn(Fragment<'_, V>) -> M,
        S: Fn(M) -> R,
        R: Into<Option<F::Color>>,
    {
        let second = |value: M, _: F::Color| second(value);
        let closure = InStages { first: &self.first, second, columns: &mut Aligned(M::EMPTY).0 };
        self.rasterizer.draw_with::<_, _, _, _, _, false>(target, primitives, positions, varyings, closure)
    }

    /// [`Rasterizer::draw_over`]. The `second` closure is also lent the colour already there.
    ///
    /// # Errors
    /// As [`Rasterizer::draw`].
    ///
    /// # Examples
    /// ```
    /// # use glam::{Vec2, Vec4};
    /// # use halfplane::{Primitives, Rasterizer, Surface, Viewport};
    /// # let positions = [Vec4::new(-1.0, -1.0, 0.5, 1.0), Vec4::new(1.0, -1.0, 0.5, 1.0), Vec4::new(0.0, 1.0, 0.5, 1.0)];
    /// let mut light = [1.0f32; 64 * 64];
    /// let mut target = Surface::color_only(&mut light, 64, 64)?;
    /// let rasterizer = Rasterizer::<f32>::new(Viewport::of_size(64, 64)?);
    /// rasterizer
    ///     .staged(|fragment| fragment.varyings())
    ///     .draw_over(&mut target, Primitives::list(), &positions, &[3.0; 3], |lamp, below| below + lamp)?;
    /// assert!(light.contains(&4.0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[inline(always)]
    pub fn draw_over<F, I, P, B, M, S, R>(
        &self,
        target: &mut F,
        primitives: Primitives<'_, I>,
        positions: P,
        varyings: B,
        second: S,
    ) -> Result<Statistics, DrawError>
    where
        F: Framebuffer,
        I: Index,
        P: Positions,
        B: Attributes<Value = V>,
        M: Columns,
        A: Fn(Fragment<'_, V>) -> M,
        S: Fn(M, F::Color) -> R,
        R: Into<Option<F::Color>>,
    {
        let closure = InStages { first: &self.first, second, columns: &mut Aligned(M::EMPTY).0 };
        self.rasterizer.draw_with::<_, _, _, _, _, true>(target, primitives, positions, varyings, closure)
    }

    /// [`Rasterizer::draw_prepared`]. The `second` closure gets what the first has made of each fragment, as in [`draw`](Self::draw).
    #[inline(always)]
    pub fn draw_prepared<'r, F, M, S, R>(
        &self,
        target: &mut F,
        records: impl IntoIterator<Item = &'r Record<V>>,
        second: S,
    ) -> Statistics
    where
        V: 'r,
        F: Framebuffer,
        M: Columns,
        A: Fn(Fragment<'_, V>) -> M,
        S: Fn(M) -> R,
        R: Into<Option<F::Color>>,
    {
        let second = |value: M, _: F::Color| second(value);
        let closure = InStages { first: &self.first, second, columns: &mut Aligned(M::EMPTY).0 };
        self.rasterizer.draw_prepared_with::<_, _, false>(target, records, closure)
    }

    /// [`Rasterizer::draw_prepared_over`]. The `second` closure is also lent the colour already there, as in
    /// [`draw_over`](Self::draw_over).
    #[inline(always)]
    pub fn draw_prepared_over<'r, F, M, S, R>(
        &self,
        target: &mut F,
        records: impl IntoIterator<Item = &'r Record<V>>,
        second: S,
    ) -> Statistics
    where
        V: 'r,
        F: Framebuffer,
        M: Columns,
        A: Fn(Fragment<'_, V>) -> M,
        S: Fn(M, F::Color) -> R,
        R: Into<Option<F::Color>>,
    {
        let closure = InStages { first: &self.first, second, columns: &mut Aligned(M::EMPTY).0 };
        self.rasterizer.draw_prepared_with::<_, _, true>(target, records, closure)
    }
}
