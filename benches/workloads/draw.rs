//! How this crate draws a workload, as a renderer's author would write it: one draw call, but for what is blended.

use core::ops::Range;

use halfplane::glam::Vec4;
use halfplane::{
    Attributes, CoarseDepth, Computed, CullMode, Fragment, Framebuffer, Grid, IndexBuffer, Less, Primitives,
    ProjectedVertex, Rasterizer, Record, Rect, Statistics, Surface, Varyings, Viewport,
};

use crate::workloads::{
    CLEAR_COLOR, CLEAR_DEPTH, HEIGHT, Lit, Shading, WIDTH, Workload, blend, checker, lit_checker, lit_texture,
};

halfplane::varyings!(Lit { normal, uv });

/// A frame that the workloads fit in, and room for their vertices.
pub struct Canvas {
    pub color: Vec<u32>,
    pub depth: Vec<f32>,
    bounds: Vec<f32>,
    room: Vec<ProjectedVertex>,
    indices: IndexBuffer<Vec<u32>>,
    /// Triangles of the blended workload.
    records: Vec<Record<[f32; 4]>>,
}

/// Rows of a band: with colour and depth, a megabyte.
const BAND: u32 = 64;

impl Canvas {
    /// A frame to be cleared.
    pub fn new() -> Self {
        let pixels = WIDTH as usize * HEIGHT as usize;
        let bounds = CoarseDepth::bounds_len(Rect::of_size(WIDTH, HEIGHT));
        Self {
            color: vec![0; pixels],
            depth: vec![0.0; pixels],
            bounds: vec![0.0; bounds],
            room: Vec::new(),
            indices: IndexBuffer::new(Vec::new()),
            records: Vec::new(),
        }
    }

    /// What a renderer does when it loads a mesh: room for its vertices, and its indices in a buffer.
    pub fn prepare(&mut self, workload: &Workload) {
        self.indices = IndexBuffer::new(workload.indices.clone());
        self.room.resize(workload.positions.len(), ProjectedVertex::default());
    }

    pub fn clear(&mut self) {
        self.color.fill(CLEAR_COLOR);
        self.depth.fill(CLEAR_DEPTH);
        self.bounds.fill(CLEAR_DEPTH);
    }

    /// Draws into all rows, or some; every vertex is transformed and projected first, once.
    pub fn draw(&mut self, workload: &Workload, rows: Range<u32>) -> Statistics {
        match &workload.shading {
            Shading::DepthOnly => self.draw_depth(workload, rows),
            Shading::Checker(uvs) => {
                self.draw_opaque(workload, rows, uvs.as_slice(), |fragment| checker(fragment.varyings()))
            }
            Shading::LitChecker(varyings) => {
                self.draw_opaque(workload, rows, varyings.as_slice(), |fragment| {
                    lit_checker(fragment.varyings())
                })
            }
            Shading::LitTexture(varyings, texture) => {
                self.draw_opaque(workload, rows, varyings.as_slice(), |fragment| {
                    let (dx, dy) = (fragment.varyings_dx().uv, fragment.varyings_dy().uv);
                    lit_texture(texture, fragment.varyings(), dx, dy)
                })
            }
            Shading::Blend(colors) => self.draw_blended(workload, rows, colors),
        }
    }

    /// One draw call.
    fn draw_opaque<V: Varyings>(
        &mut self,
        workload: &Workload,
        rows: Range<u32>,
        varyings: impl Attributes<Value = V>,
        shade: impl FnMut(Fragment<'_, V>) -> u32,
    ) -> Statistics {
        let (mut target, primitives, room) = self.parts(rows);
        let rasterizer = rasterizer(workload);
        let vertices = rasterizer.project(positions(workload), room).expect("prepared");
        rasterizer.draw(&mut target, primitives, vertices, varyings, shade).expect("valid indices")
    }

    /// Over what is there, band by band: each is in the cache while all triangles that touch it are blended. Where every
    /// pixel is read and written several times, that is half of the time.
    fn draw_blended(&mut self, workload: &Workload, rows: Range<u32>, colors: &[Vec4]) -> Statistics {
        let triangles = workload.indices.len() / 3;
        let mut records = core::mem::take(&mut self.records);
        records.resize(triangles, Record::default());
        let (mut target, primitives, room) = self.parts(rows);
        let grid = Grid::new(target.area(), WIDTH, BAND).expect("a small frame");
        let mut memory = vec![0; Grid::bin_memory(grid.len(), grid.len() + 2 * triangles)];
        let mut rasterizer = rasterizer(workload);
        let vertices = rasterizer.project(positions(workload), room).expect("prepared");
        let colors = Computed::new(colors.len(), |i| colors[i].to_array());
        let shade = |fragment: Fragment<'_, [f32; 4]>, under| blend(fragment.varyings(), under);

        let mut preparation =
            rasterizer.prepare(target.area(), primitives, vertices, colors).expect("valid indices");
        let mut statistics = Statistics::default();
        while let Some(mut batch) = preparation.fill(&mut records).expect("there is room") {
            while !batch.is_empty() {
                let bins = rasterizer.bin(&grid, batch, &mut memory).expect("long enough");
                for (index, band) in grid.tiles().enumerate() {
                    rasterizer.scissor = Some(band);
                    statistics += rasterizer.draw_prepared_over(&mut target, bins.tile(index), shade);
                }
                batch = bins.rest();
            }
        }
        statistics += preparation.statistics();
        drop(target);
        self.records = records;
        statistics
    }

    /// One draw call without colour.
    fn draw_depth(&mut self, workload: &Workload, rows: Range<u32>) -> Statistics {
        let (mut target, primitives, room) = self.parts(rows);
        let rasterizer = rasterizer::<()>(workload);
        let vertices = rasterizer.project(positions(workload), room).expect("prepared");
        rasterizer.draw_depth(&mut target, primitives, vertices).expect("valid indices")
    }

    /// Some rows of the frame, with coarse depth; the triangles; and room for vertices.
    fn parts(
        &mut self,
        rows: Range<u32>,
    ) -> (impl Framebuffer<Color = u32>, Primitives<'_>, &mut [ProjectedVertex]) {
        let area = Rect { x: 0, y: rows.start as i32, width: WIDTH, height: rows.end - rows.start };
        let skipped = Rect::of_size(WIDTH, rows.start);
        let pixels = (rows.start * WIDTH) as usize..(rows.end * WIDTH) as usize;
        let (color, depth) = (&mut self.color[pixels.clone()], &mut self.depth[pixels]);
        let bounds = &mut self.bounds[CoarseDepth::bounds_len(skipped)..];
        let surface = Surface::with_planes(color, depth, area, WIDTH as usize).expect("slices of this size");
        let target = CoarseDepth::new(surface, bounds, Less).expect("enough for all");
        (target, Primitives::list().indexed_by(&self.indices), &mut self.room)
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
