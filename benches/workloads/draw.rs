//! How this crate draws a workload, as a renderer's author would write it: a mesh in one draw call, and a few large
//! triangles, or many that are blended, in tiles that fit in the cache.

use core::ops::Range;

use halfplane::glam::{Vec2, Vec4};
use halfplane::{
    Attributes, Binned, CoarseDepth, Columns, Computed, CullMode, Fragment, Framebuffer, Grid, IndexBuffer,
    Less, Primitives, ProjectedVertex, Rasterizer, Record, Rect, Statistics, Surface, Varyings, Viewport,
};

use crate::workloads::{
    CLEAR_COLOR, CLEAR_DEPTH, HEIGHT, Lit, Shading, WIDTH, Workload, blend, checker, lit_checker, lit_place,
    lit_texture,
};

halfplane::varyings!(Lit { normal, uv });

/// A frame that the workloads fit in, and room for their vertices and triangles.
pub struct Canvas {
    pub color: Vec<u32>,
    pub depth: Vec<f32>,
    bounds: Vec<f32>,
    indices: IndexBuffer<Vec<u32>>,
    room: Vec<ProjectedVertex>,
    checkers: InTiles<Vec2>,
    blended: InTiles<[f32; 4]>,
    /// Whether tiles may be read before they are drawn: see [`Rasterizer::prefetch`].
    pub prefetches: bool,
}

/// The pixels of some rows, with coarse depth.
type Target<'a> = CoarseDepth<'a, Surface<&'a mut [u32], &'a mut [f32]>>;

impl Canvas {
    /// A frame to be cleared.
    pub fn new() -> Self {
        let pixels = WIDTH as usize * HEIGHT as usize;
        let bounds = CoarseDepth::bounds_len(Rect::of_size(WIDTH, HEIGHT));
        Self {
            color: vec![0; pixels],
            depth: vec![0.0; pixels],
            bounds: vec![0.0; bounds],
            indices: IndexBuffer::new(Vec::new()),
            room: Vec::new(),
            checkers: InTiles::new(BAND),
            blended: InTiles::new(TILE),
            prefetches: true,
        }
    }

    /// What a renderer does when it loads a mesh: its indices in a buffer, and room for its vertices and triangles.
    pub fn prepare(&mut self, workload: &Workload) {
        self.indices = IndexBuffer::new(workload.indices.clone());
        self.room.resize(workload.positions.len(), ProjectedVertex::default());
        match workload.shading {
            Shading::Checker(_) => self.checkers.prepare(workload),
            Shading::Blend(_) => self.blended.prepare(workload),
            _ => {}
        }
    }

    pub fn clear(&mut self) {
        self.color.fill(CLEAR_COLOR);
        self.depth.fill(CLEAR_DEPTH);
        self.bounds.fill(CLEAR_DEPTH);
    }

    /// Draws into all rows, or some; every vertex is transformed and projected first, once.
    #[cfg_attr(feature = "dispatch", inline(always))]
    pub fn draw(&mut self, workload: &Workload, rows: Range<u32>) -> Statistics {
        let target = target(&mut self.color, &mut self.depth, &mut self.bounds, rows);
        let (primitives, room) = (Primitives::list().indexed_by(&self.indices), &mut self.room[..]);
        let prefetches = self.prefetches;
        let scene = Scene { workload, target, primitives, room, prefetches };
        // Where a draw is dispatched, each closure is used in several functions; the attribute brings it into all of them.
        match &workload.shading {
            Shading::DepthOnly => scene.draw_depth(),
            Shading::LitChecker(varyings) => scene.draw(
                varyings.as_slice(),
                #[inline(always)]
                |fragment| lit_checker(fragment.varyings()),
            ),
            Shading::LitTexture(varyings, texture) => scene.draw_staged(
                varyings.as_slice(),
                #[inline(always)]
                |fragment| {
                    let (dx, dy) = (fragment.varyings_dx().uv, fragment.varyings_dy().uv);
                    lit_place(fragment.varyings(), dx, dy)
                },
                #[inline(always)]
                |place| lit_texture(texture, place),
            ),
            Shading::Checker(uvs) => self.checkers.draw(
                scene,
                uvs.as_slice(),
                #[inline(always)]
                |rasterizer, target, triangles| {
                    rasterizer.draw_prepared(
                        target,
                        triangles,
                        #[inline(always)]
                        |fragment| checker(fragment.varyings()),
                    )
                },
            ),
            Shading::Blend(colors) => self.blended.draw(
                scene,
                Computed::new(colors.len(), |i| colors[i].to_array()),
                #[inline(always)]
                |rasterizer, target, triangles| {
                    rasterizer.draw_prepared_over(
                        target,
                        triangles,
                        #[inline(always)]
                        |fragment, under| blend(fragment.varyings(), under),
                    )
                },
            ),
        }
    }
}

/// Some rows of a frame.
fn target<'a>(
    color: &'a mut [u32],
    depth: &'a mut [f32],
    bounds: &'a mut [f32],
    rows: Range<u32>,
) -> Target<'a> {
    let area = Rect { x: 0, y: rows.start as i32, width: WIDTH, height: rows.end - rows.start };
    let skipped = CoarseDepth::bounds_len(Rect::of_size(WIDTH, rows.start));
    let pixels = (rows.start * WIDTH) as usize..(rows.end * WIDTH) as usize;
    let (color, depth) = (&mut color[pixels.clone()], &mut depth[pixels]);
    let surface = Surface::with_planes(color, depth, area, WIDTH as usize).expect("slices of this size");
    CoarseDepth::new(surface, &mut bounds[skipped..], Less).expect("enough for all")
}

/// What is drawn, where to, and room for its vertices.
struct Scene<'a> {
    workload: &'a Workload,
    target: Target<'a>,
    primitives: Primitives<'a>,
    room: &'a mut [ProjectedVertex],
    prefetches: bool,
}

impl Scene<'_> {
    /// One draw call.
    #[cfg_attr(feature = "dispatch", inline(always))]
    fn draw<V: Varyings>(
        mut self,
        varyings: impl Attributes<Value = V>,
        shade: impl FnMut(Fragment<'_, V>) -> u32,
    ) -> Statistics {
        let rasterizer = rasterizer(self.workload);
        let vertices = rasterizer.project(positions(self.workload), self.room).expect("prepared");
        rasterizer.draw(&mut self.target, self.primitives, vertices, varyings, shade).expect("valid indices")
    }

    /// One draw call with two closures.
    #[cfg_attr(feature = "dispatch", inline(always))]
    fn draw_staged<V: Varyings, M: Columns>(
        mut self,
        varyings: impl Attributes<Value = V>,
        first: impl Fn(Fragment<'_, V>) -> M,
        second: impl Fn(M) -> u32,
    ) -> Statistics {
        let rasterizer = rasterizer(self.workload);
        let vertices = rasterizer.project(positions(self.workload), self.room).expect("prepared");
        let staged = rasterizer.staged(first);
        staged.draw(&mut self.target, self.primitives, vertices, varyings, second).expect("valid indices")
    }

    /// One draw call without colour.
    #[cfg_attr(feature = "dispatch", inline(always))]
    fn draw_depth(mut self) -> Statistics {
        let rasterizer = rasterizer::<()>(self.workload);
        let vertices = rasterizer.project(positions(self.workload), self.room).expect("prepared");
        rasterizer.draw_depth(&mut self.target, self.primitives, vertices).expect("valid indices")
    }
}

/// For triangles that are wide: with colour and depth, a megabyte.
const BAND: (u32, u32) = (WIDTH, 64);

/// For small ones: the higher tiles are, the more triangles touch a single one. 655 kilobytes.
const TILE: (u32, u32) = (640, 128);

/// So many triangles lie here and there in a tile, which is worth reading before. Rows of a few large ones are in order already.
const SCATTERED: usize = 20;

/// A frame's tiles, and room for triangles and for the numbers of those that touch each tile.
struct InTiles<V> {
    grid: Grid,
    records: Vec<Record<V>>,
    memory: Vec<u32>,
}

impl<V: Varyings + Default> InTiles<V> {
    fn new((width, height): (u32, u32)) -> Self {
        let grid = Grid::new(Rect::of_size(WIDTH, HEIGHT), width, height).expect("a small frame");
        Self { grid, records: Vec::new(), memory: Vec::new() }
    }

    /// Most triangles touch a tile or two; if there are few, each may touch all.
    fn prepare(&mut self, workload: &Workload) {
        let (triangles, tiles) = (workload.indices.len() / 3, self.grid.len());
        self.records.resize(triangles, Record::default());
        self.memory.resize(Grid::bin_memory(tiles, tiles * triangles.min(1000) + 2 * triangles), 0);
    }

    /// Tile by tile: each is in the cache while all triangles that touch it are drawn. Where every pixel is read and written
    /// several times, that saves up to half of the time; reading the tile in order first, up to a twelfth more.
    #[cfg_attr(feature = "dispatch", inline(always))]
    fn draw(
        &mut self,
        Scene { workload, mut target, primitives, room, prefetches }: Scene<'_>,
        varyings: impl Attributes<Value = V>,
        draw: impl Fn(&Rasterizer<V>, &mut Target<'_>, Binned<'_, '_, V>) -> Statistics,
    ) -> Statistics {
        let mut rasterizer = rasterizer(workload);
        let vertices = rasterizer.project(positions(workload), room).expect("prepared");
        let mut preparation =
            rasterizer.prepare(target.area(), primitives, vertices, varyings).expect("valid indices");
        let mut statistics = Statistics::default();
        while let Some(mut batch) = preparation.fill(&mut self.records).expect("there is room") {
            while !batch.is_empty() {
                let bins = rasterizer.bin(&self.grid, batch, &mut self.memory).expect("long enough");
                for (index, tile) in self.grid.tiles().enumerate() {
                    let triangles = bins.tile(index);
                    rasterizer.scissor = Some(tile);
                    if prefetches && triangles.len() >= SCATTERED {
                        rasterizer.prefetch(&mut target);
                    }
                    statistics += draw(&rasterizer, &mut target, triangles);
                }
                batch = bins.rest();
            }
        }
        statistics += preparation.statistics();
        statistics
    }
}

fn rasterizer<V: Varyings>(workload: &Workload) -> Rasterizer<V> {
    let mut rasterizer = Rasterizer::new(Viewport::of_size(WIDTH, HEIGHT).expect("a small size"));
    rasterizer.cull_mode = if workload.cull_back { CullMode::Back } else { CullMode::None };
    rasterizer
}

/// The vertex shader.
fn positions(workload: &Workload) -> impl Attributes<Value = Vec4> {
    Computed::new(workload.positions.len(), |i| workload.transform * workload.positions[i].extend(1.0))
}
