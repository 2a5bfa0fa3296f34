//! The hub: the pipeline's state, and the draws, which are the way of a triangle through all other stations.
//!
//! There are two of each: without SIMD, `one_by_one.rs`, which is the one to read first; with it, triangles come from a
//! [`Source`] in batches, and their fragments go in packets through `shade.rs`.

use core::fmt;
use core::marker::PhantomData;

use glam::Vec4;

use crate::ahead;
use crate::behind::{Glance, Sight};
use crate::clip::DepthClip;
use crate::closure::{Shade, Whole};
use crate::coarse::Coarse;
use crate::depth::{DepthBias, DepthFormat, DepthTest, Less};
use crate::depth_pass::DepthPass;
use crate::facing::Facing;
use crate::fan::{Fan, History, Piece, at_corners};
use crate::fragment::{Fragment, Identity, Shading};
use crate::geometry::Geometry;
use crate::interpolate::Varyings;
use crate::one_by_one::{OneByOne, Vertices};
use crate::packet::{Aligned, PACKET, PLACES, Packet, Places};
use crate::plane::DepthPlane;
use crate::primitive::{Index, Primitives, Triangles};
use crate::project::{Positions, Projected, ProjectedVertex, Projector};
use crate::setup::sample_bounds;
use crate::shade::Shader;
use crate::state::{CullMode, FrontFace, ProvokingVertex, Statistics};
use crate::target::{Borders, DOMAIN, Framebuffer, Rect};
use crate::tiny::Outline;
use crate::traverse::HAS_FLOAT_LANES;
use crate::upcoming::{Turns, Upcoming};
use crate::vertex::Attributes;
use crate::viewport::{ClipDepth, Viewport};

/// Why nothing was drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum DrawError {
    /// An index names a vertex that is not there.
    IndexOutOfRange {
        /// Where in the indices it stands.
        position: usize,
        /// The index.
        index: usize,
        /// How many vertices there are.
        vertices: usize,
    },
    /// There are fewer varyings than positions.
    TooFewVaryings {
        /// How many positions there are.
        positions: usize,
        /// How many varyings there are.
        varyings: usize,
    },
    /// Unindexed primitives of positions without an end, as those of a constant.
    Endless,
    /// The memory for prepared triangles has no room for any.
    NoRecords,
    /// The memory for projected vertices is too short.
    TooFewProjected {
        /// How many positions there are.
        positions: usize,
        /// How many projected vertices there is room for.
        room: usize,
    },
}

impl fmt::Display for DrawError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::IndexOutOfRange { position, index, vertices } => {
                write!(
                    f,
                    "index {index}, at position {position}, is out of range: there are {vertices} vertices"
                )
            }
            Self::TooFewVaryings { positions, varyings } => {
                write!(f, "{positions} positions need as many varyings, not {varyings}")
            }
            Self::Endless => write!(f, "unindexed primitives need a number of positions, not a constant one"),
            Self::NoRecords => write!(f, "0 records of memory cannot hold any triangle"),
            Self::TooFewProjected { positions, room } => {
                write!(f, "{positions} positions need room for as many projected vertices, not {room}")
            }
        }
    }
}

impl core::error::Error for DrawError {}

/// Draws triangles with varyings `V`, depth-tested by `T`.
///
/// Its fields are the pipeline state; any combination is legal. Nothing else is remembered between draws.
///
/// ```text
///   primitive assembly → clip → project → setup → traverse → depth → weights → your closure → your memory
/// ```
///
/// # Examples
/// ```
/// use glam::{Vec3, Vec4};
/// use halfplane::{CullMode, Greater, Primitives, Rasterizer, Surface, Viewport, pack_rgba8};
///
/// let (mut pixels, mut depth) = ([0u32; 64 * 64], [0.0f32; 64 * 64]); // with reverse Z, 0 is far
/// let mut target = Surface::new(&mut pixels, &mut depth, 64, 64)?;
///
/// // Reverse Z, back faces culled.
/// let mut rasterizer = Rasterizer::<Vec3>::new(Viewport::of_size(64, 64)?).with_depth_test(Greater);
/// rasterizer.cull_mode = CullMode::Back;
///
/// let positions = [Vec4::new(-1.0, -1.0, 0.5, 1.0), Vec4::new(1.0, -1.0, 0.5, 1.0), Vec4::new(0.0, 1.0, 0.5, 1.0)];
/// let colors = [Vec3::X, Vec3::Y, Vec3::Z];
/// let statistics = rasterizer.draw(&mut target, Primitives::list(), &positions, &colors, |fragment| {
///     pack_rgba8(fragment.varyings().extend(1.0))
/// })?;
/// assert_eq!(statistics.samples_passed, 64 * 64 / 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Rasterizer<V, T = Less> {
    /// Where clip space goes.
    pub viewport: Viewport,
    /// In pixels of the whole frame, y down: nothing is drawn outside of it. `None` is no limit.
    pub scissor: Option<Rect>,
    /// Which sides are left out.
    pub cull_mode: CullMode,
    /// Which side is the front.
    pub front_face: FrontFace,
    /// The depth range of clip space.
    pub clip_depth: ClipDepth,
    /// What happens beyond the near and far planes.
    pub depth_clip: DepthClip,
    /// What is added to depths.
    pub depth_bias: DepthBias,
    /// The comparison, and whether depth is written.
    pub depth_test: T,
    /// Whose values flat varyings take.
    pub provoking_vertex: ProvokingVertex,
    varyings: PhantomData<fn() -> V>,
}

impl<V: Varyings> Rasterizer<V> {
    /// Nearer fragments win ([`Less`], depth written), nothing is culled, and everything else is at its default.
    #[must_use]
    pub fn new(viewport: Viewport) -> Self {
        Self {
            viewport,
            scissor: None,
            cull_mode: CullMode::default(),
            front_face: FrontFace::default(),
            clip_depth: ClipDepth::default(),
            depth_clip: DepthClip::default(),
            depth_bias: DepthBias::default(),
            depth_test: Less,
            provoking_vertex: ProvokingVertex::default(),
            varyings: PhantomData,
        }
    }
}

impl<V: Varyings, T: DepthTest> Rasterizer<V, T> {
    /// The same state with another depth test: a type like [`Greater`](crate::Greater) or a
    /// [`DepthState`](crate::DepthState).
    #[must_use]
    pub fn with_depth_test<U: DepthTest>(self, depth_test: U) -> Rasterizer<V, U> {
        let Self {
            viewport,
            scissor,
            cull_mode,
            front_face,
            clip_depth,
            depth_clip,
            depth_bias,
            provoking_vertex,
            varyings,
            ..
        } = self;
        Rasterizer {
            viewport,
            scissor,
            cull_mode,
            front_face,
            clip_depth,
            depth_clip,
            depth_bias,
            depth_test,
            provoking_vertex,
            varyings,
        }
    }

    /// The pixels that a draw may touch: viewport ∩ scissor ∩ the framebuffer's area.
    #[inline(always)]
    pub fn render_area(&self, target: &impl Framebuffer) -> Rect {
        let area = self.viewport.pixels().intersection(target.area());
        self.scissor.map_or(area, |scissor| area.intersection(scissor))
    }

    /// Projects every vertex once, into memory of the caller's, for draws that use vertices several times.
    ///
    /// Without it, an indexed draw projects a vertex anew unless the triangle before used it too, and once or twice more if the
    /// triangle may be seen (where there is no SIMD, once for each triangle): with a fine mesh and positions that are
    /// [`Computed`](crate::Computed), that is several times the work.
    ///
    /// The result is good for any number of draws by this rasterizer, from any thread, until its viewport, clip depth or
    /// depth clip changes.
    ///
    /// # Errors
    /// When `room` is shorter than `positions`.
    ///
    /// # Examples
    /// ```
    /// # use glam::{Vec3, Vec4};
    /// # use halfplane::{Primitives, ProjectedVertex, Rasterizer, Surface, Viewport};
    /// # let mut pixels = [0u32; 64 * 64];
    /// # let mut target = Surface::color_only(&mut pixels, 64, 64)?;
    /// # let rasterizer = Rasterizer::<()>::new(Viewport::of_size(64, 64)?);
    /// let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec4::new(x, y, 0.5, 1.0));
    /// let mut room = [ProjectedVertex::default(); 4];
    /// let vertices = rasterizer.project(&corners, &mut room)?;
    /// let quad = Primitives::list().indexed(&[0u8, 1, 2, 0, 2, 3]);
    /// let statistics = rasterizer.draw(&mut target, quad, vertices, (), |_| 0xffff_ffff)?;
    /// assert_eq!(statistics.samples_passed, 64 * 64);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[inline(always)]
    pub fn project<'a, A: Attributes<Value = Vec4>>(
        &self,
        positions: A,
        room: &'a mut [ProjectedVertex],
    ) -> Result<Projected<'a, A>, DrawError> {
        let count = positions.len();
        let error = DrawError::TooFewProjected { positions: count, room: room.len() };
        let vertices = room.get_mut(..count).ok_or(error)?;
        let projector = self.projector();
        let done = if HAS_FLOAT_LANES { projector.project_fours(&positions, vertices) } else { 0 };
        for (vertex, index) in vertices.iter_mut().skip(done).zip(done..) {
            if let Some(position) = positions.fetch(index) {
                *vertex = projector.project(position);
            }
        }
        Ok(Projected { vertices, positions })
    }

    pub(crate) fn projector(&self) -> Projector {
        Projector::new(&self.viewport, self.clip_depth, self.depth_clip)
    }

    /// Draws triangles. The closure gives each fragment its colour, or an `Option` of it: `None` discards the fragment,
    /// and its depth is then not written either.
    ///
    /// * `positions`: in clip space, as [`Attributes`] or [`Projected`] by [`project`](Self::project).
    /// * `varyings`: as many as there are positions, or a constant.
    ///
    /// The closure runs once for each fragment that passes the depth test, triangle by triangle, rows from the top, left
    /// to right. (If it panics, the pixels of its triangle may be written in part: some of them, or their depths alone.) The
    /// compiler makes SIMD of it as long as it holds no branch, no index that is checked, no float-to-integer `as` (use
    /// [`pack_rgba8`](crate::pack_rgba8) and its neighbours) and no call: in a `std` program, write
    /// `v * (1.0 / v.length_squared().sqrt())` with `f32::sqrt` or enable glam's `std` feature, because glam's own
    /// `normalize` calls `libm` without it. A closure that fetches from a texture is faster in two parts: see
    /// [`staged`](Self::staged).
    ///
    /// # Errors
    /// When an index is out of range, when there are fewer varyings than positions, or when unindexed positions have no
    /// end. Nothing is drawn then.
    ///
    /// # Examples
    /// See [`Rasterizer`]. Depth alone, as for a shadow map, is a closure that returns `()`:
    /// ```
    /// # use glam::Vec4;
    /// # use halfplane::{Primitives, Rasterizer, Surface, Viewport};
    /// # let positions = [Vec4::new(-1.0, -1.0, 0.5, 1.0), Vec4::new(1.0, -1.0, 0.5, 1.0), Vec4::new(0.0, 1.0, 0.5, 1.0)];
    /// let mut shadow_map = [u16::MAX; 64 * 64];
    /// let mut target = Surface::depth_only(&mut shadow_map, 64, 64)?;
    /// let rasterizer = Rasterizer::<()>::new(Viewport::of_size(64, 64)?);
    /// rasterizer.draw(&mut target, Primitives::list(), &positions, (), |_| ())?;
    /// # assert!(shadow_map.contains(&32_768));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[inline(always)]
    pub fn draw<F, I, P, A, S, R>(
        &self,
        target: &mut F,
        primitives: Primitives<'_, I>,
        positions: P,
        varyings: A,
        mut shade: S,
    ) -> Result<Statistics, DrawError>
    where
        F: Framebuffer,
        I: Index,
        P: Positions,
        A: Attributes<Value = V>,
        S: FnMut(Fragment<'_, V>) -> R,
        R: Into<Option<F::Color>>,
    {
        let shade = move |fragment: Fragment<'_, V>, _| shade(fragment);
        self.draw_with::<_, _, _, _, _, false>(target, primitives, positions, varyings, Whole(shade))
    }

    /// Draws triangles with a closure that is also lent the colour already there, for blending.
    ///
    /// # Errors
    /// As [`draw`](Self::draw).
    ///
    /// # Examples
    /// ```
    /// # use glam::{Vec3, Vec4};
    /// # use halfplane::{Primitives, Rasterizer, ReadOnly, Less, Surface, Viewport};
    /// # let positions = [Vec4::new(-1.0, -1.0, 0.5, 1.0), Vec4::new(1.0, -1.0, 0.5, 1.0), Vec4::new(0.0, 1.0, 0.5, 1.0)];
    /// let mut pixels = [Vec3::ONE; 64 * 64]; // a floating-point framebuffer
    /// let mut target = Surface::color_only(&mut pixels, 64, 64)?;
    /// let glass = Rasterizer::<()>::new(Viewport::of_size(64, 64)?).with_depth_test(ReadOnly(Less));
    /// glass.draw_over(&mut target, Primitives::list(), &positions, (), |_, below| below.lerp(Vec3::X, 0.25))?;
    /// # assert!(pixels.contains(&Vec3::new(1.0, 0.75, 0.75)));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[inline(always)]
    pub fn draw_over<F, I, P, A, S, R>(
        &self,
        target: &mut F,
        primitives: Primitives<'_, I>,
        positions: P,
        varyings: A,
        shade: S,
    ) -> Result<Statistics, DrawError>
    where
        F: Framebuffer,
        I: Index,
        P: Positions,
        A: Attributes<Value = V>,
        S: FnMut(Fragment<'_, V>, F::Color) -> R,
        R: Into<Option<F::Color>>,
    {
        self.draw_with::<_, _, _, _, _, true>(target, primitives, positions, varyings, Whole(shade))
    }

    /// Draws triangles with a closure that reads the colour already there if it `BLENDS`.
    #[inline(always)]
    pub(crate) fn draw_with<F, I, P, A, S, const BLENDS: bool>(
        &self,
        target: &mut F,
        primitives: Primitives<'_, I>,
        positions: P,
        varyings: A,
        mut closure: S,
    ) -> Result<Statistics, DrawError>
    where
        F: Framebuffer,
        I: Index,
        P: Positions,
        A: Attributes<Value = V>,
        S: Shade<V, F::Color>,
    {
        if !HAS_FLOAT_LANES {
            let shade = |fragment: Fragment<'_, V>, old| closure.shade(fragment, old);
            return self.draw_one_by_one(target, primitives, positions, varyings, shade);
        }
        let area = self.render_area(target);
        let triangles = checked_triangles(primitives, &positions, &varyings)?;
        let mut direct =
            Direct { geometry: self.geometry(triangles, positions, area), varyings, fan: None, values: None };
        let mut statistics = self.draw_triangles::<_, _, BLENDS>(target, &mut direct, closure);
        statistics += direct.geometry.statistics;
        Ok(statistics)
    }

    /// Draws depth alone, as for a shadow map, an occlusion query or a first pass before the shaded one: nothing is
    /// interpolated, no closure is called, and colours stay as they are.
    ///
    /// The depths are those of [`draw`](Self::draw), at a fraction of the time where triangles are small.
    ///
    /// # Errors
    /// When an index is out of range, or when unindexed positions have no end. Nothing is drawn then.
    ///
    /// # Examples
    /// ```
    /// # use glam::Vec4;
    /// # use halfplane::{Primitives, Rasterizer, Surface, Viewport};
    /// # let positions = [Vec4::new(-1.0, -1.0, 0.5, 1.0), Vec4::new(1.0, -1.0, 0.5, 1.0), Vec4::new(0.0, 1.0, 0.5, 1.0)];
    /// let mut shadow_map = [u16::MAX; 64 * 64];
    /// let mut target = Surface::depth_only(&mut shadow_map, 64, 64)?;
    /// let rasterizer = Rasterizer::<()>::new(Viewport::of_size(64, 64)?);
    /// let statistics = rasterizer.draw_depth(&mut target, Primitives::list(), &positions)?;
    /// assert_eq!(statistics.samples_passed, 64 * 64 / 2);
    /// assert_eq!(shadow_map.iter().filter(|&&depth| depth == 32_768).count(), 64 * 64 / 2);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[inline(always)]
    pub fn draw_depth<F: Framebuffer, I: Index, P: Positions>(
        &self,
        target: &mut F,
        primitives: Primitives<'_, I>,
        positions: P,
    ) -> Result<Statistics, DrawError> {
        if !HAS_FLOAT_LANES {
            let keep = |_: Fragment<'_, ()>, color| Some(color);
            return self.draw_one_by_one(target, primitives, positions, (), keep);
        }
        let (target_area, render_area) = (target.area().intersection(DOMAIN), self.render_area(target));
        let (bias, limits) = (self.depth_bias.unless_zero(), self.viewport.depth_limits());
        let triangles = checked_triangles(primitives, &positions, &())?;
        let mut geometry = self.geometry(triangles, positions, render_area);
        let mut fan = None;
        let coarse = Coarse::new(target, render_area, self.depth_test);
        let (target_area, render_area) = (target_area.borders(), render_area.borders());
        let mut glance = Glance::new((target_area, render_area), self.depth_test, bias, limits);
        let mut pass = DepthPass { target, target_area, render_area, test: self.depth_test, coarse };
        let mut passed = 0;
        while geometry.refill() {
            if let Some(glance) = &mut glance {
                glance.begin();
                geometry.leave_out(
                    #[cfg_attr(feature = "dispatch", inline(always))]
                    |corners, bounds| glance.look(pass.target, corners, bounds),
                );
            }
            if let Some(bounds) = geometry.neighbourhood() {
                ahead::fetch::<_, false>(pass.target, bounds);
            }
            while let Some(piece) = geometry.next(&mut fan) {
                let Piece { setup, covered, .. } = piece;
                let plane = DepthPlane::new::<F::Depth>(&setup, bias, limits);
                passed += pass.draw((&setup, covered), || geometry.outline(&piece), &plane);
            }
        }
        let mut statistics = geometry.statistics;
        statistics.fragments += passed;
        statistics.samples_passed += passed;
        Ok(statistics)
    }

    /// The geometry half of a draw.
    #[inline(always)]
    pub(crate) fn geometry<'a, I: Index, P: Positions>(
        &self,
        triangles: Triangles<'a, I>,
        positions: P,
        area: Rect,
    ) -> Geometry<'a, I, P> {
        Geometry::new(triangles, positions, self.projector(), self.facing(), area)
    }

    fn facing(&self) -> Facing {
        let Self { cull_mode, front_face, provoking_vertex, .. } = *self;
        Facing { cull_mode, front_face, provoking_vertex }
    }

    /// [`draw_over`](Self::draw_over) without SIMD.
    #[inline(always)]
    pub(crate) fn draw_one_by_one<F, I, P, A, S, R>(
        &self,
        target: &mut F,
        primitives: Primitives<'_, I>,
        positions: P,
        varyings: A,
        shade: S,
    ) -> Result<Statistics, DrawError>
    where
        F: Framebuffer,
        I: Index,
        P: Positions,
        A: Attributes<Value: Varyings>,
        S: FnMut(Fragment<'_, A::Value>, F::Color) -> R,
        R: Into<Option<F::Color>>,
    {
        let triangles = checked_triangles(primitives, &positions, &varyings)?;
        let (projector, facing) = (self.projector(), self.facing());
        let mut draw = self.one_by_one(target, shade);
        let vertices = Vertices { positions, varyings, projector, facing };
        Ok(draw.draw_triangles(triangles, &vertices))
    }

    /// What a draw without SIMD works with.
    #[inline(always)]
    fn one_by_one<'a, F: Framebuffer, S>(&self, target: &'a mut F, shade: S) -> OneByOne<'a, F, T, S> {
        let area = self.render_area(target);
        OneByOne {
            target,
            area: area.borders(),
            test: self.depth_test,
            depth_bias: self.depth_bias.unless_zero(),
            depth_limits: self.viewport.depth_limits(),
            shade,
            fragments: 0,
            samples_passed: 0,
        }
    }

    /// The fragment half of a draw.
    #[inline(always)]
    pub(crate) fn draw_triangles<F, S, const BLENDS: bool>(
        &self,
        target: &mut F,
        source: &mut impl Source<V>,
        mut closure: S,
    ) -> Statistics
    where
        F: Framebuffer,
        S: Shade<V, F::Color>,
    {
        let mut statistics = Statistics::default();
        if !HAS_FLOAT_LANES {
            let shade = |fragment: Fragment<'_, V>, old| closure.shade(fragment, old);
            let mut draw = self.one_by_one(target, shade);
            while let Some(piece) = next(source) {
                let history = source.history(&piece);
                if source.fetch(&piece, history.as_ref()).is_none() {
                    continue;
                }
                let Some(&varyings) = source.varyings() else { continue };
                let pedigree = history.as_ref().map(History::pedigree);
                let (Piece { setup, .. }, Some(identity)) = (piece, source.identity(&piece)) else {
                    continue;
                };
                let shading = Shading::new(&setup, &varyings, identity, pedigree.as_ref());
                let [a, b, c] = setup.corners();
                draw.draw_setup(&setup, sample_bounds(a, b, c), &shading);
            }
            statistics.fragments = draw.fragments;
            statistics.samples_passed = draw.samples_passed;
            return statistics;
        }
        let (target_area, render_area) = (target.area().intersection(DOMAIN), self.render_area(target));
        let (bias, limits) = (self.depth_bias.unless_zero(), self.viewport.depth_limits());
        // A colour to fill the packet's arrays with until there are others: any.
        let mut any = || target.run(render_area.x, render_area.y, 1).color.first().copied();
        let Some(color) = (if render_area.is_empty() { None } else { any() }) else {
            // Nothing can be drawn; the geometry counts its triangles all the same.
            while next(source).is_some() {}
            return statistics;
        };
        let numbers = || Aligned([0.0; PACKET]);
        let (mut alpha, mut beta, mut sum, mut inv_sum) = (numbers(), numbers(), numbers(), numbers());
        let (mut l, mut m, mut z, mut x, mut y) =
            (numbers(), numbers(), numbers(), Aligned([0; PACKET]), Aligned([0; PACKET]));
        let mut colors = Aligned([color; PACKET]);
        let mut depths = Aligned([F::Depth::from_depth(0.0); PACKET]);
        let mut packet = Packet {
            alpha: &mut alpha.0,
            beta: &mut beta.0,
            sum: &mut sum.0,
            inv_sum: &mut inv_sum.0,
            l: &mut l.0,
            m: &mut m.0,
            z: &mut z.0,
            x: &mut x.0,
            y: &mut y.0,
            colors: &mut colors.0,
            depths: &mut depths.0,
            discarded: &mut [0; PACKET],
            places: &mut [0; PLACES],
        };
        let test = self.depth_test;
        let coarse = Coarse::new(target, render_area, test);
        let (target_area, render_area) = (target_area.borders(), render_area.borders());
        let mut glance = Glance::new((target_area, render_area), test, bias, limits);
        let mut shader = Shader::<_, _, _, BLENDS> {
            target,
            target_area,
            render_area,
            test,
            closure,
            expects_all: true,
            coarse,
            places: &mut Places::new(),
        };
        let mut turns = Turns::new();
        while source.refill() {
            if let Some(glance) = &mut glance {
                glance.begin();
                source.leave_out(
                    #[cfg_attr(feature = "dispatch", inline(always))]
                    |corners, bounds| glance.look(shader.target, corners, bounds),
                );
            }
            if let Some(bounds) = source.neighbourhood() {
                ahead::fetch::<_, true>(shader.target, bounds);
            }
            let (state, areas) = ((bias, limits), (target_area, render_area));
            // Once more after the last one has come: then that is drawn.
            loop {
                let found = source.next();
                if let Some(piece) = &found {
                    turns.next().set(piece, || source.history(piece), || source.outline(piece), areas);
                }
                if turns.pass(found.is_some()) {
                    draw_piece(&mut shader, source, turns.this(), state, &mut packet, &mut statistics);
                } else if found.is_none() {
                    break;
                }
            }
        }
        statistics
    }
}

/// Draws a piece whose turn it is.
#[inline(always)]
fn draw_piece<F, T, S, V, const BLENDS: bool>(
    shader: &mut Shader<'_, F, T, S, BLENDS>,
    source: &mut impl Source<V>,
    upcoming: &Upcoming,
    (bias, limits): (Option<DepthBias>, (f32, f32)),
    packet: &mut Packet<'_, F::Color, F::Depth>,
    statistics: &mut Statistics,
) where
    F: Framebuffer,
    T: DepthTest,
    V: Varyings,
    S: Shade<V, F::Color>,
{
    let (Upcoming { piece, known, .. }, history) = (upcoming, upcoming.history());
    if source.fetch(piece, history).is_none() {
        return;
    }
    let (Some(varyings), Some(identity)) = (source.varyings(), source.identity(piece)) else { return };
    let pedigree = history.map(History::pedigree);
    let shading = Shading::new(&piece.setup, varyings, identity, pedigree.as_ref());
    let plane = DepthPlane::new::<F::Depth>(&piece.setup, bias, limits);
    shader.draw((piece, known), &shading, &plane, packet, statistics);
}

/// Where the fragment half of a draw gets triangles from. It asks for one thing after the other: what is returned together
/// is stored in parts and loaded as a whole, and such a load has to wait for the stores.
pub(crate) trait Source<V> {
    /// Takes in the next few triangles, of which perhaps none may be seen. False when there are no more. Those that came before
    /// must be drawn by then.
    fn refill(&mut self) -> bool;

    /// Takes those of them out that are behind what is there. None of them may have been drawn yet. See
    /// [`keep_seen`](crate::behind::keep_seen).
    fn leave_out(&mut self, look: impl FnMut([ProjectedVertex; 3], Borders) -> Sight);

    /// About where they lie, if it is worth fetching their pixels together.
    fn neighbourhood(&self) -> Option<Borders>;

    /// The next triangle of these, or the next piece of one that was clipped.
    fn next(&mut self) -> Option<Piece>;

    /// How it came about, if it is a piece of a clipped triangle; of the piece that came last alone.
    fn history(&self, piece: &Piece) -> Option<History>;

    /// Where it lies; of the piece that came last alone.
    fn outline(&self, piece: &Piece) -> Outline;

    /// Who a piece is; of those that came since the last refill alone.
    fn identity(&self, piece: &Piece) -> Option<Identity>;

    /// Takes in the values at a piece's corners, which need not be the one that came last. `None` if one is not there; then
    /// [`varyings`](Self::varyings) must not be asked.
    fn fetch(&mut self, piece: &Piece, history: Option<&History>) -> Option<()>;

    /// The values that were taken in last.
    fn varyings(&self) -> Option<&[V; 3]>;
}

/// The next triangle, or piece of one, of all.
#[inline(always)]
fn next<V>(source: &mut impl Source<V>) -> Option<Piece> {
    loop {
        if let Some(piece) = source.next() {
            return Some(piece);
        }
        if !source.refill() {
            return None;
        }
    }
}

/// Vertices, drawn at once.
struct Direct<'a, I, P, A: Attributes> {
    geometry: Geometry<'a, I, P>,
    varyings: A,
    fan: Option<Fan>,
    /// Those of the piece that is drawn.
    values: Option<[A::Value; 3]>,
}

impl<I: Index, P: Positions, A: Attributes<Value: Varyings>> Source<A::Value> for Direct<'_, I, P, A> {
    #[inline(always)]
    fn refill(&mut self) -> bool {
        self.geometry.refill()
    }

    #[inline(always)]
    fn leave_out(&mut self, look: impl FnMut([ProjectedVertex; 3], Borders) -> Sight) {
        self.geometry.leave_out(look);
    }

    #[inline(always)]
    fn neighbourhood(&self) -> Option<Borders> {
        self.geometry.neighbourhood()
    }

    #[inline(always)]
    fn next(&mut self) -> Option<Piece> {
        self.geometry.next(&mut self.fan)
    }

    #[inline(always)]
    fn history(&self, piece: &Piece) -> Option<History> {
        self.fan.as_ref()?.history(piece.in_fan)
    }

    #[inline(always)]
    fn outline(&self, piece: &Piece) -> Outline {
        self.geometry.outline(piece)
    }

    #[inline(always)]
    fn identity(&self, piece: &Piece) -> Option<Identity> {
        Some(self.geometry.identity(piece))
    }

    #[inline(always)]
    fn fetch(&mut self, piece: &Piece, history: Option<&History>) -> Option<()> {
        let [i, j, k] = piece.vertices;
        let varyings = &self.varyings;
        // One by one into the place where they stay.
        let values = match &mut self.values {
            Some(values) => {
                values[0] = varyings.fetch(i)?;
                values[1] = varyings.fetch(j)?;
                values[2] = varyings.fetch(k)?;
                values
            }
            none => none.insert([varyings.fetch(i)?, varyings.fetch(j)?, varyings.fetch(k)?]),
        };
        if let Some(history) = history {
            let provoking = self.geometry.identity(piece).provoking;
            *values = at_corners(piece.setup.order(), provoking, *values, history);
        }
        Some(())
    }

    #[inline(always)]
    fn varyings(&self) -> Option<&[A::Value; 3]> {
        self.values.as_ref()
    }
}

impl<'a, A: Attributes<Value = Vec4>> Projected<'a, A> {
    /// Vertices that were [projected](crate::Rasterizer::project) in parts, by several threads, each into its part of
    /// the memory.
    ///
    /// # Errors
    /// When there are fewer vertices than positions.
    ///
    /// # Examples
    /// ```
    /// # use glam::Vec4;
    /// # use halfplane::{Projected, ProjectedVertex, Rasterizer, Viewport};
    /// let rasterizer = Rasterizer::<()>::new(Viewport::of_size(64, 64)?);
    /// let positions = [Vec4::W; 100];
    /// let mut room = [ProjectedVertex::default(); 100];
    /// std::thread::scope(|scope| {
    ///     for (positions, room) in positions.chunks(50).zip(room.chunks_mut(50)) {
    ///         scope.spawn(move || rasterizer.project(positions, room).map(drop));
    ///     }
    /// });
    /// let projected = Projected::new(&room, &positions)?;
    /// assert_eq!(projected.vertices()[99].position_subpixel(), Some([32 * 256, 32 * 256]));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn new(vertices: &'a [ProjectedVertex], positions: A) -> Result<Self, DrawError> {
        let count = positions.len();
        let error = DrawError::TooFewProjected { positions: count, room: vertices.len() };
        let vertices = vertices.get(..count).ok_or(error)?;
        Ok(Self { vertices, positions })
    }
}

/// The triangles of a draw, or why it cannot be done.
pub(crate) fn checked_triangles<'a, I: Index>(
    primitives: Primitives<'a, I>,
    positions: &impl Positions,
    varyings: &impl Attributes,
) -> Result<Triangles<'a, I>, DrawError> {
    let (positions, varyings) = (positions.count(), varyings.len());
    if primitives.indices.is_none() && positions == usize::MAX {
        return Err(DrawError::Endless);
    }
    if varyings < positions {
        return Err(DrawError::TooFewVaryings { positions, varyings });
    }
    match primitives.first_out_of_range(positions) {
        Some((position, index)) => Err(DrawError::IndexOutOfRange { position, index, vertices: positions }),
        None => Ok(primitives.triangles(positions)),
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::depth::ReadOnly;
    use crate::primitive::Primitives;
    use crate::target::Surface;
    use std::vec::Vec;

    /// Random numbers from 0 to 1.
    fn random(mut state: u32) -> impl FnMut() -> f32 {
        move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 16_777_216.0
        }
    }

    #[test]
    fn many_triangles_are_drawn_as_each_alone() {
        // More than are looked at together. Of a few, and in the second round of many, a vertex lies behind the eye.
        let mut next = random(3);
        for every in [150, 9] {
            let positions: Vec<Vec4> = (0..600)
                .map(|i| {
                    let w = if i % every == 0 { -0.5 } else { 0.1 } + next();
                    Vec4::new(next() * 2.0 - 1.0, next() * 2.0 - 1.0, w * next(), w)
                })
                .collect();
            let rasterizer = Rasterizer::<()>::new(Viewport::of_size(61, 47).expect("valid"));
            let mut room = [ProjectedVertex::default(); 600];
            let projected = rasterizer.project(&positions[..], &mut room).expect("enough");
            let (mut apart, mut expected) = ([0u32; 61 * 47], Statistics::default());
            let mut depths = [1.0f32; 61 * 47];
            for (number, triangle) in (0u32..).zip(positions.chunks_exact(3)) {
                let mut target = Surface::new(&mut apart, &mut depths, 61, 47).expect("it fits");
                let drawn = rasterizer.draw(&mut target, Primitives::list(), triangle, (), |_| number);
                expected += drawn.expect("as many varyings as needed");
            }
            let some = 1..150;
            assert!(some.contains(&expected.clipped) && expected.samples_passed > 1000, "{expected:?}");
            let (mut together, mut other_depths) = ([0u32; 61 * 47], [1.0f32; 61 * 47]);
            let mut target = Surface::new(&mut together, &mut other_depths, 61, 47).expect("it fits");
            let number = |fragment: Fragment<'_, ()>| fragment.primitive_index();
            let found = rasterizer.draw(&mut target, Primitives::list(), projected, (), number);
            assert_eq!(found, Ok(expected), "statistics");
            assert!(together == apart && other_depths == depths, "the picture");
        }
    }

    #[test]
    fn draw_depth_leaves_the_depths_of_draw() {
        // Minute, small and large, over the right border, beyond the viewport, with a scissor inside.
        let mut next = random(1);
        let positions: Vec<Vec4> = (0..600)
            .flat_map(|i| {
                let size = [2.0, 0.2, 0.03, 0.04][i / 64 % 4];
                let (x, y) = (next() * 2.2 - 1.1, next() * 2.2 - 1.1);
                [(); 3].map(|()| {
                    Vec4::new(x + size * (next() - 0.5), y + size * (next() - 0.5), next(), 1.0)
                        * (0.5 + next())
                })
            })
            .collect();
        let mut rasterizer = Rasterizer::<()>::new(Viewport::of_size(61, 47).expect("valid"));
        rasterizer.depth_bias = DepthBias { constant: 3.0, slope: 0.5, clamp: 0.0 };
        for scissor in [None, Some(Rect { x: 5, y: 3, width: 37, height: 29 })] {
            rasterizer.scissor = scissor;
            let (mut shaded, mut alone) = ([u16::MAX; 61 * 47], [u16::MAX; 61 * 47]);
            let mut target = Surface::depth_only(&mut shaded, 61, 47).expect("it fits");
            let expected = rasterizer.draw(&mut target, Primitives::list(), &positions[..], (), |_| ());
            let mut target = Surface::depth_only(&mut alone, 61, 47).expect("it fits");
            let found = rasterizer.draw_depth(&mut target, Primitives::list(), &positions[..]);
            assert_eq!(found, expected, "statistics");
            assert!(expected.is_ok_and(|statistics| statistics.samples_passed > 1000), "something is drawn");
            assert!(shaded == alone, "depths");

            let mut untouched = [u16::MAX; 61 * 47];
            let mut target = Surface::depth_only(&mut untouched, 61, 47).expect("it fits");
            let tests = rasterizer.with_depth_test(ReadOnly(Less));
            let all = tests.draw_depth(&mut target, Primitives::list(), &positions[..]);
            assert!(untouched == [u16::MAX; 61 * 47], "only read");
            let passed =
                |result: Result<Statistics, _>| result.map_or(0, |statistics| statistics.samples_passed);
            assert!(passed(all) > passed(found), "nothing hides anything");
        }
    }
}
