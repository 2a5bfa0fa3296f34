//! How this crate draws a workload: one draw call, as a renderer's author would write it.

use core::ops::Range;

use halfplane::glam::Vec4;
use halfplane::{
    Absent, Attributes, Computed, CullMode, Fragment, Primitives, ProjectedVertex, Rasterizer, Rect,
    Statistics, Surface, Varyings, Viewport,
};

use crate::workloads::{HEIGHT, Lit, Shading, WIDTH, Workload, blend, checker, lit_checker, lit_texture};

halfplane::varyings!(Lit { normal, uv });

/// A frame that the workloads fit in, and room for their vertices.
pub struct Canvas {
    pub color: Vec<u32>,
    pub depth: Vec<f32>,
    room: Vec<ProjectedVertex>,
}

impl Canvas {
    /// An empty frame.
    pub fn new() -> Self {
        let pixels = WIDTH as usize * HEIGHT as usize;
        Self { color: vec![0; pixels], depth: vec![0.0; pixels], room: Vec::new() }
    }

    /// Room for the vertices of a workload.
    pub fn prepare(&mut self, workload: &Workload) {
        self.room.resize(workload.positions.len(), ProjectedVertex::default());
    }

    /// Draws into all rows, or some; every vertex is transformed and projected first, once.
    pub fn draw(&mut self, workload: &Workload, rows: Range<u32>) -> Statistics {
        let pixels = (rows.start * WIDTH) as usize..(rows.end * WIDTH) as usize;
        let area = Rect { x: 0, y: rows.start as i32, width: WIDTH, height: rows.end - rows.start };
        let (color, depth) = (&mut self.color[pixels.clone()], &mut self.depth[pixels]);
        let room = &mut self.room;
        match &workload.shading {
            Shading::DepthOnly => run_depth(workload, depth, area, room),
            Shading::Checker(uvs) => {
                run(workload, (color, depth), area, room, uvs.as_slice(), |fragment, _| {
                    checker(fragment.varyings())
                })
            }
            Shading::LitChecker(varyings) => {
                run(workload, (color, depth), area, room, varyings.as_slice(), |fragment, _| {
                    lit_checker(fragment.varyings())
                })
            }
            Shading::LitTexture(varyings, texture) => {
                run(workload, (color, depth), area, room, varyings.as_slice(), |fragment, _| {
                    let (dx, dy) = (fragment.varyings_dx().uv, fragment.varyings_dy().uv);
                    lit_texture(texture, fragment.varyings(), dx, dy)
                })
            }
            Shading::Blend(colors) => {
                let colors = Computed::new(colors.len(), |i| colors[i].to_array());
                run(workload, (color, depth), area, room, colors, |fragment, under| {
                    blend(fragment.varyings(), under)
                })
            }
        }
    }
}

/// One draw call.
fn run<V: Varyings, R: Into<Option<u32>>>(
    workload: &Workload,
    (color, depth): (&mut [u32], &mut [f32]),
    area: Rect,
    room: &mut [ProjectedVertex],
    varyings: impl Attributes<Value = V>,
    shade: impl FnMut(Fragment<'_, V>, u32) -> R,
) -> Statistics {
    let mut target = Surface::with_planes(color, depth, area, WIDTH as usize).expect("slices of this size");
    let rasterizer = rasterizer(workload);
    let vertices = rasterizer.project(positions(workload), room).expect("prepared");
    let primitives = Primitives::list().indexed(&workload.indices);
    rasterizer.draw_over(&mut target, primitives, vertices, varyings, shade).expect("valid indices")
}

/// One draw call without colour.
fn run_depth(workload: &Workload, depth: &mut [f32], area: Rect, room: &mut [ProjectedVertex]) -> Statistics {
    let mut target =
        Surface::with_planes(Absent::default(), depth, area, WIDTH as usize).expect("a slice of this size");
    let rasterizer = rasterizer::<()>(workload);
    let vertices = rasterizer.project(positions(workload), room).expect("prepared");
    let primitives = Primitives::list().indexed(&workload.indices);
    rasterizer.draw_depth(&mut target, primitives, vertices).expect("valid indices")
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
