//! The hub: state, and the way of a triangle through all the other rooms.

use core::fmt;
use core::marker::PhantomData;

use crate::clip::{Corner, DepthClip, Polygon};
use crate::depth::{DepthBias, DepthFormat, DepthTest, Less, clamp};
use crate::fragment::{Fragment, Identity, Pedigree, Shading};
use crate::interpolate::{Varyings, Weights};
use crate::primitive::{Index, Primitives, ProvokingVertex, Triangle};
use crate::project::{Positions, Projected, ProjectedVertex, Projector, is_invalid};
use crate::setup::{Setup, sample_bounds, signed_area2};
use crate::target::{Framebuffer, Rect};
use crate::traverse::Span;
use crate::vertex::Attributes;
use crate::viewport::{ClipDepth, Viewport};
use glam::Vec4;

/// Which triangles are left out by the side that they show (`VkCullModeFlags`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum CullMode {
    /// None is left out.
    #[default]
    None,
    /// Those that show their front.
    Front,
    /// Those that show their back: half the work for closed meshes.
    Back,
}

/// Which way the vertices of a triangle turn, as displayed, when it shows its front (`VkFrontFace`).
///
/// Judged after rounding to the subpixel grid, by the sign of the exact area.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum FrontFace {
    /// Counter-clockwise.
    #[default]
    CounterClockwise,
    /// Clockwise.
    Clockwise,
}

/// What a draw did.
///
/// ```text
///   primitives = invalid + outside + culled + degenerate + those that were traversed
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Statistics {
    /// Triangles that primitive assembly made.
    pub primitives: u64,
    /// Triangles skipped because a coordinate was NaN, infinite or beyond 2¹⁰⁰.
    pub invalid: u64,
    /// Triangles wholly outside one plane of the clip volume.
    pub outside: u64,
    /// Triangles that were cut by a plane of the clip volume or the guard band.
    pub clipped: u64,
    /// Triangles left out by [`CullMode`].
    pub culled: u64,
    /// Triangles without area on the subpixel grid.
    pub degenerate: u64,
    /// Fragments that passed the depth test and were shaded: how often the closure ran.
    pub fragments: u64,
    /// Fragments that were not discarded either: an occlusion query's answer.
    pub samples_passed: u64,
}

impl core::ops::AddAssign for Statistics {
    fn add_assign(&mut self, other: Self) {
        self.primitives += other.primitives;
        self.invalid += other.invalid;
        self.outside += other.outside;
        self.clipped += other.clipped;
        self.culled += other.culled;
        self.degenerate += other.degenerate;
        self.fragments += other.fragments;
        self.samples_passed += other.samples_passed;
    }
}

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
/// let (mut pixels, mut depth) = ([0u32; 64 * 64], [0.0f32; 64 * 64]);
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
    /// Nothing is drawn outside of it.
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
    pub fn render_area(&self, target: &impl Framebuffer) -> Rect {
        let area = self.viewport.pixels().intersection(target.area());
        self.scissor.map_or(area, |scissor| area.intersection(scissor))
    }

    /// Projects every vertex once, into memory of the caller's, for draws that use vertices several times.
    ///
    /// Without it, an indexed draw projects a vertex anew unless the triangle before used it too.
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
        for (index, vertex) in vertices.iter_mut().enumerate() {
            if let Some(position) = positions.fetch(index) {
                *vertex = projector.project(position);
            }
        }
        Ok(Projected { vertices, positions })
    }

    fn projector(&self) -> Projector {
        Projector::new(&self.viewport, self.clip_depth, self.depth_clip)
    }

    /// Draws triangles. The closure gives each fragment its colour, or an `Option` of it: `None` discards the fragment,
    /// and its depth is then not written either.
    ///
    /// * `positions`: in clip space, as [`Attributes`] or [`Projected`] by [`project`](Self::project).
    /// * `varyings`: as many as there are positions, or a constant.
    ///
    /// The closure runs once for each fragment that passes the depth test, triangle by triangle, rows from the top, left
    /// to right. Without branches and float-to-integer `as` in it, the compiler makes SIMD of it.
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
        self.draw_over(target, primitives, positions, varyings, move |fragment, _| shade(fragment))
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
        mut shade: S,
    ) -> Result<Statistics, DrawError>
    where
        F: Framebuffer,
        I: Index,
        P: Positions,
        A: Attributes<Value = V>,
        S: FnMut(Fragment<'_, V>, F::Color) -> R,
        R: Into<Option<F::Color>>,
    {
        let count = vertex_count(&primitives, &positions, &varyings)?;
        let area = self.render_area(target);
        let projector = self.projector();
        let mut statistics = Statistics::default();
        // Strips, fans and tidy meshes name a vertex again at once: the triangle before is all the cache they need.
        let mut before = [(usize::MAX, ProjectedVertex::default()); 3];
        for triangle in primitives.triangles(count) {
            let primitive = statistics.primitives;
            statistics.primitives += 1;

            // Project, or find what was projected.
            let fetch = |index: usize| {
                positions
                    .projected(index)
                    .or_else(|| before.iter().find(|(i, _)| *i == index).map(|(_, vertex)| *vertex))
                    .or_else(|| positions.clip(index).map(|position| projector.project(position)))
                    .unwrap_or_default()
            };
            let vertices = triangle.vertices.map(fetch);
            let [i, j, k] = triangle.vertices;
            before = [(i, vertices[0]), (j, vertices[1]), (k, vertices[2])];

            // Clip, if it must be.
            let mut pieces = if vertices.iter().any(|vertex| vertex.is_outside()) {
                match Pieces::clip(&projector, vertices, triangle.vertices.map(|i| positions.clip(i))) {
                    Ok(pieces) => {
                        statistics.clipped += 1;
                        pieces
                    }
                    Err(Rejected::Invalid) => {
                        statistics.invalid += 1;
                        continue;
                    }
                    Err(Rejected::Outside) => {
                        statistics.outside += 1;
                        continue;
                    }
                }
            } else {
                Pieces::whole(vertices)
            };

            // Cull by the sign of the exact area.
            if pieces.area2 == 0 {
                statistics.degenerate += 1;
                continue;
            }
            let is_front_facing = self.is_front_facing(pieces.area2);
            if self.culls(is_front_facing) {
                statistics.culled += 1;
                continue;
            }

            let identity = self.identity(triangle, is_front_facing, primitive);
            while let Some((vertices, area2)) = pieces.next() {
                // Most small triangles miss every sample: find out before anything is divided.
                let [a, b, c] = vertices;
                let [left, top, right, bottom] = sample_bounds(a, b, c);
                let misses = left.max(area.x) >= right.min(area.right())
                    || top.max(area.y) >= bottom.min(area.bottom());
                if misses {
                    continue;
                }
                let setup = Setup::with_area2(vertices, area2);
                let [Some(a), Some(b), Some(c)] = triangle.vertices.map(|i| varyings.fetch(i)) else {
                    continue;
                };
                let values = pieces.varyings([a, b, c], identity.provoking);
                let shading = Shading::new(&setup, values, identity, pieces.pedigree());
                let plane =
                    DepthPlane::new::<F::Depth>(&setup, self.depth_bias, self.viewport.depth_limits());
                setup.for_each_span(area, |span| {
                    shade_span(target, &span, &shading, &plane, self.depth_test, &mut statistics, &mut shade);
                });
            }
        }
        Ok(statistics)
    }

    fn is_front_facing(&self, area2: i64) -> bool {
        (area2 < 0) == (self.front_face == FrontFace::CounterClockwise)
    }

    fn culls(&self, is_front_facing: bool) -> bool {
        match self.cull_mode {
            CullMode::None => false,
            CullMode::Front => is_front_facing,
            CullMode::Back => !is_front_facing,
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "documented to count modulo 2³²")]
    fn identity(&self, triangle: Triangle, is_front_facing: bool, primitive: u64) -> Identity {
        let provoking = match self.provoking_vertex {
            ProvokingVertex::First => 0,
            ProvokingVertex::Last => triangle.last_provoking,
        };
        Identity { provoking, is_front_facing, primitive: primitive as u32 }
    }
}

/// How many vertices a draw may use, or why it cannot be done.
fn vertex_count<I: Index>(
    primitives: &Primitives<'_, I>,
    positions: &impl Positions,
    varyings: &impl Attributes,
) -> Result<usize, DrawError> {
    let (positions, varyings) = (positions.count(), varyings.len());
    if primitives.indices.is_none() && positions == usize::MAX {
        return Err(DrawError::Endless);
    }
    if varyings < positions {
        return Err(DrawError::TooFewVaryings { positions, varyings });
    }
    match primitives.first_out_of_range(positions) {
        Some((position, index)) => Err(DrawError::IndexOutOfRange { position, index, vertices: positions }),
        None => Ok(positions),
    }
}

/// What is drawn of a triangle: itself, or the fan of triangles that clipping leaves.
struct Pieces {
    /// The next piece is corners 0, `next` and `next + 1`.
    next: usize,
    whole: [ProjectedVertex; 3],
    clipped: Option<Clipped>,
    /// Twice the signed area of all of it.
    area2: i64,
}

struct Clipped {
    polygon: Polygon,
    projector: Projector,
    /// The w of the vertices.
    w: [f32; 3],
}

enum Rejected {
    Invalid,
    Outside,
}

impl Pieces {
    #[inline(always)]
    fn whole(vertices: [ProjectedVertex; 3]) -> Self {
        let [a, b, c] = vertices;
        Self { next: 1, whole: vertices, clipped: None, area2: signed_area2(a, b, c) }
    }

    #[cold]
    #[inline(never)]
    fn clip(
        projector: &Projector,
        vertices: [ProjectedVertex; 3],
        positions: [Option<Vec4>; 3],
    ) -> Result<Self, Rejected> {
        let outcodes = vertices.map(|vertex| vertex.outcode());
        let union = outcodes[0] | outcodes[1] | outcodes[2];
        let [Some(a), Some(b), Some(c)] = positions else { return Err(Rejected::Invalid) };
        if is_invalid(union) {
            return Err(Rejected::Invalid);
        }
        if outcodes[0] & outcodes[1] & outcodes[2] != 0 {
            return Err(Rejected::Outside);
        }
        let triangle = projector.triangle_to_clip([a, b, c]);
        let polygon = projector.volume.clip(triangle, union);
        let clipped = Clipped { polygon, projector: *projector, w: triangle.map(|p| p.w) };
        let mut pieces = Self { next: 1, whole: vertices, clipped: Some(clipped), area2: 0 };
        if pieces.piece(1).is_none() {
            return Err(Rejected::Outside);
        }
        for next in 1.. {
            let Some([a, b, c]) = pieces.piece(next) else { break };
            pieces.area2 += signed_area2(a, b, c);
        }
        Ok(pieces)
    }

    /// The corners of a piece of a clipped triangle.
    fn corners(&self, next: usize) -> Option<[&Corner; 3]> {
        let corners = self.clipped.as_ref()?.polygon.corners();
        Some([corners.first()?, corners.get(next)?, corners.get(next + 1)?])
    }

    fn piece(&self, next: usize) -> Option<[ProjectedVertex; 3]> {
        let projector = self.clipped.as_ref()?.projector;
        Some(self.corners(next)?.map(|corner| projector.project_clipped(corner.position)))
    }

    /// The next piece and twice its signed area, which has the sign of the whole.
    #[inline(always)]
    fn next(&mut self) -> Option<([ProjectedVertex; 3], i64)> {
        if self.clipped.is_none() {
            let is_first = self.next == 1;
            self.next += 1;
            return is_first.then_some((self.whole, self.area2));
        }
        loop {
            let piece @ [a, b, c] = self.piece(self.next)?;
            self.next += 1;
            // Rounding can turn a sliver over. It belongs to its neighbours then.
            let area2 = signed_area2(a, b, c);
            if area2.signum() == self.area2.signum() {
                return Some((piece, area2));
            }
        }
    }

    /// The weights of the piece given last, if there is anything to tell.
    #[inline(always)]
    fn pedigree(&self) -> Option<Pedigree> {
        let w = self.clipped.as_ref()?.w;
        Some(Pedigree { weights: self.corners(self.next - 1)?.map(|corner| corner.weights), w })
    }

    /// The values at the corners of the piece given last.
    #[inline(always)]
    fn varyings<V: Varyings>(&self, values: [V; 3], provoking: u8) -> [V; 3] {
        let (Some(clipped), Some(corners)) = (&self.clipped, self.corners(self.next - 1)) else {
            return values;
        };
        corners.map(|corner| {
            let weights = Weights::new(corner.weights, corner.barycentrics(clipped.w), provoking);
            V::interpolate(&values, &weights)
        })
    }
}

/// A triangle's depth: linear on the screen.
struct DepthPlane {
    /// At corner 2; and what corners 0 and 1 have more.
    z: f32,
    more: [f32; 2],
    inv_area2: f32,
    /// Change by a pixel to the right.
    step_x: f32,
    limits: (f32, f32),
}

impl DepthPlane {
    #[inline(always)]
    fn new<D: DepthFormat>(setup: &Setup, bias: DepthBias, limits: (f32, f32)) -> Self {
        let [p, q, r] = setup.corners().map(|corner| corner.depth());
        let more = [p - r, q - r];
        let inv_area2 = 1.0 / setup.area2() as f32;
        let [edge_0, edge_1, _] = setup.edges().map(|edge| edge.slope());
        let step =
            |i: usize| (edge_0[i] as f32 * 256.0 * more[0] + edge_1[i] as f32 * 256.0 * more[1]) * inv_area2;
        let mut z = r;
        if bias != DepthBias::default() {
            let (dx, dy) = (step(0).abs(), step(1).abs());
            let largest = [q, r].into_iter().fold(p, |a, b| if a > b { a } else { b });
            z += bias.of(if dx > dy { dx } else { dy }, D::resolution(largest));
        }
        Self { z, more, inv_area2, step_x: step(0), limits }
    }

    /// At the anchor of a span.
    #[inline(always)]
    fn at_anchor(&self, span: &Span) -> f32 {
        let [e0, e1, _] = span.edges();
        self.z + (e0 * self.inv_area2) * self.more[0] + (e1 * self.inv_area2) * self.more[1]
    }

    /// `dx` columns right of the anchor, where it is `z`.
    #[inline(always)]
    fn at(&self, z: f32, dx: i32) -> f32 {
        clamp(z + self.step_x * dx as f32, self.limits.0, self.limits.1)
    }
}

/// Fragments are decided on and shaded this many at a time: enough for SIMD, and what the depth test has read is still
/// in the first-level cache when it is written.
const CHUNK: usize = 256;

/// Tests and shades the fragments of a span.
///
/// First the depth test of a whole chunk, which ends in a number. If all fragments pass, as most often, they are shaded
/// in a loop without a condition, which is what the compiler needs to make SIMD of it; if none, the chunk is done; and if
/// some, the same loop runs over each stretch of fragments that pass.
#[inline(always)]
fn shade_span<F, V, T, S, R>(
    target: &mut F,
    span: &Span,
    shading: &Shading<V>,
    plane: &DepthPlane,
    test: T,
    statistics: &mut Statistics,
    shade: &mut S,
) where
    F: Framebuffer,
    V: Varyings,
    T: DepthTest,
    S: FnMut(Fragment<'_, V>, F::Color) -> R,
    R: Into<Option<F::Color>>,
{
    let len = (span.end() - span.start()) as usize;
    let run = target.run(span.start(), span.y(), len);
    let z = plane.at_anchor(span);
    let mut offset = span.start() - span.anchor();
    for (colors, depths) in run.color.chunks_mut(CHUNK).zip(run.depth.chunks_mut(CHUNK)) {
        let len = colors.len().min(depths.len());
        let passes = |column: i32, old: F::Depth| {
            !F::Depth::IS_STORED || test.passes(F::Depth::from_depth(plane.at(z, column)), old)
        };
        let mut passing = 0u32;
        let mut column = offset;
        for &old in depths.iter() {
            passing += u32::from(passes(column, old));
            column = column.wrapping_add(1);
        }
        let mut passing = if F::Depth::IS_STORED { passing as usize } else { len };
        let all = passing == len;
        statistics.fragments += passing as u64;

        let mut end = 0;
        while passing > 0 {
            // The next stretch of fragments that pass.
            let begin = end;
            let find = |from: usize, wanted: bool| {
                let mut column = offset.wrapping_add(from as i32);
                depths.get(from..).unwrap_or_default().iter().position(|&old| {
                    let found = passes(column, old) == wanted;
                    column = column.wrapping_add(1);
                    found
                })
            };
            let begin = if all { begin } else { begin + find(begin, true).unwrap_or(len) };
            end = if all { len } else { find(begin, false).map_or(len, |stretch| begin + stretch) };
            let (Some(colors), Some(depths)) = (colors.get_mut(begin..end), depths.get_mut(begin..end))
            else {
                break;
            };
            passing = passing.saturating_sub(colors.len());

            // Shade them. Both results are selected, not branched on, so that a discard vectorises too.
            let mut column = offset.wrapping_add(begin as i32);
            let mut kept = 0u32;
            for (color, depth) in colors.iter_mut().zip(depths) {
                let z = plane.at(z, column);
                let shaded = shade(Fragment::new(shading, span, column, z), *color).into();
                let is_kept = shaded.is_some();
                *color = shaded.unwrap_or(*color);
                *depth = if is_kept & test.writes() { F::Depth::from_depth(z) } else { *depth };
                kept += u32::from(is_kept);
                column = column.wrapping_add(1);
            }
            statistics.samples_passed += u64::from(kept);
        }
        offset = offset.wrapping_add(len as i32);
    }
}
